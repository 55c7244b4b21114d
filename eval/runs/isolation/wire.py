"""What crosses between an evaluation and an isolated planner.

Requests are pickled: the child trusts its parent. Replies are MessagePack of plain data
with checked types: whatever the child sends, nothing in the parent is run by it. Each
message is its length in four bytes, then itself.
"""

import pickle
import struct
import time
from dataclasses import replace
from typing import Any, NamedTuple

import msgspec
import numpy as np

from beacon_mj.eval.runs.isolation.connection import Connection
from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.interface import (
    Command,
    Contact,
    Observation,
    PlannerInfo,
    PushEvidence,
    Scan,
    SensedObstacle,
    Task,
)
from beacon_mj.planners.routes.graph import RouteGraph

REPLY_MAX_B = 16 * 2**20  #: Largest reply [bytes]; a path of 10 000 points has 160 kB.
_LENGTH = struct.Struct("!I")


class Describe(NamedTuple):
    """Load a planner and say what its configuration is."""

    serial: int
    spec: str
    settings: dict[str, str]
    name: str


class Reset(NamedTuple):
    """Build a planner anew and reset it."""

    serial: int
    spec: str
    settings: dict[str, str]
    name: str
    task: Task


class Tell(NamedTuple):
    """Keep the route graph of the scene that comes next, if it has one."""

    serial: int
    routes: RouteGraph | None


class NextDay(NamedTuple):
    """Have the planner that was built go on with the next day of its mission."""

    serial: int
    task: Task


class Act(NamedTuple):
    """Decide. `seen` and `again` are what changed since the last time."""

    serial: int
    scalars: tuple[int, float, float, float, int]
    planar: tuple[bytes, bytes, bytes]
    seen: list[tuple[Any, ...]]
    again: list[tuple[int, float, bool, bool]]
    contacts: list[tuple[str, bytes, float]]
    evidence: list[tuple[Any, ...]]
    turning: tuple[float | None, float | None]
    scan: tuple[bytes, float] | None


Request = Describe | Tell | Reset | NextDay | Act


class Ready(msgspec.Struct, frozen=True, array_like=True, tag=0):
    """The request is done; the rest is what `Describe` asks for.

    Attributes:
        serial: The request's number.
        config: All values of the configuration, as plain data.
        bit_reproducible: See `Planner`.
    """

    serial: int
    config: dict[str, Any] = {}
    bit_reproducible: bool = True


class Failed(msgspec.Struct, frozen=True, array_like=True, tag=1):
    """The planner failed; `raised` is whether it raised, `where` is `file:line`."""

    serial: int
    text: str
    raised: bool
    where: str = ""


class Decided(msgspec.Struct, frozen=True, array_like=True, tag=2):
    """A command; `path` is bytes of float64, shape (m, 2)."""

    serial: int
    velocity: tuple[float, float]
    give_up: bool
    action: str
    reason: str
    target: str | None
    cost_push: float | None
    cost_detour: float | None
    terms: dict[str, float]
    path: bytes | None
    beliefs: dict[str, tuple[float, float, float]]
    replanned: bool
    expansions: int
    turn_rate: float | None = None


Reply = Ready | Failed | Decided
_encoder = msgspec.msgpack.Encoder()
_decoder: msgspec.msgpack.Decoder[Reply] = msgspec.msgpack.Decoder(Reply)


class Channel(Connection):
    """One end of the connection."""

    def send_request(self, request: Request) -> None:
        """Send a request; TimeoutError after the limit."""
        self._send_whole(pickle.dumps(request, protocol=5))

    def receive_request(self) -> Request:
        """Wait for a request; EOFError if the parent is gone."""
        request: Request = pickle.loads(self._receive(2**32))
        return request

    def send_reply(self, reply: Reply) -> None:
        """Send a reply."""
        self._send_whole(_encoder.encode(reply))

    def receive_reply(self) -> Reply:
        """Return a reply of checked types.

        Raises:
            TimeoutError: After the limit.
            EOFError: If the other end is closed.
            ValueError: If it is no reply.
        """
        return _decoder.decode(self._receive(REPLY_MAX_B))

    def _send_whole(self, body: bytes) -> None:
        self._send(_LENGTH.pack(len(body)) + body)

    def _receive(self, most: int) -> bytes:
        began, head = time.monotonic(), _LENGTH.size
        data = self._part(began)
        while len(data) < head:
            data += self._part(began)
        (size,) = _LENGTH.unpack(data[:head])
        if size > most:
            raise ValueError(f"a message of {size} bytes")
        if len(data) < head + size:
            parts, have = [data], len(data)
            while have < head + size:
                parts.append(self._part(began))
                have += len(parts[-1])
            data = b"".join(parts)
        if len(data) > head + size:
            raise ValueError("more than one message")
        return data[head:]


