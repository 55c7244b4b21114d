"""The contract of a robot: what its compiled model must be, a line for each fault.

The shipped disc keeps another one: it alone does not turn. Every other robot is a
differential drive. docs/robots.md has the contract with an example.
"""

import functools
import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import mujoco
import numpy as np

from beacon_mj.errors import TemplateError
from beacon_mj.numerics import Array, norms, unit_vectors
from beacon_mj.scene import Robot
from beacon_mj.scene_gen.mjcf_files import parse_xml
from beacon_mj.scene_gen.robot_elements import element_faults
from beacon_mj.scene_gen.robots import RobotFile
from beacon_mj.scene_gen.room_mjcf import named, room_with

#: Grip of the tyres over the force of the motors, at least: spinning wheels hop.
GRIP = 1.4
REST_S = 1.0  #: Time within which a robot must come to rest [s].
REST_M = 1e-4  #: How far it may move until then [m].
_SMALL = 1e-6
_MIDDLE = "3 3 0"  #: Of the room: the robot touches nothing there.
_CYLINDER = int(mujoco.mjtGeom.mjGEOM_CYLINDER)
_ROUND = (int(mujoco.mjtGeom.mjGEOM_SPHERE), int(mujoco.mjtGeom.mjGEOM_ELLIPSOID))
_SLIDE, _HINGE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)
_ON_JOINT, _AFFINE = 0, 1  #: mjTRN_JOINT, mjBIAS_AFFINE.
_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class DifferentialDrive:
    """What is known of a robot that keeps the contract.

    Attributes:
        mass_kg: Its whole mass.
        force_max_n: Force of both motors on the floor, at their limit.
        bumper_stiffness_npm: Stiffness of the bumper's springs.
        wheel_radius_m: Radius of the wheels.
        half_track_m: Half the distance between the wheels' middles.
        grip: Least grip of the tyres over that force.
        nq: Size of its generalised position.
        nv: Size of its generalised velocity.
    """

    mass_kg: float
    force_max_n: float
    bumper_stiffness_npm: float
    wheel_radius_m: float
    half_track_m: float
    grip: float
    nq: int
    nv: int


def robot_faults(robot: RobotFile) -> list[str]:
    """Return what keeps a robot from being used, a line each; none if nothing does."""
    if robot.is_disc:
        return []
    return list(_examined(robot.mjcf)[0])


def differential_drive(robot: RobotFile) -> DifferentialDrive:
    """Return what is known of a robot other than the disc.

    Raises:
        TemplateError: If it does not keep the contract.
    """
    faults, found = _examined(robot.mjcf)
    if found is None:
        more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
        raise TemplateError(f"robot {robot.name!r}: {faults[0]}{more}.")
    return found


def robot_sizes(robot: RobotFile) -> tuple[int, int]:
    """Return (nq, nv) of a robot: how much of a world's state is its own."""
    if robot.is_disc:
        return 4, 4
    found = differential_drive(robot)
    return found.nq, found.nv


def fitted(robot: RobotFile, scene_robot: Robot) -> Robot:
    """Return the robot of an episode: a scene's, with mass, drive and bumper of a file.

    Speed and control period are the scene's. So is the limit of the drive, where the
    file's is not lower.

    Raises:
        TemplateError: If the robot does not keep the contract, or is not as wide as the
            disc that the scene is certified for.
    """
    if robot.is_disc:
        return scene_robot
    found = differential_drive(robot)
    if abs(scene_robot.radius_m - Robot().radius_m) > _SMALL:
        raise TemplateError(
            f"robot {robot.name!r}: expected scenes for a radius of "
            f"{Robot().radius_m:g} m but this one is for {scene_robot.radius_m:g} m."
        )
    return msgspec.structs.replace(
        scene_robot,
        mass_kg=found.mass_kg,
        force_max_n=min(found.force_max_n, scene_robot.force_max_n),
        bumper_stiffness_npm=found.bumper_stiffness_npm,
    )


