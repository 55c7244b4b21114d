"""Candidate pushes of one obstacle: from where, which way, how far, moving what."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from beacon_mj.geometry import Array, Footprint, Footprints, signed_distance
from beacon_mj.interface import Observation, SensedObstacle, Task
from beacon_mj.numerics import angles_of, dot, norm, norms
from beacon_mj.planners.contact.cost_map import Crossing
from beacon_mj.planners.contact.push_model import PushWorld
from beacon_mj.pushing.cascade import Cascade

#: Directions that are tried, relative to the way through [rad]; the wide fan is for
#: when nothing else is left, and an obstacle must be cleared away to whatever side.
FAN = tuple(math.radians(a) for a in (0.0, -15.0, 15.0, -30.0, 30.0, -45.0, 45.0))
WIDE_FAN = tuple(math.radians(a) for a in range(-180, 180, 20))
STANDOFF_M = 0.06  #: Gap between bumper and obstacle where the approach ends [m].
FOLLOW_THROUGH_M = 0.25  #: Travel beyond the crossing until the disc can turn away [m].
_LONGEST_M = 2.0
_GOAL_ROOM_M = 0.1  #: Room beside the disc at the goal that no push may take [m].


@dataclass(frozen=True, slots=True)
class PushPlan:
    """One way to push one obstacle.

    Attributes:
        index: The obstacle, in the order of the observation.
        id: Its name.
        direction: Unit vector of the push, shape (2,).
        approach_m: Where the robot lines up, shape (2,) [m].
        touch_m: Centre of the robot when the bumper touches, shape (2,) [m].
        travel_m: How far it is to be pushed [m].
        cascade: What would move.
    """

    index: int
    id: str
    direction: Array
    approach_m: Array
    touch_m: Array
    travel_m: float
    cascade: Cascade

    @property
    def end_m(self) -> Array:
        """Centre of the robot after the push, shape (2,) [m]."""
        return np.asarray(self.touch_m + self.travel_m * self.direction)

    def moved(self, observation: Observation) -> list[SensedObstacle]:
        """Return what would move as it is seen now, the pushed obstacle first."""
        return [observation.obstacles[i] for i, _ in self.cascade.moved]

    def lead_m(self, position: Array) -> float:
        """Return how far the robot at `position` (2,) drives until it touches [m]."""
        way = norm(self.approach_m - position)
        return way + norm(self.touch_m - self.approach_m)

    def lead_s(self, position: Array, task: Task) -> float:
        """Return how long that takes: full speed, then a period to touch in [s]."""
        return self.lead_m(position) / task.speed_mps + task.control_period_s


def push_plans(
    observation: Observation,
    task: Task,
    crossing: Crossing,
    force: Callable[[int], float],
    fixed: Callable[[int], bool],
    *,
    predict: bool = True,
    wide: bool = False,
) -> list[PushPlan]:
    """Return the pushes of the crossed obstacle that geometry and forces allow.

    Args:
        observation: The map.
        task: The robot.
        crossing: Which obstacle, and where the path goes through it.
        force: Breakaway force of an obstacle by index [N].
        fixed: Whether an obstacle is known not to give way.
        predict: Whether chain reactions are predicted (paper II.G).
        wide: Whether to try pushes to all sides.

    Returns:
        Feasible plans, the most direct first.
    """
    world = PushWorld(observation.obstacles) if predict else None
    way = crossing.exit_m - crossing.entry_m
    main = math.atan2(way[1], way[0])
    plans = []
    fan = WIDE_FAN if wide else FAN
    for heading in _headings(observation, crossing.index, main, fan):
        direction = np.array([math.cos(heading), math.sin(heading)])
        plan = _plan(observation, task, crossing, direction, world, force, fixed)
        if plan is not None:
            plans.append(plan)
    return plans


def _headings(
    observation: Observation, index: int, main: float, fan: tuple[float, ...]
) -> list[float]:
    """Return headings around `main`, and those square to the faces nearest to it."""
    vertices = observation.obstacles[index].footprint.vertices
    headings = [main + turn for turn in fan]
    if len(vertices) > 1:
        edges = np.roll(vertices, -1, axis=0) - vertices
        inward = angles_of(np.column_stack([-edges[:, 1], edges[:, 0]]))
        turns = (inward - main + math.pi) % (2.0 * math.pi) - math.pi
        headings += [float(main + t) for t in turns if abs(t) < math.radians(50.0)]
    return headings


def _plan(
    observation: Observation,
    task: Task,
    crossing: Crossing,
    direction: Array,
    world: PushWorld | None,
    force: Callable[[int], float],
    fixed: Callable[[int], bool],
) -> PushPlan | None:
    """Return the push through the centroid along `direction`, if possible."""
    index = crossing.index
    obstacle = observation.obstacles[index]
    touch = touching_point(obstacle.footprint.vertices, obstacle.footprint.radius,
                           obstacle.centroid_m, direction, task.radius_m)  # fmt: skip
    approach = touch - STANDOFF_M * direction
    if not _stands_free(observation, task, approach, touch, index):
        return None
    through = dot(crossing.exit_m - touch, direction)
    travel = min(max(through, 0.0) + FOLLOW_THROUGH_M, _LONGEST_M)
    if _lands_on_goal(obstacle.footprint, travel * direction, task):
        return None
    if world is None:
        cascade = Cascade(((index, travel),), force(index), None)
    else:
        cascade = world.cascade(
            index, travel * direction, force, task.force_max_n, fixed
        )
    if not cascade.feasible:
        return None
    return PushPlan(index, obstacle.id, direction, approach, touch, travel, cascade)


def _lands_on_goal(footprint: Footprint, travel: Array, task: Task) -> bool:
    """Whether a push would leave an obstacle where the robot must end."""
    landed = Footprints.stack([footprint.shifted(travel)])
    return bool(landed.distance(task.goal_m)[0] < task.radius_m + _GOAL_ROOM_M)


def touching_point(
    vertices: Array, radius: float, centroid: Array, direction: Array, disc_m: float
) -> Array:
    """Return where a disc's centre is when it touches a footprint from behind.

    Args:
        vertices: Core of the footprint, shape (k, 2) [m].
        radius: Its rounding radius [m].
        centroid: Point that the disc's centre moves towards, shape (2,) [m].
        direction: Unit vector of that motion, shape (2,).
        disc_m: Radius of the disc [m].
    """
    reach = float(norms(vertices - centroid).max()) + radius + disc_m
    near, far = 0.0, reach + 0.01
    for _ in range(30):
        middle = 0.5 * (near + far)
        x, y = centroid - middle * direction
        if signed_distance(x, y, vertices, radius) >= disc_m:
            far = middle
        else:
            near = middle
    return np.asarray(centroid - far * direction)


def _stands_free(
    observation: Observation, task: Task, approach: Array, touch: Array, index: int
) -> bool:
    """Whether the robot can stand at `approach` and drive to `touch`."""
    west, south, east, north = task.workspace_m
    r = task.radius_m
    x, y = approach
    if not (west + r <= x <= east - r and south + r <= y <= north - r):
        return False
    gaps = observation.footprints.segment_distance(approach, touch)
    gaps[index] = np.inf
    return bool(gaps.min() >= r + 0.003)


def segment_is_clear(
    footprints: Footprints, start: Array, end: Array, clearance_m: float
) -> bool:
    """Whether a straight drive keeps `clearance_m` [m] from every footprint."""
    if len(footprints) == 0:
        return True
    return bool(footprints.segment_distance(start, end).min() >= clearance_m)


def nearby(observation: Observation, index: int, reach_m: float) -> list[int]:
    """Return the obstacles near one of them, itself first, by bounding discs.

    Args:
        observation: The map.
        index: The obstacle in the middle.
        reach_m: Gap up to which others count as near [m].
    """
    vertices = observation.footprints.vertices
    centres = vertices.mean(axis=1)
    spread = norms(vertices - centres[:, None]).max(axis=1)
    reach = spread + observation.footprints.radius
    apart = norms(centres - centres[index])
    near = np.flatnonzero(apart <= reach + reach[index] + reach_m)
    return [index, *(int(i) for i in near if i != index)]
