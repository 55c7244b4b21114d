"""Pushing: steady force, work, rows of boxes, and the limit of the drive."""

import numpy as np

from beacon_mj.constants import GRAVITY
from beacon_mj.fidelity.benches import bench, block
from beacon_mj.fidelity.law import Law
from beacon_mj.scene import Obstacle, Robot
from beacon_mj.world import StepOutcome, World


def push(world: World, speed_mps: float, steps: int) -> list[StepOutcome]:
    """Drive straight ahead."""
    return [world.step(np.array([speed_mps, 0.0])) for _ in range(steps)]


def bumper_n(outcomes: list[StepOutcome]) -> float:
    """Return the mean force that the bumper feels against the push [N]."""
    return float(np.mean([-o.bumper_force_n[0] for o in outcomes]))


def steady() -> list[Law]:
    """The force of a steady push is mu m g, whatever the speed."""
    rows = []
    for mass, speed in ((1.0, 0.3), (4.0, 0.1), (4.0, 0.3), (4.0, 0.5), (10.0, 0.3)):
        world = World(bench(block(gap_m=0.02, mass_kg=mass)))
        outcomes = push(world, speed, round(2.0 / speed))
        expected = 0.5 * mass * GRAVITY
        law = f"steady push of {mass:g} kg at {speed} m/s: mu m g"
        rows.append(Law(check="steady", law=law, expected=expected, unit="N",
                        measured=bumper_n(outcomes[len(outcomes) // 2 :]),
                        tolerance=0.05 * expected))  # fmt: skip
    return rows


def work() -> list[Law]:
    """The drives' work on a push at steady speed is mu m g d."""
    world = World(bench(block(gap_m=0.02)))
    push(world, 0.3, 10)
    start = world.poses[0, 0]
    outcomes = push(world, 0.3, 50)
    expected = 0.5 * 4.0 * GRAVITY * float(world.poses[0, 0] - start)
    measured = sum(o.actuator_work_j for o in outcomes)
    return [Law(check="work", law="work of the drives over 1.5 m: mu m g d", unit="J",
                expected=expected, measured=measured,
                tolerance=0.05 * expected)]  # fmt: skip


def row_of_boxes() -> list[Law]:
    """A row of n boxes takes n mu m g."""
    rows = []
    for count in (1, 2, 3, 4):
        blocks = [_brick(k) for k in range(count)]
        world = World(bench(*blocks))
        outcomes = push(world, 0.2, 60)
        expected = count * 0.4 * 1.0 * GRAVITY
        rows.append(Law(check="row", law=f"row of {count} boxes: n mu m g", unit="N",
                        expected=expected, measured=bumper_n(outcomes[20:]),
                        tolerance=0.08 * expected))  # fmt: skip
    return rows


def _brick(k: int) -> Obstacle:
    return block(f"brick_{k}", 0.02 + 0.301 * k, side_m=0.3, mass_kg=1.0, friction=0.4)


def saturation() -> list[Law]:
    """An obstacle above F_max stays, and the force on it is F_max; below, it goes."""
    limit = Robot().force_max_n
    world = World(bench(block(gap_m=0.0, mass_kg=1.3 * limit / (0.5 * GRAVITY))))
    outcomes = push(world, 0.05, 40)
    travel = 1e3 * float(world.poses[0, 0] - world.scene.obstacles[0].x_m)
    return [
        Law(check="saturation", law="force on an obstacle of 1.3 F_max: F_max",
            expected=limit, measured=bumper_n(outcomes[20:]), tolerance=0.01 * limit,
            unit="N"),
        Law(check="saturation", law="travel of an obstacle of 1.3 F_max in 4 s: none",
            expected=0.0, measured=travel, tolerance=0.5, unit="mm"),
        _feasible(0.8 * limit),
    ]  # fmt: skip


def _feasible(force_n: float) -> Law:
    """Push what needs `force_n`: it gains speed with (F_max - mu m g) / (m + M)."""
    robot, speed, mass = Robot(), 0.3, force_n / (0.5 * GRAVITY)
    world = World(bench(block(gap_m=0.0, mass_kg=mass)))
    start = world.poses[0, 0]
    push(world, speed, 40)
    gain = (robot.force_max_n - force_n) / (mass + robot.mass_kg)
    expected = speed * 4.0 - 0.5 * speed**2 / gain
    law = f"travel of an obstacle of {force_n:g} N in 4 s: v t - v^2 / (2 a)"
    return Law(check="saturation", law=law, expected=expected, unit="m",
               measured=float(world.poses[0, 0] - start),
               tolerance=0.08 * expected)  # fmt: skip
