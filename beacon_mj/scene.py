"""The scene: the whole truth about one world, as plain data.

A scene is generated once from a seed and stored as JSON. The SHA-256 of those bytes
is its identity in every result; that it was solved in the simulator, recorded in
`Certificate.simulated`, does not change it. Lengths in [m], angles in [rad],
densities in [kg/m^3], forces in [N]; coordinates in the arena frame, whose origin is
the south-west corner of the workspace.
"""

import hashlib
import math
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
import shapely
from msgspec import Meta

from beacon_mj import shapes
from beacon_mj.constants import GRAVITY, InteractionClass
from beacon_mj.errors import SceneError
from beacon_mj.geometry import Footprint, Footprints

#: Overlap that settling and rounding may cause without the scene being wrong [m].
OVERLAP_TOLERANCE_M = 1e-4

#: Names that the arena, the robot and the logs use: no obstacle may have one.
RESERVED_IDS = frozenset(
    ["robot", "wall", "floor", "sky", "sun", "overhead", "overview", "start", "goal"]
    + [f"wall_{side}" for side in ("west", "south", "east", "north")]
    + ["base", "base_x", "base_y", "bumper", "bumper_x", "bumper_y"]
    + ["drive", "drive_along", "drive_across"]
)

Profile = Literal["truth", "noisy", "misleading"]
PROFILES: tuple[Profile, ...] = ("truth", "noisy", "misleading")

Coordinate = Annotated[float, Meta(ge=-100.0, le=100.0)]
Positive = Annotated[float, Meta(gt=0.0, le=1e6)]
Probability = Annotated[float, Meta(ge=0.0, le=1.0)]


class _Record(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, dict=True
):
    """Base of the records a scene is made of."""


class Robot(_Record, frozen=True, kw_only=True):
    """A disc with a spring-mounted bumper ring and a force-limited velocity drive."""

    radius_m: Annotated[float, Meta(gt=0.02, le=1.0)] = 0.12
    height_m: Annotated[float, Meta(gt=0.02, le=1.0)] = 0.2
    mass_kg: Annotated[float, Meta(gt=1.0, le=1000.0)] = 10.0
    speed_mps: Annotated[float, Meta(gt=0.0, le=5.0)] = 0.5
    force_max_n: Annotated[float, Meta(gt=0.0, le=1e4)] = 60.0
    bumper_stiffness_npm: Annotated[float, Meta(ge=100.0, le=1e5)] = 5000.0
    control_period_s: Annotated[float, Meta(ge=0.01, le=1.0)] = 0.1


class Surface(_Record, frozen=True, kw_only=True):
    """How the geoms of one interaction class look, spin, and roll."""

    rgba: tuple[Probability, Probability, Probability, Probability]
    torsional_friction_m: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.005
    rolling_friction_m: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.004


class Perceived(_Record, frozen=True, kw_only=True):
    """What perception reports about one obstacle; never more than that.

    Attributes:
        scores: Unnormalised class scores s(c), in the order of `CLASSES`.
        density_kgm3: Perceived density.
        friction: Perceived friction coefficient against the floor.
    """

    scores: tuple[Probability, Probability, Probability]
    density_kgm3: Positive
    friction: Positive


class Obstacle(_Record, frozen=True, kw_only=True):
    """One obstacle: shape, pose of its footprint's centroid, class, and material.

    Attributes:
        fixed: Welded to the floor; only class `safe` may be.
        break_force_n: Contact force that breaks it; only class `fragile` has one.
    """

    id: Annotated[str, Meta(pattern=r"^[a-z][a-z0-9_]{0,30}$(?!\n)")]
    shape: shapes.Shape
    x_m: Coordinate
    y_m: Coordinate
    yaw_rad: Annotated[float, Meta(ge=-7.0, le=7.0)]
    interaction: InteractionClass
    fixed: bool
    density_kgm3: Annotated[float, Meta(ge=1.0, le=30000.0)]
    friction: Annotated[float, Meta(ge=0.01, le=5.0)]
    break_force_n: Positive | None
    perceived: Perceived

    @property
    def mass_kg(self) -> float:
        """Mass, density times volume [kg] (paper II.A)."""
        return self.density_kgm3 * self.shape.volume_m3

    @property
    def breakaway_force_n(self) -> float:
        """Coulomb force mu m g that starts it sliding [N]; infinite when fixed."""
        if self.fixed:
            return math.inf
        return self.friction * self.mass_kg * GRAVITY

    @cached_property
    def footprint(self) -> Footprint:
        """Outline on the floor, in the arena frame."""
        return shapes.footprint(self.shape).moved(self.x_m, self.y_m, self.yaw_rad)

    @cached_property
    def outline(self) -> shapely.Polygon:
        """The footprint as a polygon, arcs inscribed."""
        return self.footprint.polygon()

    def pushable(self, force_n: float) -> bool:
        """Whether a force-limited robot can move it, slowly, without damage."""
        limit = force_n if self.break_force_n is None else self.break_force_n
        return self.breakaway_force_n < min(limit, force_n)


