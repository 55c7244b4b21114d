"""What a learner observes: arrays of fixed size, made of what a planner is told.

Each part is one entry of the observation. Values beyond a column's bounds are clipped.
Coordinates are along the arena's axes, x east and y north.

Shapes: k rows of nearest obstacles.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array
from beacon_mj.interface import Observation, SensedObstacle, Task
from beacon_mj.numerics import norm

Values = NDArray[np.float32]

REACH_M = 200.0  #: No two points of a room are further apart along an axis.
SPEED_MPS = 10.0  #: Twice the speed of the fastest robot that a scene can hold.
TURN_RADPS = 100.0  #: No robot turns faster.
FORCE_N = 1e4  #: The drive of the strongest one.


class Column(NamedTuple):
    """One number of a part: its name, bounds, and meaning."""

    name: str
    low: float
    high: float
    meaning: str


class Part(ABC):
    """One entry of the observation.

    Attributes:
        name: Its key.
        columns: What stands in its last axis.
        rows: Length of its first axis; None for an array of one axis.
    """

    name: str
    columns: Sequence[Column]
    rows: int | None = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of its array."""
        width = len(self.columns)
        return (width,) if self.rows is None else (self.rows, width)

    @cached_property
    def low(self) -> Values:
        """Least values, in its shape."""
        return self._all([column.low for column in self.columns])

    @cached_property
    def high(self) -> Values:
        """Largest values, in its shape."""
        return self._all([column.high for column in self.columns])

    def array(self, observation: Observation, task: Task) -> Values:
        """Return the values of an observation."""
        values = np.array(self._values(observation, task), np.float32)
        return np.clip(values, self.low, self.high)

    def reset(self) -> None:  # noqa: B027 - most parts remember nothing
        """Forget what was seen before."""

    @abstractmethod
    def _values(self, observation: Observation, task: Task) -> Any:
        """Return numbers that fill its shape."""

    def _all(self, values: Sequence[float]) -> Values:
        return np.broadcast_to(np.array(values, np.float32), self.shape)


class Goal(Part):
    """Where the goal is, from the robot."""

    name = "goal"
    columns = (
        Column("x_m", -REACH_M, REACH_M, "goal from the robot's centre, east"),
        Column("y_m", -REACH_M, REACH_M, "the same, north"),
        Column("distance_m", 0.0, 2.0 * REACH_M, "distance to it"),
    )

    def _values(self, observation: Observation, task: Task) -> Sequence[float]:
        x, y = away = task.goal_m - observation.position_m
        return x, y, norm(away)


class Robot(Part):
    """How the robot moves, and what it feels."""

    name = "robot"
    columns = (
        Column("vx_mps", -SPEED_MPS, SPEED_MPS, "velocity, east"),
        Column("vy_mps", -SPEED_MPS, SPEED_MPS, "the same, north"),
        Column("bumper_x_n", -FORCE_N, FORCE_N, "force on the bumper's spring, east"),
        Column("bumper_y_n", -FORCE_N, FORCE_N, "the same, north"),
        Column("effort", 0.0, 1.0, "drive force over its limit"),
        Column("battery", 0.0, 1.0, "charge"),
        Column("ahead_x", -1.0, 1.0, "unit vector ahead, east; 0 if it does not turn"),
        Column("ahead_y", -1.0, 1.0, "the same, north"),
        Column("turn_radps", -TURN_RADPS, TURN_RADPS, "how fast it turns"),
        Column("elapsed", 0.0, 1.0, "control steps over the most there may be"),
    )

    def _values(self, observation: Observation, task: Task) -> Sequence[float]:
        return (
            *observation.velocity_mps,
            *observation.bumper_force_n,
            observation.drive_effort,
            observation.battery,
            *_ahead(observation.heading_rad),
            observation.turn_rate_radps or 0.0,
            observation.step / task.max_steps,
        )


class Walls(Part):
    """How far the outer walls are from the robot's body."""

    name = "walls"
    columns = (
        Column("west_m", -1.0, REACH_M, "gap to the west wall"),
        Column("south_m", -1.0, REACH_M, "the same, south"),
        Column("east_m", -1.0, REACH_M, "the same, east"),
        Column("north_m", -1.0, REACH_M, "the same, north"),
    )

    def _values(self, observation: Observation, task: Task) -> Sequence[float]:
        x, y = observation.position_m
        west, south, east, north = task.workspace_m
        gaps = (x - west, y - south, east - x, north - y)
        return [gap - task.radius_m for gap in gaps]


