"""The digest of the source holds all that decides a row."""

import ast
from collections.abc import Iterator
from pathlib import Path

import beacon_mj
from beacon_mj.eval.runs.versions import DECISIVE

ROOT = Path(beacon_mj.__file__).parent


def imported(folder: Path) -> Iterator[str]:
    """Yield the package's modules that the files below a folder import."""
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module:
                yield node.module
            elif isinstance(node, ast.Import):
                yield from (each.name for each in node.names)


def test_what_decides_a_row_imports_nothing_that_the_digest_leaves_out() -> None:
    """Modules beside the folders are in it, so only folders can be forgotten."""
    names = {name for folder in DECISIVE for name in imported(ROOT / folder)}
    paths = {"/".join(n.split(".")[1:]) for n in names if n.startswith("beacon_mj.")}
    left_out = {
        path
        for path in paths
        if "/" in path or (ROOT / path).is_dir()
        if not any(f"{path}/".startswith(f"{folder}/") for folder in DECISIVE)
    }
    assert left_out == set()


def test_data_that_decides_is_of_the_kinds_that_the_digest_reads() -> None:
    kinds = {
        path.suffix
        for folder in DECISIVE
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert kinds <= {".npz", ".py", ".xml"}
