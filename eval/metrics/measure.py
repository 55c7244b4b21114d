"""The metrics of one episode, from its trace alone: live, or read back from a log."""

import math

import numpy as np
from msgspec import UNSET, UnsetType

from beacon_mj.episode.trace import Trace
from beacon_mj.errors import LogError
from beacon_mj.eval.metrics import belief_metrics, contact_metrics, published_scores
from beacon_mj.eval.metrics.row import Row
from beacon_mj.geometry import Array, segment_lengths
from beacon_mj.scene_gen.robots import robot_in

ROLLING_JPM = 2.0  #: kappa_d of bare rolling resistance, for `energy_rolling_j` [J/m].


def measure(trace: Trace) -> Row:
    """Return the row of a finished episode.

    Raises:
        LogError: If the episode has no outcome: it is unfinished.
    """
    if trace.outcome is None:
        raise LogError(
            f"{trace.scene.name}: expected a finished episode but it has no outcome."
        )
    scene, robot = trace.scene, trace.protocol.robot_of(trace.scene)
    obstacles = {o.id: o for o in scene.obstacles}
    success, broken = trace.outcome == "reached", contact_metrics.broken(trace)
    path_m, time_s = path_length_m(positions_m(trace)), sim_time_s(trace)
    travel = contact_metrics.travels(trace)
    push_j = contact_metrics.push_energy_j(obstacles, travel)
    displaced = contact_metrics.displaced_mass_distance_kgm(obstacles, travel)
    impulse = contact_metrics.contact_impulse_ns(trace)
    motion_j = trace.protocol.motion_cost(scene) * path_m
    reference = scene.certificate.reference_length_m
    spl = published_scores.spl(success, reference, path_m)
    known = belief_metrics.histories(trace)
    tried = belief_metrics.pushed(trace, known)
    return Row(
        planner=trace.planner,
        oracle=trace.oracle,
        suite=trace.suite,
        family=scene.family,
        scene_index=scene.index,
        mission=None if scene.mission is UNSET else scene.mission,
        day=None if scene.day is UNSET else scene.day,
        scene_sha256=scene.sha256,
        perception=scene.perception,
        seed=scene.seed,
        robot=_robot(trace),
        world="planar" if trace.protocol.is_planar else UNSET,
        outcome=trace.outcome,
        success=success,
        clean_success=success and broken == 0,
        steps=len(trace.steps),
        path_length_m=path_m,
        contacts=contact_metrics.contact_events(trace),
        sensed_obstacles=sensed_obstacles(trace),
        energy_j=motion_j + push_j,
        energy_rolling_j=ROLLING_JPM * path_m + push_j,
        motion_energy_j=motion_j,
        push_energy_j=push_j,
        actuator_work_j=actuator_work_j(trace),
        battery_left=battery_left(trace),
        pushes=contact_metrics.pushes(trace),
        failed_pushes=contact_metrics.failed_pushes(trace),
        obstacles_moved=contact_metrics.obstacles_moved(travel),
        obstacles_moved_indirectly=contact_metrics.moved_indirectly(travel),
        obstacles_toppled=contact_metrics.toppled(trace),
        obstacles_broken=broken,
        peak_force_n=contact_metrics.peak_force_n(trace),
        filtered_peak_force_n=contact_metrics.filtered_peak_force_n(trace),
        contact_impulse_ns=impulse,
        displaced_mass_distance_kgm=displaced,
        spl=spl,
        ins=published_scores.ins(
            spl,
            published_scores.kinematic_score(robot.mass_kg, path_m, displaced),
            published_scores.dynamic_score(robot.mass_kg, time_s, impulse),
        ),
        bench_push_efficiency=published_scores.bench_push_efficiency(
            success, reference, path_m
        ),
        bench_push_effort=published_scores.bench_push_effort(
            robot.mass_kg, path_m, displaced
        ),
        reference_length_m=reference,
        excess_length_m=path_m - reference if success else None,
        brier_prior=belief_metrics.mean_brier(known.values(), 0),
        brier_posterior=belief_metrics.mean_brier(known.values(), -1),
        log_loss_prior=belief_metrics.mean_log_loss(known.values(), 0),
        log_loss_posterior=belief_metrics.mean_log_loss(known.values(), -1),
        brier_pushed_prior=belief_metrics.mean_brier(tried, 0),
        brier_pushed_posterior=belief_metrics.mean_brier(tried, -1),
        time_to_identify_s=belief_metrics.time_to_identify_s(known.values()),
        replans=sum(r.command.info.replanned for r in trace.steps),
        expansions=sum(r.command.info.expansions for r in trace.steps),
        plan_ms_p50=plan_ms(trace, 50.0),
        plan_ms_p99=plan_ms(trace, 99.0),
        sim_time_s=time_s,
        wall_time_s=trace.wall_time_s,
        detail=trace.detail,
    )


def _robot(trace: Trace) -> str | UnsetType:
    """Return what the robot is chosen by; unset for the disc."""
    robot = robot_in(trace.scene, trace.protocol.robot)
    return UNSET if robot.is_disc else str(robot)


def positions_m(trace: Trace) -> Array:
    """Return the recorded positions, start included, shape (steps + 1, 2) [m]."""
    return np.array([trace.start_m, *(r.outcome.position_m for r in trace.steps)])


def path_length_m(positions: Array) -> float:
    """Return L = sum_t ||x_{t+1} - x_t|| [m] (paper App. B)."""
    return math.fsum(segment_lengths(positions))


def sensed_obstacles(trace: Trace) -> int:
    """Return m, the number of distinct obstacles sensed (paper App. B)."""
    names = set(trace.first_sensed)
    for record in trace.steps:
        names.update(record.newly_sensed)
    return len(names)


def actuator_work_j(trace: Trace) -> float:
    """Return the work of the drives, integrated over every physics step [J]."""
    return math.fsum(r.outcome.actuator_work_j for r in trace.steps)


def battery_left(trace: Trace) -> float:
    """Return the charge at the end, in [0, 1] (paper II.A)."""
    return trace.steps[-1].battery if trace.steps else 1.0


def sim_time_s(trace: Trace) -> float:
    """Return the simulated duration [s]."""
    return trace.steps[-1].outcome.time_s if trace.steps else 0.0


def plan_ms(trace: Trace, percentile: float) -> float | None:
    """Return a percentile of the wall-clock time of decisions [ms]; None if none."""
    if not trace.steps:
        return None
    times = [1000.0 * r.decision_s for r in trace.steps]
    return float(np.percentile(times, percentile))
