"""The list of robots, and whether a robot of one's own keeps the contract."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from beacon_mj.errors import TemplateError
from beacon_mj.rendering.tables import Listing, Prose, Tabular, add_line, plain_table
from beacon_mj.scene import Robot
from beacon_mj.scene_gen.robot_contract import (
    differential_drive,
    fitted,
    robot_faults,
)
from beacon_mj.scene_gen.robots import RobotFile, read_robot, robot_paths


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotInfo:
    """A robot.

    Attributes:
        name: Its name, the stem of its file.
        drive: `holonomic` or `differential`.
        mass_kg: Mass [kg].
        force_max_n: Largest force of its drive, where a family sets no other [N].
        radius_m: Radius of its footprint [m].
        grip: Force that its tyres hold over that of its motors; None without tyres.
        sha256: SHA-256 of its file.
        path: The file; copy it to make a robot of your own.
    """

    name: str
    drive: str
    mass_kg: float
    force_max_n: float
    radius_m: float
    grip: float | None
    sha256: str
    path: Path


class Robots(Listing[RobotInfo]):
    """Robots, as a sequence and as a table."""

    def tables(self) -> Sequence[Table | str]:
        """Return a line a robot, then where the files are."""
        table = plain_table()
        table.add_column("robot", no_wrap=True)
        table.add_column("drive")
        for name in ("mass [kg]", "force [N]", "radius [m]", "grip"):
            table.add_column(name, justify="right")
        for each in self:
            add_line(table, *_cells(each))
        note = "grip: force that the tyres hold over that of the motors."
        folders = dict.fromkeys(f"{each.path.parent}/" for each in self)
        return [table, "", Prose(f"{note} Files (--robot NAME or FILE.xml):"), *folders]


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotCheck(Tabular):
    """Whether a robot keeps the contract.

    Attributes:
        faults: A line for each way in which it does not.
        robot: The robot; None if it has a fault.
    """

    faults: tuple[str, ...]
    robot: RobotInfo | None

    def tables(self) -> Sequence[Table | str]:
        """Return the robot as a table, or the faults."""
        if self.robot is None:
            return [Prose(fault) for fault in self.faults]
        return Robots([self.robot]).tables()


def _cells(robot: RobotInfo) -> tuple[str, ...]:
    return (
        robot.name,
        robot.drive,
        f"{robot.mass_kg:.3g}",
        f"{robot.force_max_n:.3g}",
        f"{robot.radius_m:g}",
        "-" if robot.grip is None else f"{robot.grip:.2f}",
    )


def list_robots() -> Robots:
    """Return the shipped robots. The same as `beacon-mj robots`."""
    return Robots([_info(read_robot(path), path) for path in robot_paths().values()])


def check_robot(path: str | Path) -> RobotCheck:
    """Return whether a robot of your own keeps the contract, and what it is.

    The same as `beacon-mj robots --check`.

    Args:
        path: Its file.

    Raises:
        TemplateError: If the file cannot be read.
    """
    path = Path(path)
    if path.suffix != ".xml":
        raise TemplateError(f"{path}: expected a robot's file, *.xml.")
    robot = read_robot(path)
    faults = tuple(robot_faults(robot))
    return RobotCheck(faults=faults, robot=None if faults else _info(robot, path))


def _info(robot: RobotFile, path: Path) -> RobotInfo:
    own = fitted(robot, Robot(force_max_n=1e4))
    if robot.is_disc:
        own = Robot()
    return RobotInfo(
        name=robot.name,
        drive="holonomic" if robot.is_disc else "differential",
        mass_kg=own.mass_kg,
        force_max_n=own.force_max_n,
        radius_m=own.radius_m,
        grip=None if robot.is_disc else differential_drive(robot).grip,
        sha256=robot.sha256,
        path=path,
    )
