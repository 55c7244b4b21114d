"""The ladder of memory: what a robot keeps of a push, rung by rung.

    none <= failures <= belief <= belief shared (by kind, by scale, by both)

The order is that of what is kept: each rung knows what the one below it knows, and
something more. It stands here, before any number was measured with it. All rungs are
configurations of one planner (`belief.memory`, `belief.sharing`); a rung's *gain* is

    c(rung) - c(rung below)

paired by scene, failures included; a negative cost means that the memory pays.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import msgspec

from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import PlannerEntry
from beacon_mj.eval.statistics.clusters import clusters_of
from beacon_mj.eval.statistics.grouping import groups
from beacon_mj.eval.statistics.intervals import (
    Interval,
    mean_interval,
    paired_interval,
    paired_rate_interval,
)

COSTS = ("steps", "path_length_m", "energy_j", "obstacles_broken")
MEMORY, SHARING = "belief.memory", "belief.sharing"


class Rung(NamedTuple):
    """One rung: what is remembered, what is shared, and the rung that it adds to."""

    name: str
    memory: str
    sharing: frozenset[str]
    below: str | None


_NOTHING = frozenset[str]()
#: From the lowest to the highest; all that share stand on `belief`.
RUNGS = (
    Rung("none", "none", _NOTHING, None),
    Rung("failures", "failures", _NOTHING, "none"),
    Rung("belief", "belief", _NOTHING, "failures"),
    Rung("shared by kind", "belief", frozenset({"kind"}), "belief"),
    Rung("shared by scale", "belief", frozenset({"scale"}), "belief"),
    Rung("shared by both", "belief", frozenset({"kind", "scale"}), "belief"),
)


class Step(msgspec.Struct, frozen=True, kw_only=True):
    """One rung in one situation and family.

    Attributes:
        family: The family, a suite, or `overall`.
        situation: A key of `SITUATIONS`.
        rung: Its name in `RUNGS`.
        below: The rung that it is compared with; None for the lowest.
        scenes: Scenes crossed.
        success: Episodes that reached the goal.
        clean: Those of them in which nothing broke.
        costs: Means of `COSTS` with intervals.
        clean_gain: Paired difference of clean success to the rung below.
        gains: Paired differences of `COSTS` to the rung below.
    """

    family: str
    situation: str
    rung: str
    below: str | None
    scenes: int
    success: int
    clean: int
    costs: dict[str, Interval]
    clean_gain: Interval | None
    gains: dict[str, Interval] | None


def own_rung(values: Mapping[str, object]) -> Rung | None:
    """Return the rung on which a planner stands; None if it has no such memory.

    Args:
        values: The planner's configuration by dotted field.
    """
    memory, shared = values.get(MEMORY), values.get(SHARING, ())
    sharing = frozenset(map(str, shared)) if isinstance(shared, list | tuple) else None
    if memory != "belief":
        sharing = _NOTHING  # Nothing is believed that could be shared.
    return next((r for r in RUNGS if (r.memory, r.sharing) == (memory, sharing)), None)


def rungs_below(own: Rung) -> list[Rung]:
    """Return all rungs that know less than one does, from the highest down."""
    rank = {name: k for k, name in enumerate(("none", "failures", "belief"))}
    return [
        rung
        for rung in reversed(RUNGS)
        if rung != own
        and rank[rung.memory] <= rank[own.memory]
        and rung.sharing <= own.sharing
    ]


def change_to(own: Rung, rung: Rung) -> dict[str, str]:
    """Return the one setting that takes a planner down to a rung."""
    if rung.memory != own.memory:
        return {MEMORY: rung.memory}
    return {SHARING: f"[{','.join(sorted(rung.sharing))}]"}


def ladder_of(
    situation: str, rungs: Mapping[str, PlannerEntry], rows: Sequence[Row]
) -> list[Step]:
    """Return the rungs of one situation from the lowest up, overall and per family.

    Args:
        situation: Its name.
        rungs: Who stands on each rung, by the rung's name; none for no ladder.
        rows: All rows, every planner on the same scenes.
    """
    ordered = sorted(rows, key=lambda row: row.key)
    steps = []
    for family, own in groups(ordered, lambda row: row).items():
        of = {n: [r for r in own if r.planner == e.name] for n, e in rungs.items()}
        known = [rung for rung in RUNGS if rung.name in of]
        steps += [_step(family, situation, rung, of) for rung in known]
    return steps


def _step(
    family: str, situation: str, rung: Rung, of: Mapping[str, Sequence[Row]]
) -> Step:
    rows = of[rung.name]
    below = None if rung.below is None else of[rung.below]
    clean = [row.clean_success for row in rows]
    clusters = clusters_of(rows)
    return Step(
        family=family,
        situation=situation,
        rung=rung.name,
        below=rung.below,
        scenes=len(rows),
        success=sum(row.success for row in rows),
        clean=sum(clean),
        costs={cost: mean_interval(column(rows, cost), clusters) for cost in COSTS},
        clean_gain=None
        if below is None
        else paired_rate_interval(
            clean, [row.clean_success for row in below], clusters=clusters
        ),
        gains=None if below is None else paired_costs(rows, below),
    )


def paired_costs(rows: Sequence[Row], others: Sequence[Row]) -> dict[str, Interval]:
    """Return the paired differences of `COSTS`, rows less others, scene by scene."""
    clusters = clusters_of(rows)
    return {
        cost: paired_interval(column(rows, cost), column(others, cost), clusters)
        for cost in COSTS
    }


def column(rows: Sequence[Row], cost: str) -> list[float]:
    """Return one column of costs."""
    return [float(getattr(row, cost)) for row in rows]
