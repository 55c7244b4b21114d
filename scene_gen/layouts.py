"""Layouts: functions that place obstacles; a family names one.

A layout takes a `Sampler`, start and goal, and returns placed obstacles. It only
proposes: what a family promises is proved afterwards, and a proposal that fails is
thrown away. A new layout is one function with `@layout("name")`, in the `layouts.py` of
a template folder; see `own_layouts`.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import msgspec
import numpy as np
import shapely

from beacon_mj.geometry import Array
from beacon_mj.scene import Obstacle, shapes
from beacon_mj.scene_gen.neighbours import Neighbours, inscribed_m
from beacon_mj.scene_gen.prototypes import DECIMALS
from beacon_mj.scene_gen.rooms import Bounds
from beacon_mj.scene_gen.rooms import Point as Point
from beacon_mj.scene_gen.sampling import Sampler

Layout = Callable[[Sampler, Point, Point], list[Obstacle]]
LAYOUTS: dict[str, Layout] = {}  #: Of all families; others belong to a folder.
_REGISTRY: ContextVar[dict[str, Layout]] = ContextVar("registry", default=LAYOUTS)

CLEARANCE_M = 0.3  #: Free ring around the robot's disc at start and goal.
LANDING_M = (0.9, 0.45)  #: Room kept free before and behind a door: length, half width.
_OTHER_DOORS_M = 1.6  #: How far off the straight line further doors may stand.
_TRIES = 200


class NoRoomError(Exception):
    """A proposal whose obstacles do not fit into the workspace."""


def layout(name: str) -> Callable[[Layout], Layout]:
    """Register a layout under the name that family files use."""

    def register(function: Layout) -> Layout:
        _REGISTRY.get()[name] = function
        return function

    return register


@contextmanager
def registering(registry: dict[str, Layout]) -> Iterator[None]:
    """Let `layout` register into `registry` instead of `LAYOUTS`."""
    token = _REGISTRY.set(registry)
    try:
        yield
    finally:
        _REGISTRY.reset(token)


@layout("scatter")
def scatter(sampler: Sampler, start: Point, goal: Point) -> list[Obstacle]:
    """Obstacles anywhere, no closer than the family's `spacing`."""
    placed: list[Obstacle] = []
    add_scattered(sampler, placed, end_discs(sampler, start, goal))
    return placed


@layout("barrier")
def barrier(sampler: Sampler, start: Point, goal: Point) -> list[Obstacle]:
    """A barrier from wall to wall with doors in it, and a few obstacles beside it."""
    return _barrier(sampler, start, goal, gate=0.0)


@layout("gated")
def gated(sampler: Sampler, start: Point, goal: Point) -> list[Obstacle]:
    """A barrier with doors near the straight line and a free gate at one wall."""
    gate = sampler.uniform(sampler.family.range("gate_width"))
    return _barrier(sampler, start, goal, gate=gate)


def add_scattered(
    sampler: Sampler,
    placed: list[Obstacle],
    forbidden: list[shapely.Geometry],
    count: int | None = None,
) -> None:
    """Add obstacles to `placed` by rejection sampling (III.B).

    Args:
        sampler: Draws them.
        placed: What they keep the family's `spacing` from.
        forbidden: Where none may stand.
        count: How many; the family's `obstacle_count` if None.

    Raises:
        NoRoomError: If one of them found no place.
    """
    spacing, workspace_m = sampler.family.value("spacing"), sampler.workspace_m
    others = Neighbours(o.outline for o in placed)
    if count is None:
        count = sampler.count("obstacle_count")
    for _ in range(count):
        shape, interaction = sampler.shape(), sampler.interaction()
        template = sampler.obstacle(shape, interaction)
        footprint = shapes.footprint(shape)
        inner_m = inscribed_m(footprint.polygon(), (0.0, 0.0))
        for _ in range(_TRIES):
            candidate = at(template, _anywhere(sampler), sampler.yaw())
            place = candidate.x_m, candidate.y_m
            if others.disc_within(place, inner_m, spacing):
                continue  # Most are refused here, before they have an outline.
            outline = footprint.moved(*place, candidate.yaw_rad).polygon()
            if _fits(outline, others, forbidden, spacing, workspace_m):
                placed.append(candidate)
                others.add(outline)
                break
        else:
            raise NoRoomError(len(placed))


def at(obstacle: Obstacle, position: Point | Array, yaw: float) -> Obstacle:
    """Return the obstacle at a pose."""
    return msgspec.structs.replace(
        obstacle,
        x_m=round(float(position[0]), DECIMALS),
        y_m=round(float(position[1]), DECIMALS),
        yaw_rad=yaw,
    )


def _anywhere(sampler: Sampler) -> Array:
    west, south, east, north = sampler.workspace_m
    return sampler.rng.uniform((west, south), (east, north))


def end_discs(sampler: Sampler, start: Point, goal: Point) -> list[shapely.Geometry]:
    """Return the discs that stay free around start and goal."""
    radius = sampler.robot.radius_m + CLEARANCE_M
    return [shapely.Point(start).buffer(radius), shapely.Point(goal).buffer(radius)]


def _fits(
    outline: shapely.Geometry,
    others: Neighbours,
    forbidden: list[shapely.Geometry],
    spacing: float,
    workspace_m: Bounds,
) -> bool:
    west, south, east, north = outline.bounds
    if west < workspace_m[0] or south < workspace_m[1]:
        return False
    if east > workspace_m[2] or north > workspace_m[3]:
        return False
    if shapely.intersects(outline, forbidden).any():
        return False
    return not others.within(outline, spacing)


