"""Which world an episode runs in: MuJoCo's, or the planar one of the paper."""

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import SceneError
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.robots import robot_in
from beacon_mj.world import BaseWorld, World
from beacon_mj.world.planar import PlanarWorld


def world_of(scene: Scene, protocol: Protocol) -> BaseWorld:
    """Return the world of a scene that a protocol asks for.

    Raises:
        SceneError: If the scene is not valid, or its robot none of the planar world.
        TemplateError: If the robot does not keep its contract.
    """
    if not protocol.is_planar:
        return World(scene, protocol.timestep_s, robot=protocol.robot)
    robot = robot_in(scene, protocol.robot)
    if not robot.is_disc:
        raise SceneError(
            f"{scene.name}: expected the disc in the planar world but the robot is "
            f"{robot.name!r}."
        )
    return PlanarWorld(scene, protocol.timestep_s, protocol.push_model)


def is_world_of(world: BaseWorld, protocol: Protocol) -> bool:
    """Whether a world is of the kind that a protocol asks for."""
    if isinstance(world, PlanarWorld):
        return protocol.is_planar and world.push == protocol.push_model
    return not protocol.is_planar
