"""Carrying out a push in a world with inertia, slip, and things that break.

The robot lines up behind the centroid, touches slowly, speeds up, keeps its line
through the centroid wherever the obstacle turns, and stops when the way is clear,
when nothing gives, or when the force on something that may break grows too large.
"""

from typing import Literal

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import (
    Action,
    Observation,
    PushEvidence,
    SensedObstacle,
    Task,
)
from beacon_mj.motion.path_tracking import follow
from beacon_mj.motion.visibility_graph import shortest_path
from beacon_mj.numerics import dot, norm
from beacon_mj.planners.contact.candidates import PushPlan, segment_is_clear
from beacon_mj.planners.contact.limits import PushLimits, braking_room_m

_CRAWL_MPS = 0.08  #: Speed up to which the bumper's force is friction alone [m/s].
_STEADY = 1.25  #: Force limit over the force of a crawl.

Phase = Literal["approach", "touch", "push", "back_off", "done", "failed"]


class PushController:
    """Executes one push plan, step by step.

    Attributes:
        plan: What is being done.
        phase: How far it got; `done` and `failed` end it.
        reason: Why it ended.
        pushed_m: How far the robot has travelled in contact [m].
    """

    def __init__(self, plan: PushPlan, task: Task, limits: PushLimits) -> None:
        """Carry out `plan`."""
        self.plan = plan
        self.phase: Phase = "approach"
        self.reason = ""
        self.pushed_m = 0.0
        self._task = task
        self._limits = limits
        self._room_m = braking_room_m(task.sensor)
        self._speed = limits.touch_mps
        self._force_limit_n = limits.force_limit_n
        self._path: Array | None = None
        self._progress = 0.0
        self._since = 0
        self._lost = 0
        self._last: Array | None = None
        self._stall = 0
        self._retreat = 0

    def act(self, observation: Observation) -> Array:
        """Return the next velocity, shape (2,) [m/s]."""
        self._since += 1
        step = {
            "approach": self._approach,
            "touch": self._touch,
            "push": self._push,
            "back_off": self._back_off,
        }.get(self.phase)
        return np.zeros(2) if step is None else step(observation)

    @property
    def action(self) -> Action:
        """What the robot is doing, in the words of a log."""
        if self.phase == "push":
            return "push"
        return "back_off" if self.phase == "back_off" else "approach"

    @property
    def ended(self) -> bool:
        """Whether there is nothing left to do."""
        return self.phase in ("done", "failed")

    def stop(self, reason: str) -> None:
        """End here: a push that has begun is done, one that has not failed."""
        self.phase = "done" if self.phase == "push" else "failed"
        self.reason = reason

    def learn(self, evidence: PushEvidence) -> None:
        """Back off from what did not move."""
        if evidence.evidence == "not_moved" and evidence.id == self.plan.id:
            self.abort("it did not move")

    def abort(self, reason: str) -> None:
        """Stop pushing and back off."""
        self.phase, self.reason, self._retreat = "back_off", reason, 5

    def obstacle(self, observation: Observation) -> SensedObstacle:
        """Return the pushed obstacle as it is seen now."""
        return observation.obstacles[self.plan.index]

    def _enter(self, phase: Phase) -> None:
        self.phase, self._since = phase, 0

    def _approach(self, observation: Observation) -> Array:
        """Drive to where the push begins, without touching anything."""
        if self._path is None:
            self._path = self._way(observation)
            if self._path is None:
                self.phase, self.reason = "failed", "no way to where the push begins"
                return np.zeros(2)
        tracking = follow(
            self._path, observation.position_m, observation.velocity_mps, self._task,
            progress_m=self._progress,
        )  # fmt: skip
        self._progress = tracking.progress_m
        if tracking.remaining_m < 0.02 and tracking.deviation_m < 0.02:
            self._enter("touch")
            return self._touch(observation)
        if self._since > 150:
            self.phase, self.reason = "failed", "did not reach where the push begins"
        return tracking.velocity_mps

    def _way(self, observation: Observation) -> Array | None:
        """Return a path to the approach point, the direct one if it is clear."""
        here, there = observation.position_m, self.plan.approach_m
        gaps = observation.footprints.distance(here)
        own = float(gaps.min(initial=np.inf)) - 0.002
        for margin in dict.fromkeys((max(0.012, self._room_m), 0.012, 0.004, 0.001)):
            clearance = min(self._task.radius_m + margin, max(own, 0.0))
            if segment_is_clear(observation.footprints, here, there, clearance):
                return np.stack([here, there])
            path = shortest_path(
                here, there, observation.footprints, clearance, self._task.workspace_m
            )
            if path is not None:
                return path
        return None

    def _touch(self, observation: Observation) -> Array:
        """Close the last gap at touching speed."""
        if self._touches(observation):
            self._enter("push")
            return self._push(observation)
        if self._since * self._task.control_period_s * self._limits.touch_mps > 0.2:
            self.phase, self.reason = "done", "the obstacle is no longer there"
        return self._along(observation, self._closing_speed(observation))

    def _closing_speed(self, observation: Observation) -> float:
        """Return the largest speed that still lets the robot slow to a touch [m/s].

        One period at v, after a change from v_0 under the drive's a, and then a change
        to the touching speed w must fit into the gap:

            v T + (v_0 - v) |v_0 - v| / 2 a + (v^2 - w^2) / 2 a.
        """
        task, touch = self._task, self._limits.touch_mps
        drive = 2.0 * task.force_max_n / task.mass_kg
        gap = observation.footprints.distance(observation.position_m)[self.plan.index]
        speed = np.linspace(touch, max(task.speed_mps, touch), 32)
        change = dot(observation.velocity_mps, self.plan.direction) - speed
        advance = speed * task.control_period_s + change * np.abs(change) / drive
        needed = advance + (speed * speed - touch * touch) / drive
        fits = needed <= gap - task.radius_m - self._room_m
        return float(speed[fits].max(initial=touch))

    def _push(self, observation: Observation) -> Array:
        """Push along the line through the centroid."""
        self._measure(observation)
        self._lost = 0 if self._touches(observation) else self._lost + 1
        period = self._task.control_period_s
        force = norm(observation.bumper_force_n)
        if self._speed <= _CRAWL_MPS:
            # What a crawl takes is friction, at any speed; only more is a blow.
            self._force_limit_n = max(self._force_limit_n, _STEADY * force)
        if force > self._force_limit_n:
            self._speed = max(0.25 * self._speed, 0.01)
        else:
            ramp = self._limits.ramp_mps2 * period
            self._speed = min(self._speed + ramp, self._limits.push_mps)
        if self._stall * period > 1.0:
            self.abort("it does not give way")
        elif self._lost * period > 1.0:
            self.phase, self.reason = "done", "the obstacle slipped away"
        return self._along(observation, self._speed)

    def _measure(self, observation: Observation) -> None:
        """Keep count of travel and of steps without any."""
        here = observation.position_m
        travelled = 0.0 if self._last is None else norm(here - self._last)
        self._last = here
        self.pushed_m += travelled
        crawling = travelled < 0.004 and self._since > 3
        self._stall = self._stall + 1 if crawling else 0

    def _along(self, observation: Observation, speed: float) -> Array:
        """Return a velocity along the push that steers back to the centroid's line."""
        u = self.plan.direction
        across = np.array([-u[1], u[0]])
        centroid = self.obstacle(observation).centroid_m
        offset = dot(observation.position_m - centroid, across)
        sideways = float(np.clip(-2.0 * offset, -0.6 * speed, 0.6 * speed))
        velocity = speed * u + sideways * across
        return self._clear_of_others(observation, velocity)

    def _clear_of_others(self, observation: Observation, velocity: Array) -> Array:
        """Take out what would drive the robot into obstacles that are not pushed."""
        moved = {i for i, _ in self.plan.cascade.moved} | {self.plan.index}
        here = observation.position_m
        after = here + velocity * self._task.control_period_s
        gaps = observation.footprints.distance(after) - self._task.radius_m
        near = observation.footprints.nearest_points(here)
        for i in np.flatnonzero(gaps < 0.006):
            if int(i) in moved:
                continue
            away = here - near[i]
            size = norm(away)
            normal = away / max(size, 1e-9)
            into = dot(velocity, normal)
            if into < 0.0:
                velocity = velocity - into * normal
        return velocity

    def _back_off(self, observation: Observation) -> Array:
        """Retreat from an obstacle that does not give way."""
        self._retreat -= 1
        if self._retreat <= 0:
            self.phase = "failed"
        return np.asarray(-0.25 * self.plan.direction)

    def _touches(self, observation: Observation) -> bool:
        return any(c.id == self.plan.id for c in observation.contacts)
