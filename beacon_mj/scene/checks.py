"""Is it a valid scene? One answer, for scenes that are read and that Python made.

A scene must be what its file says it is, bit for bit, and the file must keep the
schema; then comes what a schema cannot say: bounds, ids, overlap, classes.
"""

import math
from collections.abc import Iterable, Mapping, Set
from typing import Literal

import msgspec
import numpy as np
import shapely
from msgspec import UNSET

from beacon_mj.errors import MalformedSceneError, SceneError
from beacon_mj.scene import Obstacle, Scene, door_problem, shapes

#: Overlap that settling and rounding may cause without the scene being wrong [m].
OVERLAP_TOLERANCE_M = 1e-4
MAX_BYTES = 16_000_000  #: Of a scene's file; a log has room for as much.
MAX_CORNERS = 50_000  #: Of all meshes of a scene together.
_SOUND = "_sound"  #: Attribute of a scene that was checked; a scene cannot change.

#: Names that the arena, the robot and the logs use: no obstacle may have one.
RESERVED_IDS = frozenset(
    [
        "world",
        "robot",
        "wall",
        "floor",
        "sky",
        "sun",
        "overhead",
        "overview",
        "start",
        "goal",
    ]
    + [f"wall_{side}" for side in ("west", "south", "east", "north")]
    + ["base", "base_x", "base_y", "bumper", "bumper_x", "bumper_y"]
    + ["drive", "drive_along", "drive_across"]
    + ["base_yaw", "footprint", "wheel_left", "wheel_right"]
    + ["drive_left", "drive_right"]
)


class Versioned(msgspec.Struct):
    """What the file of any scene must say."""

    schema_version: Literal[1]


def check_scene(scene: Scene) -> None:
    """Check a scene as a reader of its file would, and what no schema can say.

    Whatever runs, draws, stores or logs a scene calls this first.

    Raises:
        SceneError: Naming the obstacle or field, what was expected, and what it was; a
            `MalformedSceneError` where no file could hold the scene.
    """
    if _SOUND in scene.__dict__:
        return
    _check_schema(scene)
    _check_truth(scene)
    scene.__dict__[_SOUND] = True


def _check_schema(scene: Scene) -> None:
    """Check that the scene's file keeps the schema and reads back as the same bytes."""
    try:
        _check_finite(msgspec.to_builtins(scene), "scene")
        data = scene.to_json()
        if len(data) > MAX_BYTES:
            raise MalformedSceneError(
                f"Expected a scene of at most {MAX_BYTES} bytes but it has {len(data)}."
            )
        again = msgspec.json.decode(data, type=Scene)
    except (msgspec.MsgspecError, TypeError, ValueError, RecursionError) as error:
        raise MalformedSceneError(f"Not a valid scene: {error}.") from error
    if (found := _difference(scene, again)) or again.to_json() != data:
        raise MalformedSceneError(
            "Expected every number of a scene to be a float where its file has one, "
            f"and every record a record, but {found}."
        )


def _difference(scene: object, again: object, path: str = "scene") -> str:
    """Say where a scene and what its file gives first differ."""
    if isinstance(scene, msgspec.Struct):
        for name in scene.__struct_fields__:
            before, after = getattr(scene, name), getattr(again, name)
            if found := _difference(before, after, f"{path}.{name}"):
                return found
    elif isinstance(scene, list | tuple) and isinstance(again, list | tuple):
        for k, (before, after) in enumerate(zip(scene, again, strict=True)):
            if found := _difference(before, after, f"{path}[{k}]"):
                return found
    elif type(scene) is not type(again):
        return f"{path} was {scene!r}"
    return ""


def _check_truth(scene: Scene) -> None:
    """Check what a schema cannot say: bounds, unique ids, no overlap, classes."""
    west, south, east, north = scene.workspace_m
    if not (west < east and south < north):
        raise SceneError(
            "Expected workspace_m to be (west, south, east, north) with west < east "
            f"and south < north but it was {scene.workspace_m}."
        )
    _check_corners(scene)
    _check_obstacles(scene)
    _check_learning(scene)
    _check_clear_of_robot(scene)
    _check_no_overlap(scene)


