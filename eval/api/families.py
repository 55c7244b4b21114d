"""The list of scene families, suite by suite."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from beacon_mj.rendering.tables import Listing, Prose, add_line, plain_table
from beacon_mj.scene_gen.family import Family, family_paths, load_family
from beacon_mj.scene_gen.learning.rounds import default_scenes
from beacon_mj.scene_gen.suites import (
    RELEASED,
    stated_suite,
    suite_families,
    suite_of,
    suites_of,
)

LEGEND = Prose(
    "learning: what the best policy that learns by touch saves, in "
    "expectation, over the best one that does not; promised for every scene.\n"
    "scenes: how many of a family an evaluation runs unless told otherwise."
)


@dataclass(frozen=True, kw_only=True, slots=True)
class FamilyInfo:
    """A scene family.

    Attributes:
        name: Its name.
        suite: The released suite that its scenes are of, or the one that a family of
            your own names; None if there is none.
        layout: How its obstacles are laid out.
        obstacles: Smallest and largest number of obstacles that it draws; None where
            walls and doors are all there is.
        learning_value_s: What learning by touch is promised to be worth in each of its
            scenes, at least [s]; None where nothing is promised.
        control: Whether what is hidden is drawn anew, so that learning is worth 0.
        scenes: Scenes of an evaluation by default: 100, or the whole rounds of latent
            worlds nearest to it.
        shapes: Names of its obstacles' prototypes.
        path: Its file; copy it to make a family of your own.
    """

    name: str
    suite: str | None
    layout: str
    obstacles: tuple[int, int] | None
    learning_value_s: float | None
    control: bool
    scenes: int
    shapes: tuple[str, ...]
    path: Path


class Families(Listing[FamilyInfo]):
    """The scene families, as a sequence and as a table."""

    def tables(self) -> Sequence[Table | str]:
        """Return a table a suite, then shapes, then where the files are."""
        suites = dict.fromkeys(each.suite for each in self)
        parts: list[Table | str] = []
        for suite in suites:
            own = [each for each in self if each.suite == suite]
            parts += [_table(suite, own), ""]
        return [*parts, LEGEND, "", _shapes(self), "", *_files(self)]


def _table(suite: str | None, families: Iterable[FamilyInfo]) -> Table:
    title = "families of no suite" if suite is None else f"suite {suite}"
    count = "obsta-\ncles"
    table = plain_table(
        title,
        spare=(count, "layout"),
        padding=(0, 1),
        collapse_padding=True,
        pad_edge=False,
    )
    table.add_column("family", overflow="fold")
    for name in ("layout", count, "learning", "scenes"):
        right = name in (count, "scenes")
        table.add_column(name, justify="right" if right else "left", no_wrap=True)
    for each in families:
        add_line(table, *_cells(each))
    return table


def _cells(family: FamilyInfo) -> tuple[str, ...]:
    """Return the line of one family."""
    count, value = family.obstacles, family.learning_value_s
    learning = "-" if value is None else f">= {value:g} s"
    return (
        family.name,
        family.layout,
        "-" if count is None else f"{count[0]}-{count[1]}",
        "control" if family.control else learning,
        str(family.scenes),
    )


def _shapes(families: Iterable[FamilyInfo]) -> str:
    """Return which shapes occur, families with the same ones together."""
    found: dict[tuple[str, ...], list[str]] = {}
    for each in families:
        found.setdefault(each.shapes, []).append(each.name)
    lines = [f"{', '.join(n)}: {', '.join(shapes)}" for shapes, n in found.items()]
    return Prose("\n".join(["Shapes of the obstacles:", *lines]))


def _files(families: Iterable[FamilyInfo]) -> Iterator[str]:
    """Yield the folders of the families' files, whole, and the files' names."""
    found: dict[Path, list[str]] = {}
    for each in families:
        found.setdefault(each.path.parent, []).append(each.path.name)
    yield Prose("Copy a file to make a family of your own (--templates):")
    for folder, names in found.items():
        yield f"{folder}/"  # A path is never broken.
        yield Prose(" ".join(names))


def list_families(
    templates: str | Path | None = None, *, suite: str | Sequence[str] = ()
) -> Families:
    """Return the scene families. The same as `beacon-mj families`.

    Args:
        templates: Folder of your own family templates; a family of your own takes the
            place of a shipped one of its name.
        suite: Suites, one or several; by default all families.

    Raises:
        TemplateError: If the folder or a suite does not exist, or a template is no
            good.
    """
    folder = None if templates is None else Path(templates)
    paths = family_paths(folder)
    names = [n for each in suites_of(suite) for n in suite_families(each, folder)]
    found = [
        _info(load_family(name, folder), paths[name], folder)
        for name in dict.fromkeys(names or paths)
    ]
    return Families(sorted(found, key=_place))


def _info(family: Family, path: Path, templates: Path | None) -> FamilyInfo:
    count = family.numerics.get("obstacle_count")
    promised = "learning_value" in family.numerics
    name = family.name
    return FamilyInfo(
        name=name,
        suite=suite_of(name, templates) or stated_suite(name, templates),
        layout=family.layout,
        obstacles=None if count is None else (int(count[0]), int(count[1])),
        learning_value_s=family.value("learning_value") if promised else None,
        control=promised and family.texts.get("redrawn", "never") != "never",
        scenes=default_scenes(family),
        shapes=tuple(p.name for p in family.prototypes),
        path=path,
    )


def _place(family: FamilyInfo) -> tuple[int, int]:
    """Return where a family stands: by suite, then as its suite has it."""
    for k, (suite, families) in enumerate(RELEASED.items()):
        if suite == family.suite:
            return k, [*families].index(family.name)
    return len(RELEASED), 0
