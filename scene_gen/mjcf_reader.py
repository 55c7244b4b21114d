"""Reading a family file with MuJoCo's `MjSpec`: what it holds is honoured or refused.

MuJoCo checks the grammar. Beyond it, an element that the generator would have no use
for is refused by name, so that nothing that a user wrote is dropped without a word.
"""

import itertools
import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco

from beacon_mj.errors import TemplateError
from beacon_mj.scene_gen.mjcf_files import Origin, Template, load_template
from beacon_mj.scene_gen.own_names import separate_names

#: Elements that a user's files may hold, and below which element.
_ALLOWED = {
    "mujoco": (
        "asset", "compiler", "custom", "default", "statistic", "visual", "worldbody",
    ),
    "asset": ("material", "mesh", "texture"),
    "custom": ("numeric", "text"),
    "default": (
        "default", "geom", "material", "mesh",
        # Without effect: elements that would have them are refused, or are only marks.
        "adhesion", "camera", "cylinder", "damper", "equality", "general",
        "intvelocity", "joint", "light", "motor", "muscle", "pair", "position", "site",
        "tendon", "velocity",
    ),
    "worldbody": ("body",),
    "body": (
        "body", "camera", "frame", "freejoint", "geom", "inertial", "joint", "light",
        "site",
    ),
    "frame": ("body", "camera", "frame", "geom", "light", "site"),
    "camera": (),
    "light": (),
    "site": (),
    "geom": (),
    "mesh": (),
    "numeric": (),
    "text": (),
    "texture": (),
    "freejoint": (),
    "inertial": (),
    "joint": (),
    "compiler": (),
}  # fmt: skip
#: Attributes that would be lost: of which element, and the value that asks for nothing.
_REFUSED = (
    ("compiler", "fusestatic", "false"),
    ("compiler", "strippath", "false"),
    ("body", "mocap", "false"),
    ("body", "gravcomp", "0"),
)
#: What to do about an element that is often there, by parent and tag.
_HINTS = {
    ("worldbody", "geom"): " The room has a floor; an obstacle's geoms are in a body.",
    ("worldbody", "light"): " The room has its light.",
    ("mujoco", "option"): " The physics is the same in every family.",
}
#: Friction of a class that does not give all three numbers.
_FRICTION = "0.5 0.005 0.004"


@dataclass(frozen=True, slots=True)
class Mjcf:
    """A family as MuJoCo understands it.

    Attributes:
        spec: Its elements.
        model: The same, compiled.
        origins: Where each body stands, by name.
    """

    spec: Any
    model: Any
    origins: dict[str, Origin]


def element_error(path: Path, element: str, expected: str) -> TemplateError:
    """Return the error for a missing or unusable element of a template."""
    return TemplateError(f"{path}: expected {element} ({expected}) but found none.")


def read_mjcf(path: Path) -> Mjcf:
    """Read and compile a family file with its includes.

    Raises:
        TemplateError: If a file is missing, leaves the template folder, is no MJCF, or
            holds what a family cannot: the message names file and line.
    """
    template = load_template(path)
    _check_elements(template, template.root)
    _check_angles(template)
    _name_bodies(template)
    separate_names(template)
    _drop_unused(template.root)
    default = ET.Element("default")
    ET.SubElement(default, "geom", friction=_FRICTION)
    template.root.insert(0, default)
    _strip(template.root)
    text = ET.tostring(template.root, encoding="unicode")
    origins = {
        e.get("name", ""): template.origins[e] for e in template.root.iter("body")
    }
    try:
        spec = mujoco.MjSpec.from_string(text, assets=template.assets)
    except ValueError as error:
        raise _named(error, template, "not valid MJCF") from error
    try:
        return Mjcf(spec, spec.compile(), origins)
    except ValueError as error:
        raise _named(error, template, "MuJoCo cannot compile it") from error


