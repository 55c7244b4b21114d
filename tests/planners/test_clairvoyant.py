"""The clairvoyant: never any damage, never beaten, and told by no other way."""

import functools
import math
from typing import Any, ClassVar

import msgspec
import numpy as np
import pytest

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.rollout import truth_about
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.trace import Trace
from beacon_mj.errors import PlannerError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.sandbox import Guarded
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.beacon import Beacon
from beacon_mj.planners.clairvoyant import Clairvoyant, ClairvoyantConfig
from beacon_mj.planners.dstar_lite import DStarLitePlanner
from beacon_mj.planners.oracle.push_routes import (
    STANDOFF_M,
    Way,
    gentle_touches,
    lines_through,
)
from beacon_mj.planners.oracle.truth import TrueObstacle
from beacon_mj.planners.push_through import PushThrough
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.perception import perceive
from tests.kinematics import box, make_task

SEED = 4000  # Neither the tuning nor the reported scenes.
NOISE_STEPS = 2  #: What a search that stops early may leave on the table.
RIVALS = (Beacon, DStarLitePlanner, PushThrough)


@functools.cache
def scene(family: str) -> Scene:
    return generate_scene(family, 1, seed=SEED)


@functools.cache
def solved(family: str) -> Trace:
    return run_episode(scene(family), Clairvoyant(), "clairvoyant")


def row(planner: Planner, family: str) -> Row:
    return measure(run_episode(scene(family), planner))


def positions(trace: Trace) -> np.ndarray:
    return np.array([r.outcome.position_m for r in trace.steps])


def test_it_arrives_and_breaks_nothing(family: str) -> None:
    found = measure(solved(family))
    assert found.clean_success
    assert found.obstacles_broken == 0


def test_no_run_is_faster_than_its_reference_path(family: str) -> None:
    trace = solved(family)
    robot = trace.scene.robot
    shortest = trace.scene.certificate.reference_length_m - 0.1
    least = shortest / (robot.speed_mps * robot.control_period_s)
    assert len(trace.steps) >= math.floor(least)


@pytest.mark.parametrize("rival", RIVALS)
def test_nobody_clean_is_faster(family: str, rival: type[Planner]) -> None:
    other = row(rival(), family)
    steps = len(solved(family).steps)
    assert steps > 0
    if other.clean_success:
        noise = 0 if rival is PushThrough else NOISE_STEPS
        assert steps <= other.steps + noise


def test_the_episode_repeats_the_rehearsal_bit_by_bit() -> None:
    planner = Clairvoyant()
    trace = run_episode(scene("collision-required"), planner)
    assert planner.best is not None
    np.testing.assert_array_equal(positions(trace), planner.best.positions_m[1:])


def test_what_it_is_told_does_not_depend_on_perception() -> None:
    fooled = perceive(scene("collision-required"), "misleading", SEED)
    blurred = Protocol(pose_noise_m=0.1, missed_detection=0.5, sensing_radius_m=0.1)
    trace = run_episode(fooled, Clairvoyant(), protocol=blurred)
    np.testing.assert_array_equal(
        positions(trace), positions(solved("collision-required"))
    )


def test_it_gives_up_where_nothing_can_be_done() -> None:
    found = scene("collision-required")
    walled = msgspec.structs.replace(
        found, obstacles=tuple(map(_immovable, found.obstacles))
    )
    trace = run_episode(walled, Clairvoyant())
    assert trace.outcome == "gave_up"
    assert "No clean way" in trace.detail


def _immovable(o: Any) -> Any:
    return msgspec.structs.replace(
        o, interaction="safe", fixed=True, break_force_n=None
    )


def test_it_must_be_told() -> None:
    with pytest.raises(PlannerError, match="told the truth before reset"):
        Clairvoyant().reset(make_task((1.0, 3.0), (5.0, 3.0)))


def test_it_checks_its_configuration() -> None:
    with pytest.raises(PlannerError, match="rehearsals"):
        ClairvoyantConfig(rehearsals=0)


class Curious(Planner):
    """Asks for the truth, but is no oracle."""

    Config: ClassVar[type[Any]] = dict
    told: ClassVar[list[object]] = []

    def set_truth(self, truth: object) -> None:
        self.told.append(truth)

    def reset(self, task: Task) -> None:
        pass

    def act(self, observation: Observation) -> Command:
        return Command(velocity_mps=np.zeros(2), give_up=True)


@pytest.mark.parametrize("guarded", [False, True])
def test_only_oracles_are_told(guarded: bool) -> None:
    planner = Guarded(Curious) if guarded else Curious()
    run_episode(scene("sparse"), planner)
    assert Curious.told == []


def test_a_guarded_oracle_is_told() -> None:
    trace = run_episode(scene("sparse"), Guarded(Clairvoyant), oracle=True)
    np.testing.assert_array_equal(positions(trace), positions(solved("sparse")))


def test_the_truth_is_the_scenes() -> None:
    found = scene("cluttered")
    truth = truth_about(found, Protocol(), run_episode)
    assert [o.id for o in truth.obstacles] == [o.id for o in found.obstacles]
    for true, o in zip(truth.obstacles, found.obstacles, strict=True):
        assert true.mass_kg == o.mass_kg
        assert true.breakaway_force_n == o.breakaway_force_n
        assert true.break_force_n == (o.break_force_n or math.inf)
        assert true.pushable(60.0) == o.pushable(60.0)


def crate(break_force_n: float = math.inf) -> TrueObstacle:
    return TrueObstacle(
        id="crate",
        footprint=box(2.9, 2.7, 3.1, 3.1),
        interaction="movable",
        mass_kg=4.0,
        breakaway_force_n=20.0,
        break_force_n=break_force_n,
    )


def test_lines_begin_behind_the_obstacle_and_lead_through_its_centroid() -> None:
    task = make_task((1.0, 3.0), (5.0, 3.0))
    path = np.array([task.start_m, task.goal_m])
    way = Way(path, frozenset({"crate"}), (crate(),))
    plain, straight, *turned = lines_through(way, task)
    assert plain == ()
    begin, centre = np.array(straight)
    np.testing.assert_allclose(centre, (3.0, 2.9))
    np.testing.assert_allclose(
        begin, (2.9 - task.radius_m - STANDOFF_M, 2.9), atol=1e-6
    )
    assert len(turned) == 2


def test_a_touch_stays_below_what_breaks() -> None:
    task = make_task((1.0, 3.0), (5.0, 3.0))
    path = np.array([task.start_m, task.goal_m])
    for obstacle, slower in ((crate(), False), (crate(break_force_n=20.0), True)):
        way = Way(path, frozenset({"crate"}), (obstacle,))
        ((name, speed),) = gentle_touches(way, task, 1.0)
        assert name == "crate"
        assert (speed < task.speed_mps) == slower
