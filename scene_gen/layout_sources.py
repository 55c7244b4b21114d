"""Where the source of a layout of one's own is: read and hashed here, never run."""

import functools
import importlib.util
import os
import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from beacon_mj.errors import TemplateError
from beacon_mj.regular_files import read_regular
from beacon_mj.source_files import local_sources

FILE = "layouts.py"  #: Of a template folder.
MAX_BYTES = 16_000_000  #: Of a file of layouts.
GROUP = "beacon_mj.layouts"  #: Entry points of packages that bring layouts.


def layout_file(folder: Path) -> Path | None:
    """Return the layouts of a template folder, if it has any."""
    path = folder / FILE
    return path if path.is_file() else None


def layout_entry_point(name: str) -> EntryPoint | None:
    """Return the installed entry point of a layout, if there is one."""
    found = _entry_points(tuple(_installed()))
    return next((point for point in found if point.name == name), None)


@functools.lru_cache(maxsize=1)
def _entry_points(installed: tuple[object, ...]) -> tuple[EntryPoint, ...]:
    """Return the layouts of all packages, read again where one was installed since."""
    return tuple(entry_points(group=GROUP))


def _installed() -> Iterator[tuple[str, int]]:
    """Yield each folder of packages, and when something last came or went there."""
    for folder in sys.path:
        try:
            yield folder, os.stat(folder or ".").st_mtime_ns
        except OSError:
            yield folder, 0


def layout_source(folder: Path, name: str) -> list[bytes]:
    """Return what stands for a layout's source in the hash of a family.

    This is the folder's `layouts.py` and the modules beside it that it imports, else
    the module of an entry point; nothing for a layout that is neither: the shipped ones
    are part of the generator's own source.

    Raises:
        TemplateError: If the source cannot be read.
    """
    path = layout_file(folder)
    if path is not None:
        return [FILE.encode(), read_source(path), *_imported_by(path)]
    found = layout_entry_point(name)
    if found is None:
        return []
    source = module_file(found)
    return [found.value.encode(), b"" if source is None else read_source(source)]


def _imported_by(path: Path) -> list[bytes]:
    """Return name and content of each local module that a file of layouts imports."""
    try:
        found = local_sources(path)
    except OSError as error:
        raise TemplateError(
            f"{path}: cannot read a module that it imports: {error.strerror}"
        ) from error
    del found[path.name]
    return [part for name, data in found.items() for part in (name.encode(), data)]


def read_source(path: Path) -> bytes:
    """Return the bytes of a file of layouts. Raises TemplateError if it cannot."""
    try:
        return read_regular(path, MAX_BYTES)
    except OSError as error:
        raise TemplateError(
            f"{path}: cannot read the layouts: {error.strerror}"
        ) from error


def module_file(found: EntryPoint) -> Path | None:
    """Return the file of the module that an entry point names, not importing it."""
    try:
        spec = importlib.util.find_spec(found.module)
    except (ImportError, ValueError):
        return None
    return Path(spec.origin) if spec is not None and spec.origin else None
