"""What stands near a place, of all that was placed so far."""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator

import shapely

_CELL_M = 1.0  #: Edge of the cells that outlines are listed by.
_SLACK_M = 1e-6  #: Boxes are this much larger than they must be, against rounding.


class Neighbours:
    """Outlines by the square cells that their bounding boxes meet.

    Asking for the outlines near another one looks at a few cells, however many outlines
    there are.
    """

    def __init__(self, outlines: Iterable[shapely.Geometry] = ()) -> None:
        """Begin with these outlines."""
        self._outlines: list[shapely.Geometry] = []
        self._discs: list[tuple[float, float, float]] = []
        self._numbers: defaultdict[tuple[int, int], list[int]] = defaultdict(list)
        for outline in outlines:
            self.add(outline)

    def add(self, outline: shapely.Geometry) -> None:
        """Place one more."""
        for cell in _cells(outline, 0.0):
            self._numbers[cell].append(len(self._outlines))
        self._outlines.append(outline)
        centre = outline.centroid
        x, y = centre.x, centre.y
        self._discs.append((x, y, inscribed_m(outline, (x, y))))

    def disc_within(
        self, centre: tuple[float, float], radius_m: float, reach_m: float
    ) -> bool:
        """Whether a disc is nearer than `reach_m` [m] to one within any outline.

        Then so is whatever the disc is within; otherwise that may be all the same.
        """
        if reach_m <= 0.0:
            return False  # Nothing is nearer than that.
        x, y = centre
        grown = radius_m + reach_m
        for cell in _cells_of(x - grown, y - grown, x + grown, y + grown):
            for number in self._numbers.get(cell, ()):
                other_x, other_y, other_m = self._discs[number]
                across, along = x - other_x, y - other_y
                near = grown + other_m - _SLACK_M
                if near > 0.0 and across * across + along * along < near * near:
                    return True
        return False

    def within(self, outline: shapely.Geometry, reach_m: float) -> bool:
        """Whether any outline is nearer than `reach_m` [m]."""
        near = {
            number
            for cell in _cells(outline, reach_m)
            for number in self._numbers.get(cell, ())
        }
        if not near:
            return False
        others = [self._outlines[number] for number in sorted(near)]
        return bool(shapely.distance(outline, others).min() < reach_m)


def _cells(outline: shapely.Geometry, reach_m: float) -> Iterator[tuple[int, int]]:
    """Return the cells that the bounding box of an outline, grown by a reach, meets."""
    grown = reach_m + _SLACK_M
    west, south, east, north = outline.bounds
    return _cells_of(west - grown, south - grown, east + grown, north + grown)


def _cells_of(
    west: float, south: float, east: float, north: float
) -> Iterator[tuple[int, int]]:
    for col in range(_cell(west), _cell(east) + 1):
        for row in range(_cell(south), _cell(north) + 1):
            yield col, row


def inscribed_m(outline: shapely.Geometry, centre: tuple[float, float]) -> float:
    """Return the radius of the disc about a point that is within an outline [m].

    Zero if the point is not.
    """
    point = shapely.Point(centre)
    return float(outline.boundary.distance(point)) if outline.covers(point) else 0.0


def _cell(value: float) -> int:
    return math.floor(value / _CELL_M)
