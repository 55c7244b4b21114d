"""Where an obstacle stands on the floor, and how much of its weight each point carries.

Loads are affine in position, as those of a rigid body on springs of one stiffness, and
never negative:

    N_k = a + b . r_k >= 0,  sum N_k = m g,  sum N_k r_k = m g c,

with c the centre of pressure: the centre of mass at rest, and mu h ahead of it while a
force of mu m g pushes at height h.
"""

import math

import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array, convex_hull
from beacon_mj.numerics import unit_vectors
from beacon_mj.scene import Surface, shapes

_RIM = 8  #: Points that stand for the rim of a cylinder.
_PATCH = 4  #: Points that stand for the patch on which a ball stands.
_DOWN_M = 1e-3  #: How much higher than its lowest vertex a body still stands [m].


def support_points(shape: shapes.Shape, surface: Surface) -> Array:
    """Return where a shape touches the floor, in its own frame, shape (q, 2) [m].

    Args:
        shape: The shape, upright.
        surface: Its torsional friction is the radius of the patch of a ball.
    """
    if isinstance(shape, shapes.Sphere):
        return surface.torsional_friction_m * _circle(_PATCH)
    if isinstance(shape, shapes.Cylinder):
        return shape.radius_m * _circle(_RIM)
    points, _ = shape.core()
    down = points[:, 2] <= points[:, 2].min() + _DOWN_M
    return convex_hull(points[down, :2])


def load_shares(points: Array, centre: Array | None = None) -> Array:
    """Return the share of the weight on each support point, shape (q,).

    Args:
        points: Support points in the frame of the centre of mass, shape (q, 2) [m].
        centre: Centre of pressure c, shape (2,) [m]; that of mass if None. Outside of
            the points nothing balances, and the nearest ones carry what they can.
    """
    c = np.zeros(2) if centre is None else centre
    shares = np.zeros(len(points))
    carries = np.arange(len(points))
    while len(carries) > 2:
        affine = _affine(points[carries], c)
        if affine is None:
            break
        if (affine >= 0.0).all():
            shares[carries] = affine
            return shares
        carries = carries[affine > 0.0]
    return _few(points, carries, c)


def _affine(points: Array, centre: Array) -> Array | None:
    """Return a + b . r_k of the affine loads, shape (q,); None on a line."""
    middle = points.mean(axis=0)
    x, y = (points - middle).T
    cx, cy = (centre - middle).tolist()
    xx, xy, yy = (math.fsum(products) for products in (x * x, x * y, y * y))
    determinant = xx * yy - xy * xy
    if determinant <= 1e-12 * (xx + yy) * (xx + yy):
        return None
    bx = (cx * yy - cy * xy) / determinant
    by = (cy * xx - cx * xy) / determinant
    return np.asarray(1.0 / len(points) + bx * x + by * y)


def _few(points: Array, carries: NDArray[np.int64], centre: Array) -> Array:
    """Return the shares of points on a line: linear along it."""
    shares = np.zeros(len(points))
    own = points[carries]
    middle = own.mean(axis=0)
    along = own[-1] - own[0]
    square = math.fsum(along * along)
    if len(own) < 2 or square == 0.0:
        shares[carries] = 1.0 / len(own)
        return shares
    t = ((own - middle) * along).sum(axis=1)
    slope = math.fsum((centre - middle) * along) / math.fsum(t * t)
    affine = np.maximum(1.0 / len(own) + slope * t, 0.0)
    shares[carries] = affine / math.fsum(affine)
    return shares


def _circle(count: int) -> Array:
    return unit_vectors(np.arange(count) * (2.0 * math.pi / count))
