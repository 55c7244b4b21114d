"""How good a planner's class beliefs were: its own probabilities against the truth.

Beliefs are those that the planner reports with its decisions. *First* is the first
report about an obstacle, before any evidence from contact; *last* is the final one.
"""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from beacon_mj.constants import CLASSES
from beacon_mj.episode.trace import Trace
from beacon_mj.interface import Probabilities

LEAST = 1e-6  #: Probabilities below this count as this much in the log loss.
IDENTIFIED = 0.9  #: Probability of the true class at which it is identified.


class History(NamedTuple):
    """Reports about one obstacle that differ from the one before.

    Attributes:
        truth: Index of its true class.
        reports: Time [s] and probabilities, the first report at first.
    """

    truth: int
    reports: list[tuple[float, Probabilities]]


def histories(trace: Trace) -> dict[str, History]:
    """Return all reported beliefs by obstacle, leaving out what is no distribution."""
    truths = {o.id: CLASSES.index(o.interaction) for o in trace.scene.obstacles}
    out: dict[str, History] = {}
    period = trace.scene.robot.control_period_s
    before: Mapping[str, Probabilities] = {}
    for record in trace.steps:
        beliefs = record.command.info.beliefs
        for name, p in beliefs.items():
            if before.get(name) is p:
                continue
            if name in truths and _is_distribution(p):
                history = out.setdefault(name, History(truths[name], []))
                # A decision is taken at the start of the step that it causes.
                history.reports.append((record.outcome.time_s - period, p))
        before = beliefs
    return out


def brier(p: Probabilities, truth: int) -> float:
    """Return sum_c (p_c - [c is true])^2, in [0, 2]; 0 is best.

    Brier, "Verification of forecasts expressed in terms of probability", 1950.
    """
    return math.fsum((q - (c == truth)) * (q - (c == truth)) for c, q in enumerate(p))


def log_loss(p: Probabilities, truth: int) -> float:
    """Return -ln max(p_true, 1e-6) [nat]; 0 is best.

    Good, "Rational Decisions", 1952; bounded so that one certain mistake does not
    decide a mean.
    """
    return -math.log(max(p[truth], LEAST))


def mean_brier(chosen: Iterable[History], report: int) -> float | None:
    """Return the mean Brier score of report number 0 or -1; None over nothing."""
    return _mean([brier(h.reports[report][1], h.truth) for h in chosen])


def mean_log_loss(chosen: Iterable[History], report: int) -> float | None:
    """Return the mean log loss of report number 0 or -1; None over nothing."""
    return _mean([log_loss(h.reports[report][1], h.truth) for h in chosen])


def pushed(trace: Trace, known: Mapping[str, History]) -> list[History]:
    """Return the histories of obstacles that a push attempt left evidence about."""
    names = {
        attempt.obstacle
        for record in trace.steps
        for attempt in record.outcome.attempts
    }
    return [h for name, h in known.items() if name in names]


def time_to_identify_s(known: Iterable[History]) -> float | None:
    """Return the mean time from first report to identification [s].

    An obstacle is identified from the report on from which the probability of its
    true class stays at 0.9 or above until the end. The mean is over obstacles that
    were identified; None if none was.
    """
    return _mean([t for h in known if (t := _identified(h)) is not None])


def _identified(history: History) -> float | None:
    since = None
    for time_s, p in history.reports:
        if p[history.truth] < IDENTIFIED:
            since = None
        elif since is None:
            since = time_s
    return None if since is None else since - history.reports[0][0]


def _is_distribution(p: Probabilities) -> bool:
    return (
        len(p) == len(CLASSES)
        and all(0.0 <= q <= 1.0 + 1e-6 for q in p)
        and abs(math.fsum(p) - 1.0) < 1e-6
    )


def _mean(values: list[float]) -> float | None:
    return math.fsum(values) / len(values) if values else None
