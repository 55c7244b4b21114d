"""Beliefs that share: what one obstacle's push tells about the others.

Beyond the paper, whose belief is per obstacle (II.B). Two things can be shared: the
class of a *kind* of obstacle, and one *scale* between perceived and true forces.

Shapes: class probabilities are (3,), ordered as `CLASSES`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from beacon_mj.constants import CLASSES
from beacon_mj.interface import Probabilities

_K = range(len(CLASSES))
_FLOOR = 1e-6  #: Least likelihood, so that no surprise ends in 0 / 0.
_POINTS = 177  #: Points of the grid over the logarithm of the scale; odd, so one is 0.
_REACH = 3.2  #: Half width of that grid in standard deviations of the prior.
#: Force that an obstacle is felt to move at, over the one it needs: the bumper's
#: filter and the drive's ramp let it overshoot by so much.
OVERSHOOT = (1.05, 1.9)


@dataclass(slots=True)
class KindBelief:
    """Class of a kind, and of each obstacle of it, exactly.

    A kind has one class L, and an obstacle of the kind has class c = L with
    probability rho, else one drawn from the kind's prior pi:

        P(c | L) = rho [c = L] + (1 - rho) pi(c).

    With w_i(c) the evidence about obstacle i alone, the product of its likelihoods and
    of its score over pi(c), and m_i(L) = sum_c P(c | L) w_i(c),

        b_i(c) ~ w_i(c) sum_L P(c | L) pi(L) prod_{j != i} m_j(L).

    pi is the mean of the scores of the kind's obstacles. An obstacle without like has
    the paper's belief.

    Attributes:
        reliability: rho, in [0, 1].
        scores: Normalised class scores of each obstacle by id.
        evidence: Product of the likelihoods of what happened to each obstacle.
    """

    reliability: float
    scores: dict[str, Probabilities] = field(default_factory=dict)
    evidence: dict[str, Probabilities] = field(default_factory=dict)

    def sight(self, obstacle_id: str, scores: Probabilities) -> None:
        """Take in an obstacle of this kind."""
        self.scores[obstacle_id] = scores
        self.evidence[obstacle_id] = (1.0, 1.0, 1.0)

    def learn(self, obstacle_id: str, likelihood: Sequence[float]) -> None:
        """Take in P(e | c) of one push of one of them, shape (3,)."""
        a, b, c = self.evidence[obstacle_id]
        la, lb, lc = (float(p) for p in likelihood)
        self.evidence[obstacle_id] = (a * la, b * lb, c * lc)

    @property
    def prior(self) -> Probabilities:
        """pi, the mean of the scores."""
        n = len(self.scores)
        a, b, c = (math.fsum(s[k] for s in self.scores.values()) / n for k in _K)
        return a, b, c

    def beliefs(self) -> dict[str, Probabilities]:
        """Return b_i by id."""
        pi = self.prior
        own = {i: self._weights(i, pi) for i in self.scores}
        messages = {i: _message(w, pi, self.reliability) for i, w in own.items()}
        return {
            i: self._posterior(i, w, pi, [m for j, m in messages.items() if j != i])
            for i, w in own.items()
        }

    def _weights(self, obstacle_id: str, pi: Probabilities) -> list[float]:
        """Return w_i(c)."""
        scores, seen = self.scores[obstacle_id], self.evidence[obstacle_id]
        return [seen[k] * (scores[k] / pi[k] if pi[k] > 0.0 else 0.0) for k in _K]

    def _posterior(
        self,
        obstacle_id: str,
        own: list[float],
        pi: Probabilities,
        others: list[list[float]],
    ) -> Probabilities:
        kind = [pi[k] * math.prod(m[k] for m in others) for k in _K]
        total = math.fsum(kind)
        rho = self.reliability
        joint = [own[c] * (rho * kind[c] + (1.0 - rho) * pi[c] * total) for c in _K]
        norm = math.fsum(joint)
        if norm <= 0.0:  # What happened was held impossible: Bayes has no answer.
            return self.scores[obstacle_id]
        a, b, c = (p / norm for p in joint)
        return a, b, c


def _message(own: list[float], pi: Probabilities, rho: float) -> list[float]:
    """Return m(L), scaled to a largest value of one."""
    anyhow = math.fsum(p * w for p, w in zip(pi, own, strict=True))
    values = [rho * w + (1.0 - rho) * anyhow for w in own]
    largest = max(*values, _FLOOR)
    return [v / largest for v in values]


class ScaleBelief:
    """One factor s between all perceived forces and the true ones.

        F_i = s F_i^perceived e_i,  ln s ~ N(0, sigma),  ln e_i ~ N(0, sigma_i),

    on a grid of ln s. An obstacle that moved at force f needed between f / 1.9 and
    f / 1.05; one that did not needs more, if its class lets it move at all.
    """

    def __init__(self, scale_error: float, own_error: float) -> None:
        """Start from the sensor's data sheet.

        Args:
            scale_error: sigma, >= 0; with 0 the scale is known to be one.
            own_error: sigma_i, > 0.
        """
        self._own = own_error * math.sqrt(2.0)
        count = _POINTS if scale_error > 0.0 else 1
        reach = _REACH * scale_error
        self._logs = [
            reach * (2.0 * k / (count - 1) - 1.0) if count > 1 else 0.0
            for k in range(count)
        ]
        density = [
            math.exp(-0.5 * (g / scale_error) * (g / scale_error)) if g else 1.0
            for g in self._logs
        ]
        total = math.fsum(density)
        self.weights = [d / total for d in density]

    @property
    def factor(self) -> float:
        """The geometric mean of s."""
        pairs = zip(self.weights, self._logs, strict=True)
        return math.exp(math.fsum(w * g for w, g in pairs))

    def probability_below(self, perceived_n: float, limit_n: float) -> float:
        """Return P(F_i < limit) of an obstacle that was not pushed.

        Args:
            perceived_n: F_i^perceived [N].
            limit_n: The limit [N].
        """
        return math.fsum(
            w * p
            for w, p in zip(
                self.weights, self._below(perceived_n, limit_n), strict=True
            )
        )

    def learn(
        self, perceived_n: float, evidence: str, force_n: float, gives_way: float
    ) -> None:
        """Take in how one push attempt ended.

        Args:
            perceived_n: The obstacle's perceived force [N].
            evidence: `moved`, `not_moved` or `broken`; the last says nothing here.
            force_n: The force that it moved at, or that it withstood [N].
            gives_way: Probability, before this push, that its class moves at all.
        """
        if evidence == "broken":
            return
        if evidence == "moved":
            high = self._below(perceived_n, force_n / OVERSHOOT[0])
            low = self._below(perceived_n, force_n / OVERSHOOT[1])
            likelihood = [a - b for a, b in zip(high, low, strict=True)]
        else:
            moves = self._below(perceived_n, force_n)
            likelihood = [1.0 - gives_way * p for p in moves]
        joint = [
            w * max(p, _FLOOR) for w, p in zip(self.weights, likelihood, strict=True)
        ]
        total = math.fsum(joint)
        self.weights = [w / total for w in joint]

    def _below(self, perceived_n: float, limit_n: float) -> list[float]:
        """Return P(F_i < limit) at each point of the grid."""
        spare = math.log(limit_n / max(perceived_n, 1e-6))
        return [0.5 * math.erfc(-(spare - g) / self._own) for g in self._logs]
