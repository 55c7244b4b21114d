"""Metrics of traces made by hand, and of live episodes."""

import itertools
import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.constants import GRAVITY, WALL_CLOCK_COLUMNS
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.errors import LogError
from beacon_mj.eval.metrics.measure import measure, path_length_m
from beacon_mj.eval.metrics.row import COLUMNS, Row
from beacon_mj.planners.push_through import PushThrough
from beacon_mj.world import World
from beacon_mj.world.outcome import Damage, Displacement
from tests.eval.traces import (
    FRICTION,
    MASS_KG,
    REFERENCE_M,
    attempt,
    force,
    scene,
    step,
    trace,
)
from tests.worlds import cached_scene

DESIGN_COLUMNS = (
    "planner, suite, family, scene_index, mission, day, scene_sha256, perception, "
    "seed, outcome, success, "
    "clean_success, steps, path_length_m, contacts, sensed_obstacles, energy_j, "
    "motion_energy_j, push_energy_j, actuator_work_j, battery_left, pushes, "
    "failed_pushes, obstacles_moved, obstacles_moved_indirectly, "
    "obstacles_toppled, obstacles_broken, peak_force_n, "
    "filtered_peak_force_n, contact_impulse_ns, displaced_mass_distance_kgm, spl, ins, "
    "bench_push_efficiency, bench_push_effort, reference_length_m, excess_length_m, "
    "brier_prior, brier_posterior, log_loss_prior, log_loss_posterior, "
    "time_to_identify_s, "
    "replans, expansions, plan_ms_p50, plan_ms_p99, sim_time_s, wall_time_s"
).split(", ")


def test_columns_are_the_designs_in_its_order() -> None:
    ours = [c for c in COLUMNS if c in DESIGN_COLUMNS]
    assert ours == DESIGN_COLUMNS
    assert set(COLUMNS) - set(DESIGN_COLUMNS) == {
        "oracle",
        "energy_rolling_j",
        "brier_pushed_prior",
        "brier_pushed_posterior",
        "detail",
    }
    assert set(COLUMNS) > WALL_CLOCK_COLUMNS


def test_identity_is_the_scenes() -> None:
    row = measure(trace([step(1, x_m=1.0)]))
    assert row.planner == "by-hand"
    assert (row.family, row.scene_index, row.seed) == ("paper", 3, 11)
    assert row.perception == "noisy"
    assert row.scene_sha256 == scene().sha256
    assert row.key == ("by-hand", "paper", 3)


def test_a_clean_straight_run() -> None:
    records = [step(k, x_m=2.5 * k, work_j=1.5, battery=0.9 - 0.1 * k) for k in (1, 2)]
    row = measure(trace(records))
    assert row.path_length_m == pytest.approx(5.0)
    assert row.steps == 2
    assert row.motion_energy_j == pytest.approx(0.2 * 10.0 * GRAVITY * 5.0)
    assert row.energy_j == row.motion_energy_j
    assert row.energy_rolling_j == pytest.approx(10.0)
    assert row.actuator_work_j == pytest.approx(3.0)
    assert row.battery_left == pytest.approx(0.7)
    assert row.spl == pytest.approx(REFERENCE_M / 5.0)
    assert row.bench_push_efficiency == pytest.approx(REFERENCE_M / 5.0)
    assert row.bench_push_effort == 1.0
    assert row.ins == pytest.approx(0.5 * 0.8 + 0.5)
    assert row.excess_length_m == pytest.approx(1.0)
    assert row.sim_time_s == pytest.approx(0.2)
    assert (row.contacts, row.obstacles_broken, row.pushes) == (0, 0, 0)
    assert row.success
    assert row.clean_success


def test_motion_cost_of_the_protocol() -> None:
    protocol = Protocol(motion_cost_jpm=7.0)
    row = measure(trace([step(1, x_m=2.0)], protocol=protocol))
    assert row.motion_energy_j == pytest.approx(14.0)
    assert row.energy_rolling_j == pytest.approx(4.0)


