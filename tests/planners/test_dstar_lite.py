import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.motion.dstar_lite import DStarLite, dijkstra
from beacon_mj.planners.dstar_lite import DStarLiteConfig, DStarLitePlanner
from tests.kinematics import box, disc, drive, make_task, observe

SIZE = 9
INNER = [r * SIZE + c for r in range(1, SIZE - 1) for c in range(1, SIZE - 1)]
COSTS = st.sampled_from([0.0, 0.0, 0.0, 0.5, 3.0, math.inf, math.inf])


def bellman_ford(cost: Array, goal: int) -> Array:
    """Costs-to-go by plain relaxation: no queue, no heuristic, no shared code."""
    rows, cols = cost.shape
    value = np.full((rows, cols), np.inf)
    value.ravel()[goal] = 0.0
    walled = np.full((rows, cols), np.inf)
    walled[1:-1, 1:-1] = cost[1:-1, 1:-1]
    steps = [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if r or c]
    while True:
        before = value.copy()
        for r in range(1, rows - 1):
            for c in range(1, cols - 1):
                for dr, dc in steps:
                    touched = [(r, c), (r + dr, c + dc), (r + dr, c), (r, c + dc)]
                    if any(np.isinf(walled[cell]) for cell in touched):
                        continue
                    step = math.hypot(dr, dc) * (1.0 + walled[r + dr, c + dc])
                    value[r, c] = min(value[r, c], step + value[r + dr, c + dc])
        if np.array_equal(before, value):
            return value


@st.composite
def searches(draw: st.DrawFn) -> tuple[Array, int, list[tuple[int, dict[int, float]]]]:
    """A cost map, a goal, and a sequence of start moves with changes of costs."""
    cells = draw(st.lists(COSTS, min_size=SIZE**2, max_size=SIZE**2))
    changes = st.dictionaries(st.sampled_from(INNER), COSTS, max_size=8)
    moves = st.lists(st.tuples(st.sampled_from(INNER), changes), min_size=1, max_size=6)
    goal = draw(st.sampled_from(INNER))
    return np.array(cells).reshape(SIZE, SIZE), goal, draw(moves)


@settings(max_examples=25, deadline=None)
@given(searches())
def test_cost_to_go_equals_brute_force_after_every_change(
    search: tuple[Array, int, list[tuple[int, dict[int, float]]]],
) -> None:
    cost, goal, moves = search
    engine = DStarLite(cost, 1.0)
    engine.set_goal(goal)
    for start, changes in moves:
        engine.move_start(start)
        cells = np.array(list(changes), dtype=np.int64)
        engine.update_cells(cells, np.array(list(changes.values())))
        cost.ravel()[cells] = list(changes.values())
        expected = bellman_ford(cost, goal)
        assert engine.compute() == pytest.approx(expected.ravel()[start])
        assert dijkstra(cost, 1.0, goal)[0] == pytest.approx(expected)
        check_path(engine, expected.ravel()[start])


def check_path(engine: DStarLite, expected: float) -> None:
    """The path's own cost is the cost-to-go."""
    path = engine.path()
    if math.isinf(expected):
        assert len(path) == 0
        return
    assert (path[0], path[-1]) == (engine.start, engine.goal)
    rows, cols = np.divmod(path, SIZE)
    steps = np.hypot(np.diff(rows), np.diff(cols))
    assert steps.max(initial=0.0) < 1.5
    assert (steps * (1.0 + engine.cost[path[1:]])).sum() == pytest.approx(expected)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000))
