"""Driving on two wheels: turning towards commands, and (v, omega)."""

import math

import msgspec
import numpy as np
import pytest

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.errors import SceneError, TemplateError
from beacon_mj.fidelity.benches import bench, block
from beacon_mj.fidelity.wheels import on_wheels
from beacon_mj.planners.push_through import PushThrough
from beacon_mj.scene import Robot
from beacon_mj.scene_gen.robots import shipped_robot
from beacon_mj.world import World
from beacon_mj.world.wheels import TURN_RATE_RADPS
from tests.worlds import drive


def towards(angle_rad: float, speed_mps: float = 0.3) -> tuple[float, float]:
    return speed_mps * math.cos(angle_rad), speed_mps * math.sin(angle_rad)


@pytest.mark.parametrize("degrees", [0, 30, 60, 90, 100, 120, 180, -45, -90, -150])
def test_it_moves_where_it_is_told(degrees: float) -> None:
    world, angle = on_wheels(), math.radians(degrees)
    drive(world, *[towards(angle)] * 20)
    assert np.abs(world.velocity_mps - towards(angle)).max() < 0.005
    moved = world.position_m - world.scene.start_m
    across = moved[1] * math.cos(angle) - moved[0] * math.sin(angle)
    assert abs(across) < 0.03


def test_it_drives_backwards_rather_than_turn_round() -> None:
    world = on_wheels()
    drive(world, *[towards(math.pi)] * 10)
    assert world.heading_rad == pytest.approx(0.0, abs=1e-3)
    drive(world, *[towards(math.pi - 1.0)] * 20)
    assert world.heading_rad == pytest.approx(-1.0, abs=0.01)


def test_commands_that_swing_about_a_right_angle_do_not_have_it_dither() -> None:
    world = on_wheels()
    swings = [towards(math.radians(90 + 15 * (-1) ** k)) for k in range(40)]
    drive(world, *swings)
    assert world.position_m[1] - world.scene.start_m[1] > 0.7


def test_it_stands_still_where_it_is_told_nothing() -> None:
    world = on_wheels()
    drive(world, *[(0.0, 0.0)] * 10)
    assert np.abs(world.position_m - world.scene.start_m).max() < 1e-6
    assert world.heading_rad == pytest.approx(0.0, abs=1e-9)


def test_v_and_omega_make_an_arc() -> None:
    world, v, omega = on_wheels(), 0.3, 1.0
    for _ in range(20):
        outcome = world.step(np.array([v, 0.0]), omega)
    angle = omega * 2.0
    arc = np.array([math.sin(angle), 1.0 - math.cos(angle)]) * v / omega
    assert world.position_m - world.scene.start_m == pytest.approx(arc, abs=0.03)
    assert world.heading_rad == pytest.approx(angle, abs=0.06)
    assert world.turn_rate_radps == pytest.approx(omega, rel=0.01)
    assert outcome.velocity_mps == pytest.approx(
        towards(world.heading_rad or 0.0), abs=0.02
    )


def test_a_turn_rate_above_the_limit_is_cut() -> None:
    world = on_wheels()
    for _ in range(10):
        world.step(np.zeros(2), -50.0)
    assert world.turn_rate_radps == pytest.approx(-TURN_RATE_RADPS, rel=0.01)


def test_it_turns_with_its_bumper_at_an_obstacle_and_says_where_it_is() -> None:
    world = on_wheels(block(gap_m=0.0, mass_kg=50.0))
    for _ in range(10):
        world.step(np.zeros(2), 1.0)
    outcomes = drive(world, *[(0.2, 0.0)] * 30)
    last = outcomes[-1]
    assert last.drive_effort == pytest.approx(1.0, abs=0.01)
    force = -last.bumper_force_n
    assert force[0] == pytest.approx(60.0, rel=0.02)
    assert abs(force[1]) < 3.0


def test_the_disc_has_no_heading() -> None:
    world = World(bench())
    assert (world.heading_rad, world.turn_rate_radps) == (None, None)
    assert world.robot is world.scene.robot


def test_a_world_has_the_robot_of_its_protocol() -> None:
    scene = bench()
    wheels = Protocol(robot=shipped_robot("diff-drive"), max_steps=3)
    with pytest.raises(SceneError, match="'diff-drive'"):
        run_episode(scene, PushThrough(), protocol=wheels, world=World(scene))


def test_a_room_for_a_wider_disc_is_none_for_it() -> None:
    wide = bench(robot=Robot(radius_m=0.2))
    with pytest.raises(TemplateError, match=r"0\.12 m"):
        World(wide, robot=shipped_robot("diff-drive"))


def test_the_family_chooses() -> None:
    scene = msgspec.structs.replace(bench(), robot_model="diff-drive")
    assert World(scene).heading_rad == 0.0
    trace = run_episode(scene, PushThrough(), protocol=Protocol(max_steps=5))
    assert trace.steps[-1].outcome.position_m[0] > scene.start_m[0]
