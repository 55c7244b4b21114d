"""From a scene to a self-contained MJCF world.

The shipped arena and a robot are taken as XML, the scene's values are written into
them with 17 significant digits, and each obstacle becomes one body. The text is the
world: MuJoCo compiles exactly this, and reloading it gives the same model bit for bit.
"""

import math
import xml.etree.ElementTree as ET

import numpy as np
from msgspec import UNSET, UnsetType

from beacon_mj.constants import CLASSES
from beacon_mj.numerics import norms
from beacon_mj.scene import Obstacle, Robot, Scene, Surface, shapes
from beacon_mj.scene_gen.robot_contract import differential_drive, fitted
from beacon_mj.scene_gen.robots import RobotFile, robot_in
from beacon_mj.scene_gen.room_mjcf import child, named, numbers, room_with

TIMESTEP_S = 0.002  #: Physics step [s].
TEMPLATE_M = (0.0, 0.0, 6.0, 6.0)  #: The room that the template is drawn with.
WALL_M = (0.05, 0.1)  #: Half thickness and half height of the walls [m].
BUMPER_MASS_SHARE = 0.05  #: Share of the robot's mass in the bumper ring.
ACROSS_SHARE = 0.25  #: Limit of the drive across its direction, over force_max.
_GROUND_GAP_M = 0.01  #: The bumper hovers this far above the floor.
_FOOT_M = 0.001  #: Radius of the feet of a prism.
_STAND_M = 0.0003  #: How far they stand out below it.


def scene_mjcf(
    scene: Scene,
    timestep_s: float = TIMESTEP_S,
    robot: RobotFile | UnsetType = UNSET,
) -> str:
    """Return the MJCF world of a scene.

    Args:
        scene: The scene.
        timestep_s: Physics step [s]; a different one is for convergence checks.
        robot: The robot in it, in place of the scene's own.

    Raises:
        TemplateError: If the robot does not keep the contract.
    """
    chosen = robot_in(scene, robot)
    own = fitted(chosen, scene.robot)
    root = room_with(ET.fromstring(chosen.mjcf))
    root.set("model", scene.name)
    child(root, "option").set("timestep", repr(timestep_s))
    world = child(root, "worldbody")
    _place_arena(world, scene)
    if scene.workspace_m != TEMPLATE_M:
        _aim_cameras(root, scene)
    named(root, "body", "base").set("pos", numbers((*scene.start_m, 0.0)))
    if chosen.is_disc:
        _set_up_disc(root, own)
    else:
        _limit_motors(root, own, differential_drive(chosen).wheel_radius_m)
    defaults = child(root, "default")
    for name, surface in zip(CLASSES, scene.surfaces, strict=True):
        defaults.append(_class_default(name, surface))
    assets = child(root, "asset")
    for obstacle in scene.obstacles:
        surface = scene.surfaces[CLASSES.index(obstacle.interaction)]
        world.append(_body(obstacle, surface, assets))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _place_arena(world: ET.Element, scene: Scene) -> None:
    """Move floor, walls and markers to the scene's workspace, start and goal."""
    west, south, east, north = scene.workspace_m
    t, h = WALL_M
    x, y = 0.5 * (west + east), 0.5 * (south + north)
    a, b = 0.5 * (east - west), 0.5 * (north - south)
    floor = named(world, "geom", "floor")
    floor.set("pos", numbers((x, y, 0.0)))
    floor.set("size", numbers((a + 1.0, b + 1.0, 0.1)))
    for name, px, py, sx, sy in (
        ("wall_west", west - t, y, t, b + 2 * t),
        ("wall_south", x, south - t, a, t),
        ("wall_east", east + t, y, t, b + 2 * t),
        ("wall_north", x, north + t, a, t),
    ):
        wall = named(world, "geom", name)
        wall.set("pos", numbers((px, py, h)))
        wall.set("size", numbers((sx, sy, h)))
    named(world, "site", "start").set("pos", numbers((*scene.start_m, 0.001)))
    named(world, "site", "goal").set("pos", numbers((*scene.goal_m, 0.001)))


def _aim_cameras(root: ET.Element, scene: Scene) -> None:
    """Let cameras and the viewer's first look see a room of another size whole."""
    west, south, east, north = scene.workspace_m
    x, y = 0.5 * (west + east), 0.5 * (south + north)
    scale = max(east - west, north - south) / (TEMPLATE_M[2] - TEMPLATE_M[0])
    for name, back, height in (("overhead", 0.0, 9.2), ("overview", 6.6, 6.2)):
        camera = named(root, "camera", name)
        camera.set("pos", numbers((x, y - scale * back, scale * height)))
    look = child(root, "statistic")
    look.set("center", numbers((x, y, 0.2)))
    look.set("extent", repr(6.0 * scale))


def _limit_motors(root: ET.Element, robot: Robot, wheel_radius_m: float) -> None:
    """Have both motors together push with the robot's force and no more."""
    torque = 0.5 * robot.force_max_n * wheel_radius_m
    for side in ("left", "right"):
        motor = named(root, "velocity", f"drive_{side}")
        motor.set("forcerange", numbers((-torque, torque)))


