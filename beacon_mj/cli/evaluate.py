"""The options of `beacon-mj eval`."""

import os
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import options


def evaluate(
    *,
    planner: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            show_default=False,
            help="A name (see `beacon-mj planners`), `all` for the five of the "
            "paper, or path/to/file.py:Class; repeatable.",
        ),
    ] = (),
    settings: options.Settings = (),
    family: options.Family = (),
    episodes: Annotated[
        options.Count | None,
        Parameter(help="Scenes per family; 100 by default, or all that are stored."),
    ] = None,
    seed: options.Seed = 0,
    perception: options.Perception = None,
    scenes: Annotated[
        Path | None, Parameter(help="Folder of stored scenes to use.")
    ] = None,
    templates: options.Templates = None,
    workers: options.Workers = None,
    cluster: Annotated[
        str | None,
        Parameter(
            help="Address of a dask scheduler, such as tcp://node1:8786, whose workers "
            "run the episodes.",
        ),
    ] = None,
    shard: Annotated[
        str | None,
        Parameter(help="I/N: only part I of N of the scenes; see `beacon-mj merge`."),
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(help="Run folder; by default a new one under runs/."),
    ] = None,
    log: Annotated[
        options.Log,
        Parameter(
            help="Which episodes leave an MCAP log: all, those that were no clean "
            "success, or none."
        ),
    ] = "all",
    resume: Annotated[
        options.Flag,
        Parameter(
            help="Go on with the run in --out; without --planner, with its options."
        ),
    ] = False,
    isolate: Annotated[
        bool | None,
        Parameter(
            negative="--no-isolate",
            show_default=False,
            help="Run every planner in a process of its own, or none; by default those "
            "from files do.",
        ),
    ] = None,
    json: options.Json = False,
) -> int:
    """Run planners through scenes: every planner crosses every scene.

    The run folder holds config.json, episodes.jsonl (a line for every finished
    episode), and at the end episodes.parquet and summary.json.
    """
    # Only now: help must not wait for MuJoCo and numba.
    from beacon_mj.cli.evaluation import Request, run_evaluation
    from beacon_mj.errors import RunError

    if cluster is not None and workers is not None:
        raise RunError("--workers: expected none with --cluster, which has its own.")
    request = Request(
        planner=planner,
        settings=settings,
        family=family,
        episodes=episodes,
        seed=seed,
        perception=perception,
        scenes=scenes,
        templates=templates,
        log=log,
        shard=shard,
        isolate=isolate,
    )
    where = cluster or workers or os.cpu_count() or 1
    return run_evaluation(request, out, where, resume=resume, json=json)
