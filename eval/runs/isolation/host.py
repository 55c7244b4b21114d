"""Planners in processes of their own: Python's in a child, others as programs."""

import atexit
import json
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping
from typing import NamedTuple

from beacon_mj.episode.answers import PlannerFailure
from beacon_mj.episode.door import RESET_LIMITS
from beacon_mj.errors import PlannerError
from beacon_mj.eval.runs.isolation import wire
from beacon_mj.eval.runs.isolation.process import Elsewhere, Process
from beacon_mj.eval.runs.isolation.program import External, Program, describe_program
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.program import is_program
from beacon_mj.planners.routes.graph import RouteGraph, RoutePlanner

LOAD_S = 120.0  #: Time for a planner's file to be imported, to see what it is [s].
POSSIBLE = os.name == "posix"  #: Whether this system has what it takes.
MOST = 16  #: Processes that one worker keeps; of more, the longest unused ends.
_BOOT = """
import json, sys
path, end, parent, memory, with_parent = json.loads(sys.argv.pop())
sys.path[:] = path
from beacon_mj.eval.runs.isolation.child import main
main(end, parent, memory, end_with_parent=with_parent)
"""


class Who(NamedTuple):
    """What an isolated planner is made of.

    Attributes:
        spec: What it is loaded by.
        settings: Values given as text, in order.
        name: Its name in messages.
        memory_mib: Address space that it may take [MiB].
        folder: Where it runs.
    """

    spec: str
    settings: tuple[tuple[str, str], ...]
    name: str
    memory_mib: int
    folder: str


def here() -> str:
    """Return the folder of this process; empty if that is no more."""
    try:
        return os.getcwd()
    except OSError:
        return ""


class Child(Process):
    """A process that holds one planner in Python."""

    def __init__(self, memory_mib: int) -> None:
        """Prepare; nothing is started yet.

        Args:
            memory_mib: Address space that it may take [MiB].
        """
        super().__init__()
        self._memory_mib = memory_mib

    def _connect(self, ours: socket.socket) -> wire.Channel:
        return wire.Channel(ours)

    def _launch(
        self, theirs: socket.socket, end_with_parent: bool
    ) -> subprocess.Popen[bytes]:
        end, parent = theirs.fileno(), os.getpid()
        boot = [sys.path, end, parent, self._memory_mib, end_with_parent]
        return subprocess.Popen(
            [sys.executable, "-c", _BOOT, json.dumps(boot)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=(end,),
            start_new_session=True,  # No Ctrl-C of the terminal's reaches it.
        )


class Isolated(Elsewhere, RoutePlanner):
    """Stands for a planner in Python."""

    def __init__(self, process: Process, who: Who, limit_s: float) -> None:
        """Ask a process for the decisions of planner `who`, each within `limit_s`."""
        super().__init__(process, limit_s)
        self._who = who

    def set_routes(self, routes: RouteGraph | None) -> None:
        """Have the planner's process keep the route graph, if the scene has one."""
        self._process.start()
        request = wire.Tell(self._process.next_serial(), routes)
        self._begin(request, "start of an episode")

    def reset(self, task: Task) -> None:
        """Have the planner built and reset."""
        self._process.start()
        who, self._changes = self._who, wire.Changes()
        serial = self._process.next_serial()
        request = wire.Reset(serial, who.spec, dict(who.settings), who.name, task)
        self._begin(request, "end of reset()")

    def next_day(self, task: Task) -> None:
        """Have the planner that was built go on with the next day."""
        self._changes = wire.Changes()
        request = wire.NextDay(self._process.next_serial(), task)
        self._begin(request, "end of next_day()")

    def act(self, observation: Observation) -> Command:
        """Have the planner asked."""
        serial = self._process.next_serial()
        return self._decision(self._changes.request(serial, observation))


class _Kept(threading.local):
    """The processes of this thread, by planner."""

    def __init__(self) -> None:
        self.processes: dict[Who, Process] = {}


_kept = _Kept()


def isolated(who: Who, limit_s: float) -> Elsewhere:
    """Return a planner in its own process, the one that it had before if it lives."""
    kept = _kept.processes
    process = kept.pop(who, None) or _registered(_new(who))
    kept[who] = process
    if len(kept) > MOST:
        kept.pop(next(iter(kept))).end()
    if isinstance(process, Program):
        return External(process, who.settings, who.name, limit_s)
    return Isolated(process, who, limit_s)


def describe_isolated(
    spec: str, settings: Mapping[str, str], name: str, limit_s: float, memory_mib: int
) -> wire.Ready:
    """Return what a planner says of itself, without importing it here.

    Raises:
        PlannerError: If the planner cannot be loaded, or a setting is no good, or this
            system cannot isolate.
    """
    if not POSSIBLE:
        raise PlannerError(
            f"{spec}: a process of its own needs a POSIX system. Use --no-isolate."
        )
    if is_program(spec):
        return describe_program(spec, settings, name, memory_mib)
    child = Child(memory_mib)
    request = wire.Describe(child.next_serial(), spec, dict(settings), name)
    try:
        child.start()
        limit_s = min(LOAD_S, RESET_LIMITS * limit_s)
        reply = child.ask(request, "end of its import", limit_s)
    except PlannerFailure as failure:
        text = str(failure)
        prefix = "" if spec.split(":")[0] in text or name in text else f"{spec}: "
        raise PlannerError(f"{prefix}{text}") from failure
    finally:
        child.end()
    return reply if isinstance(reply, wire.Ready) else wire.Ready(request.serial)


def _new(who: Who) -> Process:
    if is_program(who.spec):
        return Program(who.spec, who.memory_mib)
    return Child(who.memory_mib)


def _registered(process: Process) -> Process:
    atexit.register(process.end)
    return process
