"""Path integrals against closed forms; the imagined world against what it is told."""

import dataclasses
import math

import msgspec
import numpy as np
import pytest

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.sensor import Sensor
from beacon_mj.geometry import Array, Footprint
from beacon_mj.interface import SensedObstacle
from beacon_mj.planners.imagined import ImaginedWorld, _mjcf
from beacon_mj.planners.mppi import Mppi, MppiConfig, _way_left
from beacon_mj.world import World
from tests.kinematics import make_task
from tests.sensed import observe, sensed_box
from tests.worlds import cached_scene

TASK = make_task((1.0, 3.0), (5.0, 3.0))


def constant(x: float, y: float, steps: int = 15) -> Array:
    """Return one sequence of one velocity."""
    return np.tile(np.array([x, y]), (1, steps, 1))


def test_an_imagined_robot_drives_as_it_is_told() -> None:
    world = ImaginedWorld(observe((1.0, 3.0)), TASK, (), ())
    found = world.roll_out(observe((1.0, 3.0)), constant(0.4, 0.0))
    assert found.positions_m.shape == (1, 15, 2)
    # After the servo's time constant of 20 ms, and the limit of 6 m/s^2.
    assert found.positions_m[0, -1, 0] == pytest.approx(1.0 + 0.4 * 1.5, abs=0.04)
    assert found.positions_m[0, -1, 1] == pytest.approx(3.0, abs=1e-9)
    assert found.forces_n.max() == 0.0


def test_an_imagined_push_takes_the_perceived_force() -> None:
    crate = sensed_box("crate", 1.6, 3.0, density=200.0, friction=0.5)
    seen = observe((1.0, 3.0), crate)
    world = ImaginedWorld(seen, TASK, (0,), ())
    found = world.roll_out(seen, constant(0.3, 0.0, 40))
    assert found.positions_m[0, -1, 0] > 1.9
    steady = found.forces_n[0, 25:]
    assert steady.mean() == pytest.approx(crate.perceived_force_n, rel=0.1)


def test_what_is_thought_fixed_stops_the_robot() -> None:
    crate = sensed_box("crate", 1.6, 3.0)
    seen = observe((1.0, 3.0), crate)
    found = ImaginedWorld(seen, TASK, (0,), {"crate"}).roll_out(
        seen, constant(0.3, 0.0, 40)
    )
    face = 1.6 - 0.15 - TASK.radius_m
    assert found.positions_m[0, -1, 0] == pytest.approx(face, abs=0.01)
    assert found.forces_n[0, -1] > 20.0


def test_what_is_too_heavy_stops_it_too() -> None:
    crate = sensed_box("crate", 1.6, 3.0, density=5000.0)
    assert crate.perceived_force_n > TASK.force_max_n
    seen = observe((1.0, 3.0), crate)
    found = ImaginedWorld(seen, TASK, (0,), ()).roll_out(seen, constant(0.5, 0.0, 40))
    assert found.positions_m[0, -1, 0] < 1.6 - 0.15 - TASK.radius_m + 0.03


@pytest.mark.parametrize("vertices", [1, 2])
def test_round_things_are_as_large_as_they_are_perceived(vertices: int) -> None:
    core = np.array([[1.8, 3.0], [1.8, 3.4]])[:vertices]
    outline = Footprint(core, 0.2)
    drum = dataclasses.replace(
        sensed_box("drum"), footprint=outline, centroid_m=outline.centroid
    )
    seen = observe((1.0, 3.0), drum)
    found = ImaginedWorld(seen, TASK, (0,), {"drum"}).roll_out(
        seen, constant(0.4, 0.0, 30)
    )
    assert found.positions_m[0, -1, 0] == pytest.approx(1.6 - 0.12, abs=0.01)


def test_trying_leaves_nothing_behind() -> None:
    crate = sensed_box("crate", 1.6, 3.0)
    seen = observe((1.0, 3.0), crate)
    world = ImaginedWorld(seen, TASK, (0,), ())
    first = world.roll_out(seen, constant(0.3, 0.1))
    world.roll_out(seen, constant(0.5, -0.4, 30))
    again = world.roll_out(seen, constant(0.3, 0.1))
    assert first.positions_m.tobytes() == again.positions_m.tobytes()
    assert first.forces_n.tobytes() == again.forces_n.tobytes()


def test_the_truth_is_not_in_the_model() -> None:
    """Two scenes that look alike and are not give one model."""
    scene = cached_scene("cluttered", 0)
    texts = []
    for factor in (1.0, 3.0):
        truth = tuple(
            msgspec.structs.replace(o, density_kgm3=factor * o.density_kgm3)
            for o in scene.obstacles
        )
        world = World(msgspec.structs.replace(scene, obstacles=truth))
        seen = Sensor(world, Protocol(sensing_radius_m=10.0)).observe(None, 1.0)
        found: list[SensedObstacle] = sorted(seen.obstacles, key=lambda o: o.id)
        assert len(found) > 5
        texts.append(_mjcf(found, TASK, ()))
    assert texts[0] == texts[1]
    heavier = [dataclasses.replace(o, density_kgm3=2.0 * o.density_kgm3) for o in found]
    assert _mjcf(heavier, TASK, ()) != texts[0]


def test_the_way_left_is_measured_along_the_guide() -> None:
    guide = np.column_stack([np.linspace(0.0, 1.0, 21), np.zeros(21)])
    at = np.array([[[0.0, 0.0], [0.5, 0.0], [0.5, 0.2], [1.3, 0.0]]])
    left = _way_left(at, guide)[0]
    assert left[:2].tolist() == pytest.approx([1.0, 0.5])
    # Beside it: the least of |x - p| + rest, between 0.5 and 0.5 + 0.2.
    assert 0.5 < left[2] < 0.7
    assert left[3] == pytest.approx(0.3)


def test_weights_are_those_of_the_path_integral() -> None:
    planner = Mppi(MppiConfig(temperature_m=0.5))
    costs = np.array([1.0, 2.0, 1.5])
    expected = [math.exp(-(c - 1.0) / 0.5) for c in costs.tolist()]
    found = planner._weights(costs)
    np.testing.assert_allclose(found, np.array(expected) / sum(expected))
    assert found.sum() == pytest.approx(1.0)


def test_contact_costs() -> None:
    """Of two ways of one length the one without contact is better."""
    planner = Mppi(MppiConfig(force_cost=0.1))
    planner.reset(TASK)
    crate = sensed_box("crate", 1.5, 3.5)
    seen = observe((1.0, 3.0), crate)
    guide = np.column_stack([np.linspace(1.0, 1.0, 21), np.linspace(3.0, 4.0, 21)])
    both = np.concatenate([constant(0.5, 0.5, 10), constant(-0.5, 0.5, 10)])
    rollouts = ImaginedWorld(seen, TASK, (0,), ()).roll_out(seen, both)
    hit, missed = planner._costs(rollouts, guide).tolist()
    assert rollouts.forces_n[1].max() == 0.0
    assert hit > missed + 0.1


def test_episodes_repeat() -> None:
    scene = cached_scene("sparse", 0)
    one, two = (run_episode(scene, Mppi()) for _ in range(2))
    assert one.outcome == two.outcome == "reached"
    ways = [
        b"".join(s.outcome.position_m.tobytes() for s in t.steps) for t in (one, two)
    ]
    assert ways[0] == ways[1]
