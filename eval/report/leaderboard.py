"""A leaderboard as one static page: no network, no script, every name escaped."""

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

from beacon_mj.eval.report.page import template

POLICY = "default-src 'none'; style-src 'unsafe-inline'"


class Share(NamedTuple):
    """A rate with its 95 % interval, in per cent."""

    percent: float
    low: float
    high: float

    def __str__(self) -> str:
        """Return one cell."""
        return f"{self.percent:.1f} [{self.low:.1f}, {self.high:.1f}]"


class Line(NamedTuple):
    """A planner of a verified submission on the scenes of one suite.

    Attributes:
        conditions: Suite, perception and protocol: only lines that share them compare.
        planner: Its name.
        origin: Whether it is shipped or from a file, whose hash it gives, and how it
            ran.
        oracle: Whether it was told the truth.
        proof: The level that holds, and what was compared for it.
        scenes: How many scenes of which families, and the seed.
        success: Episodes that reached the goal.
        clean: Those in which nothing broke either.
        steps: Mean number of control steps, with its 95 % interval.
        steps_mean: The mean alone, which orders lines of one success rate.
        version: Of beacon-mj and MuJoCo.
        digest: The SHA-256 of the submission's rows.
        submission: Name of its file.
    """

    conditions: str
    planner: str
    origin: str
    oracle: bool
    proof: str
    scenes: str
    success: Share
    clean: Share
    steps: str
    steps_mean: float
    version: str
    digest: str
    submission: str


class Refused(NamedTuple):
    """A submission that does not hold, and why, a line each."""

    submission: str
    problems: tuple[str, ...]


def render_leaderboard(lines: Sequence[Line], refused: Sequence[Refused]) -> str:
    """Return the page.

    Args:
        lines: Of all submissions that hold, in any order.
        refused: The others.
    """
    ordered = sorted(lines, key=_place)
    boards = [
        (conditions, [*own])
        for conditions, own in groupby(ordered, key=lambda line: line.conditions)
    ]
    page: str = template("leaderboard.html.j2").render(
        policy=POLICY, boards=boards, refused=refused
    )
    return page


def _place(line: Line) -> tuple[object, ...]:
    """Return what orders lines: clean success, then success, then steps."""
    rates = -line.clean.percent, -line.success.percent, line.steps_mean
    return line.conditions, line.oracle, *rates, line.planner, line.submission
