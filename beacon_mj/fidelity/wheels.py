"""The differential drive: rolling, turning, standing, pushing, and its energy."""

import math

import numpy as np

from beacon_mj.constants import GRAVITY
from beacon_mj.fidelity.benches import START_M, bench, block
from beacon_mj.fidelity.energy import audit_row
from beacon_mj.fidelity.law import Law
from beacon_mj.fidelity.pushing import bumper_n, push
from beacon_mj.fidelity.repeat import wander
from beacon_mj.scene import Obstacle
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.robots import shipped_robot
from beacon_mj.world import World

NAME = "diff-drive"
SPEED_MPS, TURN_RADPS = 0.5, 2.0


def on_wheels(*obstacles: Obstacle) -> World:
    """Return a bench with the differential drive."""
    return World(bench(*obstacles), robot=shipped_robot(NAME))


def rolling() -> list[Law]:
    """A wheel rolls without slip, and the robot keeps to its line."""
    world = on_wheels()
    push(world, SPEED_MPS, 20)
    joint = world.model.joint("wheel_left")
    radius = float(world.model.geom("wheel_left").size[0])
    before, turned = world.position_m, float(world.data.qpos[joint.qposadr[0]])
    push(world, SPEED_MPS, 35)
    after = world.position_m
    turned = float(world.data.qpos[joint.qposadr[0]]) - turned
    ratio = float(after[0] - before[0]) / (radius * turned)
    drift = 1e3 * abs(float(after[1]) - START_M[1])
    return [
        Law(check="wheels", law="way over turned wheel, at 0.5 m/s: r",
            expected=1.0, measured=ratio, tolerance=1e-3),
        Law(check="wheels", law="drift off a straight line of 2.7 m: none",
            expected=0.0, measured=drift, tolerance=0.1, unit="mm"),
    ]  # fmt: skip


def turning() -> list[Law]:
    """A turn on the spot has the rate that was asked for, and stays on the spot."""
    world, still = on_wheels(), np.zeros(2)
    for _ in range(10):
        world.step(still, TURN_RADPS)
    yaw = int(world.model.joint("base_yaw").qposadr[0])
    before = float(world.data.qpos[yaw])
    for _ in range(30):
        world.step(still, TURN_RADPS)
    rate = (float(world.data.qpos[yaw]) - before) / 3.0
    left = world.position_m - np.array(START_M)
    return [
        Law(check="wheels", law="rate of a turn on the spot at 2 rad/s",
            expected=TURN_RADPS, measured=rate, tolerance=1e-3 * TURN_RADPS,
            unit="rad/s"),
        Law(check="wheels", law="way in a turn on the spot: none", expected=0.0,
            measured=1e3 * float(np.abs(left).max()), tolerance=0.1, unit="mm"),
    ]  # fmt: skip


def standing() -> list[Law]:
    """A robot that was told to stop, with nothing pulling, stays where it is."""
    world = on_wheels()
    push(world, SPEED_MPS, 5)
    push(world, 0.0, 10)
    before = world.position_m
    push(world, 0.0, 100)
    creep = 1e3 * float(np.abs(world.position_m - before).max())
    return [Law(check="wheels", law="creep in 10 s without a load: none", expected=0.0,
                measured=creep, tolerance=0.01, unit="mm")]  # fmt: skip


def force() -> list[Law]:
    """A steady push is mu m g, and against what cannot move the motors give way."""
    world = on_wheels(block(gap_m=0.02, mass_kg=4.0))
    outcomes = push(world, 0.3, 40)
    steady = 0.5 * 4.0 * GRAVITY
    limit = world.robot.force_max_n
    heavy = block(gap_m=0.0, mass_kg=1.3 * limit / (0.5 * GRAVITY))
    stalled = on_wheels(heavy)
    held = push(stalled, 0.05, 40)
    joint = stalled.model.joint("wheel_left")
    spun = abs(float(stalled.data.qvel[joint.dofadr[0]]))
    return [
        Law(check="wheels", law="steady push of 4 kg at 0.3 m/s: mu m g",
            expected=steady, measured=bumper_n(outcomes[20:]), tolerance=0.05 * steady,
            unit="N"),
        Law(check="wheels", law="force on an obstacle of 1.3 F_max: F_max",
            expected=limit, measured=bumper_n(held[20:]), tolerance=0.01 * limit,
            unit="N"),
        Law(check="wheels", law="wheels at that force: at rest", expected=0.0,
            measured=spun, tolerance=0.01, unit="rad/s"),
    ]  # fmt: skip


def turned_bumper() -> list[Law]:
    """The bumper feels a push in the arena's frame, whichever way the robot faces."""
    world = on_wheels(block(gap_m=0.02, mass_kg=4.0))
    for _ in range(10):
        world.step(np.zeros(2), math.pi)
    outcomes = push(world, 0.3, 45)
    steady = 0.5 * 4.0 * GRAVITY
    across = float(np.mean([abs(o.bumper_force_n[1]) for o in outcomes[30:]]))
    return [
        Law(check="wheels", law="the same push with the tail ahead: mu m g",
            expected=steady, measured=bumper_n(outcomes[30:]),
            tolerance=0.05 * steady, unit="N"),
        Law(check="wheels", law="across it: at most the bumper's friction, mu_b mu m g",
            expected=0.0, measured=across, tolerance=0.1 * steady, unit="N"),
    ]  # fmt: skip


def repeat() -> list[Law]:
    """Two worlds, a world that was reset and one that is watched give equal bits."""
    scene, robot = generate_scene("cluttered", 0), shipped_robot(NAME)
    world = World(scene, robot=robot)
    first = wander(world)
    world.reset()
    second = wander(world)
    watched = wander(World(scene, watch=lambda: None, robot=robot))
    return [
        Law(check="wheels", law=law, expected=1.0, measured=float(same), tolerance=0.0)
        for law, same in (
            ("states of a world that was reset", first == second),
            ("states with quiet periods, and step by step", first == watched),
        )
    ]


def energy() -> list[Law]:
    """The motors' work is all losses plus what is stored at the end."""
    return [audit_row("cluttered", 0, "wheels", shipped_robot(NAME))]
