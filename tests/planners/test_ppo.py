"""The learned policy: its features against geometry, its network against products."""

import dataclasses
import importlib.util
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from beacon_mj.episode.run import run_episode
from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.interface import Observation, PushEvidence, SensedObstacle
from beacon_mj.numerics import rotated
from beacon_mj.planners.learned.features import (
    BEARINGS,
    FRAMES,
    RADII_M,
    SIZE,
    Features,
)
from beacon_mj.planners.learned.network import load_network
from beacon_mj.planners.ppo import SHIPPED, Ppo, PpoConfig
from tests.kinematics import make_task
from tests.repository import REPOSITORY
from tests.sensed import observe, sensed_box
from tests.worlds import cached_scene

TASK = make_task((1.0, 3.0), (5.0, 3.0))
HERE = (2.0, 3.0)
FIRST = SIZE - 5 * BEARINGS  #: Where the numbers of the bearings begin.


def vector(*seen: Observation, task: Any = TASK) -> Array:
    """Return the vector of the last of some observations."""
    features = Features()
    features.reset(task)
    for each in seen:
        features.see(each)
    return features.vector(seen[-1])


def bearings(found: Array) -> Array:
    """Return free, hard, safe, fragile and force, shape (5, b)."""
    return found[FIRST:].reshape(5, BEARINGS)


def turned(o: SensedObstacle, angle: float) -> SensedObstacle:
    """Return an obstacle turned about the middle of the room."""
    middle = np.array([3.0, 3.0])
    vertices = rotated(o.footprint.vertices - middle, angle) + middle
    outline = Footprint(vertices, o.footprint.radius)
    return dataclasses.replace(o, footprint=outline, centroid_m=outline.centroid)


