"""The emitted world, compared with the scene."""

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest

from beacon_mj.fidelity.benches import bench, block
from beacon_mj.scene import Robot
from beacon_mj.scene.shapes import Capsule, Prism, Sphere
from beacon_mj.scene_gen.mjcf import scene_mjcf
from beacon_mj.world import World
from tests.worlds import FAMILIES, cached_scene

NAMED = {"body", "geom", "joint", "freejoint", "site", "camera", "light", "mesh",
         "material", "texture", "general"}  # fmt: skip


def test_every_element_is_named_once(family: str) -> None:
    root = ET.fromstring(scene_mjcf(cached_scene(family, 0)))
    parts = [root.find(tag) for tag in ("worldbody", "asset", "actuator")]
    elements = [e for part in parts if part is not None for e in part.iter()]
    unnamed = [e.tag for e in elements if e.tag in NAMED and not e.get("name")]
    assert not unnamed
    for kind in NAMED:
        names = [e.get("name") for e in elements if e.tag == kind]
        assert len(names) == len(set(names))


def test_numbers_survive_the_text_bit_for_bit() -> None:
    scene = cached_scene("cluttered", 0)
    model = World(scene).model
    for o in scene.obstacles:
        assert tuple(model.body(o.id).pos[:2]) == (o.x_m, o.y_m)
        assert model.geom(o.id).friction[0] == o.friction
    again = mujoco.MjModel.from_xml_string(scene_mjcf(scene))
    np.testing.assert_array_equal(again.body_mass, model.body_mass)
    np.testing.assert_array_equal(again.qpos0, model.qpos0)


def test_walls_stand_on_the_border_of_the_workspace() -> None:
    model = World(bench()).model
    faces = {
        "wall_west": (0, 1.0, 0.0), "wall_east": (0, -1.0, 6.0),
        "wall_south": (1, 1.0, 0.0), "wall_north": (1, -1.0, 6.0),
    }  # fmt: skip
    for name, (axis, side, expected) in faces.items():
        wall = model.geom(name)
        assert wall.pos[axis] + side * wall.size[axis] == pytest.approx(expected)


def test_the_robot_is_the_scenes() -> None:
    robot = Robot(
        radius_m=0.2, height_m=0.3, mass_kg=20.0, force_max_n=100.0,
        bumper_stiffness_npm=8000.0,
    )  # fmt: skip
    model = World(bench(block(gap_m=0.5), robot=robot)).model
    assert model.geom("bumper").size[0] == 0.2
    mass = model.body("base").mass[0] + model.body("bumper").mass[0]
    assert mass == pytest.approx(20.0)
    assert model.joint("bumper_x").stiffness[0] == 8000.0
    np.testing.assert_allclose(model.actuator("drive_along").forcerange, (-100, 100))


def test_settings_are_those_that_were_measured() -> None:
    option = World(bench()).model.opt
    assert option.timestep == 0.002
    assert option.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert option.impratio == 100.0
    assert option.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert option.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP
    assert option.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET


def test_contacts_take_the_obstacles_friction() -> None:
    """Obstacle over floor and wall, bumper over all, the larger between obstacles."""
    scene = cached_scene("cluttered", 0)
    model = World(scene).model
    for o in scene.obstacles:
        geoms = [g for g in range(model.ngeom) if model.geom(g).name.startswith(o.id)]
        assert {int(model.geom_priority[g]) for g in geoms} == {1}
        rolls = isinstance(o.shape, Sphere | Capsule)
        assert {int(model.geom_condim[g]) for g in geoms} == {6 if rolls else 3}
    assert model.geom("floor").priority[0] == model.geom("wall_west").priority[0] == 0
    assert model.geom("bumper").priority[0] == 2


def test_prisms_stand_on_one_foot_a_vertex_and_only_on_the_floor() -> None:
    counted = 0
    for family in FAMILIES:
        scene = cached_scene(family, 0)
        model = World(scene).model
        floor = model.geom("floor")
        for o in scene.obstacles:
            if not isinstance(o.shape, Prism):
                continue
            feet = [
                model.geom(f"{o.id}_foot_{k}") for k in range(len(o.shape.vertices_m))
            ]
            for foot in feet:
                assert foot.contype[0] & floor.conaffinity[0]
                assert not foot.contype[0] & model.geom("bumper").conaffinity[0]
                assert not foot.contype[0] & model.geom(o.id).conaffinity[0]
            counted += 1
    assert counted > 10
