"""What `beacon-mj eval` does with its options."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path

import msgspec

from beacon_mj.cli import options
from beacon_mj.cli.interrupts import status_of, terminable
from beacon_mj.cli.progress import progress
from beacon_mj.cli.tables import show
from beacon_mj.errors import BeaconError, RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs import config as cfg
from beacon_mj.eval.runs.config import RunConfig, SceneRef
from beacon_mj.eval.runs.jobs import Job
from beacon_mj.eval.runs.run_folder import RunFolder, free_name, load_config
from beacon_mj.eval.runs.runner import plan, run_jobs
from beacon_mj.eval.runs.shards import parse_shard, share
from beacon_mj.eval.runs.versions import versions
from beacon_mj.eval.statistics.summary import summarize

EPISODES = 100  #: Scenes per family unless the user says otherwise.


@dataclass(frozen=True, kw_only=True, slots=True)
class Request:
    """The options that decide a run's results, as the user gave them."""

    planner: tuple[str, ...] = ()
    settings: tuple[str, ...] = ()
    family: tuple[str, ...] = ()
    episodes: int | None = None
    seed: int = 0
    perception: options.Profile | None = None
    scenes: Path | None = None
    templates: Path | None = None
    log: options.Log = "all"
    shard: str | None = None
    isolate: bool | None = None


def run_evaluation(
    request: Request,
    out: Path | None,
    workers: int | str,
    *,
    resume: bool,
    json: bool,
) -> int:
    """Run, or go on with, an evaluation; return the exit status.

    Args:
        request: What to run.
        out: Run folder; None for a new one.
        workers: Number of processes, or address of a cluster.
        resume: Whether to go on with the run in `out`.
        json: Whether to print the summary as JSON.

    Raises:
        BeaconError: If an option is no good; nothing has been written then.
    """
    if resume and out is None:
        raise RunError("--resume: expected --out DIR with the run to go on with.")
    if resume and out is not None and not request.planner:
        _check_bare(request)
        config = load_config(out)
        hashes, refs = cfg.scene_refs(config)
        config = msgspec.structs.replace(config, families=hashes, versions=versions())
    else:
        config, refs = _configured(request)
    folder = RunFolder(out or free_name(_stem(config)))
    if request.planner and folder.is_unborn():
        resume = False  # So that a job that is started anew needs no other command.
    rows = folder.resume(config) if resume else []
    if not resume:
        folder.create(config)
    try:
        with terminable():
            _run(config, refs, folder, rows, workers)
    except KeyboardInterrupt as stop:
        _interrupted(folder, rows, len(config.planners) * len(refs))
        return status_of(stop)
    except BeaconError:
        if not rows:
            folder.discard()
        raise
    summary = summarize(rows)
    folder.finish(config, rows, summary)
    if json:
        print(msgspec.json.format(msgspec.json.encode(summary)).decode())
    else:
        show(summary)
    print(f"results: {folder.path}", file=sys.stderr)
    return 0


def _check_bare(request: Request) -> None:
    """Raise if a run that goes on with its own options was given others."""
    for field in fields(Request):
        if getattr(request, field.name) != field.default:
            name = "set" if field.name == "settings" else field.name
            raise RunError(
                f"--{name}: expected no other options with --resume unless --planner "
                "is given too; without it a run goes on with its own."
            )


def _configured(request: Request) -> tuple[RunConfig, list[SceneRef]]:
    """Return the checked configuration of a new run, and its scenes."""
    scenes, templates = request.scenes, request.templates
    if not request.planner:
        raise RunError("--planner: expected a planner's name, such as beacon, or all.")
    if scenes is not None and templates is not None:
        raise RunError("--templates: expected no templates with --scenes.")
    shard = None if request.shard is None else parse_shard(request.shard)
    entries, protocol = cfg.planner_entries(
        request.planner, request.settings, request.isolate
    )
    episodes = request.episodes
    if scenes is None:
        episodes = EPISODES if episodes is None else episodes
        hashes, refs = cfg.generated_scenes(request.family, episodes, templates)
    else:
        hashes, refs = cfg.stored_scenes(scenes, request.family, episodes)
    config = RunConfig(
        planners=entries,
        families=hashes,
        episodes=episodes,
        seed=request.seed,
        perception=request.perception or (None if scenes else "noisy"),
        scenes=None if scenes is None else str(scenes.resolve()),
        templates=None if templates is None else str(templates.resolve()),
        protocol=protocol,
        log=request.log,
        versions=versions(),
        shard=shard,
    )
    return config, share(refs, shard)


def _run(
    config: RunConfig,
    refs: list[SceneRef],
    folder: RunFolder,
    rows: list[Row],
    workers: int | str,
) -> None:
    """Run what is left; `rows` grows with every finished job."""
    jobs = plan(config, refs, rows)
    total = len(config.planners) * len(refs)
    with progress(total, rows) as update:
        for new in _stream(config, jobs, folder, workers):
            folder.append(new)
            rows += new
            update(new)


def _stream(
    config: RunConfig, jobs: list[Job], folder: RunFolder, workers: int | str
) -> Iterator[list[Row]]:
    """Return the rows as they come, from this machine or from a cluster."""
    if isinstance(workers, str):
        from beacon_mj.eval.runs.cluster import run_on_cluster

        return run_on_cluster(config, jobs, folder.path, workers)
    return run_jobs(config, jobs, folder.path, min(workers, len(jobs) or 1))


def _stem(config: RunConfig) -> str:
    """Return a name for the run that says what it is."""
    names = [entry.name for entry in config.planners]
    who = "-".join(names) if len(names) <= 2 else f"{len(names)}-planners"
    part = "" if config.shard is None else "-shard{}of{}".format(*config.shard)
    return f"{who}-seed{config.seed}{part}"


def _interrupted(folder: RunFolder, rows: list[Row], total: int) -> None:
    print(
        f"interrupted: {len(rows)} of {total} episodes are in {folder.path}; "
        f"go on with: beacon-mj eval --resume --out {folder.path}",
        file=sys.stderr,
    )
