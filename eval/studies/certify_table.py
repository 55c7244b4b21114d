"""Which scenes were solved without damage, as a table."""

from collections.abc import Sequence

from rich.table import Table

from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.studies.certify import verdict
from beacon_mj.rendering.tables import Tabular, add_line, plain_table

HEADINGS = ("scenes", "clean", "steps", "path m", "energy J", "wall s")


class Certification(Tabular):
    """How the clairvoyant did in stored scenes.

    Attributes:
        episodes: One row a scene, in canonical order.
    """

    def __init__(self, episodes: Sequence[Row]) -> None:
        """Hold the rows; see `beacon_mj.certify`, which runs them."""
        self.episodes = sorted(episodes, key=lambda row: row.key)

    @property
    def failed(self) -> list[Row]:
        """The scenes that were not solved, or not without damage."""
        return [row for row in self.episodes if not row.clean_success]

    @property
    def ok(self) -> bool:
        """Whether every scene was solved without damage."""
        return not self.failed

    def problems(self) -> list[str]:
        """Return a line for each scene that was not solved without damage."""
        return [
            f"{row.scene_name}: {verdict(row)}. {row.detail}".rstrip()
            for row in self.failed
        ]

    def tables(self) -> Sequence[Table | str]:
        """Return a line a family, and the count."""
        table = plain_table(padding=(0, 1))
        for name in ("family", *HEADINGS):
            table.add_column(name, justify="left" if name == "family" else "right")
        for family in sorted({row.family for row in self.episodes}):
            own = [row for row in self.episodes if row.family == family]
            add_line(table, family, *_line(own))
        n = len(self.episodes)
        return [
            table,
            f"{n - len(self.failed)} of {n} scenes solved without damage",
        ]


def _line(rows: Sequence[Row]) -> list[str]:
    """Return counts, then means over all scenes of a family."""
    n = len(rows)
    return [
        str(n),
        str(sum(row.clean_success for row in rows)),
        f"{sum(row.steps for row in rows) / n:.1f}",
        f"{sum(row.path_length_m for row in rows) / n:.2f}",
        f"{sum(row.energy_j for row in rows) / n:.1f}",
        f"{sum(row.wall_time_s for row in rows) / n:.1f}",
    ]
