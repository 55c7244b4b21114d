"""Layouts with doors that hide a latent.

Between the stages of a room stands a lock, a wall with one free opening: where the
robot comes out says nothing about the door that it came through, so only memory can.
"""

import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from beacon_mj.constants import WALL_KIND
from beacon_mj.errors import TemplateError, unknown
from beacon_mj.scene import Obstacle
from beacon_mj.scene_gen.family import Family
from beacon_mj.scene_gen.learning.latents import kind_latent, load_latent
from beacon_mj.scene_gen.learning.room import (
    SEAM_M,
    Door,
    Latent,
    Part,
    Room,
    Stage,
    wall,
    wall_with_openings,
)
from beacon_mj.scene_gen.rooms import Point, as_point, workspace_m

_WORD = re.compile(r"[a-z][a-z0-9_-]{0,30}")
LearningLayout = Callable[[Family, np.random.Generator], Room]

FIRST_M = 1.5  #: First barrier from the west wall.
LAST_M = 2.2  #: Last barrier from the east wall, at least.
END_M = 0.45  #: Start and goal from their walls.
CORNER_M = 0.25  #: Least distance of a door's edge from the room's walls.
JITTER_M = 0.4  #: Offset of the middle door from the middle of the room, at most.
#: Offset of a lock's opening, at most: from the middle of the room, or the middle door.
LOCK_M, LOCK_BEHIND_M = 0.7, 0.4
BEHIND_LOCK_M = 0.8  #: From a lock to the next row of doors, at least.
PIECE_M = 0.05  #: Least piece of wall between two doors.
START_M = 1.0  #: Offset of start and goal from the middle of the room, at most.


class Row(NamedTuple):
    """Doors side by side, and where the lock behind them opens, give or take [m]."""

    doors: tuple[Door, ...]
    lock_m: float
    offset_m: float


def look_alikes(family: Family, rng: np.random.Generator) -> Room:
    """Barriers in a row, in each one door of every kind; kinds move or do not."""
    kinds = _kinds(family)
    height = workspace_m(family)[3]
    low, high = family.range("door_spacing")
    _check_apart(family, "door_spacing", low)
    reach = 0.5 * (len(kinds) - 1) * high + 0.5 * family.range("door_width")[1]
    jitter = min(JITTER_M, 0.5 * height - reach - CORNER_M)
    if jitter < 0.0:
        raise TemplateError(
            f"{family.source}: expected a workspace of at least "
            f"{2.0 * (reach + CORNER_M):.2f} m from south to north for {len(kinds)} "
            f"doors side by side but it was {height:g} m."
        )

    def row(b: int, x: float) -> Row:
        middle = 0.5 * height + rng.uniform(-jitter, jitter)
        step = rng.uniform(low, high)
        places = middle + step * (np.arange(len(kinds)) - 0.5 * (len(kinds) - 1))
        doors = [
            _door(family, rng, f"door_{b}_{k}", (x, y), k, kind=kinds[k])
            for k, y in zip(rng.permutation(len(kinds)), places, strict=True)
        ]
        return Row(tuple(doors), 0.5 * height, LOCK_M)

    return _locked(family, rng, row, kind_latent(family, len(kinds)))


