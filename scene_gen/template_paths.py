"""Where the files of a template are, and reading them.

Nothing outside the family's own template folder and the shipped one is ever read.
"""

import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from beacon_mj.errors import TemplateError
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.regular_files import read_regular

MAX_BYTES = 64_000_000  #: Of one file of a template.


def template_folder(path: Path) -> Path:
    """Return the template folder that a family file belongs to."""
    return path.parent.parent if path.parent.name == "families" else path.parent


def read_file(path: Path) -> bytes:
    """Return the bytes of a file. Raises TemplateError if it is not fit to be read."""
    try:
        return read_regular(path, MAX_BYTES)
    except OSError as error:
        raise TemplateError(
            f"{path}: cannot read the template: {error.strerror}"
        ) from error


@dataclass(slots=True)
class AssetFolders:
    """Where the meshes and pictures of one model are, as its `<compiler>` says.

    An obstacle file is a model of its own, with all that it includes.

    Attributes:
        home: Folder of the model's file.
        mesh: Folder of its meshes, below `home`.
        texture: Folder of its pictures, below `home`.
    """

    home: Path
    mesh: str = ""
    texture: str = ""

    def take(self, compiler: ET.Element, path: Path) -> None:
        """Note what a `<compiler>` says; the attributes are gone then.

        Raises:
            TemplateError: If a folder is an absolute path.
        """
        for name in ("assetdir", "meshdir", "texturedir"):
            if (value := compiler.attrib.pop(name, None)) is None:
                continue
            if PurePosixPath(value).is_absolute():
                raise TemplateError(
                    f"{path}: expected {name} {value!r} to stay inside the template "
                    "folder."
                )
            if name != "texturedir":
                self.mesh = value
            if name != "meshdir":
                self.texture = value

    def places(self, element: ET.Element, path: Path) -> list[Path]:
        """Return the folders in which a file that an element names may be, in order."""
        named = {"texture": self.texture, "include": ""}.get(element.tag, self.mesh)
        if not named:
            return [path.parent, self.home]
        return [self.home / named, path.parent / named, path.parent]


def find_file(name: str, path: Path, folder: Path, places: Iterable[Path]) -> Path:
    """Return where a file is that a template names.

    Args:
        name: As it is written.
        path: The template.
        folder: Its template folder, where the file is looked up after `places`, and
            then among the shipped templates.
        places: Folders.

    Raises:
        TemplateError: If it is not there, or leaves the template folder.
    """
    written = [place / name for place in places]
    written += [home / "families" / name for home in (folder, ROOT)]
    candidates = [Path(os.path.normpath(each)) for each in written]
    candidates = [each for each in candidates if _lies_in(each, folder, ROOT)]
    if PurePosixPath(name).is_absolute() or not candidates:
        raise TemplateError(
            f"{path}: expected file {name!r} to stay inside the template folder."
        )
    for candidate in candidates:
        if candidate.is_dir():
            continue
        real = candidate.resolve()
        if candidate.exists() and _lies_in(real, folder.resolve(), ROOT.resolve()):
            return candidate
        if os.path.lexists(candidate) and _lies_in(candidate, folder):
            raise TemplateError(
                f"{path}: file {name!r} is a link that leaves the template folder or "
                f"leads nowhere: it leads to {real}. Copy the file."
            )
    raise TemplateError(
        f"{path}: file {name!r} found neither in {folder} nor among the shipped "
        "templates."
    )


def _lies_in(path: Path, *folders: Path) -> bool:
    whole = os.path.abspath(path)
    return any(Path(whole).is_relative_to(os.path.abspath(f)) for f in folders)
