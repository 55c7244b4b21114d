"""Writing scenes, and the list of their families."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from beacon_mj.errors import RunError
from beacon_mj.files import replacing
from beacon_mj.rendering.tables import Listing, add_line, plain_table
from beacon_mj.scene import Profile, Scene
from beacon_mj.scene_gen.family import default_families, family_paths, load_family
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.mjcf import scene_mjcf


@dataclass(frozen=True, kw_only=True, slots=True)
class FamilyInfo:
    """A scene family.

    Attributes:
        name: Its name.
        suite: The suite it belongs to; those of `paper-v1` run where none is named.
        layout: How its obstacles are laid out.
        obstacles: Smallest and largest number of obstacles that it draws; None where
            walls and doors are all there is.
        learning_value_s: What learning by touch is promised to be worth in each of its
            scenes, at least [s]; None where nothing is promised.
        shapes: Names of its obstacles' prototypes.
        path: Its file; copy it to make a family of your own.
    """

    name: str
    suite: str
    layout: str
    obstacles: tuple[int, int] | None
    learning_value_s: float | None
    shapes: tuple[str, ...]
    path: Path


class Families(Listing[FamilyInfo]):
    """The scene families, as a sequence and as a table."""

    def tables(self) -> Sequence[Table | str]:
        """Return a line a family, then its shapes, then where the files are."""
        table = plain_table(padding=(0, 1))
        for name in ("family", "suite", "layout", "obstacles", "learning"):
            table.add_column(name, no_wrap=True)
        for each in self:
            add_line(table, *_cells(each))
        shapes = "\n".join(f"  {each.name}: {', '.join(each.shapes)}" for each in self)
        files = "\n".join(f"  {each.path}" for each in self)
        return [
            table,
            "Shapes of the obstacles:\n" + shapes,
            "Copy a file to make a family of your own (--templates):\n" + files,
        ]


def _cells(family: FamilyInfo) -> tuple[str, ...]:
    """Return the line of one family."""
    count, value = family.obstacles, family.learning_value_s
    return (
        family.name,
        family.suite,
        family.layout,
        "-" if count is None else f"{count[0]}-{count[1]}",
        "-" if value is None else f">= {value:g} s",
    )


def list_families(templates: str | Path | None = None) -> Families:
    """Return the scene families. The same as `beacon-mj families`.

    Args:
        templates: Folder of your own family templates; their families come first.

    Raises:
        TemplateError: If the folder does not exist, or a template is no good.
    """
    folder = None if templates is None else Path(templates)
    found = []
    for name, path in family_paths(folder).items():
        family = load_family(name, folder)
        count = family.numerics.get("obstacle_count")
        promised = "learning_value" in family.numerics
        found.append(
            FamilyInfo(
                name=name,
                suite=family.suite,
                layout=family.layout,
                obstacles=None if count is None else (int(count[0]), int(count[1])),
                learning_value_s=family.value("learning_value") if promised else None,
                shapes=tuple(p.name for p in family.prototypes),
                path=path,
            )
        )
    return Families(found)


def generate_scenes(
    out: str | Path,
    *,
    families: Sequence[str] = (),
    scenes_per_family: int = 100,
    seed: int = 0,
    perception: Profile = "noisy",
    templates: str | Path | None = None,
    on_folder: Callable[[Path, str, int], None] = lambda *_: None,
) -> list[Path]:
    """Write certified scenes: scene_0000.json, and its world as scene_0000.xml.

    The same as `beacon-mj generate`. Several families go to a folder each. The same
    options give the same bytes.

    Args:
        out: Folder to write to, new or empty.
        families: Scene families; those of suite `paper-v1` by default.
        scenes_per_family: How many.
        seed: Seed of scenes and perception, >= 0.
        perception: What planners are told about class and material.
        templates: Folder of your own family templates.
        on_folder: Told of each folder that is complete: path, family, scenes.

    Returns:
        The JSON files.

    Raises:
        BeaconError: If a family is no good, or the folder holds files.
    """
    folder = None if templates is None else Path(templates)
    names = [*dict.fromkeys(families or default_families(folder))]
    loaded = [load_family(name, folder) for name in names]
    root = Path(out)
    _make_folder(root)
    paths = []
    for each in loaded:
        own = root / each.name if len(loaded) > 1 else root
        own.mkdir(exist_ok=True)
        for index in range(scenes_per_family):
            scene = generate_scene(each, index, seed, perception)
            paths.append(_write(scene, own))
        on_folder(own, each.name, scenes_per_family)
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
