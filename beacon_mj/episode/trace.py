"""The trace of an episode: all that its metrics need, and all that its log holds.

A live episode and a log read back give the same trace, so one implementation of each
metric serves both.
"""

from dataclasses import dataclass, field
from typing import Literal

from beacon_mj.episode.protocol import Protocol
from beacon_mj.geometry import Array
from beacon_mj.interface import Command
from beacon_mj.scene import Scene
from beacon_mj.world.outcome import StepOutcome
from beacon_mj.world.overnight import Left

Outcome = Literal[
    "reached",
    "timeout",
    "stuck",
    "gave_up",
    "battery_empty",
    "planner_error",
    "simulation_error",
]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepRecord:
    """One control step.

    Attributes:
        command: What the planner decided, and why.
        outcome: What the world did.
        battery: Charge after the step, in [0, 1].
        newly_sensed: Ids of obstacles first sensed in the observation after the step.
        decision_s: Wall-clock time of the decision [s]; in no log that must be equal.
    """

    command: Command
    outcome: StepOutcome
    battery: float
    newly_sensed: tuple[str, ...]
    decision_s: float


@dataclass(slots=True, kw_only=True, eq=False)
class Trace:
    """One episode.

    Attributes:
        planner: Name of the planner.
        scene: The whole truth about its world.
        suite: The released suite that the scene is of, if it was shown to be of one.
        protocol: How it was run.
        left: How the room was left the day before; None where it is as in the scene.
        start_m: Recorded start, shape (2,) [m].
        oracle: Whether the planner was told the truth about its world.
        first_sensed: Ids of obstacles sensed before the first step.
        steps: The control steps, in order.
        outcome: How it ended; None while it runs.
        detail: One line about how it ended: a planner's reason, an error's text.
        wall_time_s: Wall-clock time of the whole episode [s].
    """

    planner: str
    scene: Scene
    protocol: Protocol
    start_m: Array
    oracle: bool = False
    left: Left | None = None
    suite: str | None = None
    first_sensed: tuple[str, ...] = ()
    steps: list[StepRecord] = field(default_factory=list)
    outcome: Outcome | None = None
    detail: str = ""
    wall_time_s: float = 0.0