def _check_elements(template: Template, parent: ET.Element) -> None:
    """Refuse by name what would have no effect on a scene, or a wrong one."""
    allowed = _ALLOWED.get(parent.tag)
    for element in parent:
        origin = template.origins[element]
        if origin.shipped:
            continue
        if allowed is not None and element.tag not in allowed:
            name = f" {element.get('name')!r}" if element.get("name") else ""
            raise TemplateError(
                f"{origin}: expected no <{element.tag}>{name} in <{parent.tag}> of a "
                f"template but one of: {', '.join(allowed) or 'nothing'}."
                f"{_HINTS.get((parent.tag, element.tag), '')}"
            )
        _check_attributes(element, origin)
        _check_elements(template, element)


def _check_attributes(element: ET.Element, origin: Origin) -> None:
    for tag, name, harmless in _REFUSED:
        value = element.get(name, harmless)
        if element.tag == tag and value.strip() != harmless:
            raise TemplateError(
                f'{origin}: expected no {name}="{value}" in a template.'
            )


def _check_angles(template: Template) -> None:
    """Refuse an obstacle that alone would be read in other angles than in its family.

    MuJoCo takes one unit for a whole model, the last that any of its files names.
    """
    whole = _angles(e for e in template.root.iter("compiler"))
    own: dict[Path, list[ET.Element]] = {}
    for element in template.root.iter():
        if (origin := template.origins.get(element)) is not None:
            own.setdefault(origin.model, []).append(element)
    for model, elements in own.items():
        alone = _angles(e for e in elements if e.tag == "compiler")
        turned = [e for e in elements if "euler" in e.attrib or "axisangle" in e.attrib]
        if model == template.path or not turned or template.origins[turned[0]].shipped:
            continue
        if alone != whole:
            raise TemplateError(
                f"{template.origins[turned[0]]}: expected {model.name} to say "
                f'<compiler angle="{whole[0]}" eulerseq="{whole[1]}"/>, as its family '
                f"does, but alone it is read in {alone[0]}s and {alone[1]!r}."
            )


def _name_bodies(template: Template) -> None:
    """Call obstacles without a name what their file is called."""
    taken = {body.get("name") for body in template.root.iter("body")}
    for body in template.root.iterfind("worldbody/body"):
        origin = template.origins[body]
        if not body.get("name") and origin.path != template.path:
            stem = origin.path.stem
            names = (f"{stem}_{k}" if k > 1 else stem for k in itertools.count(1))
            taken.add(name := next(n for n in names if n not in taken))
            body.set("name", name)


def _drop_unused(root: ET.Element) -> None:
    """Remove what no scene has and what may cost much, or stop MuJoCo.

    Pictures take memory, and are read by C code that a stranger's file would meet. With
    `inertiagrouprange` one obstacle says for all which geoms weigh anything.
    """
    for parent in root.iter():
        for child in [e for e in parent if e.tag in ("texture", "layer")]:
            parent.remove(child)
        if parent.tag == "material":
            parent.attrib.pop("texture", None)
        if parent.tag == "compiler":
            parent.attrib.pop("inertiagrouprange", None)


def _angles(compilers: Any) -> tuple[str, str]:
    """Return the unit of angles, and the sequence of Euler angles."""
    angle, sequence = "degree", "xyz"
    for element in compilers:
        angle = element.get("angle", angle)
        sequence = element.get("eulerseq", sequence)
    return angle, sequence


def _strip(root: ET.Element) -> None:
    """Put every element on a line of its own, in document order."""
    for element in root.iter():
        element.text = element.tail = None
    ET.indent(root, space="")


def _named(error: ValueError, template: Template, what: str) -> TemplateError:
    """Return MuJoCo's complaint in one line that names the file it is about."""
    text = ET.tostring(template.root, encoding="unicode")
    starts = [
        number
        for number, line in enumerate(text.splitlines(), 1)
        if not line.startswith("</")
    ]
    elements = dict(zip(starts, template.root.iter(), strict=True))
    message = " ".join(str(error).split())
    found = re.search(r",? ?line (\d+)", message)
    element = elements.get(int(found[1])) if found else None
    origin = None if element is None else template.origins.get(element)
    if found is None or origin is None:
        return TemplateError(f"{template.path}: {what}: {message}")
    message = message.replace(found[0], f", line {origin.line}")
    return TemplateError(f"{origin.path}: {what}: {message}")
