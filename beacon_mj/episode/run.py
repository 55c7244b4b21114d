"""The execution loop of one episode (paper II.I)."""

import time
from collections.abc import Callable, Sequence
from typing import Protocol as Interface

import numpy as np
from msgspec import UNSET

from beacon_mj.episode.answers import PlannerFailure
from beacon_mj.episode.door import Door
from beacon_mj.episode.interrupts import watched
from beacon_mj.episode.protocol import Protocol, battery_slope
from beacon_mj.episode.rollout import truth_about
from beacon_mj.episode.routes import route_graph
from beacon_mj.episode.sensor import Sensor
from beacon_mj.episode.trace import Outcome, StepRecord, Trace
from beacon_mj.errors import PlannerError, SceneError, one_line
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.numerics import norm, norms
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.robots import robot_in
from beacon_mj.world import SimulationError, StepOutcome, World
from beacon_mj.world.overnight import Left
from beacon_mj.world.wheels import TURN_RATE_RADPS


class Listener(Interface):
    """Something that follows an episode while it runs, such as a recorder."""

    def begin(self, trace: Trace, world: World, observation: Observation) -> None:
        """Take note of the start, before the first decision."""

    def step(self, record: StepRecord, world: World, observation: Observation) -> None:
        """Take note of one control step and the observation after it."""

    def end(self, trace: Trace) -> None:
        """Take note of the end; `trace.outcome` is set."""


def make_task(scene: Scene, protocol: Protocol, seed: int) -> Task:
    """Return what a planner is told about a scene before the first step."""
    robot, sensor = protocol.robot_of(scene), protocol.sensor(scene)
    disc = robot_in(scene, protocol.robot).is_disc
    return Task(
        workspace_m=scene.workspace_m,
        start_m=np.array(scene.start_m),
        goal_m=np.array(scene.goal_m),
        radius_m=robot.radius_m,
        mass_kg=robot.mass_kg,
        speed_mps=robot.speed_mps,
        force_max_n=robot.force_max_n,
        bumper_stiffness_npm=robot.bumper_stiffness_npm,
        control_period_s=robot.control_period_s,
        goal_tolerance_m=protocol.goal_tolerance_m,
        sensing_radius_m=sensor.range_m,
        max_steps=protocol.step_limit(scene),
        motion_cost_jpm=protocol.motion_cost(scene),
        seed=seed,
        mission_day=None if scene.day is UNSET else scene.day,
        mission_days=None if scene.days is UNSET else scene.days,
        sensor=sensor,
        drive="holonomic" if disc else "differential",
        turn_rate_max_radps=0.0 if disc else TURN_RATE_RADPS,
    )


def world_of(scene: Scene, protocol: Protocol) -> World:
    """Return a world of a scene, with the robot and the physics step of a protocol."""
    return World(scene, protocol.timestep_s, robot=protocol.robot)


def run_episode(
    scene: Scene,
    planner: Planner,
    name: str = "planner",
    protocol: Protocol | None = None,
    seed: int = 0,
    listeners: Sequence[Listener] = (),
    world: World | None = None,
    oracle: bool | None = None,
    left: Left | None = None,
    goes_on: bool = False,
    suite: str | None = None,
) -> Trace:
    """Run one episode to its end.

    Args:
        scene: The world to cross.
        planner: Who decides.
        name: The planner's name in results.
        protocol: How the episode is run; the default protocol if None.
        seed: The planner's seed.
        listeners: Recorders and displays.
        world: A world of the same scene to reuse; it is reset first.
        oracle: Whether the planner is told the truth, which the trace then says; by
            default an `Oracle` is, and no other planner.
        left: How the room was left the day before; None for the scene's own places.
        goes_on: Whether the planner ran the day before, and is told `next_day` in place
            of `reset`; see `beacon_mj.run_mission`.
        suite: The released suite that the scene is of, for its row.

    Returns:
        The trace. A planner that fails, or a simulation that diverges, ends its
        episode with an outcome that says so; nothing is raised for it.

    Raises:
        SceneError: If the scene is not valid, or `world` is another's.
    """
    began = time.perf_counter()
    protocol = Protocol() if protocol is None else protocol
    robot = robot_in(scene, protocol.robot)
    if world is not None and world.robot_file != robot:
        raise SceneError(
            f"Expected a world with robot {robot.name!r}, as the protocol says, but it "
            f"has {world.robot_file.name!r}, or another version of it."
        )
    if world is not None and world.scene != scene:
        raise SceneError(
            f"Expected a world of scene {scene.name} but it is of {world.scene.name}, "
            "or of another version of it."
        )
    if world is not None or left is not None:
        world = world or world_of(scene, protocol)
        world.reset(left)
    else:
        world = world_of(scene, protocol)
    sensor = Sensor(world, protocol)
    observation = sensor.observe(None, 1.0)
    told = isinstance(planner, Oracle) if oracle is None else oracle
    trace = Trace(
        planner=name,
        scene=scene,
        protocol=protocol,
        start_m=world.position_m,
        oracle=told,
        left=left,
        suite=suite,
        first_sensed=tuple(o.id for o in observation.obstacles),
    )
    for listener in listeners:
        listener.begin(trace, world, observation)
    truth = None
    if told:
        truth = truth_about(scene, protocol, run_episode, left)
    door = Door(planner, protocol.decision_limit_s)
    loop = _Loop(trace, door, world, sensor, listeners)
    try:
        with watched():
            task = make_task(scene, protocol, seed)
            begin = door.next_day if goes_on else door.reset
            trace.outcome = loop.run(lambda: begin(task, truth), task, observation)
    finally:
        door.close()
    trace.wall_time_s = time.perf_counter() - began
    for listener in listeners:
        listener.end(trace)
    return trace


