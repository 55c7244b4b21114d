"""Coulomb friction: creep, breakaway, rolling, and sliding to a stop."""

import math

import mujoco
import numpy as np

from beacon_mj.constants import CLASSES, GRAVITY
from beacon_mj.fidelity.benches import bench, block, obstacle
from beacon_mj.fidelity.law import Law
from beacon_mj.scene import Obstacle, Scene, shapes
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import World

RAMP = 0.05  #: Growth of the pull, as a share of the expected breakaway force [1/s].
SLIDES_MPS = 1e-3  #: Speed at which an obstacle counts as broken away [m/s].


def pull(world: World, index: int, force_n: float, height_m: float) -> None:
    """Apply a horizontal force along x to an obstacle, `height_m` above the floor."""
    body = world.model.body(world.scene.obstacles[index].id).id
    lever = height_m - 0.5 * world.scene.obstacles[index].shape.height_m
    world.data.xfrc_applied[body] = (force_n, 0.0, 0.0, 0.0, lever * force_n, 0.0)


def creep() -> list[Law]:
    """A box pulled with 0.99 of its Coulomb limit for 5 s stays where it is."""
    rows = []
    for share, expected, tolerance in ((0.99, 0.0, 0.5), (1.01, 613.0, 61.0)):
        world = World(bench(block(gap_m=1.0)))
        limit = world.scene.obstacles[0].breakaway_force_n
        pull(world, 0, share * limit, 0.0)
        start = world.data.qpos[4]
        mujoco.mj_step(world.model, world.data, nstep=2500)
        travel = 1e3 * float(world.data.qpos[4] - start)
        law = f"travel in 5 s at {share} of mu m g: (F/m - mu g) t^2 / 2, not below 0"
        rows.append(Law(check="creep", law=law, expected=expected, measured=travel,
                        tolerance=tolerance, unit="mm"))  # fmt: skip
    return rows


def breakaway() -> list[Law]:
    """Every free obstacle of a generated scene breaks away at its own mu m g."""
    scene = generate_scene("cluttered", 0)
    world = World(scene)
    rows = []
    for i, o in enumerate(scene.obstacles):
        if o.fixed:
            continue
        expected = o.breakaway_force_n
        law = f"mu m g of {o.id} ({shapes.name_of(o.shape)}) in {scene.name}"
        measured = _breakaway(world, i, expected, 0.0)
        rows.append(Law(check="breakaway", law=law, expected=expected, unit="N",
                        measured=measured, tolerance=0.03 * expected))  # fmt: skip
    return rows


def rolling() -> list[Law]:
    """A pull at the centre rolls a ball, or a capsule across its axis.

    Friction and rolling friction share one elliptic cone, with rolling coefficient c
    [m] and radius r: F = m g / sqrt(1/mu^2 + (r/c)^2), which is c/r m g for c << mu r.
    Along its axis a capsule does not roll; it slides at mu m g.
    """
    ball = obstacle("ball", shapes.Sphere(radius_m=0.13), mass_kg=2.0)
    capsule = shapes.Capsule(radius_m=0.1, length_m=0.5)
    along = obstacle("capsule", capsule, mass_kg=2.0)
    across = obstacle("capsule", capsule, mass_kg=2.0, yaw_rad=0.5 * math.pi)
    rows = []
    for name, o in (("ball", ball), ("capsule across its axis", across)):
        expected = _rolls_at(bench(o), o)
        law = f"{name}, pulled at its centre: m g / sqrt(1/mu^2 + (r/c)^2)"
        measured = _breakaway(World(bench(o)), 0, expected, 0.5 * o.shape.height_m)
        rows.append(Law(check="rolling", law=law, expected=expected, unit="N",
                        measured=measured, tolerance=0.05 * expected))  # fmt: skip
    expected = along.breakaway_force_n
    measured = _breakaway(World(bench(along)), 0, expected, 0.0)
    rows.append(Law(check="rolling", law="capsule along its axis: mu m g", unit="N",
                    expected=expected, measured=measured,
                    tolerance=0.03 * expected))  # fmt: skip
    return rows


def deceleration() -> list[Law]:
    """A box let go at 1 m/s slides to a stop with mu g."""
    rows = []
    for friction in (0.3, 0.6):
        world = World(bench(block(gap_m=0.5, friction=friction)))
        world.data.qvel[4] = 1.0
        start = float(world.data.qpos[4])
        mujoco.mj_step(world.model, world.data, nstep=round(0.15 / 0.002))
        slowed = (1.0 - float(world.data.qvel[4])) / 0.15
        mujoco.mj_step(world.model, world.data, nstep=500)
        law = f"deceleration of a sliding box, mu = {friction}: mu g"
        expected = friction * GRAVITY
        rows.append(Law(check="deceleration", law=law, expected=expected, unit="m/s^2",
                        measured=slowed, tolerance=0.03 * expected))  # fmt: skip
        stop = 0.5 / expected
        law = f"its stopping distance from 1 m/s, mu = {friction}: v^2 / (2 mu g)"
        rows.append(Law(check="deceleration", law=law, expected=stop, unit="m",
                        measured=float(world.data.qpos[4]) - start,
                        tolerance=0.03 * stop))  # fmt: skip
    return rows


def _rolls_at(scene: Scene, o: Obstacle) -> float:
    surface = scene.surfaces[CLASSES.index(o.interaction)]
    lever = 0.5 * o.shape.height_m / surface.rolling_friction_m
    return o.mass_kg * GRAVITY / math.hypot(1.0 / o.friction, lever)


def _breakaway(world: World, index: int, expected_n: float, height_m: float) -> float:
    """Raise a pull slowly; return it when the obstacle starts to move [N]."""
    world.reset()
    address = int(world.model.joint(world.scene.obstacles[index].id).dofadr[0])
    share, step = 0.9, RAMP * world.model.opt.timestep
    while share < 1.2:
        pull(world, index, share * expected_n, height_m)
        mujoco.mj_step(world.model, world.data)
        speed = float(np.hypot(*world.data.qvel[address : address + 2]))
        if share > 0.91 and speed > SLIDES_MPS:
            return share * expected_n
        share += step
    return math.nan
