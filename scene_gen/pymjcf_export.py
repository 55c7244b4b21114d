"""Obstacles written with PyMJCF: saved as a file that a family includes.

PyMJCF is dm-control's way to write models in Python. It is not imported here: a model
that was made with it knows how to write itself.
"""

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

from beacon_mj.errors import TemplateError
from beacon_mj.files import replacing

_NAMES = ("name", "class", "childclass", "mesh", "material", "texture")


def save_obstacle(model: Any, templates: Path) -> Path:
    """Write a PyMJCF model as an obstacle of a template folder.

    Its body keeps its name. Other names get the model's name in front, so that several
    obstacles fit into one family; sites, where PyMJCF attaches models, are left out.

    Args:
        model: A `dm_control.mjcf.RootElement` with one body in its world.
        templates: The template folder; `obstacles/` in it is made if need be.

    Returns:
        The file, to be included as `obstacles/NAME.xml` by a family in the folder or as
        `../obstacles/NAME.xml` by one in its folder `families`.

    Raises:
        TemplateError: If the model has no usable name, or not one named body, or the
            folder cannot be written.
    """
    name = str(getattr(model, "model", "") or "")
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name):
        raise TemplateError(
            "Expected a PyMJCF model whose name (`model=`) is letters, digits, - and _ "
            f"but it was {name!r}."
        )
    root = ET.fromstring(model.to_xml_string())
    bodies = root.findall("worldbody/body")
    if len(bodies) != 1 or not bodies[0].get("name"):
        raise TemplateError(
            f"Expected model {name!r} to have one named body in its world but it has "
            f"{[b.get('name') for b in bodies]}."
        )
    _drop_sites(root)
    for element in root.iter():
        for key in _NAMES:
            if key in element.attrib and element is not bodies[0]:
                element.set(key, f"{name}-{element.attrib[key]}")
    files = {f"{name}.xml": ET.tostring(root, encoding="utf-8") + b"\n"}
    return _write(files | _assets(model), templates / "obstacles", name)


def _drop_sites(root: ET.Element) -> None:
    for parent in list(root.iter()):
        for site in parent.findall("site"):
            parent.remove(site)


def _assets(model: Any) -> dict[str, bytes]:
    """Return the content of the model's files, as its XML names them."""
    return {key: bytes(content) for key, content in model.get_assets().items()}


def _write(files: dict[str, bytes], folder: Path, name: str) -> Path:
    for key, content in files.items():
        with replacing(folder / key, TemplateError) as part:
            part.write_bytes(content)
    return folder / f"{name}.xml"
