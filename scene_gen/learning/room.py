"""What a layout with doors proposes: walls, doors, stages, and the prior.

A proposal holds nothing of what is true of the doors: that is drawn afterwards.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from beacon_mj.constants import GRAVITY, WALL_KIND
from beacon_mj.scene import Obstacle, Perceived
from beacon_mj.scene.shapes import Box
from beacon_mj.scene_gen.prototypes import DECIMALS
from beacon_mj.scene_gen.rooms import Point

WALL_M = 0.2  #: Thickness of inner walls.
DOOR_M = 0.28  #: Depth of a door along the way.
HEIGHT_M = 0.3  #: Height of walls and doors.
SEAM_M = 0.03  #: Gap on either side of a door.
FRICTION = 0.45
WALL_SCORES = (0.98, 0.01, 0.01)
_WALL_DENSITY_KGM3 = 2000.0


@dataclass(frozen=True, kw_only=True, slots=True)
class Door:
    """One door, across the way east.

    Attributes:
        id: Its name in the proposal.
        x_m: Its middle, east.
        y_m: Its middle, north.
        width_m: Its size across the way.
        label: Its kind's number, or its own: what it has in common with others.
        kind: What it looks like, if looks tell something.
        nominal_n: Perceived breakaway force [N].
    """

    id: str
    x_m: float
    y_m: float
    width_m: float
    label: int
    kind: str | None
    nominal_n: float


@dataclass(frozen=True, kw_only=True, slots=True)
class Stage:
    """Doors between two places that the robot must pass."""

    entry_m: Point
    exit_m: Point
    doors: tuple[Door, ...]


class Latent(Protocol):
    """What is hidden, and how it makes doors open."""

    @property
    def weights(self) -> tuple[float, ...]:
        """Prior weight of each world, (w,)."""

    @property
    def error(self) -> float:
        """Standard deviation of the logarithm of a door's own error of its force."""

    @property
    def scale_error(self) -> float:
        """The same of the factor that all doors have in common; 0 if there is none."""

    def chance(self, world: int, door: Door) -> float:
        """Return the probability that a door opens, given the world."""

    def force_n(
        self, world: int, door: Door, opens: bool, rng: np.random.Generator
    ) -> float:
        """Draw the true breakaway force of a door of which it is known if it opens."""

    @property
    def welded(self) -> bool:
        """Whether doors that do not open are welded; else they are too heavy."""

    @property
    def scores(self) -> tuple[float, float, float] | None:
        """Perceived class scores of all doors; None for the prior's."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Part:
    """Stages that share one latent.

    Attributes:
        key: Its name among the parts of the scene, for the stream of its worlds.
        latent: What is hidden.
        stages: The stages.
    """

    key: str
    latent: Latent
    stages: tuple[Stage, ...]


@dataclass(frozen=True, kw_only=True, slots=True)
class Room:
    """One proposal.

    Attributes:
        ways: Start and goal of each day, one day outside missions.
        walls: Inner walls.
        parts: The doors, by what they have in common.
    """

    ways: tuple[tuple[Point, Point], ...]
    walls: tuple[Obstacle, ...]
    parts: tuple[Part, ...]

    @property
    def doors(self) -> tuple[Door, ...]:
        """All doors, each once."""
        stages = [stage for part in self.parts for stage in part.stages]
        return tuple(dict.fromkeys(door for stage in stages for door in stage.doors))


def wall(name: str, west: float, south: float, east: float, north: float) -> Obstacle:
    """Return an inner wall that fills a rectangle [m]."""
    shape = Box(
        length_m=round(east - west, DECIMALS),
        width_m=round(north - south, DECIMALS),
        height_m=HEIGHT_M,
    )
    return Obstacle(
        id=name,
        shape=shape,
        x_m=round(0.5 * (west + east), DECIMALS),
        y_m=round(0.5 * (south + north), DECIMALS),
        yaw_rad=0.0,
        interaction="safe",
        fixed=True,
        density_kgm3=_WALL_DENSITY_KGM3,
        friction=FRICTION,
        break_force_n=None,
        perceived=Perceived(
            scores=WALL_SCORES,
            density_kgm3=_WALL_DENSITY_KGM3,
            friction=FRICTION,
            kind=WALL_KIND,
        ),
    )


def wall_with_openings(
    name: str, x: float, height_m: float, openings: list[tuple[float, float]]
) -> list[Obstacle]:
    """Return the pieces of a wall across the room but for openings (south, north)."""
    edges = [0.0, *(v for span in sorted(openings) for v in span), height_m]
    half = 0.5 * WALL_M
    return [
        wall(f"{name}_{k}", x - half, low, x + half, high)
        for k, (low, high) in enumerate(zip(edges[::2], edges[1::2], strict=True))
    ]


def door_obstacle(
    door: Door, scores: tuple[float, float, float], force_n: float, *, welded: bool
) -> Obstacle:
    """Return a door as it truly is, and as it is perceived.

    Args:
        door: The door.
        scores: Perceived class scores.
        force_n: True breakaway force; of a welded one, what it would be.
        welded: Whether it is welded to the floor.
    """
    shape = Box(
        length_m=DOOR_M, width_m=round(door.width_m, DECIMALS), height_m=HEIGHT_M
    )
    per_newton = 1.0 / (FRICTION * GRAVITY * shape.volume_m3)
    return Obstacle(
        id=door.id,
        shape=shape,
        x_m=round(door.x_m, DECIMALS),
        y_m=round(door.y_m, DECIMALS),
        yaw_rad=0.0,
        interaction="safe" if welded else "movable",
        fixed=welded,
        density_kgm3=round(force_n * per_newton, DECIMALS),
        friction=FRICTION,
        break_force_n=None,
        perceived=Perceived(
            scores=scores,
            density_kgm3=round(door.nominal_n * per_newton, DECIMALS),
            friction=FRICTION,
            kind=door.kind,
        ),
    )
