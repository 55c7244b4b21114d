import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from beacon_mj.motion.path_tracking import follow, remainder
from tests.kinematics import make_task, servo

TASK = make_task((0.0, 0.0), (1.0, 1.0))
Path = NDArray[np.float64]


def ride(path: Path, tolerance_m: float = 0.005) -> tuple[int, float]:
    """Follow a path to its end; return control steps and the largest error [m]."""
    line = shapely.linestrings(path)
    position, velocity, progress, worst = path[0], np.zeros(2), 0.0, 0.0
    for step in range(1000):
        tracking = follow(
            path,
            position,
            velocity,
            TASK,
            progress_m=progress,
            tolerance_m=tolerance_m,
        )
        progress = tracking.progress_m
        if tracking.remaining_m < 0.01:
            return step, worst
        assert np.hypot(*tracking.velocity_mps) <= TASK.speed_mps + 1e-9
        trace, velocity = servo(position, velocity, tracking.velocity_mps)
        position = trace[-1]
        worst = max(worst, shapely.distance(line, shapely.points(trace)).max())
    raise AssertionError(f"{path.tolist()} was never finished")


@settings(max_examples=40, deadline=None)
@given(
    points=st.lists(
        st.tuples(st.integers(0, 20), st.integers(0, 20)),
        min_size=2,
        max_size=7,
    ),
    scale=st.sampled_from([0.02, 0.05, 0.2]),
)
def test_cross_track_error_on_polylines(
    points: list[tuple[int, int]], scale: float
) -> None:
    _, worst = ride(scale * np.array(points, dtype=float))
    assert worst <= 0.01


@pytest.mark.parametrize("length_m", [1.0, 3.0])
def test_straight_paths_are_driven_at_full_speed(length_m: float) -> None:
    steps, worst = ride(np.array([[0.0, 0.0], [0.6 * length_m, 0.8 * length_m]]))
    assert worst < 1e-3
    assert steps * TASK.control_period_s <= 1.1 * length_m / TASK.speed_mps


def test_a_circle_is_driven_at_full_speed() -> None:
    angle = np.linspace(0.0, 2 * np.pi, 100)
    path = 0.135 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    steps, worst = ride(path)
    assert worst <= 0.006
    assert steps * TASK.control_period_s <= 1.2 * 2 * np.pi * 0.135 / TASK.speed_mps


def test_a_robot_beside_the_path_returns_to_it() -> None:
    path = np.array([[0.0, 0.0], [2.0, 0.0]])
    position, velocity, progress = np.array([0.0, 0.06]), np.zeros(2), 0.0
    for _ in range(10):
        tracking = follow(path, position, velocity, TASK, progress_m=progress)
        progress = tracking.progress_m
        trace, velocity = servo(position, velocity, tracking.velocity_mps)
        position = trace[-1]
    assert abs(position[1]) < 0.002
    assert position[0] > 0.35


def test_the_speed_limit_is_obeyed() -> None:
    path = np.array([[0.0, 0.0], [2.0, 0.0]])
    tracking = follow(path, path[0], np.zeros(2), TASK, speed_mps=0.1)
    assert np.hypot(*tracking.velocity_mps) == pytest.approx(0.1)


def test_the_end_of_a_path_is_a_place_to_rest() -> None:
    path = np.array([[0.0, 0.0], [1.0, 0.0]])
    tracking = follow(path, path[1], np.zeros(2), TASK, progress_m=1.0)
    assert tracking.remaining_m == pytest.approx(0.0)
    assert tracking.velocity_mps == pytest.approx(np.zeros(2), abs=1e-9)


def test_remainder_begins_at_the_progress() -> None:
    path = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    assert remainder(path, 0.25).tolist() == [[0.25, 0.0], [1.0, 0.0], [1.0, 1.0]]
    assert remainder(path, 5.0).tolist() == [[1.0, 1.0]]
