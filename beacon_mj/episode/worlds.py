"""Which world an episode runs in: MuJoCo's, or the planar one of the paper."""

from beacon_mj.episode.protocol import Protocol
from beacon_mj.scene import Scene
from beacon_mj.world import BaseWorld, World
from beacon_mj.world.planar import PlanarWorld


def world_of(scene: Scene, protocol: Protocol) -> BaseWorld:
    """Return the world of a scene that a protocol asks for.

    Raises:
        SceneError: If the scene is not valid.
    """
    if protocol.is_planar:
        return PlanarWorld(scene, protocol.timestep_s, protocol.push_model)
    return World(scene, protocol.timestep_s)


def is_world_of(world: BaseWorld, protocol: Protocol) -> bool:
    """Whether a world is of the kind that a protocol asks for."""
    if isinstance(world, PlanarWorld):
        return protocol.is_planar and world.push == protocol.push_model
    return not protocol.is_planar
