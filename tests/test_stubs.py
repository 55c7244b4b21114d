"""The typed names of `stubs/mujoco` are those of the installed package."""

import ast
import importlib
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest

from tests.repository import REPOSITORY

STUBS = REPOSITORY / "stubs"
#: Names that only the stubs have, to say the same thing once.
OUR_OWN = {"_Enum", "_Floats", "_Integers", "_Singles", "_Text"}
PAGES = sorted((STUBS / "mujoco").glob("*.pyi"))


def _defined(body: list[ast.stmt]) -> Iterator[tuple[str, list[ast.stmt]]]:
    """Yield the names that a stub's block defines, and what is in them."""
    for node in body:
        if isinstance(node, ast.ClassDef):
            yield node.name, node.body
        elif isinstance(node, ast.FunctionDef):
            yield node.name, []
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            yield node.target.id, []
        elif isinstance(node, ast.ImportFrom):
            yield from ((a.asname, []) for a in node.names if a.asname is not None)


def _missing(thing: object, body: list[ast.stmt], path: str) -> list[str]:
    """Return the paths of names that a stub has and `thing` has not."""
    out = []
    for name, inner in _defined(body):
        here = f"{path}.{name}"
        if hasattr(thing, name):
            out += _missing(getattr(thing, name), inner, here)
        elif name not in OUR_OWN:
            out.append(here)
    return out


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_every_name_of_a_stub_exists(page: Path) -> None:
    name = "mujoco" if page.stem == "__init__" else f"mujoco.{page.stem}"
    body = ast.parse(page.read_text()).body
    assert list(_defined(body))
    assert _missing(importlib.import_module(name), body, name) == []


def test_a_name_that_does_not_exist_is_found() -> None:
    body = ast.parse("class MjModel:\n    nbody: int\n    nonsense: int\n").body
    assert _missing(mujoco, body, "mujoco") == ["mujoco.MjModel.nonsense"]


def _arrays(page_name: str, class_name: str) -> dict[str, str]:
    """Return the fields of a stub's class that are arrays, by name."""
    body = ast.parse((STUBS / "mujoco" / page_name).read_text()).body
    inner = dict(_defined(body))[class_name]
    return {
        node.target.id: ast.unparse(node.annotation)
        for node in inner
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)
    }


def test_types_of_the_fields_are_true() -> None:
    """Numbers and arrays of a compiled model have the types that the stub says."""
    types = {"_Floats": np.float64, "_Singles": np.float32, "_Integers": np.int32}
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody>"
        "</mujoco>"
    )
    data = mujoco.MjData(model)
    for thing, name in ((model, "MjModel"), (data, "MjData"), (model.opt, "MjOption")):
        fields = _arrays("_structs.pyi", name)
        assert len(fields) >= 4
        for field, said in fields.items():
            value = getattr(thing, field)
            if said in types:
                assert value.dtype == types[said], field
            elif said in ("int", "float"):
                assert type(value).__name__ == said, field
