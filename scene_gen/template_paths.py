"""Where the files of a template are, and reading them.

Nothing outside the family's own template folder and the shipped one is ever read.
"""

import os
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


def find_file(name: str, path: Path, folder: Path) -> Path:
    """Return where a file is: beside the template that names it, or as an include."""
    relative = _inside(name, path)
    homes = folder.resolve(), ROOT.resolve()
    for candidate in (path.parent / name, folder / relative, ROOT / relative):
        if candidate.is_dir():
            continue
        real = candidate.resolve()
        inside = any(real.is_relative_to(home) for home in homes)
        if inside and candidate.exists():
            return candidate
        written = Path(os.path.normpath(candidate))
        if os.path.lexists(candidate) and written.is_relative_to(folder):
            raise TemplateError(
                f"{path}: file {name!r} is a link that leaves the template folder or "
                f"leads nowhere: it leads to {real}. Copy the file."
            )
    raise TemplateError(
        f"{path}: file {name!r} found neither in {folder} nor among the shipped "
        "templates."
    )


def _inside(name: str, path: Path) -> Path:
    """Normalise a file name of a family; it may not leave the template folder."""
    parts: list[str] = ["families"]
    pure = PurePosixPath(name)
    for part in pure.parts:
        if part == ".." and parts:
            parts.pop()
        elif part != ".":
            parts.append(part)
    if pure.is_absolute() or ".." in parts or name.count("..") > 1:
        raise TemplateError(
            f"{path}: expected file {name!r} to stay inside the template folder."
        )
    return Path(*parts)
