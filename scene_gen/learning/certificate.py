"""The certificate of the value of learning: from prior and geometry, exactly."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from beacon_mj.geometry import Footprint, Footprints, polyline_length
from beacon_mj.learning import memoryless_s, updating_s
from beacon_mj.motion.visibility_graph import shortest_path
from beacon_mj.scene import (
    LearningCertificate,
    LearningPart,
    LearningStage,
    Obstacle,
    Robot,
    door_problem,
)
from beacon_mj.scene_gen.learning.room import DOOR_M, Door, Part, Room, Stage
from beacon_mj.scene_gen.rooms import Bounds, Point

STAND_M = 0.04  #: Gap between robot and door before it pushes.
#: How far beyond a door's middle the robot pushes it before it can leave to the side.
BEYOND_M = 0.75
DECIMALS = 6  #: Of times in [s].


def certify_parts(
    parts: Iterable[LearningPart], fail_s: float, pass_s: float
) -> LearningCertificate:
    """Return the certificate of parts as a scene stores them.

    Args:
        parts: Stages, travel times and prior.
        fail_s: Time that a push which fails costs [s].
        pass_s: Time that a push which works costs, beyond the drive [s].
    """
    parts = tuple(parts)
    problem = door_problem(parts, fail_s, pass_s)
    memoryless = round(memoryless_s(problem), DECIMALS)
    updating = round(updating_s(problem), DECIMALS)
    return LearningCertificate(
        memoryless_s=memoryless,
        updating_s=updating,
        value_s=round(max(0.0, memoryless - updating), DECIMALS),
        fail_s=fail_s,
        pass_s=pass_s,
        worlds=max(len(part.weights) for part in parts),
        parts=parts,
    )


def measured_parts(
    room: Room, robot: Robot, bounds: Bounds, doors: dict[str, Obstacle]
) -> tuple[LearningPart, ...]:
    """Return the parts of a proposal with their drive times over true lengths.

    Args:
        room: The proposal.
        robot: Its disc and speed.
        bounds: The workspace [m].
        doors: The door's obstacles by their ids in the proposal; only where they stand
            counts.
    """
    drive = _Drive(room, robot, bounds, doors)
    return tuple(_measured(part, drive) for part in room.parts)


def _measured(part: Part, drive: "_Drive") -> LearningPart:
    doors = tuple(dict.fromkeys(d for stage in part.stages for d in stage.doors))
    latent = part.latent
    return LearningPart(
        doors=tuple(d.id for d in doors),
        stages=tuple(_stage(stage, drive) for stage in part.stages),
        weights=latent.weights,
        opens=tuple(
            tuple(latent.chance(w, d) for d in doors)
            for w in range(len(latent.weights))
        ),
    )


def _stage(stage: Stage, drive: "_Drive") -> LearningStage:
    fronts = [drive.before(door) for door in stage.doors]
    return LearningStage(
        doors=tuple(d.id for d in stage.doors),
        enter_s=tuple(drive.seconds(stage.entry_m, f) for f in fronts),
        between_s=tuple(tuple(drive.seconds(a, b) for b in fronts) for a in fronts),
        cross_s=tuple(
            drive.through(front, door, stage.exit_m)
            for front, door in zip(fronts, stage.doors, strict=True)
        ),
    )


class _Drive:
    """Drive times of the disc between points, among walls and closed doors."""

    def __init__(
        self, room: Room, robot: Robot, bounds: Bounds, doors: dict[str, Obstacle]
    ) -> None:
        self._robot, self._bounds = robot, bounds
        self._walls = [_Solid.of(o.footprint) for o in room.walls]
        self._doors = {name: _Solid.of(o.footprint) for name, o in doors.items()}
        self._known: dict[tuple[Point, Point, str | None], float] = {}

    def before(self, door: Door) -> Point:
        """Return where the robot stands before it pushes a door."""
        return (
            door.x_m - 0.5 * DOOR_M - self._robot.radius_m - STAND_M,
            door.y_m,
        )

    def through(self, front: Point, door: Door, goal: Point) -> float:
        """Return the time straight through a door, and on by the shortest path [s]."""
        beyond = (door.x_m + BEYOND_M, door.y_m)
        straight = (beyond[0] - front[0]) / self._robot.speed_mps
        return round(straight + self.seconds(beyond, goal, without=door), DECIMALS)

    def seconds(self, start: Point, goal: Point, without: Door | None = None) -> float:
        """Return the time of the shortest path, doors closed but for one [s]."""
        if start == goal:
            return 0.0
        name = None if without is None else without.id
        key = (min(start, goal), max(start, goal), name)
        if key not in self._known:
            self._known[key] = round(
                self._length(*key) / self._robot.speed_mps, DECIMALS
            )
        return self._known[key]

    def _length(self, start: Point, goal: Point, without: str | None) -> float:
        # Only what lies between the two can be in the way.
        low = min(start[0], goal[0]) - 1.0
        high = max(start[0], goal[0]) + 1.0
        shut = [s for name, s in self._doors.items() if name != without]
        near = [s.footprint for s in (*self._walls, *shut) if s.meets(low, high)]
        path = shortest_path(
            np.array(start),
            np.array(goal),
            Footprints.stack(near),
            self._robot.radius_m,
            self._bounds,
        )
        if path is None:
            raise NoWayError(start, goal)
        return polyline_length(path)


class NoWayError(Exception):
    """A proposal in which a stage cannot be driven."""


class _Solid(NamedTuple):
    """A footprint, and where it ends in the west and in the east [m]."""

    footprint: Footprint
    west: float
    east: float

    @classmethod
    def of(cls, footprint: Footprint) -> "_Solid":
        west, _, east, _ = footprint.polygon().bounds
        return cls(footprint, float(west), float(east))

    def meets(self, low: float, high: float) -> bool:
        return self.east >= low and self.west <= high
