"""What pushes tell of the latent: the posterior over the worlds of a part.

By Bayes' rule, with v_w the prior weight of world w and p_wi the probability that door
i opens there,

    P(w | outcomes) ~ v_w prod_tried(p_wi if it opened else 1 - p_wi)
                          prod_stages(a_w / (1 - prod_i (1 - p_wi))).

The second product is over the stages of which a door was tried, and is the promise that
a stage is no dead end: a_w is 1 once a door of the stage has opened, and until then the
probability that one of those that are left opens, 1 - prod_untried(1 - p_wi).
"""

from collections.abc import Mapping

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.learning.problem import DoorPart

Outcomes = Mapping[int, bool]  #: Whether each door opened, by its number in the part.


def world_posterior(part: DoorPart, outcomes: Outcomes) -> Array | None:
    """Return the probability of each world after some pushes, (w,).

    Args:
        part: The prior.
        outcomes: How each door that was tried ended.

    Returns:
        Probabilities with sum 1; None if no world of the prior allows the outcomes.
    """
    opens = np.array(part.opens, dtype=float)
    weight = np.array(part.weights)
    for door, opened in sorted(outcomes.items()):
        weight = weight * (opens[:, door] if opened else 1.0 - opens[:, door])
    for doors in sorted({tuple(sorted(stage.doors)) for stage in part.stages}):
        tried = [d for d in doors if d in outcomes]
        if not tried:
            continue
        passable = 1.0 - np.prod([1.0 - opens[:, d] for d in doors], axis=0)
        weight = weight / passable
        if not any(outcomes[d] for d in tried):
            left = [1.0 - opens[:, d] for d in doors if d not in outcomes]
            weight = weight * (1.0 - np.prod(left, axis=0))
    total = float(weight.sum())
    return None if total <= 0.0 else np.asarray(weight / total)