def _barrier(
    sampler: Sampler, start: Point, goal: Point, gate: float
) -> list[Obstacle]:
    """Fill a north-south line with obstacles, some of them doors."""
    _, _, width, height = sampler.workspace_m
    x = sampler.uniform((0.5 * width - 0.4, 0.5 * width + 0.4))
    crossing = start[1] + (x - start[0]) / (goal[0] - start[0]) * (goal[1] - start[1])
    mirrored = gate > 0.0 and bool(sampler.rng.random() < 0.5)
    if mirrored:
        crossing = height - crossing
    slots = _slots(sampler, crossing, height - gate)
    placed: list[Obstacle] = []
    landing: list[shapely.Geometry] = []
    for low, high, is_door in slots:
        middle = 0.5 * (low + high)
        y = height - middle if mirrored else middle
        placed.append(_element(sampler, x, y, high - low, is_door))
        if is_door:
            length, half = LANDING_M
            landing.append(shapely.box(x - length, y - half, x + length, y + half))
    keep_gate = shapely.box(
        x - 0.6, 0.0 if mirrored else height - gate - 0.1, x + 0.6, height
    )
    if mirrored:
        keep_gate = shapely.box(x - 0.6, 0.0, x + 0.6, gate + 0.1)
    forbidden = [*end_discs(sampler, start, goal), *landing]
    if gate > 0.0:
        forbidden.append(keep_gate)
    add_scattered(sampler, placed, forbidden)
    return placed


def _slots(
    sampler: Sampler, crossing: float, top: float
) -> list[tuple[float, float, bool]]:
    """Divide [0, top] into (low, high, is_door) with small gaps between.

    Doors are wide enough to be ways through, and stand off the straight line, which
    meets the barrier at `crossing`, by the family's `door_offset`.
    """
    family = sampler.family
    doors = _door_spans(sampler, crossing, top)
    slots = [(low, high, True) for low, high in doors]
    edges = [0.0, *(v for span in doors for v in span), top]
    for low, high in zip(edges[::2], edges[1::2], strict=True):
        slots += _fill(sampler, low, high, family.range("barrier_gap"), top)
    return sorted(slots)


def _door_spans(
    sampler: Sampler, crossing: float, top: float
) -> list[tuple[float, float]]:
    family = sampler.family
    nearest, farthest = family.range("door_offset")
    spans: list[tuple[float, float]] = []
    for k in range(sampler.count("door_count")):
        for _ in range(_TRIES):
            half = 0.5 * sampler.uniform(family.range("door_width"))
            far = farthest if k == 0 else max(farthest, _OTHER_DOORS_M)
            offset = sampler.uniform((nearest, far))
            side = 1.0 if sampler.rng.random() < 0.5 else -1.0
            middle = crossing + side * offset
            low, high = middle - half, middle + half
            apart = all(low > b + 0.3 or high < a - 0.3 for a, b in spans)
            if apart and low > 0.35 and high < top - 0.35:
                spans.append((low, high))
                break
    return sorted(spans)


def _fill(
    sampler: Sampler, low: float, high: float, gap: tuple[float, float], top: float
) -> list[tuple[float, float, bool]]:
    """Divide [low, high] into obstacle-sized pieces with gaps at both ends."""
    sizes = sampler.family.range("size")
    pieces_count = max(1, round((high - low) / (0.5 * math.fsum(sizes))))
    widths = [sampler.uniform(sizes) for _ in range(pieces_count)]
    gaps = [sampler.uniform(gap) for _ in range(len(widths) + 1)]
    if low == 0.0:
        gaps[0] = min(gaps[0], 0.05)
    if high == top:
        gaps[-1] = min(gaps[-1], 0.05)
    scale = (high - low - math.fsum(gaps)) / math.fsum(widths)
    pieces, y = [], low + gaps[0]
    for width, after in zip(widths, gaps[1:], strict=True):
        pieces.append((y, y + width * scale, False))
        y += width * scale + after
    return pieces


def _element(
    sampler: Sampler, x: float, y: float, width: float, is_door: bool
) -> Obstacle:
    """Return one piece of the barrier, `width` [m] long across the way."""
    shape = sampler.shape(width, rollers=False)
    # The longer side of a template lies along its x axis: turn it across the way.
    yaw = round(0.5 * math.pi + sampler.uniform((-0.08, 0.08)), DECIMALS)
    if sampler.rng.random() < 0.5:
        yaw = round(yaw - math.pi, DECIMALS)
    if is_door:
        template = sampler.obstacle(shape, "movable", fixed=False, door=True)
        return _centred(template, x, y, yaw)
    template = sampler.obstacle(shape, sampler.interaction())
    return _centred(template, x + sampler.uniform((-0.04, 0.04)), y, yaw)


def _centred(obstacle: Obstacle, x: float, y: float, yaw: float) -> Obstacle:
    """Place the middle of the outline's bounding box, not its centroid, at (x, y)."""
    turned = at(obstacle, (0.0, 0.0), yaw)
    west, south, east, north = turned.outline.bounds
    middle = np.array([0.5 * (west + east), 0.5 * (south + north)])
    return at(obstacle, np.array([x, y]) - middle, yaw)
