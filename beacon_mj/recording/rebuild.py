"""From a log back to the trace of its episode, exactly."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, get_args

import numpy as np

from beacon_mj.episode.answers import PATH_POINTS
from beacon_mj.episode.trace import Outcome, StepRecord, Trace
from beacon_mj.errors import LogError
from beacon_mj.geometry import Array
from beacon_mj.interface import (
    Action,
    Command,
    Evidence,
    PlannerInfo,
    Probabilities,
)
from beacon_mj.recording.reader import Log, read_log
from beacon_mj.world.outcome import Damage, Displacement, PairForce, StepOutcome
from beacon_mj.world.pushes import AttemptEnd

#: Points of paths that are put together from two parts, in all steps of an episode.
MAX_POINTS = 20_000_000


def read_trace(path: str | Path) -> Trace:
    """Return the trace of a logged episode; see `rebuild_trace`."""
    return rebuild_trace(read_log(path))


def rebuild_trace(log: Log) -> Trace:
    """Return the trace from which every metric can be computed again.

    It equals the live one bit for bit but for wall-clock times, which are zero. The
    outcome of an unfinished log is None.

    Raises:
        LogError: If the log holds something that no episode writes.
    """
    try:
        return _Rebuild(log).trace()
    except (LookupError, StopIteration) as error:
        raise LogError(
            f"{log.path}: expected consistent messages but one names or needs what is "
            f"not there: {error}."
        ) from error


class _Rebuild:
    """Walks through the steps of a log once."""

    def __init__(self, log: Log) -> None:
        self._log = log
        self._ids = {o.id: o.id for o in log.scene.obstacles}
        self._decisions = _Latest(log.messages["/decision"])
        self._plan = _Latest(log.messages["/plan"])
        self._belief = _Latest(log.messages["/belief"])
        self._decision: Any = None
        self._terms: dict[str, float] = {}
        self._points = np.zeros((0, 2))
        self._copied = 0
        self._beliefs: dict[str, Probabilities] = {}
        self._turns = _by_time(log, "/turn")
        self._contacts = _by_time(log, "/contacts")
        self._pushes = _by_time(log, "/push")
        self._damages = _by_time(log, "/damage")

    def trace(self) -> Trace:
        """Return the whole trace."""
        log = self._log
        start, *steps = log.messages["/step"]
        commands = log.messages["/command"]
        if len(steps) != len(commands):
            raise LogError(
                f"{log.path}: expected one command per step but there are "
                f"{len(commands)} for {len(steps)} steps."
            )
        trace = Trace(
            planner=log.planner,
            scene=log.scene,
            protocol=log.protocol,
            oracle=log.config.get("oracle") == "true",
            start_m=_planar(start[1].position_m),
            left=log.left,
            suite=log.config.get("suite") or None,
            first_sensed=tuple(start[1].newly_sensed),
        )
        trace.steps = [
            self._record(command, step)
            for command, step in zip(commands, steps, strict=True)
        ]
        if log.finished:
            self._end(trace)
        return trace

    def _end(self, trace: Trace) -> None:
        result = self._log.result
        outcome = _one_of(Outcome, result.get("outcome", ""), self._log.path)
        if result.get("steps") != str(len(trace.steps)):
            raise LogError(
                f"{self._log.path}: expected {result.get('steps')} steps, as its "
                f"result says, but there are {len(trace.steps)}."
            )
        trace.outcome = outcome
        trace.detail = result.get("detail", "")

    def _record(self, command: tuple[int, Any], step: tuple[int, Any]) -> StepRecord:
        return StepRecord(
            command=Command(
                velocity_mps=_planar(command[1].velocity_mps),
                info=self._info(*command),
                turn_rate_radps=self._turn(command[0]),
            ),
            outcome=self._outcome(*step),
            battery=step[1].battery,
            newly_sensed=tuple(step[1].newly_sensed),
            decision_s=0.0,
        )

    def _turn(self, time_ns: int) -> float | None:
        found = self._turns.get(time_ns)
        return found[0].turn_rate_radps if found else None

    def _info(self, time_ns: int, command: Any) -> PlannerInfo:
        if (found := self._decisions.until(time_ns)) is not None:
            self._decision = found
            self._terms = {term.name: term.value for term in found.terms}
        if (decision := self._decision) is None:
            raise LookupError("no decision before the first command")
        if (plan := self._plan.until(time_ns)) is not None:
            self._points = _rows(p.position for p in plan.poses)
        if (belief := self._belief.until(time_ns)) is not None:
            self._beliefs = {
                self._ids[b.obstacle]: (b.safe, b.movable, b.fragile)
                for b in belief.obstacles
            }
        return PlannerInfo(
            action=_one_of(Action, decision.action, self._log.path),
            reason=decision.reason,
            target=_optional(decision, "target"),
            cost_push=_optional(decision, "cost_push"),
            cost_detour=_optional(decision, "cost_detour"),
            terms=self._terms,
            path_m=self._path(command),
            beliefs=self._beliefs,
            replanned=decision.replanned,
            expansions=decision.expansions,
        )

    def _path(self, command: Any) -> Array | None:
        """Return the path: a few points of its own, then the end of the plan."""
        if not command.has_path:
            return None
        first = len(self._points) - command.path_tail
        if first < 0:
            raise IndexError(f"{command.path_tail} points of a shorter plan")
        if not command.path_head:
            return self._points[first:]
        path = np.vstack([_rows(command.path_head), self._points[first:]])
        self._copied += len(path)
        if len(path) > PATH_POINTS or self._copied > MAX_POINTS:
            raise IndexError(f"a path of {len(path)} points")
        return path

    def _outcome(self, time_ns: int, step: Any) -> StepOutcome:
        return StepOutcome(
            step=step.step,
            time_s=step.time_s,
            position_m=_planar(step.position_m),
            velocity_mps=_planar(step.velocity_mps),
            bumper_force_n=_planar(step.bumper_force_n),
            drive_effort=step.drive_effort,
            actuator_work_j=step.actuator_work_j,
            contacts=tuple(
                _pair_force(c)
                for message in self._contacts.get(time_ns, ())
                for c in message.contacts
            ),
            attempts=tuple(self._attempt(p) for p in self._pushes.get(time_ns, ())),
            displacements=tuple(
                Displacement(self._ids[d.obstacle], d.distance_m, tuple(d.chain))
                for d in step.displacements
            ),
            damages=tuple(
                Damage(self._ids[d.obstacle], d.counterpart, d.force_n, d.time_s)
                for d in self._damages.get(time_ns, ())
            ),
            toppled=tuple(step.toppled),
        )

    def _attempt(self, push: Any) -> AttemptEnd:
        return AttemptEnd(
            self._ids[push.obstacle],
            _one_of(Evidence, push.evidence, self._log.path),
            push.force_n,
            push.began_s,
            push.ended_s,
        )


class _Latest:
    """The last message of a topic that is written only on change."""

    def __init__(self, messages: list[tuple[int, Any]]) -> None:
        self._messages = messages
        self._next = 0

    def until(self, time_ns: int) -> Any | None:
        """Return the newest message up to a time, if it is new since the last call."""
        found = None
        while (
            self._next < len(self._messages)
            and self._messages[self._next][0] <= time_ns
        ):
            found = self._messages[self._next][1]
            self._next += 1
        return found


def _by_time(log: Log, topic: str) -> Mapping[int, list[Any]]:
    out: dict[int, list[Any]] = {}
    for time_ns, found in log.messages[topic]:
        out.setdefault(time_ns, []).append(found)
    return out


def _pair_force(c: Any) -> PairForce:
    return PairForce(
        c.obstacle,
        c.counterpart,
        np.array((c.force_n.x, c.force_n.y, c.force_n.z)),
        np.array((c.point_m.x, c.point_m.y, c.point_m.z)),
        c.filtered_n,
        c.peak_n,
        c.filtered_peak_n,
        c.impulse_ns,
    )


def _planar(vector: Any) -> Array:
    return np.array((vector.x, vector.y))


def _rows(points: Iterable[Any]) -> Array:
    """Return points as an array, shape (m, 2)."""
    return np.array([(p.x, p.y) for p in points], np.float64).reshape(-1, 2)


def _optional(found: Any, name: str) -> Any:
    return getattr(found, name) if found.HasField(name) else None


def _one_of(literal: Any, value: str, path: Path) -> Any:
    """Return `value` if it is one of a Literal's."""
    known = get_args(literal)
    if value not in known:
        raise LogError(f"{path}: expected one of {known} but it was {value!r}.")
    return value
