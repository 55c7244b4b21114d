"""Planners on the route graph: what they decide, where, and what they are told."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from msgspec import UNSET

from beacon_mj.episode.conformance import check_planner
from beacon_mj.episode.episode import make_task
from beacon_mj.episode.mission import run_mission
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.routes import route_graph, stages_of_day
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.trace import Trace
from beacon_mj.errors import SceneError
from beacon_mj.eval.runs.experiment import experiment
from beacon_mj.eval.runs.lineup import line_up
from beacon_mj.eval.runs.runner import plan, run_jobs
from beacon_mj.eval.studies.learning import actual_outcomes
from beacon_mj.interface import PushEvidence
from beacon_mj.learning import ENTRY, PartPolicy, world_posterior
from beacon_mj.planners.belief_dp import BeliefDp
from beacon_mj.planners.ctp_hindsight import CtpHindsight
from beacon_mj.planners.ctp_optimist import CtpOptimist
from beacon_mj.planners.routes.graph import RouteGraph, RoutePlanner, StageRef
from beacon_mj.planners.routes.progress import RouteProgress
from beacon_mj.scene import Scene
from beacon_mj.scene.checks import check_scene
from beacon_mj.scene_gen.generate import generate_scene
from tests.learning.problems import TWO_KINDS
from tests.worlds import cached_scene

SEED = 4000  # Neither the tuning nor the reported scenes.
PATIENT = Protocol(decision_limit_s=3600.0)
GRAPH = RouteGraph(
    problem=TWO_KINDS,
    doors=(("a", "b", "c", "d"),),
    today=(StageRef(0, 0), StageRef(0, 1)),
)
PLANNERS: list[type[RoutePlanner]] = [BeliefDp, CtpHindsight, CtpOptimist]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return generate_scene("lookalike-doors", 0, seed=SEED)


def doors_tried(trace: Trace) -> list[str]:
    """The doors that were pushed, in order, each push once."""
    tried: list[str] = []
    for record in trace.steps:
        info = record.command.info
        if info.action == "push" and info.target and info.target not in tried[-1:]:
            tried.append(info.target)
    return [*dict.fromkeys(tried)]


def doors_of_the_optimum(*days: Scene) -> list[str]:
    """The doors that the certificate's optimum tries in the actual world."""
    graph, (opens,) = route_graph(days[0]), actual_outcomes(days)
    assert graph is not None
    (part,), (ids,) = graph.problem.parts, graph.doors
    policy = PartPolicy(part, graph.problem.fail_s, graph.problem.pass_s)
    outcomes: dict[int, bool] = {}
    order = []
    for b, stage in enumerate(part.stages):
        known, at, failed = policy.evidence(outcomes), ENTRY, frozenset[int]()
        while True:
            i = policy.choose(b, at, failed, known)
            door = stage.doors[i]
            outcomes[door] = opens[door]
            order.append(ids[door])
            if opens[door]:
                break
            at, failed = i, failed | {i}
    return order


@pytest.mark.parametrize("index", range(3))
@pytest.mark.parametrize("family", ["lookalike-doors", "unweighed-doors"])
def test_the_optimum_is_driven_as_it_was_certified(family: str, index: int) -> None:
    scene = generate_scene(family, index, seed=SEED)
    trace = run_episode(scene, BeliefDp(), protocol=PATIENT)
    assert trace.outcome == "reached"
    assert doors_tried(trace) == doors_of_the_optimum(scene)


def test_a_mission_is_driven_as_it_was_certified() -> None:
    days = [mission(day) for day in range(3)]
    traces = run_mission(days, BeliefDp(), protocol=PATIENT)
    assert [trace.outcome for trace in traces] == ["reached"] * 3
    assert [d for t in traces for d in doors_tried(t)] == doors_of_the_optimum(*days)


def test_a_long_way_to_a_door_is_driven_to_its_end() -> None:
    """The last of five doors is 10 m off, out of one dead end and into another."""
    scene = generate_scene("revisited-rooms-redrawn", 9, seed=1000)
    trace = run_episode(scene, BeliefDp(), protocol=PATIENT)
    tried = doors_tried(trace)
    assert (trace.outcome, len(tried)) == ("reached", 5)
    approach = [
        r.command.info.target == tried[-1] and r.command.info.action == "approach"
        for r in trace.steps
    ]
    assert sum(approach) > 150


def test_an_isolated_planner_is_told_the_graph_of_each_day() -> None:
    found = line_up(["belief-dp"], ["protocol.decision_limit_s=3600"], isolate=True)
    config, refs = experiment(
        found.entries, found.protocol, families=["revisited-rooms"],
        scenes_per_family=3, seed=SEED, perception="noisy",
    )  # fmt: skip
    rows = [r for part in run_jobs(config, plan(config, refs)) for r in part]
    own = run_mission([mission(d) for d in range(3)], BeliefDp(), protocol=PATIENT)
    assert [row.steps for row in rows] == [len(trace.steps) for trace in own]


@pytest.mark.parametrize("cls", PLANNERS)
def test_each_keeps_the_contract(cls: type[RoutePlanner], scene: Scene) -> None:
    check_planner(cls, scene, steps=30)


