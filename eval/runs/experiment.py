"""Runs on generated scenes that leave no logs: of sweeps, ablations and regrets."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import (
    PlannerEntry,
    RunConfig,
    SceneRef,
    family_scenes,
    generated_scenes,
)
from beacon_mj.eval.runs.jobs import Handovers, Job
from beacon_mj.eval.runs.lineup import Handed, PlannerChoice, line_up
from beacon_mj.eval.runs.progress import Update
from beacon_mj.eval.runs.run_folder import RunFolder
from beacon_mj.eval.runs.runner import NOBODY, plan, resumable, run_jobs
from beacon_mj.eval.runs.variants import Values
from beacon_mj.eval.runs.versions import versions
from beacon_mj.scene import Profile
from beacon_mj.scene_gen.learning.rounds import SCENES

CHUNK = 16  #: Configurations that cross a scene in one job.


class Single(NamedTuple):
    """One planner, and how its episodes are run; see `Lineup`."""

    entry: PlannerEntry
    protocol: Protocol
    handed: dict[str, Handed]


def single_planner(planner: PlannerChoice, settings: Values = ()) -> Single:
    """Return the one planner that is meant, and the protocol.

    Raises:
        BeaconError: If an option is no good, or several planners are named.
    """
    entries, protocol, handed = line_up([planner], settings)
    if len(entries) != 1:
        raise RunError(f"Expected one planner but it was {planner}.")
    return Single(entries[0], protocol, handed)


def experiment(
    entries: Sequence[PlannerEntry],
    protocol: Protocol,
    *,
    families: Sequence[str],
    scenes_per_family: int | None,
    seed: int,
    perception: Profile,
    templates: Path | None = None,
    suites: Sequence[str] = (),
    about: int = SCENES,
) -> tuple[RunConfig, list[SceneRef]]:
    """Return a run on generated scenes that leaves no logs, and its scenes.

    See `generated_scenes` for which scenes these are.

    Raises:
        TemplateError: If a family does not exist or its template is no good.
    """
    hashes, refs = generated_scenes(
        families, scenes_per_family, templates, suites, about
    )
    config = RunConfig(
        planners=tuple(entries),
        families=hashes,
        scenes=family_scenes(hashes, refs, templates),
        scenes_per_family=scenes_per_family,
        seed=seed,
        perception=perception,
        scene_dir=None,
        templates=None if templates is None else str(templates.resolve()),
        protocol=protocol,
        log="none",
        versions=versions(),
    )
    return config, refs


def run_stage(
    path: Path,
    config: RunConfig,
    refs: Sequence[SceneRef],
    workers: int,
    update: Update,
    summarize: Callable[[Sequence[Row]], Any],
    handed: Handovers = NOBODY,
) -> list[Row]:
    """Run, or go on with, one stage of an experiment in a run folder of its own.

    Args:
        path: The run folder.
        config: The stage.
        refs: Its scenes.
        workers: Processes.
        update: Told of rows as they come, and of those that were there.
        summarize: Makes the content of `summary.json`.
        handed: Planners that cannot be loaded by their spec, by name.
    """
    folder, rows = RunFolder(path), list[Row]()
    if folder.is_unborn():
        folder.create(config)
    else:
        rows = folder.resume(config)
    try:
        jobs = [*_chunks(plan(config, refs, rows))]
        rows = folder.keep(resumable(jobs, rows), rows)
        update(rows)
        count = min(workers, len(jobs) or 1)
        for new in run_jobs(config, jobs, None, count, handed):
            folder.append(new)
            rows += new
            update(new)
        folder.finish(config, rows, summarize(rows))
    finally:
        folder.close()
    return rows


def _chunks(jobs: Sequence[Job]) -> Iterator[Job]:
    """Cut jobs of many planners, so that a kill loses little and none waits long."""
    for refs, names in jobs:
        for i in range(0, len(names), CHUNK):
            yield Job(refs, names[i : i + CHUNK])