class Changes:
    """Turns the observations of one episode into requests of what changed."""

    def __init__(self) -> None:
        """Start with nothing told."""
        self._told: list[SensedObstacle] = []

    def request(self, serial: int, now: Observation) -> Act:
        """Return the request that makes the other side's picture the present one."""
        told, seen, again = self._told, [], []
        for i, o in enumerate(now.obstacles):
            if i == len(told):
                told.append(o)
                seen.append(_fields(i, o))
            elif o is not told[i]:
                if o.footprint is told[i].footprint:
                    again.append((i, o.seen_s, o.visible, o.broken))
                else:
                    seen.append(_fields(i, o))
                told[i] = o
        return Act(
            serial,
            (now.step, now.time_s, now.battery, now.drive_effort, now.map_version),
            (
                now.position_m.tobytes(),
                now.velocity_mps.tobytes(),
                now.bumper_force_n.tobytes(),
            ),
            seen,
            again,
            [(c.id, c.normal.tobytes(), c.force_n) for c in now.contacts],
            [tuple(e) for e in now.evidence],
            (now.heading_rad, now.turn_rate_radps),
            None
            if now.scan is None
            else (now.scan.ranges_m.tobytes(), now.scan.range_max_m),
        )


class Picture:
    """Turns requests of what changed back into observations."""

    def __init__(self) -> None:
        """Start with nothing seen."""
        self._obstacles: list[SensedObstacle] = []
        self._stacked = Footprints()
        self._version = 0

    def observation(self, act: Act) -> Observation:
        """Return the observation that the parent has."""
        for fields in act.seen:
            self._place(fields[0], _obstacle(fields))
        for i, seen_s, visible, broken in act.again:
            self._place(i, _seen_again(self._obstacles[i], seen_s, visible, broken))
        step, time_s, battery, effort, version = act.scalars
        if version != self._version:
            self._version = version
            self._stacked = Footprints.stack([o.footprint for o in self._obstacles])
        position, velocity, bumper = (np.frombuffer(b) for b in act.planar)
        return Observation(
            step=step,
            time_s=time_s,
            position_m=position,
            velocity_mps=velocity,
            battery=battery,
            bumper_force_n=bumper,
            drive_effort=effort,
            obstacles=tuple(self._obstacles),
            footprints=self._stacked,
            map_version=version,
            contacts=tuple(
                Contact(name, np.frombuffer(normal), force)
                for name, normal, force in act.contacts
            ),
            evidence=tuple(PushEvidence(*e) for e in act.evidence),
            heading_rad=act.turning[0],
            turn_rate_radps=act.turning[1],
            scan=None if act.scan is None else _scan(*act.scan),
        )

    def _place(self, i: int, obstacle: SensedObstacle) -> None:
        if i == len(self._obstacles):
            self._obstacles.append(obstacle)
        else:
            self._obstacles[i] = obstacle


def decided(serial: int, command: Command) -> Decided:
    """Return a checked command as a reply."""
    info = command.info
    return Decided(
        serial,
        tuple(command.velocity_mps.tolist()),
        command.give_up,
        info.action,
        info.reason,
        info.target,
        info.cost_push,
        info.cost_detour,
        dict(info.terms),
        None if info.path_m is None else info.path_m.tobytes(),
        dict(info.beliefs),
        info.replanned,
        info.expansions,
        command.turn_rate_radps,
    )


def command_of(reply: Decided) -> Command:
    """Return a reply as a command; the episode's door checks it."""
    return Command(
        velocity_mps=np.array(reply.velocity),
        give_up=reply.give_up,
        info=PlannerInfo(
            action=reply.action,  # type: ignore[arg-type]
            reason=reply.reason,
            target=reply.target,
            cost_push=reply.cost_push,
            cost_detour=reply.cost_detour,
            terms=reply.terms,
            path_m=None if reply.path is None else _points(reply.path),
            beliefs=reply.beliefs,
            replanned=reply.replanned,
            expansions=reply.expansions,
        ),
        turn_rate_radps=reply.turn_rate,
    )


def _scan(ranges: bytes, range_max_m: float) -> Scan:
    return Scan(ranges_m=np.frombuffer(ranges), range_max_m=range_max_m)


def _points(data: bytes) -> Array:
    return np.frombuffer(data).reshape(-1, 2)


def _fields(i: int, o: SensedObstacle) -> tuple[Any, ...]:
    vertices = o.footprint.vertices
    return (
        i, o.id, vertices.shape, vertices.tobytes(), o.footprint.radius,
        o.centroid_m.tobytes(), o.height_m, o.volume_m3, o.density_kgm3, o.friction,
        o.scores, o.seen_s, o.visible, o.broken, o.kind,
    )  # fmt: skip


def _obstacle(fields: tuple[Any, ...]) -> SensedObstacle:
    _, name, shape, vertices, radius, centroid, height, volume, *rest = fields
    density, friction, scores, seen_s, visible, broken, kind = rest
    return SensedObstacle(
        id=name,
        footprint=Footprint(np.frombuffer(vertices).reshape(shape), radius),
        centroid_m=np.frombuffer(centroid),
        height_m=height,
        volume_m3=volume,
        density_kgm3=density,
        friction=friction,
        scores=scores,
        seen_s=seen_s,
        visible=visible,
        broken=broken,
        kind=kind,
    )


def _seen_again(
    o: SensedObstacle, seen_s: float, visible: bool, broken: bool
) -> SensedObstacle:
    return replace(o, seen_s=seen_s, visible=visible, broken=broken)
