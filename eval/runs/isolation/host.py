"""The parent's side of an isolated planner: starts its process, and watches it.

The watchdog is a deadline on the connection. It needs nothing of the child, so it ends
loops that swallow exceptions, compiled loops and disarmed timers alike.
"""

import atexit
import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

from beacon_mj.episode.answers import PlannerFailure
from beacon_mj.episode.door import RESET_LIMITS, Remote
from beacon_mj.errors import PlannerError
from beacon_mj.eval.runs.isolation import wire
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.routes.graph import RouteGraph, RoutePlanner

START_S = 120.0  #: Time for an interpreter to start and import this package [s].
LOAD_S = 120.0  #: Time for a planner's file to be imported, to see what it is [s].
END_S = 10.0  #: Time for a process that was killed to be gone [s].
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


class Child:
    """A process that holds one planner; it is started when it is first needed."""

    def __init__(self, memory_mib: int) -> None:
        """Prepare; nothing is started yet."""
        self._memory_mib = memory_mib
        self._process: subprocess.Popen[bytes] | None = None
        self._serial = 0

    def next_serial(self) -> int:
        """Return the number of the next request."""
        self._serial += 1
        return self._serial

    def start(self) -> None:
        """Start the process unless it runs."""
        if self._process is not None:
            return
        ours, theirs = (_beside_streams(end) for end in socket.socketpair())
        in_main = threading.current_thread() is threading.main_thread()
        boot = [sys.path, theirs.fileno(), os.getpid(), self._memory_mib, in_main]
        with theirs:
            self._channel = wire.Channel(ours)
            self._process = subprocess.Popen(
                [sys.executable, "-c", _BOOT, json.dumps(boot)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
                start_new_session=True,  # No Ctrl-C of the terminal's reaches it.
            )
        self._channel.limit(START_S)
        self._receive(0, "start of its process", START_S)

    def ask(self, request: wire.Request, what: str, limit_s: float) -> wire.Reply:
        """Return the answer to a request; a child that gives none is ended.

        Args:
            request: The request.
            what: What is waited for, to follow "no".
            limit_s: Wall-clock time that it may take [s].

        Raises:
            PlannerFailure: If there is no answer, or it says that the planner failed.
        """
        try:
            self._channel.limit(limit_s)
            self._channel.send_request(request)
        except TimeoutError:
            self.end()
            raise _late(what, limit_s) from None
        except OSError:
            raise self._died() from None
        except BaseException:
            self.end()
            raise
        reply = self._receive(request.serial, what, limit_s)
        if isinstance(reply, wire.Failed):
            raise PlannerFailure(reply.text, raised=reply.raised, where=reply.where)
        return reply

    def end(self) -> int | None:
        """Kill the process, and those that it started; return its status."""
        process, self._process = self._process, None
        if process is None:
            return None
        self._channel.close()
        ended = process.poll()
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except (ProcessLookupError, PermissionError):
            process.kill()
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            return ended  # It hangs in the kernel; it is init's now.
        return ended

    def _receive(self, serial: int, what: str, limit_s: float) -> wire.Reply:
        try:
            reply = self._channel.receive_reply()
        except TimeoutError:
            self.end()
            raise _late(what, limit_s) from None
        except (EOFError, OSError):
            raise self._died() from None
        except BaseException as error:
            self.end()
            if isinstance(error, ValueError):
                raise PlannerFailure(f"its process sent no reply: {error}") from None
            raise
        if reply.serial != serial:
            self.end()
            raise PlannerFailure("its process sent a reply that nobody asked for")
        return reply

    def _died(self) -> PlannerFailure:
        """Return how the process came to its end."""
        status = self._status()
        self.end()
        if status is None:
            how = "it closed its connection"
        elif status < 0:
            how = signal.Signals(-status).name if -status < 32 else f"signal {-status}"
        else:
            how = f"exit status {status}"
        return PlannerFailure(f"the planner's process died: {how}", raised=True)

    def _status(self) -> int | None:
        assert self._process is not None
        try:
            return self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            return None


class Isolated(Remote, RoutePlanner):
    """Stands for a planner in a process of its own, which outlives its episodes.

    Attributes:
        where: File and line at which the planner failed, as far as its process told.
    """

    Config: ClassVar[type[Any]] = dict

    def __init__(self, child: Child, who: Who, limit_s: float) -> None:
        """Ask `child` for the decisions of planner `who`, each within `limit_s`."""
        super().__init__({})
        self._child, self._who, self._limit_s = child, who, limit_s
        self.where = ""

    def set_routes(self, routes: RouteGraph | None) -> None:
        """Have the planner's process keep the route graph, if the scene has one."""
        child = self._child
        child.start()
        request = wire.Tell(child.next_serial(), routes)
        self._ask(request, "start of an episode", RESET_LIMITS * self._limit_s)

    def reset(self, task: Task) -> None:
        """Have the planner built and reset."""
        child, who = self._child, self._who
        child.start()
        self._changes = wire.Changes()
        request = wire.Reset(
            child.next_serial(), who.spec, dict(who.settings), who.name, task
        )
        self._ask(request, "end of reset()", RESET_LIMITS * self._limit_s)

    def next_day(self, task: Task) -> None:
        """Have the planner that was built go on with the next day."""
        self._changes = wire.Changes()
        request = wire.NextDay(self._child.next_serial(), task)
        self._ask(request, "end of next_day()", RESET_LIMITS * self._limit_s)

    def act(self, observation: Observation) -> Command:
        """Have the planner asked."""
        request = self._changes.request(self._child.next_serial(), observation)
        reply = self._ask(request, "decision", self._limit_s)
        if not isinstance(reply, wire.Decided):
            raise PlannerFailure("its process sent a reply that nobody asked for")
        return wire.command_of(reply)

    def _ask(self, request: wire.Request, what: str, limit_s: float) -> wire.Reply:
        try:
            return self._child.ask(request, what, limit_s)
        except PlannerFailure as failure:
            self.where = failure.where
            raise


class _Kept(threading.local):
    """The processes of this thread, by planner."""

    def __init__(self) -> None:
        self.children: dict[Who, Child] = {}


_kept = _Kept()


def isolated(who: Who, limit_s: float) -> Isolated:
    """Return a planner in its own process, the one that it had before if it lives."""
    children = _kept.children
    child = children.pop(who, None) or _registered(Child(who.memory_mib))
    children[who] = child
    if len(children) > MOST:
        children.pop(next(iter(children))).end()
    return Isolated(child, who, limit_s)


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


def _beside_streams(end: socket.socket) -> socket.socket:
    """Return a socket whose number is no standard stream's, should one be closed."""
    import fcntl

    with end:
        number = fcntl.fcntl(end.fileno(), fcntl.F_DUPFD_CLOEXEC, 3)
    return socket.socket(fileno=number)


def _registered(child: Child) -> Child:
    atexit.register(child.end)
    return child


def _late(what: str, limit_s: float) -> PlannerFailure:
    return PlannerFailure(f"TimeoutError: no {what} within {limit_s:g} s", raised=True)