def _check_finite(value: object, path: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise MalformedSceneError(f"Expected {path} to be finite but it was {value}.")
    if isinstance(value, Mapping):
        for key, item in value.items():
            _check_finite(item, f"{path}.{key}")
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            _check_finite(item, f"{path}[{i}]")


def _check_corners(scene: Scene) -> None:
    """Bound the corners of all meshes, before any hull is made of them."""
    corners = 0
    for o in scene.obstacles:
        if isinstance(o.shape, shapes.Hulls):
            for part in o.shape.parts_m:
                corners += len(part)
    if corners > MAX_CORNERS:
        raise SceneError(
            f"Expected at most {MAX_CORNERS} corners of meshes in a scene but it has "
            f"{corners}."
        )


def _check_obstacles(scene: Scene) -> None:
    seen: set[str] = set()
    for o in scene.obstacles:
        if o.id in seen:
            raise SceneError(
                f"Expected obstacle ids to be unique but {o.id!r} repeats."
            )
        seen.add(o.id)
        if o.id in RESERVED_IDS or "_part_" in o.id or "_foot_" in o.id:
            raise SceneError(
                f"Expected an obstacle id other than {o.id!r}: names of the arena and "
                "the robot, and names with '_part_' or '_foot_', are reserved."
            )
        if o.fixed and o.interaction != "safe":
            raise SceneError(
                f"Obstacle {o.id!r}: expected a fixed obstacle to be of class 'safe' "
                f"but it was {o.interaction!r}."
            )
        if (o.break_force_n is not None) != (o.interaction == "fragile"):
            raise SceneError(
                f"Obstacle {o.id!r}: expected break_force_n for class 'fragile' and "
                f"for no other but it was {o.break_force_n} for {o.interaction!r}."
            )
        if math.fsum(o.perceived.scores) <= 0.0:
            raise SceneError(
                f"Obstacle {o.id!r}: expected perceived.scores to have a positive sum "
                f"but they were {o.perceived.scores}."
            )
        _check_shape(o)
    _check_exist("certificate.door_ids", scene.certificate.door_ids, seen)


def _check_exist(field: str, doors: Iterable[str], obstacles: Set[str]) -> None:
    if missing := set(doors) - obstacles:
        raise SceneError(
            f"Expected {field} to name obstacles but {sorted(missing)} do not exist."
        )


def _check_learning(scene: Scene) -> None:
    """Check that the certificate of learning is about a problem that can be solved."""
    learning = scene.certificate.learning
    if learning is UNSET:
        return
    for part in learning.parts:
        field = "certificate.learning.parts.doors"
        _check_exist(field, part.doors, {o.id for o in scene.obstacles})
    door_problem(learning.parts, learning.fail_s, learning.pass_s)
    stages = len([stage for part in learning.parts for stage in part.stages])
    if scene.days is not UNSET and (not stages or stages % scene.days):
        raise SceneError(
            f"Expected as many stages on each of {scene.days} days but "
            f"certificate.learning has {stages} in all."
        )


def _check_shape(o: Obstacle) -> None:
    shape = o.shape
    if isinstance(shape, shapes.Capsule) and shape.half_axis_m <= 0.0:
        raise SceneError(
            f"Obstacle {o.id!r}: expected a capsule's length_m to exceed twice its "
            f"radius_m but they were {shape.length_m} and {shape.radius_m}."
        )
    if isinstance(shape, shapes.Prism) and not shapes.is_convex_ccw(
        np.array(shape.vertices_m)
    ):
        raise SceneError(
            f"Obstacle {o.id!r}: expected a prism's vertices_m to be strictly convex "
            "and counter-clockwise but they were not."
        )
    if isinstance(shape, shapes.Hulls):
        _check_hulls(o.id, shape)
    if np.abs(shapes.footprint(shape).centroid).max() > OVERLAP_TOLERANCE_M:
        raise SceneError(
            f"Obstacle {o.id!r}: expected its footprint's centroid at the origin of "
            "its shape but it was not."
        )


def _check_hulls(name: str, shape: shapes.Hulls) -> None:
    try:
        volume = math.fsum(shapes.hull_volume(np.array(part)) for part in shape.parts_m)
    except ValueError as error:
        raise SceneError(
            f"Obstacle {name!r}: expected every part of parts_m to be a solid but one "
            "was flat."
        ) from error
    if not math.isclose(volume, shape.volume_m3, rel_tol=1e-6):
        raise SceneError(
            f"Obstacle {name!r}: expected volume_m3 to be that of its parts, "
            f"{volume:.9f}, but it was {shape.volume_m3}."
        )
    heights = shape.core()[0][:, 2]
    if abs(heights.min() + heights.max()) > OVERLAP_TOLERANCE_M:
        raise SceneError(
            f"Obstacle {name!r}: expected parts_m to reach as far below the origin as "
            "above it but they did not."
        )


def _check_clear_of_robot(scene: Scene) -> None:
    west, south, east, north = scene.workspace_m
    radius = scene.robot.radius_m
    for label, point in (("start_m", scene.start_m), ("goal_m", scene.goal_m)):
        x, y = point
        if not (
            west + radius <= x <= east - radius
            and south + radius <= y <= north - radius
        ):
            raise SceneError(
                f"Expected {label} to leave the robot inside the workspace "
                f"{scene.workspace_m} but it was {point}."
            )
        gaps = scene.footprints.distance(np.array(point)) - radius
        if len(gaps) and gaps.min() < -OVERLAP_TOLERANCE_M:
            other = scene.obstacles[int(gaps.argmin())].id
            raise SceneError(
                f"Expected {label} to be free but the robot would overlap {other!r} "
                f"by {-gaps.min():.4f} m."
            )


def _check_no_overlap(scene: Scene) -> None:
    polygons = np.array([o.outline for o in scene.obstacles])
    if not len(polygons):
        return
    inside = shapely.box(*scene.workspace_m).buffer(OVERLAP_TOLERANCE_M)
    for o, within in zip(
        scene.obstacles, shapely.covers(inside, polygons), strict=True
    ):
        if not within:
            raise SceneError(
                f"Expected obstacle {o.id!r} to lie inside the workspace "
                f"{scene.workspace_m} but it does not."
            )
    tree = shapely.STRtree(polygons)
    shrunk = shapely.buffer(polygons, -OVERLAP_TOLERANCE_M)
    for i, j in tree.query(shrunk, predicate="intersects").T:
        if i != j:
            raise SceneError(
                f"Expected obstacles not to overlap but {scene.obstacles[i].id!r} and "
                f"{scene.obstacles[j].id!r} do."
            )
