"""Do beliefs mean what they say? Reliability of class beliefs over the logs of a run.

A forecast is what a planner believes about one obstacle: its most probable class, with
how much confidence. Of the forecasts made with 80 % confidence, 80 % should be right.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from beacon_mj.errors import LogError
from beacon_mj.eval.metrics.belief_metrics import History, histories, pushed
from beacon_mj.eval.statistics.intervals import wilson_interval
from beacon_mj.recording import read_trace

BINS = 10  #: Bins of equal width over [0, 1].
#: When beliefs are looked at, and about which obstacles.
FIRST, PUSHED_FIRST, PUSHED_LAST = (
    "first sight, all obstacles",
    "first sight, pushed obstacles",
    "end, pushed obstacles",
)


class Forecast(NamedTuple):
    """The most probable class: with what probability, and whether it was true."""

    confidence: float
    correct: bool


class Bin(NamedTuple):
    """Forecasts of about one confidence.

    Attributes:
        n: How many there are, at least 1.
        confidence: Their mean confidence.
        correct: Share of them that was right.
        low: Lower end of its Wilson 95 % interval.
        high: Upper end.
    """

    n: int
    confidence: float
    correct: float
    low: float
    high: float


class Reliability(NamedTuple):
    """A reliability diagram: its bins that are not empty, and the error over all.

    Attributes:
        n: Number of forecasts.
        error: Expected calibration error in [0, 1]; None over no forecast.
        bins: In order of confidence.
    """

    n: int
    error: float | None
    bins: list[Bin]


class Beliefs(NamedTuple):
    """What the logs of one planner say.

    Attributes:
        logs: Logs that were read.
        unreadable: Logs that could not be.
        forecasts: By what they are about: `FIRST`, `PUSHED_FIRST`, `PUSHED_LAST`.
    """

    logs: int
    unreadable: int
    forecasts: dict[str, list[Forecast]]


def reliability(forecasts: Sequence[Forecast]) -> Reliability:
    """Return the reliability diagram and the expected calibration error.

        ECE = sum_b n_b / n |correct_b - confidence_b|

    over bins of equal width. Naeini et al., "Obtaining well calibrated probabilities
    using Bayesian binning", 2015; Guo et al., "On calibration of modern neural
    networks", 2017.
    """
    sorted_in: dict[int, list[Forecast]] = {}
    for forecast in forecasts:
        place = min(int(forecast.confidence * BINS), BINS - 1)
        sorted_in.setdefault(place, []).append(forecast)
    bins = [_bin(sorted_in[place]) for place in sorted(sorted_in)]
    n = len(forecasts)
    error = sum(b.n * abs(b.correct - b.confidence) for b in bins) / n if n else None
    return Reliability(n, error, bins)


def forecasts(known: Iterable[History], report: int) -> list[Forecast]:
    """Return the forecasts of report number 0, the first, or -1, the last."""
    out = []
    for history in known:
        p = history.reports[report][1]
        best = max(range(len(p)), key=p.__getitem__)
        out.append(Forecast(min(p[best], 1.0), best == history.truth))
    return out


def read_beliefs(logs: Iterable[Path]) -> Beliefs:
    """Return the beliefs that logs hold; one that cannot be read is counted."""
    found: dict[str, list[Forecast]] = {FIRST: [], PUSHED_FIRST: [], PUSHED_LAST: []}
    good = bad = 0
    for path in logs:
        try:
            trace = read_trace(path)
        except LogError:
            bad += 1
            continue
        good += 1
        known = histories(trace)
        tried = pushed(trace, known)
        found[FIRST] += forecasts(known.values(), 0)
        found[PUSHED_FIRST] += forecasts(tried, 0)
        found[PUSHED_LAST] += forecasts(tried, -1)
    return Beliefs(good, bad, found)


def _bin(members: Sequence[Forecast]) -> Bin:
    n, right = len(members), sum(f.correct for f in members)
    low, high = wilson_interval(right, n)
    confidence = sum(f.confidence for f in members) / n
    return Bin(n, confidence, right / n, low, high)
