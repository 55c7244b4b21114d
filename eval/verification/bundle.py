"""A run in one file: all that is needed to verify it elsewhere, with a manifest.

The file is a ZIP archive without compression and without times, so that the same run
gives the same bytes everywhere. Code is in it as data; unpacking runs none of it.
"""

import hashlib
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

import beacon_mj
from beacon_mj.errors import BeaconError, RunError
from beacon_mj.eval.metrics.row import rows_sha256
from beacon_mj.eval.runs.code_record import check_code, code_files
from beacon_mj.eval.runs.config import RunConfig, stored_scenes
from beacon_mj.eval.runs.log_files import LOGS
from beacon_mj.eval.runs.run_folder import (
    CONFIG,
    LINES,
    REPORT,
    SUMMARY,
    TABLE,
    load_config,
    load_rows,
)
from beacon_mj.files import file_name, files_below, replacing
from beacon_mj.scene_gen.family import family_sha256

FORMAT = 1  #: Of the manifest.
MANIFEST = "manifest.json"
#: Files of a template folder that belong to it.
TEMPLATE_SUFFIXES = frozenset({".xml", ".py", ".obj", ".stl", ".msh", ".png"})
_NEVER = (1980, 1, 1, 0, 0, 0)  #: The earliest time that an archive can hold.
_MODE = 0o100644 << 16


def write_bundle(run: Path, out: Path) -> Path:
    """Write a finished run as one file; return its path.

    Args:
        run: The run folder.
        out: The file; one that exists is replaced.

    Raises:
        RunError: If the run is unfinished, or its planners' files or templates are no
            longer those that it was run with.
    """
    config, rows = load_config(run), load_rows(run)
    _check_unchanged(run, config)
    names: dict[str, Path | bytes] = dict(sorted(_contents(run, config)))
    files = {name: _described(content) for name, content in names.items()}
    manifest = {
        "format": FORMAT,
        "beacon-mj": beacon_mj.__version__,
        "rows_sha256": rows_sha256(rows),
        "planners": {
            e.name: {"spec": e.spec, "isolated": e.isolated, "code": e.code}
            for e in config.planners
        },
        "files": files,
    }
    text = msgspec.json.format(msgspec.json.encode(manifest, order="sorted"), indent=1)
    with replacing(out) as part, zipfile.ZipFile(part, "w") as archive:
        archive.writestr(_entry(MANIFEST), text + b"\n")
        for name, content in names.items():
            archive.writestr(_entry(name), _bytes(content))
    return out


def _entry(name: str) -> zipfile.ZipInfo:
    found = zipfile.ZipInfo(name, _NEVER)
    found.create_system, found.external_attr = 3, _MODE
    return found


def _bytes(content: Path | bytes) -> bytes:
    return content.read_bytes() if isinstance(content, Path) else content


def _described(content: Path | bytes) -> dict[str, Any]:
    data = _bytes(content)
    return {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}


def _check_unchanged(run: Path, config: RunConfig) -> None:
    """Refuse a run that cannot be repeated from what lies here now."""
    for name in (CONFIG, LINES, TABLE, SUMMARY):
        if not (run / name).is_file():
            raise RunError(f"{run}: expected a finished run but it has no {name}.")
    check_code(config.planners)
    if config.scene_dir is not None:
        return
    templates = None if config.templates is None else Path(config.templates)
    for name, digest in config.families.items():
        if family_sha256(name, templates) != digest:
            raise RunError(
                f"{run}: expected the files of family {name} with which it was run but "
                "they are others now."
            )


def _contents(run: Path, config: RunConfig) -> Iterator[tuple[str, Path | bytes]]:
    """Yield every file of the bundle by its name."""
    for name in (CONFIG, LINES, TABLE, SUMMARY, REPORT):
        if (run / name).is_file():
            yield f"run/{name}", run / name
    for log in files_below(run / LOGS, ".mcap"):
        yield f"run/{log.relative_to(run).as_posix()}", log
    for entry in config.planners:
        for name, data in _code(run, entry).items():
            yield f"planners/{file_name(entry.base)}/{name}", data
    if config.scene_dir is not None:
        yield from _scenes(config)
    elif config.templates is not None:
        yield from _templates(Path(config.templates))


def _code(run: Path, entry: Any) -> dict[str, bytes]:
    try:
        return code_files(entry)
    except (OSError, BeaconError) as error:
        raise RunError(f"{run}: the code of {entry.name}: {error}.") from error


def _scenes(config: RunConfig) -> Iterator[tuple[str, Path]]:
    """Yield the stored scenes that the run used."""
    assert config.scene_dir is not None
    root = Path(config.scene_dir)
    _, refs = stored_scenes(root, [*config.families], config.scenes_per_family)
    for ref in refs:
        yield f"scenes/{ref.family}_{ref.index:04d}.json", Path(str(ref.path))


def _templates(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield the files of a template folder; links that stay inside are followed."""
    root = folder.resolve()
    for path in folder.rglob("*"):
        relative = path.relative_to(folder)
        hidden = any(part.startswith((".", "__")) for part in relative.parts[:-1])
        if hidden or relative.name.startswith("."):
            continue
        if path.suffix.lower() in TEMPLATE_SUFFIXES and path.is_file():
            if Path(os.path.realpath(path)).is_relative_to(root):
                yield f"templates/{relative.as_posix()}", path
