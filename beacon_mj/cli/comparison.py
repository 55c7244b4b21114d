"""What `beacon-mj compare` does with its options."""

import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec
from rich.table import Table

from beacon_mj.cli import FAILED
from beacon_mj.cli.tables import console, plain_table
from beacon_mj.eval.statistics.compare import Cell, Comparison, Difference, compare
from beacon_mj.eval.statistics.pairing import Run, comparisons, load_run, match
from beacon_mj.eval.statistics.regression_gates import parse_gate, violations

#: Columns of costs that a terminal has room for, with heading and digits.
COSTS = {
    "path_length_m": ("path m\n", 2),
    "energy_j": ("energy J\n", 0),
    "energy_rolling_j": ("energy J\nkd 2 J/m", 1),
}
LEGEND = (
    "Differences, first minus second, on the same scenes, with 95 % intervals.\n"
    "success: in points, Newcombe's paired interval, p of McNemar's exact test.\n"
    "both: scenes that both solved; path and energy are compared on these (BCa).\n"
    "shorter: on how many scenes of 100 the path is; a failure has the longest one.\n"
    "--json has more columns, and everything over all scenes too."
)


def run_comparison(
    paths: Sequence[Path],
    baseline: str | None,
    fail_if: Sequence[str],
    *,
    common: bool,
    json: bool,
) -> int:
    """Compare, print, and return the exit status.

    Raises:
        RunError: If a run, a gate or the baseline is no good, or scenes differ.
    """
    gates = [parse_gate(text) for text in fail_if]
    runs = [load_run(path) for path in paths]
    arms = comparisons(runs, baseline)
    found = compare([match(a, b, common=common) for a, b in arms])
    failed = violations(gates, found)
    for line in _remarks(runs, found):
        print(f"note: {line}", file=sys.stderr)
    if json:
        encoded = msgspec.json.encode({"comparisons": found, "failed": failed})
        print(msgspec.json.format(encoded).decode())
    else:
        _show(found)
    for line in failed:
        print(f"failed: {line}", file=sys.stderr)
    return FAILED if failed else 0


def _remarks(runs: Sequence[Run], found: Sequence[Comparison]) -> list[str]:
    """Return what else differs between the runs, and what was left out."""
    lines = []
    for run in runs[1:]:
        for name in ("protocol", "versions"):
            if getattr(run.config, name) != getattr(runs[0].config, name):
                lines.append(f"{run.path} was run with other {name}: see config.json.")
    for c in found:
        if c.left_out:
            lines.append(
                f"{c.first} and {c.baseline}: {c.left_out} scenes that only one of "
                "them has were left out."
            )
    return lines


def _show(found: Sequence[Comparison]) -> None:
    screen = console()
    for comparison in found:
        screen.print(_table(comparison, len(found)), "")
    screen.print(LEGEND)


def _table(comparison: Comparison, together: int) -> Table:
    title = f"{comparison.first} against {comparison.baseline}"
    if together > 1:
        title += f"; success: p {_p(comparison.p_holm)} among {together} (Holm)"
    table = plain_table(title, collapse_padding=True)
    table.add_column("", width=10, overflow="fold")
    for heading in ("scenes\nboth", "success\np", *(h for h, _ in COSTS.values())):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("shorter\n%", justify="right", no_wrap=True)
    cells = [*comparison.cells.values()]
    for cell in cells[1:] if len(cells) == 2 else cells:
        table.add_row(cell.family, *_numbers(cell))
    return table


def _numbers(cell: Cell) -> list[str]:
    success = cell.rates["success"]
    path = cell.costs["path_length_m"]
    better = path.improvement
    return [
        f"{cell.scenes}\n{path.solved.n}",
        f"{_difference(success.difference, 0, 100.0)}\np {_p(success.p_value)}",
        *(
            _difference(cell.costs[c].solved, digits)
            for c, (_, digits) in COSTS.items()
        ),
        f"{100.0 * better.probability:.0f}\n"
        f"{_ends(better.low, better.high, '.0f', 100.0)}",
    ]


def _difference(found: Difference, digits: int, scale: float = 1.0) -> str:
    if found.estimate is None:
        return "-"
    form = f"+.{digits}f"
    ends = _ends(found.low, found.high, form, scale)
    return f"{scale * found.estimate:{form}}\n{ends}"


def _ends(low: float | None, high: float | None, form: str, scale: float) -> str:
    if low is None or high is None:
        return "-"
    return f"\\[{scale * low:{form}},{scale * high:{form}}]"


def _p(value: float) -> str:
    return "< 0.001" if value < 0.001 else f"= {value:.3f}"