def unweighed(family: Family, rng: np.random.Generator) -> Room:
    """Barriers in a row, in each two doors that look heavy and a light one far off."""
    height = workspace_m(family)[3]
    near, far = family.value("near_door_offset"), family.value("far_door_offset")
    _check_apart(family, "near_door_offset", near)
    _check_apart(family, "far_door_offset", far)
    edge = 0.5 * family.range("door_width")[1] + CORNER_M + 0.1
    shift = max(0.0, far + edge - 0.5 * height)
    if near + shift + edge > 0.5 * height:
        raise TemplateError(
            f"{family.source}: expected a workspace of at least "
            f"{near + far + 2.0 * edge:.2f} m from south to north but it was "
            f"{height:g} m."
        )
    forces = ("near_door_force", "door_force", "far_door_force")

    def row(b: int, x: float) -> Row:
        side = 1.0 if rng.random() < 0.5 else -1.0
        middle = 0.5 * height - side * shift + rng.uniform(-0.05, 0.05)
        places = (middle - side * near, middle, middle + side * far)
        doors = [
            _door(family, rng, f"door_{b}_{k}", (x, y), k, force=force)
            for k, (y, force) in enumerate(zip(places, forces, strict=True))
        ]
        doors.sort(key=lambda d: d.y_m)
        return Row(tuple(doors), middle, LOCK_BEHIND_M)

    return _locked(family, rng, row, load_latent(family))


def bays(family: Family, rng: np.random.Generator) -> Room:
    """Dead ends side by side, a door at the end of each; every door its own latent."""
    count, days = family.whole("bay_count"), family.whole("day_count")
    depth, width = family.value("bay_depth"), family.value("bay_width")
    _, _, length, height = workspace_m(family)
    x0 = 0.5 * (length - depth) - 0.5
    x1, pitch = x0 + depth, height / count
    if x0 < 1.0 or pitch - width < 0.1:
        raise TemplateError(
            f"{family.source}: expected a workspace of at least {depth + 3.0:.2f} x "
            f"{count * (width + 0.1):.2f} m for {count} bays but it was {length:g} x "
            f"{height:g} m."
        )
    middles = [pitch * (k + 0.5) for k in range(count)]
    doors = tuple(
        Door(
            id=f"door_{k}",
            x_m=x1 - 0.2,
            y_m=y,
            width_m=width - 2.0 * SEAM_M,
            label=k,
            kind=None,
            nominal_n=rng.uniform(*family.range("door_force")),
        )
        for k, y in enumerate(middles)
    )
    edges = [0.0, *(e for y in middles for e in (y - width / 2, y + width / 2)), height]
    walls = tuple(
        wall(f"wall_{k}", x0, low, x1, high)
        for k, (low, high) in enumerate(zip(edges[::2], edges[1::2], strict=True))
    )
    ways = tuple(_way(rng, length, height, 0.3 * height) for _ in range(days))
    latent = kind_latent(family, count, reliability=1.0)
    stages = [Stage(entry_m=a, exit_m=b, doors=doors) for a, b in ways]
    return Room(ways=ways, walls=walls, parts=_parts(family, latent, stages, "day"))


#: By the name that a family file gives as its `layout`.
LEARNING_LAYOUTS: dict[str, LearningLayout] = {
    "look-alikes": look_alikes,
    "unweighed": unweighed,
    "bays": bays,
}


def _locked(
    family: Family,
    rng: np.random.Generator,
    row: Callable[[int, float], Row],
    latent: Latent,
) -> Room:
    """Put rows of doors and locks into the room, from west to east."""
    _, _, length, height = workspace_m(family)
    count, pitch = family.whole("barrier_count"), family.value("barrier_pitch")
    needed = FIRST_M + pitch * (count - 1) + LAST_M
    if length < needed - 1e-9:
        raise TemplateError(
            f"{family.source}: expected a workspace of at least {needed:.2f} m from "
            f"west to east for {count} barriers but it was {length:g} m."
        )
    behind = family.value("lock_distance")
    if count > 1 and behind + BEHIND_LOCK_M > pitch:
        raise TemplateError(
            f"{family.source}: expected numeric 'lock_distance' to be at most "
            f"{pitch - BEHIND_LOCK_M:g} m, so that the next row is clear of the lock, "
            f"but it was {behind:g}."
        )
    start, goal = _way(rng, length, height, START_M)
    rows, walls = [], list[Obstacle]()
    entries = [start]
    for b in range(count):
        x = FIRST_M + pitch * b
        rows.append(row(b, x))
        spans = [
            (d.y_m - 0.5 * d.width_m - SEAM_M, d.y_m + 0.5 * d.width_m + SEAM_M)
            for d in rows[-1].doors
        ]
        walls += wall_with_openings(f"barrier_{b}", x, height, spans)
        if b < count - 1:
            entries.append(_lock(family, rng, b, x, rows[-1], walls))
    exits = [*entries[1:], goal]
    stages = [
        Stage(entry_m=entry, exit_m=way_out, doors=each.doors)
        for entry, way_out, each in zip(entries, exits, rows, strict=True)
    ]
    parts = _parts(family, latent, stages, "stage")
    return Room(ways=((start, goal),), walls=tuple(walls), parts=parts)


