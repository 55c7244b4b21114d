"""Inputs of a planner: copies of its own that cannot be written to.

An array's memory is a `bytes` object, so NumPy itself refuses to make it writeable. A
record or an array object that was altered by force (`object.__setattr__`,
`array.shape = ...`) was the planner's alone, and is not handed out again.
"""

from dataclasses import replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from beacon_mj.episode.sighting import sighting
from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.interface import Contact, Observation, Scan, SensedObstacle, Task

_FLOAT = np.dtype(np.float64)
_SEALED = ("footprint", "centroid_m")
_PLAIN = attrgetter(*(n for n in SensedObstacle.__slots__ if n not in _SEALED))
_SET_VERTICES = vars(Footprint)["vertices"].__set__
_SET_RADIUS = vars(Footprint)["radius"].__set__


class Memory(NamedTuple):
    """The content of an array: its shape and its bytes, in C order."""

    shape: tuple[int, ...]
    data: bytes

    @classmethod
    def of(cls, array: Array) -> "Memory":
        """Return a copy of an array's content."""
        array = np.asarray(array, _FLOAT)
        return cls(array.shape, array.tobytes())

    def array(self) -> Array:
        """Return a new read-only array of this content."""
        return np.ndarray(self.shape, _FLOAT, self.data)


def sealed_array(array: Array) -> Array:
    """Return a read-only copy of an array."""
    if array.dtype is not _FLOAT:
        array = np.asarray(array, _FLOAT)
    return np.ndarray(array.shape, _FLOAT, array.tobytes())


def sealed_footprint(footprint: Footprint) -> Footprint:
    """Return a read-only copy of a footprint."""
    return Footprint(sealed_array(footprint.vertices), footprint.radius)


def sealed_task(task: Task) -> Task:
    """Return a task for a planner to keep."""
    return replace(
        task, start_m=sealed_array(task.start_m), goal_m=sealed_array(task.goal_m)
    )


class _Sealed:
    """One obstacle's record, and the copy of it that the planner has.

    Copies share their footprint and centroid for as long as these stay as they are, so
    a planner can tell by the object that an obstacle did not move.
    """

    __slots__ = ("_centroid", "_footprint", "_outline", "_own_centroid", "copy", "seen")

    def __init__(self, seen: SensedObstacle) -> None:
        self._outline = Memory.of(seen.footprint.vertices)
        self._centroid = Memory.of(seen.centroid_m)
        self._lay_out(seen)
        self.renew(seen)

    def renew(self, seen: SensedObstacle) -> None:
        """Make a new copy; the outline is that of the last one."""
        self.seen = seen
        if not self._outline_untouched():
            self._lay_out(seen)
        self.copy = sighting(
            seen,
            self._footprint,
            self._own_centroid,
            seen.seen_s,
            seen.visible,
            seen.broken,
        )

    def untouched(self) -> bool:
        """Whether the copy is as it was made, and not altered by force."""
        try:
            return (
                _PLAIN(self.copy) == _PLAIN(self.seen)
                and self.copy.footprint is self._footprint
                and self.copy.centroid_m is self._own_centroid
                and self._outline_untouched()
            )
        except Exception:  # A field is missing, or cannot be compared.
            return False

    def _lay_out(self, seen: SensedObstacle) -> None:
        footprint = self._footprint = Footprint.__new__(Footprint)
        _SET_VERTICES(footprint, self._outline.array())
        _SET_RADIUS(footprint, seen.footprint.radius)
        self._own_centroid = self._centroid.array()

    def _outline_untouched(self) -> bool:
        """Whether footprint and centroid are as they were made."""
        centroid = self._own_centroid
        try:
            vertices = self._footprint.vertices
            return (
                type(vertices) is np.ndarray
                and vertices.shape == self._outline.shape
                and vertices.strides == (16, 8)
                and vertices.dtype is _FLOAT
                and _base(vertices) is self._outline.data
                and self._footprint.radius == self.seen.footprint.radius
                and centroid.shape == (2,)
                and centroid.strides == (8,)
                and centroid.dtype is _FLOAT
            )
        except Exception:
            return False


class Sealer:
    """Seals the observations of one episode; content that stays is copied once."""

    def __init__(self) -> None:
        """Start with nothing seen."""
        self._known: dict[str, _Sealed] = {}
        self._stacked = Footprints()
        self._vertices = Memory.of(self._stacked.vertices)
        self._radius = Memory.of(self._stacked.radius)

    def observation(self, seen: Observation) -> Observation:
        """Return what a planner gets of an observation."""
        return Observation(
            step=seen.step,
            time_s=seen.time_s,
            position_m=sealed_array(seen.position_m),
            velocity_mps=sealed_array(seen.velocity_mps),
            battery=seen.battery,
            bumper_force_n=sealed_array(seen.bumper_force_n),
            drive_effort=seen.drive_effort,
            obstacles=tuple([self._obstacle(o) for o in seen.obstacles]),
            footprints=self._footprints(seen.footprints),
            map_version=seen.map_version,
            contacts=tuple(
                [
                    Contact(c.id, sealed_array(c.normal), c.force_n)
                    for c in seen.contacts
                ]
            ),
            evidence=seen.evidence,
            heading_rad=seen.heading_rad,
            turn_rate_radps=seen.turn_rate_radps,
            scan=None if seen.scan is None else _scan(seen.scan),
        )

    def _obstacle(self, seen: SensedObstacle) -> SensedObstacle:
        known = self._known.get(seen.id)
        if known is None or known.seen.footprint is not seen.footprint:
            known = self._known[seen.id] = _Sealed(seen)
        elif known.seen is not seen or not known.untouched():
            known.renew(seen)
        return known.copy

    def _footprints(self, stacked: Footprints) -> Footprints:
        if stacked is not self._stacked:
            self._stacked = stacked
            self._vertices = Memory.of(stacked.vertices)
            self._radius = Memory.of(stacked.radius)
        return Footprints(self._vertices.array(), self._radius.array())


def _scan(scan: Scan) -> Scan:
    return Scan(ranges_m=sealed_array(scan.ranges_m), range_max_m=scan.range_max_m)


def _base(array: Array) -> object:
    return array.base
