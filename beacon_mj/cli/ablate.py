"""`beacon-mj ablate`."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from beacon_mj.cli import options

if TYPE_CHECKING:
    from rich.table import Table

    from beacon_mj.cli.progress import Update
    from beacon_mj.eval.studies.ablation import Effect

LEGEND = (
    "A minus: without that part, as differences to the whole planner in the same\n"
    "scenes, failures included. Brackets are 95 % intervals; the rest is in the JSON."
)
SHOWN = {"steps": 1, "path_length_m": 2}  #: Costs, and their digits.


def ablate(
    *,
    planner: Annotated[str, Parameter(help="Whose parts.")],
    settings: options.Settings = (),
    family: options.Family = (),
    episodes: Annotated[options.Count, Parameter(help="Scenes per family.")] = 100,
    seed: options.Seed = 0,
    templates: options.Templates = None,
    workers: options.Workers = None,
    out: Annotated[
        Path | None,
        Parameter(
            help="Folder; by default a new one under runs/. A folder of the same "
            "options is gone on with."
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """Switch off a planner's parts one at a time, and change what it perceives.

    A part is a field of the planner's configuration that is true by default.
    """
    import msgspec

    from beacon_mj.eval.runs.run_folder import free_name
    from beacon_mj.eval.studies.ablation import ablation_runs, run_ablation

    runs, refs = ablation_runs(planner, settings, family, episodes, seed, templates)
    folder = out or free_name(f"ablation-{planner.rpartition(':')[2]}")
    effects = run_ablation(runs, refs, folder, workers or os.cpu_count() or 1, _stage)
    text = msgspec.json.format(msgspec.json.encode(effects)).decode()
    (folder / "ablation.json").write_text(text + "\n", encoding="utf-8")
    if json:
        print(text)
    else:
        _show(effects, planner)
    print(f"results: {folder}", file=sys.stderr)


@contextmanager
def _stage(name: str, total: int) -> Iterator[Update]:
    from beacon_mj.cli.progress import progress

    print(f"{name}: {total} episodes", file=sys.stderr, flush=True)
    with progress(total, []) as update:
        yield update


def _show(effects: list[Effect], planner: str) -> None:
    """Print a table a family."""
    from beacon_mj.cli.tables import console

    screen = console()
    families = dict.fromkeys(effect.family for effect in effects)
    for family in list(families)[1:] if len(families) == 2 else families:
        own = [effect for effect in effects if effect.family == family]
        screen.print(_table(f"{planner}, {family}: {own[0].scenes} scenes", own))
    screen.print(LEGEND)


def _table(title: str, effects: list[Effect]) -> Table:
    from beacon_mj.cli.tables import plain_table

    table = plain_table(title)
    table.add_column("", no_wrap=True)
    for heading in ("ok", "clean", "steps", "path m"):
        table.add_column(heading, justify="right", no_wrap=True)
    for effect in effects:
        if not effect.variant:
            table.add_section()
        table.add_row(
            f"- {effect.variant}" if effect.variant else effect.situation,
            str(effect.success),
            str(effect.clean),
            *(_cell(effect, cost) for cost in SHOWN),
        )
    return table


def _cell(effect: Effect, cost: str) -> str:
    mean, low, high = effect.costs[cost]
    k, sign = SHOWN[cost], "+" if effect.variant else ""
    return rf"{mean:{sign}.{k}f} \[{low:.{k}f},{high:.{k}f}]"
