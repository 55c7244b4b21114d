"""From the records of one control step to messages."""

import math
from typing import Any

import numpy as np

from beacon_mj.episode.trace import StepRecord
from beacon_mj.geometry import Array
from beacon_mj.interface import Command, Observation, PlannerInfo, SensedObstacle
from beacon_mj.recording.drawing import ARENA, stamp
from beacon_mj.recording.messages import message
from beacon_mj.world import BaseWorld, Damage, PairForce
from beacon_mj.world.pushes import AttemptEnd


def step_message(record: StepRecord) -> Any:
    """Return the scalars of a control step, with displacements and topples."""
    outcome = record.outcome
    out = message("beacon_mj.Step")(
        step=outcome.step,
        time_s=outcome.time_s,
        drive_effort=outcome.drive_effort,
        actuator_work_j=outcome.actuator_work_j,
        battery=record.battery,
        newly_sensed=record.newly_sensed,
        toppled=outcome.toppled,
    )
    set_planar(out.position_m, outcome.position_m)
    set_planar(out.velocity_mps, outcome.velocity_mps)
    set_planar(out.bumper_force_n, outcome.bumper_force_n)
    for d in outcome.displacements:
        out.displacements.add(
            obstacle=d.obstacle, distance_m=d.distance_m, chain=d.chain
        )
    return out


def start_message(world: BaseWorld, observation: Observation) -> Any:
    """Return the same message for the start: step 0, with what is sensed there."""
    out = message("beacon_mj.Step")(
        battery=observation.battery,
        newly_sensed=[o.id for o in observation.obstacles],
    )
    set_planar(out.position_m, world.position_m)
    set_planar(out.velocity_mps, world.velocity_mps)
    set_planar(out.bumper_force_n, world.bumper_force_n)
    return out


def told_message(observation: Observation) -> Any:
    """Return what the planner was told about itself, where that is not the truth."""
    out = message("beacon_mj.Told")()
    set_planar(out.position_m, observation.position_m)
    set_planar(out.bumper_force_n, observation.bumper_force_n)
    for contact in observation.contacts:
        out.contacts.add(obstacle=contact.id, force_n=contact.force_n)
    for evidence in observation.evidence:
        out.evidence.add(obstacle=evidence.id, force_n=evidence.force_n)
    return out


def split_path(path_m: Array, plan_m: Array) -> tuple[Array, int] | None:
    """Return a path as a few new points and the rest of a logged plan.

    A robot on its way drops the points that it has passed, and may put its own
    position first. Returns (new points (h, 2) with h <= 1, number of last points of the
    plan that follow), or None if the path is another one.
    """
    for head in (0, 1):
        tail = len(path_m) - head
        if 0 <= tail <= len(plan_m) and np.array_equal(
            path_m[head:], plan_m[len(plan_m) - tail :]
        ):
            return path_m[:head], tail
    return None


def command_message(command: Command, head_m: Array, tail: int) -> Any:
    """Return a velocity command [m/s], and the path as `split_path` gives it."""
    out = message("beacon_mj.Command")(
        has_path=command.info.path_m is not None, path_tail=tail
    )
    set_planar(out.velocity_mps, command.velocity_mps)
    for x, y in head_m.tolist():
        out.path_head.add(x=x, y=y)
    return out


def turn_message(turn_rate_radps: float) -> Any:
    """Return the turn rate of a planner that drives itself [rad/s]."""
    return message("beacon_mj.Turn")(turn_rate_radps=turn_rate_radps)


def decision_message(info: PlannerInfo) -> Any:
    """Return why a command was chosen; path and beliefs are in other messages."""
    out = message("beacon_mj.Decision")(
        action=info.action,
        reason=info.reason,
        replanned=info.replanned,
        expansions=info.expansions,
    )
    if info.target is not None:
        out.target = info.target
    if info.cost_push is not None:
        out.cost_push = float(info.cost_push)
    if info.cost_detour is not None:
        out.cost_detour = float(info.cost_detour)
    for name, value in info.terms.items():
        out.terms.add(name=name, value=float(value))
    return out


