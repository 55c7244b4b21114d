"""Robots: MJCF files, the shipped ones and the user's own, as runs and logs keep them.

A robot is its whole file. What decides a result is in its record: run configurations
and logs hold the text with its SHA-256, so that they need no file to be repeated.
"""

import functools
import hashlib
from pathlib import Path
from typing import Annotated, ClassVar

import msgspec
from msgspec import UNSET, Meta, UnsetType

from beacon_mj.errors import TemplateError, unknown
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.regular_files import read_regular
from beacon_mj.scene import Scene

DISC = "disc"  #: The robot of scenes whose family chooses none.
MAX_BYTES = 100_000  #: Of a robot's file.
_NAME = r"^[A-Za-z][A-Za-z0-9_-]{0,60}$(?!\n)"


class RobotFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A robot, as it is recorded.

    Attributes:
        name: Stem of its file.
        sha256: SHA-256 of the file.
        mjcf: The file's text.
    """

    WORDS: ClassVar[str] = "a robot's name or its file"

    name: Annotated[str, Meta(pattern=_NAME)]
    sha256: str
    mjcf: Annotated[str, Meta(max_length=MAX_BYTES)]

    def __post_init__(self) -> None:
        """Check that the text is the one that was recorded.

        Raises:
            ValueError: If its SHA-256 is another.
        """
        found = _sha256(self.mjcf)
        if found != self.sha256:
            raise ValueError(
                f"expected the file of robot {self.name!r} to have SHA-256 "
                f"{self.sha256[:16]}... but it has {found[:16]}..."
            )

    @classmethod
    def from_text(cls, text: str) -> "RobotFile":
        """Return what an option names; see `find_robot`."""
        return find_robot(text)

    def __str__(self) -> str:
        """Return what it is chosen by: its name, or its file's if it is not shipped."""
        shipped = self.name in robot_paths() and self == shipped_robot(self.name)
        return self.name if shipped else f"{self.name}.xml"

    @property
    def is_disc(self) -> bool:
        """Whether it is the disc, which scenes are generated for."""
        return self.sha256 == shipped_robot(DISC).sha256


def robot_paths() -> dict[str, Path]:
    """Return the files of the shipped robots by name."""
    return {p.stem: p for p in sorted((ROOT / "robots").glob("*.xml"))}


@functools.cache
def shipped_robot(name: str) -> RobotFile:
    """Return a shipped robot. Raises TemplateError if there is none of that name."""
    paths = robot_paths()
    if name not in paths:
        raise TemplateError(unknown("robot", name, paths))
    return read_robot(paths[name])


def find_robot(choice: str) -> RobotFile:
    """Return the robot that is meant by a name, or by a file (`*.xml`).

    Raises:
        TemplateError: If there is none, or its file is no text that can be read.
    """
    if choice.endswith(".xml"):
        return read_robot(Path(choice))
    return shipped_robot(choice)


def read_robot(path: Path) -> RobotFile:
    """Return the robot in a file, unchecked. Raises TemplateError if it has no text."""
    try:
        text = read_regular(path, MAX_BYTES).decode()
        return msgspec.convert(
            {"name": path.stem, "sha256": _sha256(text), "mjcf": text}, RobotFile
        )
    except OSError as error:
        raise TemplateError(
            f"{path}: cannot read the robot: {error.strerror}."
        ) from error
    except UnicodeDecodeError as error:
        raise TemplateError(f"{path}: expected text in UTF-8: {error}.") from error
    except msgspec.ValidationError as error:
        raise TemplateError(
            f"{path}: expected a robot's file to be called by a letter and at most 60 "
            "letters (A to z), digits, - and _, followed by .xml."
        ) from error


def robot_in(scene: Scene, choice: RobotFile | UnsetType = UNSET) -> RobotFile:
    """Return the robot of an episode: the one that is chosen, or the scene's own."""
    if choice is not UNSET:
        return choice
    return shipped_robot(DISC if scene.robot_model is UNSET else scene.robot_model)


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
