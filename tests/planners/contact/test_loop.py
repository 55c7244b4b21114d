"""BEACON and the semantic baseline, in the real world and by their decisions."""

import dataclasses

import pytest

from beacon_mj.episode.run import run_episode
from beacon_mj.episode.trace import Trace
from beacon_mj.errors import PlannerError
from beacon_mj.interface import PushEvidence
from beacon_mj.planners.base import Planner
from beacon_mj.planners.beacon import Beacon, BeaconConfig, BeaconPolicy
from beacon_mj.planners.contact.belief_settings import BeliefSettings
from beacon_mj.planners.contact.limits import PushSettings
from beacon_mj.planners.semantic import Semantic, SemanticConfig
from beacon_mj.scene_gen.generate import generate_scene
from tests.kinematics import make_task
from tests.sensed import observe, sensed_box

SEED = 4000  # Neither the tuning nor the reported scenes.
PLANNERS = (Beacon, Semantic)


def crossing(planner: Planner, family: str, index: int = 0) -> Trace:
    return run_episode(generate_scene(family, index, seed=SEED), planner)


@pytest.mark.parametrize("cls", PLANNERS)
def test_barriers_are_crossed_by_pushing(cls: type[Planner]) -> None:
    trace = crossing(cls(), "collision-required")
    assert trace.outcome == "reached"
    assert any(s.outcome.attempts for s in trace.steps)
    assert not any(s.outcome.damages for s in trace.steps)


@pytest.mark.parametrize("cls", PLANNERS)
def test_free_ways_are_taken_without_touching(cls: type[Planner]) -> None:
    trace = crossing(cls(), "sparse")
    assert trace.outcome == "reached"
    assert not any(s.outcome.contacts for s in trace.steps)


def test_every_decision_has_both_costs_and_a_reason() -> None:
    trace = crossing(Beacon(), "collision-shortcut")
    pushes = [s.command.info for s in trace.steps if s.command.info.target]
    assert pushes
    for info in pushes:
        assert info.cost_push is not None
        assert info.cost_detour is not None
        assert set(info.terms) == {"pos", "risk", "vel", "res"}
    assert any(r.reason for r in pushes)


def test_beacon_believes_what_it_pushed() -> None:
    trace = crossing(Beacon(), "collision-required")
    moved = {
        a.obstacle
        for s in trace.steps
        for a in s.outcome.attempts
        if a.evidence == "moved"
    }
    last = trace.steps[-1].command.info.beliefs
    assert moved
    assert all(last[i][0] < 0.25 for i in moved)


def test_semantic_never_changes_its_mind() -> None:
    trace = crossing(Semantic(), "collision-required")
    first: dict[str, object] = {}
    for step in trace.steps:
        for name, belief in step.command.info.beliefs.items():
            assert first.setdefault(name, belief) == belief
    assert first


def planned(planner: Beacon, box_force_share: float) -> float | None:
    """Return the cell cost of a box that needs a share of the robot's force."""
    task = make_task((1.0, 3.0), (5.0, 3.0))
    box = sensed_box("a", density=box_force_share * 60.0 / (0.5 * 9.81 * 0.036))
    planner.reset(task)
    planner.policy.observe(observe((1.0, 3.0), box))
    return planner.policy.crossing_cost(box, last_resort=False)


def test_too_heavy_is_not_pushed() -> None:
    assert planned(Beacon(), 0.9) is not None
    assert planned(Beacon(), 1.1) is None


def test_cost_follows_force_and_belief() -> None:
    beacon = Beacon()
    light, heavy = planned(beacon, 0.2), planned(beacon, 0.8)
    assert light is not None
    assert heavy is not None
    assert light < heavy
    assert beacon.policy.learn(PushEvidence("a", "not_moved", 20.0, 1.0))
    box = sensed_box("a", density=0.8 * 60.0 / (0.5 * 9.81 * 0.036))
    learned = beacon.policy.crossing_cost(box, last_resort=False)
    assert learned is None or learned > heavy


def test_push_bias_decides_close_calls() -> None:
    """As printed, the bias and the margin both favour pushing (II.F)."""
    eager = BeaconConfig(push_bias=100.0)
    loath = BeaconConfig(push_bias=0.0, detour_margin=0.0, risk=(9.0, 9.0, 9.0))
    scene = generate_scene("collision-shortcut", 0, seed=SEED)
    touched = [
        any(s.outcome.attempts for s in run_episode(scene, Beacon(c)).steps)
        for c in (eager, loath)
    ]
    assert touched == [True, False]


@pytest.mark.parametrize(
    ("config", "field"),
    [
        (BeaconConfig, "lambda_occ"),
        (PushSettings, "speed_mps"),
        (BeliefSettings, "threshold"),
        (SemanticConfig, "w_r"),
    ],
)
def test_configs_are_checked(config: type, field: str) -> None:
    with pytest.raises(PlannerError, match=f"Expected {field} to be between"):
        config(**{field: -1.0})


def test_what_is_pushed_into_another_is_struck_as_well() -> None:
    policy = BeaconPolicy(BeaconConfig(accepted_fragile_chain=0.3))
    policy.reset(make_task((1.0, 3.0), (5.0, 3.0)))
    vase, crate, chest = (
        sensed_box(name, scores=(0.1, 0.9 - fragile, fragile))
        for name, fragile in (("vase", 0.5), ("crate", 0.1), ("chest", 0.2))
    )
    policy.observe(observe((1.0, 3.0), vase, crate, chest))
    assert policy.chain_is_safe([vase])  # Alone it is pushed, not struck.
    assert policy.chain_is_safe([crate, chest])
    assert not policy.chain_is_safe([crate, vase])
    assert not policy.chain_is_safe([vase, crate])
    shards = dataclasses.replace(vase, broken=True)
    assert policy.chain_is_safe([shards, crate])
