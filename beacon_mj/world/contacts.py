"""Contact forces, read at every physics step.

Entities are numbered: obstacles 0..n-1 in scene order, the robot n, the walls n+1;
the floor is no counterpart. A *pair* is two entities (a, b), a < b, that touch or
touched within the filter window. Its force is the force that b exerts on a, [N].
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array
from beacon_mj.jit import kernel

FILTER_S = 0.010  #: Averaging window of the filtered force [s].
FLOOR = -1

# Columns of the pair table.
FX, FY, FZ = 0, 1, 2  # Force that b exerts on a, at the last physics step [N].
PX, PY, PZ = 3, 4, 5  # Where it acts: mean of the contact points, by force [m].
RAW, FILTERED = 6, 7  # Magnitude at the last physics step and its window mean [N].
PEAK, FILTERED_PEAK, IMPULSE = 8, 9, 10  # Over the control step [N], [N], [N s].
COLUMNS = 11


@dataclass(slots=True)
class PairTable:
    """Forces of all touching pairs, kept in arrays that compiled code fills.

    Attributes:
        ids: Entities (a, b) of each pair, shape (capacity, 2).
        values: The columns above, shape (capacity, COLUMNS).
        window: Force magnitudes of the last physics steps, (capacity, w) [N].
        count: Number of pairs in use, shape (1,).
    """

    ids: NDArray[np.int64]
    values: Array
    window: Array
    count: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))

    @classmethod
    def create(cls, obstacles: int, timestep_s: float) -> "PairTable":
        """Return an empty table with room for 12 counterparts an obstacle."""
        capacity = 12 * (obstacles + 1)
        width = max(1, round(FILTER_S / timestep_s))
        return cls(
            np.zeros((capacity, 2), np.int64),
            np.zeros((capacity, COLUMNS)),
            np.zeros((capacity, width)),
        )

    def clear(self) -> None:
        """Forget all pairs."""
        self.count[0] = 0

    def begin_step(self) -> None:
        """Drop pairs that no longer touch and restart the control step's maxima."""
        n = int(self.count[0])
        if n == 0:
            return
        alive = np.flatnonzero(self.window[:n].any(axis=1))
        k = len(alive)
        self.ids[:k] = self.ids[alive]
        self.values[:k] = self.values[alive]
        self.window[:k] = self.window[alive]
        self.values[:k, PEAK : IMPULSE + 1] = 0.0
        self.count[0] = k


@kernel
def accumulate(
    geoms: NDArray[np.int32],
    address: NDArray[np.int32],
    frames: Array,
    points: Array,
    force: Array,
    entity: NDArray[np.int64],
    ids: NDArray[np.int64],
    values: Array,
    window: Array,
    count: NDArray[np.int64],
    timestep_s: float,
) -> float:
    """Add one physics step's contacts to the pair table.

    Args:
        geoms: The two geoms of each contact, shape (c, 2).
        address: Where each contact's force starts in `force`, -1 if inactive, (c,).
        frames: Contact frames, normal first, row-major, shape (c, 9).
        points: Contact positions, shape (c, 3) [m].
        force: Constraint forces in contact frames, shape (nefc,) [N].
        entity: Entity of each geom; below -1 for geoms without collisions.
        ids: See `PairTable`.
        values: See `PairTable`.
        window: See `PairTable`.
        count: See `PairTable`.
        timestep_s: Physics step [s].

    Returns:
        The largest filtered force on any pair [N].
    """
    n = count[0]
    for k in range(n):
        values[k, FX : RAW + 1] = 0.0
    for c in range(geoms.shape[0]):
        first, second = entity[geoms[c, 0]], entity[geoms[c, 1]]
        if address[c] < 0 or first == FLOOR or second == FLOOR:
            continue
        a, b = min(first, second), max(first, second)
        if values.shape[0] == n and _find(ids, n, a, b) == n:
            continue
        k = _find(ids, n, a, b)
        if k == n:
            ids[n, 0], ids[n, 1] = a, b
            values[n, :] = 0.0
            window[n, :] = 0.0
            n += 1
        # MuJoCo's contact force acts on the second geom; turn it onto a.
        sign = 1.0 if second == a else -1.0
        size = 0.0
        for axis in range(3):
            f = 0.0
            for row in range(3):
                f += frames[c, 3 * row + axis] * force[address[c] + row]
            values[k, FX + axis] += sign * f
            size += f * f
        size = np.sqrt(size)
        values[k, RAW] += size
        for axis in range(3):
            values[k, PX + axis] += size * points[c, axis]
    largest = 0.0
    width = window.shape[1]
    for k in range(n):
        if values[k, RAW] > 0.0:
            for axis in range(3):
                values[k, PX + axis] /= values[k, RAW]
        fx, fy, fz = values[k, FX], values[k, FY], values[k, FZ]
        net = np.sqrt(fx * fx + fy * fy + fz * fz)
        total = net
        for i in range(width - 1):
            window[k, i] = window[k, i + 1]
            total += window[k, i]
        window[k, width - 1] = net
        filtered = total / width
        values[k, RAW] = net
        values[k, FILTERED] = filtered
        values[k, PEAK] = max(values[k, PEAK], net)
        values[k, FILTERED_PEAK] = max(values[k, FILTERED_PEAK], filtered)
        values[k, IMPULSE] += net * timestep_s
        largest = max(largest, filtered)
    count[0] = n
    return largest


@kernel
def _find(ids: NDArray[np.int64], n: int, a: int, b: int) -> int:
    """Return the row of pair (a, b), or n if it is new."""
    for k in range(n):
        if ids[k, 0] == a and ids[k, 1] == b:
            return k
    return n


@kernel
def find_damage(
    ids: NDArray[np.int64],
    values: Array,
    count: int,
    break_force: Array,
    broken: NDArray[np.bool_],
) -> int:
    """Latch obstacles whose filtered force from one counterpart exceeds its limit.

    Args:
        ids: See `PairTable`.
        values: See `PairTable`.
        count: Number of pairs in use.
        break_force: Limit of each obstacle, infinite if it cannot break, (n,) [N].
        broken: Which obstacles are broken; updated, shape (n,).

    Returns:
        The row of the pair that broke something now, or -1.
    """
    hit = -1
    for k in range(count):
        for side in range(2):
            i = ids[k, side]
            if i >= break_force.shape[0] or broken[i]:
                continue
            if values[k, FILTERED] > break_force[i]:
                broken[i] = True
                hit = k
    return hit
