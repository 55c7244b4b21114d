"""One job of an evaluation: one scene or mission, every planner.

Runs in a worker process.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from beacon_mj.episode.episode import Listener
from beacon_mj.episode.mission import Mission
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.trace import Outcome, Trace
from beacon_mj.episode.worlds import world_of
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.code_record import check_code
from beacon_mj.eval.runs.config import (
    PlannerEntry,
    RunConfig,
    SceneRef,
    load_ref,
    suite_of_ref,
)
from beacon_mj.eval.runs.isolation.host import Who, here, isolated
from beacon_mj.eval.runs.isolation.process import Elsewhere
from beacon_mj.eval.runs.lineup import Handed
from beacon_mj.eval.runs.log_files import log_file
from beacon_mj.eval.runs.overrides import configure
from beacon_mj.eval.runs.sandbox import Guarded, planner_class
from beacon_mj.planners.base import Planner
from beacon_mj.planners.registry import whole_spec
from beacon_mj.scene import Scene
from beacon_mj.streams import stream
from beacon_mj.world import BaseWorld, SimulationError

Key = tuple[str, str, int]  #: Planner, family and scene index.


class Job(NamedTuple):
    """A scene, or the days of a mission, and who still has to cross it.

    Attributes:
        refs: The scene; of a mission, its days in order.
        planners: Names of the planners.
    """

    refs: tuple[SceneRef, ...]
    planners: tuple[str, ...]

    @property
    def keys(self) -> list[Key]:
        """Planner, family and scene index of its episodes."""
        return [(n, r.family, r.index) for n in self.planners for r in self.refs]

    def split(self) -> list["Job"]:
        """Return one job an episode or mission."""
        return [Job(self.refs, (name,)) for name in self.planners]


class Fault(NamedTuple):
    """Why an episode ended in `planner_error`.

    Attributes:
        key: Planner, family and scene index.
        detail: The row's: what was raised, or what was expected.
        where: `file:line` of the planner's code; empty if it is not known.
    """

    key: Key
    detail: str
    where: str


class Attempt(NamedTuple):
    """What came of a job: a row an episode, and why planners failed."""

    rows: list[Row]
    faults: list[Fault]


Handovers = Mapping[str, Handed]


def run_job(
    config: RunConfig, folder: Path | None, handed: Handovers, job: Job
) -> Attempt:
    """Run the episodes of a job.

    Args:
        config: The evaluation.
        folder: Run folder for logs; None for no logs.
        handed: Planners that cannot be loaded by their spec, by name.
        job: What to run.

    Returns:
        One row an episode. Scenes and their worlds are built once.

    Raises:
        RunError: If a planner's file was edited since the run began.
    """
    entries = [e for e in config.planners if e.name in job.planners]
    check_code(entries)
    scenes = [load_ref(config, ref) for ref in job.refs]
    suites = [
        suite_of_ref(config, *each) for each in zip(job.refs, scenes, strict=True)
    ]
    out = Attempt([], [])
    worlds: dict[object, list[BaseWorld]] = {}
    for entry in entries:
        protocol = config.protocol_of(entry.name)
        kind = (
            protocol.timestep_s,
            protocol.robot,
            protocol.is_planar,
            protocol.push_model,
        )
        try:
            if kind not in worlds:
                worlds[kind] = [world_of(scene, protocol) for scene in scenes]
        except SimulationError as error:
            out.rows.extend(
                lost_row(config, scene, entry.name, "simulation_error", str(error), own)
                for scene, own in zip(scenes, suites, strict=True)
            )
            continue
        days = _days(config, folder, worlds[kind], suites, entry, handed)
        for row, where in days:
            out.rows.append(row)
            if row.outcome == "planner_error":
                out.faults.append(Fault(row.key, row.detail, where))
    return out


def lost_attempt(config: RunConfig, job: Job, detail: str) -> Attempt:
    """Return what comes of a job of one episode whose process died."""
    [ref], [name] = job.refs, job.planners
    scene = load_ref(config, ref)
    suite = suite_of_ref(config, ref, scene)
    row = lost_row(config, scene, name, "planner_error", detail, suite)
    return Attempt([row], [Fault(row.key, detail, "")])


def lost_row(
    config: RunConfig,
    scene: Scene,
    planner: str,
    outcome: Outcome,
    detail: str,
    suite: str | None,
) -> Row:
    """Return the row of an episode that could not be run."""
    return measure(
        Trace(
            planner=planner,
            scene=scene,
            protocol=config.protocol_of(planner),
            oracle=any(e.oracle for e in config.planners if e.name == planner),
            start_m=np.array(scene.start_m),
            outcome=outcome,
            detail=detail,
            suite=suite,
        )
    )


def planner_seed(seed: int, family: str, index: int) -> int:
    """Return the planner's seed in one scene; the same for every planner."""
    return int(stream("planner", seed, family, index).integers(2**53))


def _days(
    config: RunConfig,
    folder: Path | None,
    worlds: Sequence[BaseWorld],
    suites: Sequence[str | None],
    e: PlannerEntry,
    handed: Handovers,
) -> Iterator[tuple[Row, str]]:
    """Yield a row a day, and where the planner failed if it did."""
    protocol = config.protocol_of(e.name)
    planner = _planner(e, protocol, handed)
    mission = Mission(planner, e.name, protocol, oracle=e.oracle)
    for world, suite in zip(worlds, suites, strict=True):
        scene = world.scene
        path = _log_path(config, folder, scene, e)
        seed = planner_seed(config.seed, scene.family, scene.index)
        measured = cache(measure)  # Once, for the log and for the table.
        listeners = [] if path is None else [_recorder(path, e, seed, measured)]
        row = measured(mission.day(scene, seed, listeners, world, suite))
        if path is not None and config.log == "failures" and row.clean_success:
            path.unlink()
        yield row, planner.where if row.outcome == "planner_error" else ""


def _planner(
    entry: PlannerEntry, protocol: Protocol, handed: Handovers
) -> Guarded | Elsewhere:
    """Return what stands for a planner in one mission, here or in its own process."""
    if not entry.isolated:
        return Guarded(partial(_build, entry, handed))
    who = Who(
        whole_spec(entry.loaded_from),
        tuple(entry.settings.items()),
        entry.base,
        protocol.memory_limit_mib,
        here(),
    )
    return isolated(who, protocol.decision_limit_s)


def _build(entry: PlannerEntry, handed: Handovers) -> Planner:
    cls, config = handed.get(entry.name) or Handed(planner_class(entry.loaded_from))
    if config is None:
        config = configure(cls, entry.settings, entry.name)
    return cls(config)


def _log_path(
    config: RunConfig, folder: Path | None, scene: Scene, entry: PlannerEntry
) -> Path | None:
    if folder is None or config.log == "none":
        return None
    if not folder.is_dir():  # Not to be made anew where it was.
        raise RunError(f"{folder}: the run folder was moved or deleted.")
    path = log_file(folder, entry.name, scene.name)
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _recorder(
    path: Path, entry: PlannerEntry, seed: int, measured: Callable[[Trace], Row]
) -> Listener:
    from beacon_mj.recording import Recorder

    def row(trace: Trace) -> dict[str, Any]:
        return measured(trace).as_dict()

    return Recorder(path, planner_config=entry.config, seed=seed, row=row)
