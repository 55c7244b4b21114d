"""A robot without a physics engine: a servo with limited force, and a sensor."""

from dataclasses import dataclass, field

import numpy as np

from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.interface import Command, Observation, SensorSheet, Task
from beacon_mj.planners.base import Planner

ROOM = (0.0, 0.0, 6.0, 6.0)


def make_task(
    start: tuple[float, float],
    goal: tuple[float, float],
    workspace: tuple[float, float, float, float] = ROOM,
    max_steps: int = 1000,
) -> Task:
    return Task(
        workspace_m=workspace,
        start_m=np.array(start, dtype=float),
        goal_m=np.array(goal, dtype=float),
        radius_m=0.12,
        mass_kg=10.0,
        speed_mps=0.5,
        force_max_n=60.0,
        bumper_stiffness_npm=5000.0,
        control_period_s=0.1,
        goal_tolerance_m=0.1,
        sensing_radius_m=1.0,
        max_steps=max_steps,
        motion_cost_jpm=1.0,
        seed=0,
        sensor=SensorSheet(force_error=0.21),
    )


def disc(x: float, y: float, radius: float) -> Footprint:
    return Footprint(np.array([[x, y]]), radius)


def box(west: float, south: float, east: float, north: float) -> Footprint:
    return Footprint(
        np.array([[west, south], [east, south], [east, north], [west, north]])
    )


def servo(position: Array, velocity: Array, command: Array) -> tuple[Array, Array]:
    """One control period; returns the trace (20, 2) and the last velocity."""
    step_s, acceleration, constant_s = 0.005, 6.0, 0.01
    trace = np.empty((20, 2))
    for i in range(20):
        wanted = (command - velocity) / constant_s
        wanted *= min(1.0, acceleration / max(float(np.hypot(*wanted)), 1e-12))
        velocity = velocity + wanted * step_s
        position = position + velocity * step_s
        trace[i] = position
    return trace, velocity


@dataclass
class Run:
    """How an episode went. `clearance_m` is the smallest gap beside the disc."""

    outcome: str = "timeout"
    trace: list[Array] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)
    clearance_m: float = np.inf

    @property
    def length_m(self) -> float:
        return float(np.hypot(*np.diff(self.trace, axis=0).T).sum())


def observe(
    step: int, position: Array, velocity: Array, footprints: Footprints, version: int
) -> Observation:
    return Observation(
        step=step,
        time_s=0.1 * step,
        position_m=position,
        velocity_mps=velocity,
        battery=1.0,
        bumper_force_n=np.zeros(2),
        drive_effort=0.0,
        obstacles=(),
        footprints=footprints,
        map_version=version,
        contacts=(),
        evidence=(),
    )


def drive(planner: Planner, task: Task, obstacles: list[Footprint]) -> Run:
    """Run one episode among fixed obstacles, which are sensed within range."""
    everything = Footprints.stack(obstacles)
    known: list[int] = []
    run, position, velocity = Run(), task.start_m.copy(), np.zeros(2)
    run.trace.append(position)
    planner.reset(task)
    low, high = np.array(task.workspace_m[:2]), np.array(task.workspace_m[2:])
    for step in range(task.max_steps):
        reach = everything.distance(position) - task.radius_m
        seen = np.flatnonzero(reach <= task.sensing_radius_m)
        known += [int(i) for i in seen if i not in known]
        footprints = Footprints.stack([obstacles[i] for i in known])
        command = planner.act(observe(step, position, velocity, footprints, len(known)))
        run.commands.append(command)
        if command.give_up:
            run.outcome = "gave_up"
            break
        trace, velocity = servo(position, velocity, command.velocity_mps)
        position = trace[-1]
        run.trace.append(position)
        gaps = [everything.distances(trace).min(initial=np.inf)]
        gaps += [(trace - low).min(), (high - trace).min()]
        run.clearance_m = min(run.clearance_m, min(gaps) - task.radius_m)
        if np.hypot(*(position - task.goal_m)) <= task.goal_tolerance_m:
            run.outcome = "reached"
            break
    return run