def test_driving_through_a_revealed_maze_stays_exact(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = np.where(rng.random((SIZE, SIZE)) < 0.3, np.inf, 0.0)
    known = np.zeros((SIZE, SIZE))
    engine = DStarLite(known, 1.0)
    goal, start = INNER[-1], INNER[0]
    truth.ravel()[[goal, start]] = 0.0
    engine.set_goal(goal)
    engine.move_start(start)
    while start != goal:
        row, col = divmod(start, SIZE)
        near = [
            r * SIZE + c
            for r in range(row - 1, row + 2)
            for c in (col - 1, col, col + 1)
        ]
        new = np.array([n for n in near if truth.flat[n] != known.flat[n]], np.int64)
        known.ravel()[new] = truth.ravel()[new]
        engine.update_cells(new, known.ravel()[new])
        value = engine.compute()
        assert value == pytest.approx(bellman_ford(known, goal).ravel()[start])
        if math.isinf(value):
            break
        start = int(engine.path()[1])
        engine.move_start(start)


def test_repairing_expands_fewer_vertices_than_starting_again() -> None:
    size = 40
    rng = np.random.default_rng(3)
    cost = np.zeros((size, size))
    goal, start = 20 * size + 36, 20 * size + 3
    incremental = DStarLite(cost, 1.0)
    incremental.set_goal(goal)
    scratch = 0
    for _ in range(15):
        row, col = divmod(start, size)
        ahead = row * size + min(col + 4, size - 4) + size * rng.integers(-2, 3)
        cells = np.array([ahead, ahead + size, ahead - size], dtype=np.int64)
        cells = cells[(cells != goal) & (cells != start)]
        cost.ravel()[cells] = np.inf
        incremental.move_start(start)
        incremental.update_cells(cells, np.full(len(cells), np.inf))
        fresh = DStarLite(cost, 1.0)
        fresh.set_goal(goal)
        fresh.move_start(start)
        assert incremental.compute() == pytest.approx(fresh.compute())
        scratch += fresh.expansions
        start = int(incremental.path()[1])
    assert 0 < incremental.expansions < 0.5 * scratch


def test_the_engine_wants_its_goal_first() -> None:
    engine = DStarLite(np.zeros((5, 5)), 0.05)
    with pytest.raises(PlannerError, match="goal and the start to be set"):
        engine.compute()
    with pytest.raises(PlannerError, match="at least 3 x 3 but it was 2 x 5"):
        DStarLite(np.zeros((2, 5)), 0.05)


ROOM = (0.0, 0.0, 3.0, 2.0)


@pytest.mark.parametrize(
    ("obstacles", "longest_m"),
    [
        ([], 2.05),
        ([disc(1.5, 1.0, 0.3)], 2.35),
        ([box(1.3, 0.0, 1.5, 0.9), box(1.3, 1.18, 1.5, 2.0)], 2.15),
        ([box(1.0, 0.5, 1.2, 2.0), box(1.8, 0.0, 2.0, 1.5)], 3.7),
    ],
    ids=["empty", "disc", "gap 4 cm wider than the robot", "slalom"],
)
def test_it_reaches_the_goal_without_touching(
    obstacles: list[Footprint], longest_m: float
) -> None:
    run = drive(DStarLitePlanner(), make_task((0.4, 1.0), (2.5, 1.0), ROOM), obstacles)
    assert run.outcome == "reached"
    assert run.clearance_m > 0.001
    assert run.length_m < longest_m
    assert sum(c.info.expansions for c in run.commands) > 0 or not obstacles


def test_it_gives_up_once_the_goal_is_known_to_be_walled_off() -> None:
    wall = [box(1.4, 0.0, 1.6, 0.9), box(1.4, 1.1, 1.6, 2.0)]
    run = drive(DStarLitePlanner(), make_task((0.4, 1.0), (2.5, 1.0), ROOM), wall)
    assert run.outcome == "gave_up"
    assert run.commands[-1].info.reason.startswith("The known map has no way")


def test_it_escapes_from_inside_the_margin() -> None:
    task = make_task((1.0, 1.0), (2.5, 1.0), ROOM)
    run = drive(DStarLitePlanner(), task, [disc(1.33, 1.0, 0.2)])
    assert run.outcome == "reached"
    assert run.clearance_m > 0.0


def test_a_robot_that_cannot_move_backs_off_and_then_gives_up() -> None:
    planner, task = DStarLitePlanner(), make_task((0.5, 1.0), (2.5, 1.0), ROOM)
    planner.reset(task)
    footprints = Footprints.stack([disc(0.8, 1.3, 0.2)])
    commands = []
    for step in range(400):
        seen = observe(step, task.start_m, np.zeros(2), footprints, 1)
        commands.append(planner.act(seen))
        if commands[-1].give_up:
            break
    backing = [c for c in commands if c.info.action == "back_off"]
    assert backing
    assert all(c.velocity_mps @ (-0.3, -0.3) > 0.0 for c in backing)
    assert commands[-1].info.reason.startswith("Got stuck")


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("cell_m", 0.5, "Expected cell_m to be between 0.01 and 0.1 but it was 0.5"),
        ("margin_m", math.nan, "Expected margin_m to be between"),
        ("tight_margin_m", 0.05, "Expected tight_margin_m to be between 0 and 0.01"),
        ("tolerance_m", 0.0, "Expected tolerance_m to be between 0.0005 and 0.1"),
    ],
)
def test_a_bad_config_says_what_was_expected(
    field: str, value: float, message: str
) -> None:
    with pytest.raises(PlannerError, match=message):
        DStarLiteConfig(**{field: value})
