"""Prototypes: the shapes of a family, with nominal proportions, and scaling them."""

import math
from collections.abc import Container, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import msgspec
import mujoco
import numpy as np
import shapely

from beacon_mj.errors import TemplateError
from beacon_mj.geometry import Array, convex_hull, core_centroid
from beacon_mj.scene import shapes
from beacon_mj.scene.shapes import PrismKind, Shape
from beacon_mj.scene_gen.geom_points import geom_points, geom_rotation
from beacon_mj.scene_gen.mjcf_files import Origin
from beacon_mj.scene_gen.mjcf_reader import Mjcf

#: Decimals kept of every length in a scene, so that files are the same everywhere.
DECIMALS = 6
_ALIGNED = 1e-5  #: How far off a shape may stand; MuJoCo turns meshes about.
_SOLIDS = (
    mujoco.mjtGeom.mjGEOM_SPHERE,
    mujoco.mjtGeom.mjGEOM_CAPSULE,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    mujoco.mjtGeom.mjGEOM_CYLINDER,
    mujoco.mjtGeom.mjGEOM_BOX,
    mujoco.mjtGeom.mjGEOM_MESH,
)


@dataclass(frozen=True, slots=True)
class Prototype:
    """One body of a family file.

    Attributes:
        name: Name of the body, which names the shape.
        nominal: The shape as drawn in the template.
    """

    name: str
    nominal: Shape

    def scaled(self, length_m: float, width_m: float, height_m: float) -> Shape:
        """Return the shape stretched to a bounding box.

        A ball takes the length alone, an upright cylinder length and height, a lying
        capsule length and height. An obstacle authored as a body of its own keeps its
        proportions: its longer side becomes `length_m`.
        """
        nominal = self.nominal
        length, width, height = (
            round(v, DECIMALS) for v in (length_m, width_m, height_m)
        )
        half = round(0.5 * length_m, DECIMALS)
        match nominal:
            case shapes.Sphere():
                return shapes.Sphere(radius_m=half)
            case shapes.Cylinder():
                return shapes.Cylinder(radius_m=half, height_m=height)
            case shapes.Box():
                return shapes.Box(length_m=length, width_m=width, height_m=height)
            case shapes.Capsule():
                radius = round(0.5 * height_m, DECIMALS)
                longest = max(length, round(2.5 * radius, DECIMALS))
                return shapes.Capsule(radius_m=radius, length_m=longest)
            case shapes.Prism():
                outline = np.array(nominal.vertices_m)
                scale = np.array([length_m, width_m]) / np.ptp(outline, axis=0)
                return shapes.Prism(
                    kind=nominal.kind,
                    vertices_m=_rounded(outline * scale),
                    height_m=height,
                )
            case shapes.Hulls():
                return _scaled_hulls(nominal, length_m)


def _scaled_hulls(nominal: shapes.Hulls, length_m: float) -> shapes.Hulls:
    points = nominal.core()[0][:, :2]
    scale = length_m / float(np.ptp(points, axis=0).max())
    return _hulls_of(nominal.name, [np.array(p) * scale for p in nominal.parts_m])


def _hulls_of(name: str, parts: list[Array]) -> shapes.Hulls:
    """Return the shape of convex parts; its volume is that of the rounded points."""
    rounded = tuple(_rounded(p) for p in parts)
    volume = math.fsum(shapes.hull_volume(np.array(p)) for p in rounded)
    return shapes.Hulls(name=name, parts_m=rounded, volume_m3=volume)


def _rounded(points: Array) -> tuple[Any, ...]:
    return tuple(tuple(round(float(v), DECIMALS) for v in row) for row in points)


def read_prototypes(mjcf: Mjcf, path: Path) -> tuple[Prototype, ...]:
    """Return the prototypes of a family file, one for each body of its world.

    Raises:
        TemplateError: If there is none, or one has no name, has joints of its own, or
            has no geom that collides.
    """
    model = mjcf.model
    bodies = [b for b in range(1, model.nbody) if model.body_parentid[b] == 0]
    if not bodies:
        raise TemplateError(
            f"{path}: expected at least one obstacle body in its world."
        )
    coarse = {mesh.id for mesh in mjcf.spec.meshes if mesh.maxhullvert >= 0}
    return tuple(_prototype(model, b, path, mjcf.origins, coarse) for b in bodies)


