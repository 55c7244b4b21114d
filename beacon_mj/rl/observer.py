"""Observations as arrays, for environments and for planners that were trained there."""

from typing import Any

import numpy as np

from beacon_mj.errors import PlannerError, RunError
from beacon_mj.geometry import Array
from beacon_mj.interface import Observation, Task
from beacon_mj.rl.parts import Goal, Nearest, Part, Robot, Sweep, Values, Walls

NEAREST = 8  #: Obstacles in an observation.


class Observer:
    """Turns what a planner is told into the arrays of an environment.

    A policy that was trained in `beacon_mj.gym` is a planner with it: `reset` it with
    the task, give `arrays` of each observation to the policy, and command
    `velocity_mps` of its action.

    Attributes:
        parts: What an observation is made of, in order.
    """

    def __init__(self, nearest: int = NEAREST, beams: int = 0) -> None:
        """Prepare; `reset` comes next.

        Args:
            nearest: Obstacles in an observation, 1 to 100.
            beams: Beams of the lidar, as in the protocol; 0 for no `scan`.

        Raises:
            RunError: If there would be no such number of obstacles.
        """
        if not 1 <= nearest <= 100:
            raise RunError(f"Expected nearest between 1 and 100 but it was {nearest}.")
        parts = [Goal(), Robot(), Walls(), Nearest(nearest)]
        self.parts: tuple[Part, ...] = (*parts, Sweep(beams)) if beams else (*parts,)

    def reset(self, task: Task) -> None:
        """Forget everything and start on a task."""
        self._task = task
        for part in self.parts:
            part.reset()

    def arrays(self, observation: Observation) -> dict[str, Values]:
        """Return the arrays of an observation, by the names of the parts."""
        return {part.name: part.array(observation, self._task) for part in self.parts}

    def velocity_mps(self, action: Any) -> Array:
        """Return the velocity that an action stands for, shape (2,) [m/s].

        Args:
            action: Share of the robot's speed along east and north, shape (2,).

        Raises:
            PlannerError: If it is no such action.
        """
        try:
            share = np.asarray(action, np.float64)
        except (ValueError, TypeError):
            share = np.zeros(0)
        if share.shape != (2,) or not np.isfinite(share).all():
            raise PlannerError(
                "Expected an action of shape (2,), finite shares of the robot's speed, "
                f"but it was {action!r}."
            )
        return self._task.speed_mps * share
