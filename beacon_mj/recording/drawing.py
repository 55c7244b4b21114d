"""The 3-D picture of a world in Foxglove's scene messages.

Every obstacle is an entity locked to a frame of its own name; moving it is a matter
of transforms alone. All poses are in the arena frame, in [m].
"""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array
from beacon_mj.numerics import norm
from beacon_mj.recording.messages import message
from beacon_mj.scene import Obstacle
from beacon_mj.world import BaseWorld, PairForce

ARENA, ROBOT_FRAME = "arena", "robot"
BROKEN_RGBA = (0.25, 0.05, 0.3, 1.0)  #: Colour of a broken obstacle.
ARROW_RGBA = (0.85, 0.1, 0.1, 1.0)
ARROW_M_PER_N = 0.008  #: Length of a contact arrow per newton.
ARROW_MIN_N = 0.5  #: Smallest contact force that is drawn [N].
NS = 1_000_000_000

Values = Sequence[float] | Array
_GEOM = mujoco.mjtGeom
_SKIPPED = {"base", "bumper", "floor"}


def stamp(target: Any, time_ns: int) -> None:
    """Write a simulation time into a Timestamp or Duration."""
    target.seconds, target.nanos = divmod(time_ns, NS)


def scene_update(world: BaseWorld, time_ns: int) -> Any:
    """Return the whole picture of a world: one entity for each thing in it."""
    update = message("foxglove.SceneUpdate")()
    _arena(update, world, time_ns)
    _robot(update, world, time_ns)
    for i, obstacle in enumerate(world.scene.obstacles):
        entity = new_entity(update, obstacle.id, obstacle.id, time_ns)
        broken = bool(world.broken[i])
        for key, value in _facts(obstacle, broken).items():
            entity.metadata.add(key=key, value=value)
        colour = BROKEN_RGBA if broken else None
        body = world.model.body(obstacle.id)
        first = int(body.geomadr[0])
        for geom in range(first, first + int(body.geomnum[0])):
            _primitive(entity, world.model, geom, colour)
    return update


def arrows(contacts: Sequence[PairForce], time_ns: int, lifetime_ns: int) -> Any | None:
    """Return the contact forces as arrows, or None if there is nothing to draw."""
    update = message("foxglove.SceneUpdate")()
    entity = new_entity(update, "contacts", ARENA, time_ns)
    stamp(entity.lifetime, lifetime_ns)
    for contact in contacts:
        force = norm(contact.force_n)
        if force < ARROW_MIN_N:
            continue
        arrow = entity.arrows.add(
            shaft_length=ARROW_M_PER_N * force,
            shaft_diameter=0.02,
            head_length=0.05,
            head_diameter=0.05,
        )
        set_pose(arrow.pose, contact.point_m, _turn_x_to(contact.force_n / force))
        set_colour(arrow.color, ARROW_RGBA)
    return update if entity.arrows else None


def new_entity(update: Any, name: str, frame: str, time_ns: int) -> Any:
    """Add an entity that is locked to a frame, and return it."""
    entity = update.entities.add(id=name, frame_id=frame, frame_locked=True)
    stamp(entity.timestamp, time_ns)
    return entity


def _facts(obstacle: Obstacle, broken: bool) -> dict[str, str]:
    """Return the truth about an obstacle that a click on it shows."""
    facts = {
        "class": obstacle.interaction,
        "mass_kg": f"{obstacle.mass_kg:.3f}",
        "breakaway_force_n": f"{obstacle.breakaway_force_n:.2f}",
    }
    if obstacle.perceived.kind is not None:
        facts["kind"] = obstacle.perceived.kind
    if obstacle.break_force_n is not None:
        facts |= {
            "break_force_n": f"{obstacle.break_force_n:.2f}",
            "broken": str(broken).lower(),
        }
    return facts


def _arena(update: Any, world: BaseWorld, time_ns: int) -> None:
    """Add walls, start and goal."""
    entity = new_entity(update, ARENA, ARENA, time_ns)
    model = world.model
    for geom in range(model.ngeom):
        if model.geom_bodyid[geom] == 0 and model.geom(geom).name not in _SKIPPED:
            _primitive(entity, model, geom, None)
    for site in ("start", "goal"):
        found = model.site(site)
        cylinder = entity.cylinders.add(bottom_scale=1.0, top_scale=1.0)
        set_pose(cylinder.pose, found.pos, (1.0, 0.0, 0.0, 0.0))
        set_size(cylinder.size, (2 * found.size[0], 2 * found.size[0], 0.002))
        set_colour(cylinder.color, found.rgba.tolist())


