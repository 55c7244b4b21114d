"""`beacon-mj regret`."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from beacon_mj.cli import options

if TYPE_CHECKING:
    from beacon_mj.eval.metrics.row import Row
    from beacon_mj.eval.studies.regret import Price

LEGEND = (
    "Means over the scenes that all four runs solved, with 95 % intervals.\n"
    "planning: costs above the clairvoyant's although told everything; geometry: for\n"
    "sensing only what is near; class: for uncertain classes; regret: their sum."
)


def regret(
    *,
    planner: Annotated[str, Parameter(help="Whose regret.")],
    settings: options.Settings = (),
    family: options.Family = (),
    episodes: Annotated[options.Count, Parameter(help="Scenes per family.")] = 100,
    seed: options.Seed = 0,
    perception: options.Perception = None,
    templates: options.Templates = None,
    workers: options.Workers = None,
    json: options.Json = False,
) -> None:
    """Compare a planner with the clairvoyant, and say what the difference is paid for.

    The planner crosses every scene three times: told everything, sensing only what is
    near, and with uncertain classes.
    """
    from beacon_mj.cli.progress import progress
    from beacon_mj.eval.studies.regret import decompose, regret_runs, run_regret

    profile = perception or "noisy"
    runs, refs = regret_runs(
        planner, settings, family, episodes, seed, profile, templates
    )
    rows: list[tuple[str, Row]] = []
    count = min(workers or os.cpu_count() or 1, len(refs))
    with progress(len(runs) * len(refs), []) as update:
        for name, row in run_regret(runs, refs, count):
            rows.append((name, row))
            update([row])
    prices = decompose(rows)
    if json:
        _print_json(prices)
    else:
        _show(prices, planner)


def _print_json(prices: list[Price]) -> None:
    import msgspec

    encoded = msgspec.json.encode([price._asdict() for price in prices])
    print(msgspec.json.format(encoded).decode())


def _show(prices: list[Price], planner: str) -> None:
    """Print a table a family."""
    from beacon_mj.cli.tables import console, plain_table

    screen = console()
    families = dict.fromkeys(price.family for price in prices)
    for family in list(families)[1:] if len(families) == 2 else families:
        own = [price for price in prices if price.family == family]
        title = f"{planner}, {family}: {own[0].scenes} of {own[0].of} scenes"
        table = plain_table(title)
        table.add_column("", min_width=12)
        for heading in ("steps", "%", "path m", "%", "energy J", "%"):
            table.add_column(heading, justify="right", no_wrap=True)
        for price in own:
            table.add_row(price.part, *_cells(price))
        screen.print(table)
    screen.print(LEGEND)


def _cells(price: Price) -> list[str]:
    """Return the costs with their intervals, and as shares of the clairvoyant's."""
    digits = {"steps": 1, "path_length_m": 2, "energy_j": 0}
    cells = []
    for measure, (mean, low, high) in price.costs.items():
        k = digits[measure]
        cells.append(f"{mean:.{k}f} [{low:.{k}f},{high:.{k}f}]")
        cells.append(f" {100 * price.share[measure]:.0f}")
    return cells
