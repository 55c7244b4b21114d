"""One episode, a control step at a time; who decides is somebody else's matter."""

import time
from collections.abc import Sequence
from typing import Protocol as Interface

import numpy as np
from msgspec import UNSET

from beacon_mj.episode.protocol import Protocol, battery_slope
from beacon_mj.episode.sensor import Sensor
from beacon_mj.episode.trace import Outcome, StepRecord, Trace
from beacon_mj.episode.worlds import is_world_of, world_of
from beacon_mj.errors import SceneError, one_line
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.numerics import norm, norms
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.robots import robot_in
from beacon_mj.world import BaseWorld, SimulationError, StepOutcome
from beacon_mj.world.overnight import Left
from beacon_mj.world.wheels import TURN_RATE_RADPS


class Listener(Interface):
    """Something that follows an episode while it runs, such as a recorder."""

    def begin(self, trace: Trace, world: BaseWorld, observation: Observation) -> None:
        """Take note of the start, before the first decision."""

    def step(
        self, record: StepRecord, world: BaseWorld, observation: Observation
    ) -> None:
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


class Episode:
    """One episode from its first observation to its outcome.

    It goes on while `trace.outcome` is None: `step` it with commands, or `end` it, and
    then `close` it.

    Attributes:
        task: What is told before the first step.
        world: The world.
        observation: What is known now.
        trace: What happened so far.
        battery: Charge, in [0, 1].
    """

    def __init__(
        self,
        scene: Scene,
        protocol: Protocol,
        name: str = "planner",
        *,
        seed: int = 0,
        listeners: Sequence[Listener] = (),
        world: BaseWorld | None = None,
        oracle: bool = False,
        left: Left | None = None,
        suite: str | None = None,
    ) -> None:
        """Begin; see `run_episode` for the arguments.

        Raises:
            SceneError: If the scene is not valid, or `world` is another's.
        """
        self._began_s = time.perf_counter()
        self.world = _at_start(scene, protocol, world, left)
        self.task = make_task(scene, protocol, seed)
        self.battery = 1.0
        self._sensor = Sensor(self.world, protocol)
        self.observation = self._sensor.observe(None, self.battery)
        self.trace = Trace(
            planner=name,
            scene=scene,
            protocol=protocol,
            start_m=self.world.position_m,
            oracle=oracle,
            left=left,
            suite=suite,
            first_sensed=tuple(o.id for o in self.observation.obstacles),
        )
        self._slope = battery_slope(scene)
        self._positions = [self.trace.start_m]
        self._listeners = listeners
        for listener in listeners:
            listener.begin(self.trace, self.world, self.observation)

    def step(self, command: Command, decision_s: float = 0.0) -> None:
        """Do what is commanded for one control period.

        Args:
            command: A sound command; see `answers.checked_command`.
            decision_s: Wall-clock time that it took to decide [s].
        """
        if command.give_up:
            self.end("gave_up", one_line(command.info.reason))
            return
        try:
            outcome = self.world.step(command.velocity_mps, command.turn_rate_radps)
        except SimulationError as error:
            self.end("simulation_error", str(error))
            return
        self._record(command, outcome, decision_s)
        self.trace.outcome = self._ended()

    def end(self, outcome: Outcome, detail: str) -> None:
        """End the episode, with one line about why."""
        self.trace.outcome, self.trace.detail = outcome, detail

    def close(self) -> None:
        """Note the wall-clock time, and tell those that listen of the end."""
        self.trace.wall_time_s = time.perf_counter() - self._began_s
        for listener in self._listeners:
            listener.end(self.trace)

    def _record(self, command: Command, outcome: StepOutcome, seconds: float) -> None:
        travelled = norm(outcome.position_m - self._positions[-1])
        self.battery = max(0.0, self.battery - self._slope * travelled)
        self._positions.append(outcome.position_m)
        known = len(self.observation.obstacles)
        self.observation = self._sensor.observe(outcome, self.battery)
        record = StepRecord(
            command=command,
            outcome=outcome,
            battery=self.battery,
            newly_sensed=tuple(o.id for o in self.observation.obstacles[known:]),
            decision_s=seconds,
        )
        self.trace.steps.append(record)
        for listener in self._listeners:
            listener.step(record, self.world, self.observation)

    def _ended(self) -> Outcome | None:
        protocol, task = self.trace.protocol, self.task
        if norm(self._positions[-1] - task.goal_m) <= task.goal_tolerance_m:
            return "reached"
        if protocol.battery_ends_episode and self.battery <= 0.0:
            return "battery_empty"
        if len(self.trace.steps) >= task.max_steps:
            return "timeout"
        return "stuck" if self._is_stuck() else None

    def _is_stuck(self) -> bool:
        """Whether the robot has stayed about where it is for too long."""
        protocol = self.trace.protocol
        window = round(protocol.stuck_after_s / self.task.control_period_s)
        here, radius_m = self._positions[-1], protocol.stuck_radius_m
        if len(self._positions) <= window:
            return False
        if norm(self._positions[-window] - here) >= radius_m:  # Most of the time.
            return False
        recent = np.array(self._positions[-window:])
        return bool(norms(recent - here).max() < radius_m)


def _at_start(
    scene: Scene, protocol: Protocol, world: BaseWorld | None, left: Left | None
) -> BaseWorld:
    """Return a world of the scene at the start of the episode."""
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
    if world is not None and not is_world_of(world, protocol):
        raise SceneError(
            "Expected the world that the protocol asks for but it was a "
            f"{type(world).__name__} of another kind."
        )
    if world is None and left is None:
        return world_of(scene, protocol)
    world = world or world_of(scene, protocol)
    world.reset(left)
    return world
