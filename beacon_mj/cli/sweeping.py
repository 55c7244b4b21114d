"""What `beacon-mj sweep` does with its options, and its tables."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
from rich.table import Table

from beacon_mj.cli.interrupts import status_of, terminable
from beacon_mj.cli.progress import Update, progress
from beacon_mj.cli.tables import console, plain_table
from beacon_mj.errors import RunError
from beacon_mj.eval.runs.run_folder import free_name
from beacon_mj.eval.statistics.summary import OVERALL
from beacon_mj.eval.studies.parameter_grid import variant_name
from beacon_mj.eval.studies.sweep import Request, Score
from beacon_mj.eval.studies.sweep_run import REQUEST, Gain, Line, Result, run_sweep

SHOWN = 15  #: Configurations in the table of the selection split.
LEGEND = (
    "alone: the best value with all others at their default; best: in the selected\n"
    "configuration. Selected by success, then by energy over all episodes.\n"
    "Brackets are 95 % intervals: Wilson's for rates, BCa bootstrap for energies."
)


def run(
    request: Request, out: Path | None, workers: int | None, *, resume: bool, json: bool
) -> int:
    """Run, or go on with, a sweep; return the exit status."""
    if resume and out is None:
        raise RunError("--resume: expected --out DIR with the sweep to go on with.")
    if out is not None and not resume and (out / REQUEST).exists():
        raise RunError(f"{out}: holds a sweep. Use --resume, or another --out.")
    folder = out or free_name(f"sweep-{request.planner.rpartition(':')[2]}")
    try:
        with terminable():
            result = run_sweep(request, folder, workers or os.cpu_count() or 1, _stage)
    except KeyboardInterrupt as stop:
        print(
            f"interrupted: what is finished is in {folder}; go on with the same "
            f"options and --resume --out {folder}",
            file=sys.stderr,
        )
        return status_of(stop)
    if json:
        print(msgspec.json.format(msgspec.json.encode(result)).decode())
    else:
        show(result)
    print(f"results: {folder}", file=sys.stderr)
    return 0


@contextmanager
def _stage(name: str, total: int) -> Iterator[Update]:
    print(f"{name}: {total} episodes", file=sys.stderr, flush=True)
    with progress(total, []) as update:
        yield update


def show(result: Result) -> None:
    """Print Table I, the selection split, and Table III."""
    screen = console()
    screen.print(_table_i(result.table_i), "")
    screen.print(_selection(result), "")
    screen.print(_table_iii(result))
    screen.print(_gained(result.gain))
    screen.print(LEGEND, markup=False)


def _table(title: str, *headings: str) -> Table:
    table = plain_table(title)
    table.add_column(headings[0], overflow="fold")
    for name in headings[1:]:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _table_i(lines: tuple[Line, ...]) -> Table:
    table = _table("Table I", "parameter", "default", "swept", "alone", "best")
    for line in lines:
        swept = ", ".join(line.values)
        table.add_row(line.field, line.default, swept, line.alone or "-", line.best)
    return table


def _selection(result: Result) -> Table:
    """Return the best configurations on the selection split."""
    request, ranked = (
        result.request,
        sorted(result.scores, key=lambda score: score.merit, reverse=True),
    )
    title = f"selection, seed {request.select_seed}, {len(ranked)} configurations"
    table = _table(title, "changes", "solved", "% [95 % CI]", "energy J", "steps")
    for score in ranked[:SHOWN]:
        name = variant_name("", score.settings).strip("[]") or "default"
        table.add_row(
            name, *_success(score.success), _energy(score), f"{score.steps:.0f}"
        )
    return table


def _table_iii(result: Result) -> Table:
    """Return success and energy on the report split."""
    tables = result.report["tables"]
    title = f"Table III, seed {result.request.seed}"
    table = _table(title, "planner", "solved", "% [95 % CI]", "energy J")
    for planner, cells in tables.items():
        cell = cells[OVERALL]
        energy = cell["mean"]["energy_j"]
        ends = (energy["mean"], energy["low"], energy["high"])
        who = f"{planner} (selected)" if planner == result.name else planner
        table.add_row(who.replace("[", r"\["), *_success(cell["success"]), _span(*ends))
    return table


def _gained(gain: Gain | None) -> str:
    if gain is None:
        return "The default is the selected configuration."
    return (
        f"selected less default, same scenes: success {100 * gain.success:+.1f} % "
        f"(McNemar p = {gain.p_value:.2g}), energy {_span(*gain.energy_j)} J"
    )


def _success(cell: dict[str, float]) -> tuple[str, str]:
    low, high = 100 * cell["low"], 100 * cell["high"]
    return (
        f"{cell['count']}/{cell['n']}",
        rf"{100 * cell['rate']:.0f} \[{low:.0f},{high:.0f}]",
    )


def _energy(score: Score) -> str:
    return _span(*score.energy_j)


def _span(mean: float, low: float | None, high: float | None) -> str:
    if low is None or high is None:
        return f"{mean:.1f}"
    return rf"{mean:.1f} \[{low:.1f},{high:.1f}]"
