"""What the parts of a planner are worth: switched off one at a time, scene by scene.

A *switch* is a field of the planner's configuration, or of one that it holds, that is
true by default; a *ladder* is a field whose values hold less and less, and all rungs
below the planner's own are tried. In every *situation* (what is perceived, and how
far) the whole planner crosses the scenes, and each variant with one thing less. Costs
are paired by scene within the situation:

    effect = c(variant) - c(whole planner)

over all scenes, failures included; a positive cost means that the part pays.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from beacon_mj.episode.protocol import Protocol
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import (
    PlannerEntry,
    RunConfig,
    SceneRef,
)
from beacon_mj.eval.runs.experiment import (
    experiment,
    run_stage,
    single_planner,
)
from beacon_mj.eval.runs.jobs import Handovers
from beacon_mj.eval.runs.lineup import PlannerChoice
from beacon_mj.eval.runs.overrides import dotted
from beacon_mj.eval.runs.progress import Progress
from beacon_mj.eval.runs.runner import NOBODY
from beacon_mj.eval.runs.variants import Values, variant
from beacon_mj.eval.statistics.clusters import clusters_of
from beacon_mj.eval.statistics.intervals import (
    Interval,
    mean_interval,
    paired_interval,
    paired_rate_interval,
    rate_interval,
)
from beacon_mj.eval.statistics.summary import OVERALL, summarize
from beacon_mj.planners.base import Planner
from beacon_mj.scene import Profile

COSTS = ("steps", "path_length_m", "energy_j", "obstacles_broken")


class Situation(msgspec.Struct, frozen=True):
    """What planners perceive: the profile, and the radius if not the protocol's [m]."""

    perception: Profile
    sensing_radius_m: float | None = None


#: Values of a field, each with less than the one before.
LADDERS = {"belief.memory": ("belief", "failures", "none")}
#: The default comes first.
SITUATIONS = {
    "noisy": Situation("noisy"),
    "truth": Situation("truth"),
    "misleading": Situation("misleading"),
    "noisy, 0.5 m": Situation("noisy", 0.5),
    "noisy, 2 m": Situation("noisy", 2.0),
}


class Effect(msgspec.Struct, frozen=True, kw_only=True):
    """One variant in one situation and family.

    Attributes:
        family: The family, or `overall`.
        situation: A key of `SITUATIONS`.
        variant: What is switched off, such as `predict_cascades`, or a rung such as
            `belief.memory=none`; empty for nothing.
        scenes: Scenes crossed.
        success: Episodes that reached the goal.
        clean: Those of them in which nothing broke.
        clean_rate: Clean success with its interval; of a variant the paired
            difference.
        costs: Means of `COSTS` with intervals; of a variant the paired differences.
    """

    family: str
    situation: str
    variant: str
    scenes: int
    success: int
    clean: int
    clean_rate: Interval
    costs: dict[str, Interval]


def switches(planner: str | type[Planner]) -> tuple[str, ...]:
    """Return the dotted fields of a planner's configuration that are true by default.

    Raises:
        PlannerError: If there is no such planner.
    """
    values = dotted(single_planner(planner).entry.config)
    return tuple(name for name, value in values.items() if value is True)


def rungs(values: Mapping[str, object]) -> list[dict[str, str]]:
    """Return the change to each rung below the planner's own, ladder by ladder.

    Args:
        values: The planner's configuration by dotted field.
    """
    below = {
        field: ladder[ladder.index(str(values[field])) + 1 :]
        for field, ladder in LADDERS.items()
        if values.get(field) in ladder
    }
    return [{field: rung} for field, rungs in below.items() for rung in rungs]


def ablation_runs(
    planner: PlannerChoice,
    settings: Values = (),
    families: Sequence[str] = (),
    scenes_per_family: int = 100,
    seed: int = 0,
    templates: Path | None = None,
) -> tuple[dict[str, RunConfig], list[SceneRef]]:
    """Return one run for each situation, and the scenes of all of them.

    Raises:
        BeaconError: If an option is no good, or several planners are named.
    """
    whole, protocol, handed = single_planner(planner, settings)
    base, refs = experiment(
        _variants(whole, protocol, handed),
        protocol,
        families=families,
        scenes_per_family=scenes_per_family,
        seed=seed,
        perception="noisy",
        templates=templates,
    )
    return {name: _in(base, each) for name, each in SITUATIONS.items()}, refs


