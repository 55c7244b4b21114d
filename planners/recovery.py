"""What every planner does when it no longer moves: back off, then give up."""

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Command, Observation, PlannerInfo, Task

#: A robot that stays within this distance is not getting anywhere [m].
STALL_RADIUS_M = 0.05
#: How long it may stay there before that is called a stall [s].
STALL_S = 3.0
#: How long, and how fast, it drives away from what it is stuck at.
BACK_OFF_S = 0.5
BACK_OFF_MPS = 0.2
#: Stalls after which the planner gives up.
MAX_STALLS = 4


class Recovery:
    """Notices a stall and answers it with a short drive away from obstacles.

    Attributes:
        stalls: Stalls noticed so far.
        ended: Whether a back-off ended in the last call: the time to plan anew.
    """

    def __init__(self, task: Task) -> None:
        """Start watching at the task's start."""
        self._task = task
        self._anchor = task.start_m
        self._since_s = 0.0
        self._until_s = -1.0
        self.stalls = 0
        self.ended = False

    @property
    def exhausted(self) -> bool:
        """Whether backing off has been tried often enough."""
        return self.stalls > MAX_STALLS

    def restart(self, observation: Observation) -> None:
        """Start watching anew, after something else had the robot."""
        self._anchor, self._since_s = observation.position_m, observation.time_s
        self._until_s, self.ended = -1.0, False

    def command(self, observation: Observation) -> Command | None:
        """Return the command that backs off or gives up; None while all is well.

        Call it once per control step.
        """
        away = self.velocity(observation)
        if self.exhausted:
            return give_up(f"Got stuck {self.stalls} times.")
        if away is None:
            return None
        reason = "No progress: away from what is near."
        info = PlannerInfo(action="back_off", reason=reason)
        return Command(velocity_mps=away, info=info)

    def velocity(self, observation: Observation) -> Array | None:
        """Return the velocity that backs off, or None while all is well."""
        now, position = observation.time_s, observation.position_m
        backing = now < self._until_s
        self.ended = self._until_s > 0.0 and not backing
        if self.ended:
            self._until_s, self._since_s = -1.0, now
        if np.hypot(*(position - self._anchor)) > STALL_RADIUS_M:
            self._anchor, self._since_s = position.copy(), now
        elif not backing and now - self._since_s > STALL_S:
            self.stalls += 1
            self._until_s, backing = now + BACK_OFF_S - 1e-9, True
        return BACK_OFF_MPS * self._away(observation) if backing else None

    def _away(self, observation: Observation) -> Array:
        """Unit vector away from everything near, weighted by nearness."""
        position = observation.position_m
        west, south, east, north = self._task.workspace_m
        x, y = position
        walls = np.array([(west, y), (east, y), (x, south), (x, north)])
        near = np.concatenate([walls, observation.footprints.nearest_points(position)])
        offset = position - near
        distance = np.maximum(np.hypot(*offset.T), 1e-3)
        push = (offset / distance[:, None] ** 4).sum(axis=0)
        return np.asarray(push / max(float(np.hypot(*push)), 1e-12))


def give_up(reason: str) -> Command:
    """Return the command that ends the episode, and why."""
    info = PlannerInfo(action="give_up", reason=reason)
    return Command(velocity_mps=np.zeros(2), give_up=True, info=info)
