"""The door between an episode and its planner."""

import dataclasses
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from beacon_mj.episode.answers import PlannerFailure, checked_command
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.sealed import Sealer, sealed_array
from beacon_mj.episode.sensor import Sensor
from beacon_mj.errors import describe, one_line
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.geometry import Array, Footprint
from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.push_through import PushThrough
from beacon_mj.recording import Recorder
from beacon_mj.recording.verify import verify
from beacon_mj.world import World
from tests.worlds import cached_scene

SHORT = Protocol(max_steps=20)


class Scripted(Planner):
    """Does what a test says."""

    Config: ClassVar[type[Any]] = dict

    def __init__(self, act: Callable[[Task, Observation], Any]) -> None:
        super().__init__({})
        self._act = act

    def reset(self, task: Task) -> None:
        self._task = task

    def act(self, observation: Observation) -> Command:
        command: Command = self._act(self._task, observation)
        return command


def slow(velocity: Any = (0.01, 0.0), **values: Any) -> Command:
    return Command(velocity_mps=velocity, **values)


@pytest.mark.parametrize(
    "given",
    [
        np.array([1.0, -2.0]),
        np.array([1, -2], np.float32),
        np.array([1, -2], np.int8),
        np.array([1, -2], np.longdouble),
        np.array([9.0, 1.0, 9.0, -2.0])[1::2],
        (1, -2.0),
        [1.0, np.float32(-2.0)],
    ],
)
def test_velocities_are_converted(given: Any) -> None:
    velocity = checked_command(slow(given), {}).velocity_mps
    assert velocity.dtype == np.float64
    assert velocity.flags.c_contiguous
    assert velocity.tolist() == [1.0, -2.0]
    assert not np.shares_memory(velocity, np.asarray(given))


def test_every_field_is_converted() -> None:
    info = PlannerInfo(
        target=np.str_("box"),
        cost_push=np.float32(1.5),  # type: ignore[arg-type]
        cost_detour=float("inf"),
        terms={"length": np.int64(2)},  # type: ignore[dict-item]
        path_m=[(0, 1), (2, 3)],  # type: ignore[arg-type]
        beliefs={"box": np.array([0.5, 0.25, 0.25], np.float32)},  # type: ignore[dict-item]
        replanned=np.True_,  # type: ignore[arg-type]
        expansions=np.uint8(7),  # type: ignore[arg-type]
    )
    found = checked_command(slow(give_up=np.bool_(True), info=info), {"box": None})
    assert found.give_up is True
    values = {f.name: getattr(found.info, f.name) for f in dataclasses.fields(info)}
    path = values.pop("path_m")
    assert (path.dtype, path.tolist()) == (np.float64, [[0.0, 1.0], [2.0, 3.0]])
    assert repr(values) == repr(
        {
            "action": "move",
            "reason": "",
            "target": "box",
            "cost_push": 1.5,
            "cost_detour": float("inf"),
            "terms": {"length": 2.0},
            "beliefs": {"box": (0.5, 0.25, 0.25)},
            "replanned": True,
            "expansions": 7,
        }
    )
    assert {type(v) for v in values.values()} == {str, float, dict, bool, int}


@pytest.mark.parametrize("belief", [(0.5, 0.5), (0.9, 0.9, -0.8), (np.nan, 0.5, 0.5)])
def test_unsound_beliefs_are_refused(belief: Any) -> None:
    info = PlannerInfo(beliefs={"box": belief})
    with pytest.raises(PlannerFailure, match="three probabilities that sum to 1"):
        checked_command(slow(info=info), {"box": None})


def test_a_value_is_read_once() -> None:
    class Two:
        count = 0

        def __array__(self, dtype: Any = None, copy: Any = None) -> Array:
            self.count += 1
            return np.array([self.count, 0.0])

    given = Two()
    assert checked_command(slow(given), {}).velocity_mps.tolist() == [1.0, 0.0]
    assert given.count == 1


def test_sealed_arrays_stay_sealed() -> None:
    source = np.arange(6.0).reshape(3, 2)
    sealed = sealed_array(source)
    np.testing.assert_array_equal(sealed, source)
    for array in (sealed, sealed[1:], sealed.view(), sealed.reshape(-1)):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0.0
        with pytest.raises(ValueError, match="cannot set WRITEABLE"):
            array.flags.writeable = True
        assert not np.shares_memory(array, source)


