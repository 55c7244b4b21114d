"""Pushes off the centre of friction, against quasi-static pushing in the plane.

A box and a prism are pushed at low speed beside their centre: they turn, and slip to
the side. The planar world with its push model `limit-surface` says how far. It knows no
friction of the bumper: in the strict rows there is none either, and so little on the
floor that a sliding body does not chatter. In the others the bumper is the shipped one,
whose friction goes almost wholly into holding the hopping body; it drags bodies
sideways by millimetres, so there are no rows on slip.
"""

import math
from typing import NamedTuple

import numpy as np

from beacon_mj.fidelity.benches import START_M, bench, obstacle
from beacon_mj.fidelity.law import Law
from beacon_mj.scene import Robot, Scene, shapes
from beacon_mj.world import BaseWorld, World
from beacon_mj.world.planar import PlanarWorld

SPEED_MPS = 0.05
TRAVEL_M = 0.095  #: Travel of the bumper after which angle and slip are compared.
GAP_M = 0.005  #: Gap between bumper and face at the start.
#: Offset of a push [m], and the share by which the angle may be off with the shipped
#: bumper: a small turn is lost more easily in the hops of a sliding body.
SHIPPED = ((0.02, 0.15), (0.04, 0.10), (0.06, 0.10), (0.08, 0.10), (0.10, 0.10))
STRICT, SLIP_M = 0.05, 0.001  #: The same without friction, and the slip allowed [m].
_SLIPPERY = 1e-5  #: The least friction that MuJoCo knows.
_SIDE_M = 0.2  #: From the centre to the face that is pushed.


class Turn(NamedTuple):
    """What a push did.

    Attributes:
        angle_rad: How far the body turned, counter-clockwise.
        slip_m: How far its centre went sideways.
    """

    angle_rad: float
    slip_m: float


def off_centre() -> list[Law]:
    """Angle and slip of pushes off the centre of friction."""
    rows = []
    for offset, share in SHIPPED:
        for name, shape in (("box", _box()), ("prism", _pentagon())):
            rows += _strict(name, shape, offset)
            rows.append(_shipped(name, shape, offset, share))
    return rows


def _strict(name: str, shape: shapes.Shape, offset: float) -> list[Law]:
    """Return the rows of a body that slides smoothly, without friction at all else."""
    scene = _scene(shape, offset, mass_kg=40.0, friction=0.05)
    world = World(scene)
    world.model.geom("bumper").friction[:] = _SLIPPERY
    expected, measured = pushed(_reference(scene)), pushed(world)
    angle = math.degrees(expected.angle_rad)
    case = f"{name} pushed {100 * offset:.0f} cm off, frictionless bumper"
    return [
        Law(check="off-centre", law=f"{case}: angle", unit="deg", expected=angle,
            measured=math.degrees(measured.angle_rad), tolerance=STRICT * abs(angle)),
        Law(check="off-centre", law=f"{case}: slip", unit="mm",
            expected=1e3 * expected.slip_m, measured=1e3 * measured.slip_m,
            tolerance=1e3 * SLIP_M),
    ]  # fmt: skip


def _shipped(name: str, shape: shapes.Shape, offset: float, share: float) -> Law:
    """Return the row of a body as it is pushed in the benchmark."""
    scene = _scene(shape, offset, mass_kg=4.0, friction=0.5)
    angle = math.degrees(pushed(_reference(scene)).angle_rad)
    law = f"{name} pushed {100 * offset:.0f} cm off, shipped bumper: angle"
    return Law(check="off-centre", law=law, unit="deg", expected=angle,
               measured=math.degrees(pushed(World(scene)).angle_rad),
               tolerance=share * abs(angle))  # fmt: skip


def pushed(world: BaseWorld) -> Turn:
    """Push the one obstacle of a world until the bumper has travelled `TRAVEL_M`."""
    ends = [_state(world)]
    while ends[-1][0] < GAP_M + TRAVEL_M:
        world.step(np.array([SPEED_MPS, 0.0]))
        ends.append(_state(world))
    before, after = np.array(ends[-2]), np.array(ends[-1])
    share = (GAP_M + TRAVEL_M - before[0]) / (after[0] - before[0])
    _, angle, along = before + share * (after - before)
    return Turn(float(angle), float(along - ends[0][2]))


def _state(world: BaseWorld) -> tuple[float, float, float]:
    """Return the bumper's travel, the body's angle, and its place to the side."""
    bumper = world.position_m + world.data.qpos[2:4]
    _, y, _, w, _, _, z = world.poses[0]
    return float(bumper[0] - START_M[0]), 2.0 * math.atan2(z, w), float(y)


def _reference(scene: Scene) -> BaseWorld:
    return PlanarWorld(scene, push="limit-surface")


def _scene(
    shape: shapes.Shape, offset: float, *, mass_kg: float, friction: float
) -> Scene:
    """Return a body before the robot, its centre beside the way."""
    ahead = Robot().radius_m + GAP_M + _SIDE_M
    position = START_M[0] + ahead, START_M[1] - offset
    return bench(obstacle("body", shape, position, mass_kg=mass_kg, friction=friction))


def _box() -> shapes.Box:
    return shapes.Box(length_m=2.0 * _SIDE_M, width_m=0.3, height_m=0.3)


def _pentagon() -> shapes.Prism:
    """Return a regular pentagon with a face towards the robot, and feet."""
    around = _SIDE_M / math.cos(math.pi / 5.0)
    angles = [math.pi * k / 2.5 for k in range(5)]
    corners = np.array([(math.cos(a), math.sin(a)) for a in angles]) * around
    vertices = tuple((float(x), float(y)) for x, y in corners)
    return shapes.Prism(kind="pentagon", vertices_m=vertices, height_m=0.3)
