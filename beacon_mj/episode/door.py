"""The one door between an episode and its planner.

What goes in is sealed (`sealed`), what comes out is checked (`answers`), and whatever
else a planner does costs its own episode: every exception, `BaseException` included,
becomes a `PlannerFailure`. Only the user's own Ctrl-C or SIGTERM goes through.
"""

import time
from collections.abc import Callable, Mapping
from typing import Any

from beacon_mj.episode.answers import PlannerFailure, checked_command
from beacon_mj.episode.interrupts import (
    Overdue,
    begin_limit,
    end_limit,
    limited,
    raise_if_stopped,
)
from beacon_mj.episode.process_state import ProcessState
from beacon_mj.episode.sealed import Sealer, sealed_task
from beacon_mj.errors import describe
from beacon_mj.interface import Command, Drive, Observation, Probabilities, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.routes.graph import RouteGraph, RoutePlanner

#: Decision limits that a reset may take: compiling a planner's kernels is no decision.
RESET_LIMITS = 20


class Remote(Planner):
    """A planner that runs elsewhere.

    What it is told is copied on the way, and whoever runs it keeps its time limits.
    """


class Door:
    """One planner in one episode."""

    def __init__(self, planner: Planner, limit_s: float) -> None:
        """Stand between the episode and `planner`.

        Args:
            planner: Who decides.
            limit_s: Wall-clock time that a decision may take [s].
        """
        self._planner: Any = planner
        self._limit_s = limit_s
        self._remote = isinstance(planner, Remote)
        self._sealer = Sealer()
        self._state = ProcessState()
        self._sensed: dict[str, None] = {}
        self._beliefs: Mapping[str, Probabilities] = {}
        self._drive: Drive = "holonomic"

    def tell(self, routes: RouteGraph | None) -> None:
        """Tell a planner on the route graph which graph is next; others hear nothing.

        Args:
            routes: The graph; None in a scene without a certificate of learning.

        Raises:
            PlannerFailure: If the planner fails.
        """
        if isinstance(self._planner, RoutePlanner):
            self._call(self._planner.set_routes, RESET_LIMITS * self._limit_s, routes)

    def reset(self, task: Task, truth: object = None) -> None:
        """Start the planner on a task of its own.

        Args:
            task: The task.
            truth: What an oracle is told before; None for any other planner.

        Raises:
            PlannerFailure: If it fails.
        """
        self._begin(self._reset, task, truth)

    def next_day(self, task: Task, truth: object = None) -> None:
        """Start the planner on the next day of its mission; see `reset`.

        Raises:
            PlannerFailure: If it fails.
        """
        self._begin(self._next_day, task, truth)

    def decide(self, observation: Observation) -> tuple[Command, float]:
        """Return the checked command, and the wall-clock time of the decision [s].

        Raises:
            PlannerFailure: If the planner fails, is late, or its command is not sound.
        """
        for obstacle in observation.obstacles[len(self._sensed) :]:
            self._sensed[obstacle.id] = None
        if not self._remote:
            observation = self._sealer.observation(observation)
        command, seconds = self._call(self._decide, self._limit_s, observation)
        if seconds > self._limit_s:
            raise PlannerFailure(
                f"Expected a decision within {self._limit_s:g} s but it took "
                f"{seconds:.1f} s."
            )
        return command, seconds

    def close(self) -> None:
        """Put back what the planner did to the process."""
        self._state.restore()

    def _begin(self, call: Callable[..., Any], task: Task, truth: object) -> None:
        self._drive = task.drive
        given = task if self._remote else sealed_task(task)
        self._call(call, RESET_LIMITS * self._limit_s, given, truth)

    def _reset(self, task: Task, truth: object) -> None:
        if truth is not None:
            self._planner.set_truth(truth)
        self._planner.reset(task)

    def _next_day(self, task: Task, truth: object) -> None:
        if truth is not None:
            self._planner.set_truth(truth)
        self._planner.next_day(task)

    def _decide(self, observation: Observation) -> tuple[Command, float]:
        began = time.perf_counter()
        answer = self._planner.act(observation)
        seconds = time.perf_counter() - began
        command = checked_command(answer, self._sensed, self._beliefs, self._drive)
        self._beliefs = command.info.beliefs
        return command, seconds

    def _call(self, call: Callable[..., Any], limit_s: float, *given: object) -> Any:
        """Call what is the planner's, or runs code of its values."""
        outermost = not self._remote and begin_limit(limit_s)
        try:
            value = self._contained(call, *given)
        except Overdue:
            if not outermost:
                raise
            text = f"TimeoutError: no decision within {limit_s:g} s"
            raise PlannerFailure(text, raised=True) from None
        finally:
            if outermost:
                end_limit()
        raise_if_stopped()
        return value

    def _contained(self, call: Callable[..., Any], *given: object) -> Any:
        """Turn whatever is raised into a failure; its text is planner's code too."""
        try:
            return self._state.run(call, *given)
        except PlannerFailure:
            raise
        except BaseException as error:
            raise_if_stopped()
            if isinstance(error, Overdue) and limited():
                raise
            raise PlannerFailure(_why(error), raised=True) from None


def _why(error: BaseException) -> str:
    text = describe(error)
    if isinstance(error, SystemExit):
        return f"the planner tried to end the process: {text}"
    return text
