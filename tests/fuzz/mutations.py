"""Changes to trees of JSON and to bytes, blind to what these mean."""

import json
import math
from copy import deepcopy
from random import Random
from typing import Any, NamedTuple

#: Values that something was once not made for.
WILD: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2, 2**31, 2**53 + 1, 2**63, 2**64, 10**30, -(10**30),
    0.0, -0.0, 0.5, -0.5, 1e-320, 1e-9, 1e9, 1e308, -1e308, math.nan, math.inf,
    -math.inf, "", "x", "0", "nan", "\x00", "\x1b[2J", "\ud800", "a" * 5000,
    "../../../../etc/passwd", "<script>alert(1)</script>", "[red]", "none", "é" * 300,
    [], {}, [[]], {"": None}, [0] * 3000, {"a": {"b": []}},
)  # fmt: skip
Tree = Any


class Place(NamedTuple):
    """A value within a tree: what holds it, and under which key or number."""

    parent: Any
    key: Any

    @property
    def value(self) -> Any:
        return self.parent[self.key]


def places(tree: Tree) -> list[Place]:
    """Return every place within a tree."""
    keys = tree if isinstance(tree, dict) else range(len(tree))
    found = [Place(tree, key) for key in keys]
    for place in list(found):
        if isinstance(place.value, dict | list):
            found += places(place.value)
    return found


def mutated(tree: Tree, rng: Random) -> Tree:
    """Return a copy of a tree with one to three changes."""
    tree = deepcopy(tree)
    for _ in range(rng.randint(1, 3)):
        if found := places(tree):
            _change(rng.choice(found), rng)
    return tree


def _change(place: Place, rng: Random) -> None:
    parent, key = place
    match rng.randrange(6):
        case 0:
            parent[key] = deepcopy(rng.choice(WILD))
        case 1:
            del parent[key]
        case 2 if isinstance(parent, dict):
            parent[rng.choice(["x", "", f"{key}_", "type", "__class__"])] = 1
        case 2:
            parent.insert(key, deepcopy(parent[key]))
        case 3:
            parent[key] = nudged(place.value, rng)
        case 4:
            other = rng.choice(places(parent))
            parent[key] = deepcopy(other.value)
        case _ if isinstance(place.value, list):
            rng.shuffle(place.value)
        case _:
            parent[key] = [place.value]


def nudged(value: Any, rng: Random) -> Any:
    """Return a value of the same type that is a little, or much, another one."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + rng.choice([-1, 1, -value, value, 1000])
    if isinstance(value, float):
        return rng.choice([value * 1.01, value * 0.5, -value, value + 0.1, value * 9.0])
    if isinstance(value, str):
        return rng.choice([value[:-1], value + "x", value.upper(), value[::-1]])
    return value


def text_of(tree: Tree) -> bytes:
    """Return JSON, with NaN and the like where they are."""
    return json.dumps(tree).encode()


def damaged(data: bytes, rng: Random) -> bytes:
    """Return bytes with a part missing, doubled, flipped, or encoded another way."""
    place = rng.randrange(len(data) + 1)
    match rng.randrange(8):
        case 0:
            return data[:place]
        case 1:
            return data[:place] + data[place + 1 :]
        case 2 if data:
            changed = bytearray(data)
            changed[place % len(data)] ^= 1 << rng.randrange(8)
            return bytes(changed)
        case 3:
            return data[:place] + rng.randbytes(4) + data[place:]
        case 4:
            return data[:place] + data[place // 2 :]
        case 5:
            return b"\xef\xbb\xbf" + data
        case 6:
            return data.decode(errors="replace").encode("utf-16")
        case _:
            return data[:place] + b"[" * 100_000
