"""Push attempts: one piece of evidence each, and the right one."""

import numpy as np
import pytest

from beacon_mj.fidelity.benches import START_M, bench, block, obstacle
from beacon_mj.scene.shapes import Box
from beacon_mj.world import BaseWorld, StepOutcome
from beacon_mj.world.pushes import AttemptEnd
from tests.worlds import Build

READING_S = 0.01  #: Largest time between two readings of the forces, in any world [s].
AHEAD, BACK = np.array([0.3, 0.0]), np.array([-0.3, 0.0])


def ends(outcomes: list[StepOutcome]) -> list[AttemptEnd]:
    return [a for o in outcomes for a in o.attempts]


def run(world: BaseWorld, velocity: np.ndarray, steps: int) -> list[StepOutcome]:
    return [world.step(velocity) for _ in range(steps)]


def pillar(build: Build, gap_m: float = 0.05) -> BaseWorld:
    """A world with a welded block before the robot."""
    box = Box(length_m=0.4, width_m=0.4, height_m=0.25)
    position = (START_M[0] + 0.12 + gap_m + 0.2, START_M[1])
    return build(
        bench(obstacle("pillar", box, position, interaction="safe", fixed=True))
    )


def test_moved_comes_once_per_attempt_and_after_ten_millimetres(build: Build) -> None:
    world = build(bench(block(gap_m=0.05)))
    start = world.poses[0, 0]
    outcomes = run(world, AHEAD, 40)
    (end,) = ends(outcomes)
    assert end.evidence == "moved"
    assert 19.62 - 1e-6 < end.force_n < 2.0 * 19.62
    assert world.poses[0, 0] - start > 0.5
    at_end = next(o for o in outcomes if o.attempts)
    assert at_end.time_s - 0.1 <= end.ended_s <= at_end.time_s


def test_a_second_attempt_needs_a_break_of_contact(build: Build) -> None:
    world = build(bench(block(gap_m=0.05)))
    first = run(world, AHEAD, 10)
    apart = run(world, BACK, 5)
    second = run(world, AHEAD, 20)
    assert [a.evidence for a in ends(first + apart + second)] == ["moved", "moved"]
    assert not ends(apart)


def test_a_welded_obstacle_is_not_moved_after_three_tenths_of_a_second(
    build: Build,
) -> None:
    world = pillar(build)
    outcomes = run(world, AHEAD, 60)
    (end,) = ends(outcomes)
    assert end.evidence == "not_moved"
    assert end.ended_s - end.began_s > 0.3 - READING_S - 1e-9
    assert end.force_n >= 54.0


def test_saturation_must_be_continuous(build: Build) -> None:
    """Contact that ends before 0.3 s at full force says nothing, however often."""
    world = pillar(build)
    outcomes = run(world, AHEAD, 2)
    for _ in range(6):
        outcomes += run(world, AHEAD, 2) + run(world, BACK, 3)
    assert any(c.filtered_peak_n > 1.0 for o in outcomes for c in o.contacts)
    assert not ends(outcomes)


def test_a_heavy_obstacle_is_not_moved(build: Build) -> None:
    world = build(bench(block(gap_m=0.05, mass_kg=15.0)))
    start = world.poses[0, 0]
    (end,) = ends(run(world, np.array([0.1, 0.0]), 40))
    assert end.evidence == "not_moved"
    assert abs(world.poses[0, 0] - start) < 1e-3


def test_touching_while_commanded_away_is_no_attempt(build: Build) -> None:
    world = pillar(build, gap_m=0.0)
    outcomes = run(world, np.array([0.0, 0.3]), 3) + run(world, BACK, 5)
    assert not ends(outcomes)


def test_breaking_is_evidence_and_ends_the_attempt(build: Build) -> None:
    world = build(bench(block(gap_m=0.05, mass_kg=6.0, break_force_n=12.0)))
    outcomes = run(world, np.array([0.1, 0.0]), 40)
    kinds = [a.evidence for a in ends(outcomes)]
    assert kinds.count("broken") == 1
    assert kinds[0] == "broken"
    assert len(kinds) == 1


def test_quiet_steps_forget_nothing_that_matters(build: Build) -> None:
    """After a far retreat, the same obstacle can be tried again."""
    world = build(bench(block(gap_m=0.05, mass_kg=15.0)))
    outcomes = run(world, AHEAD, 15) + run(world, BACK, 15) + run(world, AHEAD, 30)
    assert [a.evidence for a in ends(outcomes)] == ["not_moved", "not_moved"]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_only_the_touched_obstacle_of_a_row_is_tried(build: Build, count: int) -> None:
    blocks = [block(f"b{k}", 0.05 + 0.401 * k, mass_kg=1.5) for k in range(count)]
    world = build(bench(*blocks))
    got = ends(run(world, AHEAD, 30))
    assert [(a.obstacle, a.evidence) for a in got] == [("b0", "moved")]


@pytest.mark.parametrize("speed", [0.05, 0.1, 0.2, 0.3, 0.5])
@pytest.mark.parametrize("mass", [1.0, 4.0, 8.0])
def test_the_force_of_moved_bounds_breakaway_from_above(
    build: Build, speed: float, mass: float
) -> None:
    world = build(bench(block(gap_m=0.05, mass_kg=mass)))
    (end,) = ends(run(world, np.array([speed, 0.0]), round(0.1 / speed * 10) + 8))
    breakaway = world.scene.obstacles[0].breakaway_force_n
    assert end.evidence == "moved"
    assert breakaway - 1e-6 <= end.force_n <= 2.1 * breakaway


@pytest.mark.parametrize(
    ("speed", "mass"), [(0.1, 14.0), (0.1, 30.0), (0.3, 17.0), (0.5, 30.0)]
)
def test_the_force_of_not_moved_bounds_breakaway_from_below(
    build: Build, speed: float, mass: float
) -> None:
    """However hard the blow that began it."""
    world = build(bench(block(gap_m=0.05, mass_kg=mass)))
    (end,) = ends(run(world, np.array([speed, 0.0]), 40))
    assert end.evidence == "not_moved"
    assert 54.0 <= end.force_n <= world.scene.obstacles[0].breakaway_force_n
