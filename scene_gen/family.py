"""Scene families: reading one MJCF file, checked, into plain data.

A family is a valid MJCF model. Its `<custom>` section carries the numbers, one
`<default class>` per interaction class how obstacles look and behave, and the bodies
of its world which shapes occur. MuJoCo's `MjSpec` reads, checks and compiles the file
once; a file of the user's own in a process with limits.
"""

import functools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import msgspec

from beacon_mj.constants import CLASSES, MAX_OBSTACLES
from beacon_mj.errors import TemplateError, unknown
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import Surface
from beacon_mj.scene.shapes import Shape
from beacon_mj.scene_gen.limited_reader import read_apart
from beacon_mj.scene_gen.mjcf_files import load_template, template_sha256
from beacon_mj.scene_gen.mjcf_reader import Mjcf, element_error, read_mjcf
from beacon_mj.scene_gen.prototypes import Prototype, read_prototypes

#: Numbers a family may carry: how many values, least and largest allowed value.
NUMERICS: Mapping[str, tuple[int, float, float]] = {
    "obstacle_count": (2, 0, MAX_OBSTACLES),
    "size": (2, 0.05, 3.0),
    "aspect": (2, 0.05, 1.0),
    "height": (2, 0.05, 3.0),
    "spacing": (1, 0.0, 2.0),
    "class_mix": (3, 0.0, 1e6),
    "safe_fixed_fraction": (1, 0.0, 1.0),
    "safe_density": (2, 1.0, 30000.0),
    "safe_friction": (2, 0.01, 5.0),
    "movable_density": (2, 1.0, 30000.0),
    "movable_friction": (2, 0.01, 5.0),
    "fragile_density": (2, 1.0, 30000.0),
    "fragile_friction": (2, 0.01, 5.0),
    "fragile_break_force": (2, 0.1, 1e5),
    "detour_limit": (1, 1.0, 10.0),
    "door_count": (2, 1, 10),
    "door_width": (2, 0.25, 1.5),
    "door_offset": (2, 0.0, 3.0),
    "barrier_gap": (2, 0.0, 0.2),
    "gate_width": (2, 0.3, 3.0),
    "shortcut_ratio": (1, 1.0, 5.0),
    # Warehouses.
    "rack_pitch": (1, 1.0, 10.0),
    "rack_length": (1, 0.2, 3.0),
    "rack_depth": (1, 0.1, 1.0),
    "rack_height": (2, 0.05, 3.0),
    "cross_aisle_pitch": (1, 3.0, 50.0),
    "pallet_width": (2, 0.25, 1.5),
    "pallet_gap": (2, 0.0, 0.2),
    "pallet_share": (1, 0.0, 1.0),
    # The room, the robot, and how it senses.
    "workspace": (2, 3.0, 50.0),
    "force_max": (1, 1.0, 1e4),
    "sensing_radius": (1, 0.0, 100.0),
    "occlusion": (1, 0.0, 1.0),
    "pose_noise": (1, 0.0, 0.5),
    "missed_detection": (1, 0.0, 0.99),
    "robot_pose_noise": (1, 0.0, 0.5),
    "force_noise": (1, 0.0, 1.0),
    "material_error": (1, 0.0, 3.0),
    "score_concentration": (1, 0.01, 1e3),
    # Doors that hide a latent.
    "learning_value": (1, 0.0, 1e4),
    "push_fail_time": (1, 0.0, 100.0),
    "push_pass_time": (1, 0.0, 100.0),
    "barrier_count": (1, 1, 20),
    "barrier_pitch": (1, 2.0, 10.0),
    "lock_distance": (1, 1.0, 8.0),
    "lock_opening": (1, 0.3, 2.0),
    "door_spacing": (2, 0.6, 5.0),
    "door_force": (2, 0.5, 1e4),
    "door_force_error": (1, 0.0, 1.0),
    "door_scores": (3, 0.0, 1.0),
    "kind_prior": (1, 0.01, 0.99),
    "kind_reliability": (1, 0.0, 1.0),
    "near_door_force": (2, 0.5, 1e4),
    "near_door_offset": (1, 0.6, 5.0),
    "far_door_force": (2, 0.5, 1e4),
    "far_door_offset": (1, 0.6, 5.0),
    "load_empty": (2, 0.05, 20.0),
    "load_full": (2, 0.05, 20.0),
    "load_levels": (1, 1, 30),
    "bay_count": (1, 2, 8),
    "bay_depth": (1, 0.6, 10.0),
    "bay_width": (1, 0.4, 2.0),
    "day_count": (1, 1, 10),
}
_NAME = re.compile("[A-Za-z][A-Za-z0-9_-]{0,60}")  #: As in a scene.
#: Those of two values that are no range.
PAIRS = frozenset({"workspace"})
#: Those that are whole numbers.
COUNTS = frozenset(
    {"barrier_count", "load_levels", "bay_count", "day_count", "occlusion"}
)
#: The suite of a family that names none.
DEFAULT_SUITE = "paper-v1"


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Family:
    """One scene family; one that was read again is another one.

    Attributes:
        name: Name on the command line, the stem of the file.
        source: The file it was read from.
        layout: Name of the registered layout that places the obstacles.
        numerics: The numbers of its `<custom>` section, by name.
        texts: The texts of its `<custom>` section, by name.
        prototypes: The shapes that occur, with their nominal proportions.
        surfaces: Look and rolling friction of each class, in order of `CLASSES`.
    """

    name: str
    source: Path
    layout: str
    numerics: Mapping[str, tuple[float, ...]]
    texts: Mapping[str, str]
    prototypes: tuple[Prototype, ...]
    surfaces: tuple[Surface, Surface, Surface]

    @property
    def suite(self) -> str:
        """The suite that it belongs to; evaluations run `DEFAULT_SUITE` unasked."""
        return self.texts.get("suite", DEFAULT_SUITE)

    def value(self, name: str, default: float | None = None) -> float:
        """Return the single number `name`, or the default where it has none."""
        if default is not None and name not in self.numerics:
            return default
        return self._numbers(name)[0]

    def whole(self, name: str) -> int:
        """Return the single whole number `name`."""
        return round(self.value(name))

    def text(self, name: str) -> str:
        """Return the text `name`."""
        if name not in self.texts:
            raise TemplateError(
                f'{self.source}: expected <text name="{name}"> for layout '
                f"{self.layout!r} but it has none."
            )
        return self.texts[name]

    def range(self, name: str) -> tuple[float, float]:
        """Return the two ends of the range `name`."""
        low, high = self._numbers(name)
        return low, high

    def shape_range(self, shape: str, name: str) -> tuple[float, float]:
        """Return the range `name`, or the shape's own, such as `sphere_size`."""
        own = f"{shape}_{name}"
        return self.range(own if own in self.numerics else name)

    def _numbers(self, name: str) -> tuple[float, ...]:
        if name not in self.numerics:
            raise TemplateError(
                f'{self.source}: expected <numeric name="{name}"> for layout '
                f"{self.layout!r} but it has none."
            )
        return self.numerics[name]


