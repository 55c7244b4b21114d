"""Generated scenes kept on disk, so that no run generates what another one has.

An entry's name is the SHA-256 of all that decides the scene: its family's files, index,
seed, perception, the generator's source code and the versions of what it computes with.
Whatever changes, changes the name. An entry holds a SHA-256 of its name and the scene's
JSON; one that is cut off, damaged, or another's is generated again.
"""

import hashlib
import os
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile

from platformdirs import user_cache_path

import beacon_mj
from beacon_mj.errors import BeaconError, SceneError
from beacon_mj.eval.runs.versions import package_versions
from beacon_mj.scene import Profile, Scene
from beacon_mj.scene.files import parse_scene
from beacon_mj.scene_gen.family import family_sha256
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.suites import RELEASED, suite_of

VARIABLE = "BEACON_MJ_CACHE"  #: Names another folder; empty or `off` for no cache.
#: Entries in each of the 256 subfolders, where the oldest make room: all in all some
#: 10 000 scenes of 5 to 15 kB.
BUCKET = 40


def cache_folder() -> Path | None:
    """Return the folder of the cache, which may not exist yet; None for no cache."""
    chosen = os.environ.get(VARIABLE)
    if chosen is not None:
        return None if chosen in ("", "off") else Path(chosen)
    usual = user_cache_path("beacon-mj", appauthor=False)
    return usual if usual.is_absolute() else None  # Some users have no home.


def cached_scene(
    family: str,
    index: int,
    seed: int,
    perception: Profile,
    templates: Path | None = None,
    files_sha256: str | None = None,
) -> Scene:
    """Return what `generate_scene` returns for a family's name, kept or generated.

    Args:
        family: Its name.
        index: Number of the scene, >= 0.
        seed: Seed of the scenes, >= 0.
        perception: What is perceived of classes.
        templates: Folder of the user's own templates.
        files_sha256: `family_sha256` of the family, if it is known; reading all its
            files for each scene takes a third of the time.
    """
    folder = cache_folder()
    if folder is None:
        return generate_scene(family, index, seed, perception, templates)
    files = files_sha256 or family_sha256(family, templates)
    what = (files, family, index, seed, perception, CODE_SHA256, _versions())
    key = hashlib.sha256(repr(what).encode()).hexdigest()
    path = folder / "scenes" / key[:2] / key
    found = _read(path)
    if found is None:
        found = generate_scene(family, index, seed, perception, templates)
        if family_sha256(family, templates) == files:  # Nobody edited it meanwhile.
            _write(path, found)
    return found


def released_scene_suite(scene: Scene) -> str | None:
    """Return the released suite that a scene is of, or None.

    The scene is made again from the shipped family of its name: only equal bytes count.
    """
    if not any(scene.family in families for families in RELEASED.values()):
        return None
    suite = suite_of(scene.family)
    if suite is None:
        return None
    try:
        made = cached_scene(scene.family, scene.index, scene.seed, scene.perception)
    except BeaconError:
        return None
    return suite if made.sha256 == scene.sha256 else None


def generator_sources() -> Iterator[Path]:
    """Yield the modules that scenes may be made with.

    These are the generator, the folders that it may import (see the import contracts),
    whatever is in them, and the modules beside the folders.
    """
    root = Path(beacon_mj.__file__).parent
    yield from sorted(root.glob("*.py"))
    for folder in ("learning", "mjcf_templates", "motion", "scene", "scene_gen"):
        yield from sorted((root / folder).rglob("*.py"))


def _code_sha256() -> str:
    files = [path.read_bytes() for path in generator_sources()]
    return hashlib.sha256(repr(files).encode()).hexdigest()


#: Read along with the modules: a source that is edited later is not what runs here.
CODE_SHA256 = _code_sha256()


@cache
def _versions() -> str:
    return repr(sorted(package_versions().items()))


def _read(path: Path) -> Scene | None:
    """Return the scene of an entry, or None if there is none that is sound."""
    try:
        digest, _, text = path.read_bytes().partition(b"\n")
        return parse_scene(text) if digest == _digest(path, text) else None
    except (OSError, SceneError):
        return None


def _write(path: Path, scene: Scene) -> None:
    """Keep a scene, whole or not at all; a full disk or a read-only one is no error."""
    text = scene.to_json()
    write_entry(path, _digest(path, text) + b"\n" + text)


def write_entry(path: Path, content: bytes) -> None:
    """Write a file of the cache, and make room for it."""
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        part = NamedTemporaryFile(dir=path.parent, delete=False)
        try:
            with part:
                part.write(content)
            os.replace(part.name, path)
        finally:
            Path(part.name).unlink(missing_ok=True)
        _make_room(path.parent)


def _digest(path: Path, text: bytes) -> bytes:
    return hashlib.sha256(path.name.encode() + text).hexdigest().encode()


def _make_room(folder: Path) -> None:
    """Remove the oldest files, among them those that killed processes left."""
    files = sorted(folder.iterdir(), key=lambda path: path.stat().st_mtime_ns)
    for path in files[:-BUCKET]:
        path.unlink(missing_ok=True)
