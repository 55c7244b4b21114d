"""Running evaluations: worker counts, misbehaving planners, resuming."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import (
    RunConfig,
    SceneRef,
    family_scenes,
    generated_scenes,
    scene_refs,
    stored_scenes,
)
from beacon_mj.eval.runs.jobs import Job, planner_seed
from beacon_mj.eval.runs.lineup import planner_entries
from beacon_mj.eval.runs.runner import plan, run_jobs
from beacon_mj.eval.runs.versions import versions
from beacon_mj.scene_gen.generate import generate_scene
from tests.repository import REPOSITORY

HOSTILE = REPOSITORY / "tests" / "eval" / "hostile.py"


def configured(
    planners: Sequence[str],
    families: Sequence[str] = ("sparse",),
    scenes_per_family: int = 1,
    settings: Sequence[str] = ("protocol.max_steps=120",),
    isolate: bool | None = None,
) -> tuple[RunConfig, list[SceneRef]]:
    entries, protocol = planner_entries(planners, settings, isolate)
    hashes, refs = generated_scenes(families, scenes_per_family, None)
    config = RunConfig(
        planners=entries,
        families=hashes,
        scenes=family_scenes(hashes, refs, None),
        scenes_per_family=scenes_per_family,
        seed=0,
        perception="noisy",
        scene_dir=None,
        templates=None,
        protocol=protocol,
        log="none",
        versions=versions(),
    )
    return config, refs


def run(config: RunConfig, refs: Sequence[SceneRef], workers: int = 1) -> list[Row]:
    found = run_jobs(config, plan(config, refs), workers=workers)
    return sorted((row for rows in found for row in rows), key=lambda row: row.key)


def timeless(rows: Sequence[Row]) -> list[dict[str, object]]:
    return [
        {k: v for k, v in row.as_dict().items() if k not in WALL_CLOCK_COLUMNS}
        for row in rows
    ]


def hostile(name: str) -> str:
    return f"{HOSTILE}:{name}"


def test_rows_do_not_depend_on_workers_or_order() -> None:
    config, refs = configured(
        ["push-through", "dstar-lite"], ["sparse", "collision-required"]
    )
    one = run(config, refs)
    assert [row.key for row in one] == [
        (p, f, 0)
        for p in ("dstar-lite", "push-through")
        for f in ("collision-required", "sparse")
    ]
    assert sum(row.success for row in one) >= 2
    assert timeless(run(config, refs[::-1])) == timeless(one)
    assert timeless(run(config, refs, workers=2)) == timeless(one)


@pytest.mark.parametrize(
    ("name", "detail"),
    [
        ("Raises", "ZeroDivisionError: by hand"),
        ("ReturnsNan", "finite velocity"),
        ("Exits", "tried to end the process"),
        ("Hangs", "no decision within 0.2 s"),
        ("FailsToBuild", "OSError: no licence"),
    ],
)
@pytest.mark.parametrize("isolate", [False, None])
def test_a_failing_planner_costs_its_own_episode(
    name: str, detail: str, isolate: bool | None
) -> None:
    settings = ["protocol.max_steps=120", "protocol.decision_limit_s=0.2"]
    specs = [hostile(name), "push-through"]
    config, refs = configured(specs, settings=settings, isolate=isolate)
    bad, good = run(config, refs)
    assert (bad.planner, bad.outcome) == (name, "planner_error")
    assert detail in bad.detail
    assert not bad.success
    assert good.success


def test_a_dying_process_costs_only_the_episode_that_killed_it() -> None:
    config, refs = configured(
        [hostile("Dies"), hostile("Harmless"), "push-through"],
        scenes_per_family=3,
        settings=["protocol.max_steps=120", "Dies.at=2"],
        isolate=False,
    )
    rows = run(config, refs, workers=2)
    assert [row.key for row in rows] == [
        (p, "sparse", k) for p in ("Dies", "Harmless", "push-through") for k in range(3)
    ]
    assert all(r.outcome == "planner_error" for r in rows if r.planner == "Dies")
    assert all("the process died" in r.detail for r in rows if r.planner == "Dies")
    others = [row for row in rows if row.planner != "Dies"]
    assert timeless(others) == timeless(run(*_without_dies(config, refs)))


def _without_dies(
    config: RunConfig, refs: Sequence[SceneRef]
) -> tuple[RunConfig, list[SceneRef]]:
    specs = [entry.spec for entry in config.planners if entry.name != "Dies"]
    return configured(specs, scenes_per_family=len(refs))


def test_finished_episodes_are_not_planned_again() -> None:
    config, refs = configured(["push-through", "dstar-lite"], scenes_per_family=2)
    done = [row for row in run(config, refs) if row.key != ("dstar-lite", "sparse", 1)]
    [job] = plan(config, refs, done)
    assert job == Job((SceneRef("sparse", 1),), ("dstar-lite",))
    assert plan(config, refs, run(config, refs)) == []


def test_planner_seeds_differ_between_scenes_only() -> None:
    seeds = {planner_seed(0, "sparse", k) for k in range(50)}
    assert len(seeds) == 50
    assert planner_seed(0, "sparse", 1) != planner_seed(1, "sparse", 1)


def test_stored_scenes_give_the_same_rows_as_generated_ones(tmp_path: Path) -> None:
    config, refs = configured(["push-through"], scenes_per_family=2)
    for k in range(2):
        scene = generate_scene("sparse", k)
        (tmp_path / f"scene_{k:04d}.json").write_bytes(scene.to_json())
    hashes, stored = stored_scenes(tmp_path, (), None)
    assert [r.index for r in stored] == [0, 1]
    assert timeless(run(config, stored)) == timeless(run(config, refs))
    assert stored_scenes(tmp_path, ["sparse"], 1)[0] != hashes


def test_two_stored_scenes_of_one_name_are_refused(tmp_path: Path) -> None:
    for name in ("a.json", "b.json"):
        (tmp_path / name).write_bytes(generate_scene("sparse", 0).to_json())
    with pytest.raises(RunError, match="both are sparse_0000"):
        stored_scenes(tmp_path, (), None)


def test_unknown_stored_family_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(generate_scene("sparse", 0).to_json())
    with pytest.raises(RunError, match=r"family 'spars'.* Did you mean 'sparse'"):
        stored_scenes(tmp_path, ["spars"], None)


def test_a_configuration_finds_its_scenes_again() -> None:
    config, refs = configured(
        ["push-through"], ["sparse", "cluttered"], scenes_per_family=3
    )
    assert scene_refs(config) == (config.families, refs)
