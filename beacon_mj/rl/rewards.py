"""Rewards as named terms: each a measured number times a weight."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from beacon_mj.episode.trace import Outcome, StepRecord
from beacon_mj.errors import RunError, unknown
from beacon_mj.geometry import Array
from beacon_mj.numerics import norm
from beacon_mj.world.outcome import ROBOT


class Term(NamedTuple):
    """One term: its default weight, and what the number is that it weighs."""

    weight: float
    meaning: str


#: All terms by name.
TERMS: Mapping[str, Term] = {
    "progress": Term(1.0, "how much nearer the goal is, in a straight line [m]"),
    "reached": Term(10.0, "1 in the step that reaches the goal"),
    "step": Term(-0.01, "1 in every step"),
    "broken": Term(-5.0, "obstacles that broke, whatever they were pushed through"),
    "impulse": Term(-0.001, "integral of the robot's contact forces [N s]"),
    "work": Term(0.0, "work of the drives [J]"),
}


def checked_weights(changes: Mapping[str, float]) -> dict[str, float]:
    """Return the weight of each term, some of them changed.

    Raises:
        RunError: If there is no such term, or a weight is not finite.
    """
    for name, weight in changes.items():
        if name not in TERMS:
            raise RunError(unknown("reward term", name, TERMS))
        if not math.isfinite(weight):
            raise RunError(
                f"Expected a finite weight of reward term {name!r} but it was {weight}."
            )
    return {name: term.weight for name, term in TERMS.items()} | dict(changes)


def reward_terms(
    weights: Mapping[str, float],
    before_m: Array,
    record: StepRecord,
    outcome: Outcome | None,
    goal_m: Array,
) -> dict[str, float]:
    """Return the weighted terms of one control step; the reward is their sum.

    Args:
        weights: Weight of each term.
        before_m: Where the robot was before the step, shape (2,) [m].
        record: The step.
        outcome: How the episode ended with it; None if it goes on.
        goal_m: The goal, shape (2,) [m].
    """
    result = record.outcome
    own = [c.impulse_ns for c in result.contacts if c.counterpart == ROBOT]
    values = {
        "progress": norm(goal_m - before_m) - norm(goal_m - result.position_m),
        "reached": float(outcome == "reached"),
        "step": 1.0,
        "broken": float(len(result.damages)),
        "impulse": math.fsum(own),
        "work": result.actuator_work_j,
    }
    return {name: weights[name] * value for name, value in values.items()}
