"""Regression gates, such as `success < -0.02`: conditions that no comparison may meet.

    [FAMILY/]COLUMN[:all][.low|.high] OPERATOR NUMBER

The left side is the difference `first - baseline` of a column: a rate over all scenes,
a cost on scenes that both solved, or with `:all` over all. `.low` and `.high` are the
ends of its 95 % interval. Where several suites are compared, FAMILY may be
`suite NAME`.
"""

import operator
import re
from collections.abc import Callable, Iterable
from typing import NamedTuple

from beacon_mj.errors import RunError, unknown
from beacon_mj.eval.statistics.compare import COSTS, Comparison, FamilyComparison
from beacon_mj.eval.statistics.summary import OVERALL, RATES

_OPERATORS: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_FORM = re.compile(
    r"\s*(?:(?P<family>(?:suite )?[\w.-]+|no suite)/)?(?P<column>\w+)(?P<all>:all)?"
    r"(?:\.(?P<end>low|high))?\s*(?P<sign><=|>=|<|>)\s*(?P<limit>\S+)\s*"
)


class Gate(NamedTuple):
    """A condition on a difference that fails a comparison.

    Attributes:
        text: As the user wrote it.
        family: A family, or `overall`.
        column: What is compared.
        everywhere: Whether a cost is taken over all scenes.
        end: `estimate`, `low` or `high`.
        sign: A key of the operators.
        limit: The right side.
    """

    text: str
    family: str
    column: str
    everywhere: bool
    end: str
    sign: str
    limit: float


def parse_gate(text: str) -> Gate:
    """Return the gate that a text stands for.

    Raises:
        RunError: If the text has another form, or its column is not compared.
    """
    found = _FORM.fullmatch(text)
    limit = _number(found["limit"]) if found else None
    if found is None or limit is None:
        raise RunError(
            f"--fail-if {text!r}: expected [FAMILY/]COLUMN[:all][.low|.high], one of "
            "< <= > >=, and a number, such as 'success < -0.02'."
        )
    if (column := found["column"]) not in (*RATES, *COSTS):
        raise RunError(
            f"--fail-if {text!r}: {unknown('column', column, (*RATES, *COSTS))}"
        )
    return Gate(
        text=text,
        family=found["family"] or OVERALL,
        column=column,
        everywhere=found["all"] is not None,
        end=found["end"] or "estimate",
        sign=found["sign"],
        limit=limit,
    )


def violations(gates: Iterable[Gate], comparisons: Iterable[Comparison]) -> list[str]:
    """Return one line for every gate that a comparison fails.

    A difference that does not exist, such as a path length when no scene was solved by
    both, fails its gate: a regression gate must not pass because nothing was left.

    Raises:
        RunError: If a gate names a family that was not run.
    """
    known = [*comparisons]
    return [
        line
        for gate in gates
        for comparison in known
        if (line := _violation(gate, comparison)) is not None
    ]


def _violation(gate: Gate, comparison: Comparison) -> str | None:
    if gate.family not in comparison.cells:
        raise RunError(
            f"--fail-if {gate.text!r}: "
            f"{unknown('family', gate.family, comparison.cells)}"
        )
    value = _value(gate, comparison.cells[gate.family])
    arms = f"{comparison.first} against {comparison.baseline}"
    if value is None:
        return f"{gate.text}: {arms}: there is no such difference to judge"
    if _OPERATORS[gate.sign](value, gate.limit):
        return f"{gate.text}: {arms}: it is {value:+.4g}"
    return None


def _value(gate: Gate, cell: FamilyComparison) -> float | None:
    if gate.column in cell.rates:
        difference = cell.rates[gate.column].difference
    else:
        cost = cell.costs[gate.column]
        difference = cost.all if gate.everywhere else cost.solved
    value: float | None = getattr(difference, gate.end)
    return value


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if abs(value) < float("inf") else None
