"""The protocol: everything about an episode that is not the scene or the planner."""

import functools
import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeVar, get_args, get_type_hints

import msgspec
from msgspec import UNSET, Meta, UnsetType

from beacon_mj.constants import GRAVITY
from beacon_mj.errors import RunError, unknown
from beacon_mj.interface import SensorSheet
from beacon_mj.pushing import PushModel
from beacon_mj.scene import Robot, Scene, Sensing
from beacon_mj.scene_gen.perception import force_errors
from beacon_mj.scene_gen.robot_contract import fitted
from beacon_mj.scene_gen.robots import RobotFile, robot_in

WorldKind = Literal["mujoco", "planar"]
#: Sensing radius beyond every workspace [m].
EVERYTHING_M = 100.0
LIDAR_RANGE_M = 3.5  #: Range of a lidar unless set: LDS-01 of a TurtleBot3 [m].
#: Key of the value at which a field hides nothing. Every field that makes the sensor
#: less than perfect carries one; `Protocol.certain` needs no other list of them.
_CERTAIN = "certain"
#: Diagonal up to which an episode has `STEPS`, that of a room of 6 x 6 m [m].
DIAGONAL_M = math.sqrt(72.0)
STEPS = 1000  #: Control steps of an episode in a room of up to that diagonal.


#: What each preset changes of the defaults; docs/protocol.md says why these values.
PRESETS: Mapping[str, Mapping[str, float | bool]] = {
    "paper": {},
    "realistic": {
        "occlusion": True,
        "missed_detection": 0.05,
        "pose_noise_m": 0.01,
        "robot_pose_noise_m": 0.02,
        "force_noise": 0.1,
    },
}


