"""Ways through obstacles: which lines to push them along, how fast to meet them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Task
from beacon_mj.numerics import norms
from beacon_mj.planners.contact.candidates import touching_point
from beacon_mj.planners.contact.push_model import gentle_speed_mps
from beacon_mj.planners.oracle.truth import TrueObstacle

#: Turns of a push from the direction of the path, after the path itself [rad].
TURNS = tuple(math.radians(a) for a in (0.0, -25.0, 25.0))
#: Gap between bumper and obstacle where a push through its centroid begins [m].
STANDOFF_M = 0.05
#: Share of the force that breaks an obstacle which a touch may reach.
GENTLE_SHARE = 0.6

Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """A path through some obstacles.

    Attributes:
        path_m: From start to goal, shape (m, 2) [m].
        soft: Ids of all obstacles that it may lead through.
        through: Those that it does lead through, in order.
    """

    path_m: Array
    soft: frozenset[str]
    through: tuple[TrueObstacle, ...]


def lines_through(way: Way, task: Task) -> Iterator[Points]:
    """Yield points to visit: none for the path itself, then pushes through centroids.

    Each push begins behind the obstacle and leads through its centroid.
    """
    yield ()
    if not way.through:
        return
    for turn in TURNS:
        points: list[tuple[float, float]] = []
        for obstacle in way.through:
            points += _through_centroid(way.path_m, obstacle, task, turn)
        yield tuple(points)


def gentle_touches(way: Way, task: Task, share: float) -> tuple[tuple[str, float], ...]:
    """Return the speed at which each soft obstacle may be met [m/s].

    It is a share of the robot's speed limit, and less for what would break.
    """
    return tuple((o.id, min(share * task.speed_mps, _gentle(o, task)))
                 for o in way.through)  # fmt: skip


def _gentle(obstacle: TrueObstacle, task: Task) -> float:
    if math.isinf(obstacle.break_force_n):
        return math.inf
    return gentle_speed_mps(
        GENTLE_SHARE * obstacle.break_force_n,
        obstacle.mass_kg,
        task.mass_kg,
        task.bumper_stiffness_npm,
    )


def _through_centroid(
    path: Array, obstacle: TrueObstacle, task: Task, turn: float
) -> list[tuple[float, float]]:
    """Return where a push begins, and its centroid."""
    footprint = obstacle.footprint
    centroid = footprint.centroid
    heading = _heading(path, centroid) + turn
    direction = np.array([math.cos(heading), math.sin(heading)])
    touch = touching_point(
        footprint.vertices, footprint.radius, centroid, direction, task.radius_m
    )
    begin = touch - STANDOFF_M * direction
    return [
        (float(begin[0]), float(begin[1])),
        (float(centroid[0]), float(centroid[1])),
    ]


def _heading(path: Array, point: Array) -> float:
    """Return the direction of the path's segment that is nearest to a point [rad]."""
    start, step = path[:-1], np.diff(path, axis=0)
    square = np.maximum((step * step).sum(axis=1), 1e-12)
    t = np.clip(((point - start) * step).sum(axis=1) / square, 0.0, 1.0)
    gap = norms(start + t[:, None] * step - point)
    x, y = step[int(np.argmin(gap))]
    return math.atan2(y, x)