def test_pushing_costs_its_friction_work() -> None:
    moves = [
        Displacement("a", 0.5, ("a",)),
        Displacement("b", 0.25, ("a", "b")),
        Displacement("c", 9.0, ()),  # Nobody pushed it.
    ]
    row = measure(trace([step(1, x_m=2.0, displacements=moves, contacts=[force("a")])]))
    assert row.displaced_mass_distance_kgm == pytest.approx(MASS_KG * 0.75)
    expected = FRICTION * MASS_KG * GRAVITY * 0.75
    assert row.push_energy_j == pytest.approx(expected)
    assert row.energy_j == pytest.approx(row.motion_energy_j + expected)
    assert row.energy_rolling_j == pytest.approx(2.0 * 2.0 + expected)
    assert (row.obstacles_moved, row.obstacles_moved_indirectly) == (2, 1)
    kinematic = 20.0 / (20.0 + 1.5)
    dynamic = 9.81 / (9.81 + 0.5)
    assert row.bench_push_effort == pytest.approx(kinematic)
    assert row.ins == pytest.approx(0.5 * row.spl + 0.25 * (kinematic + dynamic))


def test_small_displacements_add_up_to_moved() -> None:
    tiny = [step(k, displacements=[Displacement("a", 0.004, ("a",))]) for k in (1, 2)]
    assert measure(trace(tiny)).obstacles_moved == 0
    assert measure(trace([*tiny, tiny[0]])).obstacles_moved == 1


def test_a_failure_scores_nothing_and_has_no_regret() -> None:
    row = measure(trace([step(1, x_m=4.0)], outcome="timeout"))
    assert not row.success
    assert not row.clean_success
    assert (row.spl, row.bench_push_efficiency) == (0.0, 0.0)
    assert row.excess_length_m is None


def test_a_success_that_breaks_something_is_not_clean() -> None:
    hit = Damage("c", "robot", 12.0, 0.1)
    row = measure(trace([step(1, x_m=4.0, damages=[hit], toppled=["c", "b"])]))
    assert row.success
    assert not row.clean_success
    assert (row.obstacles_broken, row.obstacles_toppled) == (1, 2)


def test_contact_events_need_a_pause() -> None:
    def events(*numbers: int) -> int:
        touching = [
            step(k, contacts=[force("a")] if k in numbers else []) for k in range(1, 30)
        ]
        return measure(trace(touching)).contacts

    assert events(1, 2, 3, 4) == 1
    assert events(1, 6) == 1  # 0.4 s between the end of step 1 and the start of 6.
    assert events(1, 7) == 2  # 0.5 s.
    assert events(1, 5, 9, 13) == 1
    assert events() == 0


def test_contact_events_are_the_robots_and_above_one_newton() -> None:
    quiet = step(1, contacts=[force("a", filtered_n=1.0)])
    assert measure(trace([quiet])).contacts == 0
    others = step(
        1, contacts=[force("a", "b"), force("a", "wall"), force("robot", "wall")]
    )
    row = measure(trace([others]))
    assert (row.contacts, row.peak_force_n, row.contact_impulse_ns) == (0, 0.0, 0.0)
    two = step(1, contacts=[force("a"), force("b", filtered_n=7.0)])
    row = measure(trace([two]))
    assert row.contacts == 2
    assert (row.peak_force_n, row.filtered_peak_force_n) == (14.0, 7.0)
    assert row.contact_impulse_ns == pytest.approx(1.2)


def test_pushes_are_attempts_with_evidence() -> None:
    by_robot = Damage("c", "robot", 12.0, 0.3)
    by_other = Damage("c", "a", 12.0, 0.3)
    done = [attempt("a", "moved"), attempt("b", "not_moved")]
    row = measure(trace([step(1, attempts=done)]))
    assert (row.pushes, row.failed_pushes) == (2, 1)
    sudden = attempt("c", "broken", began_s=0.3)
    assert measure(trace([step(1, attempts=[sudden], damages=[by_robot])])).pushes == 1
    assert measure(trace([step(1, attempts=[sudden], damages=[by_other])])).pushes == 0
    tried = attempt("c", "broken", began_s=0.1)
    assert measure(trace([step(1, attempts=[tried], damages=[by_other])])).pushes == 1


def test_sensed_obstacles_are_distinct() -> None:
    records = [step(1, sensed=["b"]), step(2, sensed=["c", "b"])]
    assert measure(trace(records, first_sensed=["a"])).sensed_obstacles == 3


def test_belief_scores() -> None:
    first = {"a": (0.5, 0.25, 0.25), "c": (0.0, 0.0, 1.0)}
    last = {"a": (0.0, 1.0, 0.0), "c": (0.0, 0.0, 1.0)}
    records = [
        step(1, beliefs=first),
        step(2, beliefs=first, attempts=[attempt("a", "moved")]),
        step(3, beliefs=last),
        step(4, beliefs=last),
    ]
    row = measure(trace(records))
    assert row.brier_prior == pytest.approx((0.25 + 0.5625 + 0.0625) / 2)
    assert row.log_loss_prior == pytest.approx(math.log(4.0) / 2)
    assert (row.brier_posterior, row.log_loss_posterior) == (0.0, 0.0)
    assert row.brier_pushed_prior == pytest.approx(0.875)
    assert row.brier_pushed_posterior == 0.0
    assert row.time_to_identify_s == pytest.approx((0.2 + 0.0) / 2)


