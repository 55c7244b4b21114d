"""Checks of planner configurations, in one voice."""

from beacon_mj.errors import PlannerError


def expect(name: str, value: object, expected: str, holds: bool) -> None:
    """Raise a PlannerError that names the field unless the condition holds.

    Args:
        name: The field's name.
        value: What it was.
        expected: What it should be, to follow "Expected <name> to be".
        holds: Whether it is.

    Raises:
        PlannerError: If `holds` is false.
    """
    if not holds:
        raise PlannerError(f"Expected {name} to be {expected} but it was {value!r}.")


def expect_between(name: str, value: float, low: float, high: float) -> None:
    """Raise a PlannerError unless `low` <= value <= `high`; refuses NaN too."""
    expect(name, value, f"between {low:g} and {high:g}", low <= value <= high)
