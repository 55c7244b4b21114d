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
        self._numbers: defaultdict[tuple[int, int], list[int]] = defaultdict(list)
        for outline in outlines:
            self.add(outline)

    def add(self, outline: shapely.Geometry) -> None:
        """Place one more."""
        for cell in _cells(outline, 0.0):
            self._numbers[cell].append(len(self._outlines))
        self._outlines.append(outline)

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
    """Yield the cells that the bounding box of an outline, grown by a reach, meets."""
    grown = reach_m + _SLACK_M
    west, south, east, north = outline.bounds
    for col in range(_cell(west - grown), _cell(east + grown) + 1):
        for row in range(_cell(south - grown), _cell(north + grown) + 1):
            yield col, row


def _cell(value: float) -> int:
    return math.floor(value / _CELL_M)
