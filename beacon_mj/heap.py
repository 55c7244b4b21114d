"""A binary heap of vertices that knows where each vertex sits.

Keys are pairs, ordered lexicographically, smallest first. Each vertex is in the heap
at most once: putting it again changes its key.
"""

from typing import NamedTuple

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.grid import Cells
from beacon_mj.jit import kernel


class Heap(NamedTuple):
    """Storage for at most n vertices numbered below n.

    Slot 0 holds the smallest key. `slot` (n,) is where each vertex sits, -1 if it is
    not in the heap; `size` (1,) counts the slots in use.
    """

    key1: Array
    key2: Array
    vertex: Cells
    slot: Cells
    size: Cells

    @classmethod
    def empty(cls, n: int) -> "Heap":
        """Return an empty heap for vertices 0 to n - 1."""
        return cls(
            np.empty(n),
            np.empty(n),
            np.empty(n, dtype=np.int64),
            np.full(n, -1, dtype=np.int64),
            np.zeros(1, dtype=np.int64),
        )

    def clear(self) -> None:
        """Take everything out."""
        self.slot[:] = -1
        self.size[0] = 0


@kernel
def before(a1: float, a2: float, b1: float, b2: float) -> bool:
    """Whether key (a1, a2) comes strictly before key (b1, b2)."""
    return a1 < b1 or (a1 == b1 and a2 < b2)


@kernel
def heap_put(heap: Heap, vertex: int, key1: float, key2: float) -> None:
    """Insert a vertex, or change its key."""
    slot = heap.slot[vertex]
    if slot < 0:
        slot = heap.size[0]
        heap.size[0] += 1
    _settle(heap, slot, vertex, key1, key2)


@kernel
def heap_remove(heap: Heap, vertex: int) -> None:
    """Take a vertex out; nothing happens if it is not in."""
    slot = heap.slot[vertex]
    if slot < 0:
        return
    heap.slot[vertex] = -1
    heap.size[0] -= 1
    last = heap.size[0]
    if slot != last:
        _settle(heap, slot, heap.vertex[last], heap.key1[last], heap.key2[last])


@kernel
def _settle(heap: Heap, slot: int, vertex: int, key1: float, key2: float) -> None:
    """Place an entry that belongs at `slot` or above or below it."""
    while slot > 0:
        parent = (slot - 1) // 2
        if not before(key1, key2, heap.key1[parent], heap.key2[parent]):
            break
        _move(heap, parent, slot)
        slot = parent
    while 2 * slot + 1 < heap.size[0]:
        child = 2 * slot + 1
        right = child + 1
        if right < heap.size[0] and before(
            heap.key1[right], heap.key2[right], heap.key1[child], heap.key2[child]
        ):
            child = right
        if not before(heap.key1[child], heap.key2[child], key1, key2):
            break
        _move(heap, child, slot)
        slot = child
    heap.key1[slot], heap.key2[slot] = key1, key2
    heap.vertex[slot] = vertex
    heap.slot[vertex] = slot


@kernel
def _move(heap: Heap, source: int, target: int) -> None:
    """Copy the entry of one slot to another."""
    heap.key1[target], heap.key2[target] = heap.key1[source], heap.key2[source]
    heap.vertex[target] = heap.vertex[source]
    heap.slot[heap.vertex[target]] = target
