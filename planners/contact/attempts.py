"""What the loop remembers of its own pushes: who withstood, who was just moved."""

import math

from beacon_mj.interface import Observation, PushEvidence, SensedObstacle

_MAX_FAILURES = 2  #: Failed pushes of one obstacle before it counts as immovable.
_COOLDOWN_S = 3.0  #: Time for which an obstacle just pushed aside is left alone [s].


class Attempts:
    """Failed pushes of each obstacle, and when the last one ended."""

    def __init__(self, failures_last_s: float = math.inf) -> None:
        """Begin with no push.

        Args:
            failures_last_s: Time after which a failed push is forgotten [s].
        """
        self._failures_last_s = failures_last_s
        self._failures: dict[str, int] = {}
        self._failed_s: dict[str, float] = {}
        self._rests_until_s: dict[str, float] = {}
        self._earlier: frozenset[str] = frozenset()

    def overnight(self) -> "Attempts":
        """Return what is remembered of them on the next day, whose clock is at zero."""
        after = Attempts(self._failures_last_s)
        after._failures = dict(self._failures)
        after._earlier = frozenset(self._failures)
        return after

    def doubt(self) -> bool:
        """Forget failures of earlier days; return whether there were any."""
        old = self._earlier - self._failed_s.keys()
        for name in old:
            del self._failures[name]
        self._earlier = frozenset()
        return bool(old)

    def learn(self, evidence: PushEvidence) -> None:
        """Note what did not move under all the force there is."""
        if evidence.evidence == "not_moved":
            self._failures[evidence.id] = _MAX_FAILURES
            self._failed_s[evidence.id] = evidence.time_s

    def forget(self, now_s: float) -> None:
        """Forget the failures of what last failed too long ago.

        Args:
            now_s: Simulation time [s].
        """
        for name, failed_s in [*self._failed_s.items()]:
            if now_s - failed_s > self._failures_last_s:
                del self._failures[name], self._failed_s[name]

    def ended(
        self, obstacle_id: str, observation: Observation, *, failed: bool
    ) -> None:
        """Note that a push is over now."""
        if failed:
            self._failures[obstacle_id] = self._failures.get(obstacle_id, 0) + 1
            self._failed_s[obstacle_id] = observation.time_s
        self._rests_until_s[obstacle_id] = observation.time_s + _COOLDOWN_S

    def immovable(self, obstacle: SensedObstacle) -> bool:
        """Whether an obstacle counts as one that will not give way."""
        return self._failures.get(obstacle.id, 0) >= _MAX_FAILURES

    def rests(self, obstacle: SensedObstacle, observation: Observation) -> bool:
        """Whether an obstacle was pushed a moment ago."""
        return self._rests_until_s.get(obstacle.id, -1.0) > observation.time_s

    def any_rests(self, observation: Observation) -> bool:
        """Whether any obstacle was pushed a moment ago."""
        return any(
            self.rests(obstacle, observation) for obstacle in observation.obstacles
        )