def family_paths(templates: Path | None = None) -> dict[str, Path]:
    """Return the file of each family by name; those of `templates` win.

    Raises:
        TemplateError: If `templates` is no folder or holds no family.
    """
    paths = {p.stem: p for p in sorted((ROOT / "families").glob("*.xml"))}
    if templates is None:
        return paths
    if not templates.is_dir():
        raise TemplateError(f"{templates}: expected a folder of templates.")
    own = [*sorted(templates.glob("*.xml")), *sorted(templates.glob("families/*.xml"))]
    own = [p for p in own if p.name not in ("arena.xml", "robot.xml")]
    own = [p for p in own if not p.name.startswith(".")]  # Such as AppleDouble's.
    if not own:
        raise TemplateError(
            f"{templates}: expected a family file (*.xml or families/*.xml) "
            "but there is none."
        )
    return paths | {p.stem: p for p in own}


def default_families(templates: Path | None = None) -> list[str]:
    """Return the families of `DEFAULT_SUITE`, which run where none is named.

    Families of the user's own that name no suite are among them.
    """
    names = family_paths(templates)
    return [n for n in names if load_family(n, templates).suite == DEFAULT_SUITE]


def load_family(name: str, templates: Path | None = None) -> Family:
    """Read the family `name`.

    Raises:
        TemplateError: If there is no such family or its file is not a valid one.
    """
    return read_family(_path(name, templates))


def family_sha256(name: str, templates: Path | None = None) -> str:
    """Return the SHA-256 of all files that make up the family `name`.

    Raises:
        TemplateError: If there is no such family or a file cannot be read.
    """
    return template_sha256(_path(name, templates))


def _path(name: str, templates: Path | None) -> Path:
    paths = family_paths(templates)
    if name not in paths:
        raise TemplateError(unknown("family", name, paths))
    return paths[name]


def read_family(path: Path) -> Family:
    """Read and check one family file. Raises TemplateError, naming file and element."""
    if not _NAME.fullmatch(path.stem):
        raise TemplateError(
            f"{path}: expected a family's file to be called by a letter and at most 60 "
            "letters (A to z), digits, - and _, followed by .xml."
        )
    return _read_family(path, template_sha256(path))


