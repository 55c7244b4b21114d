"""The results of a run: its rows, its tables, its folder."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig
from beacon_mj.eval.runs.frame import frame
from beacon_mj.eval.runs.jobs import Fault
from beacon_mj.eval.runs.log_files import log_file
from beacon_mj.eval.runs.run_folder import load_config, load_rows
from beacon_mj.eval.statistics.missions import mission_frame
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.eval.statistics.summary_table import SummaryTable
from beacon_mj.rendering.tables import Tabular
from beacon_mj.scene_gen.learning.rounds import cut_round

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    from rich.table import Table

#: Said of planners that are not `bit_reproducible`.
INEXACT = "says that its rows need not be the same another time, or elsewhere."


class Results(Tabular):
    """A run: every planner that crossed its scenes, finished or not.

    In a notebook it shows itself as its tables.

    Attributes:
        folder: The run folder.
        config: What was run.
        episodes: One row an episode, in canonical order: planner, family, index.
        faults: Why planners failed, as far as their episodes ran when this was made; a
            run that is loaded from its folder has none, and says why in `detail`.
    """

    def __init__(
        self,
        folder: Path,
        config: RunConfig,
        episodes: Sequence[Row],
        faults: Sequence[Fault] = (),
    ) -> None:
        """Hold the rows of a run; see `evaluate` and `load_results`, which make it."""
        self.folder = folder
        self.config = config
        self.episodes = sorted(episodes, key=lambda row: row.key)
        self.faults = sorted(faults)

    @property
    def rows(self) -> "pl.DataFrame":
        """The rows as a polars frame: the columns of docs/reference/columns.md.

        What the run varies has a column too, such as `set.beacon.push_bias`.
        """
        return frame(self.episodes, self.config)

    def missions(self) -> "pl.DataFrame":
        """Return a line a planner and mission: its columns, over all days together.

        Sums of steps, lengths, energies and counts; `success` is that of all days.
        Empty for a run without missions; those that lack a day are left out.
        """
        return mission_frame(self.episodes)

    @property
    def planners(self) -> dict[str, list[Row]]:
        """The rows by planner, in the order in which the planners were given."""
        names = [entry.name for entry in self.config.planners]
        found = {name: list[Row]() for name in names}
        for row in self.episodes:
            found.setdefault(row.planner, []).append(row)
        return {name: own for name, own in found.items() if own}

    def summary(self) -> dict[str, Any]:
        """Return every number of the tables, overall and per family."""
        return summarize(self.episodes)

    def table(self) -> SummaryTable:
        """Return the tables: success, lengths, energy, and how episodes ended."""
        return SummaryTable(self.summary(), self.notes())

    def notes(self) -> list[str]:
        """Return what is to be said below every table, a line each.

        That is each planner whose rows need not repeat, and each family of which the
        episodes cut a round.
        """
        indices: dict[str, set[int]] = {}
        for row in self.episodes:
            indices.setdefault(row.family, set()).add(row.scene_index)
        rounds = {n: each.round for n, each in self.config.scenes.items()}
        lines = (
            cut_round(name, len(own), rounds.get(name, 1))
            for name, own in indices.items()
        )
        cut = [line for line in lines if line is not None]
        return [f"{name}: {INEXACT}" for name in self.config.inexact] + cut

    def tables(self) -> "Sequence[Table | str]":
        """Return the tables one by one."""
        return self.table().tables()

    def to_dicts(self) -> list[dict[str, Any]]:
        """Return the rows as dictionaries."""
        return self.rows.to_dicts()

    def to_pandas(self) -> "pd.DataFrame":
        """Return the rows as a pandas frame.

        Raises:
            RunError: If pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise RunError(
                "Expected pandas but it is not installed: pip install pandas."
            ) from error
        found = self.rows
        return pd.DataFrame({name: found[name].to_list() for name in found.columns})

    def failures(self) -> list[str]:
        """Return a line for each planner that failed: how often, and first where.

        The line of the planner's code is known of the episodes that ran when this was
        made.
        """
        lines = []
        for name, rows in self.planners.items():
            failed = [row for row in rows if row.outcome == "planner_error"]
            if failed:
                lines.append(self._failure(name, failed, len(rows)))
        return lines

    def _failure(self, planner: str, failed: Sequence[Row], of: int) -> str:
        known = [fault for fault in self.faults if fault.key[0] == planner]
        keys = [fault.key for fault in known]
        first = next((row for row in failed if row.key in keys), failed[0])
        where = next((f.where for f in known if f.key == first.key), "")
        detail = " ".join(first.detail.split())
        return (
            f"{planner}: failed in {len(failed)} of {of} episodes; first in "
            f"{first.scene_name}: {detail}{f' ({where})' if where else ''}"
        )

    def log(self, planner: str, family: str, index: int) -> Path:
        """Return where the log of an episode is.

        Raises:
            RunError: If the episode left none.
        """
        path = log_file(self.folder, planner, f"{family}_{index:04d}")
        if not path.is_file():
            raise RunError(f"{path}: expected a log but the episode left none.")
        return path

    def __len__(self) -> int:
        """Return the number of episodes."""
        return len(self.episodes)

    def __repr__(self) -> str:
        """Return folder and size."""
        return f"Results({str(self.folder)!r}, {len(self)} episodes)"


Source = Results | str | Path  #: Results, or the folder of a run.


def load_results(folder: str | Path) -> Results:
    """Return the results of a run folder, finished or not.

    Raises:
        RunError: If the folder is no run, or no episode is finished.
    """
    path = Path(folder)
    config, rows = load_config(path), load_rows(path)
    if not rows:
        raise RunError(f"{path}: expected finished episodes but there are none.")
    return Results(path, config, rows)


def results_of(source: Source) -> Results:
    """Return results as they are, or those of a run folder."""
    return source if isinstance(source, Results) else load_results(source)
