"""Say how far both worlds agree about random points of Table I's full grid.

    python .ci/rank_parameters.py --out runs/points

Runs the points in the planar world and in MuJoCo, on the same scenes, and prints
Spearman's rank correlations with Fisher's interval.
"""

import argparse
from pathlib import Path

import numpy as np
from msgspec import UNSET

import beacon_mj
from beacon_mj.eval.statistics.intervals import rank_correlation_interval
from beacon_mj.eval.studies.parameter_grid import settings_of
from beacon_mj.eval.studies.sweep import (
    Score,
    SweepRequest,
    order_agreement,
    swept_lines,
)
from beacon_mj.eval.studies.sweep_run import run_settings

SMALL_M = "0.12"  #: The robot's own radius; with the other one it hardly gets through.


def main() -> None:
    """Draw the points, run them, and print the correlations."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--points", type=int, default=24)
    parser.add_argument("--seed", type=int, default=16)
    parser.add_argument("--scenes", type=int, default=1, help="of each family")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    request = SweepRequest(
        planner="beacon", grid="full", scenes_per_family=given.scenes, world="planar"
    )
    grid = settings_of(swept_lines(request), "full")
    rng = np.random.default_rng(given.seed)
    drawn = rng.choice(len(grid), given.points, replace=False)
    points = [grid[i] for i in sorted(drawn.tolist())]
    found = [
        run_settings(
            request, given.out / name, points, given.workers, beacon_mj.show_progress,
            world,
        )
        for name, world in (("planar", None), ("mujoco", UNSET))
    ]  # fmt: skip
    small = [
        i
        for i, point in enumerate(points)
        if point.get("robot_radius_m", SMALL_M) == SMALL_M
    ]
    for name, kept in (("all", [*range(len(points))]), (f"radius {SMALL_M}", small)):
        _tell(name, *([scores[i] for i in kept] for scores in found))


def _tell(name: str, planar: list[Score], physical: list[Score]) -> None:
    """Print rank correlations by the criterion, by energy and by steps."""
    criterion = order_agreement(planar, physical)
    print(f"{name}, {len(planar)} points: criterion {_span(*criterion)}", end="")
    for label, value in (("energy", _energy), ("steps", _steps)):
        pairs = [[value(score) for score in each] for each in (planar, physical)]
        r = rank_correlation_interval(*pairs)
        print(f", {label} {_span(r.estimate, r.low, r.high)}", end="")
    print()


def _energy(score: Score) -> float:
    return score.energy_j[0]


def _steps(score: Score) -> float:
    return score.steps


def _span(mean: float, low: float | None, high: float | None) -> str:
    if low is None or high is None or low != low:
        return f"{mean:.2f}"
    return f"{mean:.2f} [{low:.2f}, {high:.2f}]"


if __name__ == "__main__":
    main()