@functools.lru_cache(maxsize=64)
def _read_family(path: Path, sha256: str) -> Family:
    """Read one family; one of which any file was edited since is read again."""
    if load_template(path).shipped:
        return compile_family(path)
    try:
        plain = msgspec.json.decode(read_apart(path), type=_Plain)
        prototypes = tuple(_prototype(*p) for p in plain.prototypes)
    except (msgspec.MsgspecError, KeyError, TypeError) as error:
        raise TemplateError(f"{path}: no family: {error}.") from error
    return Family(
        name=path.stem,
        source=path,
        layout=plain.layout,
        numerics=plain.numerics,
        texts=plain.texts,
        prototypes=prototypes,
        surfaces=plain.surfaces,
    )


class _Plain(msgspec.Struct, frozen=True, kw_only=True):
    """What a family is read into, as JSON carries it from one process to another."""

    layout: str
    numerics: dict[str, tuple[float, ...]]
    texts: dict[str, str]
    prototypes: tuple[tuple[str, dict[str, Any]], ...]
    surfaces: tuple[Surface, Surface, Surface]


def to_json(family: Family) -> bytes:
    """Return all that was read from a family's files."""
    plain = _Plain(
        layout=family.layout,
        numerics=dict(family.numerics),
        texts=dict(family.texts),
        prototypes=tuple(
            (p.name, msgspec.to_builtins(p.nominal)) for p in family.prototypes
        ),
        surfaces=family.surfaces,
    )
    return msgspec.json.encode(plain)


_SHAPES = {shape.__struct_config__.tag: shape for shape in get_args(Shape)}


def _prototype(name: str, nominal: dict[str, Any]) -> Prototype:
    """Return a prototype; its size is as it was drawn, and not yet a scene's."""
    fields = {key: _tuples(value) for key, value in nominal.items()}
    shape = _SHAPES[fields.pop("type")]
    return Prototype(name, shape(**fields))


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def compile_family(path: Path) -> Family:
    """Read and compile a family in this process; see `read_family`."""
    mjcf = read_mjcf(path)
    texts = {t.name: t.data for t in mjcf.spec.texts}
    if "layout" not in texts:
        raise TemplateError(f'{path}: expected <text name="layout" data="..."/>.')
    prototypes = read_prototypes(mjcf, path)
    names = {p.name for p in prototypes}
    numerics = {n.name: _checked(n, path, names) for n in mjcf.spec.numerics}
    return Family(
        name=path.stem,
        source=path,
        layout=texts["layout"],
        numerics=numerics,
        texts={name: data for name, data in texts.items() if name},
        prototypes=prototypes,
        surfaces=tuple(_surface(mjcf, c, path) for c in CLASSES),  # type: ignore[arg-type]
    )


def _checked(numeric: object, path: Path, shapes: set[str]) -> tuple[float, ...]:
    """Check one `<numeric>`: known name, right length, within bounds, in order."""
    name: str = numeric.name  # type: ignore[attr-defined]
    values = tuple(float(v) for v in numeric.data)  # type: ignore[attr-defined]
    kind = name
    for suffix in ("size", "height"):
        if name.removesuffix(f"_{suffix}") in shapes:
            kind = suffix
    if kind not in NUMERICS:
        raise TemplateError(f"{path}: {unknown('numeric', name, NUMERICS)}")
    count, low, high = NUMERICS[kind]
    if len(values) != count or not all(low <= v <= high for v in values):
        raise TemplateError(
            f"{path}: expected numeric {name!r} to be {count} value(s) in "
            f"[{low:g}, {high:g}] but it was {values}."
        )
    if name in COUNTS and values[0] != round(values[0]):
        raise TemplateError(
            f"{path}: expected numeric {name!r} to be a whole number but it was "
            f"{values[0]:g}."
        )
    if count == 2 and name not in PAIRS and values[0] > values[1]:
        raise TemplateError(
            f"{path}: expected numeric {name!r} to be a range (low, high) but it was "
            f"{values}."
        )
    if name == "class_mix" and math.fsum(values) <= 0.0:
        raise TemplateError(f"{path}: expected numeric 'class_mix' to have a weight.")
    return values


def _surface(mjcf: Mjcf, name: str, path: Path) -> Surface:
    """Read how the geoms of one interaction class look and roll."""
    default = mjcf.spec.find_default(name)
    if default is None:
        raise element_error(path, f'<default class="{name}">', "one per class")
    _, torsional, rolling = default.geom.friction
    # MuJoCo keeps colors in single precision: their shortest text is what was written.
    red, green, blue, alpha = (float(str(v)) for v in default.geom.rgba)
    return Surface(
        rgba=(red, green, blue, alpha),
        torsional_friction_m=float(torsional),
        rolling_friction_m=float(rolling),
    )
