"""Two policies of the Canadian traveller literature, for one stage of doors.

A stage ends at the same place through whatever door, so later stages add the same to
every choice and are left out. d is where the robot is, the entry or before a door.

* Optimism (free-space assumption): every door that did not fail is taken to be open,

      i* = argmin_i t(d, i) + t_cross(i).

  Called OMT, "optimistic policy", by Eyerich, Keller and Helmert (2010).
* Hindsight optimisation: the costs of a clairvoyant in sampled worlds are averaged,

      Q(i) = t(d, i) + 1/n sum_k c_k(i),
      c_k(i) = t_pass + t_cross(i)                                   if i opens in k,
               t_fail + min_j t(i, j) + t_pass + t_cross(j)          otherwise,

  j over the doors that open in world k. The clairvoyant of each sample knows its world,
  so what a push would teach is worth nothing: the policy never probes. HOP in Eyerich,
  Keller and Helmert (2010).
"""

import math
from collections.abc import Set

import numpy as np

from beacon_mj.learning.belief import Outcomes, world_posterior
from beacon_mj.learning.policy import ENTRY
from beacon_mj.learning.problem import DoorPart, DoorProblem, DoorStage


def travel_s(stage: DoorStage, at: int, i: int) -> float:
    """Return the drive from the entry, or from before a door, to door i [s]."""
    return stage.enter_s[i] if at == ENTRY else stage.between_s[at][i]


def optimistic_s(stage: DoorStage, at: int, failed: Set[int]) -> dict[int, float]:
    """Return the time through each door that did not fail, if it opens [s].

    Args:
        stage: The stage.
        at: `ENTRY`, or the place in `stage.doors` of the door that the robot is before.
        failed: Places of the doors that did not open.
    """
    return {
        i: travel_s(stage, at, i) + stage.cross_s[i]
        for i in range(len(stage.doors))
        if i not in failed
    }


def hindsight_s(
    problem: DoorProblem,
    part: DoorPart,
    b: int,
    at: int,
    failed: Set[int],
    outcomes: Outcomes,
    *,
    samples: int,
    rng: np.random.Generator,
) -> dict[int, float]:
    """Return Q(i) of each door of stage b that did not fail [s].

    Args:
        problem: What pushes cost.
        part: The part, one of `problem.parts`.
        b: The stage.
        at: `ENTRY`, or the place in `stage.doors` of the door that the robot is before.
        failed: Places of the doors that did not open.
        outcomes: What is known of the part's doors, those of the stage included.
        samples: How many worlds are sampled.
        rng: Source of the samples.

    Returns:
        By place; empty where the prior allows no world, or no door is left.
    """
    stage = part.stages[b]
    weight = world_posterior(part, outcomes)
    left = [i for i in range(len(stage.doors)) if i not in failed]
    if weight is None or not left:
        return {}
    drawn = rng.choice(len(weight), size=samples, p=weight)
    total = dict.fromkeys(left, 0.0)
    for world in drawn.tolist():
        opens = _draw(part, world, stage, failed, outcomes, rng)
        for i in left:
            total[i] += _clairvoyant_s(problem, stage, i, opens)
    return {i: travel_s(stage, at, i) + total[i] / samples for i in left}


def _draw(
    part: DoorPart,
    world: int,
    stage: DoorStage,
    failed: Set[int],
    outcomes: Outcomes,
    rng: np.random.Generator,
) -> list[int]:
    """Draw which doors of a stage open in a world that is possible; one does."""
    chances = np.array(
        [
            0.0 if i in failed else float(outcomes.get(d, part.opens[world][d]))
            for i, d in enumerate(stage.doors)
        ]
    )
    if chances.max() <= 0.0:
        return []
    while True:
        opens = np.flatnonzero(rng.random(len(chances)) < chances)
        if len(opens):
            return [int(i) for i in opens]


def _clairvoyant_s(
    problem: DoorProblem, stage: DoorStage, i: int, opens: list[int]
) -> float:
    """Return the time from before door i to the exit, of who knows what opens [s]."""
    if i in opens:
        return problem.pass_s + stage.cross_s[i]
    best = min(
        (stage.between_s[i][j] + problem.pass_s + stage.cross_s[j] for j in opens),
        default=math.inf,
    )
    return problem.fail_s + best
