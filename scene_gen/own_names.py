"""Names within an obstacle are its own: two obstacles may each have a mesh `body`.

MuJoCo knows one space of names for a whole family. Each obstacle file is a model of its
own, so a name that another one took before gets a number. The names of the obstacles
themselves, the bodies in the world, have to differ.
"""

import itertools
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from pathlib import Path

from beacon_mj.scene_gen.mjcf_files import Template

#: What each attribute refers to.
_REFERENCES = {
    "mesh": "mesh",
    "material": "material",
    "texture": "texture",
    "class": "default",
    "childclass": "default",
}
_NAMED = (
    "mesh", "material", "texture", "body", "frame", "geom", "site", "camera", "light",
    "joint", "freejoint",
)  # fmt: skip
Names = Mapping[tuple[str, str], str]


def separate_names(template: Template) -> None:
    """Give each obstacle's inner names a number where another model has them too."""
    models: dict[Path, list[ET.Element]] = {}
    for element in template.root.iter():
        if (origin := template.origins.get(element)) is not None:
            models.setdefault(origin.model, []).append(element)
    outer = set(template.root.iterfind("worldbody/body"))
    family = models.pop(template.path, [])
    taken = {*map(_defined, family), *map(_defined, outer)}
    for elements in models.values():
        inner = [e for e in elements if e not in outer]
        own = {key for e in inner if (key := _defined(e)) is not None}
        _rename(elements, outer, {key: _free(key, taken | own) for key in own & taken})
        taken |= {_defined(e) for e in inner}


def _space(tag: str) -> str:
    return "joint" if tag == "freejoint" else tag


def _defined(element: ET.Element) -> tuple[str, str] | None:
    """Return the kind and the name of what an element defines."""
    if element.tag == "default":
        name = element.get("class")
    else:
        name = element.get("name") if element.tag in _NAMED else None
    return None if name in (None, "main") else (_space(element.tag), str(name))


def _free(key: tuple[str, str], taken: Iterable[tuple[str, str] | None]) -> str:
    kind, name = key
    names = (f"{name}_{k}" for k in itertools.count(2))
    return next(n for n in names if (kind, n) not in taken)


def _rename(elements: list[ET.Element], outer: set[ET.Element], new: Names) -> None:
    for element in elements:
        if "name" in element.attrib and element not in outer:
            key = _space(element.tag), element.attrib["name"]
            element.set("name", new.get(key, key[1]))
        for attribute, kind in _REFERENCES.items():
            if attribute in element.attrib:
                value = element.attrib[attribute]
                element.set(attribute, new.get((kind, value), value))
