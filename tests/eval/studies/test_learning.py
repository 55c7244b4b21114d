"""Savings by learning: pairing, actual worlds, missions, the command and its figure."""

import json
import math
from pathlib import Path

import msgspec
import numpy as np
import pytest

import beacon_mj
from beacon_mj.cli import BAD_INPUT, run
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.trace import Trace
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig
from beacon_mj.eval.runs.experiment import experiment
from beacon_mj.eval.runs.lineup import planner_entries
from beacon_mj.eval.statistics.results import Results
from beacon_mj.eval.studies.learning import actual_outcomes, by_family, savings
from beacon_mj.learning import actual_saving
from beacon_mj.scene import Scene, door_problem
from beacon_mj.scene_gen.generate import generate_scene

SEED = 4000  # Neither the tuning nor the reported scenes.


def results(folder: Path, family: str, count: int, **seconds: list[float]) -> Results:
    """A run of made-up times on real scenes; `inf` is an episode that failed."""
    entries, protocol = planner_entries(["beacon", "beacon-kinds"], [])
    config, _ = experiment(
        entries, protocol, families=[family], scenes_per_family=count, seed=SEED,
        perception="noisy",
    )  # fmt: skip
    rows = []
    for name, times in seconds.items():
        for index, time_s in enumerate(times):
            scene = generate_scene(family, index, seed=SEED)
            rows.append(row_of(scene, name.replace("_", "-"), time_s))
    return Results(folder, config, rows)


def row_of(scene: Scene, planner: str, time_s: float) -> Row:
    """The row of an episode of that length, or of one that failed."""
    solved = math.isfinite(time_s)
    row = measure(
        Trace(
            planner=planner,
            scene=scene,
            protocol=Protocol(),
            start_m=np.array(scene.start_m),
            outcome="reached" if solved else "stuck",
        )
    )
    return msgspec.structs.replace(row, sim_time_s=time_s if solved else 99.0)


def test_actual_outcomes_are_those_of_the_doors() -> None:
    scene = generate_scene("lookalike-doors", 0, seed=SEED)
    fixed = {o.id: o.fixed for o in scene.obstacles}
    assert scene.certificate.learning
    (part,), (opens,) = scene.certificate.learning.parts, actual_outcomes([scene])
    assert opens == [not fixed[door] for door in part.doors]
    assert {*opens} == {True, False}
    for stage in part.stages:
        assert any(opens[part.doors.index(door)] for door in stage.doors)


def optimum_saving(days: list[Scene]) -> float:
    learning = days[0].certificate.learning
    assert learning
    problem = door_problem(learning.parts, learning.fail_s, learning.pass_s)
    return actual_saving(problem, actual_outcomes(days)).saving_s


def test_savings_are_joined_scene_by_scene(tmp_path: Path) -> None:
    run_ = results(
        tmp_path, "lookalike-doors", 4,
        beacon=[40.0, 50.0, 60.0, 45.0], beacon_kinds=[35.0, 52.0, math.inf, 45.0],
    )  # fmt: skip
    found = savings(run_, "beacon", "beacon-kinds")
    assert [s.number for s in found] == [0, 1, 2, 3]
    assert [s.solved for s in found] == [True, True, False, True]
    assert [s.realised_s for s in found if s.solved] == pytest.approx([5.0, -2.0, 0.0])
    scenes = [generate_scene("lookalike-doors", k, seed=SEED) for k in range(4)]
    assert [s.optimum.saving_s for s in found] == [optimum_saving([s]) for s in scenes]
    (family,) = by_family(found)
    assert (family.solved, family.of) == (3, 4)
    assert family.realised_s.estimate == pytest.approx(1.0)
    assert family.least_s == min(s.certified_s for s in found) > 3.0
    expected = np.corrcoef(
        [s.optimum.saving_s for s in found if s.solved], [5.0, -2.0, 0.0]
    )[0, 1]
    assert family.correlation.estimate == pytest.approx(expected)


def test_a_mission_counts_once_and_whole(tmp_path: Path) -> None:
    run_ = results(
        tmp_path, "revisited-rooms", 6,
        beacon=[20.0] * 5, beacon_kinds=[10.0, 11.0, 12.0, 9.0, 9.0],
    )  # fmt: skip
    (mission,) = savings(run_, "beacon", "beacon-kinds")  # The second lacks a day.
    assert mission.number == 0
    assert mission.realised_s == pytest.approx(27.0)
    days = [generate_scene("revisited-rooms", k, seed=SEED) for k in range(3)]
    assert mission.optimum.saving_s == optimum_saving(days)


def test_controls_have_nothing_to_save(tmp_path: Path) -> None:
    run_ = results(
        tmp_path,
        "lookalike-doors-shuffled",
        2,
        beacon=[9.0, 8.0],
        beacon_kinds=[8.0, 8.0],
    )
    (family,) = by_family(savings(run_, "beacon", "beacon-kinds"))
    assert family.actual_s.estimate == pytest.approx(0.0, abs=1e-9)
    assert math.isnan(family.correlation.estimate)
    assert "-" in str(
        beacon_mj.learning_savings(run_, without="beacon", learner="beacon-kinds")
    )


def test_what_cannot_be_joined_is_refused(tmp_path: Path) -> None:
    run_ = results(tmp_path, "sparse", 1, beacon=[9.0], beacon_kinds=[8.0])
    with pytest.raises(RunError, match="with a certificate of learning"):
        savings(run_, "beacon", "beacon-kinds")
    with pytest.raises(RunError, match=r"Unknown planner 'becon'\. Did you mean"):
        savings(run_, "becon", "beacon-kinds")
    other = results(tmp_path, "lookalike-doors", 1, beacon=[9.0], beacon_kinds=[8.0])
    config: RunConfig = msgspec.structs.replace(other.config, seed=SEED + 1)
    with pytest.raises(RunError, match="another scene now"):
        savings(Results(tmp_path, config, other.episodes), "beacon", "beacon-kinds")


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, figure = tmp_path / "run", tmp_path / "savings.svg"
    beacon_mj.evaluate(
        ["ctp-optimist"], families=["lookalike-doors"], scenes_per_family=1, seed=SEED,
        vary={"ctp-optimist.push.speed_mps": [0.4, 0.5]}, workers=1, out=folder,
        settings={"protocol.decision_limit_s": 3600}, log="none",
    )  # fmt: skip
    arms = [
        "--without", "ctp-optimist[push.speed_mps=0.4]",
        "--with", "ctp-optimist[push.speed_mps=0.5]",
    ]  # fmt: skip
    assert run(["learning", str(folder), *arms, "--plot", str(figure)]) == 0
    printed = capsys.readouterr().out
    assert "lookalike-doors: 1 of 1 scenes" in printed
    assert all(len(line) <= 80 for line in printed.splitlines())
    assert "<svg" in figure.read_text()
    assert run(["learning", str(folder), *arms, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [s["solved"] for s in found["scenes"]] == [True]
    bad = ["--plot", str(tmp_path / "savings.txt")]
    assert run(["learning", str(folder), *arms, *bad]) == BAD_INPUT
    assert "ends in one of .svg" in capsys.readouterr().err
