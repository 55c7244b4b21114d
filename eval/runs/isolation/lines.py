"""What crosses between an evaluation and a program: lines of JSON, one a message.

Version 1 of the protocol; docs/exec.md describes it, exec-v1.schema.json has every
field. Floats are written with as many digits as tell them apart, so they cross as they
are.
"""

import dataclasses
import time
from functools import cache
from typing import Any, NamedTuple

import msgspec
import numpy as np

import beacon_mj
from beacon_mj.errors import one_line
from beacon_mj.eval.runs.isolation import wire
from beacon_mj.eval.runs.isolation.connection import Connection
from beacon_mj.interface import Observation, Task

PROTOCOL = 1  #: Raised when a message or a field changes its name or meaning.
#: Of an observation, what says again what `obstacles` says.
LEFT_OUT = frozenset({"footprints"})

Value = bool | int | float | str  #: Of a program's configuration.
Point = tuple[float, float]


class Hello(NamedTuple):
    """Say which protocol is spoken, and what can be set."""

    serial: int


class Reset(NamedTuple):
    """Forget everything and start on a task."""

    serial: int
    task: Task
    config: dict[str, Value]


class NextDay(NamedTuple):
    """Start on the next day of the mission."""

    serial: int
    task: Task


class Act(NamedTuple):
    """Decide."""

    serial: int
    observation: Observation


Request = Hello | Reset | NextDay | Act


class Greeting(
    msgspec.Struct, frozen=True, tag_field="type", tag="hello",
    forbid_unknown_fields=True,
):  # fmt: skip
    """The answer to `hello`.

    Attributes:
        id: The message's number.
        protocol: Which version the program speaks.
        config: What can be set with `--set`, with its defaults.
        bit_reproducible: Whether it decides the same, bit for bit, each time.
    """

    id: int
    protocol: int
    config: dict[str, Value] = {}
    bit_reproducible: bool = True


class Ready(
    msgspec.Struct, frozen=True, tag_field="type", tag="ready",
    forbid_unknown_fields=True,
):  # fmt: skip
    """The answer to `reset` and `next_day`.

    Attributes:
        id: The message's number.
    """

    id: int


class Failed(
    msgspec.Struct, frozen=True, tag_field="type", tag="error",
    forbid_unknown_fields=True,
):  # fmt: skip
    """An answer to any message: the program failed, which costs the episode.

    Attributes:
        id: The message's number.
        text: Why, in one line.
    """

    id: int
    text: str