@functools.lru_cache(maxsize=64)
def _examined(text: str) -> tuple[tuple[str, ...], DifferentialDrive | None]:
    """Return the faults of a file, and what is known of it if there is none."""
    try:
        root = parse_xml(text.encode(), "its file")[0]
    except TemplateError as error:
        return (str(error).removeprefix("its file: ").rstrip("."),), None
    if faults := tuple(element_faults(root)):
        return faults, None
    try:
        room = room_with(root)
        named(room, "body", "base").set("pos", _MIDDLE)
        text = ET.tostring(room, encoding="unicode")
        model = mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        return (f"MuJoCo cannot compile it: {' '.join(str(error).split())}",), None
    faults = tuple([*_base(model), *_bumper(model), *_wheels(model), *_geoms(model)])
    if faults:
        return faults, None
    grip, moved_m = _grip(model)
    found = _known(model, grip)
    faults = tuple(_numbers(model, found, moved_m))
    return faults, None if faults else found


def _base(model: Any) -> Iterator[str]:
    body = model.body("base")
    joints = [("base_x", _SLIDE, _X), ("base_y", _SLIDE, _Y), ("base_yaw", _HINGE, _Z)]
    yield from _joints(model, "base", joints)
    for name, _, _ in joints:
        joint = model.joint(name)
        if joint.stiffness[0] or joint.damping[0] or joint.frictionloss[0]:
            yield f"expected joint {name!r} to move freely but it has a spring or loss"
    site = model.site("footprint")
    radius = Robot().radius_m
    if model.site_bodyid[site.id] != body.id or np.abs(site.pos[:2]).max() > _SMALL:
        yield "expected site 'footprint' in the middle of body 'base'"
    if abs(site.size[0] - radius) > _SMALL:
        yield (
            f"expected site 'footprint' of radius {radius:g} m, which scenes are "
            f"certified for, but it has {site.size[0]:g} m"
        )


def _bumper(model: Any) -> Iterator[str]:
    body, geom = model.body("bumper"), model.geom("bumper")
    if model.body_parentid[body.id] != model.body("base").id:
        yield "expected body 'bumper' in body 'base'"
    if np.abs(body.pos[:2]).max() > _SMALL or np.abs(geom.pos[:2]).max() > _SMALL:
        yield "expected the bumper in the middle of body 'base'"
    yield from _joints(
        model, "bumper", [("bumper_x", _SLIDE, _X), ("bumper_y", _SLIDE, _Y)]
    )
    stiffness = [float(model.joint(f"bumper_{a}").stiffness[0]) for a in "xy"]
    if stiffness[0] != stiffness[1] or not 100.0 <= stiffness[0] <= 1e5:
        yield (
            "expected both springs of the bumper equally stiff, 100 to 1e5 N/m, but "
            f"they have {stiffness[0]:g} and {stiffness[1]:g}"
        )
    radius = Robot().radius_m
    if geom.type[0] != _CYLINDER or abs(geom.size[0] - radius) > _SMALL:
        yield f"expected geom 'bumper' to be a cylinder of radius {radius:g} m"
    if geom.contype[0] != 2 or geom.conaffinity[0] != 2 or geom.priority[0] < 2:
        yield (
            'expected geom \'bumper\' with contype="2" conaffinity="2" priority="2", '
            "which touches obstacles and walls and whose friction counts"
        )


def _joints(
    model: Any, body: str, wanted: Sequence[tuple[str, int, tuple[float, ...]]]
) -> Iterator[str]:
    """Yield how the joints of a body are others than expected."""
    found = model.body(body)
    first = int(found.jntadr[0])
    names = [model.joint(first + k).name for k in range(int(found.jntnum[0]))]
    if names != [name for name, _, _ in wanted]:
        yield (
            f"expected the joints of body {body!r} to be "
            f"{', '.join(name for name, _, _ in wanted)}, in this order, but they are "
            f"{', '.join(names) or 'none'}"
        )
        return
    for name, kind, axis in wanted:
        joint = model.joint(name)
        if joint.type[0] != kind or np.abs(joint.axis - axis).max() > _SMALL:
            what = "slide" if kind == _SLIDE else "hinge"
            yield f"expected joint {name!r} to be a {what} along {_vector(axis)}"


