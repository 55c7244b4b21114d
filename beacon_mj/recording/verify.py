"""Does a log prove its own numbers?

The world is rebuilt from the attached scene and fed the logged commands, and all that
happens is recorded again. Recording is deterministic, so a genuine log and the second
recording hold the same messages, bit for bit: states, forces, poses, pictures, events,
and the result with its row. What only the planner could have made, its commands and
reasons, whether it gave up or failed, is taken from the log.
"""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import msgspec
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata

from beacon_mj.episode.run import run_episode
from beacon_mj.episode.trace import StepRecord, Trace
from beacon_mj.errors import LogError
from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.planners.base import Planner
from beacon_mj.recording import provenance
from beacon_mj.recording.container import Container
from beacon_mj.recording.drawing import NS
from beacon_mj.recording.messages import message
from beacon_mj.recording.reader import Log, read_log
from beacon_mj.recording.rebuild import rebuild_trace
from beacon_mj.recording.recorder import Recorder
from beacon_mj.recording.schemas import TOPICS
from beacon_mj.scene_gen.mjcf import scene_mjcf
from beacon_mj.world import World

RowOf = Callable[[Trace], Mapping[str, Any]]
#: Outcomes that are acts of the planner, or of a step that left no record.
_UNREPEATABLE = ("planner_error", "simulation_error")
_ENGINE = ("mujoco", "machine")
#: Metadata that may differ between equal recordings: who recorded, and where.
_RECORDER = ("versions", "machine")


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """What came of verifying a log.

    Attributes:
        path: The log.
        steps: Control steps that were simulated again.
        row_checked: Whether the stored row was computed again as well.
        row: The row that is stored in the log, if there is one and the log is sound.
        problem: Where the log first differs, in one line; None if it proves itself.
    """

    path: Path
    steps: int
    row_checked: bool
    row: dict[str, Any] | None
    problem: str | None

    @property
    def ok(self) -> bool:
        """Whether the log proves its own numbers."""
        return self.problem is None


def verify(path: str | Path, row: RowOf | None = None) -> Verification:
    """Check a log by simulating it again; every failure is a returned problem.

    Args:
        path: The log.
        row: Computes an episode's row from its trace; if None, the stored row is not
            checked.
    """
    path = Path(path)
    try:
        log = read_log(path)
        problem = _unfit(log) or _first_difference(log, row)
    except LogError as error:
        return Verification(
            path=path, steps=0, row_checked=False, row=None, problem=str(error)
        )
    checked = row is not None and "row" in log.result
    return Verification(
        path=path,
        steps=log.steps,
        row_checked=checked,
        row=None if problem else log.row,
        problem=problem,
    )


def _unfit(log: Log) -> str | None:
    """Return why a log cannot be simulated again here, if so."""
    if not log.finished:
        return f"{log.path}: unfinished: it broke off and has no result."
    here = provenance.log_versions()
    for name in _ENGINE:
        if log.versions.get(name) != here[name]:
            return (
                f"{log.path}: recorded with {name} {log.versions.get(name)} but this "
                f"is {name} {here[name]}: states need not be equal bit for bit."
            )
    regenerated = scene_mjcf(log.scene, log.protocol.timestep_s)
    if log.mjcf != regenerated:
        pairs = zip_longest(log.mjcf.splitlines(), regenerated.splitlines())
        line = next(k for k, (a, b) in enumerate(pairs, start=1) if a != b)
        return (
            f"{log.path}: the attached world differs from what its scene gives with "
            f"this version, first in line {line}."
        )
    return None


def _first_difference(log: Log, row: RowOf | None) -> str | None:
    """Record the episode again; return where the recordings first differ."""
    with tempfile.TemporaryDirectory(prefix="beacon-mj-") as folder:
        again = Path(folder) / "again.mcap"
        trace = rebuild_trace(log)
        _repeat(log, trace, again, row)
        pairs = zip_longest(_essence(log.path, row), _essence(again, row))
        for logged, simulated in pairs:
            if logged != simulated:
                return f"{log.path}: {_difference(logged, simulated)}"
    return None


def _repeat(log: Log, trace: Trace, again: Path, row: RowOf | None) -> None:
    """Run the logged commands and record what happens."""
    config = log.config.get("planner_config", "null")
    seed = log.config.get("planner_seed", "")
    if not seed.isdecimal():
        raise LogError(f"{log.path}: expected a planner's seed but it is {seed!r}.")
    recorder = Recorder(
        again, planner_config=msgspec.Raw(config.encode()), seed=int(seed), row=row
    )
    run_episode(
        trace.scene,
        _Script(trace),
        name=trace.planner,
        protocol=trace.protocol,
        seed=int(seed),
        listeners=[_AdoptEnd(trace), recorder],
        suite=trace.suite,
    )


