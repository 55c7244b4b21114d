"""What a scene stores about learning by touch: its problem, and what it is worth.

The problem is that of `beacon_mj.learning`, with the ids of obstacles for doors. It
follows from prior and geometry alone: nothing in it depends on what is true of the
doors of this scene, so it may be computed again from the family without them.
"""

from collections.abc import Iterable
from typing import Annotated

from msgspec import Meta

from beacon_mj.errors import SceneError
from beacon_mj.learning.problem import DoorPart, DoorProblem, DoorStage
from beacon_mj.scene.record import NonNegative, Positive, Probability, Record


class LearningStage(Record, frozen=True, kw_only=True):
    """Doors side by side between two places that the robot must pass.

    Attributes:
        doors: Their obstacles, (k,).
        enter_s: Drive from the stage's entry to the place before each door, (k,) [s].
        between_s: Drive from the place before one to that before another, (k, k) [s].
        cross_s: Drive from the place before each, through it, to the exit, (k,) [s].
    """

    doors: tuple[str, ...]
    enter_s: tuple[NonNegative, ...]
    between_s: tuple[tuple[NonNegative, ...], ...]
    cross_s: tuple[NonNegative, ...]


class LearningPart(Record, frozen=True, kw_only=True):
    """Stages that ask about one latent.

    Attributes:
        doors: All its doors, (n,).
        stages: In the order in which they are crossed; on several days the same doors.
        weights: Prior weight of each world, (w,).
        opens: Probability that each door opens, given the world, (w, n).
    """

    doors: tuple[str, ...]
    stages: tuple[LearningStage, ...]
    weights: tuple[Probability, ...]
    opens: tuple[tuple[Probability, ...], ...]


class LearningCertificate(Record, frozen=True, kw_only=True):
    """The value of learning, in expectation over the prior.

    Attributes:
        memoryless_s: Least expected time of policies that carry no evidence from one
            stage to another.
        updating_s: Least expected time of all policies.
        value_s: The first minus the second.
        fail_s: Time that a push which fails is taken to cost.
        pass_s: Time that a push which works is taken to cost, beyond the drive.
        worlds: Number of worlds that the latent may be in.
        parts: The problem itself; latents of different parts are independent.
    """

    memoryless_s: NonNegative
    updating_s: NonNegative
    value_s: NonNegative
    fail_s: NonNegative
    pass_s: NonNegative
    worlds: Annotated[int, Meta(ge=1, le=10**6)]
    parts: tuple[LearningPart, ...]


def door_problem(
    parts: Iterable[LearningPart], fail_s: float, pass_s: float
) -> DoorProblem:
    """Return the decision problem of parts as a scene stores them.

    Args:
        parts: Stages, travel times and prior.
        fail_s: Time that a push which fails costs [s].
        pass_s: Time that a push which works costs, beyond the drive [s].

    Raises:
        SceneError: If the parts are no decision problem.
    """
    return DoorProblem(
        parts=tuple(map(_problem_part, parts)), fail_s=fail_s, pass_s=pass_s
    )


def _problem_part(part: LearningPart) -> DoorPart:
    number = {name: i for i, name in enumerate(part.doors)}
    if unknown := {d for stage in part.stages for d in stage.doors} - set(number):
        raise SceneError(
            f"Expected stages of the doors {list(part.doors)} but they name "
            f"{sorted(unknown)}."
        )
    return DoorPart(
        stages=tuple(
            DoorStage(
                doors=tuple(number[name] for name in stage.doors),
                enter_s=stage.enter_s,
                between_s=stage.between_s,
                cross_s=stage.cross_s,
            )
            for stage in part.stages
        ),
        weights=part.weights,
        opens=part.opens,
    )


class Sensing(Record, frozen=True, kw_only=True, omit_defaults=True):
    """How a family is sensed, where it is not as the protocol and the profile say.

    Attributes:
        radius_m: Range of the obstacle sensor from the robot's body.
        occlusion: Whether an obstacle is sensed only in line of sight.
        pose_noise_m: Standard deviation of sensed positions.
        missed_detection: Probability that an obstacle in range is missed in a step.
        material_error: Standard deviation of the logarithm of perceived density, and
            of perceived friction.
        score_concentration: Concentration of the scores of profile `noisy`.
        robot_pose_noise_m: Standard deviation of the robot's own position.
        force_noise: Standard deviation of a felt force over that force.
        force_error: Standard deviation of the logarithm of one obstacle's true over its
            perceived breakaway force, where the perceived values are the family's own.
        force_scale_error: The same of the factor that all obstacles have in common.
        designed: Whether the perceived values of profile `noisy` are the family's own;
            only the generator can make them.
    """

    radius_m: NonNegative | None = None
    occlusion: bool | None = None
    pose_noise_m: NonNegative | None = None
    missed_detection: Probability | None = None
    material_error: NonNegative | None = None
    score_concentration: Positive | None = None
    robot_pose_noise_m: NonNegative | None = None
    force_noise: NonNegative | None = None
    force_error: NonNegative | None = None
    force_scale_error: NonNegative | None = None
    designed: bool = False
