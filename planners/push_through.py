"""Straight to the goal, whatever stands there: the lower bound of every table."""

from dataclasses import dataclass

import numpy as np

from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.recovery import STALL_RADIUS_M, give_up

#: Time without progress after which nothing will give way any more [s].
PATIENCE_S = 10.0


@dataclass(frozen=True, kw_only=True, slots=True)
class PushThroughConfig:
    """How `PushThrough` drives."""

    #: Share of the speed limit at which it drives, in (0, 1].
    speed_share: float = 1.0

    def __post_init__(self) -> None:
        """Check the range.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_between("speed_share", self.speed_share, 0.01, 1.0)


class PushThrough(Planner[PushThroughConfig]):
    """v = share v_max (goal - x) / ||goal - x||, slower only to stop at the goal.

    It uses nothing that is sensed, and gives up once nothing has given way for
    `PATIENCE_S`. What it breaks, and where it gets stuck, is what a planner gains by
    looking.
    """

    Config = PushThroughConfig

    def reset(self, task: Task) -> None:
        """Take note of the goal."""
        self._task = task
        self._anchor, self._since_s = task.start_m, 0.0

    def act(self, observation: Observation) -> Command:
        """Drive at the goal."""
        task = self._task
        if self._stalled(observation):
            return give_up("Nothing gives way any more.")
        offset = task.goal_m - observation.position_m
        distance = float(np.hypot(*offset))
        limit = self.config.speed_share * task.speed_mps
        speed = min(limit, distance / task.control_period_s)
        return Command(
            velocity_mps=offset * (speed / max(distance, 1e-9)),
            info=PlannerInfo(
                reason="Straight to the goal.",
                path_m=np.array([observation.position_m, task.goal_m]),
            ),
        )

    def _stalled(self, observation: Observation) -> bool:
        """Whether the robot has stayed in one place for too long."""
        if np.hypot(*(observation.position_m - self._anchor)) > STALL_RADIUS_M:
            self._anchor = observation.position_m.copy()
            self._since_s = observation.time_s
        return observation.time_s - self._since_s > PATIENCE_S
