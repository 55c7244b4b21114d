"""What is unknown is open: the optimistic Canadian traveller, a reference planner."""

from beacon_mj.learning import optimistic_s
from beacon_mj.planners.routes.policy import (
    RouteConfig,
    RouteContactPlanner,
    RoutePolicy,
)
from beacon_mj.planners.routes.progress import RouteProgress


class CtpOptimistPolicy(RoutePolicy[RouteConfig]):
    """The shortest way through a door that did not fail."""

    Config = RouteConfig

    def rank(self, progress: RouteProgress) -> dict[int, float]:
        """Return the time through each door, if it opens [s]."""
        assert progress.stage is not None
        stage = progress.routes.stage(progress.stage)
        return optimistic_s(stage, progress.at, progress.shut)


class CtpOptimist(RouteContactPlanner[RouteConfig]):
    """Takes every door for open that it has not found shut.

    With d where the robot is, t the drive times of the route graph,

        i* = argmin_i t(d, i) + t_cross(i),

    over the doors that did not fail. It is told the graph and uses no prior. This is
    the optimistic policy of the Canadian traveller problem (Papadimitriou and
    Yannakakis 1991; OMT in Eyerich, Keller and Helmert 2010), and what D* Lite does on
    a grid.
    """

    Policy = CtpOptimistPolicy
