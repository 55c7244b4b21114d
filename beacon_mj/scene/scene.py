"""The scene: the whole truth about one world, as plain data.

A scene is generated once from a seed and stored as JSON. The SHA-256 of those bytes
is its identity in every result; that it was solved in the simulator, recorded in
`Certificate.simulated`, does not change it. Lengths in [m], angles in [rad],
densities in [kg/m^3], forces in [N]; coordinates in the arena frame, whose origin is
the south-west corner of the workspace.
"""

import hashlib
import math
from functools import cached_property
from typing import Annotated, Literal

import msgspec
import shapely
from msgspec import UNSET, Meta, UnsetType

from beacon_mj.constants import GRAVITY, MAX_OBSTACLES, InteractionClass
from beacon_mj.geometry import Footprint, Footprints
from beacon_mj.scene import shapes
from beacon_mj.scene.learning import LearningCertificate, Sensing
from beacon_mj.scene.record import Coordinate, Positive, Probability, Record

Profile = Literal["truth", "noisy", "misleading"]
PROFILES: tuple[Profile, ...] = ("truth", "noisy", "misleading")

Kind = Annotated[str, Meta(pattern=r"^[a-z][a-z0-9_-]{0,30}$(?!\n)")]


class Robot(Record, frozen=True, kw_only=True):
    """A disc with a spring-mounted bumper ring and a force-limited velocity drive."""

    radius_m: Annotated[float, Meta(gt=0.02, le=1.0)] = 0.12
    height_m: Annotated[float, Meta(gt=0.02, le=1.0)] = 0.2
    mass_kg: Annotated[float, Meta(gt=1.0, le=1000.0)] = 10.0
    speed_mps: Annotated[float, Meta(ge=0.01, le=5.0)] = 0.5
    force_max_n: Annotated[float, Meta(ge=0.1, le=1e4)] = 60.0
    bumper_stiffness_npm: Annotated[float, Meta(ge=100.0, le=1e5)] = 5000.0
    control_period_s: Annotated[float, Meta(ge=0.01, le=1.0)] = 0.1


class Surface(Record, frozen=True, kw_only=True):
    """How the geoms of one interaction class look, spin, and roll."""

    rgba: tuple[Probability, Probability, Probability, Probability]
    torsional_friction_m: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.005
    rolling_friction_m: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.004


class Perceived(Record, frozen=True, kw_only=True, omit_defaults=True):
    """What perception reports about one obstacle; never more than that.

    Attributes:
        scores: Unnormalised class scores s(c), in the order of `CLASSES`.
        density_kgm3: Perceived density.
        friction: Perceived friction coefficient against the floor.
        kind: What it looks like, such as "crate"; None, and then not in the file, where
            looks tell nothing.
    """

    scores: tuple[Probability, Probability, Probability]
    density_kgm3: Positive
    friction: Positive
    kind: Kind | None = None


class Obstacle(Record, frozen=True, kw_only=True):
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


class Certificate(Record, frozen=True, kw_only=True):
    """What the generator proved about the scene, for the disc of the robot's radius.

    Attributes:
        collision_free_length_m: Shortest collision-free path, None if there is none.
        reference_length_m: Shortest path when every obstacle that can be pushed
            without damage is removed; no damage-free run can be shorter.
        straight_line_m: Distance from start to goal.
        door_ids: Movable obstacles whose removal opens the certified way through.
        margin_m: Extra clearance at which the collision-free path still exists.
        simulated: Outcome of the clairvoyant planner's run in MuJoCo, if certified.
        learning: What learning by touch is worth; not in the file of other families.
    """

    collision_free_length_m: Positive | None
    reference_length_m: Positive
    straight_line_m: Positive
    door_ids: tuple[str, ...]
    margin_m: Annotated[float, Meta(ge=0.0, le=1.0)]
    simulated: str | None = None
    learning: LearningCertificate | UnsetType = UNSET


class Scene(Record, frozen=True, kw_only=True):
    """One world. See `to_json`, `load_scene`, and `check_scene`.

    Fields that do not concern a scene are `msgspec.UNSET`, and not in its file.

    Attributes:
        robot_model: The shipped robot that its family chooses; unset for the disc.
        sensing: How its family is sensed, where that is the family's to say.
        mission: Number of the mission that it is a day of.
        day: Which day of the mission, from 0.
        days: How many days the mission has. The days of one mission share seed and
            room: obstacles with their ids, and what is perceived of them.
    """

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
    obstacles: Annotated[tuple[Obstacle, ...], Meta(max_length=MAX_OBSTACLES)]
    certificate: Certificate
    robot_model: Literal["diff-drive"] | UnsetType = UNSET
    sensing: Sensing | UnsetType = UNSET
    mission: Annotated[int, Meta(ge=0, le=10**9)] | UnsetType = UNSET
    day: Annotated[int, Meta(ge=0, le=10**6)] | UnsetType = UNSET
    days: Annotated[int, Meta(ge=1, le=10**6)] | UnsetType = UNSET

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
