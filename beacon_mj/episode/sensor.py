"""The sensing wrapper: the only way from the true world to a planner.

An obstacle is sensed when the distance between the robot's body and its footprint is
at most r_s, and whenever the robot touches it, whatever hides it. Once sensed it stays
in the map with its last seen pose. Class, mass, friction and break force never cross;
perceived values do, as the scene stores them.
"""

from dataclasses import replace

import numpy as np
import shapely

from beacon_mj.constants import CONTACT_N
from beacon_mj.episode.protocol import Protocol
from beacon_mj.geometry import Footprint, Footprints, Mask
from beacon_mj.interface import Contact, Observation, PushEvidence, SensedObstacle
from beacon_mj.numerics import norm
from beacon_mj.scene import Obstacle
from beacon_mj.streams import stream
from beacon_mj.world import StepOutcome, World
from beacon_mj.world.outcome import ROBOT
from beacon_mj.world.pushes import AttemptEnd


class Sensor:
    """Turns the state of one world into observations, and remembers sightings."""

    def __init__(self, world: World, protocol: Protocol) -> None:
        """Sense `world` under `protocol`; the noise stream is the scene's own."""
        self._world = world
        scene = world.scene
        self._model = protocol.sensor(scene)
        self._rng = stream("sensor", scene.seed, scene.family, scene.index)
        self._number = {o.id: i for i, o in enumerate(scene.obstacles)}
        self._order: list[int] = []
        self._seen: dict[int, SensedObstacle] = {}
        self._sighting: dict[int, Footprint] = {}
        self._untold: list[AttemptEnd] = []
        self._stacked = Footprints()
        self._version = 0

    def observe(self, outcome: StepOutcome | None, battery: float) -> Observation:
        """Return what is known after a control step, or at the start (None)."""
        world = self._world
        time_s = 0.0 if outcome is None else outcome.time_s
        self._look(time_s, outcome)
        return Observation(
            step=0 if outcome is None else outcome.step,
            time_s=time_s,
            position_m=world.position_m,
            velocity_mps=world.velocity_mps,
            battery=battery,
            bumper_force_n=world.bumper_force_n,
            drive_effort=0.0 if outcome is None else outcome.drive_effort,
            obstacles=tuple(self._seen[i] for i in self._order),
            footprints=self._stacked,
            map_version=self._version,
            contacts=() if outcome is None else _felt(outcome),
            evidence=() if outcome is None else self._evidence(outcome),
        )

    def _look(self, time_s: float, outcome: StepOutcome | None) -> None:
        """Update the map from this moment's sightings."""
        visible = self._visible()
        touched = set() if outcome is None else _touched(outcome)
        changed = False
        for i in range(len(visible)):
            if visible[i] or self._world.scene.obstacles[i].id in touched:
                changed |= self._sight(i, time_s)
            elif i in self._seen and self._seen[i].visible:
                self._seen[i] = replace(self._seen[i], visible=False)
        if changed:
            self._version += 1
            self._stacked = Footprints.stack(
                [self._seen[i].footprint for i in self._order]
            )

    def _visible(self) -> Mask:
        """Return which obstacles are in range, and in sight, shape (n,)."""
        world, model = self._world, self._model
        if len(world.footprints) == 0:
            return np.zeros(0, np.bool_)
        gaps = world.footprints.distance(world.position_m)
        visible: Mask = gaps - world.scene.robot.radius_m <= model.radius_m
        if model.occlusion:
            visible &= self._in_sight(visible)
        if model.missed_detection > 0.0:
            visible &= self._rng.random(len(visible)) >= model.missed_detection
        return np.asarray(visible)

    def _in_sight(self, candidates: Mask) -> Mask:
        """Return which candidates no other obstacle hides entirely, shape (n,).

        An obstacle is in sight when the ray to its nearest point or to its centroid
        meets no other footprint.
        """
        world = self._world
        eye = world.position_m
        near = world.footprints.nearest_points(eye)
        polygons = np.array([f.polygon() for f in world.outlines])
        sight = np.zeros(len(candidates), np.bool_)
        for i in np.flatnonzero(candidates):
            others = np.delete(polygons, i)
            for point in (near[i], world.outlines[i].centroid):
                ray = shapely.LineString([eye, point])
                if not shapely.intersects(others, ray).any():
                    sight[i] = True
                    break
        return sight

    def _sight(self, i: int, time_s: float) -> bool:
        """Record a sighting of obstacle i; return whether the map changed."""
        world = self._world
        outline = world.outlines[i]
        before = self._seen.get(i)
        broken = bool(world.broken[i])
        if before is not None and self._sighting[i] is outline:
            if before.seen_s != time_s or before.broken != broken or not before.visible:
                self._seen[i] = replace(
                    before, visible=True, seen_s=time_s, broken=broken
                )
            return False
        self._sighting[i] = outline
        self._seen[i] = self._sensed(world.scene.obstacles[i], outline, time_s, broken)
        if before is None:
            self._order.append(i)
        return True

    def _sensed(
        self, obstacle: Obstacle, outline: Footprint, time_s: float, broken: bool
    ) -> SensedObstacle:
        if self._model.pose_noise_m > 0.0:
            outline = outline.shifted(
                self._model.pose_noise_m * self._rng.standard_normal(2)
            )
        perceived = obstacle.perceived
        return SensedObstacle(
            id=obstacle.id,
            footprint=outline,
            centroid_m=outline.centroid,
            height_m=obstacle.shape.height_m,
            volume_m3=obstacle.shape.volume_m3,
            density_kgm3=perceived.density_kgm3,
            friction=perceived.friction,
            scores=perceived.scores,
            seen_s=time_s,
            visible=True,
            broken=broken,
            kind=perceived.kind,
        )

    def _evidence(self, outcome: StepOutcome) -> tuple[PushEvidence, ...]:
        """Return the evidence about obstacles that are sensed in this step.

        What the robot touched always is. What broke unseen, by something else, is told
        when the obstacle is sensed next.
        """
        told: list[AttemptEnd] = []
        untold: list[AttemptEnd] = []
        for attempt in (*self._untold, *outcome.attempts):
            seen = self._seen.get(self._number[attempt.obstacle])
            sensed = seen is not None and seen.visible
            (told if sensed else untold).append(attempt)
        self._untold = untold
        return tuple(
            PushEvidence(a.obstacle, a.evidence, a.force_n, a.ended_s) for a in told
        )


def _touched(outcome: StepOutcome) -> set[str]:
    """Return the obstacles that the bumper touches, or pushed in this step."""
    felt = {c.id for c in _felt(outcome)}
    return felt | {a.obstacle for a in outcome.own_attempts}


def _felt(outcome: StepOutcome) -> tuple[Contact, ...]:
    """Return the obstacles that touch the bumper at the end of the step."""
    felt = []
    for c in outcome.contacts:
        size = norm(c.force_n[:2])
        if c.counterpart == ROBOT and c.filtered_n > CONTACT_N and size > 0.0:
            felt.append(Contact(c.obstacle, c.force_n[:2] / size, c.filtered_n))
    return tuple(felt)
