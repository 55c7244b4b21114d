"""Reading a bundle that anybody may have made: nothing in it is believed or run."""

import hashlib
import zipfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

import msgspec

from beacon_mj.errors import RunError
from beacon_mj.eval.runs.config import PlannerEntry, RunConfig
from beacon_mj.eval.runs.run_folder import load_config
from beacon_mj.eval.verification.bundle import FORMAT, MANIFEST
from beacon_mj.files import file_name
from beacon_mj.planners.program import is_program

MAX_BYTES = 4 * 2**30  #: Of a bundle, which is as large as what it holds.
MAX_FILE_BYTES = 2**29  #: Of one file in it.
MAX_FILES = 100_000
MAX_MANIFEST_BYTES = 2**26
MAX_NAME = 400  #: Characters of a name.
#: What a bundle may hold, by the first part of its names.
FOLDERS = frozenset({"run", "planners", "templates", "scenes"})
_MAGIC = b"PK\x03\x04"
_REGULAR, _KIND = 0o100000, 0o170000


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the manifest says of a file."""

    bytes: int
    sha256: str


class _Manifest(msgspec.Struct, frozen=True):
    """What is used of the manifest; the rest is for readers."""

    format: int
    files: dict[str, _File]


def is_bundle(path: Path) -> bool:
    """Whether a file begins as bundles do."""
    try:
        with open(path, "rb") as file:
            return file.read(len(_MAGIC)) == _MAGIC
    except OSError:
        return False


def unpack(path: Path, folder: Path) -> Path:
    """Write the files of a bundle below a folder; return that of the run.

    Args:
        path: The bundle.
        folder: An empty folder.

    Raises:
        RunError: If it is no sound bundle: a name that leaves the folder, a link, a
            file that is too large, compressed, missing, not listed, or not the one in
            the manifest.
    """
    if path.stat().st_size > MAX_BYTES:
        raise RunError(f"{path}: expected a bundle of at most {MAX_BYTES} bytes.")
    try:
        with zipfile.ZipFile(path) as archive:
            entries = {entry.filename: entry for entry in _checked(path, archive)}
            listed = _manifest(path, archive, entries)
            for name, said in listed.items():
                _write(path, archive, entries[name], said, folder / name)
    # zipfile says NotImplementedError of a compression that it does not know.
    except (zipfile.BadZipFile, NotImplementedError, EOFError, ValueError) as error:
        raise RunError(f"{path}: not a sound bundle: {error}.") from error
    run = folder / "run"
    if not run.is_dir():
        raise RunError(f"{path}: expected a bundle with a run but it has none.")
    return run


def relocated(run: Path, folder: Path) -> RunConfig:
    """Return a run's configuration with the places that its bundle was unpacked to."""
    config = load_config(run)
    templates, scenes = folder / "templates", folder / "scenes"
    return msgspec.structs.replace(
        config,
        planners=tuple(_relocated(entry, folder) for entry in config.planners),
        templates=None if config.templates is None else str(templates),
        scene_dir=None if config.scene_dir is None else str(scenes),
    )


def _relocated(entry: PlannerEntry, folder: Path) -> PlannerEntry:
    if not entry.home or is_program(entry.spec):
        return entry  # A program runs only where the files of its command are.
    name = Path(entry.home.replace("\\", "/")).name
    home = folder / "planners" / file_name(entry.base) / name
    return msgspec.structs.replace(entry, home=str(home))


def _checked(path: Path, archive: zipfile.ZipFile) -> Iterator[zipfile.ZipInfo]:
    """Yield the entries of an archive, each fit to be written."""
    seen: set[str] = set()
    entries = archive.infolist()
    if len(entries) > MAX_FILES:
        raise RunError(f"{path}: expected at most {MAX_FILES} files.")
    for entry in entries:
        name = entry.filename
        if problem := _problem(entry):
            raise RunError(f"{path}: {name[:80]!r}: expected {problem}.")
        if name.casefold() in seen:
            raise RunError(f"{path}: {name!r} is there twice.")
        seen.add(name.casefold())
        yield entry
    if sum(entry.file_size for entry in entries) > MAX_BYTES:
        raise RunError(f"{path}: expected at most {MAX_BYTES} bytes in all.")


def _problem(entry: zipfile.ZipInfo) -> str | None:
    """Say what an entry should be and is not, or return None."""
    name, kind = entry.filename, (entry.external_attr >> 16) & _KIND
    pure = PurePosixPath(name)
    plain = name == str(pure) and not pure.is_absolute() and "\\" not in name
    if not plain or {"..", "."} & {*name.split("/")} or not name.isprintable():
        return "a name inside of the bundle, such as run/config.json"
    if len(name) > MAX_NAME or any(len(part.encode()) > 250 for part in pure.parts):
        return f"a name of at most {MAX_NAME} characters"
    if name != MANIFEST and (len(pure.parts) < 2 or pure.parts[0] not in FOLDERS):
        return f"a file below {', '.join(sorted(FOLDERS))}"
    if kind not in (0, _REGULAR) or entry.is_dir():
        return "a regular file"
    if entry.flag_bits & 1 or entry.compress_type != zipfile.ZIP_STORED:
        return "a file that is neither compressed nor encrypted"
    if entry.compress_size != entry.file_size or entry.file_size > MAX_FILE_BYTES:
        return f"at most {MAX_FILE_BYTES} bytes"
    return None


def _manifest(
    path: Path, archive: zipfile.ZipFile, entries: dict[str, zipfile.ZipInfo]
) -> dict[str, _File]:
    """Return what the manifest says of each file; raise unless it lists them all."""
    found = entries.get(MANIFEST)
    if found is None or found.file_size > MAX_MANIFEST_BYTES:
        raise RunError(f"{path}: expected a bundle with a {MANIFEST}.")
    try:
        manifest = msgspec.json.decode(archive.read(found), type=_Manifest)
    except msgspec.MsgspecError as error:
        raise RunError(f"{path}: {MANIFEST}: {error}.") from error
    if manifest.format != FORMAT:
        raise RunError(
            f"{path}: expected a bundle of format {FORMAT} but it is of format "
            f"{manifest.format}."
        )
    there = entries.keys() - {MANIFEST}
    for name in sorted(there ^ manifest.files.keys()):
        where = "not in the manifest" if name in there else "not in the bundle"
        raise RunError(f"{path}: {name!r} is {where}.")
    return manifest.files


def _write(
    path: Path, archive: zipfile.ZipFile, entry: zipfile.ZipInfo, said: _File,
    target: Path,
) -> None:  # fmt: skip
    data = archive.read(entry)
    if (len(data), hashlib.sha256(data).hexdigest()) != (said.bytes, said.sha256):
        raise RunError(f"{path}: {entry.filename!r} is not the file in the manifest.")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with open(target, "xb") as file:
            file.write(data)
    except OSError as error:
        raise RunError(f"{path}: {entry.filename!r}: {error.strerror}.") from error
