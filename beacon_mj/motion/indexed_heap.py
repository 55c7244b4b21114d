"""A binary heap of vertices that knows where each vertex sits.

Keys are pairs, ordered lexicographically, smallest first. Each vertex is in the heap
at most once: putting it again changes its key.

A heap is two record arrays. `entries` (n + 1,), of `ENTRY`, holds the entries from
slot 1, which has the smallest key; slot 0 counts them in its field `vertex`. The
vertices (n,) are records with a field `slot`, 0 for a vertex that is not in the heap.
Records, rather than an array for each field, because compiled code then counts one
reference in place of five and finds what belongs together side by side in memory.
"""

import numpy as np
from numpy.typing import NDArray

from beacon_mj.jit import inlined

Records = NDArray[np.void]

ENTRY = np.dtype([("key1", "f8"), ("key2", "f8"), ("vertex", "i8")])


def empty_heap(n: int) -> Records:
    """Return the entries of an empty heap for vertices 0 to n - 1."""
    return np.zeros(n + 1, dtype=ENTRY)


@inlined
def heap_size(entries: Records) -> int:
    """Return the number of entries."""
    size: int = entries[0]["vertex"]
    return size


@inlined
def before(a1: float, a2: float, b1: float, b2: float) -> bool:
    """Whether key (a1, a2) comes strictly before key (b1, b2)."""
    return a1 < b1 or (a1 == b1 and a2 < b2)


@inlined
def heap_put(
    vertices: Records, entries: Records, vertex: int, key1: float, key2: float
) -> None:
    """Insert a vertex, or change its key."""
    slot = vertices[vertex]["slot"]
    if slot == 0:
        slot = entries[0]["vertex"] + 1
        entries[0]["vertex"] = slot
    _settle(vertices, entries, slot, vertex, key1, key2)


@inlined
def heap_remove(vertices: Records, entries: Records, vertex: int) -> None:
    """Take a vertex out; nothing happens if it is not in."""
    slot = vertices[vertex]["slot"]
    if slot == 0:
        return
    vertices[vertex]["slot"] = 0
    last = entries[0]["vertex"]
    entries[0]["vertex"] = last - 1
    if slot != last:
        key1, key2 = entries[last]["key1"], entries[last]["key2"]
        _settle(vertices, entries, slot, entries[last]["vertex"], key1, key2)


@inlined
def _settle(
    vertices: Records,
    entries: Records,
    slot: int,
    vertex: int,
    key1: float,
    key2: float,
) -> None:
    """Place an entry that belongs at `slot` or above or below it."""
    while slot > 1 and _before_entry(key1, key2, entries[slot // 2]):
        _move(vertices, entries, slot // 2, slot)
        slot //= 2
    size = entries[0]["vertex"]
    while 2 * slot <= size:
        child = 2 * slot
        if child < size and before(
            entries[child + 1]["key1"], entries[child + 1]["key2"],
            entries[child]["key1"], entries[child]["key2"],
        ):  # fmt: skip
            child += 1
        if not before(entries[child]["key1"], entries[child]["key2"], key1, key2):
            break
        _move(vertices, entries, child, slot)
        slot = child
    entries[slot]["key1"], entries[slot]["key2"] = key1, key2
    entries[slot]["vertex"] = vertex
    vertices[vertex]["slot"] = slot


@inlined
def _before_entry(key1: float, key2: float, entry: np.void) -> bool:
    """Whether a key comes strictly before that of an entry."""
    return before(key1, key2, entry["key1"], entry["key2"])


@inlined
def _move(vertices: Records, entries: Records, source: int, target: int) -> None:
    """Copy the entry of one slot to another."""
    vertex = entries[source]["vertex"]
    entries[target]["key1"] = entries[source]["key1"]
    entries[target]["key2"] = entries[source]["key2"]
    entries[target]["vertex"] = vertex
    vertices[vertex]["slot"] = target
