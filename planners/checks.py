"""Checks of configurations, in one voice.

(`beacon_mj.planners.contact.checks` guards a push while it goes on.)
"""

from collections.abc import Sequence

from beacon_mj.errors import PlannerError


class FieldError(PlannerError):
    """A field of a configuration that is not what it should be.

    Attributes:
        field: Its name, dotted from the configuration that raised.
        expected: What it should be, to follow "Expected <field> to be".
        value: What it was.
    """

    def __init__(self, field: str, expected: str, value: object) -> None:
        """Name the field, what was expected, and what it was."""
        super().__init__(field, expected, value)
        self.field, self.expected, self.value = field, expected, value

    def __str__(self) -> str:
        """Return the one line that the user reads."""
        return f"Expected {self.field} to be {self.expected} but it was {self.value!r}."

    def within(self, name: str) -> "FieldError":
        """Return the same error as seen from what holds the configuration."""
        return FieldError(f"{name}.{self.field}", self.expected, self.value)


def expect(name: str, value: object, expected: str, holds: bool) -> None:
    """Raise a FieldError unless the condition holds.

    Args:
        name: The field's name.
        value: What it was.
        expected: What it should be, to follow "Expected <name> to be".
        holds: Whether it is.

    Raises:
        FieldError: If `holds` is false.
    """
    if not holds:
        raise FieldError(name, expected, value)


def expect_between(name: str, value: float, low: float, high: float) -> None:
    """Raise a FieldError unless `low` <= value <= `high`; refuses NaN too."""
    expect(name, value, f"between {low:g} and {high:g}", low <= value <= high)


def expect_all_between(
    name: str, values: Sequence[float], count: int, low: float, high: float
) -> None:
    """Raise a FieldError unless there are `count` values, each in [low, high]."""
    holds = len(values) == count and all(low <= value <= high for value in values)
    expect(name, values, f"{count} numbers between {low:g} and {high:g}", holds)
