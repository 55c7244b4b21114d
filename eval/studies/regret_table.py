"""A planner's regret as tables, at most 80 columns wide."""

from collections.abc import Sequence

from rich.table import Table

from beacon_mj.eval.statistics.grouping import shown
from beacon_mj.eval.statistics.oracles import NOTE, marked
from beacon_mj.eval.studies.regret import Price
from beacon_mj.rendering.tables import Tabular, add_line, plain_table

LEGEND = (
    "Means over the scenes that all four runs solved, with 95 % intervals.\n"
    "planning: costs above the clairvoyant's although told everything; geometry: for\n"
    "sensing only what is near; class: for uncertain classes; regret: their sum."
)
_DIGITS = {"steps": 1, "path_length_m": 2, "energy_j": 0}


class Regret(Tabular):
    """What a planner's regret to the clairvoyant is paid for.

    Attributes:
        planner: Its name.
        oracle: Whether it is told the truth about each world.
        prices: The parts, overall and per family.
        notes: What is to be said of the scenes.
    """

    def __init__(
        self,
        planner: str,
        prices: Sequence[Price],
        notes: Sequence[str] = (),
        *,
        oracle: bool = False,
    ) -> None:
        """Hold the parts; see `beacon_mj.regret`, which measures them."""
        self.planner = planner
        self.oracle = oracle
        self.prices = tuple(prices)
        self.notes = tuple(notes)

    def tables(self) -> Sequence[Table | str]:
        """Return a table a family."""
        names = [*dict.fromkeys(price.family for price in self.prices)]
        notes = [NOTE, *self.notes] if self.oracle else self.notes
        return [*map(self._table, shown(names)), LEGEND, *notes]

    def _table(self, family: str) -> Table:
        own = [price for price in self.prices if price.family == family]
        who = marked(self.planner, self.oracle)
        title = f"{who}, {family}: {own[0].scenes} of {own[0].of} scenes"
        table = plain_table(title)
        table.add_column("", min_width=12)
        for heading in ("steps", "%", "path m", "%", "energy J", "%"):
            table.add_column(heading, justify="right", no_wrap=True)
        for price in own:
            add_line(table, price.part, *_cells(price))
        return table


def _cells(price: Price) -> list[str]:
    """Return the costs with their intervals, and as shares of the clairvoyant's."""
    cells = []
    for measure, (mean, low, high) in price.costs.items():
        k = _DIGITS[measure]
        cells.append(f"{mean:.{k}f} [{low:.{k}f},{high:.{k}f}]")
        cells.append(f" {100 * price.share[measure]:.0f}")
    return cells
