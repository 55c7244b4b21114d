"""`beacon-mj generate`, `families`, and `view`."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from beacon_mj.cli import options
from beacon_mj.errors import RunError

if TYPE_CHECKING:
    from beacon_mj.scene import Scene
    from beacon_mj.scene_gen.family import Family


def generate(
    *,
    out: Annotated[Path, Parameter(help="Folder to write to; new or empty.")],
    family: options.Family = (),
    episodes: Annotated[options.Count, Parameter(help="Scenes per family.")] = 100,
    seed: options.Seed = 0,
    perception: options.Perception = None,
    templates: options.Templates = None,
    certify: Annotated[
        options.Flag,
        Parameter(help="Then solve each in MuJoCo, as `beacon-mj certify` does."),
    ] = False,
) -> int:
    """Write certified scenes: scene_0000.json, and its world as scene_0000.xml.

    Several families go to a folder each. The same options give the same bytes.
    """
    from beacon_mj.scene_gen.family import default_families, load_family
    from beacon_mj.scene_gen.generate import generate_scene

    names = [*dict.fromkeys(family or default_families(templates))]
    loaded = [load_family(name, templates) for name in names]
    _make_folder(out)
    for each in loaded:
        folder = out / each.name if len(loaded) > 1 else out
        folder.mkdir(exist_ok=True)
        for index in range(episodes):
            profile = perception or "noisy"
            _write(generate_scene(each, index, seed, profile), folder)
        print(f"{folder}: {episodes} scenes of {each.name}", file=sys.stderr)
    if not certify:
        return 0
    from beacon_mj.cli.certify import certify as certify_folder

    return certify_folder(out)


def families(*, templates: options.Templates = None) -> None:
    """List the scene families: suite, layout, obstacles, value of learning, and file.

    The value of learning is what the best policy that learns from stage to stage
    saves, in expectation, over the best one that does not; promised for every scene.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from beacon_mj.cli.tables import console
    from beacon_mj.scene_gen.family import family_paths, load_family

    table = Table(box=SIMPLE_HEAD)
    for title in ("family", "suite", "layout", "obstacles", "learning"):
        table.add_column(title, no_wrap=True)
    paths = family_paths(templates)
    for name in paths:
        found = load_family(name, templates)
        table.add_row(
            name,
            found.suite,
            found.layout,
            _count(found),
            _learning(found),
        )
    screen = console()
    screen.print(table)
    screen.print("Copy a file to make a family of your own (--templates):")
    for path in paths.values():
        print(f"  {path}")


def _count(family: "Family") -> str:
    """Return how many obstacles a family draws; doors and walls are its layout's."""
    if "obstacle_count" not in family.numerics:
        return "-"
    low, high = family.range("obstacle_count")
    return f"{low:g}-{high:g}"


def _learning(family: "Family") -> str:
    """Return the least value of learning that a family promises."""
    if "learning_value" not in family.numerics:
        return "-"
    return f">= {family.value('learning_value'):g} s"


def view(
    scene: Path,
    /,
    *,
    png: Annotated[
        Path | None, Parameter(help="Write a picture instead of opening a window.")
    ] = None,
) -> None:
    """Look at a scene: in MuJoCo's viewer, or as a picture.

    Parameters
    ----------
    scene
        A scene's JSON file.
    """
    from beacon_mj.rendering import render_scene, view_scene
    from beacon_mj.scene.files import load_scene

    found = load_scene(scene)
    if png is None:
        view_scene(found)
    else:
        print(render_scene(found, png), file=sys.stderr)


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


def _write(scene: "Scene", folder: Path) -> None:
    """Write one scene and its world, each whole or not at all."""
    from beacon_mj.scene_gen.mjcf import scene_mjcf

    stem = f"scene_{scene.index:04d}"
    texts = {".xml": scene_mjcf(scene).encode(), ".json": scene.to_json()}
    for suffix, text in texts.items():
        part = folder / f"{stem}{suffix}.part"
        part.write_bytes(text)
        part.replace(folder / f"{stem}{suffix}")
