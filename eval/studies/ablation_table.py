"""An ablation as tables, at most 80 columns wide."""

from collections.abc import Sequence
from pathlib import Path

from rich.table import Table

from beacon_mj.eval.statistics.oracles import NOTE, marked
from beacon_mj.eval.studies.ablation import Effect
from beacon_mj.rendering.tables import Tabular, add_line, plain_table

LEGEND = (
    "A minus: without that part, as differences to the whole planner in the same\n"
    "scenes, failures included. Brackets are 95 % intervals; the rest is in the JSON."
)
SHOWN = {"steps": 1, "path_length_m": 2}  #: Costs, and their digits.


class Ablation(Tabular):
    """What the parts of a planner are worth.

    Attributes:
        planner: Its name.
        oracle: Whether it is told the truth about each world.
        effects: One a variant, situation and family.
        folder: Where the runs are, and `ablation.json`.
    """

    def __init__(
        self,
        planner: str,
        effects: Sequence[Effect],
        folder: Path,
        *,
        oracle: bool = False,
    ) -> None:
        """Hold the effects; see `beacon_mj.ablate`, which measures them."""
        self.planner = planner
        self.oracle = oracle
        self.effects = tuple(effects)
        self.folder = folder

    def tables(self) -> Sequence[Table | str]:
        """Return a table a family."""
        families = [*dict.fromkeys(effect.family for effect in self.effects)]
        shown = families[1:] if len(families) == 2 else families
        notes = [LEGEND, NOTE] if self.oracle else [LEGEND]
        return [*(self._table(family) for family in shown), *notes]

    def _table(self, family: str) -> Table:
        own = [effect for effect in self.effects if effect.family == family]
        table = plain_table(
            f"{marked(self.planner, self.oracle)}, {family}: {own[0].scenes} scenes"
        )
        table.add_column("", no_wrap=True)
        for heading in ("ok", "clean", "steps", "path m"):
            table.add_column(heading, justify="right", no_wrap=True)
        for effect in own:
            if not effect.variant:
                table.add_section()
            add_line(
                table,
                f"- {effect.variant}" if effect.variant else effect.situation,
                str(effect.success),
                str(effect.clean),
                *(_cell(effect, cost) for cost in SHOWN),
            )
        return table


def _cell(effect: Effect, cost: str) -> str:
    mean, low, high = effect.costs[cost]
    k, sign = SHOWN[cost], "+" if effect.variant else ""
    return f"{mean:{sign}.{k}f} [{low:.{k}f},{high:.{k}f}]"
