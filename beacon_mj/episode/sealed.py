"""Inputs of a planner: copies of its own that cannot be written to.

An array's memory is a `bytes` object, so NumPy itself refuses to make it writeable. A
record or an array object that was altered by force (`object.__setattr__`,
`array.shape = ...`) is the planner's alone: nothing that was handed out is used again.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.interface import Contact, Observation, SensedObstacle, Task

_FLOAT = np.dtype(np.float64)


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
    return Memory.of(array).array()


def sealed_footprint(footprint: Footprint) -> Footprint:
    """Return a read-only copy of a footprint."""
    return Footprint(sealed_array(footprint.vertices), footprint.radius)


def sealed_task(task: Task) -> Task:
    """Return a task for a planner to keep."""
    return replace(
        task, start_m=sealed_array(task.start_m), goal_m=sealed_array(task.goal_m)
    )


class Sealer:
    """Seals the observations of one episode; content that stays is copied once."""

    def __init__(self) -> None:
        """Start with nothing seen."""
        self._outlines: dict[str, tuple[Footprint, Memory, Memory]] = {}
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
        )

    def _obstacle(self, seen: SensedObstacle) -> SensedObstacle:
        footprint = seen.footprint
        known = self._outlines.get(seen.id)
        if known is None or known[0] is not footprint:
            outline = Memory.of(footprint.vertices)
            known = footprint, outline, Memory.of(seen.centroid_m)
            self._outlines[seen.id] = known
        _, outline, centroid = known
        return SensedObstacle(
            id=seen.id,
            footprint=Footprint(
                np.ndarray(outline.shape, _FLOAT, outline.data), footprint.radius
            ),
            centroid_m=np.ndarray(centroid.shape, _FLOAT, centroid.data),
            height_m=seen.height_m,
            volume_m3=seen.volume_m3,
            density_kgm3=seen.density_kgm3,
            friction=seen.friction,
            scores=seen.scores,
            seen_s=seen.seen_s,
            visible=seen.visible,
            broken=seen.broken,
        )

    def _footprints(self, stacked: Footprints) -> Footprints:
        if stacked is not self._stacked:
            self._stacked = stacked
            self._vertices = Memory.of(stacked.vertices)
            self._radius = Memory.of(stacked.radius)
        return Footprints(self._vertices.array(), self._radius.array())