class _Loop:
    """The state of one running episode."""

    def __init__(
        self,
        trace: Trace,
        door: Door,
        world: World,
        sensor: Sensor,
        listeners: Sequence[Listener],
    ) -> None:
        self.trace = trace
        self.door = door
        self.world = world
        self.sensor = sensor
        self.listeners = listeners
        self.battery = 1.0
        self.slope = battery_slope(trace.scene)
        self.positions = [trace.start_m]

    def run(
        self, begin: Callable[[], None], task: Task, observation: Observation
    ) -> Outcome:
        """Start the planner, and step until the episode ends; return how."""
        try:
            self.door.tell(route_graph(self.trace.scene))
            begin()
            while True:
                command, seconds = self.door.decide(observation)
                if command.give_up:
                    self.trace.detail = one_line(command.info.reason)
                    return "gave_up"
                outcome = self.world.step(command.velocity_mps, command.turn_rate_radps)
                observation = self._record(command, outcome, seconds, observation)
                if (end := self._ended(task)) is not None:
                    return end
        except SimulationError as error:
            self.trace.detail = str(error)
            return "simulation_error"
        except (PlannerFailure, PlannerError) as error:
            self.trace.detail = str(error)
            return "planner_error"

    def _record(
        self,
        command: Command,
        outcome: StepOutcome,
        seconds: float,
        before: Observation,
    ) -> Observation:
        travelled = norm(outcome.position_m - self.positions[-1])
        self.battery = max(0.0, self.battery - self.slope * travelled)
        self.positions.append(outcome.position_m)
        observation = self.sensor.observe(outcome, self.battery)
        new = observation.obstacles[len(before.obstacles) :]
        record = StepRecord(
            command=command,
            outcome=outcome,
            battery=self.battery,
            newly_sensed=tuple(o.id for o in new),
            decision_s=seconds,
        )
        self.trace.steps.append(record)
        for listener in self.listeners:
            listener.step(record, self.world, observation)
        return observation

    def _ended(self, task: Task) -> Outcome | None:
        protocol = self.trace.protocol
        if norm(self.positions[-1] - task.goal_m) <= task.goal_tolerance_m:
            return "reached"
        if protocol.battery_ends_episode and self.battery <= 0.0:
            return "battery_empty"
        if len(self.trace.steps) >= task.max_steps:
            return "timeout"
        return "stuck" if self._is_stuck(task) else None

    def _is_stuck(self, task: Task) -> bool:
        """Whether the robot has stayed about where it is for too long."""
        protocol = self.trace.protocol
        window = round(protocol.stuck_after_s / task.control_period_s)
        here, radius_m = self.positions[-1], protocol.stuck_radius_m
        if len(self.positions) <= window:
            return False
        if norm(self.positions[-window] - here) >= radius_m:  # Most of the time.
            return False
        recent = np.array(self.positions[-window:])
        return bool(norms(recent - here).max() < radius_m)
