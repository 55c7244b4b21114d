"""The cheapest way to the goal, past some obstacles and straight through others."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array, Footprints
from beacon_mj.interface import Observation
from beacon_mj.motion.string_pulling import shorten
from beacon_mj.planners.contact.cost_map import ContactMap


class WayThrough(NamedTuple):
    """A path, shape (m, 2) [m], and the indices of the obstacles it leads through."""

    path_m: Array
    through: NDArray[np.int64]


def way_through(
    ways: ContactMap,
    observation: Observation,
    costs: Mapping[int, float],
    radius_m: float,
    margin_m: float,
) -> WayThrough | None:
    """Return the cheapest way, pulled tight past what it does not lead through.

    Args:
        ways: The search, on its grid.
        observation: The map.
        costs: Cost per metre of going right through each obstacle that may be pushed,
            by its index; the others block.
        radius_m: Radius of the robot's disc [m].
        margin_m: Distance that the disc keeps from what it goes round [m].

    Returns:
        The way; None if there is none.
    """
    footprints = observation.footprints
    ways.plan(observation, costs)
    if (path := ways.path) is None:
        return None
    soft = np.zeros(len(footprints), np.bool_)
    soft[list(costs)] = True
    inside = (footprints.distances(path) < radius_m).any(axis=0) & soft
    others = Footprints(footprints.vertices[~inside], footprints.radius[~inside])
    tight = shorten(path, others, radius_m + margin_m)
    return WayThrough(tight, np.flatnonzero(inside))
