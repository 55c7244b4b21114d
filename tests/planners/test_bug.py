"""Bug1 and Bug2 against the bounds and the completeness that their authors proved."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.interface import Task
from beacon_mj.planners.bug.boundary import BoundaryPlanner, BugConfig
from beacon_mj.planners.bug.free_space import Contour, FreeSpace
from beacon_mj.planners.bug1 import Bug1
from beacon_mj.planners.bug2 import Bug2
from tests.kinematics import Run, box, disc, drive, make_task

ROOM = (0.0, 0.0, 4.0, 3.0)
START, GOAL = (0.4, 1.5), (3.6, 1.5)
CLEARANCE_M = 0.12 + BugConfig().margin_m
#: Cut corners, and the few millimetres between a hit and the boundary.
SLACK_M = 0.3
TASK = make_task(START, GOAL, ROOM, max_steps=4000)


def far_from_the_ends(footprint: Footprint) -> bool:
    """Whether the ends are well inside free space."""
    points = np.array([START, GOAL])
    return bool(Footprints.stack([footprint]).distances(points).min() > 0.25)


def obstacles() -> st.SearchStrategy[list[Footprint]]:
    """Up to seven overlapping discs and boxes, which often close the way."""
    x, y = st.floats(0.3, 3.7), st.floats(0.0, 3.0)
    discs = st.builds(disc, x, y, st.floats(0.05, 0.4))
    boxes = st.builds(
        lambda x, y, w, h: box(x, y, x + w, y + h),
        x,
        st.floats(-0.2, 2.5),
        st.floats(0.05, 0.4),
        st.floats(0.05, 1.5),
    )
    return st.lists((discs | boxes).filter(far_from_the_ends), max_size=7)


def free_space(footprints: list[Footprint], clearance_m: float) -> shapely.Geometry:
    """Oracle: free space built one footprint at a time, without the planners' code."""
    west, south, east, north = ROOM
    room = shapely.box(west, south, east, north).buffer(-clearance_m)
    return room.difference(
        shapely.union_all([f.polygon(clearance_m) for f in footprints])
    )


def joined(footprints: list[Footprint], clearance_m: float) -> bool:
    """Whether start and goal lie in one part of free space."""
    ends = shapely.points([START, GOAL])
    parts = shapely.get_parts(free_space(footprints, clearance_m))
    return any(part.contains(ends).all() for part in map(Containing, parts))


class Containing:
    """A polygon that answers for many points."""

    def __init__(self, polygon: shapely.Geometry) -> None:
        self.polygon = polygon

    def contains(self, points: object) -> Array:
        return np.asarray(shapely.contains(self.polygon, points))


def hit_contours(planner: BoundaryPlanner, obstacles: list[Footprint]) -> list[Contour]:
    """The true contour at each hit point."""
    space = FreeSpace(Footprints.stack(obstacles), ROOM, CLEARANCE_M)
    found = [space.nearest(hit) for hit in planner.hits]
    return [contour for contour in found if contour is not None]


def check_outcome(run: Run, obstacles: list[Footprint]) -> None:
    """Reached if the way is open with room to spare, given up if it is closed."""
    assert run.clearance_m > 0.0
    if joined(obstacles, CLEARANCE_M + 0.003):
        assert run.outcome == "reached", run.commands[-1].info.reason
    elif not joined(obstacles, CLEARANCE_M - 0.003):
        assert run.outcome == "gave_up"
        assert "cut off" in run.commands[-1].info.reason


def shortest(task: Task) -> float:
    return float(np.hypot(*(task.goal_m - task.start_m)))


@settings(max_examples=60, deadline=None)
@given(obstacles(), st.sampled_from(["left", "right"]))
def test_bug1_is_complete_and_within_its_bound(
    obstacles: list[Footprint], turn: str
) -> None:
    planner = Bug1(BugConfig(turn=turn))  # type: ignore[arg-type]
    run = drive(planner, TASK, obstacles)
    check_outcome(run, obstacles)
    perimeters = sum(c.length_m for c in hit_contours(planner, obstacles))
    assert run.length_m <= shortest(TASK) + 1.5 * perimeters + SLACK_M


