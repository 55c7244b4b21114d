"""Errors of what the robot knows about itself: where it is, and what it feels.

Each has a stream of its own, so that what one of them draws changes no other.
"""

import math

from beacon_mj.geometry import Array
from beacon_mj.scene import Scene
from beacon_mj.streams import stream

#: Time in which the error of the robot's position forgets itself [s].
CORRELATION_S = 10.0


class PoseError:
    """Error of the robot's own position: a first-order Gauss-Markov process.

    A localisation is neither noise nor drift: it is off for a while, and corrected.
    Along each axis, with standard deviation sigma, time constant tau and period T,

        e_0 = sigma w_0,   e_k+1 = a e_k + sigma sqrt(1 - a^2) w_k+1,

    with a = exp(-T / tau) and w standard normal, so that for every k

        E[e_k e_k+n] = sigma^2 exp(-n T / tau)        (Gelb 1974, section 3.7).
    """

    def __init__(self, scene: Scene, sigma_m: float) -> None:
        """Begin an episode.

        Args:
            scene: The scene, whose stream it is.
            sigma_m: Standard deviation along each axis, > 0 [m].
        """
        self._rng = stream("sensor", scene.seed, scene.family, scene.index, "pose")
        self._keep = math.exp(-scene.robot.control_period_s / CORRELATION_S)
        self._fresh_m = sigma_m * math.sqrt(1.0 - self._keep * self._keep)
        self._now_m: Array = sigma_m * self._rng.standard_normal(2)

    def next_m(self) -> Array:
        """Return the error at the next control step, shape (2,) [m]."""
        now = self._now_m
        self._now_m = self._keep * now + self._fresh_m * self._rng.standard_normal(2)
        return now


class ForceGain:
    """Gain of the force sensor in a control step: 1 + s w, w standard normal, >= 0."""

    def __init__(self, scene: Scene, spread: float) -> None:
        """Begin an episode.

        Args:
            scene: The scene, whose stream it is.
            spread: s, the standard deviation of a felt force over that force.
        """
        self._rng = stream("sensor", scene.seed, scene.family, scene.index, "force")
        self._spread = spread

    def next(self) -> float:
        """Return the gain of the next control step."""
        return max(0.0, 1.0 + self._spread * float(self._rng.standard_normal()))
