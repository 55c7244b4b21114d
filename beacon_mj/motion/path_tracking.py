"""Tracking a polyline with velocity commands that the robot can obey.

The robot is a velocity servo whose drive is limited to a = force_max / mass. While it
changes from velocity v to a command u it moves as

    v(t) = u + (v - u) (1 - t / t_c),   t < t_c = |v - u| / a,   then u,

so one control period ends at a known place with a known velocity. `follow` inverts
this: it looks for the longest advance along the path whose predicted motion, and the
shortest stop after it, both stay within the tolerance of the path. The second
condition slows the robot before a corner and nowhere else.

Shapes: m path points.
"""

import math
from typing import NamedTuple

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Task
from beacon_mj.jit import kernel

#: Advances that are tried, as fractions of the longest one.
_TRIALS = 16
#: Points of the predicted motion, and of the predicted stop, that are checked.
_SAMPLES = 4


class Tracking(NamedTuple):
    """One step of following a path.

    `velocity_mps` is the command, shape (2,) [m/s]; `progress_m` the arc length of the
    point of the path that is nearest to the robot [m]; `remaining_m` what is left of
    the path after it [m]; `deviation_m` the robot's distance from that point [m].
    """

    velocity_mps: Array
    progress_m: float
    remaining_m: float
    deviation_m: float


def follow(
    path: Array,
    position: Array,
    velocity: Array,
    task: Task,
    *,
    progress_m: float = 0.0,
    speed_mps: float = math.inf,
    tolerance_m: float = 0.005,
) -> Tracking:
    """Return the velocity that takes the robot along a path as fast as it may go.

    Args:
        path: Polyline, shape (m, 2), m >= 1 [m]. It may cross itself or be closed.
        position: Where the robot is, shape (2,) [m].
        velocity: How it moves, shape (2,) [m/s].
        task: Speed limit, drive force, mass and control period.
        progress_m: Progress of the last call with this path, 0 for the first [m].
        speed_mps: Speed limit below the task's [m/s].
        tolerance_m: Largest distance from the path that corners may cause [m].

    Returns:
        Command and progress. The robot comes to rest at the path's end.
    """
    ux, uy, progress, total, deviation = _follow(
        np.ascontiguousarray(path, dtype=np.float64),
        position[0],
        position[1],
        velocity[0],
        velocity[1],
        progress_m,
        min(speed_mps, task.speed_mps),
        task.force_max_n / task.mass_kg,
        task.control_period_s,
        tolerance_m,
    )
    return Tracking(np.array([ux, uy]), progress, total - progress, deviation)


def remainder(path: Array, progress_m: float) -> Array:
    """Return what is left of a path after an arc length, shape (p, 2), p >= 1 [m]."""
    return _remainder(path, progress_m)


@kernel
def _remainder(path: Array, progress_m: float) -> Array:
    """Fill an array with what is left; see `remainder`."""
    arc = _arc_lengths(path)
    first = 0
    while first < path.shape[0] and not arc[first] > progress_m:
        first += 1
    left = np.empty((path.shape[0] - first + 1, 2))
    left[0, 0], left[0, 1] = _point_at(path, arc, progress_m)
    left[1:] = path[first:]
    return left


@kernel
def _arc_lengths(path: Array) -> Array:
    """Arc length at each point of a polyline, shape (m,) [m]."""
    arc = np.zeros(path.shape[0])
    for i in range(1, path.shape[0]):
        dx, dy = path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1]
        arc[i] = arc[i - 1] + math.sqrt(dx * dx + dy * dy)
    return arc


@kernel
def _nearest(
    path: Array, arc: Array, x: float, y: float, low: float, high: float
) -> tuple[float, float]:
    """Distance to the part [low, high] of a path, and the arc length where [m]."""
    best = np.inf
    where = max(0.0, min(low, arc[-1]))
    for i in range(max(path.shape[0] - 1, 1)):
        j = min(i + 1, path.shape[0] - 1)
        step = arc[j] - arc[i]
        if arc[j] < low or arc[i] > high:
            continue
        t = 0.0
        if step > 0.0:
            ex, ey = path[j, 0] - path[i, 0], path[j, 1] - path[i, 1]
            t = ((x - path[i, 0]) * ex + (y - path[i, 1]) * ey) / (step * step)
            t = min(t, (high - arc[i]) / step, 1.0)
            t = max(t, (low - arc[i]) / step, 0.0)
            px, py = path[i, 0] + t * ex, path[i, 1] + t * ey
        else:
            px, py = path[i, 0], path[i, 1]
        d2 = (x - px) * (x - px) + (y - py) * (y - py)
        if d2 < best:
            best = d2
            where = arc[i] + t * step
    return math.sqrt(best), where


