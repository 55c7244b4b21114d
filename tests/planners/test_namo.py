"""Regions, doors and plans of `namo`, in rooms that can be solved by hand."""

import numpy as np
import pytest
import shapely

from beacon_mj.constants import WALL_KIND
from beacon_mj.episode.run import run_episode
from beacon_mj.geometry import Footprints
from beacon_mj.interface import Observation, SensedObstacle
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.namo import Namo, NamoConfig, NamoPolicy, pushed
from beacon_mj.planners.regions import Regions, nearest_door
from tests.kinematics import ROOM, box, make_task
from tests.sensed import observe, sensed_box
from tests.worlds import cached_scene

CLEARANCE_M = 0.15


def wall(name: str, x: float, south: float, north: float) -> SensedObstacle:
    """Return an inner wall across the robot's way."""
    return sensed_box(
        name, x, 0.5 * (south + north), length=0.1, width=north - south,
        density=1e5, scores=(1.0, 0.0, 0.0), kind=WALL_KIND,
    )  # fmt: skip


def barrier(x: float, *doors: tuple[str, float, float]) -> list[SensedObstacle]:
    """Return walls from south to north with a crate of a density in each gap."""
    found, south = [], 0.0
    for name, y, density in doors:
        found.append(wall(f"{name}_wall", x, south, y - 0.3))
        crate = sensed_box(name, x, y, length=0.35, width=0.5, density=density)
        found.append(crate)
        south = y + 0.3
    return [*found, wall(f"last_{x}", x, south, 6.0)]


def policy(*, depth: int = 3) -> NamoPolicy:
    out = NamoPolicy(NamoConfig(most_pushes=depth))
    out.reset(make_task((1.0, 3.0), (5.0, 3.0)))
    return out


def plan(
    world: Observation, *, movable: set[str], depth: int = 3
) -> list[PushPlan] | None:
    """Return the whole plan of SelectConnect, for what may be moved."""
    own = policy(depth=depth)
    own.observe(world)
    costs = {
        i: own.force_n(o) / own.task.motion_cost_jpm
        for i, o in enumerate(world.obstacles)
        if o.id in movable
    }
    return own._select_connect(world, costs, depth)


def test_a_wall_makes_two_regions() -> None:
    footprints = Footprints.stack([box(2.9, 0.0, 3.1, 6.0), box(4.0, 4.0, 4.5, 4.5)])
    regions = Regions(footprints, ROOM, CLEARANCE_M)
    assert len(regions.parts) == 2
    west, east = (regions.of(np.array(p), 0.0) for p in ((1.0, 3.0), (5.0, 3.0)))
    assert west is not None
    assert east is not None
    assert west != east
    assert regions.touches[0].all()
    assert regions.touches[1].tolist().count(True) == 1
    assert regions.touches[1, east]
    # Exact but for the corners of the dilated footprints.
    expected = (2.9 - 2 * CLEARANCE_M) * (6.0 - 2 * CLEARANCE_M)
    assert shapely.area(regions.parts[west]) == pytest.approx(expected, abs=0.01)


def test_places_within_the_clearance_belong_to_the_nearest_region() -> None:
    regions = Regions(Footprints.stack([box(2.9, 0.0, 3.1, 6.0)]), ROOM, CLEARANCE_M)
    close = np.array([2.85, 3.0])
    assert regions.of(close, 0.01) is None
    assert regions.of(close, 0.2) == regions.of(np.array([1.0, 3.0]), 0.0)


def test_an_empty_room_is_one_region() -> None:
    regions = Regions(Footprints(), ROOM, CLEARANCE_M)
    assert len(regions.parts) == 1
    assert regions.touches.shape == (0, 1)


def test_the_door_is_the_one_on_the_cheapest_way() -> None:
    """The nearer one, unless it costs more than the way to the other and back."""
    obstacles = barrier(3.0, ("near", 3.0, 100.0), ("far", 5.0, 100.0))
    world = observe((1.0, 3.0), *obstacles)
    regions = Regions(world.footprints, ROOM, CLEARANCE_M)
    points = np.array([1.0, 3.0]), np.array([5.0, 3.0])
    ends = tuple(regions.of(p, 0.2) for p in points)
    centroids = np.array([o.centroid_m for o in obstacles])
    names = [o.id for o in obstacles]
    near, far = names.index("near"), names.index("far")
    longer = 2.0 * (np.hypot(2.0, 2.0) - 2.0)
    for extra, expected in ((longer - 0.01, near), (longer + 0.01, far)):
        costs = {near: 1.0 + extra, far: 1.0}
        door = nearest_door(regions, ends, points, centroids, costs)  # type: ignore[arg-type]
        assert door is not None
        assert (door.index, door.beyond) == (expected, ends[1])
    door = nearest_door(regions, ends, points, centroids, costs, {far})  # type: ignore[arg-type]
    assert door is not None
    assert door.index == near
    assert nearest_door(regions, ends, points, centroids, {}) is None  # type: ignore[arg-type]


def test_one_push_opens_a_barrier() -> None:
    world = observe((1.0, 3.0), *barrier(3.0, ("crate", 3.0, 100.0)))
    found = plan(world, movable={"crate"})
    assert found is not None
    assert [push.id for push in found] == ["crate"]
    after = pushed(world, found[0])
    regions = Regions(after.footprints, ROOM, CLEARANCE_M - 0.02)
    goal = np.array([5.0, 3.0])
    assert regions.of(after.position_m, 0.2) == regions.of(goal, 0.2)


def test_two_barriers_take_two_pushes() -> None:
    obstacles = [*barrier(2.0, ("a", 3.0, 100.0)), *barrier(3.6, ("b", 3.0, 100.0))]
    world = observe((1.0, 3.0), *obstacles)
    found = plan(world, movable={"a", "b"})
    assert found is not None
    assert [push.id for push in found] == ["a", "b"]
    assert plan(world, movable={"a", "b"}, depth=1) is None
    assert plan(world, movable={"a"}) is None


def test_a_door_that_leads_nowhere_is_avoided() -> None:
    """The nearer crate is in a niche: behind it there is a wall that stays."""
    obstacles = barrier(3.0, ("niche", 3.0, 100.0), ("way", 4.8, 100.0))
    obstacles += [wall("back", 3.35, 2.5, 3.5)]
    world = observe((1.0, 3.0), *obstacles)
    found = plan(world, movable={"niche", "way"})
    assert found is not None
    assert [push.id for push in found] == ["way"]


def test_nothing_is_planned_where_the_way_is_free() -> None:
    assert plan(observe((1.0, 3.0), sensed_box("crate", 3.0, 3.0)), movable=set()) == []


def test_what_seems_movable_is_asked_for_first() -> None:
    own = policy()
    crate = sensed_box("crate", scores=(0.2, 0.6, 0.2))
    vase = sensed_box("vase", 3.0, scores=(0.1, 0.3, 0.6))
    heavy = sensed_box("heavy", 4.0, density=5000.0)
    own.observe(observe((1.0, 3.0), crate, vase, heavy))
    asked = [own.crossing_cost(o, last_resort=False) for o in (crate, vase, heavy)]
    assert asked[0] == pytest.approx(crate.perceived_force_n / 1.0)
    assert asked[1:] == [None, None]
    assert own.crossing_cost(vase, last_resort=True) is not None


@pytest.mark.parametrize("index", [0, 1, 2])
def test_it_crosses_what_must_be_crossed(index: int) -> None:
    trace = run_episode(cached_scene("collision-required", index), Namo())
    assert trace.outcome == "reached", trace.detail
    assert any(step.outcome.displacements for step in trace.steps)
