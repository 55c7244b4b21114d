"""Robots: what is shipped, and what the contract says about files of other people."""

from pathlib import Path

import msgspec
import mujoco
import pytest

from beacon_mj.errors import TemplateError
from beacon_mj.scene import Robot
from beacon_mj.scene_gen.mjcf import scene_mjcf
from beacon_mj.scene_gen.robot_contract import (
    differential_drive,
    fitted,
    robot_faults,
    robot_sizes,
)
from beacon_mj.scene_gen.robots import (
    RobotFile,
    find_robot,
    read_robot,
    robot_in,
    robot_paths,
    shipped_robot,
)
from tests.own_robot import OWN_ROBOT
from tests.worlds import cached_scene


def own(
    tmp_path: Path, old: str = "", new: str = "", name: str = "porter"
) -> RobotFile:
    assert old in OWN_ROBOT
    path = tmp_path / f"{name}.xml"
    path.write_text(OWN_ROBOT.replace(old, new) if old else OWN_ROBOT)
    return read_robot(path)


@pytest.mark.parametrize("name", robot_paths())
def test_shipped_robots_keep_the_contract_and_open_alone(name: str) -> None:
    robot = shipped_robot(name)
    assert robot_faults(robot) == []
    assert robot.name == name == str(robot)
    model = mujoco.MjModel.from_xml_path(str(robot_paths()[name]))
    nq, nv = robot_sizes(robot)
    assert (model.body("base").id, len(model.qpos0), model.nv) == (1, nq, nv)


def test_the_two_shipped_robots() -> None:
    assert [*robot_paths()] == ["diff-drive", "disc"]
    assert fitted(shipped_robot("disc"), Robot()) == Robot()
    wheels = fitted(shipped_robot("diff-drive"), Robot())
    assert wheels.mass_kg == pytest.approx(10.0, rel=1e-12)
    assert wheels == msgspec.structs.replace(Robot(), mass_kg=wheels.mass_kg)
    known = differential_drive(shipped_robot("diff-drive"))
    assert known.half_track_m == 0.085
    assert known.grip == pytest.approx(0.9 * 2 * 49.0 / 60.0, rel=0.01)


def test_a_robot_that_is_not_ours(tmp_path: Path) -> None:
    robot = own(tmp_path)
    assert robot_faults(robot) == []
    assert str(robot) == "porter.xml"
    found = fitted(robot, Robot())
    assert found.mass_kg == pytest.approx(13.0 + 2 * 0.4 + 0.8)
    assert found.force_max_n == pytest.approx(2 * 0.75 / 0.03)
    assert found.bumper_stiffness_npm == 4000.0
    assert (found.radius_m, found.speed_mps) == (0.12, 0.5)
    assert differential_drive(robot).half_track_m == pytest.approx(0.088)


def test_a_family_that_wants_less_force_gets_less(tmp_path: Path) -> None:
    weak = msgspec.structs.replace(
        cached_scene("sparse", 0), robot=Robot(force_max_n=30)
    )
    for robot in (shipped_robot("diff-drive"), own(tmp_path)):
        model = mujoco.MjModel.from_xml_string(scene_mjcf(weak, robot=robot))
        radius = float(model.geom("wheel_left").size[0])
        torque = float(model.actuator("drive_right").forcerange[1])
        assert 2.0 * torque / radius == pytest.approx(30.0)