def test_what_is_ahead_is_seen_ahead() -> None:
    crate = sensed_box("crate", 3.0, 3.0, scores=(0.2, 0.5, 0.3))
    free, hard, safe, fragile, force = bearings(vector(observe(HERE, crate)))
    face = 3.0 - 0.15 - TASK.radius_m - HERE[0]
    assert free[0] == sum(r <= face for r in RADII_M) / len(RADII_M)
    assert hard[0] > free[0]  # It may be pushed; behind it is nothing for 2 m.
    assert (safe[0], fragile[0]) == pytest.approx((0.2, 0.3))
    assert force[0] == pytest.approx(crate.perceived_force_n / 60.0 / 2.0)
    assert free[BEARINGS // 4] == free[BEARINGS // 2 - 3] == 1.0
    assert safe[BEARINGS // 4] == 0.0


def test_the_outer_wall_counts() -> None:
    free, hard, safe, *_ = bearings(vector(observe((0.2, 3.0))))
    back = BEARINGS // 2
    assert free[back] == hard[back] == pytest.approx(0.1)  # 0.08 m are left.
    assert safe[back] == 1.0
    assert free[0] == 1.0


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_turned_room_looks_the_same(quarters: int) -> None:
    """The frame is the goal's, so no direction is special."""
    angle, middle = quarters * math.pi / 2.0, np.array([3.0, 3.0])
    boxes = [sensed_box("a", 2.7, 3.3), sensed_box("b", 1.5, 2.2, scores=(1, 0, 0))]
    goal, here = np.array([5.0, 3.5]), np.array(HERE)
    task = dataclasses.replace(TASK, goal_m=goal)
    plain = dataclasses.replace(
        observe(HERE, *boxes), velocity_mps=np.array([0.3, -0.1])
    )
    other = [turned(o, angle) for o in boxes]
    seen = dataclasses.replace(
        observe(HERE, *other),
        position_m=rotated(here - middle, angle) + middle,
        velocity_mps=rotated(np.array([0.3, -0.1]), angle),
        footprints=Footprints.stack([o.footprint for o in other]),
    )
    moved = dataclasses.replace(TASK, goal_m=rotated(goal - middle, angle) + middle)
    np.testing.assert_allclose(vector(plain, task=task), vector(seen, task=moved))


def test_pushes_are_remembered() -> None:
    crate = sensed_box("crate", 2.5, 3.0, scores=(0.3, 0.6, 0.1))
    seen = observe(HERE, crate)

    def after(evidence: Any) -> Array:
        push = PushEvidence(id="crate", evidence=evidence, force_n=50.0, time_s=1.0)
        return bearings(vector(dataclasses.replace(seen, evidence=(push,)), seen))[:, 0]

    free, hard, safe, _, force = after("not_moved")
    assert (safe, force) == (1.0, 1.0)
    assert hard == free
    free, hard, safe, *_ = after("moved")
    assert safe == 0.0
    assert hard > free


def test_history_is_in_it() -> None:
    features = Features()
    features.reset(TASK)
    for step in range(21):
        seen = observe((1.0 + 0.05 * step, 3.0))
        features.see(seen)
        if step % 3 == 0:
            found = features.vector(seen)
            features.velocity_share(np.array([0.5, 0.1 * step]))
    frames = found[2 : 2 + 7 * FRAMES].reshape(FRAMES, 7)
    assert frames[:, 6] == pytest.approx([1.0, 1.0, 0.9, 0.6])
    past = found[2 + 7 * FRAMES : FIRST].reshape(-1, 2)
    assert past[:, 0] == pytest.approx([1.0, 0.9, 0.45, 0.225, 0.1125])


def test_an_action_is_towards_the_goal() -> None:
    features = Features()
    features.reset(make_task((1.0, 1.0), (1.0, 5.0)))
    features.see(observe((1.0, 1.0)))
    features.vector(observe((1.0, 1.0)))
    assert features.velocity_share(np.array([1.0, 0.0])).tolist() == [0.0, 1.0]
    share = features.velocity_share(np.array([5.0, -1.0]))
    assert share == pytest.approx([math.sqrt(0.5), math.sqrt(0.5)])


def test_the_network_is_products_and_relu(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    path = tmp_path / "w.npz"
    shapes = [(4, 3), (5, 4), (2, 5)]
    weights = [rng.normal(size=s).astype(np.float32) for s in shapes]
    biases = [rng.normal(size=s[0]).astype(np.float32) for s in shapes]
    named: dict[str, Any] = {f"weight_{k}": w for k, w in enumerate(weights)}
    named |= {f"bias_{k}": b for k, b in enumerate(biases)}
    np.savez(path, **named)
    x = rng.normal(size=3)
    y: Any = x
    for k in range(3):
        y = weights[k] @ (np.maximum(y, 0.0) if k else y) + biases[k]
    np.testing.assert_allclose(load_network(path, 3, 2)(x), y, rtol=1e-6)
    with pytest.raises(PlannerError, match="from 7 inputs to 2 outputs"):
        load_network(path, 7, 2)


@pytest.mark.parametrize("content", [b"", b"nothing", b"PK\x03\x04"])
def test_files_that_are_no_weights_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "w.npz"
    path.write_bytes(content)
    with pytest.raises(PlannerError, match="expected a network's weights"):
        Ppo(PpoConfig(weights=str(path)))


def test_a_missing_file_is_refused_before_the_run() -> None:
    with pytest.raises(PlannerError, match="Expected weights to be an existing file"):
        PpoConfig(weights="missing.npz")


def test_pickles_are_not_opened(tmp_path: Path) -> None:
    path = tmp_path / "w.npz"
    np.savez(path, weight_0=np.array([{}], object), bias_0=np.zeros(2))
    with pytest.raises(PlannerError, match="expected a network's weights"):
        load_network(path, SIZE, 2)


def test_the_shipped_weights_are_small() -> None:
    assert SHIPPED.stat().st_size < 500_000
    layers = load_network(SHIPPED, SIZE, 2).layers
    assert all(np.isfinite(w).all() and np.isfinite(b).all() for w, b in layers)
    assert Ppo.bit_reproducible is False


def test_episodes_repeat_on_one_machine() -> None:
    scene = cached_scene("sparse", 0)
    one, two = (run_episode(scene, Ppo()) for _ in range(2))
    ways = [
        b"".join(s.outcome.position_m.tobytes() for s in t.steps) for t in (one, two)
    ]
    assert len(one.steps) > 10
    assert ways[0] == ways[1]


@pytest.mark.slow
def test_a_little_training_gives_weights_that_drive(tmp_path: Path) -> None:
    """The planner's action is that of the policy which was trained."""
    for name in ("torch", "stable_baselines3"):
        pytest.importorskip(name, reason="it trains with Stable-Baselines3")
    path = REPOSITORY / "examples" / "train_ppo.py"
    spec = importlib.util.spec_from_file_location("train_ppo", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    model = module.train(0, 0.01, tmp_path)
    network = load_network(tmp_path / "seed-0.npz", SIZE, 2)
    x = np.random.default_rng(0).normal(size=SIZE).astype(np.float32)
    expected, _ = model.predict(x, deterministic=True)
    found = np.clip(network(x.astype(float)), -1.0, 1.0)
    np.testing.assert_allclose(found, expected, atol=1e-5)
    planner = Ppo(PpoConfig(weights=str(tmp_path / "seed-0.npz")))
    assert len(run_episode(cached_scene("sparse", 0), planner).steps) > 10
