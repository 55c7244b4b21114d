"""A planner that is built anew for each episode or mission, behind the door."""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

from beacon_mj.eval.runs.location import location, location_of
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle, Truth
from beacon_mj.planners.registry import load_planner
from beacon_mj.planners.routes.graph import RouteGraph, RoutePlanner


class Guarded(RoutePlanner):
    """Builds a planner in `reset`, so that a failing constructor costs an episode too.

    The truth about a world is passed on where the episode gives it, that is for a
    planner that its run's configuration calls an oracle, and for no other one. The
    route graph is passed on to planners on it.
    """

    Config: ClassVar[type[Any]] = dict

    def __init__(self, build: Callable[[], Planner]) -> None:
        """Guard the planner that `build` returns."""
        super().__init__({})
        self._build = build
        self._planner: Planner | None = None
        self._raised = ""
        self._truth: Truth | None = None

    def set_truth(self, truth: Truth) -> None:
        """Keep the truth until the planner is there."""
        self._truth = truth

    def set_routes(self, routes: RouteGraph | None) -> None:
        """Keep the route graph until it is known who asks."""
        self._routes = routes

    def reset(self, task: Task) -> None:
        """Build the planner and reset it."""
        try:
            planner = self._planner = self._build()
            if isinstance(planner, RoutePlanner):
                planner.set_routes(self._routes)
            if self._truth is not None and isinstance(planner, Oracle):
                planner.set_truth(self._truth)
            planner.reset(task)
        except BaseException as error:
            self._raised = location(error)
            raise

    def next_day(self, task: Task) -> None:
        """Start the planner that was built on the next day of its mission."""
        planner = self._planner
        assert planner is not None, "next_day() before reset()"
        try:
            if isinstance(planner, RoutePlanner):
                planner.set_routes(self._routes)
            if self._truth is not None and isinstance(planner, Oracle):
                planner.set_truth(self._truth)
            planner.next_day(task)
        except BaseException as error:
            self._raised = location(error)
            raise

    def act(self, observation: Observation) -> Command:
        """Ask the planner."""
        planner = self._planner
        assert planner is not None
        try:
            return planner.act(observation)
        except BaseException as error:
            self._raised = location(error)
            raise

    @property
    def where(self) -> str:
        """File and line at which the planner raised, or else where its `act` begins.

        Empty if neither is known.
        """
        return self._raised or location_of(self._planner, "act")


def planner_class(spec: str) -> type[Planner]:
    """Return a planner's class; that of a file anew if the file is another one."""
    path = Path(spec.rpartition(":")[0])
    if path.suffix != ".py" or not path.is_file():
        return _kept_class(spec)
    found = path.stat()
    return _kept_class(spec, str(path.resolve()), found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=64)
def _kept_class(spec: str, *stamp: object) -> type[Planner]:
    return load_planner(spec)[1]