def belief_message(info: PlannerInfo) -> Any:
    """Return the class probabilities of every obstacle that a planner knows."""
    out = message("beacon_mj.Belief")()
    for name, (safe, movable, fragile) in info.beliefs.items():
        out.obstacles.add(obstacle=name, safe=safe, movable=movable, fragile=fragile)
    return out


def plan_message(path_m: Array, time_ns: int) -> Any:
    """Return a path (m, 2) [m] as poses on the floor."""
    out = message("foxglove.PosesInFrame")(frame_id=ARENA)
    stamp(out.timestamp, time_ns)
    for x, y in path_m.tolist():
        pose = out.poses.add()
        set_planar(pose.position, (x, y))
        pose.orientation.w = 1.0
    return out


def robot_message(position_m: Array, time_ns: int, heading_rad: float = 0.0) -> Any:
    """Return the robot's pose."""
    out = message("foxglove.PoseInFrame")(frame_id=ARENA)
    stamp(out.timestamp, time_ns)
    set_planar(out.pose.position, position_m)
    out.pose.orientation.w = math.cos(0.5 * heading_rad)
    if heading_rad:
        out.pose.orientation.z = math.sin(0.5 * heading_rad)
    return out


def contacts_message(contacts: tuple[PairForce, ...]) -> Any:
    """Return every obstacle contact of a step."""
    out = message("beacon_mj.Contacts")()
    for c in contacts:
        entry = out.contacts.add(
            obstacle=c.obstacle,
            counterpart=c.counterpart,
            filtered_n=c.filtered_n,
            peak_n=c.peak_n,
            filtered_peak_n=c.filtered_peak_n,
            impulse_ns=c.impulse_ns,
        )
        force, point = entry.force_n, entry.point_m
        force.x, force.y, force.z = c.force_n.tolist()
        point.x, point.y, point.z = c.point_m.tolist()
    return out


def sensed_message(visible: list[str], updated: list[SensedObstacle]) -> Any:
    """Return what is in range now, and the obstacles whose map entry changed."""
    out = message("beacon_mj.Sensed")(visible=visible)
    for o in updated:
        entry = out.updated.add(
            obstacle=o.id,
            density_kgm3=o.density_kgm3,
            friction=o.friction,
            broken=o.broken,
        )
        set_planar(entry.centroid_m, o.centroid_m)
        if o.kind is not None:
            entry.kind = o.kind
        scores = entry.scores
        scores.safe, scores.movable, scores.fragile = o.scores
    return out


class StateDelta:
    """Turns states into messages that hold only what changed, bit for bit."""

    def __init__(self) -> None:
        """Start with nothing: the first state is written in full."""
        self._qpos = np.zeros(0, np.int64)
        self._qvel = np.zeros(0, np.int64)

    def message(self, step: int, qpos: Array, qvel: Array) -> Any:
        """Return the state after `step`, as changes since the last call."""
        out = message("beacon_mj.State")(step=step)
        bits, rates = qpos.view(np.int64), qvel.view(np.int64)
        if len(self._qpos) == 0:
            out.full = True
            out.qpos.extend(qpos.tolist())
            out.qvel.extend(qvel.tolist())
        else:
            for index, values, now, before in (
                (out.qpos_index, out.qpos, bits, self._qpos),
                (out.qvel_index, out.qvel, rates, self._qvel),
            ):
                changed = (now != before).nonzero()[0]
                index.extend(changed.tolist())
                values.extend(now[changed].view(np.float64).tolist())
        self._qpos, self._qvel = bits.copy(), rates.copy()
        return out


def set_planar(target: Any, values: Any) -> None:
    """Write x and y of a vector message."""
    target.x, target.y = float(values[0]), float(values[1])


def push_message(attempt: AttemptEnd) -> Any:
    """Return how a push attempt ended."""
    return message("beacon_mj.Push")(
        obstacle=attempt.obstacle,
        evidence=attempt.evidence,
        force_n=attempt.force_n,
        began_s=attempt.began_s,
        ended_s=attempt.ended_s,
    )


def damage_message(damage: Damage) -> Any:
    """Return that an obstacle broke."""
    return message("beacon_mj.Damage")(
        obstacle=damage.obstacle,
        counterpart=damage.counterpart,
        force_n=damage.force_n,
        time_s=damage.time_s,
    )
