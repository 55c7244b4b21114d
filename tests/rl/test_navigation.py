"""Episodes for learners: order of scenes, rewards, and ends."""

import itertools
import math

import numpy as np
import pytest

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import BeaconError, PlannerError, RunError
from beacon_mj.rl.navigation import Navigation, Step
from beacon_mj.rl.options import Options, made_options
from beacon_mj.rl.order import SceneOrder
from beacon_mj.rl.rewards import TERMS
from tests.rl.policies import straight

SHORT = Protocol(max_steps=30)


def run(episodes: Navigation, index: int | None = None) -> list[Step]:
    """Drive one episode straight at the goal."""
    observation, steps = episodes.begin(index), list[Step]()
    while not steps or steps[-1].outcome is None:
        steps.append(episodes.step(straight(observation)))
        observation = steps[-1].observation
    return steps


def test_scenes_come_in_their_order() -> None:
    order = SceneOrder([4, 2], seed=7)
    assert [order.next() for _ in range(5)] == [4, 2, 4, 2, 4]
    order.restart(8)
    assert (order.seed, order.next()) == (8, 4)
    endless = SceneOrder(None, seed=0)
    assert [endless.next() for _ in range(3)] == [0, 1, 2]


@pytest.mark.parametrize("indices", [[], [1, -1]])
def test_what_are_no_indices_is_refused(indices: list[int]) -> None:
    with pytest.raises(RunError, match="at least one scene, whole numbers from 0"):
        SceneOrder(indices, seed=0)


def test_a_bad_seed_is_refused() -> None:
    with pytest.raises(RunError, match="--seed: expected a whole number from 0"):
        SceneOrder(None, seed=-1)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"nearst": 3}, "option of an environment 'nearst'. Did you mean 'nearest'"),
        ({"perception": "true"}, "Unknown perception 'true'. Did you mean 'truth'"),
        ({"protocol": "papers"}, "Unknown protocol 'papers'. Did you mean 'paper'"),
        ({"protocol": Protocol(overnight="as_left")}, "overnight to be 'restored'"),
        ({"weights": {"progres": 1.0}}, "reward term 'progres'"),
        ({"weights": {"step": math.nan}}, "finite weight of reward term 'step'"),
        ({"nearest": 0}, "nearest between 1 and 100"),
    ],
)
def test_bad_options_are_refused_in_one_line(
    given: dict[str, object], message: str
) -> None:
    with pytest.raises(BeaconError) as refused:
        Navigation(made_options("sparse", given))
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_terms_add_up_to_the_reward() -> None:
    weights = {"progress": 2.0, "work": -0.5}
    episodes = Navigation(Options(family="cluttered", protocol=SHORT, weights=weights))
    steps = run(episodes)
    assert len(steps) == 30
    assert {*steps[0].terms} == {*TERMS}
    for step in steps:
        assert step.reward == math.fsum(step.terms.values())
    episode = episodes.episode
    assert episode is not None
    goal_m, row = episode.task.goal_m, episodes.row()
    before = np.linalg.norm(goal_m - episode.trace.start_m)
    after = np.linalg.norm(goal_m - episode.world.position_m)
    progress = math.fsum(step.terms["progress"] for step in steps)
    assert progress == pytest.approx(2.0 * (before - after), rel=1e-12)
    work = math.fsum(step.terms["work"] for step in steps)
    assert work == pytest.approx(-0.5 * row.actuator_work_j, rel=1e-12)
    impulse = math.fsum(step.terms["impulse"] for step in steps)
    assert impulse == pytest.approx(-0.001 * row.contact_impulse_ns, rel=1e-12)


def test_what_breaks_is_paid_for() -> None:
    episodes = Navigation(Options(family="collision-shortcut"))
    broken = []
    for index in (1, 2):
        paid = math.fsum(step.terms["broken"] for step in run(episodes, index))
        broken.append(episodes.row().obstacles_broken)
        assert paid == -5.0 * broken[-1]
    assert broken == [0, 1]


@pytest.mark.parametrize(
    ("index", "max_steps", "outcome"),
    [(1, None, "reached"), (0, None, "stuck"), (0, 20, "timeout")],
)
def test_reaching_the_goal_terminates_and_limits_truncate(
    index: int, max_steps: int | None, outcome: str
) -> None:
    protocol = Protocol(max_steps=max_steps)
    episodes = Navigation(Options(family="collision-required", protocol=protocol))
    last = run(episodes, index)[-1]
    assert last.outcome == outcome == episodes.row().outcome
    reached = outcome == "reached"
    assert (last.terminated, last.truncated) == (reached, not reached)
    assert last.terms["reached"] == 10.0 * reached


def test_an_empty_battery_terminates_where_the_protocol_says_so() -> None:
    protocol = Protocol(battery_ends_episode=True, stuck_after_s=1e4)
    episodes = Navigation(Options(family="sparse", protocol=protocol))
    assert episodes.begin()["robot"][5] == 1.0
    for k in itertools.count():
        # To and fro: the battery falls by distance.
        step = episodes.step((1.0, 0.0) if k // 5 % 2 else (-1.0, 0.0))
        if step.outcome is not None:
            break
    assert step.observation["robot"][5] == 0.0
    assert (step.outcome, step.terminated) == ("battery_empty", True)


def test_nothing_goes_on_before_reset_or_after_the_end() -> None:
    episodes = Navigation(Options(family="sparse", protocol=Protocol(max_steps=2)))
    with pytest.raises(PlannerError, match=r"reset\(\) before step\(\)"):
        episodes.step((0.0, 0.0))
    run(episodes)
    with pytest.raises(PlannerError, match=r"reset\(\) before step\(\)"):
        episodes.step((0.0, 0.0))
