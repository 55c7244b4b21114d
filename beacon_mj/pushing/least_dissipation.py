"""Quasi-static pushing on supporting points with Coulomb friction: who moves how.

Of all motions that the contacts allow, bodies take the one of least dissipation,

    min  sum_k mu N_k |u_k|   over  q_b = (dx, dy, dtheta)
    with gap_c + n_c . (u_second - u_first)(p_c) >= 0,

u_k the travel of support point k and u the travel of the touching points. That is
Mason's and Lynch's pushing: contact forces are the multipliers, and each body's wrench
lies on its limit surface, whose normal there is its motion. (Mason, "Mechanics and
planning of manipulator pushing operations", 1986; Peshkin and Sanderson, "Minimization
of energy in quasi-static manipulation", 1989; Goyal, Ruina and Papadopoulos, "Planar
sliding with dry friction", 1991; Lynch and Mason, "Stable pushing", 1996.) Contacts
have no friction. The forces of a row of bodies add up by themselves.

The minimum is found by iteratively reweighted least squares: with the weights mu N_k /
|u_k| it is a quadratic program, which projected Gauss-Seidel solves in the forces.

Shapes: m bodies with q support points each, c contacts. Forces in [N], lengths in [m].
"""

import math

import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array
from beacon_mj.jit import kernel

ROBOT, IMMOVABLE = -1, -2  #: What stands for a body in a contact with one of these.
_STILL_M = 1e-9  #: Travel of a support point that counts as none [m].
_REWEIGHTED, _SWEEPS = 60, 400  #: Most iterations, and sweeps in each.
_SETTLED = 1e-7  #: Change of a motion at which it is found, over the robot's travel.
_SOLVED = 1e-9  #: Change of a contact's closing at which a sweep is the last.


@kernel
def least_dissipation(
    points: Array,
    friction: Array,
    bodies: NDArray[np.int64],
    normals: Array,
    arms: Array,
    gaps: Array,
    travel: Array,
    motion: Array,
    force: Array,
) -> float:
    """Find the motion of least dissipation.

    Args:
        points: Support points from each body's origin, shape (m, q, 2).
        friction: mu N of each, 0 for padding, shape (m, q).
        bodies: First and second body of each contact, or one of the two above, (c, 2).
        normals: Unit vectors from the first into the second, shape (c, 2).
        arms: Contact points from the first's and the second's origin, (c, 4).
        gaps: Gaps, negative where they overlap, shape (c,).
        travel: The robot's travel, shape (2,).
        motion: Filled with q_b, shape (m, 3) [m, m, rad]; what it holds is the guess.
        force: Filled with the contact forces, shape (c,).

    Returns:
        How much the contacts still overlap where nothing could be moved out of the
        way, 0 if all constraints hold.
    """
    m, c = points.shape[0], gaps.shape[0]
    size = math.sqrt(travel[0] * travel[0] + travel[1] * travel[1])
    if _still(motion):
        motion[:, 0], motion[:, 1] = travel[0], travel[1]
    inverse, wrench = np.empty((m, 3, 3)), np.empty((c, 2, 3))
    for k in range(c):
        for side in range(2):
            sign = 1.0 if side == 1 else -1.0
            nx, ny = sign * normals[k, 0], sign * normals[k, 1]
            rx, ry = arms[k, 2 * side], arms[k, 2 * side + 1]
            wrench[k, side, 0], wrench[k, side, 1] = nx, ny
            wrench[k, side, 2] = rx * ny - ry * nx
    force[:] = 0.0
    left = 0.0
    before = np.empty((m, 3))
    for _ in range(_REWEIGHTED):
        before[:] = motion
        for b in range(m):
            _compliance(points[b], friction[b], motion[b], inverse[b])
        left = _quadratic(bodies, normals, wrench, gaps, travel, inverse, motion, force)
        change = 0.0
        for b in range(m):
            for axis in range(3):
                change = max(change, abs(motion[b, axis] - before[b, axis]))
        if change <= _SETTLED * size:
            break
    return left


@kernel
def _still(motion: Array) -> bool:
    for b in range(motion.shape[0]):
        for axis in range(3):
            if motion[b, axis] != 0.0:
                return False
    return True


@kernel
def _compliance(points: Array, friction: Array, q: Array, inverse: Array) -> None:
    """Fill `inverse` (3, 3) with the inverse of sum_k (mu N_k / |u_k|) J_k^T J_k."""
    total = sx = sy = rr = 0.0
    for k in range(points.shape[0]):
        x, y = points[k, 0], points[k, 1]
        ux, uy = q[0] - q[2] * y, q[1] + q[2] * x
        w = friction[k] / math.sqrt(ux * ux + uy * uy + _STILL_M * _STILL_M)
        total += w
        sx += w * x
        sy += w * y
        rr += w * (x * x + y * y)
    # [[total, 0, -sy], [0, total, sx], [-sy, sx, rr]], inverted about its centre.
    cx, cy = sx / total, sy / total
    about = rr - total * (cx * cx + cy * cy)
    turn = 1.0 / max(about, 1e-12 * rr + 1e-300)
    inverse[0, 0] = 1.0 / total + cy * cy * turn
    inverse[1, 1] = 1.0 / total + cx * cx * turn
    inverse[0, 1] = inverse[1, 0] = -cx * cy * turn
    inverse[0, 2] = inverse[2, 0] = cy * turn
    inverse[1, 2] = inverse[2, 1] = -cx * turn
    inverse[2, 2] = turn


@kernel
def _quadratic(
    bodies: NDArray[np.int64],
    normals: Array,
    wrench: Array,
    gaps: Array,
    travel: Array,
    inverse: Array,
    motion: Array,
    force: Array,
) -> float:
    """Solve the quadratic program by projected Gauss-Seidel, from the last forces."""
    c = gaps.shape[0]
    motion[:] = 0.0
    for k in range(c):
        _apply(bodies[k], wrench[k], inverse, force[k], motion)
    left = 0.0
    for _ in range(_SWEEPS):
        change, left = 0.0, 0.0
        for k in range(c):
            gap = gaps[k]
            if bodies[k, 0] == ROBOT:
                gap -= normals[k, 0] * travel[0] + normals[k, 1] * travel[1]
            give = 0.0
            for side in range(2):
                b = bodies[k, side]
                if b < 0:
                    continue
                for row in range(3):
                    gap += wrench[k, side, row] * motion[b, row]
                    for column in range(3):
                        give += (
                            wrench[k, side, row]
                            * inverse[b, row, column]
                            * wrench[k, side, column]
                        )
            if give <= 0.0:
                left = max(left, -gap)
                continue
            step = max(force[k] - gap / give, 0.0) - force[k]
            force[k] += step
            change = max(change, abs(step * give))
            left = max(left, -gap)
            _apply(bodies[k], wrench[k], inverse, step, motion)
        if change <= _SOLVED:
            break
    return left


@kernel
def _apply(
    pair: NDArray[np.int64], wrench: Array, inverse: Array, force: float, motion: Array
) -> None:
    """Add what a contact force does to the motions of its two bodies."""
    for side in range(2):
        b = pair[side]
        if b < 0:
            continue
        for row in range(3):
            for column in range(3):
                motion[b, row] += inverse[b, row, column] * wrench[side, column] * force
