"""Single pushes in every world, against what a planner predicts of them.

The robot stands before an obstacle of a generated scene and drives through its
centroid. The prediction is the planners' own (paper II.D, II.G), on true outlines and
true forces: what moves, and that it takes E = sum F_i d_i.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import msgspec
import numpy as np

from beacon_mj.constants import MOVED_M
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.sensor import Sensor
from beacon_mj.episode.worlds import world_of
from beacon_mj.geometry import Array
from beacon_mj.numerics import norms
from beacon_mj.planners.contact.candidates import touching_point
from beacon_mj.planners.contact.push_model import PushWorld
from beacon_mj.scene import Scene
from beacon_mj.scene.shapes import name_of
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.streams import stream

#: The worlds by name.
WORLDS = {
    "mujoco": Protocol(),
    "paper": Protocol(world="planar"),
    "limit-surface": Protocol(world="planar", planar_push="limit-surface"),
}
TRAVEL_M = 0.25  #: How far the robot drives on after it touches.
SPEED_MPS = 0.2
STANDOFF_M = 0.02  #: Gap before the push.
ROOM_M = 0.003  #: Gap to everything else where it stands.
PER_SCENE = 3  #: Pushes of one scene.


class Trial(NamedTuple):
    """What one push did in one world.

    Attributes:
        moved: Obstacles that travelled more than 10 mm.
        evidence: How the attempt on the pushed obstacle ended; "" if with nothing.
        force_n: The force that this is evidence of; 0 if there is none [N].
        broken: Whether anything broke.
        work_j: Work of the drives, without what the robot's own motion took [J].
        model_j: Sum of F_i d_i over what moved, true forces [J].
    """

    moved: frozenset[int]
    evidence: str
    force_n: float
    broken: bool
    work_j: float
    model_j: float


class Push(NamedTuple):
    """One push: what it is of, what is predicted, and what each world did.

    Attributes:
        family: The scene's family.
        shape: Everyday name of the pushed shape.
        mass_kg: Its mass.
        breakaway_n: Its breakaway force mu m g [N].
        feasible: Whether the whole cascade is predicted to give way.
        predicted: Obstacles that are predicted to move more than 10 mm.
        first: The pushed obstacle.
        trials: What happened, by world.
    """

    family: str
    shape: str
    mass_kg: float
    breakaway_n: float
    feasible: bool
    predicted: frozenset[int]
    first: int
    trials: dict[str, Trial]


def pushes(families: Sequence[str], scenes: int, seed: int = 0) -> Iterator[Push]:
    """Yield pushes of free obstacles in generated scenes.

    Args:
        families: Scene families.
        scenes: Scenes of each.
        seed: Seed of the scenes.
    """
    for family in families:
        for index in range(scenes):
            scene = generate_scene(family, index, seed=seed)
            rng = stream("analysis", seed, family, index)
            found = 0
            for i in rng.permutation(len(scene.obstacles)).tolist():
                heading = float(rng.uniform(-math.pi, math.pi))
                direction = np.array([math.cos(heading), math.sin(heading)])
                start = _start(scene, i, direction)
                if start is not None and found < PER_SCENE:
                    found += 1
                    yield _push(scene, i, direction, start)


def _start(scene: Scene, i: int, direction: Array) -> Array | None:
    """Return where the robot stands before a push, or None if there is no room."""
    obstacle, radius = scene.obstacles[i], scene.robot.radius_m
    if obstacle.fixed:
        return None
    outline = obstacle.footprint
    touch = touching_point(
        outline.vertices, outline.radius, outline.centroid, direction, radius
    )
    x, y = start = touch - STANDOFF_M * direction
    west, south, east, north = scene.workspace_m
    inside = west + radius <= x <= east - radius and south + radius <= y <= (
        north - radius
    )
    gaps = scene.footprints.distance(start)
    return start if inside and gaps.min() >= radius + ROOM_M else None


def _push(scene: Scene, i: int, direction: Array, start: Array) -> Push:
    moved = msgspec.structs.replace(scene, start_m=(float(start[0]), float(start[1])))
    feasible, predicted = _prediction(moved, i, direction)
    obstacle = scene.obstacles[i]
    return Push(
        scene.family, name_of(obstacle.shape), obstacle.mass_kg,
        obstacle.breakaway_force_n, feasible, predicted, i,
        {name: trial(moved, i, direction, p) for name, p in WORLDS.items()},
    )  # fmt: skip


def _prediction(scene: Scene, i: int, direction: Array) -> tuple[bool, frozenset[int]]:
    """Return whether the cascade is feasible, and what moves up to where it ends."""
    protocol = WORLDS["paper"].certain()
    sensed = Sensor(world_of(scene, protocol), protocol).observe(None, 1.0).obstacles
    names = {o.id: k for k, o in enumerate(scene.obstacles)}
    order = [names[o.id] for o in sensed]
    forces = [scene.obstacles[k].breakaway_force_n for k in order]
    world, first, travel_m = PushWorld(sensed), order.index(i), TRAVEL_M

    def cascade(travel_m: float) -> tuple[bool, float, frozenset[int]]:
        found = world.cascade(
            first, travel_m * direction, forces.__getitem__, scene.robot.force_max_n,
            lambda k: math.isinf(forces[k]),
        )  # fmt: skip
        moved = frozenset(order[k] for k, d in found.moved if d > MOVED_M)
        return found.feasible, found.room_m, moved

    feasible, room_m, moved = cascade(travel_m)
    if not feasible:
        moved = cascade(room_m)[2] if room_m > MOVED_M else frozenset()
    return feasible, moved


def trial(scene: Scene, i: int, direction: Array, protocol: Protocol) -> Trial:
    """Push obstacle i of a scene in the world of a protocol."""
    world = world_of(scene, protocol)
    before = world.poses[:, :2].copy()
    steps = math.ceil((STANDOFF_M + TRAVEL_M) / (SPEED_MPS * 0.1))
    outcomes = [world.step(SPEED_MPS * direction) for _ in range(steps)]
    travel = norms(world.poses[:, :2] - before)
    moved = frozenset(np.flatnonzero(travel > MOVED_M).tolist())
    name = scene.obstacles[i].id
    own = [a for o in outcomes for a in o.attempts if a.obstacle == name]
    evidence, force_n = (own[0].evidence, own[0].force_n) if own else ("", 0.0)
    speed = norms(world.velocity_mps)
    kinetic = 0.5 * scene.robot.mass_kg * float(speed * speed)
    work = math.fsum(o.actuator_work_j for o in outcomes) - kinetic
    forces = [scene.obstacles[k].breakaway_force_n for k in moved]
    model = math.fsum(f * travel[k] for f, k in zip(forces, moved, strict=True))
    broken = any(o.damages for o in outcomes)
    return Trial(moved, evidence, force_n, broken, work, model)