class Sweep(Part):
    """The lidar's sweep, where the protocol gives the robot one.

    Beam k of n points along the angle 2 pi k / n, counter-clockwise from east.
    """

    name = "scan"
    columns = (
        Column("range_m", 0.0, REACH_M, "first surface along a beam, else the range"),
    )

    def __init__(self, beams: int) -> None:
        """Hold that many beams."""
        self._beams = beams

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of its array: one number a beam."""
        return (self._beams,)

    def _values(self, observation: Observation, task: Task) -> Array:
        assert observation.scan is not None
        return np.minimum(observation.scan.ranges_m, observation.scan.range_max_m)


class Nearest(Part):
    """The nearest obstacles that were sensed so far, by their gap to the robot's body.

    Rows without one are zero. What is out of range stands where it was seen last.
    """

    name = "obstacles"
    columns = (
        Column("known", 0.0, 1.0, "1 where the row holds an obstacle"),
        Column("near_x_m", -REACH_M, REACH_M, "its nearest point from the robot, east"),
        Column("near_y_m", -REACH_M, REACH_M, "the same, north"),
        Column("gap_m", -1.0, REACH_M, "gap between its outline and the robot's body"),
        Column("x_m", -REACH_M, REACH_M, "its centroid from the robot, east"),
        Column("y_m", -REACH_M, REACH_M, "the same, north"),
        Column("height_m", 0.0, REACH_M, "height above the floor"),
        Column("force_n", 0.0, FORCE_N, "force that it seems to need to move"),
        Column("safe", 0.0, 1.0, "perceived probability that it is fixed or heavy"),
        Column("movable", 0.0, 1.0, "the same, that it can be pushed"),
        Column("fragile", 0.0, 1.0, "the same, that it may break"),
        Column("visible", 0.0, 1.0, "1 while it is sensed"),
        Column("broken", 0.0, 1.0, "1 after it was seen to break"),
        Column("contact_n", 0.0, FORCE_N, "force with which it touches the bumper"),
        Column("moved", 0.0, 1.0, "1 after a push that moved it"),
        Column("held_n", 0.0, FORCE_N, "largest force of a push that did not move it"),
    )

    def __init__(self, rows: int) -> None:
        """Hold that many rows."""
        self.rows = rows
        self.reset()

    def reset(self) -> None:
        """Forget how pushes ended."""
        self._moved = set[str]()
        self._held_n = dict[str, float]()

    def _values(self, observation: Observation, task: Task) -> Sequence[Any]:
        self._remember(observation)
        assert self.rows is not None
        here, outlines = observation.position_m, observation.footprints
        gaps = outlines.distance(here) - task.radius_m
        order = np.argsort(gaps, kind="stable")[: self.rows].tolist()
        points = (outlines.nearest_points(here) - here).tolist()
        felt = {c.id: c.force_n for c in observation.contacts}
        found = [
            (1.0, *points[i], gaps[i], *self._obstacle(o, here, felt.get(o.id, 0.0)))
            for i, o in ((i, observation.obstacles[i]) for i in order)
        ]
        none = (0.0,) * len(self.columns)
        return [*found, *[none] * (self.rows - len(found))]

    def _remember(self, observation: Observation) -> None:
        for each in observation.evidence:
            if each.evidence == "moved":
                self._moved.add(each.id)
            elif each.evidence == "not_moved":
                held = self._held_n.get(each.id, 0.0)
                self._held_n[each.id] = max(held, each.force_n)

    def _obstacle(
        self, o: SensedObstacle, here: Array, contact_n: float
    ) -> Sequence[float]:
        x, y = (o.centroid_m - here).tolist()
        total = math.fsum(o.scores)
        chances = [score / total for score in o.scores] if total > 0.0 else o.scores
        return (
            x,
            y,
            o.height_m,
            o.perceived_force_n,
            *chances,
            o.visible,
            o.broken,
            contact_n,
            o.id in self._moved,
            self._held_n.get(o.id, 0.0),
        )


def _ahead(heading_rad: float | None) -> tuple[float, float]:
    """Return the unit vector along a heading; zero where there is none."""
    if heading_rad is None:
        return 0.0, 0.0
    return math.cos(heading_rad), math.sin(heading_rad)