class Info(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Why a command was chosen; only log and metrics read it. See `PlannerInfo`.

    Attributes:
        action: move, detour, push, approach, back_off, follow or give_up.
        reason: One short sentence.
        target: Obstacle the action is about.
        cost_push: What the last push-or-detour comparison compared of the push.
        cost_detour: The same of the way round.
        terms: Named terms of the chosen candidate's objective.
        path_m: Planned path, points [m].
        beliefs: Probabilities of safe, movable, fragile, by obstacle.
        replanned: Whether the path was planned anew in this step.
        expansions: Vertices that all searches together expanded in this step.
    """

    action: str = "move"
    reason: str = ""
    target: str | None = None
    cost_push: float | None = None
    cost_detour: float | None = None
    terms: dict[str, float] = {}
    path_m: list[Point] | None = None
    beliefs: dict[str, tuple[float, float, float]] = {}
    replanned: bool = False
    expansions: int = 0


class Decision(
    msgspec.Struct, frozen=True, tag_field="type", tag="command",
    forbid_unknown_fields=True,
):  # fmt: skip
    """The answer to `act`.

    Attributes:
        id: The message's number.
        velocity_mps: Velocity for one control period, east and north [m/s]; one above
            the speed limit is scaled down. With a turn rate: forwards, and 0.
        give_up: Whether the program cannot go on; the episode ends.
        info: Why.
        turn_rate_radps: Turn rate, counter-clockwise, of a robot that turns; null
            leaves turning to the robot.
    """

    id: int
    velocity_mps: Point
    give_up: bool = False
    info: Info = Info()
    turn_rate_radps: float | None = None


Reply = Greeting | Ready | Failed | Decision
_decoder: msgspec.json.Decoder[Reply] = msgspec.json.Decoder(Reply)


class Channel(Connection):
    """The evaluation's end of the connection."""

    def send_request(self, request: Request) -> None:
        """Send a request; TimeoutError after the limit."""
        self._send(_encoder.encode(message(request)) + b"\n")

    def receive_reply(self) -> wire.Reply:
        """Return a reply of checked types.

        Raises:
            TimeoutError: After the limit.
            EOFError: If the other end is closed.
            ValueError: If it is no reply.
        """
        return parsed(self._line())

    def _line(self) -> bytes:
        """Return what comes next, up to the end of the line."""
        began, parts, size = time.monotonic(), [b""], 0
        while not parts[-1].endswith(b"\n"):
            parts.append(self._part(began))
            size += len(parts[-1])
            if size > wire.REPLY_MAX_B:
                raise ValueError("a line that does not end")
        line = b"".join(parts)
        if line.count(b"\n") > 1:
            raise ValueError(f"expected one line but there are more: {_shown(line)}")
        return line


def message(request: Request) -> dict[str, Any]:
    """Return a request as an object of JSON."""
    if isinstance(request, Hello):
        return {
            "type": "hello",
            "id": request.serial,
            "protocol": PROTOCOL,
            "beacon_mj": beacon_mj.__version__,
        }
    if isinstance(request, Reset):
        return {
            "type": "reset",
            "id": request.serial,
            "task": request.task,
            "config": request.config,
        }
    if isinstance(request, NextDay):
        return {"type": "next_day", "id": request.serial, "task": request.task}
    seen = request.observation
    told: dict[str, Any] = {name: getattr(seen, name) for name in _observed()}
    told["contacts"] = [contact._asdict() for contact in seen.contacts]
    told["evidence"] = [each._asdict() for each in seen.evidence]
    return {"type": "act", "id": request.serial, "observation": told}


def parsed(line: bytes) -> wire.Reply:
    """Return a line as a reply. Raises ValueError if it is none."""
    try:
        reply = _decoder.decode(line)
    except (msgspec.DecodeError, RecursionError) as error:
        raise ValueError(f"{error}: {_shown(line)}") from error
    if isinstance(reply, Greeting):
        if reply.protocol != PROTOCOL:
            raise ValueError(
                f"expected protocol {PROTOCOL} but it speaks {reply.protocol}"
            )
        return wire.Ready(reply.id, dict(reply.config), reply.bit_reproducible)
    if isinstance(reply, Ready):
        return wire.Ready(reply.id)
    if isinstance(reply, Failed):
        return wire.Failed(reply.id, reply.text, raised=True)
    return _decided(reply)


def _decided(reply: Decision) -> wire.Decided:
    info = reply.info
    path = None if info.path_m is None else np.array(info.path_m, np.float64).tobytes()
    return wire.Decided(
        reply.id,
        reply.velocity_mps,
        reply.give_up,
        info.action,
        info.reason,
        info.target,
        info.cost_push,
        info.cost_detour,
        info.terms,
        path,
        info.beliefs,
        info.replanned,
        info.expansions,
        reply.turn_rate_radps,
    )


@cache
def _observed() -> tuple[str, ...]:
    """Return the fields of an observation that cross."""
    names = (field.name for field in dataclasses.fields(Observation))
    return tuple(name for name in names if name not in LEFT_OUT)


def _plain(value: Any) -> Any:
    """Return an array, or a number of NumPy's, as JSON has it."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    # What msgspec asks of a hook that does not know a type.
    raise NotImplementedError(f"a {type(value).__name__} is no plain data")


_encoder = msgspec.json.Encoder(enc_hook=_plain)


def _shown(line: bytes) -> str:
    return repr(one_line(line.decode(errors="replace"), 100))
