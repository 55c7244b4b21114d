"""Hand-made scenes: one robot and a few known obstacles in the shipped arena."""

import math

import msgspec

from beacon_mj.constants import InteractionClass
from beacon_mj.scene import Certificate, Obstacle, Perceived, Robot, Scene, Surface
from beacon_mj.scene.shapes import Box, Shape

START_M = (1.0, 3.0)  #: Where the robot of a bench stands.
SURFACE = Surface(rgba=(0.6, 0.6, 0.6, 1.0))


def obstacle(
    name: str,
    shape: Shape,
    position_m: tuple[float, float] = (3.0, 3.0),
    *,
    interaction: InteractionClass = "movable",
    mass_kg: float = 4.0,
    friction: float = 0.5,
    yaw_rad: float = 0.0,
    fixed: bool = False,
    break_force_n: float | None = None,
) -> Obstacle:
    """Return an obstacle of a given mass; its density follows from its volume."""
    density = mass_kg / shape.volume_m3
    return Obstacle(
        id=name,
        shape=shape,
        x_m=position_m[0],
        y_m=position_m[1],
        yaw_rad=yaw_rad,
        interaction=interaction,
        fixed=fixed,
        density_kgm3=density,
        friction=friction,
        break_force_n=break_force_n,
        perceived=Perceived(
            scores=(1.0, 1.0, 1.0), density_kgm3=density, friction=friction
        ),
    )


def block(
    name: str = "block",
    gap_m: float = 0.1,
    *,
    side_m: float = 0.4,
    height_m: float = 0.25,
    mass_kg: float = 4.0,
    friction: float = 0.5,
    break_force_n: float | None = None,
) -> Obstacle:
    """Return a square box straight before the robot, `gap_m` from its bumper."""
    return obstacle(
        name,
        Box(length_m=side_m, width_m=side_m, height_m=height_m),
        (START_M[0] + Robot().radius_m + gap_m + 0.5 * side_m, START_M[1]),
        interaction="movable" if break_force_n is None else "fragile",
        mass_kg=mass_kg,
        friction=friction,
        break_force_n=break_force_n,
    )


def bench(
    *obstacles: Obstacle, robot: Robot | None = None, name: str = "bench"
) -> Scene:
    """Return a scene of `obstacles` in a room of 6 m with the robot at `START_M`."""
    goal = (5.6, 5.6)
    return Scene(
        family=name,
        index=0,
        seed=0,
        perception="truth",
        workspace_m=(0.0, 0.0, 6.0, 6.0),
        start_m=START_M,
        goal_m=goal,
        robot=Robot() if robot is None else robot,
        surfaces=(SURFACE, SURFACE, SURFACE),
        obstacles=obstacles,
        certificate=Certificate(
            collision_free_length_m=None,
            reference_length_m=math.dist(START_M, goal),
            straight_line_m=math.dist(START_M, goal),
            door_ids=(),
            margin_m=0.0,
        ),
    )


def rolling(scene: Scene, friction_m: float) -> Scene:
    """Return the scene with the rolling friction of every class replaced."""
    surface = msgspec.structs.replace(SURFACE, rolling_friction_m=friction_m)
    return msgspec.structs.replace(scene, surfaces=(surface, surface, surface))
