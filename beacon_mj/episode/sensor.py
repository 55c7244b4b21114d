"""The sensing wrapper: the only way from the true world to a planner.

An obstacle is sensed when the distance between the robot's body and its footprint is
at most r_s, and whenever the robot touches it, whatever hides it. Once sensed it stays
in the map with its last seen pose. It is sensed from the robot: where that is wrong
about its own position, what it sees is off by as much. Class, mass, friction and break
force never cross; perceived values do, as the scene stores them.

Where obstacles are not perceived there is no map at all: a planner has the scan of the
lidar, if there is one, and feels where something touches the bumper, but not what.
"""

import numpy as np
import shapely

from beacon_mj.constants import CONTACT_N
from beacon_mj.episode.lidar import Scanner
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.sensor_noise import ForceGain, PoseError
from beacon_mj.episode.sighting import sighting
from beacon_mj.geometry import Array, Footprint, Footprints, Mask
from beacon_mj.interface import Contact, Observation, PushEvidence, SensedObstacle
from beacon_mj.numerics import norm, norms
from beacon_mj.streams import stream
from beacon_mj.world import BaseWorld, StepOutcome
from beacon_mj.world.outcome import ROBOT
from beacon_mj.world.pushes import AttemptEnd

_SLACK_M = 1e-6  #: What is farther away than a ray is long by this cannot hide its end.


