"""The elements of a robot's file: what may stand there, and what must.

A robot is put into the room of every scene. What would change the room or the physics
is refused by name, and so is every file that a robot could refer to: its text is all
that it is.
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator

from beacon_mj.constants import CLASSES

#: Elements that a robot's file may hold, below which element.
_ALLOWED = {
    "mujoco": ("compiler", "default", "worldbody", "contact", "actuator"),
    "compiler": (),
    "worldbody": ("body", "geom"),
    "body": ("body", "joint", "geom", "site", "inertial"),
    "contact": ("pair",),
    "actuator": ("velocity",),
    "joint": (),
    "geom": (),
    "site": (),
    "inertial": (),
    "pair": (),
    "velocity": (),
}
_IN_CLASS = ("default", "joint", "geom", "site", "pair", "velocity")
#: Attributes that would reach beyond the robot, or be lost.
_REFUSED = ("mesh", "hfield", "material", "file", "mocap", "gravcomp", "childclass")
_SHAPES = ("sphere", "capsule", "ellipsoid", "cylinder", "box")
#: What the contract names, by the element that has the name.
NAMES = (
    ("body", "base"),
    ("joint", "base_x"),
    ("joint", "base_y"),
    ("joint", "base_yaw"),
    ("site", "footprint"),
    ("body", "bumper"),
    ("joint", "bumper_x"),
    ("joint", "bumper_y"),
    ("geom", "bumper"),
    ("joint", "wheel_left"),
    ("joint", "wheel_right"),
    ("geom", "wheel_left"),
    ("geom", "wheel_right"),
    ("velocity", "drive_left"),
    ("velocity", "drive_right"),
)
_OPTION = " The physics is the same for every robot."


def element_faults(root: ET.Element) -> Iterator[str]:
    """Yield a line for each element that may not be there, or is missing."""
    if root.tag != "mujoco":
        yield f"expected <mujoco> as the outermost element but it is <{root.tag}>"
        return
    yield from _unfit(root)
    yield from _compiler(root)
    yield from _world(root)
    for tag, name in NAMES:
        if root.find(f"worldbody//{tag}[@name='{name}']") is None:
            if root.find(f"actuator/{tag}[@name='{name}']") is None:
                yield f'expected <{tag} name="{name}"> but there is none'
    for side in ("left", "right"):
        if find_pair(root, f"wheel_{side}") is None:
            yield (
                f'expected <pair geom1="floor" geom2="wheel_{side}"> in <contact>, the '
                "tyre on the floor, but there is none"
            )


def find_pair(root: ET.Element, wheel: str) -> ET.Element | None:
    """Return the contact pair of a wheel's geom with the floor."""
    for pair in root.iterfind("contact/pair"):
        if {pair.get("geom1"), pair.get("geom2")} == {"floor", wheel}:
            return pair
    return None


def _unfit(parent: ET.Element) -> Iterator[str]:
    allowed = _IN_CLASS if parent.tag == "default" else _ALLOWED.get(parent.tag, ())
    for element in parent:
        if element.tag not in allowed:
            yield (
                f"expected no <{element.tag}> in <{parent.tag}> of a robot but one of: "
                f"{', '.join(allowed) or 'nothing'}."
                f"{_OPTION if element.tag == 'option' else ''}"
            )
            continue
        yield from _attributes(element)
        yield from _unfit(element)


def _attributes(element: ET.Element) -> Iterator[str]:
    what = f'<{element.tag} name="{element.get("name", "")}">'
    for name in _REFUSED:
        if name in element.attrib:
            yield f"expected no {name}= in a robot but {what} has one"
    shape = element.get("type", "sphere")
    floor = element.get("name") == "floor"
    if element.tag == "geom" and shape not in _SHAPES and not floor:
        yield f"expected {what} to be one of {', '.join(_SHAPES)} but it is a {shape}"


def _compiler(root: ET.Element) -> Iterator[str]:
    """Angles are the room's: MuJoCo reads a whole world in one unit."""
    found: dict[str, str] = {}
    for element in root.iterfind("compiler"):
        found |= element.attrib
    if found.get("angle") != "radian":
        yield 'expected <compiler angle="radian"/>, as in the room, but there is none'
    for name in found.keys() - {"angle", "autolimits"}:
        yield f"expected no {name}= in <compiler> of a robot"


def _world(root: ET.Element) -> Iterator[str]:
    """The world has the base, and may have a floor that stands for the room's."""
    bodies = [b.get("name", "") for b in root.iterfind("worldbody/body")]
    if bodies != ["base"]:
        yield (
            "expected one body in the world, 'base', but there are: "
            f"{', '.join(bodies) or 'none'}"
        )
    if any(b.get("pos", "0 0 0") != "0 0 0" for b in root.iterfind("worldbody/body")):
        yield "expected body 'base' at the origin of the world, pos=\"0 0 0\""
    for geom in root.iterfind("worldbody/geom"):
        if (geom.get("name"), geom.get("type")) != ("floor", "plane"):
            yield (
                "expected no geom in the world but a plane 'floor', which stands for "
                f"the room's, but there is {geom.get('name')!r}"
            )
    reserved = {"wall", *CLASSES}
    for default in root.iterfind("default//default"):
        name = default.get("class", "")
        if name in reserved or not re.fullmatch("[A-Za-z][A-Za-z0-9_-]*", name):
            yield f"expected a class of its own for defaults but it is {name!r}"
    for default in root.iterfind("default"):
        if default.get("class") or any(e.tag != "default" for e in default):
            yield (
                "expected nothing but named classes in <default>: others would hold "
                "for the whole room"
            )
