"""The planar world against its closed forms, and the paper's II.D and II.G by hand."""

import math

import numpy as np
import pytest

from beacon_mj.fidelity.benches import START_M, bench, block, obstacle
from beacon_mj.geometry import Array
from beacon_mj.pushing import PushModel
from beacon_mj.scene import shapes
from beacon_mj.scene.shapes import Box
from beacon_mj.world import StepOutcome
from beacon_mj.world.planar import PlanarWorld
from beacon_mj.world.planar_drive import driven
from tests.worlds import cached_scene, drive

MODELS: tuple[PushModel, ...] = ("paper", "limit-surface")
EXACT = 1e-9
AHEAD = np.array([0.3, 0.0])


def ahead(world: PlanarWorld, steps: int, speed: float = 0.3) -> list[StepOutcome]:
    return drive(world, *[(speed, 0.0)] * steps)


def row(*masses: float, gap_m: float = 0.05) -> PlanarWorld:
    """Blocks of 0.4 m in a row, printed model, friction 0.5."""
    blocks = [
        block(f"b{k}", gap_m + k * (0.4 + gap_m), mass_kg=m)
        for k, m in enumerate(masses)
    ]
    return PlanarWorld(bench(*blocks))


def moved(world: PlanarWorld) -> Array:
    starts = [o.x_m for o in world.scene.obstacles]
    return np.asarray(world.poses[:, 0] - starts)


def test_free_motion_is_the_ramp_of_the_drive() -> None:
    """From rest to v: v / a of ramp, a = F_max / M, then v."""
    world = PlanarWorld(bench())
    ahead(world, 3, 0.5)
    ramp = 0.5 * 10.0 / 60.0
    expected = START_M[0] + 0.5 * (0.3 - 0.5 * ramp)
    assert world.position_m[0] == pytest.approx(expected, abs=EXACT)
    np.testing.assert_allclose(world.velocity_mps, (0.5, 0.0), atol=EXACT)


@pytest.mark.parametrize("parts", [1, 3, 10])
def test_the_ramp_does_not_depend_on_how_time_is_cut(parts: int) -> None:
    robot = bench().robot
    velocity, command = np.array([0.1, -0.3]), np.array([-0.4, 0.2])
    whole = driven(velocity, command, robot, 0.12)
    travel, work = np.zeros(2), 0.0
    for _ in range(parts):
        part = driven(velocity, command, robot, 0.12 / parts)
        travel, velocity = travel + part.travel_m, part.velocity_mps
        work += part.work_j
    np.testing.assert_allclose(travel, whole.travel_m, atol=EXACT)
    np.testing.assert_allclose(velocity, whole.velocity_mps, atol=EXACT)
    assert work == pytest.approx(whole.work_j, abs=EXACT)


@pytest.mark.parametrize("model", MODELS)
def test_force_and_energy_of_a_push_are_f_and_f_d(model: PushModel) -> None:
    """II.D: F = mu rho V g = 0.5 * 4 * 9.81, E = F d."""
    world = PlanarWorld(bench(block(gap_m=0.05)), push=model)
    outcomes = ahead(world, 20)
    (travel,) = moved(world)
    assert travel == pytest.approx(world.position_m[0] - START_M[0] - 0.05, abs=EXACT)
    assert [-o.bumper_force_n[0] for o in outcomes[5:]] == pytest.approx(
        [19.62] * 15, rel=1e-9
    )
    (contact,) = outcomes[-1].contacts
    assert contact.filtered_peak_n == pytest.approx(19.62, rel=1e-9)
    work = math.fsum(o.actuator_work_j for o in outcomes)
    kinetic = 0.5 * 10.0 * 0.3**2
    assert work - kinetic == pytest.approx(19.62 * travel, rel=1e-7)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("mass", "gives"), [(12.2, True), (12.3, False)])
def test_a_push_is_feasible_up_to_f_max(
    model: PushModel, mass: float, gives: bool
) -> None:
    """II.D: F <= F_max = 60 N; mu m g = 59.8 N and 60.3 N."""
    world = PlanarWorld(bench(block(gap_m=0.05, mass_kg=mass)), push=model)
    outcomes = ahead(world, 20)
    assert bool(moved(world)[0] > 0.1) is gives
    if not gives:
        assert moved(world)[0] == 0.0
        assert world.position_m[0] == pytest.approx(START_M[0] + 0.05, abs=EXACT)
        assert -outcomes[-1].bumper_force_n[0] == pytest.approx(60.0)


def test_a_chain_travels_less_by_every_gap() -> None:
    """II.G by hand: the robot gets d into the row, link k moves d - k gaps."""
    world = row(2.0, 3.0, 1.0)
    outcomes = ahead(world, 20)
    depth = world.position_m[0] - START_M[0] - 0.05
    np.testing.assert_allclose(moved(world), depth - 0.05 * np.arange(3), atol=EXACT)
    energy = math.fsum(o.actuator_work_j for o in outcomes) - 0.5 * 10.0 * 0.3**2
    forces = 0.5 * 9.81 * np.array([2.0, 3.0, 1.0])
    assert energy == pytest.approx(float(forces @ moved(world)), rel=1e-9)


