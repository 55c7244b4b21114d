"""The fidelity checks as a table."""

from collections.abc import Sequence

from rich.table import Table

from beacon_mj.fidelity.law import Law
from beacon_mj.rendering.tables import Listing, add_line, plain_table


class Fidelity(Listing[Law]):
    """Measured physics against closed forms, as a sequence of rows and as a table."""

    @property
    def ok(self) -> bool:
        """Whether every row passes."""
        return all(row.passed for row in self)

    def tables(self) -> Sequence[Table | str]:
        """Return a line a row, and how many pass."""
        table = plain_table()
        table.add_column("law")
        for heading in ("expected", "measured", "tolerance"):
            table.add_column(heading, justify="right", no_wrap=True)
        table.add_column("unit")
        table.add_column("", no_wrap=True)
        for row in self:
            numbers = [f"{x:.4g}" for x in (row.expected, row.measured, row.tolerance)]
            verdict = "ok" if row.passed else "FAIL"
            add_line(table, f"{row.check}: {row.law}", *numbers, row.unit, verdict)
        passed = sum(row.passed for row in self)
        return [table, f"\n{passed} of {len(self)} rows pass"]
