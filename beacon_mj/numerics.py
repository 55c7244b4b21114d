"""Arithmetic that gives the same bits on every machine.

NumPy's and BLAS's functions choose their machine code by the CPU. `a @ b` may fuse a
product and a sum into one rounding; `np.sin` of an array may differ from `math.sin`
in the last bit where there is AVX-512; `hypot` and `**` are other functions in every C
library. One bit in a footprint or a command grows into another episode.

What a scene, a decision, the physics or a row depends on uses +, -, *, /, sqrt,
comparisons, NumPy's elementwise arithmetic and sums, `math.fsum`, scalar functions of
`math` such as `math.sin`, and the functions below. `docs/same-rows.md` has the rules;
`tests/test_same_bits.py` enforces them.

Shapes: k vectors.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def dot(a: Array, b: Array) -> float:
    """Return the scalar product of two vectors (d,), summed from the left."""
    if len(a) == len(b) == 2:  # Nearly all are; without a loop it takes a third.
        ax, ay = a.tolist()
        bx, by = b.tolist()
        return float(0.0 + ax * bx + ay * by)  # The 0.0 makes -0.0 the sum's 0.0.
    total = 0.0
    for x, y in zip(a.tolist(), b.tolist(), strict=True):
        total += x * y
    return total


def norm(vector: Array) -> float:
    """Return the Euclidean length of a vector (d,)."""
    if len(vector) == 2:
        x, y = vector.tolist()
        return math.sqrt(x * x + y * y)
    return math.sqrt(dot(vector, vector))


def norms(vectors: Array) -> Array:
    """Return the Euclidean lengths of planar vectors (..., 2), shape (...)."""
    x, y = vectors[..., 0], vectors[..., 1]
    return np.asarray(np.sqrt(x * x + y * y))


def rotated(vectors: Array, angle: float) -> Array:
    """Return planar vectors (..., 2) turned counter-clockwise by `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    out = np.empty(vectors.shape)
    out[..., 0], out[..., 1] = x * c - y * s, x * s + y * c
    return out


def rotated_3d(points: Array, rotation: Array) -> Array:
    """Return points (k, 3) under a rotation matrix (3, 3): row i is `rotation p_i`."""
    x, y, z = points[:, :1], points[:, 1:2], points[:, 2:]
    return np.asarray(x * rotation[:, 0] + y * rotation[:, 1] + z * rotation[:, 2])


def wrapped(angle: float) -> float:
    """Return an angle in [-pi, pi) [rad]."""
    turns = math.floor((angle + math.pi) / (2.0 * math.pi))
    return angle - 2.0 * math.pi * turns


def unit_vectors(angles: NDArray[np.floating[Any]]) -> Array:
    """Return unit vectors (k, 2) that point along `angles` (k,) [rad]."""
    pairs = [(math.cos(a), math.sin(a)) for a in angles.tolist()]
    return np.array(pairs).reshape(-1, 2)


def angles_of(vectors: Array) -> Array:
    """Return the angles (k,) of planar vectors (k, 2), in (-pi, pi] [rad]."""
    return np.array([math.atan2(y, x) for x, y in vectors.tolist()])
