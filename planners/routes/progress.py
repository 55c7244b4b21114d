"""How far a robot has come on the route graph, and what it knows of the doors."""

from collections.abc import Mapping

from beacon_mj.learning import ENTRY
from beacon_mj.planners.routes.graph import RouteGraph, StageRef


class RouteProgress:
    """The stage that the robot is in, the doors that failed there, and all outcomes.

    A stage is over as soon as one of its doors has opened: the robot then decides for
    the next one.

    Attributes:
        routes: The graph.
        learned: Whether each door that was tried opened, by its id.
        at: Where the robot is: `ENTRY`, or the place of the door that it is before.
    """

    def __init__(self, routes: RouteGraph, learned: Mapping[str, bool]) -> None:
        """Begin before the first stage of the day, knowing what `learned` holds."""
        self.routes = routes
        self.learned = {**learned}
        self.at = ENTRY
        self._names = [routes.names(ref) for ref in routes.today]
        self._turn = 0
        self._failed: list[set[int]] = [set() for _ in routes.today]
        self._before = {**learned}

    @property
    def stage(self) -> StageRef | None:
        """The stage that the robot is in; None behind the last one."""
        return self.routes.today[self._turn] if self._turn < len(self._names) else None

    @property
    def names(self) -> tuple[str, ...]:
        """Ids of the doors of the present stage; none behind the last one."""
        return self._names[self._turn] if self._turn < len(self._names) else ()

    @property
    def failed(self) -> frozenset[int]:
        """Places of the doors that failed in the present stage."""
        if self._turn == len(self._names):
            return frozenset()
        return frozenset(self._failed[self._turn])

    @property
    def shut(self) -> frozenset[int]:
        """Places of those that failed in it, or earlier."""
        known = [self.learned.get(name) for name in self.names]
        return self.failed | {i for i, opens in enumerate(known) if opens is False}

    def outcomes(self, part: int, *, of_stage: bool) -> dict[int, bool]:
        """Return the outcomes of a part's doors, by their numbers.

        Args:
            part: The part.
            of_stage: Whether to include what was learned in the present stage.
        """
        known = self.learned if of_stage else self._before
        ids = self.routes.doors[part]
        return {n: known[name] for n, name in enumerate(ids) if name in known}

    def met(self, name: str) -> bool:
        """Whether a door belongs to the present stage or one before it."""
        return any(name in names for names in self._names[: self._turn + 1])

    def opened(self, name: str) -> None:
        """Note that a door has opened; if it is the present stage's, that is over."""
        self.learned[name] = True
        if name in self.names:
            self._turn, self.at = self._turn + 1, ENTRY
            self._before = {**self.learned}

    def withstood(self, name: str) -> None:
        """Note that a door has not opened; one that seemed to is met again."""
        turn = self._turn
        if self.learned.get(name) and name not in self.names:
            turn = next(
                (k for k, own in enumerate(self._names[:turn]) if name in own), turn
            )
        self.learned[name] = False
        self._turn = turn
        if name in self.names:
            self.at = self.names.index(name)
            self._failed[turn].add(self.at)
