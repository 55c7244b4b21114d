"""Planners that are programs of their own: started by a command, asked in JSON."""

import dataclasses
import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterable, Mapping
from typing import Any

from beacon_mj.episode.answers import PlannerFailure
from beacon_mj.errors import PlannerError
from beacon_mj.eval.runs.isolation import lines, wire
from beacon_mj.eval.runs.isolation.process import START_S, Elsewhere, Process
from beacon_mj.eval.runs.overrides import convert
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import NoConfig
from beacon_mj.planners.program import found_program, program_words

#: Sets the limits of a process, and becomes the program.
_BOOT = """
import json, os, sys
path, words, parent, memory, with_parent = json.loads(sys.argv.pop())
sys.path[:] = path
from beacon_mj.process_limits import become
become(words, parent, memory, end_with_parent=with_parent)
"""


class Program(Process):
    """The process of a program: it reads requests from stdin and answers on stdout.

    Attributes:
        greeting: What it says of itself; set once it was started.
    """

    greeting: wire.Ready

    def __init__(
        self, spec: str, memory_mib: int, stderr: int | None = subprocess.DEVNULL
    ) -> None:
        """Prepare; nothing is started yet.

        Args:
            spec: `exec:COMMAND`.
            memory_mib: Address space that it may take [MiB].
            stderr: Where its stderr goes, as for `subprocess.Popen`.
        """
        super().__init__()
        self._words = program_words(spec)
        self._memory_mib, self._stderr = memory_mib, stderr

    def _connect(self, ours: socket.socket) -> lines.Channel:
        return lines.Channel(ours)

    def _launch(
        self, theirs: socket.socket, end_with_parent: bool
    ) -> subprocess.Popen[bytes]:
        parent = os.getpid()
        boot = [sys.path, self._words, parent, self._memory_mib, end_with_parent]
        return subprocess.Popen(
            [sys.executable, "-c", _BOOT, json.dumps(boot)],
            stdin=theirs.fileno(),
            stdout=theirs.fileno(),
            stderr=self._stderr,
            start_new_session=True,  # No Ctrl-C of the terminal's reaches it.
        )

    def _greet(self) -> None:
        reply = self.ask(lines.Hello(0), "answer to hello", START_S)
        if not isinstance(reply, wire.Ready):
            self.end()
            raise PlannerFailure("its process sent a reply that nobody asked for")
        self.greeting = reply


class External(Elsewhere):
    """Stands for a program."""

    Config = NoConfig

    def __init__(
        self,
        process: Program,
        settings: Iterable[tuple[str, str]],
        name: str,
        limit_s: float,
    ) -> None:
        """Ask a program for decisions.

        Args:
            process: Its process.
            settings: Values given as text.
            name: Its name in messages.
            limit_s: Time for a decision [s].
        """
        super().__init__(process, limit_s)
        self._program, self._settings, self._name = process, dict(settings), name

    def reset(self, task: Task) -> None:
        """Have the program start on a task."""
        self._program.start()
        config = configured(self._program.greeting.config, self._settings, self._name)
        request = lines.Reset(self._program.next_serial(), task, config)
        self._begin(request, "answer to reset")

    def next_day(self, task: Task) -> None:
        """Have the program go on with the next day."""
        request = lines.NextDay(self._program.next_serial(), task)
        self._begin(request, "answer to next_day")

    def act(self, observation: Observation) -> Command:
        """Have the program asked."""
        return self._decision(lines.Act(self._program.next_serial(), observation))


def describe_program(
    spec: str, settings: Mapping[str, str], name: str, memory_mib: int
) -> wire.Ready:
    """Return what a program says of itself, with some values set.

    Raises:
        PlannerError: If it cannot be started, does not greet, or a setting is no good.
    """
    found_program(spec)
    process = Program(spec, memory_mib)
    try:
        process.start()
        said = process.greeting
    except PlannerFailure as failure:
        raise PlannerError(f"{spec}: {failure}") from failure
    finally:
        process.end()
    config = configured(said.config, settings, name)
    return wire.Ready(0, config, said.bit_reproducible)


def configured(
    defaults: Mapping[str, Any], settings: Mapping[str, str], name: str
) -> dict[str, Any]:
    """Return a program's configuration with values given as text in it.

    Raises:
        PlannerError: If there is no such field, or a value is not of its default's
            type.
    """
    if not settings:
        return dict(defaults)
    for field in defaults:
        if not field.isidentifier():
            raise PlannerError(
                f"{name}: expected fields of its configuration to be words but one is "
                f"{field!r}."
            )
    fields = [
        (field, type(value), dataclasses.field(default=value))
        for field, value in defaults.items()
    ]
    made: type[Any] = dataclasses.make_dataclass("Config", fields, frozen=True)
    return dataclasses.asdict(convert(made, settings, name, PlannerError))
