"""Ranges against a closed form, and against shapely in the plane."""

import math

import msgspec
import numpy as np
import pytest
import shapely

from beacon_mj.fidelity.benches import START_M, bench, block, obstacle
from beacon_mj.geometry import Array
from beacon_mj.interface import beam_angles
from beacon_mj.scene import Robot, Scene, shapes
from beacon_mj.scene_gen.robots import shipped_robot
from beacon_mj.world import BaseWorld, World
from beacon_mj.world.lidar import Lidar, scan_height_m
from tests.worlds import WORLDS, cached_scene, drive

FAR_M = 20.0
#: Shapes whose section is the same at every height that a beam can have.
UPRIGHT = (shapes.Box, shapes.Cylinder, shapes.Prism)


def room_m(angle: float, position: Array) -> float:
    """Return the distance to the walls of a room of 6 x 6 m along one direction."""
    c, s = math.cos(angle), math.sin(angle)
    x, y = position.tolist()
    walls: list[float] = [(6.0 - x) / c if c > 0 else -x / c] if abs(c) > 1e-12 else []
    walls += [(6.0 - y) / s if s > 0 else -y / s] if abs(s) > 1e-12 else []
    return min(walls)


def test_an_empty_room_is_a_square() -> None:
    world = World(bench())
    for beams in (1, 4, 7, 360):
        found = Lidar(world, beams, FAR_M).ranges_m()
        expected = [room_m(a, world.position_m) for a in beam_angles(beams).tolist()]
        np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("radius", [0.15, 0.3])
def test_a_cylinder_is_a_circle(radius: float) -> None:
    """r = d cos t - sqrt(R^2 - d^2 sin^2 t), the nearer root, where it is real."""
    away, shape = 1.0, shapes.Cylinder(radius_m=radius, height_m=0.3)
    scene = bench(obstacle("drum", shape, (START_M[0] + away, START_M[1])))
    world = World(scene)
    found = Lidar(world, 720, FAR_M).ranges_m()
    hits = 0
    for angle, measured in zip(beam_angles(720).tolist(), found, strict=True):
        under = radius * radius - (away * math.sin(angle)) ** 2
        if under > 1e-6 and math.cos(angle) > 0.0:
            hits += 1
            near = away * math.cos(angle) - math.sqrt(under)
            assert measured == pytest.approx(near, abs=1e-5)
        elif under < -1e-6:
            assert measured == pytest.approx(room_m(angle, world.position_m), abs=1e-9)
    assert hits > 20


def test_nothing_is_nearer_than_the_robot_or_farther_than_the_range() -> None:
    world = World(cached_scene("cluttered", 0))
    found = Lidar(world, 500, 1.2).ranges_m()
    assert np.isinf(found).any()
    assert np.isfinite(found).any()
    assert found.min() >= world.scene.robot.radius_m
    assert found[np.isfinite(found)].max() <= 1.2
    far = Lidar(world, 500, FAR_M).ranges_m()
    np.testing.assert_array_equal(np.where(far <= 1.2, far, np.inf), found)


def upright(scene: Scene) -> Scene:
    """Return a scene without what is round from top to bottom."""
    kept = tuple(o for o in scene.obstacles if isinstance(o.shape, UPRIGHT))
    return msgspec.structs.replace(scene, obstacles=kept)


def brute_force(world: BaseWorld, beams: int) -> Array:
    """Return the ranges as shapely finds them among footprints and walls."""
    x, y = world.position_m
    west, south, east, north = world.scene.workspace_m
    walls = shapely.box(west, south, east, north).exterior
    solid = shapely.union_all([f.polygon() for f in world.outlines])
    eye, out = shapely.Point(x, y), []
    for angle in beam_angles(beams).tolist():
        end = x + FAR_M * math.cos(angle), y + FAR_M * math.sin(angle)
        ray = shapely.LineString([(x, y), end])
        met = [shapely.intersection(ray, thing) for thing in (walls, solid)]
        out.append(min(shapely.distance(eye, m) for m in met if not m.is_empty))
    return np.array(out)


@pytest.mark.parametrize("family", ["cluttered", "collision-required"])
@pytest.mark.parametrize("index", [0, 1, 2])
def test_rays_are_those_of_the_plane(family: str, index: int) -> None:
    """But for grazing beams: outlines of round shapes are polygons in shapely."""
    world = World(upright(cached_scene(family, index)))
    assert len(world.footprints) > 3
    found, expected = Lidar(world, 360, FAR_M).ranges_m(), brute_force(world, 360)
    close = np.abs(found - expected) < 2e-3
    assert close.mean() > 0.98


@pytest.mark.parametrize("name", WORLDS)
def test_rays_are_those_of_every_world_after_a_push(name: str) -> None:
    scene = bench(block("crate", 0.1))
    world = WORLDS[name](scene)
    lidar = Lidar(world, 360, FAR_M)
    drive(world, *[(0.4, 0.05)] * 12)
    assert world.outlines[0].centroid[0] > scene.obstacles[0].x_m + 0.1
    found, expected = lidar.ranges_m(), brute_force(world, 360)
    assert (np.abs(found - expected) < 2e-3).mean() > 0.98


def test_no_beam_hits_the_wheels_or_turns_with_the_robot() -> None:
    scene = upright(cached_scene("cluttered", 0))
    world = World(scene, robot=shipped_robot("diff-drive"))
    lidar = Lidar(world, 360, FAR_M)
    drive(world, *[(0.1, 0.4)] * 15)
    found, expected = lidar.ranges_m(), brute_force(world, 360)
    assert found.min() >= scene.robot.radius_m
    assert (np.abs(found - expected) < 2e-3).mean() > 0.98


def test_looking_changes_nothing() -> None:
    scene = cached_scene("collision-required", 0)
    plain, watched = World(scene), World(scene)
    lidar = Lidar(watched, 90, FAR_M)
    before = lidar.ranges_m()
    for _ in range(40):
        for world in (plain, watched):
            world.step(np.array([0.4, 0.3]))
        lidar.ranges_m()
        assert plain.data.qpos.tobytes() == watched.data.qpos.tobytes()
        assert plain.data.qvel.tobytes() == watched.data.qvel.tobytes()
    assert (lidar.ranges_m() != before).mean() > 0.5


def test_the_lidar_is_half_way_up() -> None:
    low = shapes.Box(length_m=0.4, width_m=0.4, height_m=0.08)
    box = obstacle("box", low, (START_M[0] + 1.0, START_M[1]))
    over, into = Robot(height_m=0.2), Robot(height_m=0.1)
    assert scan_height_m(over.height_m) > 0.08 > scan_height_m(into.height_m)
    ranges = [
        Lidar(World(bench(box, robot=robot)), 4, FAR_M).ranges_m()[0]
        for robot in (over, into)
    ]
    assert ranges[0] > 4.0
    assert ranges[1] == pytest.approx(0.8, abs=1e-3)
