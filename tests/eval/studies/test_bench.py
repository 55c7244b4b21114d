"""What the bench measures is of the same physics, adds up, and compares with itself."""

import json
from pathlib import Path

import numpy as np
import pytest

import beacon_mj
from beacon_mj.errors import RunError
from beacon_mj.eval.api.bench import Bench
from beacon_mj.eval.studies.bench import Measure, episodes, medians, search
from beacon_mj.eval.studies.bench_scale import scale
from beacon_mj.planners.registry import load_planner
from beacon_mj.world.bare import BareWorld, ScheduledWorld
from tests.worlds import cached_scene


def test_the_engine_alone_reaches_the_states_of_the_episode() -> None:
    scene = cached_scene("collision-required", 0)
    planner = load_planner("push-through")[1]()
    trace = beacon_mj.run_episode(scene, planner)
    commands = [record.command.velocity_mps for record in trace.steps]
    world = ScheduledWorld(scene)
    outcomes = [world.step(command) for command in commands]
    assert any(outcome.contacts for outcome in outcomes)
    assert {0, 50} <= {n for schedule in world.schedules for n in schedule}
    for schedules in (None, world.schedules):
        state = BareWorld(scene).run(commands, schedules)
        assert state.tobytes() == world.data.qpos.tobytes()
    other = BareWorld(scene).run([-c for c in commands], None)
    assert not np.array_equal(other, world.data.qpos)


def test_shares_add_up_and_an_episode_costs_more_than_its_physics() -> None:
    found = {m.what: m for m in episodes(["dstar-lite"], ["sparse"])}
    shares = [m.value for what, m in found.items() if what.startswith("share of")]
    assert sum(shares) == pytest.approx(100.0)
    assert len(shares) == 6
    assert min(shares[:-1]) > 0.0
    assert found["episode over bare stepping, with log"].value > 1.0
    assert found["real-time factor, with log"].value > 1.0


def test_what_grows_with_a_room_is_measured_for_each_family_and_planner() -> None:
    found = {m.what: m.value for m in scale(["sparse"], ["dstar-lite"])}
    p50, p99, largest = (
        found[f"decision of dstar-lite, {what}"] for what in ("p50", "p99", "largest")
    )
    assert 0.0 < p50 <= p99 <= largest
    assert len(found) == 8
    assert min(found.values()) > 0.0


def test_searches_agree() -> None:
    ours, scipys = search([40])
    assert ours.of == scipys.of == "Dijkstra, 40 x 40 cells"
    assert 0.0 < ours.value < 1000.0


def test_medians_are_of_each_measure() -> None:
    rounds = [
        [Measure("a", "b", v, "s"), Measure("c", "d", -v, "s")] for v in (3, 1, 2)
    ]
    assert [m.value for m in medians(rounds)] == [2, -2]


def test_a_stored_run_is_compared_with(tmp_path: Path) -> None:
    file = tmp_path / "before.json"
    first = beacon_mj.bench(["search"], rounds=1, save=file)
    stored = json.loads(file.read_text())
    assert stored["measures"].keys() == {m.name for m in first.measures}
    assert "mujoco" in stored["versions"]
    stored["measures"][first.measures[0].name]["value"] *= 2.0
    del stored["measures"][first.measures[1].name]
    file.write_text(json.dumps(stored))
    before = {name: each["value"] for name, each in stored["measures"].items()}
    again = Bench(first.measures, before)
    assert again.ratio(first.measures[0]) == pytest.approx(0.5)
    assert again.ratio(first.measures[1]) is None
    assert "ratio" in str(again)


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"measures": {"a": 1}}', "[" * 10_000]
)
def test_another_file_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "other.json"
    file.write_text(text)
    with pytest.raises(RunError, match=r"other\.json: expected what `beacon-mj bench"):
        beacon_mj.bench(["search"], against=file)


def test_an_unknown_part_is_named() -> None:
    with pytest.raises(RunError, match="Unknown part 'speed'"):
        beacon_mj.bench(["speed"])
