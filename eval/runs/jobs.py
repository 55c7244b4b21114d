"""One job of an evaluation: one scene, every planner. Runs in a worker process."""

from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import Listener, run_episode
from beacon_mj.episode.trace import Outcome, Trace
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import PlannerEntry, RunConfig, SceneRef, load_ref
from beacon_mj.eval.runs.isolation.host import Who, isolated
from beacon_mj.eval.runs.overrides import configure
from beacon_mj.eval.runs.sandbox import Guarded
from beacon_mj.planners.base import Planner
from beacon_mj.planners.registry import load_planner
from beacon_mj.scene import Scene
from beacon_mj.streams import stream
from beacon_mj.world import SimulationError, World


class Job(NamedTuple):
    """A scene, and the names of the planners that still have to cross it."""

    ref: SceneRef
    planners: tuple[str, ...]

    def split(self) -> list["Job"]:
        """Return one job an episode."""
        return [Job(self.ref, (name,)) for name in self.planners]


def run_job(config: RunConfig, folder: Path | None, job: Job) -> list[Row]:
    """Run the episodes of a job.

    Args:
        config: The evaluation.
        folder: Run folder for logs; None for no logs.
        job: What to run.

    Returns:
        One row a planner. The scene and its world are built once.
    """
    scene = load_ref(config, job.ref)
    entries = [e for e in config.planners if e.name in job.planners]
    try:
        world = World(scene, config.protocol.timestep_s)
    except SimulationError as error:
        return [
            lost_row(config, scene, e.name, "simulation_error", str(error))
            for e in entries
        ]
    return [_episode(config, folder, scene, world, e) for e in entries]


def lost_row(
    config: RunConfig, scene: Scene, planner: str, outcome: Outcome, detail: str
) -> Row:
    """Return the row of an episode that could not be run."""
    return measure(
        Trace(
            planner=planner,
            scene=scene,
            protocol=config.protocol,
            start_m=np.array(scene.start_m),
            outcome=outcome,
            detail=detail,
        )
    )


def planner_seed(seed: int, family: str, index: int) -> int:
    """Return the planner's seed in one scene; the same for every planner."""
    return int(stream("planner", seed, family, index).integers(2**53))


def _episode(
    config: RunConfig, folder: Path | None, scene: Scene, world: World, e: PlannerEntry
) -> Row:
    path = _log_path(config, folder, scene, e)
    seed = planner_seed(config.seed, scene.family, scene.index)
    listeners = [] if path is None else [_recorder(path, e, seed)]
    trace = run_episode(
        scene,
        _planner(e, config.protocol),
        name=e.name,
        protocol=config.protocol,
        seed=seed,
        listeners=listeners,
        world=world,
    )
    row = measure(trace)
    if path is not None and config.log == "failures" and row.clean_success:
        path.unlink()
    return row


def _planner(entry: PlannerEntry, protocol: Protocol) -> Planner:
    if not entry.isolated:
        return Guarded(partial(_build, entry))
    who = Who(
        entry.spec,
        tuple(entry.settings.items()),
        entry.name.partition("[")[0],
        protocol.memory_limit_mib,
    )
    return isolated(who, protocol.decision_limit_s)


def _build(entry: PlannerEntry) -> Planner:
    cls = _planner_class(entry.spec)
    return cls(configure(cls, entry.settings, entry.name))


@lru_cache(maxsize=64)
def _planner_class(spec: str) -> type[Planner]:
    return load_planner(spec)[1]


def _log_path(
    config: RunConfig, folder: Path | None, scene: Scene, entry: PlannerEntry
) -> Path | None:
    if folder is None or config.log == "none":
        return None
    path = folder / "logs" / entry.name / f"{scene.name}.mcap"
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _recorder(path: Path, entry: PlannerEntry, seed: int) -> Listener:
    from beacon_mj.recording import Recorder

    return Recorder(path, planner_config=entry.config, seed=seed, row=_measured)


def _measured(trace: Trace) -> dict[str, Any]:
    return measure(trace).as_dict()