def _prototype(
    model: Any,
    body: int,
    path: Path,
    origins: Mapping[str, Origin],
    coarse: Container[int],
) -> Prototype:
    name = model.body(body).name
    if not name:
        raise TemplateError(f"{path}: expected every obstacle body to have a name.")
    where = str(origins.get(name, path))
    _check_rigid(model, body, f"{where}: expected body {name!r}")
    inside = [g for g in range(model.ngeom) if model.geom_bodyid[g] > 0]
    inside = [g for g in inside if model.body_rootid[model.geom_bodyid[g]] == body]
    # What cannot touch anything is there to be looked at.
    geoms = [g for g in inside if model.geom_contype[g] or model.geom_conaffinity[g]]
    if not geoms:
        raise TemplateError(
            f"{where}: expected body {name!r} to have a geom"
            + (" that collides (contype or conaffinity)." if inside else ".")
        )
    for geom in geoms:
        kind = mujoco.mjtGeom(model.geom_type[geom])
        if kind not in _SOLIDS:
            word = kind.name.removeprefix("mjGEOM_").lower()
            raise TemplateError(
                f"{where}: expected the geoms of body {name!r} to be solid (sphere, "
                f"capsule, ellipsoid, cylinder, box, mesh) but one is a {word}."
            )
    try:
        shape = _simple_shape(model, geoms[0], name) if len(geoms) == 1 else None
        shape = shape or _hulls(name, [geom_points(model, g, coarse) for g in geoms])
        prototype = Prototype(name, shape)
    except ValueError as error:
        raise TemplateError(
            f"{where}: expected the geoms of body {name!r} to be solid but one is flat."
        ) from error
    _check_storable(prototype, where)
    return prototype


def _check_storable(prototype: Prototype, where: str) -> None:
    """Refuse at once what every reader of its scenes would refuse."""
    try:
        shape = prototype.scaled(1.0, 1.0, 1.0)
        msgspec.convert(msgspec.to_builtins(shape), Shape)
    except msgspec.ValidationError as error:
        raise TemplateError(
            f"{where}: expected body {prototype.name!r} to be a shape that fits into a "
            "scene, at most 32 geoms that collide, each of at most 256 corners (give a "
            f'mesh maxhullvert="64"): {error}.'
        ) from error


def _check_rigid(model: Any, body: int, expected: str) -> None:
    """Refuse joints but for the body's own free one: an obstacle is one rigid body."""
    for joint in range(model.njnt):
        owner = model.jnt_bodyid[joint]
        free = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        if model.body_rootid[owner] == body and not (owner == body and free):
            raise TemplateError(
                f"{expected} to be rigid, with no joint but a <freejoint>, but it has "
                f"joint {model.joint(joint).name!r}."
            )


def _simple_shape(model: Any, geom: int, name: str) -> Shape | None:
    """Return the shape of a body with one geom, if it is one of the nine."""
    a, b, c = (float(v) for v in model.geom_size[geom])
    kind = mujoco.mjtGeom(model.geom_type[geom])
    rotation = geom_rotation(model, geom)
    upright = abs(rotation[2, 2]) > 1.0 - _ALIGNED
    if name == "sphere" and kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return shapes.Sphere(radius_m=a)
    if name == "box" and kind == mujoco.mjtGeom.mjGEOM_BOX:
        if np.abs(rotation - np.eye(3)).max() < _ALIGNED:
            return shapes.Box(length_m=2 * a, width_m=2 * b, height_m=2 * c)
    if name == "cylinder" and kind == mujoco.mjtGeom.mjGEOM_CYLINDER and upright:
        return shapes.Cylinder(radius_m=a, height_m=2 * b)
    if name == "capsule" and kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        if abs(rotation[0, 2]) > 1.0 - _ALIGNED:  # It lies along the x axis.
            return shapes.Capsule(radius_m=a, length_m=2 * (a + b))
    if name in get_args(PrismKind) and kind == mujoco.mjtGeom.mjGEOM_MESH:
        return _prism(geom_points(model, geom), name)
    return None


def _prism(points: Array, name: str) -> shapes.Prism | None:
    """Return the upright prism that the points are the corners of, if they are."""
    low, high = points[:, 2].min(), points[:, 2].max()
    ends = [points[np.abs(points[:, 2] - z) < _ALIGNED] for z in (low, high)]
    if len(ends[0]) + len(ends[1]) != len(points) or len(ends[0]) != len(ends[1]):
        return None
    outline = convex_hull(np.round(points[:, :2], 9))
    outline = outline - core_centroid(outline)
    return shapes.Prism(
        kind=name,  # type: ignore[arg-type]
        vertices_m=_rounded(outline),
        height_m=float(np.ptp(points[:, 2])),
    )


def _hulls(name: str, parts: list[Array]) -> shapes.Hulls:
    """Return the convex parts of an authored body, standing on the floor, centred."""
    everything = np.concatenate(parts)
    centre = core_centroid(convex_hull(everything[:, :2]))
    middle = 0.5 * (everything[:, 2].min() + everything[:, 2].max())
    return _hulls_of(name, [p - (*centre, middle) for p in parts])


def largest_side(shape: Shape) -> float:
    """Return the longer side of the footprint's bounding box [m]."""
    west, south, east, north = shapely.bounds(shapes.footprint(shape).polygon())
    return float(max(east - west, north - south))
