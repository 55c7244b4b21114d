"""Missions in evaluations: workers, isolation, resuming, shards, and their columns."""

import functools
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import beacon_mj as bmj
from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import (
    RunConfig,
    SceneRef,
    family_scenes,
    generated_scenes,
)
from beacon_mj.eval.runs.jobs import Attempt, Job
from beacon_mj.eval.runs.lineup import planner_entries
from beacon_mj.eval.runs.missions import by_mission, share_missions
from beacon_mj.eval.runs.run_folder import RunFolder, load_rows
from beacon_mj.eval.runs.runner import plan, rescued, resumable, run_jobs
from beacon_mj.eval.runs.shards import Shard
from beacon_mj.eval.runs.versions import versions
from beacon_mj.eval.statistics.clusters import sign_flip_test
from beacon_mj.eval.statistics.intervals import mcnemar

NAMES = ["beacon", "push-through"]
PATIENT = ["protocol.decision_limit_s=3600"]


def config(scenes: int = 6) -> tuple[RunConfig, list[SceneRef]]:
    entries, protocol = planner_entries(NAMES, PATIENT)
    hashes, refs = generated_scenes(["revisited-rooms"], scenes, None)
    made = RunConfig(
        planners=entries,
        families=hashes,
        scenes=family_scenes(hashes, refs, None),
        scenes_per_family=scenes,
        seed=1000,
        perception="noisy",
        scene_dir=None,
        templates=None,
        protocol=protocol,
        log="none",
        versions=versions(),
    )
    return made, refs


@functools.cache
def whole() -> tuple[Row, ...]:
    made, refs = config()
    rows = [row for new in run_jobs(made, plan(made, refs)) for row in new]
    return tuple(sorted(rows, key=lambda row: row.key))


def timeless(rows: list[Row] | tuple[Row, ...]) -> list[dict[str, object]]:
    ordered = sorted(rows, key=lambda row: row.key)
    return [
        {k: v for k, v in row.as_dict().items() if k not in WALL_CLOCK_COLUMNS}
        for row in ordered
    ]


def test_rows_name_mission_and_day_after_the_index() -> None:
    assert [(r.mission, r.day) for r in whole()[:6]] == [
        (m, d) for m in range(2) for d in range(3)
    ]
    index = Row.__struct_fields__.index("scene_index")
    assert Row.__struct_fields__[index + 1 : index + 3] == ("mission", "day")


@settings(max_examples=8, deadline=None)
@given(st.sets(st.integers(0, 11)))
def test_a_run_goes_on_from_any_rows_to_the_same_rows(done: set[int]) -> None:
    made, refs = config()
    before = [whole()[k] for k in sorted(done)]
    jobs = plan(made, refs, before)
    kept = resumable(jobs, before)
    new = [row for rows in run_jobs(made, jobs) for row in rows]
    assert timeless([*kept, *new]) == timeless(whole())


def test_a_half_finished_mission_leaves_no_row_twice(tmp_path: Path) -> None:
    made, _ = config()
    folder = RunFolder(tmp_path / "run")
    folder.create(made)
    folder.append(whole()[:4])  # The second mission of beacon is one day old.
    folder.close()
    results = bmj.evaluate(
        NAMES,
        families=["revisited-rooms"],
        scenes_per_family=6,
        seed=1000,
        settings=PATIENT,
        workers=1,
        log="none",
        out=tmp_path / "run",
        resume=True,
    )
    assert timeless(results.episodes) == timeless(whole())
    assert len((tmp_path / "run/episodes.jsonl").read_text().splitlines()) == 12
    assert timeless(load_rows(tmp_path / "run")) == timeless(whole())
    missions = results.missions()
    assert missions["days"].to_list() == [3, 3, 3, 3]
    assert missions["steps"].to_list() == [
        sum(row.steps for row in whole()[k : k + 3]) for k in (0, 3, 6, 9)
    ]


def test_an_isolated_planner_remembers_as_any_other(tmp_path: Path) -> None:
    results = bmj.evaluate(
        ["beacon"],
        families=["revisited-rooms"],
        scenes_per_family=6,
        seed=1000,
        settings=PATIENT,
        workers=2,
        isolate=True,
        log="none",
        out=tmp_path / "run",
    )
    assert timeless(results.episodes) == timeless(whole()[:6])


def test_scenes_must_be_whole_missions(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="which have 3 days, such as 6 or 9"):
        generated_scenes(["revisited-rooms"], 7, None)
    bmj.generate_scenes(tmp_path, families=["revisited-rooms"], scenes_per_family=2)
    with pytest.raises(RunError, match="expected all 3 days of mission 0"):
        bmj.evaluate(["beacon"], scene_dir=tmp_path, out=tmp_path / "run")


@given(st.integers(1, 5))
def test_shards_split_no_mission(of: int) -> None:
    refs = [SceneRef("a", i, mission=i // 3) for i in range(18)]
    shares = [share_missions(refs, Shard(k, of)) for k in range(1, of + 1)]
    assert sorted(r.index for own in shares for r in own) == [*range(18)]
    for own in shares:
        assert all(len(days) == 3 for days in by_mission(own))


@given(st.sets(st.integers(0, 3)))
def test_only_deadly_days_are_lost(deadly: set[int]) -> None:
    """A process dies on the deadly days; what lives keeps the rows of its own days."""
    made, _ = config()
    refs = tuple(SceneRef("revisited-rooms", i, mission=0) for i in range(3))
    rows = {row.scene_index: row for row in whole()[:3]}

    def attempt(job: Job) -> Attempt | None:
        if any(ref.index in deadly for ref in job.refs):
            return None
        return Attempt([rows[ref.index] for ref in job.refs], [])

    found = rescued(made, Job(refs, ("beacon",)), attempt, "it died")
    assert [row.scene_index for row in found.rows] == [0, 1, 2]
    lost = {row.scene_index for row in found.rows if row.outcome == "planner_error"}
    assert lost == deadly & {0, 1, 2}


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=40))
def test_sign_flips_of_single_scenes_are_mcnemars_test(
    pairs: list[tuple[bool, bool]],
) -> None:
    first, second = [a for a, _ in pairs], [b for _, b in pairs]
    flips = sign_flip_test([int(a) - int(b) for a, b in pairs])
    assert flips == pytest.approx(mcnemar(first, second))
