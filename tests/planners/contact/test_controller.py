"""How a push is chosen among several, begun, and charged for."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
import shapely

from beacon_mj.episode.run import run_episode
from beacon_mj.geometry import Array
from beacon_mj.interface import Observation, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.beacon import BeaconConfig, BeaconPolicy
from beacon_mj.planners.beacon_voi import BeaconVoi
from beacon_mj.planners.contact import loop
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.checks import next_in_chain
from beacon_mj.planners.contact.controller import PushController
from beacon_mj.planners.contact.cost_map import ContactMap
from beacon_mj.planners.contact.cost_to_go import TravelTimes
from beacon_mj.planners.contact.decision import Decision
from beacon_mj.planners.contact.limits import PushLimits
from beacon_mj.planners.contact.loop import ContactPlanner
from beacon_mj.pushing.cascade import Cascade
from beacon_mj.scene_gen.generate import generate_scene
from tests.kinematics import make_task
from tests.sensed import observe, sensed_box

SEED = 4000  # Neither the tuning nor the reported scenes.


class WatchedController(PushController):
    """Notes the speed with which a push begins, and what was allowed [m/s]."""

    touches: ClassVar[list[tuple[float, float, int]]] = []

    def __init__(self, plan: PushPlan, task: Task, limits: PushLimits) -> None:
        super().__init__(plan, task, limits)
        self.allowed_mps, self.closing = limits.touch_mps, 0

    def act(self, observation: Observation) -> Array:
        closing = self.phase == "touch"
        velocity = super().act(observation)
        self.closing = self.closing + 1 if closing else 0
        if closing and self.phase == "push":
            speed = float(np.hypot(*observation.velocity_mps))
            self.touches.append((speed, self.allowed_mps, self.closing))
        return velocity


class WatchedPolicy(BeaconPolicy):
    """Notes which obstacles there were to choose from, and which was chosen."""

    def __init__(self, config: BeaconConfig | None = None) -> None:
        super().__init__(config)
        self.compared: list[tuple[int, list[int]]] = []

    def choose(
        self,
        observation: Observation,
        options: Iterator[list[PushPlan]],
        detour: FreeRoute,
    ) -> Decision | None:
        seen: list[int] = []

        def noted() -> Iterator[list[PushPlan]]:
            for plans in options:
                seen.append(plans[0].index)
                yield plans

        decision = super().choose(observation, noted(), detour)
        if decision is not None and decision.plan is not None:
            self.compared.append((decision.plan.index, seen))
        return decision


class Watched(ContactPlanner[BeaconConfig]):
    Policy = WatchedPolicy


@dataclass
class Notes:
    touches: list[tuple[float, float, int]]
    compared: list[tuple[int, list[int]]]


@pytest.fixture(scope="module")
def watched() -> Notes:
    planner = Watched()
    policy = planner.policy
    assert isinstance(policy, WatchedPolicy)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loop, "PushController", WatchedController)
        for family in ("collision-required", "collision-shortcut"):
            for index in range(6):
                run_episode(generate_scene(family, index, seed=SEED), planner)
    return Notes(WatchedController.touches, policy.compared)


def test_a_touch_is_as_slow_as_it_must_be_and_not_slower(watched: Notes) -> None:
    assert len(watched.touches) >= 6
    for speed, allowed, steps in watched.touches:
        assert speed < 1.1 * allowed + 0.01
        assert steps <= 5  # 60 mm at 0.1 m/s would take six.


def test_the_first_obstacle_met_is_not_always_pushed(watched: Notes) -> None:
    chosen = [(pushed, seen[0]) for pushed, seen in watched.compared]
    assert any(pushed == first for pushed, first in chosen)
    assert any(pushed != first for pushed, first in chosen)


def test_cost_is_charged_by_how_far_an_obstacle_is_in_the_way() -> None:
    radius = 0.125
    task = make_task((1.0, 3.0), (5.0, 3.0))
    box = sensed_box("a")
    observation = observe((1.0, 3.0), box)
    contact_map = ContactMap(task, 0.05, radius)
    contact_map.plan(observation, {0: 2.0})
    charged = contact_map._route.engine.cost
    grid = contact_map._route.field.grid
    outline = shapely.MultiPoint(box.footprint.vertices).convex_hull
    free = np.flatnonzero(np.isfinite(charged))
    for point, cost in zip(grid.centres(free), charged[free], strict=True):
        assert cost == pytest.approx(2.0 * overlap(outline, point, radius), abs=1e-9)


def overlap(outline: shapely.Polygon, point: Array, radius: float) -> float:
    """Depth to which a disc is inside of a polygon, in diameters, at most one."""
    here = shapely.Point(point)
    gap = outline.distance(here)
    if outline.contains(here):
        gap = -outline.exterior.distance(here)
    return float(min(max(radius - gap, 0.0) / (2.0 * radius), 1.0))


@pytest.mark.parametrize(
    ("beside_m", "counts"), [(-0.05, True), (0.003, True), (0.03, False)]
)
def test_a_neighbour_just_beside_the_way_counts(beside_m: float, counts: bool) -> None:
    """A pushed box turns a little: what it would just miss, it may well strike."""
    task = make_task((1.0, 3.0), (5.0, 3.0))
    pushed = sensed_box("pushed", 2.0, 3.0, length=0.3, width=0.3)
    other = sensed_box("other", 2.4, 3.3 + beside_m, length=0.3, width=0.3)
    observation = observe((1.0, 3.0), pushed, other)
    east = np.array([1.0, 0.0])
    alone = Cascade(((0, 0.5),), 10.0, None)
    plan = PushPlan(0, "pushed", east, np.zeros(2), np.zeros(2), 0.5, alone)
    chain = [o.id for o in next_in_chain(observation, plan, task)]
    assert chain == (["pushed", "other"] if counts else ["pushed"])


def test_voi_pushes_what_was_left_on_the_goal() -> None:
    """No path leads there any more, whatever the coarser travel times say."""
    task = make_task((1.0, 3.0), (5.018, 3.005))
    box = sensed_box("a", 5.102, 3.256, length=0.2, scores=(0.01, 0.98, 0.01))
    observation = observe((4.0, 3.0), box)
    planner = BeaconVoi()
    planner.reset(task)
    command = planner.act(observation)
    times = TravelTimes(task, unknown_premium=0.3)
    times.update(observation, {})
    assert math.isfinite(times.from_point(observation.position_m))
    assert command.info.action == "approach"
    assert command.info.cost_detour == math.inf


@pytest.mark.parametrize(("moves", "phase"), [(True, "touch"), (False, "failed")])
def test_an_approach_may_take_as_long_as_its_path(moves: bool, phase: str) -> None:
    """10 m take 200 control periods; a robot that does not move is given 300."""
    task = make_task((1.0, 3.0), (13.0, 3.0), (0.0, 0.0, 14.0, 6.0))
    east, touch = np.array([1.0, 0.0]), np.array([11.5, 3.0])
    plan = PushPlan(
        0, "a", east, np.array([11.0, 3.0]), touch, 0.5,
        Cascade(((0, 0.5),), 10.0, None),
    )  # fmt: skip
    controller = PushController(plan, task, PushLimits(touch_mps=0.1, push_mps=0.5))
    here, steps = np.array([1.0, 3.0]), 0
    while controller.phase == "approach":
        seen = observe((float(here[0]), float(here[1])), sensed_box("a", 12.0, 3.0))
        velocity = controller.act(seen)
        here = here + moves * task.control_period_s * velocity
        steps += 1
    assert controller.phase == phase
    assert steps > 190 if moves else steps == 301
