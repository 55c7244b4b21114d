"""Prototypes: the shapes of a family, with nominal proportions, and scaling them."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import mujoco
import numpy as np
import shapely

from beacon_mj.errors import TemplateError
from beacon_mj.geometry import Array, convex_hull, core_centroid
from beacon_mj.numerics import rotated_3d
from beacon_mj.scene import shapes
from beacon_mj.scene.shapes import PrismKind, Shape

#: Decimals kept of every length in a scene, so that files are the same everywhere.
DECIMALS = 6


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


def read_prototypes(root: Any, path: Path) -> tuple[Prototype, ...]:
    """Return the prototypes of a parsed family file.

    Raises:
        TemplateError: If there is none, or one has no name or no geometry.
    """
    try:
        with_files = {k: v for k, v in root.get_assets().items()}
        model = mujoco.MjModel.from_xml_string(root.to_xml_string(), with_files)
    except ValueError as error:
        raise TemplateError(f"{path}: MuJoCo cannot compile it: {error}") from error
    bodies = list(root.worldbody.body)
    if not bodies:
        raise TemplateError(
            f"{path}: expected at least one obstacle body in its world."
        )
    return tuple(_prototype(model, body.name, path) for body in bodies)


def _prototype(model: Any, name: str | None, path: Path) -> Prototype:
    if not name:
        raise TemplateError(f"{path}: expected every obstacle body to have a name.")
    body = model.body(name)
    geoms = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body.id]
    if not geoms:
        raise TemplateError(f"{path}: expected body {name!r} to have a geom.")
    if len(geoms) == 1 and (shape := _simple_shape(model, geoms[0], name)) is not None:
        return Prototype(name, shape)
    return Prototype(name, _hulls(model, geoms, name))


def _simple_shape(model: Any, geom: int, name: str) -> Shape | None:
    """Return the shape of a body with one geom, if it is one of the nine."""
    a, b, c = (float(v) for v in model.geom_size[geom])
    kind = mujoco.mjtGeom(model.geom_type[geom])
    if name == "sphere" and kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return shapes.Sphere(radius_m=a)
    if name == "box" and kind == mujoco.mjtGeom.mjGEOM_BOX:
        return shapes.Box(length_m=2 * a, width_m=2 * b, height_m=2 * c)
    if name == "cylinder" and kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return shapes.Cylinder(radius_m=a, height_m=2 * b)
    if name == "capsule" and kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return shapes.Capsule(radius_m=a, length_m=2 * (a + b))
    if name in get_args(PrismKind) and kind == mujoco.mjtGeom.mjGEOM_MESH:
        points = _geom_points(model, geom)
        outline = convex_hull(np.round(points[:, :2], 9))
        outline = outline - core_centroid(outline)
        return shapes.Prism(
            kind=name,  # type: ignore[arg-type]
            vertices_m=_rounded(outline),
            height_m=float(np.ptp(points[:, 2])),
        )
    return None


def _hulls(model: Any, geoms: list[int], name: str) -> shapes.Hulls:
    """Return the convex parts of an authored body, standing on the floor, centred."""
    parts = [_geom_points(model, g) for g in geoms]
    everything = np.concatenate(parts)
    centre = core_centroid(convex_hull(everything[:, :2]))
    middle = 0.5 * (everything[:, 2].min() + everything[:, 2].max())
    return _hulls_of(name, [p - (*centre, middle) for p in parts])


def _geom_points(model: Any, geom: int) -> Array:
    """Return points whose convex hull is the geom, in its body's frame, (k, 3) [m]."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
    local = _local_points(model, geom)
    return np.asarray(rotated_3d(local, rotation.reshape(3, 3)) + model.geom_pos[geom])


def _local_points(model: Any, geom: int) -> Array:
    size = model.geom_size[geom]
    kind = mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        points = model.mesh_vert[start : start + count].astype(float)
        return _hull_vertices(points)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        corners = shapes.Box(
            length_m=2 * size[0], width_m=2 * size[1], height_m=2 * size[2]
        )
        return corners.core()[0]
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return shapes.Cylinder(radius_m=size[0], height_m=2 * size[1]).core()[0]
    return _round_points(size, kind)


def _round_points(size: Array, kind: Any) -> Array:
    """Return points on a sphere, ellipsoid or capsule."""
    polar = np.linspace(0.0, np.pi, 9)
    around = np.arange(12) * (np.pi / 6)
    unit = np.array(
        [
            (math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t))
            for t in polar
            for p in around
        ]
    )
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return _hull_vertices(unit * size)
    points = unit * size[0]
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        points = points + np.sign(unit[:, 2:]) * (0.0, 0.0, 1.0) * size[1]
    return _hull_vertices(points)


def _hull_vertices(points: Array) -> Array:
    from scipy.spatial import ConvexHull

    return np.asarray(points[np.sort(ConvexHull(points).vertices)])


def largest_side(shape: Shape) -> float:
    """Return the longer side of the footprint's bounding box [m]."""
    west, south, east, north = shapely.bounds(shapes.footprint(shape).polygon())
    return float(max(east - west, north - south))
