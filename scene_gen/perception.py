"""Perception profiles: what a classifier would report about each obstacle.

* `truth`: one-hot on the true class, exact material (the paper's fallback, II.B).
* `noisy`: scores from a Dirichlet, calibrated: among obstacles with s(c) = p, a share
  p is of class c. With base rates pi and concentration k, the scores of an obstacle of
  class c are Dirichlet(k pi + e_c); by Bayes' rule the posterior of c given s is s(c).
  The most likely class is right for about 80 % of obstacles.
* `misleading`: the reported class is right half the time and always overconfident.

In the last two, density and friction carry a log-normal error of 15 %. A family may
state another error and another concentration, or make its perceived values itself.
"""

import math
from typing import NamedTuple

import msgspec
import numpy as np

from beacon_mj.constants import CLASSES
from beacon_mj.errors import SceneError
from beacon_mj.scene import Obstacle, Perceived, Profile, Scene, Sensing
from beacon_mj.streams import stream

#: Shares of safe, movable, fragile in the families together (seed 1000).
BASE_RATES = (0.39, 0.40, 0.21)
CONCENTRATION = 0.7  #: k of the noisy profile; smaller is surer.
SCORE_FLOOR = 0.01  #: Least score reported, so that evidence can revise it.
MATERIAL_ERROR = 0.15  #: Standard deviation of the logarithm of density and friction.
MISLEADING_ACCURACY = 0.5
MISLEADING_CONFIDENCE = (0.85, 0.97)  #: Range of the score of the reported class.


class ForceErrors(NamedTuple):
    """How wrong perceived breakaway forces are, as the sensor's data sheet says.

    Attributes:
        force_error: Standard deviation of the logarithm of one obstacle's true over its
            perceived force.
        force_scale_error: The same of the factor that all obstacles have in common.
    """

    force_error: float
    force_scale_error: float


def force_errors(scene: Scene) -> ForceErrors:
    """Return how wrong the perceived forces of a scene's sensor are, to two decimals.

    A force is friction times density times what is known. The two errors are
    independent and alike, so that of the force is sqrt(2) of one:

        sigma_F = sqrt(2) sigma_material.

    Where the perceived values are the family's own, the family says.
    """
    if scene.perception == "truth":
        return ForceErrors(0.0, 0.0)
    sensing = scene.sensing or Sensing()
    if sensing.designed:
        own, common = sensing.force_error, sensing.force_scale_error
    else:
        own, common = math.sqrt(2.0) * _material_error(sensing), 0.0
    return ForceErrors(round(own or 0.0, 2), round(common or 0.0, 2))


def _material_error(sensing: Sensing) -> float:
    own = sensing.material_error
    return MATERIAL_ERROR if own is None else own


def perceive(scene: Scene, profile: Profile, seed: int) -> Scene:
    """Return the scene with perceived values redrawn for `profile`.

    Args:
        scene: Any scene; its own perceived values are replaced.
        profile: Name of the perception profile.
        seed: The perception seed.

    Raises:
        SceneError: If the perceived values of the profile are the family's own.
    """
    sensing = scene.sensing or Sensing()
    if sensing.designed and profile != "truth":
        if profile == scene.perception:
            return scene
        raise SceneError(
            f"{scene.name}: expected perception 'truth', or 'noisy' from the "
            f"generator, but it was {profile!r}: what is perceived here is the "
            "family's own."
        )
    rng = stream("perception", seed, profile, scene.family, scene.index)
    obstacles = tuple(
        msgspec.structs.replace(o, perceived=_perceived(o, profile, sensing, rng))
        for o in scene.obstacles
    )
    return msgspec.structs.replace(scene, perception=profile, obstacles=obstacles)


def _perceived(
    o: Obstacle, profile: Profile, sensing: Sensing, rng: np.random.Generator
) -> Perceived:
    truth = CLASSES.index(o.interaction)
    if profile == "truth":
        one_hot = [0.0, 0.0, 0.0]
        one_hot[truth] = 1.0
        return Perceived(
            scores=(one_hot[0], one_hot[1], one_hot[2]),
            density_kgm3=o.density_kgm3,
            friction=o.friction,
            kind=o.perceived.kind,
        )
    if profile == "noisy":
        drawn = _noisy_scores(truth, sensing.score_concentration or CONCENTRATION, rng)
    else:
        drawn = _misleading_scores(truth, rng)
    scores = np.maximum(drawn, SCORE_FLOOR)
    a, b, c = (round(float(s), 6) for s in scores / scores.sum())
    spread = _material_error(sensing)
    error = [math.exp(spread * z) for z in rng.standard_normal(2).tolist()]
    return Perceived(
        scores=(a, b, c),
        density_kgm3=round(o.density_kgm3 * float(error[0]), 6),
        friction=round(o.friction * float(error[1]), 6),
        kind=o.perceived.kind,
    )


def _noisy_scores(
    truth: int, concentration: float, rng: np.random.Generator
) -> np.ndarray:
    alpha = concentration * np.array(BASE_RATES)
    alpha[truth] += 1.0
    return rng.dirichlet(alpha)


def _misleading_scores(truth: int, rng: np.random.Generator) -> np.ndarray:
    reported = truth
    if rng.random() >= MISLEADING_ACCURACY:
        reported = (truth + 1 + int(rng.integers(2))) % 3
    confidence = rng.uniform(*MISLEADING_CONFIDENCE)
    split = rng.random()
    scores = np.empty(3)
    scores[reported] = confidence
    scores[(reported + 1) % 3] = (1.0 - confidence) * split
    scores[(reported + 2) % 3] = (1.0 - confidence) * (1.0 - split)
    return scores