def test_beliefs_that_are_repeated_are_checked_once_and_changed_ones_again() -> None:
    known = {"box": (0.5, 0.25, 0.25), "can": (1.0, 0.0, 0.0)}
    sensed = dict.fromkeys(known)
    first = checked_command(slow(info=PlannerInfo(beliefs=known)), sensed).info.beliefs
    info = PlannerInfo(beliefs=dict(known))
    again = checked_command(slow(info=info), sensed, first).info.beliefs
    assert again is first
    for other in ({**known, "box": (0.5, 0.5, 0.0)}, {"can": known["can"]}):
        info = PlannerInfo(beliefs=other)
        assert checked_command(slow(info=info), sensed, first).info.beliefs == other
    info = PlannerInfo(beliefs={**known, "can": (1.0, 0.5, 0.0)})
    with pytest.raises(PlannerFailure, match="three probabilities"):
        checked_command(slow(info=info), sensed, first)


def _everything(value: Any, path: str = "") -> dict[str, Any]:
    """Return all arrays and scalars in a value, by where they are."""
    if dataclasses.is_dataclass(value):
        parts = [(f.name, getattr(value, f.name)) for f in dataclasses.fields(value)]
    elif isinstance(value, tuple):
        parts = [(str(k), v) for k, v in enumerate(value)]
    else:
        return {path: value.tolist() if isinstance(value, np.ndarray) else value}
    out: dict[str, Any] = {}
    for name, part in parts:
        out |= _everything(part, f"{path}.{name}")
    return out


def _arrays(value: Any) -> list[Array]:
    if isinstance(value, np.ndarray):
        return [value]
    if dataclasses.is_dataclass(value):
        value = tuple(getattr(value, f.name) for f in dataclasses.fields(value))
    if isinstance(value, tuple):
        return [array for part in value for array in _arrays(part)]
    return []


def observed(steps: int) -> list[tuple[World, Observation]]:
    world = World(cached_scene("collision-required", 0))
    sensor = Sensor(world, Protocol())
    out = [(world, sensor.observe(None, 1.0))]
    for _ in range(steps):
        out.append((world, sensor.observe(world.step(np.array([0.5, 0.1])), 1.0)))
    return out


def test_an_observation_is_sealed_whole() -> None:
    sealer, touched = Sealer(), 0
    for world, seen in observed(60):
        given = sealer.observation(seen)
        assert _everything(given) == _everything(seen)
        mine = [*_arrays(world.footprints), *_arrays(tuple(world.outlines))]
        for array in _arrays(given):
            assert not array.flags.writeable
            assert not any(np.shares_memory(array, other) for other in mine)
        touched += len(given.contacts)
    assert len(seen.obstacles) > 3
    assert touched


def test_what_stays_keeps_its_object() -> None:
    """A planner's caches may tell by the object that an obstacle did not move."""
    sealer, kept = Sealer(), 0
    before: dict[str, Footprint] = {}
    seen_before: dict[str, Footprint] = {}
    for _, seen in observed(60):
        for own, o in zip(
            sealer.observation(seen).obstacles, seen.obstacles, strict=True
        ):
            same = seen_before.get(o.id) is o.footprint
            assert (before.get(o.id) is own.footprint) == same
            before[o.id], seen_before[o.id] = own.footprint, o.footprint
            kept += same
    assert kept > 60


def _spoil(given: Observation) -> None:
    """Alter a record, and arrays, by force."""
    for o in given.obstacles:
        centroid = o.centroid_m
        centroid.shape = (1, 2)
        vertices = o.footprint.vertices
        vertices.dtype = np.dtype(np.int64)  # type: ignore[assignment,misc]
        object.__setattr__(o, "broken", True)
        object.__setattr__(o, "seen_s", -1.0)
    given.footprints.vertices.shape = (-1,)
    object.__setattr__(given, "obstacles", ())


@pytest.mark.filterwarnings("ignore:Setting the (shape|dtype):DeprecationWarning")
def test_what_was_altered_by_force_is_not_handed_out_again() -> None:
    sealer = Sealer()
    for _, seen in observed(30):
        given = sealer.observation(seen)
        assert _everything(given) == _everything(seen)
        _spoil(given)


