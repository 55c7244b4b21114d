"""Telling an oracle the truth about a scene, with a copy of the world to try it in."""

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.sealed import sealed_footprint
from beacon_mj.episode.trace import Trace
from beacon_mj.episode.worlds import world_of
from beacon_mj.geometry import Footprint
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Rollout, TrueObstacle, Truth
from beacon_mj.scene import Obstacle, Scene
from beacon_mj.scene_gen.perception import perceive
from beacon_mj.world import BaseWorld
from beacon_mj.world.overnight import Left


def truth_about(
    scene: Scene,
    protocol: Protocol,
    run: Callable[..., Trace],
    left: Left | None = None,
) -> Truth:
    """Return the truth about a scene, or about the room that was left in it.

    Args:
        scene: The scene.
        protocol: How the episode is run.
        run: `beacon_mj.episode.run.run_episode`, which rehearses.
        left: How the room was left the day before.
    """
    copy = _Copy(scene, protocol, run, left)
    places = [o.footprint for o in scene.obstacles]
    return Truth(
        obstacles=tuple(
            _true(o, place)
            for o, place in zip(
                scene.obstacles, copy.footprints if left else places, strict=True
            )
        ),
        rehearse=copy.rehearse,
    )


class _Copy:
    """A copy of the world, built when it is first used."""

    def __init__(
        self,
        scene: Scene,
        protocol: Protocol,
        run: Callable[..., Trace],
        left: Left | None,
    ) -> None:
        self._scene = perceive(scene, "truth", scene.seed)
        self._protocol = protocol.certain()
        self._run = run
        self._left = left

    @cached_property
    def _world(self) -> BaseWorld:
        return world_of(self._scene, self._protocol)

    @property
    def footprints(self) -> list[Footprint]:
        """Where everything stands before the first step."""
        self._world.reset(self._left)
        return self._world.outlines

    def rehearse(self, planner: Planner) -> Rollout:
        """Run an episode in the copy."""
        trace = self._run(
            self._scene,
            planner,
            protocol=self._protocol,
            world=self._world,
            left=self._left,
        )
        velocities = [r.command.velocity_mps for r in trace.steps]
        positions = [trace.start_m, *(r.outcome.position_m for r in trace.steps)]
        return Rollout(
            reached=trace.outcome == "reached",
            broken=tuple(d.obstacle for r in trace.steps for d in r.outcome.damages),
            velocities_mps=np.array(velocities).reshape(-1, 2),
            positions_m=np.array(positions),
            detail=trace.detail,
        )


def _true(o: Obstacle, place: Footprint) -> TrueObstacle:
    return TrueObstacle(
        id=o.id,
        footprint=sealed_footprint(place),
        interaction=o.interaction,
        mass_kg=o.mass_kg,
        breakaway_force_n=o.breakaway_force_n,
        break_force_n=math.inf if o.break_force_n is None else o.break_force_n,
    )
