"""Averages of clairvoyant costs: hindsight optimisation, a reference planner."""

from dataclasses import dataclass

import numpy as np

from beacon_mj.interface import Task
from beacon_mj.learning import hindsight_s, optimistic_s
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.routes.policy import (
    RouteConfig,
    RouteContactPlanner,
    RoutePolicy,
)
from beacon_mj.planners.routes.progress import RouteProgress


@dataclass(frozen=True, kw_only=True, slots=True)
class CtpHindsightConfig(RouteConfig):
    """Parameters of `CtpHindsight`."""

    #: Worlds that are sampled for a decision.
    samples: int = 200

    def __post_init__(self) -> None:
        """Check the range.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_between("samples", self.samples, 1, 10**6)


class CtpHindsightPolicy(RoutePolicy[CtpHindsightConfig]):
    """The least average over what would have been best in each sampled world."""

    Config = CtpHindsightConfig

    def start(self, task: Task, learned: dict[str, bool]) -> None:
        """Start with the task's stream of randomness."""
        super().start(task, learned)
        self._rng = np.random.default_rng(task.seed)

    def rank(self, progress: RouteProgress) -> dict[int, float]:
        """Return Q(i) of each door [s]; optimism where no world is possible."""
        ref, routes = progress.stage, progress.routes
        assert ref is not None
        shut = progress.shut
        costs = hindsight_s(
            routes.problem,
            routes.part(ref),
            ref.stage,
            progress.at,
            shut,
            progress.outcomes(ref.part, of_stage=True),
            samples=self.config.samples,
            rng=self._rng,
        )
        return costs or optimistic_s(routes.stage(ref), progress.at, shut)


class CtpHindsight(RouteContactPlanner[CtpHindsightConfig]):
    """Hindsight optimisation on the route graph.

    It samples n worlds from the posterior given all pushes so far, and tries the door
    with the least

        Q(i) = t(d, i) + 1/n sum_k c_k(i),

    c_k(i) the least time from before door i to the exit for somebody who knows world k,
    a push that fails included. Since that somebody knows, nothing is to be learned:
    the policy never probes (Eyerich, Keller and Helmert 2010, there HOP).
    """

    Policy = CtpHindsightPolicy
