"""Contacts of a planar world, in the form in which MuJoCo reports its own.

`contacts.accumulate` then filters and adds up the forces of both worlds.
"""

from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array
from beacon_mj.numerics import norm
from beacon_mj.world import contacts as ct


@dataclass(slots=True)
class Touches:
    """Contacts with a force, as they are found.

    Attributes:
        pairs: Two entities each; the force acts on the second.
        forces: Horizontal forces on the second, shape (2,) each [N].
        points: Where they act, shape (2,) each [m].
    """

    pairs: list[tuple[int, int]] = field(default_factory=list)
    forces: list[Array] = field(default_factory=list)
    points: list[Array] = field(default_factory=list)

    def add(self, first: int, second: int, force: Array, point: Array) -> None:
        """Add the force of `first` on `second`, shape (2,) [N], at a point (2,) [m]."""
        self.pairs.append((first, second))
        self.forces.append(force)
        self.points.append(point)

    def on(self, entity: int) -> Array:
        """Return the sum of the forces on an entity, shape (2,) [N]."""
        total = np.zeros(2)
        for (first, second), force in zip(self.pairs, self.forces, strict=True):
            if second == entity:
                total += force
            elif first == entity:
                total -= force
        return total

    def read_into(self, table: ct.PairTable, entities: int, timestep_s: float) -> float:
        """Add the contacts to a table; return its largest filtered force [N].

        Args:
            table: Of the world.
            entities: How many entities it has.
            timestep_s: Time between two readings [s].
        """
        count = len(self.pairs)
        frames, forces = np.zeros((count, 9)), np.zeros((count, 3))
        points = np.zeros((count, 3))
        for k, force in enumerate(self.forces):
            size = norm(force)
            forces[k, 0] = size
            frames[k, :2] = force / size if size > 0.0 else force
            points[k, :2] = self.points[k]
        return ct.accumulate(
            np.array(self.pairs, np.int32).reshape(-1, 2),
            np.arange(0, 3 * count, 3, dtype=np.int32),
            frames, points, forces.ravel(), _themselves(entities),
            table.ids, table.values, table.window, table.count, timestep_s,
        )  # fmt: skip


@cache
def _themselves(entities: int) -> NDArray[np.int64]:
    """Return the entity of each geom: there are no geoms but the entities."""
    return np.arange(entities)