class _Script(Planner):
    """Gives the commands of a trace, and gives up where the trace did."""

    Config = type(None)

    def __init__(self, trace: Trace) -> None:
        super().__init__()
        self._trace = trace

    def reset(self, task: Task) -> None:
        """Start from the first command."""
        self._next = 0

    def act(self, observation: Observation) -> Command:
        """Return the next command; raise when there is none."""
        steps, trace = self._trace.steps, self._trace
        if self._next < len(steps):
            self._next += 1
            return steps[self._next - 1].command
        if trace.outcome == "gave_up":
            return Command(
                velocity_mps=trace.start_m * 0.0,
                give_up=True,
                info=PlannerInfo(reason=trace.detail),
            )
        raise EOFError("the log has no further command")


class _AdoptEnd:
    """Takes an outcome that cannot be repeated from the log."""

    def __init__(self, logged: Trace) -> None:
        self._logged = logged

    def begin(self, trace: Trace, world: World, observation: Observation) -> None:
        """Do nothing."""

    def step(self, record: StepRecord, world: World, observation: Observation) -> None:
        """Do nothing."""

    def end(self, trace: Trace) -> None:
        """Adopt the logged end where the commands ran out before one."""
        if trace.outcome == "planner_error" and self._logged.outcome in _UNREPEATABLE:
            trace.outcome, trace.detail = self._logged.outcome, self._logged.detail


Essence = tuple[str, int, Any]


def _essence(path: Path, row: RowOf | None) -> Iterator[Essence]:
    """Yield (kind or topic, time [ns], content) of all that must be equal.

    Messages come in their order, then attachments and metadata in the order of names,
    for where those stand between chunks is no matter of content.
    """
    topics: dict[int, str] = {}
    fixed: list[Essence] = []
    for record in Container(path).records():
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Message):
            yield topics.get(record.channel_id, "?"), record.log_time, record.data
        else:
            fixed += _fixed(record, row)
    yield from sorted(fixed, key=lambda entry: entry[0])


def _fixed(record: McapRecord, row: RowOf | None) -> Iterator[Essence]:
    """Yield attachments and metadata; versions may differ, and so may no row."""
    if isinstance(record, Attachment):
        yield f"attachment {record.name}", 0, record.data
    elif isinstance(record, Metadata) and record.name not in _RECORDER:
        data = dict(record.metadata)
        if row is None:
            data.pop("row", None)
        yield f"metadata {record.name}", 0, data


def _difference(logged: Essence | None, simulated: Essence | None) -> str:
    """Say in one line how two entries differ."""
    if logged is None or simulated is None:
        there = logged or simulated
        assert there is not None
        where = "the log" if simulated is None else "the simulation"
        return f"only {where} goes on, with {there[0]} at {there[1] / NS:.1f} s."
    name, time_ns, content = logged
    if (name, time_ns) != simulated[:2]:
        return (
            f"at {time_ns / NS:.1f} s the log has {name} where the simulation has "
            f"{simulated[0]} at {simulated[1] / NS:.1f} s."
        )
    where = f"{name} at {time_ns / NS:.1f} s" if name in TOPICS else name
    before, after = _flat(name, content), _flat(name, simulated[2])
    for key in [*before, *after]:
        if before.get(key) != after.get(key):
            return (
                f"{where}: {key} is {before.get(key)!r} in the "
                f"log but {after.get(key)!r} in the simulation."
            )
    return f"{where}: encoded differently."


def _flat(name: str, content: Any) -> dict[str, Any]:
    """Return the named values in an entry."""
    if name in TOPICS:
        return dict(_fields("", message(TOPICS[name]).FromString(content)))
    if isinstance(content, bytes):
        return {"content": f"{len(content)} bytes"}
    out = dict(content)
    try:
        row = msgspec.json.decode(out.get("row", "{}"), type=dict[str, Any])
    except msgspec.DecodeError:
        return out
    out.pop("row", None)
    return out | {f"row.{column}": value for column, value in row.items()}


def _fields(prefix: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield (path, scalar) of everything set in a protobuf message."""
    for field, content in value.ListFields():
        path = f"{prefix}{field.name}"
        items = (
            [(path, content)]
            if not field.is_repeated
            else [(f"{path}[{k}]", item) for k, item in enumerate(content)]
        )
        for key, item in items:
            if hasattr(item, "ListFields"):
                yield from _fields(f"{key}.", item)
            else:
                yield key, item