class Protocol(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How an episode is run and scored; identical for all planners.

    Attributes:
        sensing_radius_m: Range r_s of the obstacle sensor from the robot's body; None
            for the family's, or 1 m where it has none.
        max_steps: Control steps after which the outcome is `timeout`; None for 1000 in
            rooms of up to 6 x 6 m, and in larger ones for as many more as the room's
            diagonal is longer.
        goal_tolerance_m: Distance to the goal that counts as reached.
        motion_cost_jpm: kappa_d of App. B, energy per metre [J/m], at least 0.001:
            energies are divided by it. None for a cost of transport of 0.2, which is
            0.2 m g.
        battery_ends_episode: Whether an empty battery ends the episode.
        stuck_after_s: Time within which the robot must leave a disc of
            `stuck_radius_m`, or the outcome is `stuck`.
        stuck_radius_m: See `stuck_after_s`.
        decision_limit_s: Wall-clock time of one decision above which the outcome is
            `planner_error`.
        memory_limit_mib: Address space that a planner in a process of its own may take
            beyond what the interpreter and this package use [MiB].
        timestep_s: Physics step; halve it to see whether results depend on it.
        occlusion: Whether an obstacle is sensed only in line of sight; None for the
            family's, or no.
        pose_noise_m: Standard deviation of sensed positions; None for the family's, or
            0.
        missed_detection: Probability that an obstacle in range is missed in a step;
            None for the family's, or 0.
        robot_pose_noise_m: Standard deviation of the robot's own position, along each
            axis; None for the family's, or 0.
        force_noise: Standard deviation of a felt force over that force; None for the
            family's, or 0.
        overnight: How each further day of a mission finds the room: `restored`, as the
            scene has it, or `as_left` by the planner on the day before.
        lidar_beams: Beams of the robot's lidar, evenly all round; none if 0 or unset.
        lidar_range_m: Its range from the robot's centre; 3.5 m if unset, that of the
            LDS-01 of a TurtleBot3.
        lidar_noise_m: Standard deviation of a measured range; 0 if unset.
        lidar_dropout: Probability that a beam brings nothing back; 0 if unset.
        obstacles: Whether obstacles are `perceived`, as if unset, or `none`: a planner
            then knows what the lidar measures and the bumper feels, and nothing else.
        robot: The robot, a name of `beacon-mj robots` or a file of your own; if unset,
            the family's, or the disc. Its whole file is recorded.
        world: The world: `mujoco`, as if unset, or `planar`, the paper's.
        planar_push: How the planar world pushes: as the `paper` prints it, as if unset,
            or by `limit-surface`, quasi-static pushing with rotation.
    """

    sensing_radius_m: (
        Annotated[float, Meta(ge=0.0, le=EVERYTHING_M, extra={_CERTAIN: EVERYTHING_M})]
        | None
    ) = None
    max_steps: Annotated[int, Meta(ge=1, le=10**6)] | None = None
    goal_tolerance_m: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.10
    motion_cost_jpm: Annotated[float, Meta(ge=1e-3, le=1e6)] | None = None
    battery_ends_episode: bool = False
    stuck_after_s: Annotated[float, Meta(gt=0.0, le=1e4)] = 20.0
    stuck_radius_m: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.05
    decision_limit_s: Annotated[float, Meta(gt=0.0, le=1e4)] = 30.0
    memory_limit_mib: Annotated[int, Meta(ge=64, le=2**22)] = 4096
    timestep_s: Annotated[float, Meta(ge=1e-4, le=0.01)] = 0.002
    occlusion: Annotated[bool, Meta(extra={_CERTAIN: False})] | None = None
    pose_noise_m: (
        Annotated[float, Meta(ge=0.0, le=0.5, extra={_CERTAIN: 0.0})] | None
    ) = None
    missed_detection: (
        Annotated[float, Meta(ge=0.0, lt=1.0, extra={_CERTAIN: 0.0})] | None
    ) = None
    robot_pose_noise_m: (
        Annotated[float, Meta(ge=0.0, le=0.5, extra={_CERTAIN: 0.0})] | None
    ) = None
    force_noise: (
        Annotated[float, Meta(ge=0.0, le=1.0, extra={_CERTAIN: 0.0})] | None
    ) = None
    overnight: Literal["restored", "as_left"] = "restored"
    # Fields that were added later are left out of logs and runs in which they are not
    # set, so that those keep their bytes.
    lidar_beams: (
        Annotated[int, Meta(ge=0, le=4096, extra={_CERTAIN: UNSET})] | UnsetType
    ) = UNSET
    lidar_range_m: (
        Annotated[float, Meta(ge=0.2, le=EVERYTHING_M, extra={_CERTAIN: UNSET})]
        | UnsetType
    ) = UNSET
    lidar_noise_m: (
        Annotated[float, Meta(ge=0.0, le=0.5, extra={_CERTAIN: UNSET})] | UnsetType
    ) = UNSET
    lidar_dropout: (
        Annotated[float, Meta(ge=0.0, lt=1.0, extra={_CERTAIN: UNSET})] | UnsetType
    ) = UNSET
    obstacles: (
        Annotated[Literal["perceived", "none"], Meta(extra={_CERTAIN: UNSET})]
        | UnsetType
    ) = UNSET
    robot: RobotFile | UnsetType = UNSET
    world: WorldKind | UnsetType = UNSET
    planar_push: PushModel | UnsetType = UNSET

    @classmethod
    def preset(cls, name: str) -> "Protocol":
        """Return a protocol of `PRESETS`.

        Args:
            name: `paper`, which is the default one, or `realistic`.

        Raises:
            RunError: If there is no preset of that name.
        """
        if name not in PRESETS:
            raise RunError(unknown("protocol", name, PRESETS))
        return cls(**PRESETS[name])  # type: ignore[arg-type]

    def certain(self) -> "Protocol":
        """Return this protocol with a sensor that senses everything, and exactly."""
        return msgspec.structs.replace(self, **_perfect())

    def __post_init__(self) -> None:
        """Check the ranges of a protocol made in Python as of one that was read.

        Raises:
            RunError: If a field has the wrong type or is out of range.
        """
        for field in msgspec.structs.fields(self):
            value = getattr(self, field.name)
            if value is UNSET:
                continue
            plain = float(value) if isinstance(value, float) else value
            try:
                msgspec.convert(plain, field.type)
            except msgspec.ValidationError as problem:
                wanted = str(problem).removeprefix("Expected ").partition(", got")[0]
                raise RunError(
                    f"Expected protocol.{field.name} to be {wanted.replace('`', '')} "
                    f"but it was {value!r}."
                ) from problem

    def robot_of(self, scene: Scene) -> Robot:
        """Return the numbers of the robot that crosses a scene.

        Raises:
            TemplateError: If its file does not keep the contract.
        """
        return fitted(robot_in(scene, self.robot), scene.robot)

    @property
    def is_planar(self) -> bool:
        """Whether episodes run in the planar world."""
        return self.world == "planar"

    @property
    def push_model(self) -> PushModel:
        """How the planar world pushes."""
        return "paper" if isinstance(self.planar_push, UnsetType) else self.planar_push

    def motion_cost(self, scene: Scene) -> float:
        """Return kappa_d for the robot [J/m]."""
        if self.motion_cost_jpm is not None:
            return self.motion_cost_jpm
        return 0.2 * self.robot_of(scene).mass_kg * GRAVITY

    def step_limit(self, scene: Scene) -> int:
        """Return the control steps after which the outcome is `timeout`."""
        if self.max_steps is not None:
            return self.max_steps
        return math.ceil(STEPS * max(1.0, diagonal_m(scene) / DIAGONAL_M))

    def sensor(self, scene: Scene) -> SensorSheet:
        """Return the sensors: what is set here, else the family's, else the default.

        How wrong perceived forces are is the family's and the profile's to say.
        """
        own = scene.sensing or Sensing()
        forces = force_errors(scene)
        return SensorSheet(
            range_m=_first(self.sensing_radius_m, own.radius_m, 1.0),
            occlusion=_first(self.occlusion, own.occlusion, False),
            pose_noise_m=_first(self.pose_noise_m, own.pose_noise_m, 0.0),
            missed_detection=_first(self.missed_detection, own.missed_detection, 0.0),
            force_error=forces.force_error,
            force_scale_error=forces.force_scale_error,
            robot_pose_noise_m=_first(
                self.robot_pose_noise_m, own.robot_pose_noise_m, 0.0
            ),
            force_noise=_first(self.force_noise, own.force_noise, 0.0),
            lidar_beams=_first(self.lidar_beams, None, 0),
            lidar_range_m=_first(self.lidar_range_m, None, LIDAR_RANGE_M),
            lidar_noise_m=_first(self.lidar_noise_m, None, 0.0),
            lidar_dropout=_first(self.lidar_dropout, None, 0.0),
            obstacles=_first(self.obstacles, None, "perceived"),
        )


T = TypeVar("T")


def _first(user: T | UnsetType | None, family: T | None, default: T) -> T:
    if user is not None and not isinstance(user, UnsetType):
        return user
    return default if family is None else family


def diagonal_m(scene: Scene) -> float:
    """Return diam(workspace), its diagonal [m]."""
    west, south, east, north = scene.workspace_m
    x, y = east - west, north - south
    return math.sqrt(x * x + y * y)


@functools.cache
def _perfect() -> dict[str, float | bool | UnsetType]:
    """Return the fields that limit the sensor, at the values at which none does."""
    hints = get_type_hints(Protocol, include_extras=True)
    extras = {name: _extra(hint) for name, hint in hints.items()}
    return {name: e[_CERTAIN] for name, e in extras.items() if _CERTAIN in e}


def _extra(hint: Any) -> dict[str, Any]:
    """Return what the annotations within a type say beside its limits."""
    own = [m.extra or {} for m in getattr(hint, "__metadata__", ())]
    parts = [_extra(part) for part in get_args(hint)]
    return {key: value for e in (*parts, *own) for key, value in e.items()}


def battery_slope(scene: Scene) -> float:
    """Return eta = B_0 / diam(workspace), charge per metre [1/m] (paper II.A)."""
    return 1.0 / diagonal_m(scene)
