"""Does a log prove its own numbers?

The world is rebuilt from the attached scene and fed the logged commands, and all that
happens is recorded again. Recording is deterministic, so a genuine log and the second
recording hold the same messages, bit for bit: states, forces, poses, pictures, events,
and the result with its row. What only the planner could have made, its commands and
reasons, whether it gave up or failed, is taken from the log.
"""

import re
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any

import msgspec

from beacon_mj.episode.run import run_episode
from beacon_mj.episode.trace import StepRecord, Trace
from beacon_mj.errors import LogError, SceneError
from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.planners.base import Planner
from beacon_mj.recording import provenance
from beacon_mj.recording.differences import first_difference
from beacon_mj.recording.machine import machine
from beacon_mj.recording.reader import Log, read_log
from beacon_mj.recording.rebuild import rebuild_trace
from beacon_mj.recording.recorder import Recorder
from beacon_mj.recording.tolerance import TOLERANCE_M, state_problem
from beacon_mj.scene.recertify import first_lie, proved_certificate
from beacon_mj.world import BaseWorld

RowOf = Callable[[Trace], Mapping[str, Any]]
#: Outcomes that are acts of the planner, or of a step that left no record.
_UNREPEATABLE = ("planner_error", "simulation_error")


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """What came of verifying a log.

    Attributes:
        path: The log.
        steps: Control steps that were simulated again.
        row_checked: Whether the stored row was computed again as well.
        row: The row that is stored in the log, if there is one and the log is sound.
        problem: Where the log first differs, in one line; None if it proves itself.
        config: What the log says it was run with.
        versions: And with which versions.
        tolerance_m: How far positions may differ where another kind of machine
            recorded it; 0 where everything must be equal bit for bit [m].
    """

    path: Path
    steps: int
    row_checked: bool
    row: dict[str, Any] | None
    problem: str | None
    config: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    tolerance_m: float = 0.0

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
        exact = is_exact(log)
        problem = _unfit(log) or _first_difference(log, row, exact)
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
        config=log.config,
        versions=log.versions,
        tolerance_m=0.0 if exact else TOLERANCE_M,
    )


def is_exact(log: Log) -> bool:
    """Whether a log was recorded on this kind of machine, where bits are equal.

    That is one of this processor's kind, and with glibc if this one has it.
    """
    return same_kind(log.versions.get("machine", ""), [log.machine])


def same_kind(processor: str, machines: Iterable[Mapping[str, str]]) -> bool:
    """Whether bits are equal here and where something was recorded.

    Args:
        processor: The kind of processor there, such as `x86_64`; words before it, as
            for the system, are left out.
        machines: What is known of each machine; see `recording.machine`.
    """
    if processor.split()[-1:] != [provenance.log_versions()["machine"]]:
        return False
    here = _libc(machine())
    return all(_libc(found) in ("", here) for found in machines)


def _libc(found: Mapping[str, str]) -> str:
    return found.get("libc", "").split(" ")[0]


def _unfit(log: Log) -> str | None:
    """Return why a log cannot be simulated again here, if so."""
    if not log.finished:
        return f"{log.path}: unfinished: it broke off and has no result."
    here = provenance.log_versions()
    if log.versions.get("mujoco") != here["mujoco"]:
        return (
            f"{log.path}: recorded with mujoco {log.versions.get('mujoco')} but this "
            f"is mujoco {here['mujoco']}: states need not be equal bit for bit."
        )
    try:
        lie = first_lie(log.scene.certificate, proved_certificate(log.scene))
    except SceneError as error:
        lie = str(error)
    if lie is not None:
        return f"{log.path}: its scene: {lie}."
    regenerated = log.regenerated()
    if log.mjcf != regenerated:
        pairs = zip_longest(log.mjcf.splitlines(), regenerated.splitlines())
        line = next(k for k, (a, b) in enumerate(pairs, start=1) if a != b)
        return (
            f"{log.path}: the attached world differs from what its scene gives with "
            f"this version, first in line {line}."
        )
    return None


def _first_difference(log: Log, row: RowOf | None, exact: bool) -> str | None:
    """Record the episode again; return where the recordings first differ."""
    with tempfile.TemporaryDirectory(prefix="beacon-mj-") as folder:
        again = Path(folder) / "again.mcap"
        trace = rebuild_trace(log)
        repeated = _repeat(log, trace, again, row)
        if exact:
            return first_difference(log.path, again, rows=row is not None)
    return state_problem(log, trace, repeated, row)


def _repeat(log: Log, trace: Trace, again: Path, row: RowOf | None) -> Trace:
    """Run the logged commands, record what happens, and return it."""
    config = log.config.get("planner_config", "null")
    seed = log.config.get("planner_seed", "")
    if not re.fullmatch("[0-9]{1,16}", seed):
        raise LogError(f"{log.path}: expected a planner's seed but it is {seed!r}.")
    recorder = Recorder(
        again, planner_config=msgspec.Raw(config.encode()), seed=int(seed), row=row
    )
    return run_episode(
        trace.scene,
        _Script(trace),
        name=trace.planner,
        protocol=trace.protocol,
        seed=int(seed),
        listeners=[_Adopt(trace), recorder],
        left=trace.left,
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


class _Adopt:
    """Takes from the log what its commands cannot repeat: who gave them, and an end."""

    def __init__(self, logged: Trace) -> None:
        self._logged = logged

    def begin(self, trace: Trace, world: BaseWorld, observation: Observation) -> None:
        """Adopt whether the planner was told the truth, which the script is not."""
        trace.oracle = self._logged.oracle

    def step(
        self, record: StepRecord, world: BaseWorld, observation: Observation
    ) -> None:
        """Do nothing."""

    def end(self, trace: Trace) -> None:
        """Adopt the logged end where the commands ran out before one."""
        if trace.outcome == "planner_error" and self._logged.outcome in _UNREPEATABLE:
            trace.outcome, trace.detail = self._logged.outcome, self._logged.detail
