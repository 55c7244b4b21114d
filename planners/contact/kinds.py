"""What one obstacle's push tells about others of its kind, exactly.

Beyond the paper, whose belief is per obstacle (II.B). Class probabilities have shape
(3,), ordered as `CLASSES`.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from beacon_mj.constants import CLASSES
from beacon_mj.interface import Probabilities

_K = range(len(CLASSES))
_ONES = [1.0 for _ in CLASSES]


class _Member(NamedTuple):
    """One obstacle of a kind: its normalised scores, and P(all its evidence | c)."""

    scores: Probabilities
    evidence: Probabilities


@dataclass(slots=True)
class KindBeliefs:
    """Classes of all kinds, and of each obstacle of them, and how reliable kinds are.

    A kind has one class L, and an obstacle of the kind has class c = L with
    probability rho, else one drawn from the kind's prior pi:

        P(c | L, rho) = rho [c = L] + (1 - rho) pi(c).

    With w_i(c) the evidence about obstacle i alone, the product of its likelihoods and
    of its score over pi(c), and m_i(L) = sum_c P(c | L, rho) w_i(c),

        b_i(c | rho) ~ w_i(c) sum_L P(c | L, rho) pi(L) prod_{j != i} m_j(L).

    rho is one of a few values, equally likely at first, the same for all kinds; a value
    counts by what it makes of all that happened:

        P(rho) ~ prod_kinds sum_L pi(L) prod_i m_i(L),
        b_i(c) = sum_rho P(rho) b_i(c | rho).

    pi is the mean of the scores of the kind's obstacles. An obstacle without like has
    the paper's belief.

    Attributes:
        reliabilities: The values of rho, each in [0, 1].
        kinds: The obstacles of each kind, by id.
        kind_of: The kind of each obstacle.
    """

    reliabilities: tuple[float, ...]
    kinds: dict[str, dict[str, _Member]] = field(default_factory=dict)
    kind_of: dict[str, str] = field(default_factory=dict)

    def sight(self, obstacle_id: str, kind: str, scores: Probabilities) -> None:
        """Take in an obstacle, its kind, and its normalised class scores."""
        self.kind_of[obstacle_id] = kind
        members = self.kinds.setdefault(kind, {})
        members[obstacle_id] = _Member(scores, (1.0, 1.0, 1.0))

    def learn(self, obstacle_id: str, likelihood: Sequence[float]) -> None:
        """Take in P(e | c) of one push of one of them, shape (3,)."""
        members = self.kinds[self.kind_of[obstacle_id]]
        scores, (a, b, c) = members[obstacle_id]
        la, lb, lc = (float(p) for p in likelihood)
        members[obstacle_id] = _Member(scores, (a * la, b * lb, c * lc))

    def reliability(self) -> tuple[float, ...]:
        """Return P(rho), in the order of `reliabilities`."""
        return _normalised(
            [
                math.fsum(_Kind(members, rho).log_evidence for members in self._groups)
                for rho in self.reliabilities
            ]
        )

    def beliefs(self) -> dict[str, Probabilities]:
        """Return b_i by id."""
        weights = self.reliability()
        beliefs: dict[str, Probabilities] = {}
        for members in self._groups:
            given = [_Kind(members, rho).beliefs() for rho in self.reliabilities]
            for i, each in zip(members, zip(*given, strict=True), strict=True):
                beliefs[i] = _mixed(weights, each)
        return beliefs

    @property
    def _groups(self) -> Iterable[dict[str, _Member]]:
        return self.kinds.values()


class _Kind:
    """One kind under one rho."""

    def __init__(self, members: dict[str, _Member], rho: float) -> None:
        self._rho, n = rho, len(members)
        self._pi = [math.fsum(m.scores[k] for m in members.values()) / n for k in _K]
        self._own = [self._weights(m) for m in members.values()]
        self._messages = [self._message(w) for w in self._own]
        self._scores = [m.scores for m in members.values()]

    @property
    def log_evidence(self) -> float:
        """Logarithm of sum_L pi(L) prod_i m_i(L): how likely is all that happened."""
        total = math.fsum(
            self._pi[k] * math.prod(m[k] for m in self._messages) for k in _K
        )
        return math.log(total) if total > 0.0 else -math.inf

    def beliefs(self) -> list[Probabilities]:
        """Return b_i(c | rho) of all obstacles, (n, 3)."""
        return [
            self._posterior(own, others, scores)
            for own, others, scores in zip(
                self._own,
                _products_of_others(self._messages),
                self._scores,
                strict=True,
            )
        ]

    def _posterior(
        self, own: list[float], others: list[float], scores: Probabilities
    ) -> Probabilities:
        rho, pi = self._rho, self._pi
        kind = [pi[k] * others[k] for k in _K]
        total = math.fsum(kind)
        joint = [own[c] * (rho * kind[c] + (1.0 - rho) * pi[c] * total) for c in _K]
        norm = math.fsum(joint)
        if norm <= 0.0:  # What happened was held impossible: Bayes has no answer.
            return scores
        a, b, c = (p / norm for p in joint)
        return a, b, c

    def _weights(self, member: _Member) -> list[float]:
        """Return w_i(c)."""
        scores, seen = member
        pi = self._pi
        return [seen[k] * (scores[k] / pi[k] if pi[k] > 0.0 else 0.0) for k in _K]

    def _message(self, own: list[float]) -> list[float]:
        """Return m_i(L)."""
        anyhow = math.fsum(p * w for p, w in zip(self._pi, own, strict=True))
        return [self._rho * w + (1.0 - self._rho) * anyhow for w in own]


def _products_of_others(rows: list[list[float]]) -> list[list[float]]:
    """Return for each row the product of all others, (n, 3), without dividing."""
    before, after = [_ONES], [_ONES]
    for row, last in zip(rows[:-1], reversed(rows[1:]), strict=True):
        before.append([a * b for a, b in zip(before[-1], row, strict=True)])
        after.append([a * b for a, b in zip(after[-1], last, strict=True)])
    return [
        [a * b for a, b in zip(x, y, strict=True)]
        for x, y in zip(before, reversed(after), strict=True)
    ]


def _mixed(weights: Sequence[float], beliefs: Sequence[Probabilities]) -> Probabilities:
    a, b, c = (
        math.fsum(w * p[k] for w, p in zip(weights, beliefs, strict=True)) for k in _K
    )
    return a, b, c


def _normalised(logs: Sequence[float]) -> tuple[float, ...]:
    """Return probabilities from logarithms; equal ones where all are impossible."""
    largest = max(logs)
    if largest == -math.inf:
        return tuple(1.0 / len(logs) for _ in logs)
    weights = [math.exp(v - largest) for v in logs]
    total = math.fsum(weights)
    return tuple(w / total for w in weights)
