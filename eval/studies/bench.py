"""What episodes cost, and of what: in processor time, on this machine, as it is now.

The least that an episode can cost is its physics: the same commands, and the engine
stepped as `World` steps it, which looks for contacts only where something can be
touched. Everything else is stated as a multiple or a share.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, TypeVar

import numpy as np

from beacon_mj.episode.run import run_episode
from beacon_mj.episode.sensor import Sensor
from beacon_mj.episode.trace import StepRecord, Trace
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.geometry import Array
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.motion.dstar_lite import dijkstra
from beacon_mj.planners.base import Planner
from beacon_mj.planners.registry import load_planner
from beacon_mj.recording import Recorder
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import BaseWorld, World
from beacon_mj.world.bare import BareWorld, ScheduledWorld

T = TypeVar("T")

PLANNERS = ("bug2", "dstar-lite", "beacon", "beacon-voi")
FAMILIES = ("sparse", "cluttered", "collision-required", "collision-shortcut")
GENERATED = ("cluttered", "collision-required", "lookalike-doors")
GRIDS = (120, 240, 480)  #: Cells along an edge of the grids that are searched.
SEED = 1000  #: Of scenes that no published table holds.


class Measure(NamedTuple):
    """One number: what it is of, what it says, in which unit."""

    of: str
    what: str
    value: float
    unit: str

    @property
    def name(self) -> str:
        """What tells it from the others, such as `beacon: real-time factor`."""
        return f"{self.of}: {self.what}"


class Clock:
    """Adds up the processor time that calls take [s]."""

    def __init__(self) -> None:
        """Begin at zero."""
        self.seconds = 0.0

    def time(self, call: Callable[..., T], *given: Any, **named: Any) -> T:
        """Return what a call returns."""
        begin = time.process_time()
        value = call(*given, **named)
        self.seconds += time.process_time() - begin
        return value


class _TimedPlanner(Planner[Any]):
    """A planner whose decisions are timed."""

    def __init__(self, planner: Planner[Any], clock: Clock) -> None:
        super().__init__()
        self._planner, self._clock = planner, clock

    def reset(self, task: Task) -> None:
        self._clock.time(self._planner.reset, task)

    def act(self, observation: Observation) -> Command:
        return self._clock.time(self._planner.act, observation)


class _TimedRecorder(Recorder):
    """A recorder that is timed."""

    clock: Clock

    def begin(self, trace: Trace, world: BaseWorld, observation: Observation) -> None:
        self.clock.time(super().begin, trace, world, observation)

    def step(
        self, record: StepRecord, world: BaseWorld, observation: Observation
    ) -> None:
        self.clock.time(super().step, record, world, observation)

    def end(self, trace: Trace) -> None:
        self.clock.time(super().end, trace)


class Costs:
    """Processor times of one planner's episodes, added up."""

    def __init__(self) -> None:
        """Begin at zero."""
        self.simulated_s, self.steps = 0.0, 0
        self.silent, self.logged, self.naive, self.physics = (Clock() for _ in range(4))
        self.world, self.sensing, self.planning, self.logging = (
            Clock() for _ in range(4)
        )

    def add(self, planner: str, scene: Scene) -> None:
        """Run a scene with a log and without, and its commands on the engine alone."""
        cls, world = load_planner(planner)[1], World(scene)
        self.silent.time(run_episode, scene, cls(), planner, world=world)
        with TemporaryDirectory() as folder:
            recorder = _TimedRecorder(
                Path(folder) / "log.mcap", row=lambda trace: measure(trace).as_dict()
            )
            recorder.clock = self.logging
            timed = _TimedPlanner(cls(), self.planning)
            trace = self.logged.time(
                run_episode, scene, timed, planner, listeners=[recorder], world=world
            )
        self.steps += len(trace.steps)
        self.simulated_s += len(trace.steps) * scene.robot.control_period_s
        self._replay(trace)

    def _replay(self, trace: Trace) -> None:
        commands = [record.command.velocity_mps for record in trace.steps]
        world = ScheduledWorld(trace.scene)
        sensor = Sensor(world, trace.protocol)
        for command in commands:
            outcome = self.world.time(world.step, command)
            self.sensing.time(sensor.observe, outcome, 1.0)
        bare, last = BareWorld(trace.scene), world.data.qpos
        for state in (
            self.naive.time(bare.run, commands, None),
            self.physics.time(bare.run, commands, world.schedules),
        ):
            if state.tobytes() != last.tobytes():
                raise RunError(f"{trace.scene.name}: the bare engine went elsewhere.")

    def measures(self, planner: str) -> Iterator[Measure]:
        """Yield real-time factor, multiples of bare stepping, and shares of a step."""
        logged, bare = self.logged.seconds, self.physics.seconds
        factor = self.simulated_s / logged
        yield Measure(planner, "real-time factor, with log", factor, "x")
        for what, clock in (("without log", self.silent), ("with log", self.logged)):
            times = clock.seconds / bare
            yield Measure(planner, f"episode over bare stepping, {what}", times, "x")
        times = logged / self.naive.seconds
        yield Measure(planner, "episode over naive stepping, with log", times, "x")
        shares = {
            "physics": bare,
            "forces and poses": self.world.seconds - bare,
            "sensing": self.sensing.seconds,
            "planning": self.planning.seconds,
            "logging": self.logging.seconds,
        }
        shares["the rest"] = logged - sum(shares.values())
        for what, seconds in shares.items():
            yield Measure(planner, f"share of {what}", 100.0 * seconds / logged, "%")
        pace = self.steps / (self.world.seconds + self.sensing.seconds)
        yield Measure(planner, "steps of world and sensor", pace, "1/s")


