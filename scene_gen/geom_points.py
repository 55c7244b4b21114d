"""The geoms of a compiled model, as points in the frame of the obstacle."""

import math
from collections.abc import Container
from typing import Any

import mujoco
import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.numerics import rotated_3d
from beacon_mj.scene import shapes


def geom_points(model: Any, geom: int, coarse: Container[int] = ()) -> Array:
    """Return points whose convex hull is the geom, (k, 3) [m].

    The frame is the world's, its origin that of the obstacle's outermost body.

    Args:
        model: The compiled model.
        geom: Number of the geom.
        coarse: Numbers of the meshes whose hull the template limits (`maxhullvert`):
            theirs is as MuJoCo made it.
    """
    local = _local_points(model, geom, coarse)
    points = rotated_3d(local, _matrix(model.geom_quat[geom]))
    points = points + model.geom_pos[geom]
    body = model.geom_bodyid[geom]
    while model.body_parentid[body] != 0:
        points = rotated_3d(points, _matrix(model.body_quat[body]))
        points = points + model.body_pos[body]
        body = model.body_parentid[body]
    return rotated_3d(points, _matrix(model.body_quat[body]))


def geom_rotation(model: Any, geom: int) -> Array:
    """Return the rotation of a geom in the world, (3, 3)."""
    rotation, body = _matrix(model.geom_quat[geom]), model.geom_bodyid[geom]
    while body != 0:
        # Columns of a product of matrices are the columns, rotated.
        rotation = rotated_3d(rotation.T, _matrix(model.body_quat[body])).T
        body = model.body_parentid[body]
    return rotation


def _matrix(quaternion: Array) -> Array:
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, quaternion)
    return flat.reshape(3, 3)


def _local_points(model: Any, geom: int, coarse: Container[int]) -> Array:
    size = model.geom_size[geom]
    kind = mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        points = model.mesh_vert[start : start + count].astype(float)
        known = _known_hull(model, mesh)
        if mesh in coarse or len(known) == count:
            return np.asarray(points[known])
        return _hull_vertices(points)  # MuJoCo's has other tolerances.
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        corners = shapes.Box(
            length_m=2 * size[0], width_m=2 * size[1], height_m=2 * size[2]
        )
        return corners.core()[0]
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return shapes.Cylinder(radius_m=size[0], height_m=2 * size[1]).core()[0]
    return _round_points(size, kind)


def _known_hull(model: Any, mesh: int) -> Array:
    """Return which vertices of a mesh are its hull's in MuJoCo, (k,); maybe none."""
    if model.mesh_graphadr[mesh] < 0:
        return np.empty(0, int)
    # The record of a hull: k, the number of faces, k addresses of edges, k vertices.
    record = model.mesh_graph[model.mesh_graphadr[mesh] :]
    count = int(record[0])
    return np.sort(record[2 + count : 2 + 2 * count])


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
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(points[np.sort(ConvexHull(points).vertices)])
    except QhullError as error:
        raise ValueError("Expected points of a solid but they lie flat.") from error