@settings(max_examples=60, deadline=None)
@given(obstacles(), st.sampled_from(["left", "right"]))
def test_bug2_is_complete_and_within_its_bound(
    obstacles: list[Footprint], turn: str
) -> None:
    planner = Bug2(BugConfig(turn=turn))  # type: ignore[arg-type]
    run = drive(planner, TASK, obstacles)
    check_outcome(run, obstacles)
    line = shapely.LineString([START, GOAL])
    bound = shortest(TASK)
    for contour in {
        c.points.tobytes(): c for c in hit_contours(planner, obstacles)
    }.values():
        ring = shapely.LinearRing(contour.points)
        crossings = len(shapely.get_coordinates(shapely.intersection(ring, line)))
        # Odd if the boundary parts start from goal; then one more pair may be walked.
        bound += max(math.ceil(crossings / 2), 1) * contour.length_m
    assert run.length_m <= bound + SLACK_M


def test_bug1_goes_round_once_and_leaves_where_the_goal_is_nearest() -> None:
    obstacle = disc(2.0, 1.6, 0.4)
    planner = Bug1()
    run = drive(planner, TASK, [obstacle])
    perimeter = 2 * np.pi * (0.4 + CLEARANCE_M)
    assert len(planner.hits) == 1
    nearest = np.array([2.0, 1.6]) + (0.4 + CLEARANCE_M) * np.array(
        [1.6, -0.1]
    ) / np.hypot(1.6, 0.1)
    assert min(np.hypot(*(p - nearest)) for p in run.trace) < 0.03
    lap = [c for c in run.commands if c.info.action == "follow"]
    assert len(lap) * 0.05 == pytest.approx(1.5 * perimeter, rel=0.1)


def test_bug2_leaves_at_the_m_line() -> None:
    planner = Bug2()
    run = drive(planner, TASK, [disc(2.0, 1.6, 0.4)])
    actions = [c.info.action for c in run.commands]
    left = run.trace[len(actions) - actions[::-1].index("follow") - 1]
    assert left[1] == pytest.approx(1.5, abs=0.06)
    assert run.length_m < 4.5


def test_a_gap_of_two_millimetres_does_not_look_like_a_cut() -> None:
    gap = 0.4 + 2 * CLEARANCE_M + 0.002
    run = drive(Bug1(), TASK, [disc(1.5, 1.5, 0.2), disc(1.5 + gap, 1.5, 0.2)])
    assert run.outcome == "reached"


@pytest.mark.parametrize(("turn", "side"), [("left", 1.0), ("right", -1.0)])
def test_the_turn_decides_the_side(turn: str, side: float) -> None:
    planner = Bug2(BugConfig(turn=turn))  # type: ignore[arg-type]
    run = drive(planner, TASK, [disc(2.0, 1.5, 0.4)])
    highest = max(run.trace, key=lambda p: abs(p[1] - 1.5))
    assert np.sign(highest[1] - 1.5) == side


def test_contour_lengths_and_stretches() -> None:
    space = FreeSpace(Footprints.stack([disc(2.0, 1.5, 0.3)]), ROOM, 0.1)
    wall, island = sorted(space.contours, key=lambda c: -c.length_m)
    assert wall.length_m == pytest.approx(2 * (3.8 + 2.8))
    assert island.length_m == pytest.approx(2 * np.pi * 0.4, rel=1e-3)
    start = island.project(np.array([1.0, 1.5]))
    half = island.stretch(start, island.length_m / 2)
    assert half[0] == pytest.approx([1.6, 1.5], abs=1e-3)
    assert half[-1] == pytest.approx([2.4, 1.5], abs=1e-3)
    assert half[len(half) // 2] == pytest.approx([2.0, 1.9], abs=0.03)


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ({"turn": "up"}, "Expected turn to be left or right but it was 'up'"),
        ({"margin_m": 0.5}, "Expected margin_m to be between 0.001 and 0.1"),
        ({"tolerance_m": 0.02}, "Expected tolerance_m to be between"),
    ],
)
def test_a_bad_config_says_what_was_expected(
    config: dict[str, object], message: str
) -> None:
    with pytest.raises(PlannerError, match=message):
        BugConfig(**config)  # type: ignore[arg-type]