def _variants(
    whole: PlannerEntry, protocol: Protocol, handed: Handovers
) -> tuple[PlannerEntry, ...]:
    cls = handed[whole.name].cls if whole.name in handed else None
    values = dotted(whole.config)
    off = [{s: "false"} for s in switches(cls or whole.spec) if values[s]]
    changes = [*rungs(values), *off]
    return (whole, *(variant(whole, change, protocol, cls) for change in changes))


def _in(base: RunConfig, situation: Situation) -> RunConfig:
    radius = situation.sensing_radius_m
    protocol = base.protocol
    if radius is not None:
        protocol = msgspec.structs.replace(protocol, sensing_radius_m=radius)
    return msgspec.structs.replace(
        base, perception=situation.perception, protocol=protocol
    )


def run_ablation(
    runs: Mapping[str, RunConfig],
    refs: Sequence[SceneRef],
    out: Path,
    workers: int,
    stage: Progress,
    handed: Handovers = NOBODY,
) -> list[Effect]:
    """Run, or go on with, all situations, a run folder each, below `out`.

    Args:
        runs: See `ablation_runs`.
        refs: The scenes.
        out: Folder of the ablation.
        workers: Processes.
        stage: Opens the progress of each situation.
        handed: The planner and its variants, if no worker can load them.
    """
    effects = []
    for name, config in runs.items():
        path = out / name.replace(", ", "-").replace(" ", "")
        with stage(name, len(config.planners) * len(refs)) as update:
            rows = run_stage(path, config, refs, workers, update, summarize, handed)
        effects += effects_of(name, config.planners, rows)
    return effects


def effects_of(
    situation: str, entries: Sequence[PlannerEntry], rows: Sequence[Row]
) -> list[Effect]:
    """Return all variants of one situation, overall and per family.

    Args:
        situation: Its name.
        entries: The whole planner, then its variants.
        rows: All rows, each variant on the same scenes.
    """
    ordered = sorted(rows, key=lambda row: row.key)
    effects = []
    for family in (OVERALL, *dict.fromkeys(row.family for row in ordered)):
        own = [row for row in ordered if family in (OVERALL, row.family)]
        whole, *others = ([r for r in own if r.planner == e.name] for e in entries)
        effects.append(_whole(family, situation, whole))
        for entry, rest in zip(entries[1:], others, strict=True):
            effects.append(_variant(family, situation, _less(entry), rest, whole))
    return effects


def _less(entry: PlannerEntry) -> str:
    """Return what a variant has less: a switch, or a rung."""
    [(field, text)] = entry.varied.items()
    field = field.removeprefix(f"{entry.base}.")
    return field if text == "false" else f"{field}={text}"


def _whole(family: str, situation: str, rows: Sequence[Row]) -> Effect:
    count = sum(row.clean_success for row in rows)
    clusters = clusters_of(rows)
    return Effect(
        family=family,
        situation=situation,
        variant="",
        scenes=len(rows),
        success=sum(row.success for row in rows),
        clean=count,
        clean_rate=Interval(
            count / len(rows),
            *rate_interval([row.clean_success for row in rows], clusters),
        ),
        costs={cost: mean_interval(_column(rows, cost), clusters) for cost in COSTS},
    )


def _variant(
    family: str,
    situation: str,
    switch: str,
    rows: Sequence[Row],
    whole: Sequence[Row],
) -> Effect:
    clean = [row.clean_success for row in rows]
    clusters = clusters_of(rows)
    return Effect(
        family=family,
        situation=situation,
        variant=switch,
        scenes=len(rows),
        success=sum(row.success for row in rows),
        clean=sum(clean),
        clean_rate=paired_rate_interval(
            clean, [row.clean_success for row in whole], clusters=clusters
        ),
        costs={
            cost: paired_interval(_column(rows, cost), _column(whole, cost), clusters)
            for cost in COSTS
        },
    )


def _column(rows: Sequence[Row], cost: str) -> list[float]:
    return [float(getattr(row, cost)) for row in rows]
