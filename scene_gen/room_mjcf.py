"""The shipped room as MJCF, with a robot put into it."""

import functools
import xml.etree.ElementTree as ET
from collections.abc import Iterable

from beacon_mj.mjcf_templates import ROOT

_SECTIONS = ("default", "worldbody", "contact", "actuator")


def room_with(robot: ET.Element) -> ET.Element:
    """Return the room with a robot in it, as the root of a new MJCF model.

    Args:
        robot: Root of the robot's file; its floor stands for the room's and is left
            out.
    """
    root = ET.fromstring(_arena())
    for section in _SECTIONS:
        source = robot.find(section)
        if source is None:
            continue
        target = root.find(section)
        if target is None:
            target = ET.SubElement(root, section)
        target.extend(e for e in source if e.get("name") != "floor")
    return root


def child(parent: ET.Element, tag: str) -> ET.Element:
    """Return the first element of a tag, which is there."""
    found = parent.find(tag)
    assert found is not None, f"template without <{tag}>"
    return found


def named(root: ET.Element, tag: str, name: str) -> ET.Element:
    """Return the element of a tag and a name, which is there."""
    found = root.find(f".//{tag}[@name='{name}']")
    assert found is not None, f"template without {tag} {name!r}"
    return found


def numbers(values: Iterable[float]) -> str:
    """Write numbers so that reading them gives the same bits."""
    return " ".join(repr(float(v)) for v in values)


@functools.cache
def _arena() -> str:
    return (ROOT / "arena.xml").read_text(encoding="utf-8")
