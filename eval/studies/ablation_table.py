"""An ablation as tables, at most 80 columns wide."""

from collections.abc import Sequence
from pathlib import Path

from rich.table import Table

from beacon_mj.eval.statistics.grouping import shown
from beacon_mj.eval.statistics.intervals import Interval
from beacon_mj.eval.statistics.oracles import NOTE, marked
from beacon_mj.eval.studies.ablation import Effect
from beacon_mj.eval.studies.ladder import Step
from beacon_mj.rendering.tables import Tabular, add_line, plain_table

LEGEND = (
    "A minus: without that part, as differences to the whole planner in the same\n"
    "scenes, failures included. Brackets are 95 % intervals; the rest is in the JSON."
)
LADDER_LEGEND = (
    "The ladder: each rung keeps what the one below it keeps, and more; those that\n"
    "share stand on belief. Differences are paired by scene, failures included."
)
SHOWN = {"steps": 1, "path_length_m": 2}  #: Costs, and their digits.


class Ablation(Tabular):
    """What the parts of a planner are worth.

    Attributes:
        planner: Its name.
        oracle: Whether it is told the truth about each world.
        effects: One a variant, situation and family.
        ladder: The ladder of memory: one a rung, situation and family.
        folder: Where the runs are, and `ablation.json` and `ladder.json`.
        notes: What is to be said of the scenes.
    """

    def __init__(
        self,
        planner: str,
        effects: Sequence[Effect],
        ladder: Sequence[Step],
        folder: Path,
        notes: Sequence[str] = (),
        *,
        oracle: bool = False,
    ) -> None:
        """Hold the effects; see `beacon_mj.ablate`, which measures them."""
        self.planner = planner
        self.oracle = oracle
        self.effects = tuple(effects)
        self.ladder = tuple(ladder)
        self.folder = folder
        self.notes = tuple(notes)

    def tables(self) -> Sequence[Table | str]:
        """Return a table a family, then the ladder of memory of each."""
        names = shown([*dict.fromkeys(effect.family for effect in self.effects)])
        parts: list[Table | str] = [*map(self._table, names), LEGEND]
        if self.ladder:
            names = shown([*dict.fromkeys(step.family for step in self.ladder)])
            parts += [*map(self._ladder, names), LADDER_LEGEND]
        notes = [NOTE, *self.notes] if self.oracle else self.notes
        return [*parts, *notes]

    def _table(self, family: str) -> Table:
        own = [effect for effect in self.effects if effect.family == family]
        who = marked(self.planner, self.oracle)
        table = plain_table(f"{who}, {family}: {_scenes(own)}")
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

    def _ladder(self, family: str) -> Table:
        own = [step for step in self.ladder if step.family == family]
        title = f"{self.planner}, {family}, ladder of memory: {_scenes(own)}"
        table = plain_table(title)
        table.add_column("", no_wrap=True)
        for heading in ("ok", "clean", "steps", "to the rung below"):
            table.add_column(heading, justify="right", no_wrap=True)
        situation = ""
        for step in own:
            if step.situation != situation:
                situation = step.situation
                table.add_section()
                add_line(table, situation, *[""] * 4)
            add_line(
                table,
                f"  {step.rung}",
                str(step.success),
                str(step.clean),
                _interval(step.costs["steps"], 1),
                _interval(step.gains["steps"], 1, "+") if step.gains else "-",
            )
        return table


def _scenes(found: Sequence[Effect | Step]) -> str:
    """Return how many scenes a table is of; not every situation fits every family."""
    counts = [each.scenes for each in found]
    least, most = min(counts), max(counts)
    return f"{most} scenes" if least == most else f"{least} to {most} scenes"


def _cell(effect: Effect, cost: str) -> str:
    sign = "+" if effect.variant else ""
    return _interval(effect.costs[cost], SHOWN[cost], sign)


def _interval(found: Interval, digits: int, sign: str = "") -> str:
    mean, low, high = found
    return f"{mean:{sign}.{digits}f} [{low:.{digits}f},{high:.{digits}f}]"
