"""The environment: episodes of one family behind Gymnasium's interface."""

import copy
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from beacon_mj.episode.episode import Episode
from beacon_mj.errors import RunError, unknown
from beacon_mj.interface import Observation, Task
from beacon_mj.rl.navigation import Navigation
from beacon_mj.rl.options import made_options
from beacon_mj.rl.parts import Part, Values

OPTIONS = ("index",)  #: What `reset` takes as options.
WIDTH, HEIGHT = 600, 520  #: Of a picture [pixels].


class NavigationEnv(gymnasium.Env[dict[str, Values], Values]):
    """Cross a room full of obstacles: push them, or go round them.

    An observation is a dict of arrays of fixed size, an action the share of the robot's
    speed along east and north. An episode is terminated where the goal is reached, or
    where the battery is empty if the protocol ends it then; it is truncated at the step
    limit, where the robot is stuck, and where physics diverged.

    `info` names family, index, seed and step at a reset; in each step it has the
    `terms` of the reward, and at the end the `outcome` and the `row` of the episode,
    the same that an evaluation writes.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium declares it so
        "render_modes": ["rgb_array"],
        "render_fps": 10,
    }

    def __init__(
        self, family: str, *, render_mode: str | None = None, **options: Any
    ) -> None:
        """Prepare; no scene is made yet.

        Args:
            family: Name of a scene family.
            render_mode: `rgb_array` for pictures, or None.
            options: The other fields of `beacon_mj.rl.options.Options`.

        Raises:
            BeaconError: If an option is no good.
        """
        modes = self.metadata["render_modes"]
        if render_mode is not None and render_mode not in modes:
            raise RunError(unknown("render mode", render_mode, modes))
        self.render_mode = render_mode
        self._episodes = Navigation(made_options(family, options))
        parts = self._episodes.observer.parts
        self.observation_space: Any = spaces.Dict({p.name: _box(p) for p in parts})
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Values], dict[str, Any]]:
        """Start an episode in the next scene.

        Args:
            seed: Scenes are those of this seed from now on, from the first one.
            options: `index` for that scene, out of turn.

        Returns:
            The first observation, and which scene it is of.

        Raises:
            BeaconError: If an option or the seed is no good.
        """
        super().reset(seed=seed)
        for option in options or {}:
            if option not in OPTIONS:
                raise RunError(unknown("option of reset()", option, OPTIONS))
        if seed is not None:
            self._episodes.order.restart(seed)
        index = (options or {}).get("index")
        observation = self._episodes.begin(None if index is None else int(index))
        scene = self._episode.trace.scene
        return observation, {
            "family": scene.family,
            "index": scene.index,
            "seed": self._episodes.order.seed,
        }

    def step(
        self, action: Any
    ) -> tuple[dict[str, Values], float, bool, bool, dict[str, Any]]:
        """Do an action for one control period.

        Args:
            action: Share of the robot's speed along east and north, shape (2,); above a
                length of one it is scaled down.

        Raises:
            PlannerError: If it is no such action, or no episode goes on.
        """
        came = self._episodes.step(action)
        info: dict[str, Any] = {"terms": came.terms}
        if came.outcome is not None:
            info |= {"outcome": came.outcome, "row": self._episodes.row()}
        return came.observation, came.reward, came.terminated, came.truncated, info

    def render(self) -> Any:
        """Return a picture of the room from above, shape (520, 600, 3), or None.

        Raises:
            RenderError: If nothing can be drawn here.
        """
        if self.render_mode is None:
            return None
        from beacon_mj.rendering.camera import camera_over
        from beacon_mj.rendering.gl import Canvas

        world = self._episode.world
        # What makes it look well is no part of the physics: it is set in a copy.
        with Canvas(copy.copy(world.model), WIDTH, HEIGHT) as canvas:
            return canvas.draw(world.data, camera_over(world.scene.workspace_m))

    @property
    def task(self) -> Task:
        """What planners are told about the scene: room, goal, robot, sensors."""
        return self._episode.task

    @property
    def observation(self) -> Observation:
        """What planners are told now, of which the observation is made."""
        return self._episode.observation

    @property
    def _episode(self) -> Episode:
        if self._episodes.episode is None:
            raise RunError("Expected reset() before but no episode has begun.")
        return self._episodes.episode


def _box(part: Part) -> spaces.Box:
    return spaces.Box(part.low, part.high, part.shape, np.float32)
