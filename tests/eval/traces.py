"""Traces made by hand, for metrics whose values can be worked out on paper."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.trace import Outcome, StepRecord, Trace
from beacon_mj.interface import Command, Evidence, PlannerInfo, Probabilities
from beacon_mj.scene import Certificate, Obstacle, Perceived, Robot, Scene, Surface
from beacon_mj.scene.shapes import Box
from beacon_mj.world.outcome import Damage, Displacement, PairForce, StepOutcome
from beacon_mj.world.pushes import AttemptEnd

PERIOD_S = 0.1
MASS_KG = 2.0  #: Of every obstacle: a cube of 0.2 m, 250 kg/m^3.
FRICTION = 0.5
REFERENCE_M = 4.0


def obstacle(name: str, interaction: str, x_m: float) -> Obstacle:
    return Obstacle(
        id=name,
        shape=Box(length_m=0.2, width_m=0.2, height_m=0.2),
        x_m=x_m,
        y_m=5.0,
        yaw_rad=0.0,
        interaction=interaction,  # type: ignore[arg-type]
        fixed=False,
        density_kgm3=250.0,
        friction=FRICTION,
        break_force_n=5.0 if interaction == "fragile" else None,
        perceived=Perceived(scores=(0.2, 0.5, 0.3), density_kgm3=250.0, friction=0.5),
    )


def scene() -> Scene:
    grey = Surface(rgba=(0.5, 0.5, 0.5, 1.0))
    return Scene(
        family="paper",
        index=3,
        seed=11,
        perception="noisy",
        workspace_m=(0.0, 0.0, 6.0, 6.0),
        start_m=(0.0 + 0.5, 1.0),
        goal_m=(4.5, 1.0),
        robot=Robot(),
        surfaces=(grey, grey, grey),
        obstacles=(
            obstacle("a", "movable", 1.0),
            obstacle("b", "movable", 2.0),
            obstacle("c", "fragile", 3.0),
        ),
        certificate=Certificate(
            collision_free_length_m=None,
            reference_length_m=REFERENCE_M,
            straight_line_m=4.0,
            door_ids=("a",),
            margin_m=0.02,
        ),
    )


def force(name: str, other: str = "robot", filtered_n: float = 5.0) -> PairForce:
    return PairForce(
        name, other, np.zeros(3), np.zeros(3), filtered_n, 2.0 * filtered_n,
        filtered_n, 0.1 * filtered_n,
    )  # fmt: skip


def attempt(name: str, evidence: Evidence, began_s: float = 0.0) -> AttemptEnd:
    return AttemptEnd(name, evidence, 9.0, began_s, 0.3)


def step(
    number: int,
    *,
    x_m: float = 0.0,
    contacts: Sequence[PairForce] = (),
    attempts: Sequence[AttemptEnd] = (),
    displacements: Sequence[Displacement] = (),
    damages: Sequence[Damage] = (),
    toppled: Sequence[str] = (),
    sensed: Sequence[str] = (),
    beliefs: Mapping[str, Probabilities] | None = None,
    work_j: float = 0.0,
    battery: float = 1.0,
    decision_s: float = 0.001,
    info: Mapping[str, Any] | None = None,
) -> StepRecord:
    return StepRecord(
        command=Command(
            velocity_mps=np.zeros(2),
            info=PlannerInfo(beliefs=beliefs or {}, **(info or {})),
        ),
        outcome=StepOutcome(
            step=number,
            time_s=number * PERIOD_S,
            position_m=np.array([0.5 + x_m, 1.0]),
            velocity_mps=np.zeros(2),
            bumper_force_n=np.zeros(2),
            drive_effort=0.0,
            actuator_work_j=work_j,
            contacts=tuple(contacts),
            attempts=tuple(attempts),
            displacements=tuple(displacements),
            damages=tuple(damages),
            toppled=tuple(toppled),
        ),
        battery=battery,
        newly_sensed=tuple(sensed),
        decision_s=decision_s,
    )


def trace(
    steps: Sequence[StepRecord],
    outcome: Outcome | None = "reached",
    first_sensed: Sequence[str] = (),
    protocol: Protocol | None = None,
) -> Trace:
    return Trace(
        planner="by-hand",
        scene=scene(),
        protocol=protocol or Protocol(),
        start_m=np.array([0.5, 1.0]),
        first_sensed=tuple(first_sensed),
        steps=list(steps),
        outcome=outcome,
    )