#: A change of the file, and a word of the one line that says what is wrong.
FAULTS = [
    ('<body name="base">', '<body name="hull">', "'base'"),
    ('<site name="footprint" size="0.12"/>', "", 'site name="footprint"'),
    ('<site name="footprint" size="0.12"/>',
     '<site name="footprint" size="0.1"/>', "0.12 m"),
    ('name="base_yaw" type="hinge"', 'name="base_yaw" type="slide"', "hinge"),
    ('<joint name="base_x" type="slide" axis="1 0 0"/>',
     '<joint name="base_x" type="slide" axis="0 0 1"/>', "'base_x' to be a slide"),
    ('<joint name="base_x" type="slide" axis="1 0 0"/>',
     '<joint name="base_x" type="slide" axis="1 0 0" damping="3"/>', "move freely"),
    ('<compiler angle="radian"/>', "", "radian"),
    ('<compiler angle="radian"/>',
     '<compiler angle="radian"/><option timestep="0.01"/>', "no <option>"),
    ('<compiler angle="radian"/>',
     '<compiler angle="radian"/><default><geom friction="2"/></default>',
     "whole room"),
    ('type="box" pos="0 0 0.1" size="0.06 0.06 0.05"', 'type="mesh" mesh="car"',
     "no mesh="),
    ('size="0.06 0.06 0.05"', 'size="0.2 0.06 0.05"', "'hull' within the footprint"),
    ('mass="13"\n            contype="0"', 'mass="13"\n            contype="1"',
     "only the bumper touches"),
    ('size="0.12 0.08"', 'size="0.11 0.08"', "cylinder of radius 0.12 m"),
    ('priority="2"', 'priority="0"', "priority"),
    ('axis="0 1 0" stiffness="4000"', 'axis="0 1 0" stiffness="3000"', "equally stiff"),
    ('geom1="wheel_right" geom2="floor"', 'geom1="wheel_right" geom2="hull"',
     'geom2="wheel_right"'),
    ('type="sphere" size="0.03"', 'type="capsule" size="0.03 0.005"', "one point"),
    ('pos="0 0.088 0.03"', 'pos="0.01 0.088 0.03"', "left and right of the middle"),
    ('pos="0 0.088 0.03"', 'pos="0 0.088 0.03" euler="0 0 0.3"', "not to be turned"),
    ('joint="wheel_left" kv="1"', 'joint="wheel_left" kv="2"', "one gain"),
    ('forcerange="-0.75 0.75"', 'forcerange="-2 2"', "tyres that hold"),
    ('forcerange="-0.75 0.75"', 'forcerange="-0.5 0.75"', "limit of torque"),
    ("</mujoco>", "", "XML"),
    ("<worldbody>", "<!DOCTYPE x><worldbody>", "XML"),
    ('springref="-0.2"', 'springref="0.2"', "tyres that hold"),
    ('name="axle_left"', 'name="sun" mocap="true"', "no mocap="),
    ('<geom name="hull"', '<geom name="wall_west"', "MuJoCo cannot compile"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "word"), FAULTS)
def test_each_fault_is_one_line(tmp_path: Path, old: str, new: str, word: str) -> None:
    robot = own(tmp_path, old, new)
    found = robot_faults(robot)
    assert any(word in line for line in found), found
    assert all("\n" not in line for line in found)
    with pytest.raises(TemplateError, match="robot 'porter'"):
        fitted(robot, Robot())


def test_faults_come_together(tmp_path: Path) -> None:
    path = tmp_path / "empty.xml"
    path.write_text("<mujoco><worldbody/></mujoco>")
    found = robot_faults(read_robot(path))
    assert len(found) > 15
    assert len({*found}) == len(found)


def test_what_is_recorded_is_the_file(tmp_path: Path) -> None:
    robot = own(tmp_path)
    text = msgspec.json.encode(robot)
    assert msgspec.json.decode(text, type=RobotFile) == robot
    forged = text.replace(b"0.088", b"0.089")
    assert forged != text
    with pytest.raises(msgspec.ValidationError, match="SHA-256"):
        msgspec.json.decode(forged, type=RobotFile)


def test_a_robot_is_found_by_name_or_file(tmp_path: Path) -> None:
    own(tmp_path)
    assert find_robot("disc").is_disc
    assert find_robot(str(tmp_path / "porter.xml")).name == "porter"
    with pytest.raises(TemplateError, match=r"'disk'.*'disc'.*diff-drive, disc"):
        find_robot("disk")
    with pytest.raises(TemplateError, match="cannot read the robot"):
        find_robot(str(tmp_path / "none.xml"))
    bad = tmp_path / "1.xml"
    bad.write_text(OWN_ROBOT)
    with pytest.raises(TemplateError, match="called by a letter"):
        find_robot(str(bad))


def test_a_copy_of_the_disc_is_the_disc_and_a_changed_one_is_none(
    tmp_path: Path,
) -> None:
    path = tmp_path / "mine.xml"
    path.write_bytes(robot_paths()["disc"].read_bytes())
    assert read_robot(path).is_disc
    path.write_text(path.read_text().replace("5000", "6000"))
    assert robot_faults(read_robot(path))


def test_a_scene_that_chooses_its_robot() -> None:
    scene = cached_scene("sparse", 0)
    assert robot_in(scene).is_disc
    chosen = msgspec.structs.replace(scene, robot_model="diff-drive")
    assert robot_in(chosen).name == "diff-drive"
    assert robot_in(chosen, shipped_robot("disc")).is_disc
    assert b"robot_model" in chosen.to_json()
    assert b"robot_model" not in scene.to_json()
