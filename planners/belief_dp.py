"""The optimum over all policies that learn, driven in MuJoCo: a reference planner."""

from dataclasses import dataclass
from functools import lru_cache

from beacon_mj.interface import Task
from beacon_mj.learning import (
    DoorPart,
    PartPolicy,
    optimistic_s,
    world_posterior,
)
from beacon_mj.planners.routes.policy import (
    RouteConfig,
    RouteContactPlanner,
    RoutePolicy,
)
from beacon_mj.planners.routes.progress import RouteProgress


@dataclass(frozen=True, kw_only=True, slots=True)
class BeliefDpConfig(RouteConfig):
    """Parameters of `BeliefDp`."""

    #: Whether it learns from stage to stage; if not, it is the memoryless optimum.
    updating: bool = True


class BeliefDpPolicy(RoutePolicy[BeliefDpConfig]):
    """The policy of the certificate's `updating_s`, or of its `memoryless_s`."""

    Config = BeliefDpConfig

    def start(self, task: Task, learned: dict[str, bool]) -> None:
        """Start with no plan made."""
        super().start(task, learned)
        self._plan = lru_cache(maxsize=None)(self._planned)

    @property
    def remembers(self) -> bool:
        """Whether what was learned is kept on the next day of a mission."""
        return self.config.updating

    def rank(self, progress: RouteProgress) -> dict[int, float]:
        """Return the expected time of the optimum for the door it tries [s].

        Where the prior holds what was seen for impossible, optimism decides.
        """
        ref = progress.stage
        assert ref is not None
        part, failed = progress.routes.part(ref), progress.failed
        before = progress.outcomes(ref.part, of_stage=False)
        if not self.config.updating:
            before = {}
        tried = {part.stages[ref.stage].doors[i]: False for i in failed}
        if world_posterior(part, before | tried) is None or len(failed) == len(
            part.stages[ref.stage].doors
        ):
            stage = progress.routes.stage(ref)
            return optimistic_s(stage, progress.at, progress.shut)
        # Who remembers nothing of earlier stages plans as if there had been none.
        first = 0 if before else ref.stage
        policy = self._plan(ref.part, first)
        state = ref.stage - first, progress.at, failed, policy.evidence(before)
        return {policy.choose(*state): policy.expected_from(*state)}

    def _planned(self, part: int, first: int) -> PartPolicy:
        """Return the optimal policy of a part from a stage on, or for that stage."""
        problem = self.progress.routes.problem
        own = problem.parts[part]
        last = None if self.config.updating else first + 1
        left = DoorPart(
            stages=own.stages[first:last], weights=own.weights, opens=own.opens
        )
        return PartPolicy(left, problem.fail_s, problem.pass_s)


class BeliefDp(RouteContactPlanner[BeliefDpConfig]):
    """The updating optimum of the certificate, with the controller of all others.

    V(b, d, F, e) = min_i t(d, i) + P_i (t_pass + t_cross(i) + V(b + 1, entry, {}, e_i))
                                  + (1 - P_i) (t_fail + V(b, i, F + {i}, e))

    over stages b, places d, doors F that failed in the stage, and evidence e of earlier
    ones, with P_i the exact posterior probability that door i opens; see
    `beacon_mj.learning.policy`. No policy takes less time on the route graph in
    expectation, so what another planner loses to it is lost by its decisions. With
    `updating=false` it is the best policy that carries nothing from stage to stage. The
    prior and the graph are told; what is true of this scene's doors is not.
    """

    Policy = BeliefDpPolicy