class Sensor:
    """Turns the state of one world into observations, and remembers sightings."""

    def __init__(self, world: BaseWorld, protocol: Protocol) -> None:
        """Sense `world` under `protocol`; the noise stream is the scene's own."""
        self._world = world
        scene = world.scene
        sheet = self._sheet = protocol.sensor(scene)
        self._rng = stream("sensor", scene.seed, scene.family, scene.index)
        own = sheet.robot_pose_noise_m
        self._pose = PoseError(scene, own) if own > 0.0 else None
        felt = sheet.force_noise
        self._gain = ForceGain(scene, felt) if felt > 0.0 else None
        self._scanner = Scanner(world, sheet) if sheet.lidar_beams else None
        self._blind = sheet.obstacles == "none"
        self._off_m: Array | None = None
        self._number = {o.id: i for i, o in enumerate(scene.obstacles)}
        self._order: list[int] = []
        self._seen: dict[int, SensedObstacle] = {}
        self._sensed_last: set[int] = set()
        self._sighting: dict[int, Footprint] = {}
        self._measured: dict[int, Footprint] = {}
        self._untold: list[AttemptEnd] = []
        self._stacked = Footprints()
        self._version = 0

    def observe(self, outcome: StepOutcome | None, battery: float) -> Observation:
        """Return what is known after a control step, or at the start (None)."""
        world = self._world
        time_s = 0.0 if outcome is None else outcome.time_s
        self._off_m = None if self._pose is None else self._pose.next_m()
        gain = 1.0 if self._gain is None else self._gain.next()
        if not self._blind:
            self._look(time_s, outcome)
        felt = () if outcome is None else _felt(outcome, gain)
        ended = () if outcome is None else self._evidence(outcome, gain)
        position = world.position_m
        return Observation(
            step=0 if outcome is None else outcome.step,
            time_s=time_s,
            position_m=position if self._off_m is None else position + self._off_m,
            velocity_mps=world.velocity_mps,
            battery=battery,
            bumper_force_n=gain * world.bumper_force_n,
            drive_effort=0.0 if outcome is None else outcome.drive_effort,
            obstacles=tuple(self._seen[i] for i in self._order),
            footprints=self._stacked,
            map_version=self._version,
            contacts=_nameless(felt) if self._blind else felt,
            evidence=() if self._blind else ended,
            heading_rad=world.heading_rad,
            turn_rate_radps=world.turn_rate_radps,
            scan=None if self._scanner is None else self._scanner.scan(),
        )

    def _look(self, time_s: float, outcome: StepOutcome | None) -> None:
        """Update the map from this moment's sightings."""
        sensed = set(self._visible().nonzero()[0].tolist())
        if outcome is not None:
            sensed |= {self._number[name] for name in _touched(outcome)}
        for i in self._sensed_last - sensed:
            self._seen[i] = _hidden(self._seen[i])
        changed = False
        for i in sorted(sensed):
            changed |= self._sight(i, time_s)
        self._sensed_last = sensed
        if changed:
            self._version += 1
            self._stacked = Footprints.stack(
                [self._seen[i].footprint for i in self._order]
            )

    def _visible(self) -> Mask:
        """Return which obstacles are in range, and in sight, shape (n,)."""
        world, sheet = self._world, self._sheet
        if len(world.footprints) == 0:
            return np.zeros(0, np.bool_)
        gaps = world.footprints.distance(world.position_m)
        visible: Mask = gaps - world.scene.robot.radius_m <= sheet.range_m
        if sheet.occlusion:
            visible &= self._in_sight(visible, gaps)
        if sheet.missed_detection > 0.0:
            visible &= self._rng.random(len(visible)) >= sheet.missed_detection
        return np.asarray(visible)

    def _in_sight(self, candidates: Mask, gaps: Array) -> Mask:
        """Return which candidates no other obstacle hides entirely, shape (n,).

        An obstacle is in sight when the ray to its nearest point or to its centroid
        meets no other footprint. `gaps` (n,) are the distances of all [m].
        """
        outlines, eye = self._world.outlines, self._world.position_m
        numbers = np.flatnonzero(candidates)
        sight = np.zeros(len(candidates), np.bool_)
        if len(numbers) == 0:
            return sight
        near = self._world.footprints.nearest_points(eye)
        centroids = np.array([outlines[i].centroid for i in numbers])
        farthest_m = norms(np.concatenate([near[numbers], centroids]) - eye).max()
        close = np.flatnonzero(gaps <= farthest_m + _SLACK_M)
        polygons = np.array([outlines[i].polygon() for i in close])
        for i, centroid in zip(numbers, centroids, strict=True):
            others = polygons[close != i]
            for point in (near[i], centroid):
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
        same = before is not None and self._sighting[i] is outline
        if before is not None and same and self._off_m is None:
            if before.seen_s != time_s or before.broken != broken or not before.visible:
                self._seen[i] = sighting(
                    before, before.footprint, before.centroid_m, time_s, True, broken
                )
            return False
        if not same:
            self._sighting[i], self._measured[i] = outline, self._measure(outline)
        self._seen[i] = self._sensed(i, time_s, broken)
        if before is None:
            self._order.append(i)
        return True

    def _measure(self, outline: Footprint) -> Footprint:
        """Return an outline with the error of an obstacle's place from the robot."""
        noise_m = self._sheet.pose_noise_m
        if noise_m <= 0.0:
            return outline
        return outline.shifted(noise_m * self._rng.standard_normal(2))

    def _sensed(self, i: int, time_s: float, broken: bool) -> SensedObstacle:
        obstacle, outline = self._world.scene.obstacles[i], self._measured[i]
        if self._off_m is not None:
            outline = outline.shifted(self._off_m)
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

    def _evidence(self, outcome: StepOutcome, gain: float) -> tuple[PushEvidence, ...]:
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
            PushEvidence(a.obstacle, a.evidence, gain * a.force_n, a.ended_s)
            for a in told
        )


def _hidden(seen: SensedObstacle) -> SensedObstacle:
    """Return an obstacle that is out of sight now, as it was seen last."""
    return sighting(
        seen, seen.footprint, seen.centroid_m, seen.seen_s, False, seen.broken
    )


def _touched(outcome: StepOutcome) -> set[str]:
    """Return the obstacles that the bumper touches, or pushed in this step."""
    felt = {c.id for c in _felt(outcome)}
    return felt | {a.obstacle for a in outcome.own_attempts}


def _felt(outcome: StepOutcome, gain: float = 1.0) -> tuple[Contact, ...]:
    """Return the obstacles that touch the bumper at the end of the step."""
    felt = []
    for c in outcome.contacts:
        size = norm(c.force_n[:2])
        if c.counterpart == ROBOT and c.filtered_n > CONTACT_N and size > 0.0:
            normal = c.force_n[:2] / size
            felt.append(Contact(c.obstacle, normal, gain * c.filtered_n))
    return tuple(felt)


def _nameless(felt: tuple[Contact, ...]) -> tuple[Contact, ...]:
    """Return contacts of which only place and force are known."""
    return tuple(contact._replace(id="") for contact in felt)