@kernel
def _point_at(path: Array, arc: Array, s: float) -> tuple[float, float]:
    """Point of a path at arc length s, its last point beyond the end."""
    for i in range(path.shape[0] - 1):
        if s < arc[i + 1]:
            t = (s - arc[i]) / (arc[i + 1] - arc[i])
            return (
                path[i, 0] + t * (path[i + 1, 0] - path[i, 0]),
                path[i, 1] + t * (path[i + 1, 1] - path[i, 1]),
            )
    return path[-1, 0], path[-1, 1]


@kernel
def _moved(u: float, w: float, change_s: float, t: float) -> float:
    """Displacement along one axis after time t; w = v - u at the start [m]."""
    within = min(t, change_s)
    lag = within - 0.5 * within * within / change_s if change_s > 0.0 else 0.0
    return u * t + w * lag


@kernel
def _command(
    dx: float, dy: float, vx: float, vy: float, speed: float, a: float, period: float
) -> tuple[float, float]:
    """Command whose predicted displacement in one period is (dx, dy), if any is."""
    ux, uy = dx / period, dy / period
    for _ in range(6):
        wx, wy = vx - ux, vy - uy
        change = math.sqrt(wx * wx + wy * wy) / a
        ux += (dx - _moved(ux, wx, change, period)) / period
        uy += (dy - _moved(uy, wy, change, period)) / period
    size = math.sqrt(ux * ux + uy * uy)
    if size > speed:
        ux, uy = ux * speed / size, uy * speed / size
    return ux, uy


@kernel
def _excursion(
    path: Array,
    arc: Array,
    px: float,
    py: float,
    vx: float,
    vy: float,
    ux: float,
    uy: float,
    a: float,
    period: float,
    low: float,
    high: float,
) -> float:
    """Largest distance from the path in one period of command u and a stop after."""
    wx, wy = vx - ux, vy - uy
    change = math.sqrt(wx * wx + wy * wy) / a
    worst = 0.0
    for i in range(1, _SAMPLES + 1):
        t = period * i / _SAMPLES
        x, y = px + _moved(ux, wx, change, t), py + _moved(uy, wy, change, t)
        worst = max(worst, _nearest(path, arc, x, y, low, high)[0])
    left = max(0.0, 1.0 - period / change) if change > 0.0 else 0.0
    ex, ey = ux + wx * left, uy + wy * left
    stop = math.sqrt(ex * ex + ey * ey) / a
    for i in range(1, _SAMPLES + 1):
        t = stop * i / _SAMPLES
        bx, by = x + _moved(0.0, ex, stop, t), y + _moved(0.0, ey, stop, t)
        worst = max(worst, _nearest(path, arc, bx, by, low, high)[0])
    return worst


@kernel
def _follow(
    path: Array,
    px: float,
    py: float,
    vx: float,
    vy: float,
    progress: float,
    speed: float,
    a: float,
    period: float,
    tolerance: float,
) -> tuple[float, float, float, float, float]:
    """Command, progress, length of the path and deviation; see `follow`."""
    arc = _arc_lengths(path)
    reach = speed * period
    ahead = reach + speed * speed / a
    deviation, s = _nearest(path, arc, px, py, progress - 0.02, progress + ahead)
    allowed = max(tolerance, deviation)
    least = np.inf
    bx = by = 0.0
    for trial in range(_TRIALS):
        advance = reach * (1.0 - trial / _TRIALS)
        tx, ty = _point_at(path, arc, s + advance)
        ux, uy = _command(tx - px, ty - py, vx, vy, speed, a, period)
        worst = _excursion(
            path, arc, px, py, vx, vy, ux, uy, a, period, s - 0.02, s + ahead
        )
        if worst < least:
            least, bx, by = worst, ux, uy
        if worst <= allowed:
            break
    return bx, by, s, arc[-1], deviation
