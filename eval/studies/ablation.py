"""What the parts of a planner are worth: switched off one at a time, scene by scene.

A *switch* is a field of the planner's configuration, or of one that it holds, that is
true by default; of the ladder of memory (`ladder.py`) all rungs below the planner's own
are tried. In every *situation* (what is perceived, and how far) that fits a family the
whole planner crosses its scenes, and each variant with one thing less. Costs are paired
by scene within the situation:

    effect = c(variant) - c(whole planner)

over all scenes, failures included; a positive cost means that the part pays.
"""

from collections.abc import Callable, Mapping, Sequence, Set
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
from beacon_mj.eval.statistics.grouping import groups
from beacon_mj.eval.statistics.intervals import (
    Interval,
    mean_interval,
    paired_rate_interval,
    rate_interval,
)
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.eval.studies.ladder import (
    COSTS,
    MEMORY,
    SHARING,
    Step,
    change_to,
    column,
    ladder_of,
    own_rung,
    paired_costs,
    rungs_below,
)
from beacon_mj.planners.base import Planner
from beacon_mj.scene import Profile
from beacon_mj.scene_gen.family import Family, load_family
from beacon_mj.scene_gen.learning.layouts import LEARNING_LAYOUTS


class Situation(msgspec.Struct, frozen=True):
    """What planners perceive.

    Attributes:
        perception: The profile.
        sensing_radius_m: The sensor's range, if not the family's or the protocol's [m].
        fits: Whether a family can be, and is to be, perceived so.
    """

    perception: Profile
    sensing_radius_m: float | None = None
    fits: Callable[[Family], bool] = lambda family: True


def has_own_radius(family: Family) -> bool:
    """Whether a family says how far obstacles are sensed."""
    return "sensing_radius" in family.numerics


def has_drawn_scores(family: Family) -> bool:
    """Whether what is perceived is drawn, and not designed with the layout."""
    return family.layout not in LEARNING_LAYOUTS


#: The default comes first. Misleading scores do not exist where a layout designs them;
#: a family with a sensing radius of its own stands beside the protocol's 1 m.
SITUATIONS = {
    "noisy": Situation("noisy"),
    "truth": Situation("truth"),
    "misleading": Situation("misleading", None, has_drawn_scores),
    "noisy, 0.5 m": Situation("noisy", 0.5, lambda f: not has_own_radius(f)),
    "noisy, 1 m": Situation("noisy", 1.0, has_own_radius),
    "noisy, 2 m": Situation("noisy", 2.0, lambda f: not has_own_radius(f)),
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


def ablation_runs(
    planner: PlannerChoice,
    settings: Values = (),
    families: Sequence[str] = (),
    scenes_per_family: int | None = None,
    seed: int = 0,
    templates: Path | None = None,
    suites: Sequence[str] = (),
) -> tuple[dict[str, RunConfig], list[SceneRef]]:
    """Return one run for each situation that a family fits, and all their scenes.

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
        suites=suites,
    )
    known = {name: load_family(name, templates) for name in base.families}
    runs = {}
    for name, situation in SITUATIONS.items():
        fitting = {n for n, family in known.items() if situation.fits(family)}
        if fitting:
            runs[name] = _in(base, situation, fitting)
    return runs, refs


def _variants(
    whole: PlannerEntry, protocol: Protocol, handed: Handovers
) -> tuple[PlannerEntry, ...]:
    cls = handed[whole.name].cls if whole.name in handed else None
    values = dotted(whole.config)
    own = own_rung(values)
    lower = [] if own is None else [change_to(own, r) for r in rungs_below(own)]
    off = [{s: "false"} for s in switches(cls or whole.spec) if values[s]]
    changes = [*lower, *off]
    return (whole, *(variant(whole, change, protocol, cls) for change in changes))


def _in(base: RunConfig, situation: Situation, families: Set[str]) -> RunConfig:
    """Return the run of one situation, with the families that fit it."""
    radius = situation.sensing_radius_m
    protocol = base.protocol
    if radius is not None:
        protocol = msgspec.structs.replace(protocol, sensing_radius_m=radius)
    return msgspec.structs.replace(
        base,
        perception=situation.perception,
        protocol=protocol,
        families={n: found for n, found in base.families.items() if n in families},
        scenes={n: found for n, found in base.scenes.items() if n in families},
    )


def run_ablation(
    runs: Mapping[str, RunConfig],
    refs: Sequence[SceneRef],
    out: Path,
    workers: int,
    stage: Progress,
    handed: Handovers = NOBODY,
) -> tuple[list[Effect], list[Step]]:
    """Run, or go on with, all situations, a run folder each, below `out`.

    Args:
        runs: See `ablation_runs`.
        refs: The scenes.
        out: Folder of the ablation.
        workers: Processes.
        stage: Opens the progress of each situation.
        handed: The planner and its variants, if no worker can load them.

    Returns:
        What each part is worth, and the ladder of memory.
    """
    effects, ladder = list[Effect](), list[Step]()
    for name, config in runs.items():
        own = [ref for ref in refs if ref.family in config.families]
        path = out / name.replace(", ", "-").replace(" ", "")
        with stage(name, len(config.planners) * len(own)) as update:
            rows = run_stage(path, config, own, workers, update, summarize, handed)
        effects += effects_of(name, config.planners, rows)
        ladder += ladder_of(name, rungs_of(config.planners), rows)
    return effects, ladder


def rungs_of(entries: Sequence[PlannerEntry]) -> dict[str, PlannerEntry]:
    """Return who stands on each rung of the ladder of memory, by the rung's name.

    Args:
        entries: The whole planner, then its variants; those without another part stand
            on no rung.
    """
    whole, *variants = entries
    own = own_rung(dotted(whole.config))
    if own is None:
        return {}
    fields = {f"{whole.base}.{field}" for field in (MEMORY, SHARING)}
    lower = [e for e in variants if e.varied.keys() <= fields]
    found = {rung.name: e for e in lower if (rung := own_rung(dotted(e.config)))}
    return {**found, own.name: whole}


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
    for family, own in groups(ordered, lambda row: row).items():
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
        costs={cost: mean_interval(column(rows, cost), clusters) for cost in COSTS},
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
        costs=paired_costs(rows, whole),
    )
