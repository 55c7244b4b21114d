"""Scenes and drives that several test modules share."""

import functools
from collections.abc import Callable, Mapping

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import BaseWorld, StepOutcome, World
from beacon_mj.world.planar import PlanarWorld

FAMILIES = ("sparse", "cluttered", "collision-required", "collision-shortcut")

Build = Callable[[Scene], BaseWorld]
#: Every kind of world, by name.
WORLDS: Mapping[str, Build] = {
    "mujoco": World,
    "paper": functools.partial(PlanarWorld, push="paper"),
    "limit-surface": functools.partial(PlanarWorld, push="limit-surface"),
}


@functools.cache
def cached_scene(family: str, index: int) -> Scene:
    """Return a generated scene, made once per test session."""
    return generate_scene(family, index)


def drive(
    world: BaseWorld, *velocities: Array | tuple[float, float]
) -> list[StepOutcome]:
    """Apply velocity commands in turn, one control period each."""
    return [world.step(np.array(v, dtype=float)) for v in velocities]
