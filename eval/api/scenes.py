"""Writing scenes."""

from collections.abc import Callable, Sequence
from pathlib import Path

from beacon_mj.errors import RunError
from beacon_mj.eval.runs.whole_numbers import check_whole_numbers
from beacon_mj.files import replacing
from beacon_mj.scene import Profile, Scene
from beacon_mj.scene_gen.family import load_family
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.learning.rounds import (
    cut_round,
    default_scenes,
    round_scenes,
)
from beacon_mj.scene_gen.mjcf import scene_mjcf
from beacon_mj.scene_gen.suites import chosen_families, suites_of


def generate_scenes(
    out: str | Path,
    *,
    families: Sequence[str] = (),
    suite: str | Sequence[str] = (),
    scenes_per_family: int | None = None,
    seed: int = 0,
    perception: Profile = "noisy",
    templates: str | Path | None = None,
    on_folder: Callable[[Path, str, int], None] = lambda *_: None,
    tell: Callable[[str], None] = lambda _: None,
) -> list[Path]:
    """Write certified scenes: scene_0000.json, and its world as scene_0000.xml.

    The same as `beacon-mj generate`. Several families go to a folder each. The same
    options give the same bytes.

    Args:
        out: Folder to write to, new or empty.
        families: Scene families; those of suite `paper-v1` by default.
        suite: Suites, in place of `families`; see `evaluate`.
        scenes_per_family: Default 100, or the whole rounds nearest to it.
        seed: Seed of scenes and perception, >= 0.
        perception: What planners are told about class and material.
        templates: Folder of your own family templates.
        on_folder: Told of each folder that is complete: path, family, scenes.
        tell: Told before the start of rounds that are cut; see `evaluate`.

    Returns:
        The JSON files.

    Raises:
        BeaconError: If a family is no good, or the folder holds files.
    """
    check_whole_numbers(seed=seed, scenes_per_family=scenes_per_family)
    folder = None if templates is None else Path(templates)
    names = chosen_families(families, suites_of(suite), folder)
    loaded = [load_family(name, folder) for name in names]
    counts = [scenes_per_family or default_scenes(each) for each in loaded]
    for each, count in zip(loaded, counts, strict=True):
        if line := cut_round(each.name, count, round_scenes(each)):
            tell(line)
    root = Path(out)
    _make_folder(root)
    paths = []
    for each, count in zip(loaded, counts, strict=True):
        own = root / each.name if len(loaded) > 1 else root
        own.mkdir(exist_ok=True)
        for index in range(count):
            scene = generate_scene(each, index, seed, perception)
            paths.append(_write(scene, own))
        on_folder(own, each.name, count)
    return paths


def _make_folder(path: Path) -> None:
    if path.is_dir() and any(path.iterdir()):
        raise RunError(f"{path}: expected a new or empty folder but it holds files.")
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise RunError(f"{path}: cannot be written: {error.strerror}.") from error


def _write(scene: Scene, folder: Path) -> Path:
    """Write one scene and its world, each whole or not at all; return the scene's."""
    stem = f"scene_{scene.index:04d}"
    texts = {".xml": scene_mjcf(scene).encode(), ".json": scene.to_json()}
    for suffix, text in texts.items():
        with replacing(folder / f"{stem}{suffix}", RunError) as part:
            part.write_bytes(text)
    return folder / f"{stem}.json"
