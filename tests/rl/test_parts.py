"""What a learner observes, against geometry and bookkeeping done in another way."""

import math

import numpy as np
import pytest
import shapely

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import PlannerError, RunError
from beacon_mj.interface import Observation, PushEvidence, Task
from beacon_mj.rl.navigation import Navigation
from beacon_mj.rl.observer import Observer
from beacon_mj.rl.options import Options
from tests.rl.policies import straight

NEAREST = [column.name for column in Observer().parts[-1].columns]


def seen(steps: int = 40, **options: object) -> tuple[Observation, Task, Navigation]:
    """Return what is observed after some steps of a push through clutter."""
    made = Options(family="cluttered", **options)  # type: ignore[arg-type]
    episodes = Navigation(made)
    arrays = episodes.begin()
    for _ in range(steps):
        arrays = episodes.step(straight(arrays)).observation
    episode = episodes.running()
    return episode.observation, episode.task, episodes


def column(array: np.ndarray, name: str) -> np.ndarray:
    return np.asarray(array[:, NEAREST.index(name)])


def test_nearest_obstacles_are_those_of_an_independent_geometry() -> None:
    observation, task, episodes = seen(nearest=4)
    found = episodes.observer.arrays(observation)["obstacles"]
    assert found.shape == (4, len(NEAREST))
    body = shapely.Point(observation.position_m).buffer(task.radius_m, quad_segs=512)
    gaps = sorted(o.footprint.polygon().distance(body) for o in observation.obstacles)
    assert len(gaps) >= 4
    assert column(found, "known").all()
    shown = np.maximum(column(found, "gap_m"), 0.0)
    assert shown == pytest.approx(gaps[:4], abs=2e-3)
    near = np.hypot(column(found, "near_x_m"), column(found, "near_y_m"))
    apart = column(found, "gap_m") > 0.0
    assert apart.any()
    assert near[apart] == pytest.approx(shown[apart] + task.radius_m, abs=1e-5)
    chances = [column(found, name) for name in ("safe", "movable", "fragile")]
    assert sum(chances) == pytest.approx(np.ones(4), abs=1e-6)


def test_rows_without_an_obstacle_are_zero() -> None:
    observation, _, episodes = seen(steps=0, nearest=100)
    found = episodes.observer.arrays(observation)["obstacles"]
    count = len(observation.obstacles)
    assert 0 < count < 100
    assert column(found, "known").sum() == count
    assert not found[count:].any()


def test_goal_robot_and_walls() -> None:
    observation, task, episodes = seen()
    found = episodes.observer.arrays(observation)
    away = task.goal_m - observation.position_m
    assert found["goal"] == pytest.approx([*away, math.hypot(*away)], abs=1e-5)
    assert found["robot"][:2] == pytest.approx(observation.velocity_mps, abs=1e-6)
    assert found["robot"][-1] == pytest.approx(40 / task.max_steps)
    west, _, east, _ = task.workspace_m
    gaps = found["walls"]
    assert gaps[0] + gaps[2] == pytest.approx(east - west - 2 * task.radius_m, abs=1e-4)


def test_how_pushes_ended_is_remembered_until_the_next_episode() -> None:
    observation, task, _ = seen()
    first, second = observation.obstacles[:2]
    told = [
        PushEvidence(first.id, "not_moved", 30.0, 1.0),
        PushEvidence(first.id, "not_moved", 20.0, 2.0),
        PushEvidence(second.id, "moved", 10.0, 3.0),
    ]
    observer = Observer(100)
    observer.reset(task)
    observer.arrays(with_evidence(observation, told))
    found = observer.arrays(with_evidence(observation, []))["obstacles"]
    assert sorted(column(found, "held_n"))[-2:] == [0.0, 30.0]
    assert column(found, "moved").sum() == 1.0
    observer.reset(task)
    found = observer.arrays(with_evidence(observation, []))["obstacles"]
    assert not column(found, "held_n").any()
    assert not column(found, "moved").any()


def with_evidence(observation: Observation, told: list[PushEvidence]) -> Observation:
    names = [name for name in Observation.__slots__ if name != "evidence"]
    fields = {name: getattr(observation, name) for name in names}
    return Observation(**fields, evidence=tuple(told))


def test_values_are_within_their_bounds() -> None:
    observation, task, _ = seen()
    observer = Observer()
    observer.reset(task)
    names = [n for n in Observation.__slots__ if n != "bumper_force_n"]
    fields = {name: getattr(observation, name) for name in names}
    hard = Observation(**fields, bumper_force_n=np.array([1e7, -1e7]))
    arrays = observer.arrays(hard)
    for part in observer.parts:
        assert (arrays[part.name] >= part.low).all()
        assert (arrays[part.name] <= part.high).all()
        assert arrays[part.name].dtype == np.float32
    assert [*arrays["robot"][2:4]] == [1e4, -1e4]


@pytest.mark.parametrize("action", [(1.0,), (math.nan, 0.0), "north", (1.0, None)])
def test_what_is_no_action_is_refused(action: object) -> None:
    _, task, _ = seen(steps=0)
    observer = Observer()
    observer.reset(task)
    with pytest.raises(PlannerError, match=r"action of shape \(2,\), finite shares"):
        observer.velocity_mps(action)


def test_a_lidar_is_observed_where_there_is_one() -> None:
    protocol = Protocol(lidar_beams=36, obstacles="none")
    observation, task, episodes = seen(protocol=protocol)
    found = episodes.observer.arrays(observation)
    assert observation.scan is not None
    assert found["scan"].shape == (36,)
    assert np.isinf(observation.scan.ranges_m).any()
    near = np.isfinite(observation.scan.ranges_m)
    assert near.any()
    assert found["scan"][near] == pytest.approx(observation.scan.ranges_m[near])
    assert (found["scan"][~near] == np.float32(task.sensor.lidar_range_m)).all()
    assert not found["obstacles"].any()


@pytest.mark.parametrize("nearest", [0, 101])
def test_a_number_of_obstacles_is_bounded(nearest: int) -> None:
    with pytest.raises(RunError, match="nearest between 1 and 100"):
        Observer(nearest)
