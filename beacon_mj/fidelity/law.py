"""One row of the fidelity table."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """A law, what it predicts, and what the simulated world does.

    Attributes:
        check: Name of the check that the row belongs to.
        law: The law in words or symbols, and the case.
        expected: What the law predicts, in `unit`.
        measured: What was measured, in `unit`.
        tolerance: Largest difference allowed, in `unit`.
        unit: Unit of the three numbers; empty for counts and ratios.
    """

    check: str
    law: str
    expected: float
    measured: float
    tolerance: float
    unit: str = ""

    @property
    def passed(self) -> bool:
        """Whether the measured value is within the tolerance; NaN is not."""
        return abs(self.measured - self.expected) <= self.tolerance
