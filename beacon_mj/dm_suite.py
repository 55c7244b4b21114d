"""The scenes as `dm_env` environments, with dm-control's view of their physics."""

from typing import Any

import numpy as np

from beacon_mj.errors import BeaconError, RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.extras import missing
from beacon_mj.rl.navigation import Navigation
from beacon_mj.rl.options import made_options
from beacon_mj.rl.parts import Part
from beacon_mj.world import BaseWorld

try:
    import dm_env
    from dm_control.mujoco import Physics
    from dm_control.mujoco.wrapper import MjData
    from dm_env import specs
except ImportError as _error:
    raise BeaconError(missing(_error, "pymjcf")) from _error


def load(family: str, index: int = 0, **options: Any) -> "NavigationEnvironment":
    """Return one scene as an environment.

    Args:
        family: Name of a scene family.
        index: Number of the scene, >= 0.
        options: The other fields of `beacon_mj.rl.options.Options`.

    Raises:
        BeaconError: If an option is no good.
    """
    chosen = made_options(family, {"indices": [index], **options})
    return NavigationEnvironment(Navigation(chosen))


class NavigationEnvironment(dm_env.Environment):  # type: ignore[misc]
    """One scene: each episode begins as the one before.

    Observations, actions and rewards are those of `beacon_mj.gym`.
    """

    def __init__(self, episodes: Navigation) -> None:
        """Cross the scene of `episodes`."""
        self._episodes = episodes
        self._viewed: tuple[BaseWorld, Any] | None = None
        self._over = True

    def reset(self) -> Any:
        """Start an episode; return its first `TimeStep`."""
        self._over = False
        return dm_env.restart(self._episodes.begin())

    def step(self, action: Any) -> Any:
        """Do an action for one control period; after the end of an episode, reset.

        Args:
            action: Share of the robot's speed along east and north, shape (2,).

        Returns:
            A `TimeStep`. Its discount is 0 where the goal was reached, or the battery
            is empty and that ends the episode; where an episode is cut off it is 1.
        """
        if self._over:
            return self.reset()
        came = self._episodes.step(action)
        self._over = came.outcome is not None
        if came.terminated:
            return dm_env.termination(came.reward, came.observation)
        if came.truncated:
            return dm_env.truncation(came.reward, came.observation)
        return dm_env.transition(came.reward, came.observation)

    def observation_spec(self) -> dict[str, Any]:
        """Return the arrays of an observation, by name."""
        return {part.name: _bounded(part) for part in self._episodes.observer.parts}

    def action_spec(self) -> Any:
        """Return what an action is."""
        return specs.BoundedArray((2,), np.float32, -1.0, 1.0, "action")

    def control_timestep(self) -> float:
        """Return the control period [s]."""
        return self._world.scene.robot.control_period_s

    @property
    def physics(self) -> Any:
        """The state of the episode as dm-control's `Physics`, for looking at it.

        It shares model and data with the world. Stepping or changing it would be
        another episode: its row no longer holds.
        """
        world = self._world
        if self._viewed is None or self._viewed[0] is not world:
            self._viewed = world, Physics(MjData(world.data))
        return self._viewed[1]

    @property
    def row(self) -> Row:
        """The row of the episode that ended, the same that an evaluation writes."""
        if not self._over or self._episodes.episode is None:
            raise RunError("Expected the end of an episode before its row.")
        return self._episodes.row()

    @property
    def _world(self) -> BaseWorld:
        if self._episodes.episode is None:
            self.reset()
        assert self._episodes.episode is not None
        return self._episodes.episode.world


def _bounded(part: Part) -> Any:
    return specs.BoundedArray(part.shape, np.float32, part.low, part.high, part.name)
