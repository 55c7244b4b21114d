"""What one control step did to the world: plain data, for sensor, log and metrics."""

from dataclasses import dataclass
from typing import NamedTuple

from beacon_mj.geometry import Array
from beacon_mj.world.pushes import AttemptEnd

ROBOT, WALL = "robot", "wall"  #: Names of the counterparts that are no obstacles.


class PairForce(NamedTuple):
    """Contact of an obstacle with a counterpart during one control step.

    Attributes:
        obstacle: Obstacle id.
        counterpart: Another obstacle's id, `robot` or `wall`.
        force_n: Force on `obstacle` at the end of the step, shape (3,) [N].
        point_m: Where it acts, shape (3,) [m].
        filtered_n: Filtered magnitude at the end of the step [N].
        peak_n: Largest magnitude at any physics step [N].
        filtered_peak_n: Largest filtered magnitude [N].
        impulse_ns: Magnitude integrated over the step [N s].
    """

    obstacle: str
    counterpart: str
    force_n: Array
    point_m: Array
    filtered_n: float
    peak_n: float
    filtered_peak_n: float
    impulse_ns: float


class Displacement(NamedTuple):
    """How far an obstacle travelled in one control step [m], and through whom.

    `chain` names the bodies from the one that the robot touched to the obstacle
    itself; a chain of one is a direct push, an empty one a cause that is unknown.
    """

    obstacle: str
    distance_m: float
    chain: tuple[str, ...]


class Damage(NamedTuple):
    """An obstacle broke: by whom, at what filtered force [N], when [s]."""

    obstacle: str
    counterpart: str
    force_n: float
    time_s: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepOutcome:
    """The world after one control step.

    Attributes:
        step: Control steps executed so far.
        time_s: Simulation time [s].
        position_m: Centre of the robot, shape (2,) [m].
        velocity_mps: Its velocity, shape (2,) [m/s].
        bumper_force_n: Spring force on the bumper from outside, shape (2,) [N].
        drive_effort: Drive force over its limit, in [0, 1].
        actuator_work_j: Work of the drives during the step [J].
        contacts: Every obstacle contact of the step.
        attempts: Push attempts that ended with evidence, and what broke without one.
        displacements: Obstacles that travelled more than 0.1 mm.
        damages: Obstacles that broke.
        toppled: Obstacles that fell over.
    """

    step: int
    time_s: float
    position_m: Array
    velocity_mps: Array
    bumper_force_n: Array
    drive_effort: float
    actuator_work_j: float
    contacts: tuple[PairForce, ...]
    attempts: tuple[AttemptEnd, ...]
    displacements: tuple[Displacement, ...]
    damages: tuple[Damage, ...]
    toppled: tuple[str, ...]

    @property
    def own_attempts(self) -> tuple[AttemptEnd, ...]:
        """The attempts in which the robot touched the obstacle itself.

        The others are obstacles that something else broke, with no attempt on them.
        """
        by_robot = {d.obstacle for d in self.damages if d.counterpart == ROBOT}
        return tuple(
            a
            for a in self.attempts
            if a.evidence != "broken" or a.ended_s > a.began_s or a.obstacle in by_robot
        )