def _set_up_disc(root: ET.Element, robot: Robot) -> None:
    """Write the scene's robot into the disc's bodies, springs and drives."""
    ring = BUMPER_MASS_SHARE * robot.mass_kg
    base, bumper = named(root, "geom", "base"), named(root, "geom", "bumper")
    half = 0.5 * robot.height_m
    base.set("mass", repr(robot.mass_kg - ring))
    base.set("size", numbers((0.7 * robot.radius_m, half)))
    base.set("pos", numbers((0.0, 0.0, half + 0.5 * _GROUND_GAP_M)))
    bumper.set("mass", repr(ring))
    bumper.set("size", numbers((robot.radius_m, half - _GROUND_GAP_M)))
    bumper.set("pos", numbers((0.0, 0.0, half)))
    critical = 2.0 * math.sqrt(robot.bumper_stiffness_npm * ring)
    for axis in "xy":
        joint = named(root, "joint", f"bumper_{axis}")
        joint.set("stiffness", repr(robot.bumper_stiffness_npm))
        joint.set("damping", repr(critical))
    gain = 200.0 * robot.mass_kg  # Time constant of the free servo: 5 ms.
    for name, share in (("drive_along", 1.0), ("drive_across", ACROSS_SHARE)):
        drive = named(root, "general", name)
        limit = share * robot.force_max_n
        drive.set("gainprm", repr(gain))
        drive.set("biasprm", numbers((0.0, 0.0, -gain)))
        drive.set("forcerange", numbers((-limit, limit)))


def _class_default(name: str, surface: Surface) -> ET.Element:
    default = ET.Element("default", {"class": name})
    ET.SubElement(
        default,
        "geom",
        rgba=numbers(surface.rgba),
        priority="1",  # The obstacle's friction counts, not the floor's.
        contype="3",
        conaffinity="3",
    )
    return default


def _body(o: Obstacle, surface: Surface, assets: ET.Element) -> ET.Element:
    """Return the body of one obstacle, its geoms named after it."""
    half_yaw = 0.5 * o.yaw_rad
    body = ET.Element(
        "body",
        name=o.id,
        pos=numbers((o.x_m, o.y_m, 0.5 * o.shape.height_m)),
        quat=numbers((math.cos(half_yaw), 0.0, 0.0, math.sin(half_yaw))),
    )
    if not o.fixed:
        ET.SubElement(body, "freejoint", name=o.id)
    rolls = isinstance(o.shape, shapes.Sphere | shapes.Capsule)
    for name, geometry in _geoms(o, assets):
        attributes = {
            "name": name,
            "class": o.interaction,
            "density": repr(o.density_kgm3),
            "condim": "6" if rolls else "3",
            "friction": numbers(
                (o.friction, surface.torsional_friction_m, surface.rolling_friction_m)
            ),
        }
        ET.SubElement(body, "geom", attributes | geometry)
    return body


def _geoms(o: Obstacle, assets: ET.Element) -> list[tuple[str, dict[str, str]]]:
    """Return (name, MJCF attributes) of the geoms of an obstacle."""
    match o.shape:
        case shapes.Sphere(radius_m=r):
            return [(o.id, {"type": "sphere", "size": numbers((r,))})]
        case shapes.Box(length_m=a, width_m=b, height_m=c):
            size = numbers((0.5 * a, 0.5 * b, 0.5 * c))
            return [(o.id, {"type": "box", "size": size})]
        case shapes.Cylinder(radius_m=r, height_m=h):
            return [(o.id, {"type": "cylinder", "size": numbers((r, 0.5 * h))})]
        case shapes.Capsule(radius_m=r):
            size = numbers((r, o.shape.half_axis_m))
            lying = numbers((math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0))
            return [(o.id, {"type": "capsule", "size": size, "quat": lying})]
        case shapes.Prism():
            return [_mesh(o.id, o.shape.core()[0], assets), *_feet(o.id, o.shape)]
        case shapes.Hulls(parts_m=parts):
            return [
                _mesh(f"{o.id}_part_{k}", np.array(part), assets)
                for k, part in enumerate(parts)
            ]


def _feet(name: str, shape: shapes.Prism) -> list[tuple[str, dict[str, str]]]:
    """Return one weightless ball below each lower vertex of a prism, to stand on.

    MuJoCo gives a mesh on a plane four contacts at most and changes its mind about
    which: a pentagon then rocks, and creeps below its Coulomb limit. One contact at
    each vertex that is down is what a convex body on a plane has. Fallen over, the
    prism lies on its mesh.
    """
    points = np.array(shape.vertices_m)
    inset = points * (1.0 - _FOOT_M / norms(points)[:, None])
    height = _FOOT_M - _STAND_M - 0.5 * shape.height_m
    return [
        (
            f"{name}_foot_{k}",
            {
                "type": "sphere",
                "size": repr(_FOOT_M),
                "pos": numbers((*point, height)),
                "density": "0",
                "contype": "4",
                "conaffinity": "4",
                "group": "3",
            },
        )
        for k, point in enumerate(inset)
    ]


def _mesh(
    name: str, points: np.ndarray, assets: ET.Element
) -> tuple[str, dict[str, str]]:
    """Add a convex mesh asset; return the name and attributes of its geom."""
    ET.SubElement(assets, "mesh", name=name, vertex=numbers(points.ravel()))
    return name, {"type": "mesh", "mesh": name}
