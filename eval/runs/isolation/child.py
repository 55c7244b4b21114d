"""The process of an isolated planner: builds it, asks it, and answers for it."""

import importlib.abc
import math
import os
import socket
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

import msgspec

from beacon_mj.episode.answers import PlannerFailure
from beacon_mj.episode.door import Door
from beacon_mj.errors import BeaconError, PlannerError, describe, printable
from beacon_mj.eval.runs.isolation import wire
from beacon_mj.eval.runs.overrides import built_ins, configure
from beacon_mj.eval.runs.sandbox import Guarded, planner_class
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle
from beacon_mj.planners.routes.graph import RouteGraph
from beacon_mj.process_limits import end_with, limit_memory

#: Packages that hold the truth about a world, or make it from a seed.
TRUTH = (
    "beacon_mj.cli",
    "beacon_mj.eval",
    "beacon_mj.fidelity",
    "beacon_mj.gym",
    "beacon_mj.mjcf_templates",
    "beacon_mj.recording",
    "beacon_mj.rendering",
    "beacon_mj.scene",
    "beacon_mj.scene_gen",
    "beacon_mj.world",
)


def main(end: int, parent: int, memory_mib: int, *, end_with_parent: bool) -> None:
    """Serve requests until the parent hangs up.

    Args:
        end: File descriptor of this end of the connection.
        parent: The parent's process id.
        memory_mib: Address space that the planner may take beyond what is in use [MiB].
        end_with_parent: Whether the kernel ends this process with the parent's thread.
    """
    if end_with_parent:
        end_with(parent)
    limit_memory(memory_mib)
    sys.meta_path.insert(0, NoTruth())
    channel = wire.Channel(socket.socket(fileno=end))
    channel.send_reply(wire.Ready(0))
    served, planner = os.getpid(), _Planner()
    while True:
        try:
            request = channel.receive_request()
            reply = planner.answer(request)
            if os.getpid() != served:
                os._exit(0)  # The planner forked, and this is not the one.
            channel.send_reply(reply)
        except (EOFError, OSError):
            os._exit(0)  # Without the planner's own ideas of how to end.


class NoTruth(importlib.abc.MetaPathFinder):
    """Refuses imports of what a planner must not know.

    It stops what is done openly. It does not stop a planner that reads the files.
    """

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        """Refuse the packages in `TRUTH`; leave all others to the next finder."""
        if any(fullname == p or fullname.startswith(f"{p}.") for p in TRUTH):
            raise ModuleNotFoundError(
                f"{fullname} is out of reach of a planner in a process of its own: it "
                "leads to the truth about the world",
                name=fullname,
            )
        return None


class _Planner:
    """The planner of the episode, or mission, that goes on."""

    def __init__(self) -> None:
        self._door: Door | None = None
        self._guarded: Guarded | None = None
        self._picture = wire.Picture()
        self._routes: RouteGraph | None = None

    def answer(self, request: wire.Request) -> wire.Reply:
        """Do what is asked; whatever the planner raises is an answer too."""
        try:
            if isinstance(request, wire.Describe):
                return _described(request)
            if isinstance(request, wire.Tell):
                self._tell(request)
                return wire.Ready(request.serial)
            if isinstance(request, wire.Reset):
                self._reset(request)
                return wire.Ready(request.serial)
            if isinstance(request, wire.NextDay):
                self._next_day(request)
                return wire.Ready(request.serial)
            return self._act(request)
        except PlannerFailure as failure:
            return wire.Failed(
                request.serial, str(failure), failure.raised, self._where()
            )
        except BaseException as error:
            text = str(error) if isinstance(error, BeaconError) else describe(error)
            return wire.Failed(request.serial, printable(text), True)

    def _tell(self, request: wire.Tell) -> None:
        self._routes = request.routes
        if self._door is not None:
            self._door.tell(self._routes)

    def _reset(self, request: wire.Reset) -> None:
        self._picture = wire.Picture()
        self._guarded = Guarded(lambda: _build(request))
        self._door = Door(self._guarded, math.inf)
        self._door.tell(self._routes)
        self._door.reset(request.task)

    def _next_day(self, request: wire.NextDay) -> None:
        if self._guarded is None:
            raise PlannerFailure("Expected reset() before next_day().")
        self._picture = wire.Picture()
        self._door = Door(self._guarded, math.inf)
        self._door.next_day(request.task)

    def _act(self, request: wire.Act) -> wire.Reply:
        observation = self._picture.observation(request)
        if self._door is None:
            raise PlannerFailure("Expected reset() before act().")
        command, _ = self._door.decide(observation)
        return wire.decided(request.serial, command)

    def _where(self) -> str:
        return "" if self._guarded is None else self._guarded.where


def _described(request: wire.Describe) -> wire.Ready:
    """Return what a planner says of itself, as plain data."""
    cls = _class_of(request.spec)
    config = configure(cls, request.settings, request.name)
    plain = msgspec.msgpack.encode(built_ins(config))
    values = msgspec.msgpack.decode(plain, type=dict[str, Any])
    return wire.Ready(request.serial, values, cls.bit_reproducible is True)


def _build(request: wire.Reset) -> Planner:
    cls = _class_of(request.spec)
    return cls(configure(cls, request.settings, request.name))


def _class_of(spec: str) -> type[Planner]:
    """Return a planner's class, unless it is one that is told the truth."""
    cls = planner_class(spec)
    if issubclass(cls, Oracle):
        raise PlannerError(
            f"{spec}: is an oracle, which is told the truth, and so cannot run in a "
            "process of its own. Use --no-isolate."
        )
    return cls