def _wheels(model: Any) -> Iterator[str]:
    base = model.body("base").id
    for side in ("left", "right"):
        name = f"wheel_{side}"
        joint, geom = model.joint(name), model.geom(name)
        body = model.geom_bodyid[geom.id]
        turned = np.abs(joint.axis - _Y).max() > _SMALL or joint.type[0] != _HINGE
        if model.jnt_bodyid[joint.id] != body or turned:
            yield f"expected joint {name!r} to be a hinge along {_vector(_Y)} there"
        if model.body_parentid[body] != base:
            yield f"expected the body of geom {name!r} in body 'base'"
        if geom.type[0] not in _ROUND:
            yield (
                f"expected geom {name!r} to be a sphere or an ellipsoid, which touch "
                "the floor in one point"
            )
        elif geom.type[0] == _ROUND[1] and geom.size[0] != geom.size[2]:
            yield f"expected geom {name!r} to be round about its axle"
        yield from _motor(model, side)


def _motor(model: Any, side: str) -> Iterator[str]:
    drive = model.actuator(f"drive_{side}")
    joint = model.joint(f"wheel_{side}").id
    if drive.trntype[0] != _ON_JOINT or drive.trnid[0] != joint or drive.gear[0] != 1.0:
        yield f"expected 'drive_{side}' on joint 'wheel_{side}', with gear 1"
    low, high = (float(v) for v in drive.forcerange)
    if not (high > 0.0 and low == -high):
        yield f"expected 'drive_{side}' to have forcerange=\"-T T\", a limit of torque"
    if not (drive.biastype[0] == _AFFINE and drive.gainprm[0] > 0.0):
        yield f"expected 'drive_{side}' to have a gain kv above 0"


def _geoms(model: Any) -> Iterator[str]:
    """No body is turned, nothing but the bumper touches or reaches out of it."""
    root = model.body("base").id
    for body in np.flatnonzero(model.body_rootid == root).tolist():
        if body and np.abs(model.body_quat[body] - (1.0, 0.0, 0.0, 0.0)).max() > 0.0:
            name = model.body(body).name or f"number {body}"
            yield f"expected body {name!r} not to be turned: turn its geoms"
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    base = model.body("base").id
    for geom in range(model.ngeom):
        name = model.geom(geom).name or f"number {geom}"
        if model.body_rootid[model.geom_bodyid[geom]] != base or name == "bumper":
            continue
        if model.geom_contype[geom] or model.geom_conaffinity[geom]:
            yield (
                f'expected contype="0" conaffinity="0" of geom {name!r}: only the '
                "bumper touches obstacles"
            )
        reach = _reach_m(model, data, geom)
        if reach > Robot().radius_m + _SMALL:
            yield (
                f"expected geom {name!r} within the footprint of "
                f"{Robot().radius_m:g} m but it reaches {reach:.3f} m"
            )


def _reach_m(model: Any, data: Any, geom: int) -> float:
    """Return how far a geom reaches from the middle [m], in any horizontal direction.

    That is the largest support c.u + h(u) of the shape, over unit vectors u.
    """
    ahead = unit_vectors(np.linspace(-math.pi, math.pi, 721))
    middle = data.geom_xpos[geom] - data.body("base").xpos
    # Directions in the frame of the geom, (k, 3).
    x, y = (data.geom_xmat[geom].reshape(3, 3)[row] for row in (0, 1))
    local = ahead[:, :1] * x + ahead[:, 1:] * y
    reach = ahead[:, 0] * middle[0] + ahead[:, 1] * middle[1]
    return float((reach + _support_m(model, geom, local)).max())


