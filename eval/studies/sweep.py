"""The paper's hyperparameter sweep: select on one split, report on another.

    selected = argmax over configurations of (successes, -mean energy)

Table III's criterion: the highest success rate, with average energy over all episodes
as tie-breaker. Of two that tie in both, the one that was named first is selected: the
default, then fewer changes. Scenes of the selection split are drawn with a seed of 1000
or more, so that a benchmark's numbers are never those that the choice was made on.
"""

import math
from collections.abc import Sequence
from typing import Any

import msgspec
from msgspec import UNSET, UnsetType

from beacon_mj.episode.protocol import Protocol, WorldKind
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import (
    PlannerEntry,
    RunConfig,
    SceneRef,
)
from beacon_mj.eval.runs.experiment import Single, experiment, single_planner
from beacon_mj.eval.runs.lineup import planner_entries
from beacon_mj.eval.runs.variants import PROTOCOL, axes, variant, variant_name
from beacon_mj.eval.statistics.clusters import clusters_of
from beacon_mj.eval.statistics.intervals import (
    Interval,
    mean_interval,
    rank_correlation_interval,
)
from beacon_mj.eval.statistics.summary import rate
from beacon_mj.eval.studies.parameter_grid import (
    Changes,
    Grid,
    Swept,
    swept,
    varied_line,
)
from beacon_mj.scene import Profile

SCENES = 10  #: Scenes per family of each split, unless the user says otherwise.
FIRST_SEED = 1000  #: Seeds of selection splits begin here.
FINALISTS = 8  #: Configurations that are confirmed in MuJoCo.
AGAINST = ("bug1", "bug2", "dstar-lite")  #: Who else is in Table III.

Span = tuple[float, float | None, float | None]


class SweepRequest(msgspec.Struct, frozen=True, kw_only=True):
    """What is swept, and on which scenes.

    Attributes:
        planner: Name or `file.py:Class`.
        settings: Further values, `planner.field=value` or `protocol.field=value`.
        grid: See `settings_of`.
        families: Scene families; none for those of the suites.
        scenes_per_family: Scenes per family, of each split; None for `SCENES`, or the
            whole rounds nearest to it.
        suites: Suites, in place of families; none for `paper-v1`.
        select_seed: Seed of the scenes on which a configuration is selected.
        seed: Seed of the scenes on which it is reported.
        perception: Profile.
        vary: What is swept, `planner.field=a,b,c` or `protocol.field=a,b,c`; none for
            the lines of Table I that the planner has.
        against: Planners beside it in the report, at their defaults.
        trials: Configurations that optuna tries beyond the grid.
        world: World in which configurations are selected; of a `planar` one the best
            few are then confirmed in MuJoCo. The report is always MuJoCo's.
    """

    planner: str
    settings: tuple[str, ...] = ()
    grid: Grid = "one-at-a-time"
    families: tuple[str, ...] = ()
    scenes_per_family: int | None = None
    suites: tuple[str, ...] = ()
    select_seed: int = FIRST_SEED
    seed: int = 0
    perception: Profile = "noisy"
    vary: tuple[str, ...] = ()
    against: tuple[str, ...] = AGAINST
    trials: int = 0
    world: WorldKind | UnsetType = UNSET

    def __post_init__(self) -> None:
        """Keep the splits apart; raises RunError."""
        if self.select_seed < FIRST_SEED or self.select_seed == self.seed:
            raise RunError(
                f"--select-seed: expected {FIRST_SEED} or more, and another than "
                f"--seed {self.seed}, but it was {self.select_seed}."
            )


class Score(msgspec.Struct, frozen=True, kw_only=True):
    """How a configuration did on the selection split.

    Attributes:
        settings: What it changes.
        success: Count, n, rate, and its Wilson interval.
        energy_j: Mean over all episodes [J], and its bootstrap interval, null where
            a single scene allows none.
        steps: Mean over all episodes.
    """

    settings: dict[str, str]
    success: dict[str, Any]
    energy_j: Span
    steps: float

    @property
    def merit(self) -> tuple[int, float]:
        """Successes, then less energy: larger is better."""
        return self.success["count"], -self.energy_j[0]


def planner_in(request: SweepRequest, world: WorldKind | UnsetType = UNSET) -> Single:
    """Return the swept planner and the protocol, in a world."""
    own = () if isinstance(world, UnsetType) else (f"{PROTOCOL}.world={world}",)
    return single_planner(request.planner, (*request.settings, *own))


def base_entry(request: SweepRequest) -> PlannerEntry:
    """Return the swept planner. Raises BeaconError if an option is no good."""
    return planner_in(request).entry


