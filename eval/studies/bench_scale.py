"""What scenes and decisions cost as rooms grow: processor time against obstacles."""

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from beacon_mj.episode.run import run_episode
from beacon_mj.episode.sensor import Sensor
from beacon_mj.episode.trace import Trace
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.runs.warm_up import compile_kernels, load_kernels
from beacon_mj.eval.studies.bench import SEED, Clock, Measure
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.registry import load_planner
from beacon_mj.recording import Recorder
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import World

FAMILIES = ("sparse", "cluttered", "warehouse-12", "warehouse-24")
PLANNERS = ("dstar-lite", "beacon", "beacon-voi")


class _Decisions(Planner[Any]):
    """A planner whose single decisions are timed."""

    def __init__(self, planner: Planner[Any]) -> None:
        super().__init__()
        self._planner = planner
        self.ms: list[float] = []

    def reset(self, task: Task) -> None:
        self._planner.reset(task)

    def act(self, observation: Observation) -> Command:
        begin = time.process_time()
        command = self._planner.act(observation)
        self.ms.append(1000.0 * (time.process_time() - begin))
        return command


def scale(
    families: Sequence[str] = FAMILIES, planners: Sequence[str] = PLANNERS
) -> Iterator[Measure]:
    """Yield what one scene of each family, its steps and its decisions take."""
    compile_kernels(planners)
    load_kernels(planners)
    for name in planners:  # Imports the rest.
        run_episode(generate_scene("sparse", 1, SEED), load_planner(name)[1](), name)
    for family in families:
        clock = Clock()
        scene = clock.time(generate_scene, family, 0, SEED)
        of = f"{family}, {len(scene.obstacles)} obstacles"
        yield Measure(of, "generation", 1000.0 * clock.seconds, "ms")
        for name in planners:
            decisions = _Decisions(load_planner(name)[1]())
            trace = run_episode(scene, decisions, name)
            for what, share in (("p50", 50.0), ("p99", 99.0), ("largest", 100.0)):
                value = float(np.percentile(decisions.ms, share))
                yield Measure(of, f"decision of {name}, {what}", value, "ms")
        yield from _steps(of, scene, trace)


def _steps(of: str, scene: Scene, trace: Trace) -> Iterator[Measure]:
    """Yield what the steps of an episode take, and its log."""
    world, opening, logging = World(scene), Clock(), Clock()
    sensor, stepping, sensing = Sensor(world, trace.protocol), Clock(), Clock()
    with TemporaryDirectory() as folder:
        recorder = Recorder(
            Path(folder) / "log.mcap", row=lambda done: measure(done).as_dict()
        )
        first = sensor.observe(None, 1.0)
        opening.time(recorder.begin, trace, world, first)
        for record in trace.steps:
            outcome = stepping.time(world.step, record.command.velocity_mps)
            seen = sensing.time(sensor.observe, outcome, 1.0)
            logging.time(recorder.step, record, world, seen)
        recorder.end(trace)
    each = 1000.0 / len(trace.steps)
    yield Measure(of, "step of the world", each * stepping.seconds, "ms")
    yield Measure(of, "observation", each * sensing.seconds, "ms")
    yield Measure(of, "opening a log", 1000.0 * opening.seconds, "ms")
    yield Measure(of, "step of a log", each * logging.seconds, "ms")