@pytest.mark.filterwarnings("ignore:Setting the (shape|dtype):DeprecationWarning")
def test_altering_inputs_by_force_changes_nothing() -> None:
    def honest(task: Task, seen: Observation) -> Command:
        return slow((0.4, 0.1))

    def forced(task: Task, seen: Observation) -> Command:
        _spoil(seen)
        object.__setattr__(task, "goal_m", task.start_m)
        object.__setattr__(task, "goal_tolerance_m", 1e3)
        object.__setattr__(task, "control_period_s", 1e3)
        return slow((0.4, 0.1))

    scene = cached_scene("cluttered", 0)
    rows = [
        measure(run_episode(scene, Scripted(act), protocol=Protocol(max_steps=60)))
        for act in (honest, forced)
    ]
    assert rows[0].outcome == "timeout"
    assert rows[0].contacts > 0
    clock = dict.fromkeys(("plan_ms_p50", "plan_ms_p99", "wall_time_s"))
    assert rows[0].as_dict() | clock == rows[1].as_dict() | clock


def test_a_planner_cannot_move_the_goal() -> None:
    class Mover(PushThrough):
        def reset(self, task: Task) -> None:
            task.goal_m[:] = task.start_m
            super().reset(task)

    trace = run_episode(cached_scene("sparse", 0), Mover())
    assert (trace.outcome, len(trace.steps)) == ("planner_error", 0)
    assert "read-only" in trace.detail


class Single(PushThrough):
    """Computes in single precision, as a neural network would."""

    def act(self, observation: Observation) -> Command:
        command = super().act(observation)
        velocity: Any = command.velocity_mps.astype(np.float32)
        path: Any = np.array(command.info.path_m, np.float32)
        info = dataclasses.replace(command.info, path_m=path)
        return Command(velocity_mps=velocity, info=info)


def test_a_log_of_a_planner_in_single_precision_verifies(tmp_path: Path) -> None:
    log = tmp_path / "single.mcap"
    recorder = Recorder(log, row=lambda trace: measure(trace).as_dict())
    scene = cached_scene("cluttered", 0)
    trace = run_episode(scene, Single(), "single", listeners=[recorder])
    assert trace.steps[0].command.velocity_mps.dtype == np.float64
    found = verify(log, lambda trace: measure(trace).as_dict())
    assert found.problem is None
    assert found.steps == len(trace.steps) > 20


@pytest.mark.parametrize("swallow", [False, True])
def test_only_the_users_own_interrupt_stops_a_run(swallow: bool) -> None:
    def act(task: Task, seen: Observation) -> Command:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            if not swallow:
                raise
        return slow()

    def raising(task: Task, seen: Observation) -> Command:
        raise KeyboardInterrupt

    scene = cached_scene("sparse", 0)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        run_episode(scene, Scripted(act), protocol=SHORT)
    trace = run_episode(scene, Scripted(raising), protocol=SHORT)
    assert (trace.outcome, trace.detail) == ("planner_error", "KeyboardInterrupt")
    assert signal.getsignal(signal.SIGINT) is before


def test_a_decision_that_does_not_end_is_interrupted() -> None:
    def act(task: Task, seen: Observation) -> Command:
        try:
            time.sleep(600.0)
        except BaseException:
            time.sleep(600.0)
        return slow()

    hasty = Protocol(max_steps=20, decision_limit_s=0.1)
    trace = run_episode(cached_scene("sparse", 0), Scripted(act), protocol=hasty)
    assert trace.detail == "TimeoutError: no decision within 0.1 s"
    assert trace.wall_time_s < 10.0
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_the_process_is_left_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HERE", "1")
    (tmp_path / "elsewhere").mkdir()

    def act(task: Task, seen: Observation) -> Command:
        os.chdir(tmp_path / "elsewhere")
        os.environ.clear()
        os.umask(0o777)
        np.seterr(all="raise")
        return slow()

    before, mask = np.geterr(), os.umask(0o022)
    run_episode(cached_scene("sparse", 0), Scripted(act), protocol=SHORT)
    assert os.umask(mask) == 0o022
    assert Path.cwd() == tmp_path
    assert os.environ["HERE"] == "1"
    assert np.geterr() == before


def test_an_exception_is_one_line_whatever_it_says() -> None:
    class Odd(Exception):
        def __str__(self) -> str:
            raise SystemExit

    assert describe(Odd()) == "Odd: (no text: SystemExit in its __str__)"
    assert describe(KeyError("a")) == "KeyError: 'a'"
    assert describe(ValueError()) == "ValueError"
    text = one_line("a\n b\x1b[1m\udcff é" + "x" * 5000)
    assert text.startswith(r"a b\x1b[1m\udcff é")
    assert len(text) == 1000
    assert one_line(text) == text
