"""One stage of an experiment: a run folder of its own, which can be gone on with."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from beacon_mj.eval.config import RunConfig, SceneRef
from beacon_mj.eval.jobs import Job
from beacon_mj.eval.row import Row
from beacon_mj.eval.run_folder import RunFolder
from beacon_mj.eval.runner import plan, run_jobs

CHUNK = 16  #: Configurations that cross a scene in one job.

Update = Callable[[Sequence[Row]], None]
#: Opens a stage's progress, by its name and number of episodes.
Stage = Callable[[str, int], AbstractContextManager[Update]]


def run_stage(
    path: Path,
    config: RunConfig,
    refs: Sequence[SceneRef],
    workers: int,
    update: Update,
    summarize: Callable[[Sequence[Row]], Any],
) -> list[Row]:
    """Run, or go on with, one stage of an experiment in a run folder of its own.

    Args:
        path: The run folder.
        config: The stage.
        refs: Its scenes.
        workers: Processes.
        update: Told of rows as they come, and of those that were there.
        summarize: Makes the content of `summary.json`.
    """
    folder, rows = RunFolder(path), list[Row]()
    if folder.is_unborn():
        folder.create(config)
    else:
        rows = folder.resume(config)
        update(rows)
    jobs = [*_chunks(plan(config, refs, rows))]
    for new in run_jobs(config, jobs, None, min(workers, len(jobs) or 1)):
        folder.append(new)
        rows += new
        update(new)
    folder.finish(config, rows, summarize(rows))
    return rows


def _chunks(jobs: Sequence[Job]) -> Iterator[Job]:
    """Cut jobs of many planners, so that a kill loses little and none waits long."""
    for ref, names in jobs:
        for i in range(0, len(names), CHUNK):
            yield Job(ref, names[i : i + CHUNK])
