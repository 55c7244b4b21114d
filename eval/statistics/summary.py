"""Every table of a run: per family and overall, as plain numbers.

Counts carry n and a Wilson interval, means n and a bootstrap interval; means over all
episodes and means over successes are separate entries. No episode is dropped: one that
crashed is a failure in the denominator.
"""

import math
from collections.abc import Sequence
from typing import Any, get_args

import numpy as np

from beacon_mj.episode.trace import Outcome
from beacon_mj.eval.metrics.row import Row, rows_sha256
from beacon_mj.eval.statistics.bootstrap import bca_intervals
from beacon_mj.eval.statistics.clusters import Clustered, clusters_of
from beacon_mj.eval.statistics.grouping import OVERALL as OVERALL
from beacon_mj.eval.statistics.grouping import groups
from beacon_mj.eval.statistics.intervals import rate_interval
from beacon_mj.eval.statistics.missions import SUMS, mission_row, whole_missions
from beacon_mj.eval.statistics.oracles import oracles

OUTCOMES: tuple[str, ...] = get_args(Outcome)
RATES = ("success", "clean_success")
#: Columns of which a table shows the mean over all, and the mean over successes.
MEANS = (
    "steps",
    "path_length_m",
    "contacts",
    "sensed_obstacles",
    "energy_j",
    "energy_rolling_j",
    "actuator_work_j",
    "obstacles_broken",
    "pushes",
    "failed_pushes",
    "obstacles_moved",
    "obstacles_moved_indirectly",
    "obstacles_toppled",
    "peak_force_n",
    "filtered_peak_force_n",
    "displaced_mass_distance_kgm",
    "spl",
    "ins",
    "bench_push_efficiency",
    "bench_push_effort",
    "excess_length_m",
    "brier_prior",
    "brier_posterior",
    "log_loss_prior",
    "log_loss_posterior",
    "brier_pushed_prior",
    "brier_pushed_posterior",
    "time_to_identify_s",
    "plan_ms_p50",
    "plan_ms_p99",
)

Summary = dict[str, Any]


def summarize(rows: Sequence[Row]) -> Summary:
    """Return all tables: `tables[planner][family or "overall"]` is one entry.

    Where more than one suite is present there is one of each, `suite NAME`, too.
    `oracles` names the planners that were told the truth.

    Args:
        rows: Rows of a run, in any order.
    """
    ordered = sorted(rows, key=lambda row: row.key)
    planners = dict.fromkeys(row.planner for row in ordered)
    missions = mission_tables(ordered)
    return {
        "episodes": len(ordered),
        "rows_sha256": rows_sha256(ordered),
        "oracles": oracles(ordered),
        "tables": {
            p: _planner([r for r in ordered if r.planner == p]) for p in planners
        },
    } | ({"missions": missions} if missions else {})


def mission_tables(rows: Sequence[Row]) -> dict[str, dict[str, Summary]]:
    """Return the numbers of whole missions, by planner and family; empty for none."""
    tables: dict[str, dict[str, Summary]] = {}
    found: dict[tuple[str, str], list[list[Row]]] = {}
    for days in whole_missions(rows):
        found.setdefault((days[0].planner, days[0].family), []).append(days)
    for (planner, family), missions in found.items():
        own = [mission_row(days) for days in missions]
        tables.setdefault(planner, {})[family] = {
            "n": len(own),
            "days": len(missions[0]),
            **rates(own),
            "mean": means(own, SUMS),
            "by_day": [cell(day) for day in zip(*missions, strict=True)],
        }
    return tables


def _planner(rows: Sequence[Row]) -> dict[str, Summary]:
    return {name: cell(own) for name, own in groups(rows, lambda row: row).items()}


def cell(rows: Sequence[Row]) -> Summary:
    """Return the numbers of one planner on one set of scenes."""
    return {
        "n": len(rows),
        **rates(rows),
        "outcomes": {o: sum(row.outcome == o for row in rows) for o in OUTCOMES},
        "mean": means(rows),
        "mean_over_successes": means([row for row in rows if row.success]),
    }


def rates(rows: Sequence[Clustered]) -> Summary:
    """Return the rate of every column of `RATES`."""
    clusters = clusters_of(rows)
    return {name: rate([getattr(r, name) for r in rows], clusters) for name in RATES}


def rate(flags: Sequence[bool], clusters: Sequence[str] | None = None) -> Summary:
    """Return count, n, share, and its Wilson 95 % interval; nulls for no episode."""
    count, n = sum(flags), len(flags)
    if n == 0:
        return {"count": 0, "n": 0, "rate": None, "low": None, "high": None}
    low, high = rate_interval(flags, clusters)
    return {"count": count, "n": n, "rate": count / n, "low": low, "high": high}


def means(
    rows: Sequence[Clustered], columns: Sequence[str] = MEANS
) -> dict[str, Summary]:
    """Return each column's mean where it is defined, its n and BCa 95 % interval.

    Scenes, and missions, are resampled, not episodes. Nulls where there is nothing to
    say.
    """
    units = {key: i for i, key in enumerate(dict.fromkeys(r.unit for r in rows))}
    sums, counts = np.zeros((2, len(units), len(columns)))
    for row in rows:
        for j, name in enumerate(columns):
            if (value := getattr(row, name)) is not None:
                sums[units[row.unit], j] += value
                counts[units[row.unit], j] += 1.0
    ends = bca_intervals(sums, counts) if rows else np.full((len(columns), 2), np.nan)
    return {
        name: _mean(float(sums[:, j].sum()), int(counts[:, j].sum()), *ends[j].tolist())
        for j, name in enumerate(columns)
    }


def _mean(total: float, n: int, low: float, high: float) -> Summary:
    return {
        "mean": total / n if n else None,
        "n": n,
        "low": None if math.isnan(low) else low,
        "high": None if math.isnan(high) else high,
    }
