"""Shapes against the bodies that MuJoCo compiles from them."""

import itertools
import math

import mujoco
import numpy as np
import pytest
import shapely

from beacon_mj.fidelity.benches import bench, obstacle
from beacon_mj.geometry import Footprints
from beacon_mj.scene import shapes
from beacon_mj.scene.shapes import Shape
from beacon_mj.scene_gen.mjcf import scene_mjcf
from beacon_mj.world import World


def ngon(kind: shapes.PrismKind, count: int) -> shapes.Prism:
    angles = np.arange(count) * (2.0 * math.pi / count)
    outline = np.column_stack([0.2 * np.cos(angles), 0.15 * np.sin(angles)]).round(6)
    return shapes.Prism(
        kind=kind, vertices_m=tuple((x, y) for x, y in outline.tolist()), height_m=0.3
    )


def table() -> shapes.Hulls:
    """A top on two legs, of three boxes."""
    parts = []
    for (x, y, z), (a, b, c) in (
        ((0.0, 0.0, 0.06), (0.3, 0.2, 0.03)),
        ((-0.27, 0.0, -0.03), (0.03, 0.2, 0.06)),
        ((0.27, 0.0, -0.03), (0.03, 0.2, 0.06)),
    ):
        corners = itertools.product((-a, a), (-b, b), (-c, c))
        parts.append(tuple((x + u, y + v, z + w) for u, v, w in corners))
    volume = 8.0 * (0.3 * 0.2 * 0.03 + 2 * 0.03 * 0.2 * 0.06)
    return shapes.Hulls(name="table", parts_m=tuple(parts), volume_m3=volume)


ALL: dict[str, Shape] = {
    "sphere": shapes.Sphere(radius_m=0.15),
    "box": shapes.Box(length_m=0.4, width_m=0.25, height_m=0.3),
    "cylinder": shapes.Cylinder(radius_m=0.2, height_m=0.3),
    "capsule": shapes.Capsule(radius_m=0.12, length_m=0.5),
    "triangle": ngon("triangle", 3),
    "trapezoid": ngon("trapezoid", 4),
    "parallelogram": ngon("parallelogram", 4),
    "pentagon": ngon("pentagon", 5),
    "hexagon": ngon("hexagon", 6),
    "table": table(),
}


@pytest.fixture(params=ALL)
def shape(request: pytest.FixtureRequest) -> Shape:
    return ALL[request.param]


def test_name(shape: Shape) -> None:
    assert ALL[shapes.name_of(shape)] is shape


def test_volume_and_height_are_the_compiled_ones(shape: Shape) -> None:
    scene = bench(obstacle("thing", shape, mass_kg=7.0))
    world = World(scene)
    assert scene.obstacles[0].mass_kg == pytest.approx(7.0)
    assert world.model.body("thing").mass[0] == pytest.approx(7.0, rel=1e-6)
    assert world.poses[0, 2] == pytest.approx(0.5 * shape.height_m, abs=1e-3)


@pytest.mark.parametrize("yaw", [0.0, 0.7, 2.5])
def test_footprint_is_the_shadow_of_the_geometry(shape: Shape, yaw: float) -> None:
    """Support of the outline against MuJoCo's geoms, in 36 directions."""
    o = obstacle("thing", shape, (3.0, 2.5), yaw_rad=yaw)
    model = mujoco.MjModel.from_xml_string(scene_mjcf(bench(o)))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geoms = solid_geoms(model)
    outline = shapely.get_coordinates(o.footprint.polygon())
    for angle in np.arange(36) * (math.pi / 18):
        direction = np.array([math.cos(angle), math.sin(angle), 0.0])
        expected = max(_support(model, data, g, direction) for g in geoms)
        assert (outline @ direction[:2]).max() == pytest.approx(expected, abs=5e-4)


def solid_geoms(model: mujoco.MjModel) -> list[int]:
    """Return the geoms of the obstacle that the bumper can touch."""
    body = model.body("thing").id
    return [
        g
        for g in range(model.ngeom)
        if model.geom_bodyid[g] == body and model.geom_contype[g] & 2
    ]


def _support(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int, direction: np.ndarray
) -> float:
    """How far a geom reaches along a direction."""
    local = data.geom_xmat[geom].reshape(3, 3).T @ direction
    size, kind = model.geom_size[geom], mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        at = model.mesh_vertadr[mesh]
        vertices = model.mesh_vert[at : at + model.mesh_vertnum[mesh]]
        reach = float((vertices @ local).max())
    elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        reach = float(size[0])
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        reach = float(np.abs(local) @ size)
    else:
        across, along = np.hypot(local[0], local[1]), abs(local[2])
        capsule = kind == mujoco.mjtGeom.mjGEOM_CAPSULE
        reach = float(size[0] * (1.0 if capsule else across) + size[1] * along)
    return reach + float(data.geom_xpos[geom] @ direction)


@pytest.mark.parametrize("angle", [0.0, 0.8, 2.1, 3.9, 5.5])
def test_clearance_is_the_engines_distance_to_the_bumper(
    shape: Shape, angle: float
) -> None:
    """Robot at 5 cm from the footprint: MuJoCo measures 5 cm between the geoms."""
    position = np.array([3.0, 3.0]) + 1.2 * np.array([math.cos(angle), math.sin(angle)])
    o = obstacle("thing", shape, (3.0, 3.0), yaw_rad=0.4)
    footprints = Footprints.stack([o.footprint])
    near = footprints.nearest_points(position)[0]
    gap = footprints.distance(position)[0]
    position = near + (position - near) / gap * 0.17
    world = World(bench(o))
    world.data.qpos[:2] = position - (1.0, 3.0)
    mujoco.mj_kinematics(world.model, world.data)
    bumper = world.model.geom("bumper").id
    distance = min(
        mujoco.mj_geomDistance(world.model, world.data, bumper, g, 1.0, None)
        for g in solid_geoms(world.model)
    )
    assert distance == pytest.approx(0.05, abs=1e-3)


def test_a_tilted_shadow_is_that_of_the_turned_geometry() -> None:
    box = shapes.Box(length_m=0.2, width_m=0.3, height_m=0.8)
    rotation = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    lying = shapes.tilted_footprint(box, rotation).polygon()
    np.testing.assert_allclose(lying.bounds, (-0.4, -0.15, 0.4, 0.15), atol=1e-12)
    upright = shapes.tilted_footprint(box, np.eye(3)).polygon()
    assert upright.equals_exact(
        shapes.footprint(box).polygon(), 1e-9
    ) or upright.area == pytest.approx(0.06)


@pytest.mark.parametrize(
    ("vertices", "convex"),
    [
        ([(0, 0), (1, 0), (0, 1)], True),
        ([(0, 0), (0, 1), (1, 0)], False),
        ([(0, 0), (1, 0), (2, 0), (1, 1)], False),
        ([(0, 0), (2, 0), (0.4, 0.4), (0, 2)], False),
        ([(0, 0), (1, 0), (0, 1), (0, 0), (1, 0), (0, 1)], False),
    ],
)
def test_convexity(vertices: list[tuple[float, float]], convex: bool) -> None:
    assert shapes.is_convex_ccw(np.array(vertices, dtype=float)) is convex