def _lock(
    family: Family,
    rng: np.random.Generator,
    b: int,
    x: float,
    row: Row,
    walls: list[Obstacle],
) -> Point:
    """Add the wall behind a row; return the middle of its opening."""
    height, half = workspace_m(family)[3], 0.5 * family.value("lock_opening")
    low = max(row.lock_m - row.offset_m, half + CORNER_M)
    high = min(row.lock_m + row.offset_m, height - half - CORNER_M)
    y = rng.uniform(low, high)
    x += family.value("lock_distance")
    walls += wall_with_openings(f"lock_{b}", x, height, [(y - half, y + half)])
    return as_point(np.array([x, y]))


def _way(
    rng: np.random.Generator, length: float, height: float, offset: float
) -> tuple[Point, Point]:
    """Draw start and goal of one crossing."""
    offset = min(offset, 0.5 * height - END_M)
    low, high = 0.5 * height - offset, 0.5 * height + offset
    start, goal = rng.uniform(low, high, 2)
    return (
        as_point(np.array([END_M, start])),
        as_point(np.array([length - END_M, goal])),
    )


def _door(
    family: Family,
    rng: np.random.Generator,
    name: str,
    place: Point,
    label: int,
    *,
    force: str = "door_force",
    kind: str | None = None,
) -> Door:
    return Door(
        id=name,
        x_m=float(place[0]),
        y_m=float(place[1]),
        width_m=rng.uniform(*family.range("door_width")),
        label=int(label),
        kind=kind,
        nominal_n=rng.uniform(*family.range(force)),
    )


def _parts(
    family: Family, latent: Latent, stages: list[Stage], unit: str
) -> tuple[Part, ...]:
    """Return the stages as one part, or each as its own where the latent is redrawn."""
    redrawn = family.texts.get("redrawn", "never")
    if redrawn not in ("never", unit):
        raise TemplateError(
            f"{family.source}: {unknown('redrawn', redrawn, ('never', unit))}"
        )
    if redrawn == "never":
        return (Part(key="all", latent=latent, stages=tuple(stages)),)
    return tuple(
        Part(key=f"{unit}_{k}", latent=latent, stages=(stage,))
        for k, stage in enumerate(stages)
    )


def _check_apart(family: Family, name: str, spacing_m: float) -> None:
    """Raise if doors at a distance of that name would leave no wall between them."""
    needed = family.range("door_width")[1] + 2.0 * SEAM_M + PIECE_M
    if spacing_m < needed:
        raise TemplateError(
            f"{family.source}: expected numeric {name!r} to be at least {needed:g} m "
            f"for doors of that width but it was {spacing_m:g}."
        )


def _kinds(family: Family) -> list[str]:
    """Return the names of the kinds; a row has one door of each."""
    kinds = family.text("kinds").split()
    distinct = len({*kinds, WALL_KIND}) == len(kinds) + 1
    if not (2 <= len(kinds) <= 5 and distinct and all(map(_WORD.fullmatch, kinds))):
        raise TemplateError(
            f"{family.source}: expected text 'kinds' to be two to five different words "
            f"of small letters other than 'wall' but it was {family.text('kinds')!r}."
        )
    return kinds