def test_each_link_alone_as_printed() -> None:
    """Three of 49 N pass: together 147 N, but no link is beyond 60 N."""
    world = row(10.0, 10.0, 10.0)
    outcomes = ahead(world, 20)
    assert moved(world)[2] > 0.1
    by_pair = {(c.obstacle, c.counterpart): c for c in outcomes[-1].contacts}
    assert set(by_pair) == {("b0", "robot"), ("b0", "b1"), ("b1", "b2")}
    for contact in by_pair.values():
        assert contact.filtered_n == pytest.approx(49.05, rel=1e-9)


def test_the_summed_force_of_a_row_stops_it_in_the_other_model() -> None:
    blocks = [block(f"b{k}", 0.05 + 0.4 * k, mass_kg=10.0) for k in range(3)]
    world = PlanarWorld(bench(*blocks), push="limit-surface")
    ahead(world, 20)
    np.testing.assert_allclose(moved(world), 0.0, atol=EXACT)


def test_the_chain_ends_at_the_first_infeasible_link() -> None:
    """II.G: b1 needs 98 N, so b0 moves up to it and no further."""
    world = row(2.0, 20.0, 1.0)
    ahead(world, 20)
    np.testing.assert_allclose(moved(world), (0.05, 0.0, 0.0), atol=EXACT)
    assert world.position_m[0] == pytest.approx(START_M[0] + 0.1, abs=EXACT)


def test_an_obstacle_translates_along_the_contact_normal() -> None:
    """Printed model: a disc is pushed along the line of centres, and does not turn."""
    disc = shapes.Cylinder(radius_m=0.2, height_m=0.3)
    at = (START_M[0] + 0.31, START_M[1] + 0.1)
    world = PlanarWorld(bench(obstacle("disc", disc, at)))
    ahead(world, 2, 0.5)
    before = world.poses[0, :2] - world.position_m
    assert np.hypot(*before) == pytest.approx(0.32, abs=EXACT)
    ahead(world, 1, 0.5)
    assert world.poses[0, 1] > at[1]
    np.testing.assert_array_equal(world.poses[0, 3:], (1.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("model", MODELS)
def test_the_disc_slides_along_a_wall(model: PushModel) -> None:
    world = PlanarWorld(bench(), push=model)
    drive(world, *[(-0.4, 0.3)] * 60)
    x, y = world.position_m
    assert x == pytest.approx(0.12, abs=EXACT)
    assert y > 4.0


@pytest.mark.parametrize("model", MODELS)
def test_a_corner_of_the_room_holds_the_disc(model: PushModel) -> None:
    world = PlanarWorld(bench(), push=model)
    drive(world, *[(-0.4, -0.4)] * 150)
    np.testing.assert_allclose(world.position_m, (0.12, 0.12), atol=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_walls_stop_what_is_pushed(model: PushModel) -> None:
    box = obstacle("box", Box(length_m=0.4, width_m=0.4, height_m=0.25), (5.5, 3.0))
    world = PlanarWorld(bench(box), push=model)
    ahead(world, 110, 0.5)
    assert world.poses[0, 0] == pytest.approx(5.8, abs=0.0011)


def test_an_off_centre_push_turns_in_one_model_only() -> None:
    at = (START_M[0] + 0.37, START_M[1] - 0.06)
    box = obstacle("box", Box(length_m=0.4, width_m=0.4, height_m=0.25), at)
    turned = {}
    for model in MODELS:
        world = PlanarWorld(bench(box), push=model)
        ahead(world, 10)
        turned[model] = 2.0 * math.atan2(world.poses[0, 6], world.poses[0, 3])
    assert turned["paper"] == 0.0
    assert turned["limit-surface"] < -0.05


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("family", ["cluttered", "collision-required"])
@pytest.mark.parametrize("index", range(4))
def test_nothing_is_driven_into_anything(
    model: PushModel, family: str, index: int
) -> None:
    """Random drives through real scenes: 1 mm of overlap at most, rotation included."""
    world = PlanarWorld(cached_scene(family, index), push=model)
    rng = np.random.default_rng(index)
    for _ in range(150):
        towards = np.array(world.scene.goal_m) - world.position_m
        world.step(0.4 * towards / np.hypot(*towards) + rng.normal(0.0, 0.25, 2))
        gaps = world.footprints.distance(world.position_m)
        assert gaps.min() > world.scene.robot.radius_m - 1e-3
    polygons = [o.polygon() for o in world.outlines]
    for k, one in enumerate(polygons):
        for other in polygons[:k]:
            assert one.intersection(other).area < 1e-3 * 0.4


@pytest.mark.parametrize("model", MODELS)
def test_half_the_step_changes_little(model: PushModel) -> None:
    box = obstacle("box", Box(length_m=0.4, width_m=0.3, height_m=0.3),
                   (START_M[0] + 0.37, START_M[1] - 0.05))  # fmt: skip
    ends = []
    for timestep_s in (0.002, 0.001):
        world = PlanarWorld(bench(box), timestep_s, model)
        ahead(world, 12)
        ends.append(world.poses[0])
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-3)
