"""The world: settled, repeatable, watched, and honest about divergence."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
import shapely

from beacon_mj.errors import SceneError
from beacon_mj.fidelity.benches import START_M, bench, block, obstacle
from beacon_mj.scene import Robot, Scene, shapes
from beacon_mj.scene.shapes import Sphere
from beacon_mj.world import BaseWorld, SimulationError, StepOutcome, World
from tests.worlds import Build, cached_scene, drive


def wander(world: BaseWorld, steps: int, seed: int = 0) -> list[StepOutcome]:
    rng = np.random.default_rng(seed)
    goal = np.array(world.scene.goal_m)
    out = []
    for _ in range(steps):
        ahead = goal - world.position_m
        ahead *= 0.4 / np.hypot(*ahead)
        out.append(world.step(ahead + rng.normal(0.0, 0.2, 2)))
    return out


def state(world: BaseWorld) -> bytes:
    return bytes(world.data.qpos.tobytes() + world.data.qvel.tobytes())


def test_obstacles_start_where_the_scene_puts_them(build: Build, family: str) -> None:
    scene = cached_scene(family, 0)
    world = build(scene)
    expected = np.array([(o.x_m, o.y_m) for o in scene.obstacles])
    np.testing.assert_allclose(world.poses[:, :2], expected, atol=2e-4)
    heights = np.array([0.5 * o.shape.height_m for o in scene.obstacles])
    np.testing.assert_allclose(world.poses[:, 2], heights, atol=6e-4)
    for outline, o in zip(world.outlines, scene.obstacles, strict=True):
        assert outline.polygon().symmetric_difference(o.outline).area < 1e-3
    assert world.data.time == 0.0


def test_obstacles_start_asleep(family: str) -> None:
    assert World(cached_scene(family, 0)).data.ntree_awake <= 1


def test_nothing_moves_when_nothing_is_done(build: Build, family: str) -> None:
    world = build(cached_scene(family, 1))
    before = world.poses
    outcomes = drive(world, *[(0.0, 0.0)] * 20)
    assert not any(o.displacements or o.contacts or o.damages for o in outcomes)
    np.testing.assert_array_equal(world.poses, before)
    np.testing.assert_allclose(world.position_m, world.scene.start_m, atol=1e-12)


def test_same_commands_give_the_same_bits(build: Build) -> None:
    scene = cached_scene("cluttered", 0)
    first, second = build(scene), build(scene)
    wander(first, 120)
    wander(second, 120)
    assert state(first) == state(second)


def test_reset_gives_the_bits_of_a_new_world(build: Build) -> None:
    scene = cached_scene("cluttered", 1)
    used = build(scene)
    wander(used, 60, seed=3)
    used.reset()
    fresh = build(scene)
    assert state(used) == state(fresh)
    a, b = wander(used, 60), wander(fresh, 60)
    assert state(used) == state(fresh)
    assert [o.actuator_work_j for o in a] == [o.actuator_work_j for o in b]
    assert [o.contacts != () for o in a] == [o.contacts != () for o in b]
    assert any(o.contacts for o in a)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_the_quiet_shortcut_changes_no_bit(index: int) -> None:
    scene = cached_scene("cluttered", index)
    steps: list[None] = []
    quick, stepwise = World(scene), World(scene, watch=lambda: steps.append(None))
    a, b = wander(quick, 120, index), wander(stepwise, 120, index)
    assert len(steps) == 120 * 50
    assert state(quick) == state(stepwise)
    assert any(o.contacts for o in a)
    for x, y in zip(a, b, strict=True):
        assert [(c.obstacle, c.peak_n) for c in x.contacts] == [
            (c.obstacle, c.peak_n) for c in y.contacts
        ]
        assert x.attempts == y.attempts
        assert x.actuator_work_j == pytest.approx(y.actuator_work_j, abs=0.05)


def test_footprints_follow_the_bodies(build: Build) -> None:
    world = build(bench(block(gap_m=0.05, mass_kg=1.0)))
    drive(world, *[(0.4, 0.05)] * 20)
    (outline,) = world.outlines
    np.testing.assert_allclose(outline.centroid, world.poses[0, :2], atol=1e-9)
    np.testing.assert_allclose(outline.polygon().area, 0.16, rtol=1e-9)
    assert world.footprints.distance(world.position_m)[0] == pytest.approx(
        0.12, abs=0.003
    )


def test_speed_limit_and_free_motion(build: Build) -> None:
    world = build(bench())
    outcomes = drive(world, *[(3.0, 4.0)] * 10)
    assert np.hypot(*outcomes[-1].velocity_mps) == pytest.approx(0.5, abs=1e-6)
    np.testing.assert_allclose(outcomes[-1].velocity_mps, (0.3, 0.4), atol=1e-6)
    kinetic = 0.5 * 10.0 * 0.5**2
    assert sum(o.actuator_work_j for o in outcomes) == pytest.approx(kinetic, rel=1e-3)


def test_drive_force_is_limited() -> None:
    forces: list[float] = []
    world = World(
        bench(block(gap_m=0.05, mass_kg=30.0)),
        watch=lambda: forces.append(float(np.abs(world.data.actuator_force).max())),
    )
    outcomes = drive(world, *[(0.3, 0.0)] * 20, *[(-0.5, 0.2)] * 5)
    assert max(forces) <= 60.0 + 1e-9
    assert outcomes[15].drive_effort == pytest.approx(1.0)


def test_a_tall_thin_cylinder_topples_once() -> None:
    pole = obstacle(
        "pole",
        shapes.Cylinder(radius_m=0.05, height_m=0.9),
        (START_M[0] + 0.3, START_M[1]),
        mass_kg=3.0,
        friction=1.2,
    )
    world = World(bench(pole))
    upright = world.outlines[0].polygon().area
    outcomes = drive(world, *[(0.5, 0.0)] * 15, *[(0.0, 0.0)] * 15)
    assert [name for o in outcomes for name in o.toppled] == ["pole"]
    lying = world.outlines[0].polygon()
    assert lying.area > 5.0 * upright
    west, _, east, _ = shapely.bounds(lying)
    assert east - west == pytest.approx(0.9, abs=0.05)
    world.reset()
    assert world.outlines[0].polygon().area == pytest.approx(upright, rel=1e-3)


@pytest.mark.parametrize("height", [0.5, 0.8])
def test_a_prism_falls_over_and_comes_to_rest_on_its_side(height: float) -> None:
    corners = ((0.08, -0.05), (0.0, 0.1), (-0.08, -0.05))
    prism = shapes.Prism(kind="triangle", vertices_m=corners, height_m=height)
    world = World(bench(obstacle("pole", prism, mass_kg=3.0, friction=1.2)))
    world.data.qvel[8] = 5.0
    outcomes = drive(world, *[(0.0, 0.0)] * 50)
    assert [name for o in outcomes for name in o.toppled] == ["pole"]
    assert world.data.ntree_awake == 1
    assert 0.02 < world.poses[0, 2] < 0.11
    assert world.outlines[0].polygon().area > 0.1 * height


def test_a_ball_rolls_and_does_not_topple() -> None:
    ball = obstacle(
        "ball",
        shapes.Sphere(radius_m=0.13),
        (START_M[0] + 0.4, START_M[1]),
        mass_kg=2.0,
    )
    world = World(bench(ball))
    outcomes = drive(world, *[(0.4, 0.0)] * 20)
    assert world.poses[0, 0] - START_M[0] > 0.8
    assert not any(o.toppled for o in outcomes)
    work = sum(o.actuator_work_j for o in outcomes) - 0.5 * 10.0 * 0.4**2
    assert work < 0.3 * 0.5 * 2.0 * 9.81 * 0.5


@pytest.mark.parametrize("value", [np.nan, 1e12])
def test_a_diverging_state_is_an_error_and_leaves_no_log_file(
    value: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    world = World(bench(block()))
    world.data.qvel[4] = value
    with pytest.raises(SimulationError, match=r"bench_0000: .*(mjWARN_BAD|finite)"):
        world.step(np.zeros(2))
    assert not list(tmp_path.iterdir())


def test_no_warning_and_no_log_file_in_a_whole_episode(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    world = World(cached_scene("collision-required", 0))
    wander(world, 100)
    assert not world.data.warning.number.any()
    assert not list(tmp_path.iterdir())


def with_period(scene: Scene, period_s: float) -> Scene:
    return msgspec.structs.replace(scene, robot=Robot(control_period_s=period_s))


def test_control_period_must_be_whole_physics_steps() -> None:
    with pytest.raises(SceneError, match="multiple of the physics step"):
        World(with_period(bench(), 0.0333))
    world = World(with_period(bench(), 0.05))
    drive(world, *[(0.5, 0.0)] * 4)
    assert world.data.time == pytest.approx(0.2)


def test_dense_and_sparse_jacobians_agree() -> None:
    """Of a ball: on a face, rounding chooses the point of the line of contact."""
    ball = obstacle("ball", Sphere(radius_m=0.1), (1.3, 3.0), mass_kg=2.0)
    worlds = []
    for jacobian in (0, 1):
        world = World(bench(ball))
        world.model.opt.jacobian = jacobian
        drive(world, *[(0.3, 0.0)] * 10)
        worlds.append(world)
    np.testing.assert_allclose(
        worlds[0].data.qpos, worlds[1].data.qpos, rtol=0, atol=1e-6
    )


def test_an_impossible_force_ends_the_episode() -> None:
    world = World(bench(block(gap_m=0.01, mass_kg=1000.0)))
    world.data.qvel[0] = 4.0  # Eight times what the drive can reach.
    with pytest.raises(SimulationError, match=r"to stay below 34\d N but it was"):
        world.step(np.zeros(2))
