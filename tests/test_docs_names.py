"""Every name of ours that the documentation sets as code exists, where it says."""

import ast
import builtins
import functools
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from beacon_mj.recording.schemas import BEACON
from beacon_mj.scene_gen.suites import RELEASED
from tests.repository import REPOSITORY

PAGES = [*sorted((REPOSITORY / "docs").glob("*.md")), REPOSITORY / "README.md"]
FOLDERS = ("beacon_mj", "eval", "planners", "scene_gen", "mjcf_templates")
#: Files that the reader writes, or that a run writes under a number.
READERS = re.compile(r"(mine|file|layouts|lazy|nudge|study)\.py|scene_\d+\.(json|xml)")
#: Words of Python, and of other programs.
FOREIGN = {*dir(builtins), "exp", "use_sim_time", "SandyBridge", "SkylakeX"} | {
    "AsyncVectorEnv", "SyncVectorEnv", "check_env",
}  # fmt: skip
#: Names that are no modules: groups of entry points.
GROUPS = {"beacon_mj.layouts"}
#: Ids of environments, and how they are made.
ENVIRONMENTS = {
    f"beacon_mj/{family}-v{suite.rpartition('-v')[2]}"
    for suite, families in RELEASED.items()
    for family in families
} | {"beacon_mj/FAMILY-vN"}

NAME = r"[A-Za-z_]\w*"
DOTTED = re.compile(rf"beacon_mj(\.{NAME})+(?=$|\()")
PATH = re.compile(r"[\w.-]+(/[\w.-]+)*/?")
FILE = re.compile(r"[\w-]+\.(py|xml|json|jsonl|parquet|md|toml)")
CALL = re.compile(rf"(?:{NAME}\.)*({NAME})\(")
MEMBER = re.compile(rf"({NAME})\.({NAME})")
WORD = re.compile(r"[a-z]\w*_\w+|[A-Z][a-z]+\w*[A-Z]\w*")


def names_in(page: Path) -> Iterator[str]:
    """Yield what stands between single backticks, outside blocks of code."""
    prose = re.sub(r"^ *```.*?^ *```", "", page.read_text(), flags=re.M | re.S)
    yield from re.findall(r"(?<!`)`([^`\n]+)`(?!`)", prose)


@functools.cache
def files() -> frozenset[Path]:
    found = {p for folder in FOLDERS for p in (REPOSITORY / folder).rglob("*.*")}
    return frozenset(p for p in found if "__pycache__" not in p.parts)


@functools.cache
def words() -> frozenset[str]:
    """Return the words of sources and templates; a prefix of an f-string too."""
    texts = [p.read_text() for p in files() if p.suffix in (".py", ".xml")]
    return frozenset(re.findall(r"\w+(?:\.\w+)*|\w+", " ".join(texts))) | frozenset(
        re.findall(r"\w+", " ".join(texts))
    )


@functools.cache
def definitions() -> tuple[frozenset[str], dict[str, frozenset[str]]]:
    """Return the functions and classes of the sources, and each class's members."""
    callables: set[str] = set()
    members: dict[str, frozenset[str]] = {}
    for path in files():
        for node in (
            ast.walk(ast.parse(path.read_text())) if path.suffix == ".py" else ()
        ):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                callables.add(node.name)
            if isinstance(node, ast.ClassDef):
                targets = [s.target for s in node.body if isinstance(s, ast.AnnAssign)]
                own = {t.id for t in targets if isinstance(t, ast.Name)}
                own |= {s.name for s in node.body if isinstance(s, ast.FunctionDef)}
                members[node.name] = frozenset(own) | members.get(
                    node.name, frozenset()
                )
    return frozenset(callables), members


def missing(name: str) -> str | None:
    """Return what is not there of a name, or None."""
    callables, members = definitions()
    if name in GROUPS | ENVIRONMENTS:
        return None
    if dotted := DOTTED.match(name):
        if dotted.group().removeprefix("beacon_mj.") not in BEACON:
            try:
                pkgutil.resolve_name(dotted.group())
            except (ImportError, AttributeError) as error:
                return str(error)
        return None
    if PATH.fullmatch(name) and name.split("/")[0] in (
        *FOLDERS,
        "tests",
        "docs",
        ".ci",
    ):
        there = (REPOSITORY / name).exists() or "/" not in name
        return None if there else "no such file"
    if FILE.fullmatch(name):
        there = name in {p.name for p in files()} | words() | {"pyproject.toml"}
        return None if there or READERS.fullmatch(name) else "no such file"
    if call := CALL.match(name):
        there = call[1] in callables | FOREIGN
        return None if there else f"no function {call[1]}"
    if (member := MEMBER.fullmatch(name)) and member[1] in members:
        there = member[2] in members[member[1]]
        return None if there else f"{member[1]} has no {member[2]}"
    if WORD.fullmatch(name) and name not in words() | FOREIGN:
        return "stands nowhere in the sources"
    return None


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_name_of_ours_exists(page: Path) -> None:
    wrong = {name: why for name in names_in(page) if (why := missing(name))}
    assert not wrong


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_import_of_ours_works(page: Path) -> None:
    for module, names in re.findall(
        r"^from (beacon_mj[\w.]*) import (\([^)]*\)|[^\n]*)", page.read_text(), re.M
    ):
        for name in re.findall(NAME, names):
            pkgutil.resolve_name(f"{module}:{name}")


def test_every_path_in_a_docstring_exists() -> None:
    wrong = {}
    for path in files():
        if path.suffix == ".py":
            for name in re.findall(r"(?<!`)`([\w./]+)`(?!`)", path.read_text()):
                if "." in name and (why := missing(name)):
                    wrong[f"{path.name}: {name}"] = why
    assert not wrong


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("beacon_mj.scene.files.scene_schema()", None),
        ("beacon_mj.scene.scene_schema()", "no attribute"),
        ("beacon_mj.sensing", "sensing"),
        ("beacon_mj.Push", None),
        ("planners/contact/limits.py", None),
        ("planners/push_guard.py", "no such file"),
        ("push_guard.py", "no such file"),
        ("episodes.parquet", None),
        ("reset(task)", None),
        ("rewind(task)", "no function"),
        ("World.step", None),
        ("World.leap", "has no leap"),
        ("obstacles_broken", None),
        ("obstacles_shattered", "nowhere"),
        ("PushController", None),
        ("PushPilot", "nowhere"),
        ("runs/table", None),
    ],
)
def test_the_rule_finds_what_is_wrong(name: str, why: str | None) -> None:
    found = missing(name)
    assert found is None if why is None else found is not None and why in found
