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
from beacon_mj.eval.statistics.intervals import wilson_interval
from beacon_mj.eval.statistics.oracles import oracles

OVERALL = "overall"
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

    `oracles` names the planners that were told the truth.

    Args:
        rows: Rows of a run, in any order.
    """
    ordered = sorted(rows, key=lambda row: row.key)
    planners = dict.fromkeys(row.planner for row in ordered)
    return {
        "episodes": len(ordered),
        "rows_sha256": rows_sha256(ordered),
        "oracles": oracles(ordered),
        "tables": {
            p: _planner([r for r in ordered if r.planner == p]) for p in planners
        },
    }


def _planner(rows: Sequence[Row]) -> dict[str, Summary]:
    families = dict.fromkeys(row.family for row in rows)
    cells = {OVERALL: cell(rows)}
    return cells | {f: cell([r for r in rows if r.family == f]) for f in families}


def cell(rows: Sequence[Row]) -> Summary:
    """Return the numbers of one planner on one set of scenes."""
    return {
        "n": len(rows),
        **{name: rate([getattr(row, name) for row in rows]) for name in RATES},
        "outcomes": {o: sum(row.outcome == o for row in rows) for o in OUTCOMES},
        "mean": means(rows),
        "mean_over_successes": means([row for row in rows if row.success]),
    }


def rate(flags: Sequence[bool]) -> Summary:
    """Return count, n, share, and its Wilson 95 % interval; nulls for no episode."""
    count, n = sum(flags), len(flags)
    if n == 0:
        return {"count": 0, "n": 0, "rate": None, "low": None, "high": None}
    low, high = wilson_interval(count, n)
    return {"count": count, "n": n, "rate": count / n, "low": low, "high": high}


def means(rows: Sequence[Row]) -> dict[str, Summary]:
    """Return each column's mean where it is defined, its n and BCa 95 % interval.

    Scenes are resampled, not episodes. Nulls where there is nothing to say.
    """
    scenes = {
        key: i for i, key in enumerate(dict.fromkeys(r.scene_sha256 for r in rows))
    }
    sums, counts = np.zeros((2, len(scenes), len(MEANS)))
    for row in rows:
        for j, name in enumerate(MEANS):
            if (value := getattr(row, name)) is not None:
                sums[scenes[row.scene_sha256], j] += value
                counts[scenes[row.scene_sha256], j] += 1.0
    ends = bca_intervals(sums, counts) if rows else np.full((len(MEANS), 2), np.nan)
    return {
        name: _mean(float(sums[:, j].sum()), int(counts[:, j].sum()), *ends[j].tolist())
        for j, name in enumerate(MEANS)
    }


def _mean(total: float, n: int, low: float, high: float) -> Summary:
    return {
        "mean": total / n if n else None,
        "n": n,
        "low": None if math.isnan(low) else low,
        "high": None if math.isnan(high) else high,
    }