class Certificate(_Record, frozen=True, kw_only=True):
    """What the generator proved about the scene, for the disc of the robot's radius.

    Attributes:
        collision_free_length_m: Shortest collision-free path, None if there is none.
        reference_length_m: Shortest path when every obstacle that can be pushed
            without damage is removed; no damage-free run can be shorter.
        straight_line_m: Distance from start to goal.
        door_ids: Movable obstacles whose removal opens the certified way through.
        margin_m: Extra clearance at which the collision-free path still exists.
        simulated: Outcome of the clairvoyant planner's run in MuJoCo, if certified.
    """

    collision_free_length_m: Positive | None
    reference_length_m: Positive
    straight_line_m: Positive
    door_ids: tuple[str, ...]
    margin_m: Annotated[float, Meta(ge=0.0, le=1.0)]
    simulated: str | None = None


class Scene(_Record, frozen=True, kw_only=True):
    """One world. See `to_json`, `load_scene`, and `check_scene`."""

    schema_version: Literal[1] = 1
    family: Annotated[str, Meta(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,60}$(?!\n)")]
    index: Annotated[int, Meta(ge=0, le=10**9)]
    seed: Annotated[int, Meta(ge=0, le=2**53)]
    perception: Profile
    workspace_m: tuple[Coordinate, Coordinate, Coordinate, Coordinate]
    start_m: tuple[Coordinate, Coordinate]
    goal_m: tuple[Coordinate, Coordinate]
    robot: Robot
    surfaces: tuple[Surface, Surface, Surface]
    obstacles: Annotated[tuple[Obstacle, ...], Meta(max_length=500)]
    certificate: Certificate

    @property
    def name(self) -> str:
        """`family_0007`, the stem of every file about this scene."""
        return f"{self.family}_{self.index:04d}"

    @cached_property
    def footprints(self) -> Footprints:
        """Footprints of all obstacles, in order."""
        return Footprints.stack([o.footprint for o in self.obstacles])

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the scene's JSON without `certificate.simulated`, its identity.

        That a scene was solved says nothing new about the world that it is.
        """
        proved = msgspec.structs.replace(self.certificate, simulated=None)
        plain = msgspec.structs.replace(self, certificate=proved)
        return hashlib.sha256(plain.to_json()).hexdigest()

    def to_json(self) -> bytes:
        """Return the canonical JSON; equal scenes give equal bytes."""
        return msgspec.json.format(msgspec.json.encode(self), indent=1) + b"\n"


def scene_schema() -> dict[str, Any]:
    """Return the published JSON Schema of a scene file."""
    return msgspec.json.schema(Scene)


def parse_scene(data: bytes, source: str = "scene") -> Scene:
    """Decode and check a scene.

    Args:
        data: JSON text.
        source: Name of the file or object, for messages.

    Raises:
        SceneError: If the JSON is broken, a field is missing, unknown or out of
            range, or the scene fails `check_scene`.
    """
    try:
        scene = msgspec.json.decode(data, type=Scene)
    except msgspec.ValidationError as error:
        raise SceneError(f"{source}: not a valid scene: {error}") from error
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise SceneError(f"{source}: not valid JSON: {error}") from error
    try:
        check_scene(scene)
    except SceneError as error:
        raise SceneError(f"{source}: {error}") from error
    return scene


def load_scene(path: str | Path) -> Scene:
    """Read a scene file. Raises SceneError on anything that is not a valid scene."""
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SceneError(
            f"{path}: cannot read the scene file: {error.strerror}"
        ) from error
    return parse_scene(data, str(path))


def check_scene(scene: Scene) -> None:
    """Check what a schema cannot say: bounds, unique ids, no overlap, classes.

    Raises:
        SceneError: Naming the obstacle or field, what was expected, and what it was.
    """
    west, south, east, north = scene.workspace_m
    if not (west < east and south < north):
        raise SceneError(
            "Expected workspace_m to be (west, south, east, north) with west < east "
            f"and south < north but it was {scene.workspace_m}."
        )
    _check_finite(msgspec.to_builtins(scene), "scene")
    _check_obstacles(scene)
    _check_clear_of_robot(scene)
    _check_no_overlap(scene)


def _check_finite(value: object, path: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise SceneError(f"Expected {path} to be finite but it was {value}.")
    if isinstance(value, Mapping):
        for key, item in value.items():
            _check_finite(item, f"{path}.{key}")
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            _check_finite(item, f"{path}[{i}]")


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
        if sum(o.perceived.scores) <= 0.0:
            raise SceneError(
                f"Obstacle {o.id!r}: expected perceived.scores to have a positive sum "
                f"but they were {o.perceived.scores}."
            )
        _check_shape(o)
    missing = set(scene.certificate.door_ids) - seen
    if missing:
        raise SceneError(
            f"Expected certificate.door_ids to name obstacles but {sorted(missing)} "
            "do not exist."
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
        volume = sum(shapes.hull_volume(np.array(part)) for part in shape.parts_m)
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