def _robot(update: Any, world: BaseWorld, time_ns: int) -> None:
    """Add all geoms of the robot, in its frame; its bodies are not turned in it."""
    entity = new_entity(update, ROBOT_FRAME, ROBOT_FRAME, time_ns)
    model = world.model
    base = model.body("base").id
    for geom in np.flatnonzero(model.body_rootid[model.geom_bodyid] == base).tolist():
        body, offset = int(model.geom_bodyid[geom]), np.zeros(3)
        while body != base:
            offset = offset + model.body_pos[body]
            body = int(model.body_parentid[body])
        _primitive(entity, model, geom, None, offset)


def _primitive(
    entity: Any,
    model: mujoco.MjModel,
    geom: int,
    colour: Values | None,
    offset: Array | None = None,
) -> None:
    """Add one MuJoCo geom to an entity, in the frame of its body plus an offset."""
    rgba = model.geom_rgba[geom] if colour is None else colour
    position, quaternion = model.geom_pos[geom], model.geom_quat[geom]
    if offset is not None:  # Adding nothing would turn -0 into 0.
        position = position + offset
    size = model.geom_size[geom]
    match model.geom_type[geom]:
        case _GEOM.mjGEOM_BOX:
            shape = entity.cubes.add()
            set_size(shape.size, 2.0 * size)
        case _GEOM.mjGEOM_SPHERE:
            shape = entity.spheres.add()
            set_size(shape.size, np.full(3, 2.0 * size[0]))
        case _GEOM.mjGEOM_ELLIPSOID:
            shape = entity.spheres.add()
            set_size(shape.size, 2.0 * size)
        case _GEOM.mjGEOM_CYLINDER | _GEOM.mjGEOM_CAPSULE as kind:
            shape = entity.cylinders.add(bottom_scale=1.0, top_scale=1.0)
            set_size(shape.size, 2.0 * size[[0, 0, 1]])
            if kind == _GEOM.mjGEOM_CAPSULE:
                _caps(entity, position, quaternion, size, rgba)
        case _:
            shape = entity.triangles.add()
            _mesh(shape, model, int(model.geom_dataid[geom]))
    set_pose(shape.pose, position, quaternion)
    set_colour(shape.color, rgba)


def _caps(
    entity: Any, position: Array, quaternion: Array, size: Array, rgba: Values
) -> None:
    """Add the two ends of a capsule, which Foxglove has no primitive for."""
    axis = np.empty(3)
    mujoco.mju_rotVecQuat(axis, np.array([0.0, 0.0, size[1]]), quaternion)
    for end in (position - axis, position + axis):
        cap = entity.spheres.add()
        set_size(cap.size, np.full(3, 2.0 * size[0]))
        set_pose(cap.pose, end, (1.0, 0.0, 0.0, 0.0))
        set_colour(cap.color, rgba)


def _mesh(shape: Any, model: mujoco.MjModel, mesh: int) -> None:
    """Write the triangles of a compiled mesh."""
    vertex, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
    vertices = model.mesh_vert[vertex : vertex + int(model.mesh_vertnum[mesh])]
    faces: NDArray[np.int32] = model.mesh_face[
        face : face + int(model.mesh_facenum[mesh])
    ]
    for x, y, z in vertices.tolist():
        shape.points.add(x=x, y=y, z=z)
    shape.indices.extend(faces.ravel().tolist())


def _turn_x_to(direction: Array) -> tuple[float, float, float, float]:
    """Return the quaternion (wxyz) that turns the x axis to a unit vector."""
    x, y, z = direction.tolist()
    if x < -0.999999:
        return 0.0, 0.0, 0.0, 1.0
    w = np.sqrt(0.5 * (1.0 + x))
    return float(w), 0.0, float(-0.5 * z / w), float(0.5 * y / w)


def set_pose(pose: Any, position: Values, wxyz: Values) -> None:
    """Write a position [m] and a quaternion."""
    p, q = pose.position, pose.orientation
    p.x, p.y, p.z = position
    q.w, q.x, q.y, q.z = wxyz


def set_size(size: Any, values: Values) -> None:
    """Write the size along x, y, z [m]."""
    size.x, size.y, size.z = values


def set_colour(colour: Any, rgba: Values) -> None:
    """Write red, green, blue and opacity, 0 to 1."""
    colour.r, colour.g, colour.b, colour.a = rgba
