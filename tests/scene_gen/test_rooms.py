"""Rooms of any size: start, goal, obstacles, cameras, steps, and battery follow."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import msgspec
import numpy as np
import pytest

from beacon_mj.episode.episode import make_task
from beacon_mj.episode.protocol import Protocol, battery_slope
from beacon_mj.errors import TemplateError
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import Scene, Sensing
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.mjcf import scene_mjcf
from beacon_mj.world import World
from tests.worlds import cached_scene

SIZES = ((3.0, 3.0), (12.0, 6.0), (6.0, 11.0), (50.0, 50.0))


def in_room(folder: Path, family: str, width: float, height: float) -> Scene:
    text = (ROOT / "families" / f"{family}.xml").read_text()
    room = f'<custom>\n<numeric name="workspace" data="{width} {height}"/>'
    text = text.replace("<custom>", room)
    if width < 6.0:
        text = text.replace('data="5 8"', 'data="2 3"')
    (folder / "roomy.xml").write_text(text)
    return generate_scene("roomy", 0, 2000, templates=folder)


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_start_goal_and_obstacles_use_the_whole_room(
    width: float, height: float, tmp_path: Path
) -> None:
    scene = in_room(tmp_path, "sparse", width, height)
    assert scene.workspace_m == (0.0, 0.0, width, height)
    assert scene.start_m[0] <= 0.75
    assert scene.goal_m[0] >= width - 0.75
    assert width - 1.4 <= scene.certificate.straight_line_m <= width - 0.6
    assert scene.certificate.collision_free_length_m is not None
    places = np.array([(o.x_m / width, o.y_m / height) for o in scene.obstacles])
    assert np.ptp(places, axis=0).max() > 0.3
    world = World(scene)
    walls = {n: world.model.geom(f"wall_{n}").pos for n in ("east", "north")}
    assert walls["east"][0] == pytest.approx(width + 0.05)
    assert walls["north"][1] == pytest.approx(height + 0.05)


@pytest.mark.parametrize("family", ["collision-required", "collision-shortcut"])
def test_barriers_reach_from_wall_to_wall(family: str, tmp_path: Path) -> None:
    scene = in_room(tmp_path, family, 9.0, 8.0)
    free = scene.certificate.collision_free_length_m
    assert (free is None) == (family == "collision-required")
    assert scene.certificate.door_ids
    in_barrier = [o for o in scene.obstacles if abs(o.x_m - 4.5) < 0.5]
    assert max(o.y_m for o in in_barrier) > 7.0 or free is not None


def test_cameras_see_all_of_a_larger_room(tmp_path: Path) -> None:
    usual = ET.fromstring(scene_mjcf(cached_scene("sparse", 0)))
    larger = ET.fromstring(scene_mjcf(in_room(tmp_path, "sparse", 12.0, 6.0)))
    for name, back in (("overhead", 0.0), ("overview", 6.6)):
        cameras = [t.find(f".//camera[@name='{name}']") for t in (usual, larger)]
        before, after = (
            np.array(list(map(float, c.get("pos", "").split())))
            for c in cameras
            if c is not None
        )
        assert after[2] == pytest.approx(2.0 * before[2])
        assert after[:2] == pytest.approx((6.0, 3.0 - 2.0 * back))


def test_a_room_out_of_bounds_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        TemplateError, match=r"'workspace' to be 2 value\(s\) in \[3, 50"
    ):
        in_room(tmp_path, "sparse", 51.0, 6.0)


def resized(scene: Scene, width: float, height: float) -> Scene:
    return msgspec.structs.replace(scene, workspace_m=(0.0, 0.0, width, height))


def test_steps_grow_with_the_diagonal_and_never_shrink() -> None:
    scene = cached_scene("sparse", 0)
    assert Protocol().step_limit(scene) == 1000
    assert Protocol().step_limit(resized(scene, 3.0, 3.0)) == 1000
    assert Protocol().step_limit(resized(scene, 12.0, 12.0)) == 2000
    assert Protocol(max_steps=7).step_limit(resized(scene, 12.0, 12.0)) == 7
    assert make_task(resized(scene, 12.0, 12.0), Protocol(), 0).max_steps == 2000


def test_a_full_battery_lasts_for_one_diagonal() -> None:
    scene = resized(cached_scene("sparse", 0), 12.0, 5.0)
    assert battery_slope(scene) * math.hypot(12.0, 5.0) == pytest.approx(1.0)


OWN = Sensing(radius_m=10.0, occlusion=True, pose_noise_m=0.01, missed_detection=0.2)


def test_the_sensor_is_the_users_else_the_familys_else_the_default() -> None:
    plain = cached_scene("sparse", 0)
    own = msgspec.structs.replace(plain, sensing=OWN)
    for protocol, scene, expected in (
        (Protocol(), plain, (1.0, False, 0.0, 0.0)),
        (Protocol(), own, (10.0, True, 0.01, 0.2)),
        (
            Protocol(
                sensing_radius_m=1.0,
                occlusion=False,
                pose_noise_m=0.0,
                missed_detection=0.0,
            ),
            own,
            (1.0, False, 0.0, 0.0),
        ),
        (Protocol(sensing_radius_m=2.0), own, (2.0, True, 0.01, 0.2)),
    ):
        sensor = protocol.sensor(scene)
        assert expected == (
            sensor.range_m,
            sensor.occlusion,
            sensor.pose_noise_m,
            sensor.missed_detection,
        )
        assert make_task(scene, protocol, 0).sensing_radius_m == expected[0]
