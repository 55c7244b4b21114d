"""Missions as a whole: what the days of each took together."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import msgspec

from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.frame import typed_frame

if TYPE_CHECKING:
    import polars as pl

#: Columns that are summed over the days of a mission.
SUMS = (
    "steps",
    "path_length_m",
    "energy_j",
    "energy_rolling_j",
    "contacts",
    "pushes",
    "failed_pushes",
    "obstacles_broken",
    "sim_time_s",
)


class MissionRow(msgspec.Struct, frozen=True, kw_only=True):
    """One planner in one mission; columns as in `Row`, summed over the days.

    Attributes:
        days: How many days it has.
        success: Whether the goal was reached on every day.
        clean_success: The same, with nothing broken.
        days_solved: On how many days the goal was reached.
        filtered_peak_force_n: The largest of all days.
    """

    planner: str
    family: str
    mission: int
    perception: str
    seed: int
    days: int
    success: bool
    clean_success: bool
    days_solved: int
    steps: int
    path_length_m: float
    energy_j: float
    energy_rolling_j: float
    contacts: int
    pushes: int
    failed_pushes: int
    obstacles_broken: int
    filtered_peak_force_n: float
    sim_time_s: float

    @property
    def unit(self) -> str:
        """What is independent of others: the mission."""
        return f"{self.family} {self.seed} {self.perception} {self.mission}"


def whole_missions(rows: Sequence[Row]) -> list[list[Row]]:
    """Return the rows of each mission, day by day, by planner, family and number.

    Args:
        rows: Rows of a run, in any order. Those outside missions, and those of a
            mission that lacks a day, are left out.
    """
    found: dict[tuple[str, str], list[Row]] = {}
    for row in sorted(rows, key=lambda row: row.key):
        if row.mission is not None:
            found.setdefault((row.planner, row.unit), []).append(row)
    days: dict[str, int] = {}
    for own in found.values():
        last = max(row.day or 0 for row in own)
        days[own[0].family] = max(last + 1, days.get(own[0].family, 1))
    return [own for own in found.values() if len(own) == days[own[0].family]]


def mission_row(days: Sequence[Row]) -> MissionRow:
    """Return the row of a mission, from those of its days."""
    first = days[0]
    return MissionRow(
        planner=first.planner,
        family=first.family,
        mission=first.mission or 0,
        perception=first.perception,
        seed=first.seed,
        days=len(days),
        success=all(row.success for row in days),
        clean_success=all(row.clean_success for row in days),
        days_solved=sum(row.success for row in days),
        filtered_peak_force_n=max(row.filtered_peak_force_n for row in days),
        **{name: sum(getattr(row, name) for row in days) for name in SUMS},
    )


def mission_frame(rows: Sequence[Row]) -> "pl.DataFrame":
    """Return the missions as a polars frame, a line a planner and mission."""
    return typed_frame([mission_row(days) for days in whole_missions(rows)], MissionRow)