def episodes(
    planners: Sequence[str] = PLANNERS, families: Sequence[str] = FAMILIES
) -> Iterator[Measure]:
    """Yield what episodes of planners cost, over a scene of each family."""
    scenes = [generate_scene(family, 0, SEED) for family in families]
    for planner in planners:
        Costs().add(planner, scenes[0])  # Loads what is compiled.
        costs = Costs()
        for scene in scenes:
            costs.add(planner, scene)
        yield from costs.measures(planner)


def generation(families: Sequence[str] = GENERATED) -> Iterator[Measure]:
    """Yield what a scene and its certificate take."""
    for family in families:
        generate_scene(family, 0, SEED)
        clock, count = Clock(), 5
        for index in range(1, 1 + count):
            clock.time(generate_scene, family, index, SEED)
        yield Measure("scene", family, 1000.0 * clock.seconds / count, "ms")


def start_up() -> Iterator[Measure]:
    """Yield what commands take in processes of their own: help, and one episode.

    The caches of scenes and machine code are empty at first. Python's bytecode is not,
    as after any installation.
    """
    with TemporaryDirectory() as folder:
        environment = _empty_caches(folder)
        one = ("eval", "--planner", "dstar-lite", "--family", "sparse", "-n", "1")
        rest = ("--workers", "1", "--no-report", "--out")
        for what, arguments in (
            ("one episode, empty caches", (*one, *rest, f"{folder}/first")),
            ("one episode", (*one, *rest, f"{folder}/second")),
            ("help", ("--help",)),
        ):
            seconds = _command_s(environment, *arguments)
            yield Measure("start-up", what, seconds, "s")


def _empty_caches(folder: str) -> dict[str, str]:
    """Return an environment whose caches are in a folder; all bytecode is made."""
    own = {
        "BEACON_MJ_CACHE": f"{folder}/scenes",
        "NUMBA_CACHE_DIR": f"{folder}/kernels",
        "PYTHONPYCACHEPREFIX": f"{folder}/bytecode",
    }
    environment = {**os.environ, **own}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    evaluation = "import beacon_mj.eval.api.evaluation, beacon_mj.cli.evaluate"
    code = f"{evaluation}, beacon_mj.planners.dstar_lite"
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
    return environment


def _command_s(environment: dict[str, str], *arguments: str) -> float:
    """Return the processor time of a command [s]."""
    before = _children_s()
    subprocess.run(
        [sys.executable, "-m", "beacon_mj", *arguments],
        env=environment,
        capture_output=True,
        check=True,
    )
    return _children_s() - before


def search(edges: Sequence[int] = GRIDS) -> Iterator[Measure]:
    """Yield the time of Dijkstra's search, here and in SciPy, on the same grids."""
    for cells in edges:
        cost = np.random.default_rng(cells).uniform(0.0, 1.0, (cells, cells))
        cost[[0, -1], :] = cost[:, [0, -1]] = np.inf
        goal = (cells // 2) * cells + cells // 2
        dijkstra(cost, 0.05, goal)
        ours, scipys = Clock(), Clock()
        found, _ = ours.time(dijkstra, cost, 0.05, goal)
        other = _scipy_dijkstra(cost, 0.05, goal, scipys)
        if not np.allclose(found.ravel(), other, rtol=1e-9, atol=1e-9):
            raise RunError("Expected both searches to find the same costs.")
        of = f"Dijkstra, {cells} x {cells} cells"
        yield Measure(of, "ours", 1000.0 * ours.seconds, "ms")
        yield Measure(of, "SciPy", 1000.0 * scipys.seconds, "ms")


def _scipy_dijkstra(cost: Array, cell_m: float, goal: int, clock: Clock) -> Array:
    """Return the cost-to-go of all cells; edges are those of `dstar_lite_kernels`."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra as scipy_dijkstra

    flat, cols = cost.ravel(), cost.shape[1]
    free = np.flatnonzero(np.isfinite(flat))
    tails, heads, lengths = [], [], []
    for step in (1, -1, cols, -cols, cols + 1, cols - 1, -cols + 1, -cols - 1):
        diagonal = abs(step) not in (1, cols)
        tail = free[np.isfinite(flat[free + step])]
        tails.append(tail)
        heads.append(tail + step)
        side = cell_m * (np.sqrt(2.0) if diagonal else 1.0)
        lengths.append(side * (1.0 + flat[tail + step]))
    edges = np.concatenate(heads), np.concatenate(tails)
    shape = (flat.size, flat.size)
    graph = coo_matrix((np.concatenate(lengths), edges), shape=shape).tocsr()
    return np.asarray(clock.time(scipy_dijkstra, graph, indices=goal))


def _children_s() -> float:
    """Return the processor time of all processes that were waited for [s]."""
    times = os.times()
    return times.children_user + times.children_system


def medians(rounds: Sequence[Sequence[Measure]]) -> list[Measure]:
    """Return the median of each measure over rounds of the same ones."""
    return [
        own[0]._replace(value=median(m.value for m in own))
        for own in zip(*rounds, strict=True)
    ]
