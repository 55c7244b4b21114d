"""Contact forces against MuJoCo's own, and what they break."""

import mujoco
import numpy as np
import pytest

from beacon_mj.fidelity.benches import START_M, bench, block, obstacle
from beacon_mj.scene import Scene
from beacon_mj.scene.shapes import Box, Cylinder
from beacon_mj.world import World
from beacon_mj.world.contacts import PairTable, find_damage

AHEAD = np.array([0.4, 0.0])


def engine_force(world: World, name: str) -> np.ndarray:
    """Sum the forces of the bumper on one obstacle with `mj_contactForce`."""
    model, data = world.model, world.data
    bumper, geom = model.geom("bumper").id, model.geom(name).id
    total, wrench = np.zeros(3), np.zeros(6)
    for k in range(data.ncon):
        contact = data.contact[k]
        if {int(g) for g in contact.geom} != {bumper, geom}:
            continue
        mujoco.mj_contactForce(model, data, k, wrench)
        force = contact.frame.reshape(3, 3).T @ wrench[:3]
        total += force if contact.geom[1] == geom else -force
    return total


@pytest.mark.parametrize(
    "shape",
    [
        Box(length_m=0.4, width_m=0.4, height_m=0.25),
        Cylinder(radius_m=0.2, height_m=0.3),
    ],
)
def test_force_on_an_obstacle_is_the_engines(shape: Box | Cylinder) -> None:
    scene = bench(obstacle("thing", shape, (START_M[0] + 0.42, START_M[1] + 0.03)))
    world = World(scene)
    compared = 0
    for _ in range(20):
        outcome = world.step(AHEAD)
        expected = engine_force(world, "thing")
        got = sum(
            (c.force_n for c in outcome.contacts if c.counterpart == "robot"),
            np.zeros(3),
        )
        np.testing.assert_allclose(got, expected, atol=1e-9)
        compared += bool(np.hypot(*expected[:2]) > 1.0)
    assert compared > 5


def test_force_points_from_the_robot_into_the_obstacle() -> None:
    world = World(bench(block(mass_kg=4.0)))
    outcomes = [world.step(AHEAD) for _ in range(20)]
    (contact,) = outcomes[-1].contacts
    assert (contact.obstacle, contact.counterpart) == ("block", "robot")
    assert contact.force_n[0] > 10.0
    assert abs(contact.force_n[1]) < 2.5
    assert outcomes[-1].bumper_force_n[0] < -10.0
    assert contact.point_m[0] == pytest.approx(world.position_m[0] + 0.12, abs=0.01)


def test_peak_is_at_least_the_filtered_peak_and_the_window_mean() -> None:
    world = World(bench(block(gap_m=0.02)))
    for _ in range(10):
        for contact in world.step(AHEAD).contacts:
            assert contact.peak_n >= contact.filtered_peak_n >= contact.filtered_n
            assert contact.impulse_ns <= contact.peak_n * 0.1 + 1e-9


def test_filtered_force_is_the_mean_of_the_last_ten_milliseconds() -> None:
    scene, forces = bench(block(gap_m=0.02)), []
    world = World(scene, watch=lambda: forces.append(engine_force(world, "block")))
    checked = 0
    for _ in range(8):
        outcome = world.step(AHEAD)
        sizes = np.linalg.norm(np.array(forces[-5:]), axis=1)
        for contact in outcome.contacts:
            assert contact.filtered_n == pytest.approx(sizes.mean(), abs=1e-9)
            checked += 1
    assert checked > 3
    assert len(forces) == 8 * 50


def test_robot_against_a_wall_is_reported_and_is_no_obstacle() -> None:
    world = World(bench())
    west = np.array([-0.5, 0.0])
    contacts = [c for _ in range(30) for c in world.step(west).contacts]
    assert contacts
    assert {(c.obstacle, c.counterpart) for c in contacts} == {("robot", "wall")}
    assert contacts[-1].filtered_n == pytest.approx(60.0, rel=0.02)


def squeezed(force_n: float) -> Scene:
    """A fragile block between the robot and a welded one."""
    near = block("vase", gap_m=0.05, break_force_n=force_n, mass_kg=1.0)
    wall = obstacle(
        "pillar",
        Box(length_m=0.4, width_m=0.4, height_m=0.25),
        (near.x_m + 0.401, near.y_m),
        interaction="safe",
        fixed=True,
    )
    return bench(near, wall)


def test_opposed_contacts_do_not_cancel() -> None:
    world = World(squeezed(30.0))
    damages = [d for _ in range(20) for d in world.step(np.array([0.1, 0.0])).damages]
    assert [d.obstacle for d in damages] == ["vase"]
    assert damages[0].counterpart in ("robot", "pillar")
    assert damages[0].force_n > 30.0


def test_damage_is_latched_until_reset() -> None:
    world = World(bench(block(break_force_n=15.0, mass_kg=1.0)))
    damages = [d for _ in range(30) for d in world.step(AHEAD).damages]
    assert len(damages) == 1
    assert bool(world.broken[0])
    for _ in range(10):
        assert not world.step(-AHEAD).damages
    assert bool(world.broken[0])
    world.reset()
    assert not world.broken[0]


def test_a_blow_between_two_control_steps_counts() -> None:
    """Robot and vase part before the control step ends; its last force is zero."""
    vase = block("vase", gap_m=0.15, mass_kg=0.4, friction=0.05, break_force_n=3.0)
    world = World(bench(vase))
    outcome = [world.step(AHEAD) for _ in range(5)][-1]
    (damage,) = outcome.damages
    (contact,) = outcome.contacts
    assert contact.filtered_n < 0.1
    assert outcome.time_s - 0.1 < damage.time_s < outcome.time_s
    assert contact.filtered_peak_n >= damage.force_n > 3.0


@pytest.mark.parametrize("speed", [0.1, 0.2, 0.3, 0.4, 0.5])
@pytest.mark.parametrize("mass", [0.5, 2.0, 8.0])
def test_half_the_timestep_gives_the_same_peak(speed: float, mass: float) -> None:
    peaks = []
    for timestep in (0.002, 0.001):
        world = World(bench(block(gap_m=0.1, mass_kg=mass)), timestep)
        contacts = [
            c for _ in range(20) for c in world.step(np.array([speed, 0.0])).contacts
        ]
        peaks.append(max(c.filtered_peak_n for c in contacts))
    assert peaks[0] == pytest.approx(peaks[1], rel=0.08)


def test_find_damage_breaks_what_exceeds_its_limit_only() -> None:
    table = PairTable.create(3, 0.002)
    table.ids[:2] = [(0, 1), (2, 3)]
    table.values[0, 7], table.values[1, 7] = 20.0, 20.0
    broken = np.zeros(3, np.bool_)
    limits = np.array([19.0, 21.0, np.inf])
    assert find_damage(table.ids, table.values, 2, limits, broken) == 0
    assert broken.tolist() == [True, False, False]
    assert find_damage(table.ids, table.values, 2, limits, broken) == -1
