"""How tables mark oracles: planners that are told the truth about each world."""

from collections.abc import Iterable
from typing import Any

from beacon_mj.eval.metrics.row import Row

MARK = "*"
NOTE = "*: an oracle, which is told the truth about each world: out of the contest."


def marked(planner: str, oracle: bool) -> str:
    """Return a planner's name as tables show it."""
    return planner + MARK if oracle else planner


def oracles(rows: Iterable[Row]) -> list[str]:
    """Return the planners that were told the truth in any episode, in order."""
    return list(dict.fromkeys(row.planner for row in rows if row.oracle))


def oracles_of(summary: dict[str, Any]) -> list[str]:
    """Return the oracles that a summary names."""
    return list(summary.get("oracles", ()))