def swept_lines(request: SweepRequest) -> tuple[Swept, ...]:
    """Return what is swept: the lines of Table I, or what the request varies.

    Raises:
        BeaconError: If nothing can be swept, or a field or value is no good.
    """
    if not request.vary:
        return swept(request.planner)
    base, protocol, _ = planner_in(request)
    return tuple(
        varied_line(base, protocol, target, field, values)
        for (target, field), values in axes(request.vary, [PROTOCOL, base.name]).items()
    )


def select_config(
    request: SweepRequest,
    settings: Sequence[Changes],
    world: WorldKind | UnsetType = UNSET,
) -> tuple[RunConfig, list[SceneRef]]:
    """Return the run of some configurations on the selection split, in a world."""
    base, protocol, _ = planner_in(request, world)
    entries = tuple(variant(base, values, protocol) for values in settings)
    return _config(request, entries, request.select_seed, protocol)


def report_config(
    request: SweepRequest, best: Changes
) -> tuple[RunConfig, list[SceneRef]]:
    """Return the run of default, best, and the others on the report split."""
    base, protocol, _ = planner_in(request)
    own = {e.name: e for s in ({}, best) for e in [variant(base, s, protocol)]}
    others = [e for e in planner_entries(request.against, ())[0] if e.name not in own]
    return _config(request, (*others, *own.values()), request.seed, protocol)


def _config(
    request: SweepRequest,
    entries: tuple[PlannerEntry, ...],
    seed: int,
    protocol: Protocol,
) -> tuple[RunConfig, list[SceneRef]]:
    return experiment(
        entries,
        protocol,
        families=request.families,
        scenes_per_family=request.scenes_per_family,
        seed=seed,
        perception=request.perception,
        suites=request.suites,
        about=SCENES,
    )


def score(rows: Sequence[Row], settings: Changes) -> Score:
    """Return how one configuration did.

    Args:
        rows: Its rows.
        settings: What it changes.
    """
    ordered = sorted(rows, key=lambda row: row.key)
    clusters = clusters_of(ordered)
    energies = [row.energy_j for row in ordered]
    return Score(
        settings=dict(settings),
        success=rate([row.success for row in ordered], clusters),
        energy_j=span(mean_interval(energies, clusters)),
        steps=sum(row.steps for row in ordered) / len(ordered),
    )


def span(interval: Interval) -> Span:
    """Return estimate and ends as JSON can hold them."""
    mean, low, high = interval
    return (mean, None, None) if math.isnan(low) else (mean, low, high)


def scores(
    rows: Sequence[Row], planner: str, settings: Sequence[Changes]
) -> list[Score]:
    """Return how each configuration did, in the order of `settings`."""
    of: dict[str, list[Row]] = {}
    for row in rows:
        of.setdefault(row.planner, []).append(row)
    return [score(of[variant_name(planner, values)], values) for values in settings]


def best(found: Sequence[Score]) -> Score:
    """Return the score that the criterion selects; of equal ones the first."""
    return max(found, key=lambda each: each.merit)


def finalists(found: Sequence[Score]) -> list[dict[str, str]]:
    """Return the best few configurations, and the default, which came first."""
    ranked = sorted(found, key=lambda each: each.merit, reverse=True)
    kept = ranked[:FINALISTS]
    return [s.settings for s in (kept if found[0] in kept else [found[0], *kept])]


def order_agreement(first: Sequence[Score], second: Sequence[Score]) -> Span:
    """Return the rank correlation of two worlds over the configurations of both.

    Spearman's, of the criterion; see `rank_correlation_interval`.
    """
    merits = {variant_name("", s.settings): s.merit for s in first}
    pairs = [
        (merits[name], s.merit)
        for s in second
        if (name := variant_name("", s.settings)) in merits
    ]
    ours, theirs = (places([pair[side] for pair in pairs]) for side in (0, 1))
    return span(rank_correlation_interval(ours, theirs))


def places(merits: Sequence[tuple[int, float]]) -> list[float]:
    """Return the place of each merit in ascending order; equal ones share one."""
    order = sorted(set(merits))
    return [float(order.index(merit)) for merit in merits]


def best_alone(found: Sequence[Score], line: Swept) -> str:
    """Return the best value of one parameter while all others are at their default."""
    own = [s for s in found if set(s.settings) <= {line.field}]
    return best(own).settings.get(line.field, line.default)


def combination(found: Sequence[Score], lines: Sequence[Swept]) -> dict[str, str]:
    """Return the best value of every parameter, put together."""
    alone = {line.field: best_alone(found, line) for line in lines}
    return {k.field: alone[k.field] for k in lines if alone[k.field] != k.default}
