"""Which files a Python file is made of: itself, and the modules beside it.

The source is read, never run, so that a record of it can be made and compared in a
folder that nobody trusts yet.
"""

import ast
import sys
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from pathlib import Path

MAX_FILES = 1000  #: Modules that are followed from one file.
_IMPORTERS = ("import_module", "__import__")


def local_sources(
    file: Path, folder: Path | None = None, package: str | None = None
) -> dict[str, bytes]:
    """Return the content of a Python file and of the local modules that it imports.

    Local is what lies in `folder` or below. Imports are followed wherever they stand
    in the source, absolute or relative, also `importlib.import_module("name")` of a
    plain text. A name that is put together at run time is not found.

    Args:
        file: The Python file.
        folder: Where the names of imported modules begin; by default the file's own.
        package: The only package of that folder whose modules count; None for all.

    Returns:
        Content by path below `folder`, in the order of the paths.

    Raises:
        OSError: If a file cannot be read.
    """
    root = file.parent if folder is None else folder
    found: dict[Path, bytes] = {}
    waiting = [file]
    while waiting and len(found) < MAX_FILES:
        path = waiting.pop()
        if path not in found:
            found[path] = path.read_bytes()
            waiting += _imported(found[path], path, root, package)
    names = {path.relative_to(root).as_posix(): data for path, data in found.items()}
    return dict(sorted(names.items()))


def digests(sources: Mapping[str, bytes]) -> dict[str, str]:
    """Return the SHA-256 of each content."""
    return {name: sha256(data).hexdigest() for name, data in sources.items()}


def first_change(before: Mapping[str, str], now: Mapping[str, str]) -> str | None:
    """Say which file differs between two records of digests, or return None."""
    for name in dict.fromkeys([*before, *now]):
        if name not in now:
            return f"{name} is not there any more"
        if name not in before:
            return f"{name} is new"
        if before[name] != now[name]:
            return f"{name} is another file"
    return None


def _imported(
    source: bytes, path: Path, root: Path, package: str | None
) -> Iterator[Path]:
    """Yield the files below `root` that a source imports."""
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return  # Who imports it will say so.
    for node in ast.walk(tree):
        for base, name in _names(node, path, root):
            parts = name.split(".")
            if package in (None, parts[0]) or base != root:
                yield from _files(base, parts)


def _names(node: ast.AST, path: Path, root: Path) -> Iterator[tuple[Path, str]]:
    """Yield the modules that a statement may import, and where their names begin."""
    if isinstance(node, ast.Import):
        yield from _absolute((alias.name for alias in node.names), root)
    elif isinstance(node, ast.Call):
        yield from _absolute(_by_text(node), root)
    elif isinstance(node, ast.ImportFrom):
        names = [f"{node.module or ''}.{a.name}".strip(".") for a in node.names]
        if not node.level:
            yield from _absolute(names, root)
        elif (base := _above(path, node.level, root)) is not None:
            yield from ((base, name) for name in names)


def _absolute(names: Iterable[str], root: Path) -> Iterator[tuple[Path, str]]:
    """Yield what may be local: nothing of the standard library is hidden."""
    for name in names:
        if name.partition(".")[0] not in sys.stdlib_module_names:
            yield root, name


def _by_text(call: ast.Call) -> Iterator[str]:
    function = call.func
    name = getattr(function, "attr", None) or getattr(function, "id", None)
    first = call.args[0] if call.args else None
    if name in _IMPORTERS and isinstance(first, ast.Constant):
        if isinstance(first.value, str):
            yield first.value.lstrip(".")


def _above(path: Path, level: int, root: Path) -> Path | None:
    """Return the folder in which a relative name begins; None outside of `root`."""
    base = path.parent
    for _ in range(level - 1):
        base = base.parent
    return base if base.is_relative_to(root) else None


def _files(base: Path, parts: list[str]) -> Iterator[Path]:
    """Yield the files that are executed to import `parts`, as far as they exist."""
    for part in parts:
        module, package = base / f"{part}.py", base / part / "__init__.py"
        if package.is_file():
            yield package
        elif module.is_file():
            yield module
            return
        base = base / part
