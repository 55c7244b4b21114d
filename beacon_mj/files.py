"""Files: contents that are whole, names that are safe, and what lies in a folder."""

import hashlib
import os
import re
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from beacon_mj.errors import BeaconError

NAME_BYTES = 200  #: Longest file name that is made of another name; systems take 255.
#: What some system cannot have in a name, or gives a meaning of its own; `~` marks
#: names that were made safe.
_UNSAFE = re.compile(r'[/\\:*?"<>|~]')
_DEVICES = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")


@contextmanager
def replacing(path: Path, error: type[BeaconError] = BeaconError) -> Iterator[Path]:
    """Yield a temporary path beside `path`; rename it when the block succeeds.

    Whatever ends the block early leaves `path` as it was, and nothing beside it. A link
    stays a link: the file that it leads to is replaced.

    Args:
        path: The file to write; its folder is made when missing.
        error: What is raised.

    Raises:
        BeaconError: If the folder or the file cannot be written, or `path` is there and
            no regular file.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        raise error(f"{path}: cannot write: it is there and no regular file.")
    part = target.with_name(f"{target.name}.part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield part
            os.replace(part, target)
        finally:
            part.unlink(missing_ok=True)
    except OSError as failure:
        why = failure.strerror or str(failure)
        raise error(f"{path}: cannot write: {why}") from failure


def file_name(name: str) -> str:
    """Return a name that can be a file's, whoever chose it: a different one for each.

    A name of printable characters that no system gives a meaning stays as it is. Any
    other one, such as `../x`, an empty one or one with control characters, becomes what
    can be read of it, `~`, and the beginning of its SHA-256.
    """
    plain = not _UNSAFE.search(name) and name.isprintable()
    if (
        plain
        and name
        and name[0] not in ".- "
        and name[-1] not in ". "
        and len(os.fsencode(name)) <= NAME_BYTES
        and unicodedata.is_normalized("NFC", name)
        and not _DEVICES.fullmatch(name)
    ):
        return name
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:16]
    return f"{re.sub(r'[^A-Za-z0-9_=,-]', '_', name)[:60].strip('-')}~{digest}"


def files_below(folder: Path, suffix: str) -> list[Path]:
    """Return the files below a folder whose names end in `suffix`, sorted.

    Links to folders are followed, each folder once, and hidden files and folders (such
    as the `._x` of a file server) left out.
    """
    found: list[Path] = []
    seen: set[str] = set()
    for place, folders, names in os.walk(folder, followlinks=True):
        real = os.path.realpath(place)
        folders[:] = sorted(n for n in folders if not n.startswith("."))
        if real in seen:
            folders.clear()
            continue
        seen.add(real)
        found += [
            Path(place, name)
            for name in names
            if name.endswith(suffix) and not name.startswith(".")
        ]
    return sorted(found)
