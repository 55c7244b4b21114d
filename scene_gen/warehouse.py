"""The layout `warehouse`: racks, cross aisles, pallets, and what lies about.

Rows of racks stand across the way from wall to wall. Cross aisles lead through them. In
each row a pallet stands in the cross aisle nearest to the straight line, and in some of
the others: too wide to be passed, and light enough to be pushed out of the way.
"""

import math
from typing import NamedTuple

import shapely

from beacon_mj.scene import Obstacle
from beacon_mj.scene.shapes import Box
from beacon_mj.scene_gen.layouts import (
    NoRoomError,
    add_scattered,
    at,
    end_discs,
    layout,
)
from beacon_mj.scene_gen.prototypes import DECIMALS
from beacon_mj.scene_gen.rooms import Point
from beacon_mj.scene_gen.sampling import Sampler

_ENDS_M = 1.5  #: From the west and the east wall to the nearest row, at least.
_SEAM_M = 0.03  #: Gap between racks, and between a rack and a wall.
_JITTER_M = 0.4  #: How far a cross aisle may lie off its place in the row.
_SKEW_RAD = 0.05  #: How far a pallet may be turned.
#: Kept free before and behind a cross aisle: length, and width beyond it.
_LANDING_M = (0.9, 0.1)


class _CrossAisle(NamedTuple):
    """A way through a row, from south to north [m]."""

    low: float
    high: float
    pallet_m: float

    @property
    def middle(self) -> float:
        return 0.5 * (self.low + self.high)


@layout("warehouse")
def warehouse(sampler: Sampler, start: Point, goal: Point) -> list[Obstacle]:
    """Rows of racks with cross aisles, pallets in some, and scattered obstacles.

    `obstacle_count` counts all of them.
    """
    placed: list[Obstacle] = []
    forbidden = end_discs(sampler, start, goal)
    for x in _rows(sampler):
        crossing = start[1] + (x - start[0]) / (goal[0] - start[0]) * (
            goal[1] - start[1]
        )
        aisles = _cross_aisles(sampler)
        placed += _racks(sampler, x, aisles)
        blocked = _blocked(sampler, aisles, crossing)
        placed += [_pallet(sampler, x, aisle) for aisle in blocked]
        forbidden += [_landing(x, aisle) for aisle in aisles]
    left = sampler.count("obstacle_count") - len(placed)
    if left < 0:
        raise NoRoomError(len(placed))
    add_scattered(sampler, placed, forbidden, left)
    return placed


def _rows(sampler: Sampler) -> list[float]:
    """Return where the rows stand, evenly spaced about the middle of the room [m]."""
    _, _, width, _ = sampler.workspace_m
    pitch = sampler.family.value("rack_pitch")
    count = 1 + math.floor((width - 2.0 * _ENDS_M) / pitch + 1e-9)
    first = 0.5 * (width - (count - 1) * pitch)
    return [first + k * pitch for k in range(count)]


def _cross_aisles(sampler: Sampler) -> list[_CrossAisle]:
    """Draw the cross aisles of one row, about evenly spaced."""
    family, (_, _, _, height) = sampler.family, sampler.workspace_m
    count = max(2, round(height / family.value("cross_aisle_pitch")))
    pitch = height / count
    aisles = []
    for k in range(count):
        pallet = sampler.uniform(family.range("pallet_width"))
        middle = (k + 0.5) * pitch + sampler.uniform((-_JITTER_M, _JITTER_M))
        half = 0.5 * pallet + sampler.uniform(family.range("pallet_gap"))
        aisles.append(_CrossAisle(middle - half, middle + half, pallet))
    return aisles


def _blocked(
    sampler: Sampler, aisles: list[_CrossAisle], crossing: float
) -> list[_CrossAisle]:
    """Return the cross aisles with a pallet: the nearest to the line, and some more."""
    share = sampler.family.value("pallet_share")
    by_distance = sorted(aisles, key=lambda aisle: abs(aisle.middle - crossing))
    drawn = [sampler.rng.random() < share for _ in by_distance]
    drawn[0] = True
    drawn[1 + int(sampler.rng.integers(len(drawn) - 1))] = False  # One stays open.
    return [a for a, blocked in zip(by_distance, drawn, strict=True) if blocked]


def _racks(sampler: Sampler, x: float, aisles: list[_CrossAisle]) -> list[Obstacle]:
    """Fill a row with racks of about equal length between its cross aisles."""
    family, (_, _, _, height) = sampler.family, sampler.workspace_m
    length, depth = family.value("rack_length"), family.value("rack_depth")
    edges = [0.0, *(edge for a in aisles for edge in (a.low, a.high)), height]
    racks: list[Obstacle] = []
    for low, high in zip(edges[::2], edges[1::2], strict=True):
        if high - low < 2.0 * _SEAM_M:
            raise NoRoomError(len(racks))
        count = max(1, round((high - low) / length))
        pitch = (high - low) / count
        for k in range(count):
            middle = low + (k + 0.5) * pitch
            racks.append(_rack(sampler, x, middle, pitch - _SEAM_M, depth))
    return racks


def _landing(x: float, aisle: _CrossAisle) -> shapely.Geometry:
    length, beside = _LANDING_M
    low, high = aisle.low - beside, aisle.high + beside
    return shapely.box(x - length, low, x + length, high)


def _rack(
    sampler: Sampler, x: float, y: float, length: float, depth: float
) -> Obstacle:
    """Return one rack, welded to the floor, its longer side along the row."""
    shape = Box(
        length_m=round(length, DECIMALS),
        width_m=round(depth, DECIMALS),
        height_m=round(sampler.uniform(sampler.family.range("rack_height")), DECIMALS),
    )
    rack = sampler.obstacle(shape, "safe", fixed=True)
    return at(rack, (x, y), round(0.5 * math.pi, DECIMALS))


def _pallet(sampler: Sampler, x: float, aisle: _CrossAisle) -> Obstacle:
    """Return a pallet in the middle of a cross aisle."""
    shape = Box(
        length_m=round(aisle.pallet_m, DECIMALS),
        width_m=round(sampler.family.value("rack_depth"), DECIMALS),
        height_m=round(sampler.uniform(sampler.family.range("height")), DECIMALS),
    )
    pallet = sampler.obstacle(shape, "movable", fixed=False, door=True)
    yaw = 0.5 * math.pi + sampler.uniform((-_SKEW_RAD, _SKEW_RAD))
    return at(pallet, (x, aisle.middle), round(yaw, DECIMALS))