@pytest.mark.parametrize("cls", PLANNERS)
def test_a_scene_without_a_graph_ends_at_once(cls: type[RoutePlanner]) -> None:
    trace = run_episode(cached_scene("sparse", 0), cls(), protocol=PATIENT)
    assert (trace.outcome, len(trace.steps)) == ("planner_error", 0)
    assert "value of learning" in trace.detail
    assert "lookalike-doors" in trace.detail


def test_the_graph_of_an_earlier_scene_is_not_used_again(scene: Scene) -> None:
    planner = CtpOptimist()
    begun = run_episode(scene, planner, protocol=Protocol(max_steps=3))
    assert begun.outcome == "timeout"
    trace = run_episode(cached_scene("sparse", 0), planner, protocol=PATIENT)
    assert trace.outcome == "planner_error"


def test_a_process_of_its_own_is_told_the_same(tmp_path: Path) -> None:
    """Rows of the isolated planner are those of the one in this process."""
    rows = []
    for isolate in (False, True):
        found = line_up(
            ["belief-dp"], ["protocol.decision_limit_s=3600"], isolate=isolate
        )
        config, refs = experiment(
            found.entries, found.protocol, families=["lookalike-doors", "sparse"],
            scenes_per_family=1, seed=SEED, perception="noisy",
        )  # fmt: skip
        assert found.entries[0].isolated is isolate
        rows.append([r for part in run_jobs(config, plan(config, refs)) for r in part])
    plain = [
        [(r.family, r.outcome, r.steps, r.path_length_m, r.detail) for r in own]
        for own in rows
    ]
    assert plain[0] == plain[1]
    assert [row[1] for row in plain[0]] == ["reached", "planner_error"]


def test_an_opened_door_ends_its_stage() -> None:
    progress = RouteProgress(GRAPH, {})
    progress.withstood("a")
    assert (progress.at, progress.failed, progress.stage) == (
        0,
        frozenset({0}),
        StageRef(0, 0),
    )
    progress.opened("b")
    assert (progress.at, progress.failed, progress.stage) == (
        ENTRY, frozenset(), StageRef(0, 1),
    )  # fmt: skip
    assert progress.outcomes(0, of_stage=False) == {0: False, 1: True}
    progress.opened("d")
    assert (progress.stage, progress.names) == (None, ())


def test_a_door_that_only_seemed_to_open_is_met_again() -> None:
    progress = RouteProgress(GRAPH, {})
    progress.opened("a")
    progress.withstood("a")
    assert progress.stage == StageRef(0, 0)
    assert (progress.failed, progress.learned) == (frozenset({0}), {"a": False})


def test_what_the_prior_rules_out_is_driven_by_optimism() -> None:
    """One of two kinds opens, but doors of both did: no world is left."""
    policy = BeliefDp().policy
    progress = RouteProgress(GRAPH, {"a": True})
    progress.opened("b")
    assert (
        world_posterior(TWO_KINDS.parts[0], progress.outcomes(0, of_stage=False))
        is None
    )
    assert policy.rank(progress) == {0: 1.0, 1: 1.0}


def mission(day: int) -> Scene:
    return generate_scene("revisited-rooms", day, seed=SEED)


def test_days_of_a_mission_are_its_stages() -> None:
    assert [stages_of_day(mission(day)) for day in (0, 2)] == [
        (StageRef(0, 0),),
        (StageRef(0, 2),),
    ]
    redrawn = generate_scene("revisited-rooms-redrawn", 1, seed=SEED)
    assert stages_of_day(redrawn) == (StageRef(1, 0),)
    assert stages_of_day(cached_scene("sparse", 0)) == ()


def test_days_that_do_not_divide_are_refused() -> None:
    odd = msgspec.structs.replace(mission(0), days=2)
    with pytest.raises(SceneError, match="as many stages on each of 2 days"):
        check_scene(odd)


@pytest.mark.parametrize("family", ["revisited-rooms", "revisited-rooms-redrawn"])
def test_the_next_day_keeps_what_lasts(family: str) -> None:
    planner = BeliefDp()
    days = [generate_scene(family, day, seed=SEED) for day in (0, 1)]
    tasks = [make_task(day, PATIENT, seed=1) for day in days]
    planner.set_routes(route_graph(days[0]))
    planner.reset(tasks[0])
    shut, opened = planner.policy.progress.names[:2]
    for name, evidence in ((shut, "not_moved"), (opened, "moved")):
        planner.policy.learn(PushEvidence(name, evidence, 50.0, 1.0))  # type: ignore[arg-type]
    planner.set_routes(route_graph(days[1]))
    planner.next_day(tasks[1])
    lasting = {shut: False, opened: True} if family == "revisited-rooms" else {}
    assert planner.policy.progress.learned == lasting
    planner.reset(tasks[1])
    assert planner.policy.progress.learned == {}


def test_truth_is_no_part_of_the_graph() -> None:
    """Two scenes of one room whose doors differ have the same graph."""
    scene = generate_scene("lookalike-doors", 0, seed=SEED)
    other = msgspec.structs.replace(
        scene,
        obstacles=tuple(
            msgspec.structs.replace(o, fixed=True, interaction="safe")
            for o in scene.obstacles
        ),
    )
    assert route_graph(scene) == route_graph(other)
    assert scene.certificate.learning is not UNSET
    assert np.isfinite(scene.certificate.learning.value_s)
