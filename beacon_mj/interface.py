"""What crosses between the world and a planner: plain data, and nothing else.

Coordinates are in the arena frame, in [m]; times are simulation time, in [s].
Class probabilities are ordered as `beacon_mj.constants.CLASSES`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from beacon_mj.constants import GRAVITY
from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.numerics import unit_vectors

Probabilities = tuple[float, float, float]
Evidence = Literal["moved", "not_moved", "broken"]
Drive = Literal["holonomic", "differential"]
Action = Literal["move", "detour", "push", "approach", "back_off", "follow", "give_up"]


@dataclass(frozen=True, kw_only=True, slots=True)
class SensorSheet:
    """The data sheet of the robot's sensors: how far they reach, how wrong they are.

    What an obstacle's true breakaway force is, over the perceived one, is log-normal
    about `exp(z_common) exp(z_own)`: z_common is one number for all obstacles, z_own
    one for each. Errors are those of the sensor as it is sold, not of this world.

    Attributes:
        range_m: Range of the obstacle sensor from the robot's body [m].
        occlusion: Whether an obstacle is sensed only in line of sight.
        pose_noise_m: Standard deviation of an obstacle's sensed position from the
            robot, along each axis [m].
        missed_detection: Probability that an obstacle in range is missed in a step.
        force_error: Standard deviation of z_own.
        force_scale_error: Standard deviation of z_common; 0 where there is none.
        robot_pose_noise_m: Standard deviation of the robot's own position in the arena,
            along each axis [m].
        force_noise: Standard deviation of a felt force over that force.
        lidar_beams: Beams of the lidar, evenly all round; 0 where there is none.
        lidar_range_m: Range of the lidar from the robot's centre [m].
        lidar_noise_m: Standard deviation of a measured range [m].
        lidar_dropout: Probability that a beam brings nothing back.
        obstacles: Whether obstacles are `perceived`, or `none`: then the scan and touch
            are all there is.
    """

    range_m: float = 1.0
    occlusion: bool = False
    pose_noise_m: float = 0.0
    missed_detection: float = 0.0
    force_error: float = 0.0
    force_scale_error: float = 0.0
    robot_pose_noise_m: float = 0.0
    force_noise: float = 0.0
    lidar_beams: int = 0
    lidar_range_m: float = 3.5
    lidar_noise_m: float = 0.0
    lidar_dropout: float = 0.0
    obstacles: Literal["perceived", "none"] = "perceived"


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Task:
    """What a planner is told before the first step.

    Attributes:
        workspace_m: West, south, east, north limits [m].
        start_m: Where the robot starts, shape (2,) [m].
        goal_m: Where it must go, shape (2,) [m].
        radius_m: Radius of the robot's disc, bumper included [m].
        mass_kg: Mass of the robot [kg].
        speed_mps: Largest speed [m/s].
        force_max_n: Largest force the drive can apply [N].
        bumper_stiffness_npm: Stiffness of the bumper's spring [N/m].
        control_period_s: Time for which one command holds [s].
        goal_tolerance_m: Distance to the goal that counts as reached [m].
        sensing_radius_m: Range of the obstacle sensor from the robot's body [m].
        sensor: The data sheet of the sensors, that range included.
        max_steps: Control steps after which the episode ends.
        motion_cost_jpm: The protocol's kappa_d, energy per metre travelled [J/m].
        seed: The planner's own stream of randomness.
        mission_day: Which day of a mission this is, from 0; None outside missions. The
            days of a mission are tasks in one room: obstacles keep their ids, and start
            and goal are new each day.
        mission_days: How many days the mission has; None outside missions.
        drive: `holonomic`, a disc that moves any way at once and does not turn, or
            `differential`, which drives along its heading and turns.
        turn_rate_max_radps: Largest turn rate; 0 for a holonomic robot.
    """

    workspace_m: tuple[float, float, float, float]
    start_m: Array
    goal_m: Array
    radius_m: float
    mass_kg: float
    speed_mps: float
    force_max_n: float
    bumper_stiffness_npm: float
    control_period_s: float
    goal_tolerance_m: float
    sensing_radius_m: float
    max_steps: int
    motion_cost_jpm: float
    seed: int
    mission_day: int | None = None
    mission_days: int | None = None
    sensor: SensorSheet = SensorSheet()
    drive: Drive = "holonomic"
    turn_rate_max_radps: float = 0.0


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SensedObstacle:
    """One obstacle as it was last seen.

    Attributes:
        id: Its name, stable over the episode, and over the days of a mission.
        footprint: Outline on the floor at the pose of the last sighting.
        centroid_m: Centroid of that outline, shape (2,) [m].
        height_m: Height above the floor [m].
        volume_m3: Volume [m^3].
        density_kgm3: Perceived density [kg/m^3].
        friction: Perceived friction against the floor.
        scores: Class scores s_i(c) (paper II.B), not normalised.
        seen_s: Time of the last sighting [s].
        visible: Whether it is in range now; if not, its pose may be stale.
        broken: Whether it was seen to break.
        kind: What it looks like, such as "crate"; None where looks tell nothing.
            Obstacles of one kind tend to behave alike; "wall" never gives way.
    """

    id: str
    footprint: Footprint
    centroid_m: Array
    height_m: float
    volume_m3: float
    density_kgm3: float
    friction: float
    scores: Probabilities
    seen_s: float
    visible: bool
    broken: bool
    kind: str | None = None

    @property
    def perceived_force_n(self) -> float:
        """F_i = mu rho V g from perceived values [N] (paper II.D)."""
        return self.friction * self.density_kgm3 * self.volume_m3 * GRAVITY


class Contact(NamedTuple):
    """The bumper feels an obstacle.

    Attributes:
        id: The obstacle; empty where obstacles are not perceived: touch has no names.
        normal: Horizontal unit vector from the robot into it, shape (2,).
        force_n: Filtered force at the end of the control step [N].
    """

    id: str
    normal: Array
    force_n: float


class PushEvidence(NamedTuple):
    """How one push attempt ended; exactly one for each attempt that says anything.

    Attributes:
        id: The obstacle.
        evidence: `moved`, `not_moved` or `broken`.
        force_n: For `moved`, the largest filtered force until it slipped, an upper
            bound on the force it needs; for `not_moved` the force it held, a lower
            bound; for `broken` the force that broke it [N].
        time_s: When the attempt ended [s].
    """

    id: str
    evidence: Evidence
    force_n: float
    time_s: float


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Scan:
    """One sweep of the lidar, from the robot's centre, all beams at one moment.

    Beam k of n points along the angle 2 pi k / n, counter-clockwise from the arena's x
    axis: the sensor's frame does not turn with the robot.

    Attributes:
        ranges_m: Distance to the first surface along each beam, shape (n,) [m];
            infinite where nothing came back, be it for range or for a dropout.
        range_max_m: Range of the lidar [m].
    """

    ranges_m: Array
    range_max_m: float

    @property
    def angles_rad(self) -> Array:
        """Direction of each beam, shape (n,), in [0, 2 pi) [rad]."""
        return beam_angles(len(self.ranges_m))

    def points_m(self, position_m: Array) -> Array:
        """Return what was hit, as seen from `position_m` (2,), shape (k, 2) [m].

        Args:
            position_m: Centre of the robot, as in the observation of the scan.
        """
        hit = np.isfinite(self.ranges_m)
        directions = unit_vectors(self.angles_rad[hit])
        return np.asarray(position_m + self.ranges_m[hit][:, None] * directions)


def beam_angles(beams: int) -> Array:
    """Return the directions of `beams` beams, evenly all round, shape (n,) [rad]."""
    return np.arange(beams, dtype=np.float64) * (2.0 * math.pi / max(beams, 1))


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Observation:
    """Everything a planner knows at one control step.

    Attributes:
        step: Control steps executed so far.
        time_s: Simulation time [s].
        position_m: Centre of the robot, shape (2,) [m], as it knows it: obstacles in
            sight carry the same error.
        velocity_mps: Its velocity, shape (2,) [m/s].
        battery: Remaining charge in [0, 1].
        bumper_force_n: Force on the bumper from its spring, shape (2,) [N].
        drive_effort: Drive force over its limit, in [0, 1].
        obstacles: All obstacles sensed so far, in order of first sighting.
        footprints: Their footprints, in the same order.
        map_version: Grows by one whenever `footprints` changes.
        contacts: Obstacles that touch the bumper now.
        evidence: Push attempts that ended in the last control step, and what broke
            out of sight before and is sensed again now.
        heading_rad: Where the robot's nose points, counter-clockwise from the x axis,
            in [-pi, pi); None for a robot that does not turn.
        turn_rate_radps: How fast it turns, counter-clockwise; None likewise.
        scan: The lidar's sweep at this moment; None where the robot has no lidar.
    """

    step: int
    time_s: float
    position_m: Array
    velocity_mps: Array
    battery: float
    bumper_force_n: Array
    drive_effort: float
    obstacles: tuple[SensedObstacle, ...]
    footprints: Footprints
    map_version: int
    contacts: tuple[Contact, ...]
    evidence: tuple[PushEvidence, ...]
    heading_rad: float | None = None
    turn_rate_radps: float | None = None
    scan: Scan | None = None


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PlannerInfo:
    """Why a command was chosen. Only the log and the metrics read it.

    Attributes:
        action: What the planner is doing.
        reason: One short sentence.
        target: Obstacle the action is about, if any.
        cost_push: What the last push-or-detour comparison compared of the push, where
            the lower side was chosen: C_push - b_push in the rule of paper II.F.
        cost_detour: The same of the way round: C_detour + m_detour.
        terms: Named terms of the chosen candidate's objective J (paper II.E).
        path_m: Planned path, shape (m, 2) [m].
        beliefs: Class probabilities of each obstacle known to the planner.
        replanned: Whether the path was planned anew in this step.
        expansions: Grid vertices that all searches together expanded in this step.
    """

    action: Action = "move"
    reason: str = ""
    target: str | None = None
    cost_push: float | None = None
    cost_detour: float | None = None
    terms: Mapping[str, float] = field(default_factory=dict)
    path_m: Array | None = None
    beliefs: Mapping[str, Probabilities] = field(default_factory=dict)
    replanned: bool = False
    expansions: int = 0


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Command:
    """A planar velocity for one control period, and why.

    A robot that turns tracks the velocity: it turns its nose or its tail towards it,
    and drives. With `turn_rate_radps` a planner drives itself, by (v, omega).

    Attributes:
        velocity_mps: Velocity of the robot's centre, shape (2,) [m/s]; one above the
            speed limit is scaled down. It is in the arena frame, or, with a turn rate,
            in the robot's own: v forwards, negative for backwards, and 0.
        give_up: Set by a planner that has proved, or decided, that it cannot go on: the
            episode then ends with outcome `gave_up`.
        info: For the log and the metrics.
        turn_rate_radps: Turn rate omega, counter-clockwise, of a robot that turns; one
            above the task's limit is cut to it. None leaves turning to the robot.
    """

    velocity_mps: Array
    give_up: bool = False
    info: PlannerInfo = PlannerInfo()
    turn_rate_radps: float | None = None
