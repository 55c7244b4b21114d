"""Missions: one planner over several days, and the room overnight."""

import functools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from beacon_mj.episode.mission import Mission, run_mission
from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import SceneError
from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.beacon import Beacon, BeaconConfig
from beacon_mj.planners.clairvoyant import Clairvoyant
from beacon_mj.planners.contact.belief_settings import BeliefSettings, Overnight
from beacon_mj.recording import Recorder, read_trace
from beacon_mj.recording.verify import verify
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import World
from beacon_mj.world.overnight import Left, as_left

PATIENT = Protocol(decision_limit_s=3600.0)
AS_LEFT = Protocol(decision_limit_s=3600.0, overnight="as_left")


@functools.cache
def days(number: int = 0, family: str = "revisited-rooms") -> tuple[Scene, ...]:
    return tuple(generate_scene(family, 3 * number + day, 1000) for day in range(3))


class Diary(Planner):
    """Gives up at once, and notes what it was told."""

    def __init__(self, config: Any = None) -> None:
        super().__init__(config)
        self.told: list[tuple[str, int | None, int | None]] = []
        self.fails_on = -1

    def reset(self, task: Task) -> None:
        self._note("reset", task)

    def next_day(self, task: Task) -> None:
        self._note("next_day", task)

    def _note(self, method: str, task: Task) -> None:
        self.told.append((method, task.mission_day, task.mission_days))
        if task.mission_day == self.fails_on:
            raise RuntimeError("I am unwell")

    def act(self, observation: Observation) -> Command:
        return Command(velocity_mps=np.zeros(2), give_up=True)


def test_a_planner_is_told_of_each_day() -> None:
    planner = Diary()
    run_mission(days(), planner, protocol=PATIENT)
    assert planner.told == [("reset", 0, 3), ("next_day", 1, 3), ("next_day", 2, 3)]


def test_a_day_that_fails_costs_that_day_and_the_memory() -> None:
    planner = Diary()
    planner.fails_on = 1
    traces = run_mission(days(), planner, protocol=PATIENT)
    assert [t.outcome for t in traces] == ["gave_up", "planner_error", "gave_up"]
    assert [method for method, _, _ in planner.told] == ["reset", "next_day", "reset"]


def test_outside_missions_no_day_is_told() -> None:
    planner = Diary()
    Mission(planner, protocol=PATIENT).day(generate_scene("sparse", 0))
    assert planner.told == [("reset", None, None)]


def test_scenes_that_are_no_mission_are_refused() -> None:
    with pytest.raises(SceneError, match="expected day 0 of the mission"):
        run_mission(days()[1:], Diary())
    with pytest.raises(SceneError, match="Expected all 3 days"):
        run_mission(days()[:2], Diary())
    with pytest.raises(SceneError, match="Expected all  days"):
        run_mission([], Diary())


@pytest.mark.parametrize("overnight", ["nothing", "failures", "belief"])
def test_what_is_kept_overnight(overnight: Overnight) -> None:
    settings = BeliefSettings(overnight=overnight)
    planner = Beacon(BeaconConfig(belief=settings))
    traces = run_mission(days(_telling_mission()), planner, protocol=PATIENT)
    tried = [
        [a for r in trace.steps for a in r.outcome.attempts] for trace in traces[:2]
    ]
    failed = {a.obstacle for a in tried[0] if a.evidence == "not_moved"}
    again = {a.obstacle for a in tried[1]} & failed
    assert failed
    if overnight != "nothing":
        assert not again
    first = traces[1].steps[0].command.info.beliefs
    last = traces[0].steps[-1].command.info.beliefs
    same = [first[name] == last[name] for name in failed if name in first]
    assert same
    assert all(same) is (overnight == "belief")


@functools.cache
def _telling_mission() -> int:
    """Return the first mission with a failed push on its first day."""
    for number in range(10):
        trace = Mission(Beacon(), protocol=PATIENT).day(days(number)[0])
        ends = [a.evidence for r in trace.steps for a in r.outcome.attempts]
        if "not_moved" in ends:
            return number
    raise AssertionError("no failed push in ten missions")


def test_a_room_stays_as_it_was_left_and_logs_stand_alone(tmp_path: Path) -> None:
    planner = Beacon()
    mission = Mission(planner, "beacon", AS_LEFT)
    paths = [tmp_path / f"{day}.mcap" for day in range(2)]
    traces = [
        mission.day(scene, listeners=[Recorder(path, planner_config={})])
        for scene, path in zip(days()[:2], paths, strict=True)
    ]
    moved = {d.obstacle for r in traces[0].steps for d in r.outcome.displacements}
    left = traces[1].left
    assert left is not None
    assert moved
    assert moved <= left.poses.keys()
    assert read_trace(paths[1]).left == left
    for path in paths:
        assert verify(path).problem is None
    homes = {o.id: (o.x_m, o.y_m) for o in days()[1].obstacles}
    far = [np.hypot(*np.subtract(left.poses[i][:2], homes[i])) for i in moved]
    assert max(far) > 0.05


def test_what_stands_on_the_goal_is_put_back_and_what_broke_stays_broken() -> None:
    scene, following = days()[:2]
    free = [o.id for o in scene.obstacles if not o.fixed]
    world = World(scene)
    lying = (*following.goal_m, 0.15, 1.0, 0.0, 0.0, 0.0)
    world.reset(Left(poses={free[0]: lying}, broken=(free[1],)))
    assert world.outlines[_index(scene, free[0])].centroid == pytest.approx(
        following.goal_m, abs=0.01
    )
    after = as_left(world, following)
    assert free[0] not in after.poses
    assert free[1] in after.poses
    assert after.broken == (free[1],)
    world.reset()
    assert not world.broken.any()


def test_an_oracle_is_told_how_the_room_was_left() -> None:
    traces = run_mission(days(), Clairvoyant(), protocol=AS_LEFT)
    assert [t.outcome for t in traces] == ["reached"] * 3


def _index(scene: Scene, name: str) -> int:
    return [o.id for o in scene.obstacles].index(name)


def test_beliefs_are_reported_of_what_was_seen_on_the_day() -> None:
    protocol = Protocol(decision_limit_s=3600.0, sensing_radius_m=1.0)
    traces = run_mission(days(), Beacon(), protocol=protocol)
    assert all(t.outcome != "planner_error" for t in traces), traces[-1].detail
    info: PlannerInfo = traces[1].steps[0].command.info
    assert info.beliefs.keys() == {*traces[1].first_sensed}
