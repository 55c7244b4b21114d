"""The parent's side of an isolated planner: starts its process, and watches it.

The watchdog is a deadline on the connection. It needs nothing of the process, so it
ends loops that swallow exceptions, compiled loops and disarmed timers alike.
"""

import os
import signal
import socket
import subprocess
import threading
from abc import ABC, abstractmethod
from typing import Any, ClassVar
from typing import Protocol as Interface

from beacon_mj.episode.answers import PlannerFailure
from beacon_mj.episode.door import RESET_LIMITS, Remote
from beacon_mj.eval.runs.isolation import wire
from beacon_mj.interface import Command

START_S = 120.0  #: Time for an interpreter to start and import this package [s].
END_S = 10.0  #: Time for a process that was killed to be gone [s].


class Channel(Interface):
    """One end of a connection: how requests and replies are written is its matter."""

    def limit(self, limit_s: float) -> None:
        """Have every transfer from now on take at most `limit_s`."""

    def send_request(self, request: Any) -> None:
        """Send a request; TimeoutError after the limit."""

    def receive_reply(self) -> wire.Reply:
        """Return a reply; TimeoutError, EOFError, or ValueError if it is none."""

    def close(self) -> None:
        """Close this end."""


class Process(ABC):
    """A process that holds one planner; it is started when it is first needed."""

    def __init__(self) -> None:
        """Prepare; nothing is started yet."""
        self._process: subprocess.Popen[bytes] | None = None
        self._channel: Channel
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
        with theirs:
            self._channel = self._connect(ours)
            self._process = self._launch(theirs, in_main)
        self._channel.limit(START_S)
        self._greet()

    @abstractmethod
    def _connect(self, ours: socket.socket) -> Channel:
        """Return what is spoken over this end of the connection."""

    @abstractmethod
    def _launch(
        self, theirs: socket.socket, end_with_parent: bool
    ) -> subprocess.Popen[bytes]:
        """Start the process, with the other end, in a session of its own.

        Args:
            theirs: The other end.
            end_with_parent: Whether the kernel may end it with this thread.
        """

    def _greet(self) -> None:
        """Wait until it is ready."""
        self._receive(0, "start of its process", START_S)

    def ask(self, request: Any, what: str, limit_s: float) -> wire.Reply:
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


class Elsewhere(Remote):
    """Stands for a planner in a process of its own, which outlives its episodes.

    Attributes:
        where: File and line at which the planner failed, as far as its process told.
    """

    Config: ClassVar[type[Any]] = dict

    def __init__(self, process: Process, limit_s: float) -> None:
        """Ask a process for decisions, each within `limit_s`."""
        super().__init__({})
        self._process, self._limit_s = process, limit_s
        self.where = ""

    def _begin(self, request: Any, what: str) -> None:
        """Ask for what is no decision."""
        self._ask(request, what, RESET_LIMITS * self._limit_s)

    def _decision(self, request: Any) -> Command:
        reply = self._ask(request, "decision", self._limit_s)
        if not isinstance(reply, wire.Decided):
            raise PlannerFailure("its process sent a reply that nobody asked for")
        return wire.command_of(reply)

    def _ask(self, request: Any, what: str, limit_s: float) -> wire.Reply:
        try:
            return self._process.ask(request, what, limit_s)
        except PlannerFailure as failure:
            self.where = failure.where
            raise


def _beside_streams(end: socket.socket) -> socket.socket:
    """Return a socket whose number is no standard stream's, should one be closed."""
    import fcntl

    with end:
        number = fcntl.fcntl(end.fileno(), fcntl.F_DUPFD_CLOEXEC, 3)
    return socket.socket(fileno=number)


def _late(what: str, limit_s: float) -> PlannerFailure:
    return PlannerFailure(f"TimeoutError: no {what} within {limit_s:g} s", raised=True)
