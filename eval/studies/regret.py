"""Regret to the clairvoyant, and what it is paid for.

With c(x) a cost of an episode (steps, path, energy), o the clairvoyant, and a planner
that knows more or less, scene by scene:

    regret     = c(uncertain) - c(o)
               = [c(told) - c(o)]            price of its own way of planning
               + [c(near) - c(told)]         price of unknown geometry
               + [c(uncertain) - c(near)]    price of unknown class

* told: perceives true classes and materials, and senses everything from the start,
  exactly: `Protocol.certain`;
* near: true classes, but only what the protocol's sensor tells, with its range, its
  occlusion, its missed detections and its noise;
* uncertain: the same sensor, and the perception profile under test.

Only scenes that all four solved count; how many these are is part of the answer.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import (
    RunConfig,
    SceneRef,
)
from beacon_mj.eval.runs.experiment import experiment, single_planner
from beacon_mj.eval.runs.jobs import Handovers
from beacon_mj.eval.runs.lineup import PlannerChoice, planner_entries
from beacon_mj.eval.runs.runner import NOBODY, plan, run_jobs
from beacon_mj.eval.runs.variants import Values
from beacon_mj.eval.statistics.clusters import clusters_of
from beacon_mj.eval.statistics.grouping import groups
from beacon_mj.eval.statistics.intervals import Interval, mean_interval, paired_interval
from beacon_mj.eval.studies.certify import ORACLE
from beacon_mj.scene import Profile

LEVELS = ("told", "near", "uncertain")
#: The parts of the regret: which run less which other one.
PARTS = {
    "planning": ("told", ORACLE),
    "geometry": ("near", "told"),
    "class": ("uncertain", "near"),
    "regret": ("uncertain", ORACLE),
}
MEASURES = ("steps", "path_length_m", "energy_j")


class Price(NamedTuple):
    """One part of the regret in one family.

    Attributes:
        family: The family, or `overall`.
        part: A key of `PARTS`, or `clairvoyant` for the costs themselves.
        scenes: Scenes that count, of `of` that were run.
        of: See `scenes`.
        costs: Mean and interval of each measure.
        share: Mean of the same over the clairvoyant's cost, by measure.
    """

    family: str
    part: str
    scenes: int
    of: int
    costs: dict[str, Interval]
    share: dict[str, float]


def regret_runs(
    planner: PlannerChoice,
    settings: Values = (),
    families: Sequence[str] = (),
    scenes_per_family: int | None = None,
    seed: int = 0,
    perception: Profile = "noisy",
    templates: Path | None = None,
    suites: Sequence[str] = (),
) -> tuple[dict[str, RunConfig], list[SceneRef]]:
    """Return the runs that measure a planner's regret, by name, and their scenes.

    Raises:
        BeaconError: If an option is no good, or the planner is the clairvoyant.
    """
    entry, protocol, _ = single_planner(planner, settings)
    if entry.name == ORACLE:
        raise RunError(
            f"Expected a planner other than {ORACLE}: that is the comparison."
        )
    base, refs = experiment(
        [entry],
        protocol,
        families=families,
        scenes_per_family=scenes_per_family,
        seed=seed,
        perception="truth",
        templates=templates,
        suites=suites,
    )
    replace = msgspec.structs.replace
    oracle = replace(base, planners=planner_entries([ORACLE], ())[0])
    return {
        ORACLE: oracle,
        "told": replace(base, protocol=base.protocol.certain()),
        "near": base,
        "uncertain": replace(base, perception=perception),
    }, refs


def run_regret(
    runs: dict[str, RunConfig],
    refs: Sequence[SceneRef],
    workers: int = 1,
    handed: Handovers = NOBODY,
) -> Iterator[tuple[str, Row]]:
    """Run everything; yield each row with the name of its run.

    Args:
        runs: See `regret_runs`.
        refs: The scenes.
        workers: Processes.
        handed: The planner, if no worker can load it.
    """
    for name, config in runs.items():
        for rows in run_jobs(config, plan(config, refs), None, workers, handed):
            yield from ((name, row) for row in rows)


def decompose(rows: Sequence[tuple[str, Row]]) -> list[Price]:
    """Return the parts of the regret, per family and overall.

    Args:
        rows: Rows with the names of their runs, in any order; a scene for which a run
            is missing does not count.
    """
    scenes: dict[tuple[str, int], dict[str, Row]] = {}
    for name, row in rows:
        scenes.setdefault((row.family, row.scene_index), {})[name] = row
    ordered = [scenes[key] for key in sorted(scenes)]
    found = groups(ordered, lambda scene: next(iter(scene.values())))
    return [price for name, own in found.items() for price in _prices(name, own)]


def _prices(family: str, scenes: list[dict[str, Row]]) -> list[Price]:
    """Return all parts of one family."""
    names = (ORACLE, *LEVELS)
    solved = [s for s in scenes if all(n in s and s[n].success for n in names)]
    return [_price(family, part, solved, len(scenes)) for part in (ORACLE, *PARTS)]


def _price(family: str, part: str, solved: list[dict[str, Row]], of: int) -> Price:
    costs, share = {}, {}
    clusters = clusters_of(scene[ORACLE] for scene in solved)
    for measure in MEASURES:
        cost = {n: _column(solved, n, measure) for n in (ORACLE, *LEVELS)}
        oracle = cost[ORACLE]
        if part == ORACLE:
            costs[measure] = mean_interval(oracle, clusters)
            difference = oracle
        else:
            more, less = PARTS[part]
            costs[measure] = paired_interval(cost[more], cost[less], clusters)
            difference = [a - b for a, b in zip(cost[more], cost[less], strict=True)]
        share[measure] = _mean_ratio(difference, oracle)
    return Price(family, part, len(solved), of, costs, share)


def _column(solved: list[dict[str, Row]], name: str, measure: str) -> list[float]:
    return [float(getattr(scene[name], measure)) for scene in solved]


def _mean_ratio(values: list[float], by: list[float]) -> float:
    """Return the mean of values over `by`, scene by scene; NaN of none."""
    ratios = [a / b for a, b in zip(values, by, strict=True) if b > 0.0]
    return sum(ratios) / len(ratios) if ratios else float("nan")
