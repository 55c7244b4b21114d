"""What a learned policy observes: a vector of numbers of order one, with history.

Everything is in a frame that turns with the way to the goal: its x axis points from the
robot at the goal. So one policy serves all directions.

Shapes: b bearings, r radii, n obstacles.
"""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from beacon_mj.geometry import Array, Mask
from beacon_mj.interface import Observation, SensedObstacle, Task
from beacon_mj.motion.grid import Cells
from beacon_mj.numerics import norm

BEARINGS = 24  #: Directions in which the known map is felt out, evenly all round.
#: Distances along each of them at which the robot is imagined [m].
RADII_M = (0.04, 0.1, 0.18, 0.28, 0.4, 0.55, 0.75, 1.0, 1.4, 2.0)
AGES_S = (1, 2, 4, 8, 16)  #: How long ago the robot is remembered to have been where.
FRAMES = 4  #: Decisions whose velocity, force and action are remembered.
LEVELS = 5  #: Numbers for each bearing; see `Features`.
#: Of the outer wall: safe, fragile, and half the force it needs over the robot's.
WALL = (1.0, 0.0, 1.0)

SIZE = 2 + 7 * FRAMES + 2 * len(AGES_S) + LEVELS * BEARINGS  #: Length of the vector.


class Features:
    """Turns what a planner is told into the vector that a policy decides by.

    In order:

    * the distance to the goal, up to 10 m and up to 1 m (2);
    * of this and the last three decisions: velocity and force on the bumper, both over
      the robot's largest, effort of the drive, and the action before it (7 each);
    * where the robot was 1, 2, 4, 8 and 16 s ago, over how far it could have come (10);
    * for each of 24 bearings, the first towards the goal: how far the disc could
      drive before it met anything known, and what seems not to move; of what it meets
      first the probabilities of being safe and of being fragile, and half the force
      that it seems to need over the robot's (24 each).

    What withstood a push counts as safe from then on, what moved as not safe.
    """

    def reset(self, task: Task) -> None:
        """Forget everything and start on a task."""
        self._task = task
        self._moved: set[str] = set()
        self._held: set[str] = set()
        self._way: list[Array] = []
        self._frames: deque[list[float]] = deque(
            [[0.0] * 7 for _ in range(FRAMES)], maxlen=FRAMES
        )
        self._action = (0.0, 0.0)
        self._ahead = (1.0, 0.0)

    def see(self, observation: Observation) -> None:
        """Take note of one control step; call it in each, before `vector`."""
        self._way.append(observation.position_m)
        for each in observation.evidence:
            if each.evidence == "moved":
                self._moved.add(each.id)
                self._held.discard(each.id)
            elif each.evidence == "not_moved":
                self._held.add(each.id)

    def vector(self, observation: Observation) -> Array:
        """Return the vector of an observation, shape (SIZE,); call it per decision."""
        away = self._task.goal_m - observation.position_m
        distance_m = norm(away)
        if distance_m > 1e-6:
            self._ahead = (away[0] / distance_m, away[1] / distance_m)
        self._frames.append(self._frame(observation))
        parts: list[Sequence[float] | Array] = [
            [min(distance_m, 10.0) / 10.0, min(distance_m, 1.0)],
            *reversed(self._frames),
            self._past(observation.position_m),
            self._surroundings(observation),
        ]
        whole = np.concatenate([np.asarray(part) for part in parts])
        return np.asarray(np.clip(whole, -2.0, 2.0))

    def velocity_share(self, action: Array) -> Array:
        """Return the share of the speed that an action stands for, shape (2,).

        Args:
            action: Share of the speed towards the goal and to the left of it, shape
                (2,); above a length of one it is scaled down.
        """
        x, y = (min(max(float(a), -1.0), 1.0) for a in action)
        self._action = (x, y)
        c, s = self._ahead
        scale = 1.0 / max(1.0, math.sqrt(x * x + y * y))
        return np.array([scale * (c * x - s * y), scale * (s * x + c * y)])

    def _turned(self, vector: Array) -> tuple[float, float]:
        """Return a vector of the arena in the frame of the goal."""
        (x, y), (c, s) = vector.tolist(), self._ahead
        return c * x + s * y, c * y - s * x

    def _frame(self, observation: Observation) -> list[float]:
        """Return what is remembered of one decision: 7 numbers."""
        task = self._task
        vx, vy = self._turned(observation.velocity_mps / task.speed_mps)
        fx, fy = self._turned(observation.bumper_force_n / task.force_max_n)
        return [vx, vy, fx, fy, observation.drive_effort, *self._action]

    def _past(self, here: Array) -> list[float]:
        """Return where the robot was, for each age two numbers."""
        found: list[float] = []
        for age_s in AGES_S:
            steps = round(age_s / self._task.control_period_s)
            before = self._way[max(0, len(self._way) - 1 - steps)]
            found += self._turned((here - before) / (self._task.speed_mps * age_s))
        return found

    def _surroundings(self, observation: Observation) -> Array:
        """Return five numbers for each bearing, shape (5 b,)."""
        points = observation.position_m + self._offsets()
        blocked, first = self._blocked(points, observation)
        traits = np.array([*map(self._traits, observation.obstacles), WALL])
        stays = (traits[:, 0] >= 0.5) | (traits[:, 2] >= 0.5)
        free = _free_share(np.asarray(blocked.any(axis=2)))
        hard = _free_share(np.asarray(blocked[:, :, stays].any(axis=2)))
        met = traits[first] * (free < 1.0)[:, None]
        return np.concatenate([free, hard, *met.T])

    def _offsets(self) -> Array:
        """Return where the robot is imagined, from where it is, shape (b r, 2) [m]."""
        (c, s), radii = self._ahead, np.array(RADII_M)
        x, y = _DIRECTIONS[:, :1], _DIRECTIONS[:, 1:]
        turned = np.stack([(c * x - s * y) * radii, (s * x + c * y) * radii], axis=-1)
        return turned.reshape(-1, 2)

    def _blocked(self, points: Array, observation: Observation) -> tuple[Mask, Cells]:
        """Return what stands in the way: (b, r, n + 1), and the first one, (b,).

        The last column is the outer wall.
        """
        west, south, east, north = self._task.workspace_m
        x, y = points[:, 0], points[:, 1]
        wall = np.minimum(
            np.minimum(x - west, east - x), np.minimum(y - south, north - y)
        )
        gaps = observation.footprints.distances(points)
        all_gaps = np.concatenate([gaps, wall[:, None]], axis=1)
        all_gaps = all_gaps.reshape(BEARINGS, len(RADII_M), -1)
        blocked = all_gaps < self._task.radius_m
        rows = np.arange(BEARINGS)
        nearest = all_gaps.argmin(axis=2)
        return blocked, nearest[rows, np.asarray(blocked.any(axis=2)).argmax(axis=1)]

    def _traits(self, obstacle: SensedObstacle) -> tuple[float, float, float]:
        """Return three numbers, as of `WALL`."""
        safe, fragile = _chances(obstacle.scores)
        share = min(obstacle.perceived_force_n / self._task.force_max_n, 2.0) / 2.0
        if obstacle.id in self._held:
            return 1.0, fragile, 1.0
        if obstacle.id in self._moved:
            return 0.0, fragile, min(share, 0.4)
        return safe, fragile, share


def _chances(scores: Sequence[float]) -> tuple[float, float]:
    """Return the probabilities of being safe, and of being fragile."""
    total = math.fsum(scores)
    return (scores[0] / total, scores[2] / total) if total > 0.0 else (1 / 3, 1 / 3)


def _free_share(blocked: Mask) -> Array:
    """Return the share of the radii before the first that is blocked, shape (b,).

    Args:
        blocked: Shape (b, r).
    """
    first = np.where(blocked.any(axis=1), blocked.argmax(axis=1), len(RADII_M))
    return np.asarray(first / len(RADII_M))


_DIRECTIONS = np.array(
    [
        [math.cos(2.0 * math.pi * k / BEARINGS), math.sin(2.0 * math.pi * k / BEARINGS)]
        for k in range(BEARINGS)
    ]
)