def test_a_certain_mistake_costs_a_bounded_log_loss() -> None:
    row = measure(trace([step(1, beliefs={"a": (1.0, 0.0, 0.0)})]))
    assert row.brier_prior == 2.0
    assert row.log_loss_prior == pytest.approx(-math.log(1e-6))
    assert row.time_to_identify_s is None


def test_identification_must_last() -> None:
    sure, unsure = (0.05, 0.95, 0.0), (0.5, 0.5, 0.0)
    beliefs = [unsure, sure, unsure, sure, sure]
    row = measure(trace([step(k, beliefs={"a": p}) for k, p in enumerate(beliefs, 1)]))
    assert row.time_to_identify_s == pytest.approx(0.3)


@pytest.mark.parametrize(
    "nonsense",
    [
        {"nobody": (0.2, 0.3, 0.5)},
        {"a": (0.5, 0.5)},
        {"a": (math.nan, 0.5, 0.5)},
        {"a": (1.0, 1.0, 1.0)},
        {},
    ],
)
def test_beliefs_that_are_none_have_no_score(
    nonsense: dict[str, tuple[float, ...]],
) -> None:
    row = measure(trace([step(1, beliefs=nonsense)]))  # type: ignore[arg-type]
    assert (row.brier_prior, row.log_loss_posterior, row.brier_pushed_posterior) == (
        None,
    ) * 3


def test_planning_columns() -> None:
    times = [0.001, 0.002, 0.003, 0.010]
    reasons = {"replanned": True, "expansions": 5}
    records = [step(k, decision_s=t, info=reasons) for k, t in enumerate(times, 1)]
    row = measure(trace([*records, step(5, decision_s=0.002)]))
    assert (row.replans, row.expansions) == (4, 20)
    assert row.plan_ms_p50 == pytest.approx(2.0)
    assert row.plan_ms_p99 == pytest.approx(9.72)


def test_an_episode_without_a_step() -> None:
    row = measure(trace([], outcome="planner_error"))
    assert (row.steps, row.path_length_m, row.sim_time_s, row.battery_left) == (
        0,
        0,
        0,
        1,
    )
    assert (row.plan_ms_p50, row.plan_ms_p99) == (None, None)
    assert row.bench_push_effort == 1.0


def test_an_unfinished_episode_has_no_row() -> None:
    with pytest.raises(LogError, match="no outcome"):
        measure(trace([step(1)], outcome=None))


@given(
    st.lists(
        st.tuples(st.floats(0.0, 6.0), st.floats(0.0, 6.0)), min_size=1, max_size=30
    )
)
def test_path_length_is_at_least_the_distance(
    points: list[tuple[float, float]],
) -> None:
    positions = np.array(points)
    length = path_length_m(positions)
    oracle = sum(math.dist(p, q) for p, q in itertools.pairwise(points))
    assert length == pytest.approx(oracle)
    assert length >= math.dist(points[0], points[-1]) - 1e-9
    assert path_length_m(positions[::-1]) == pytest.approx(length)


def test_a_live_row_survives_json(family: str) -> None:
    found = cached_scene(family, 0)
    row = measure(run_episode(found, PushThrough(), "push-through"))
    assert msgspec.json.decode(msgspec.json.encode(row), type=Row) == row
    assert row.steps > 0
    assert 0.0 <= row.ins <= 1.0
    assert row.filtered_peak_force_n <= row.peak_force_n
    assert row.obstacles_moved_indirectly <= row.obstacles_moved
    assert row.failed_pushes <= row.pushes


def test_rows_do_not_depend_on_reusing_the_world() -> None:
    found = cached_scene("collision-required", 0)
    world = World(found)

    def row(reused: World | None) -> dict[str, object]:
        made = measure(run_episode(found, PushThrough(), world=reused)).as_dict()
        return {k: v for k, v in made.items() if k not in WALL_CLOCK_COLUMNS}

    fresh = row(None)
    assert fresh["contacts"]
    assert row(world) == fresh
    assert row(world) == fresh