def _support_m(model: Any, geom: int, local: Array) -> Array:
    """Return how far a shape reaches along directions (k, 3) in its frame, (k,) [m]."""
    size, along = model.geom_size[geom], np.abs(local)
    match mujoco.mjtGeom(int(model.geom_type[geom])):
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return np.full(len(local), float(size[0]))
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            scaled = along * size
            return np.asarray(np.sqrt((scaled * scaled).sum(axis=1)))
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return np.asarray(size[0] + size[1] * along[:, 2])
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return np.asarray(size[0] * norms(along[:, :2]) + size[1] * along[:, 2])
        case _:
            return np.asarray((along * size).sum(axis=1))


def _grip(model: Any) -> tuple[list[float], float]:
    """Return each tyre's grip mu N at rest [N], and how far the robot moved [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(REST_S / float(model.opt.timestep)))
    wheels = [model.geom(f"wheel_{side}").id for side in ("left", "right")]
    grip, force = [0.0, 0.0], np.zeros(6)
    for k in range(data.ncon):
        pair = data.contact[k].geom
        for i, wheel in enumerate(wheels):
            if wheel in pair:
                mujoco.mj_contactForce(model, data, k, force)
                grip[i] += float(data.contact[k].friction[0] * force[0])
    moved = float(np.abs(data.qpos[:3]).max())
    return grip, moved


def _known(model: Any, grip_n: list[float]) -> DifferentialDrive:
    left, right = (model.geom(f"wheel_{side}") for side in ("left", "right"))
    y = [float(model.body(model.geom_bodyid[g.id]).pos[1] + g.pos[1])
         for g in (left, right)]  # fmt: skip
    radius = float(left.size[0])
    force = 2.0 * float(model.actuator("drive_left").forcerange[1]) / radius
    return DifferentialDrive(
        mass_kg=float(model.body_subtreemass[model.body("base").id]),
        force_max_n=force,
        bumper_stiffness_npm=float(model.joint("bumper_x").stiffness[0]),
        wheel_radius_m=radius,
        half_track_m=0.5 * (y[0] - y[1]),
        grip=2.0 * min(grip_n) / force,
        nq=int(model.nq),
        nv=int(model.nv),
    )


def _numbers(model: Any, found: DifferentialDrive, moved_m: float) -> Iterator[str]:
    left, right = (model.geom(f"wheel_{side}") for side in ("left", "right"))
    if left.size[0] != right.size[0]:
        yield "expected both wheels of one radius"
    places = [model.body(model.geom_bodyid[g.id]).pos + g.pos for g in (left, right)]
    mirrored = places[1] * np.array([1.0, -1.0, 1.0])
    if np.abs(places[0] - mirrored).max() > _SMALL or abs(places[0][0]) > _SMALL:
        yield "expected the wheels left and right of the middle, as far from it"
    if found.half_track_m <= 0.01:
        yield "expected 'wheel_left' on the left, 1 cm or more from the middle"
    drives = [model.actuator(f"drive_{side}") for side in ("left", "right")]
    if (drives[0].forcerange != drives[1].forcerange).any() or (
        drives[0].gainprm[0] != drives[1].gainprm[0]
    ):
        yield "expected both motors to have one gain and one limit"
    if not 1.0 < found.mass_kg <= 1000.0:
        yield f"expected a mass of 1 to 1000 kg but it is {found.mass_kg:g} kg"
    if not 0.1 <= found.force_max_n <= 1e4:
        yield f"expected motors of 0.1 to 1e4 N but they have {found.force_max_n:g} N"
    if found.grip < GRIP:
        yield (
            f"expected tyres that hold {GRIP:g} times the force of the motors, "
            f"{found.force_max_n:.1f} N, but at rest they hold "
            f"{found.grip * found.force_max_n:.1f} N: less torque, or more load on them"
        )
    if moved_m > REST_M:
        yield f"expected it to stand still at rest but it moves {1e3 * moved_m:.2f} mm"


def _vector(axis: tuple[float, ...]) -> str:
    return " ".join(f"{v:g}" for v in axis)
