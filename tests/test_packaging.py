"""What is installed: packages, data, import time, and which way the arrows point."""

import shutil
import subprocess
import sys
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

from tests.repository import REPOSITORY

LINKED = ("eval", "mjcf_templates", "planners", "scene_gen")


def pyproject() -> dict[str, object]:
    return tomllib.loads((REPOSITORY / "pyproject.toml").read_text())


def test_listed_packages_are_those_of_the_tree() -> None:
    listed = pyproject()["tool"]["setuptools"]["packages"]  # type: ignore[index]
    found = {"beacon_mj"}
    for top in ("beacon_mj", *LINKED):
        for init in (REPOSITORY / top).rglob("__init__.py"):
            parts = init.parent.relative_to(REPOSITORY).parts
            found.add(".".join(parts if top == "beacon_mj" else ("beacon_mj", *parts)))
    assert sorted(listed) == sorted(found)


@pytest.mark.parametrize("name", LINKED)
def test_links_are_relative(name: str) -> None:
    link = REPOSITORY / "beacon_mj" / name
    assert link.is_symlink()
    assert link.readlink() == Path("..") / name


def test_constraints_match_the_lock_file() -> None:
    lock = tomllib.loads((REPOSITORY / "uv.lock").read_text())
    locked = {(p["name"], p.get("version")) for p in lock["package"]}
    pins = [
        line.split(" ;")[0].strip().split("==")
        for line in (REPOSITORY / "constraints.txt").read_text().splitlines()
    ]
    assert len(pins) > 20
    assert {(name, version) for name, version in pins} <= locked


def test_import_contracts_hold() -> None:
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command"
               " as c; c(standalone_mode=True)"]  # fmt: skip
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True)
    assert "0 broken" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("name", ["beacon", "semantic", "dstar_lite", "bug1", "bug2"])
def test_a_planner_loads_without_the_simulator(name: str) -> None:
    """The truth is out of reach: not even the engine gets imported."""
    code = (
        f"import sys, beacon_mj.planners.{name}\n"
        "bad = {'mujoco', 'dm_control', 'beacon_mj.world', 'beacon_mj.scene',"
        " 'beacon_mj.scene_gen', 'beacon_mj.eval'} & set(sys.modules)\n"
        "sys.exit(f'imported {bad}' if bad else 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True
    )
    assert done.returncode == 0, done.stderr


def _left_out(folder: str, names: list[str]) -> set[str]:
    """Return what is no source; `runs` holds results at the top, code in `eval`."""
    made = {"build", "dist", "runs", "scenes"} if Path(folder) == REPOSITORY else set()
    return {
        n
        for n in names
        if n.startswith(".") or n.endswith((".egg-info", "__pycache__")) or n in made
    }


def copy_of_the_checkout(folder: Path) -> Path:
    """Return a copy, since building leaves a folder behind in the source."""
    shutil.copytree(REPOSITORY, folder, symlinks=True, ignore=_left_out)
    return folder


@pytest.mark.slow
def test_type_checkers_can_follow_an_editable_install(tmp_path: Path) -> None:
    """It is a line with a path, no import hook, and leads to every package."""
    source = copy_of_the_checkout(tmp_path / "source")
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    subprocess.run(
        [python, "-m", "pip", "install", "-q", "--no-deps", "-e", source], check=True
    )
    (pth,) = (tmp_path / "venv").rglob("__editable__*.pth")
    root = Path(pth.read_text().strip())
    assert root.samefile(source)
    listed = pyproject()["tool"]["setuptools"]["packages"]  # type: ignore[index]
    assert all((root.joinpath(*p.split(".")) / "__init__.py").is_file() for p in listed)


@pytest.mark.slow
def test_wheel_works_on_its_own(tmp_path: Path) -> None:
    """Build the wheel, install it without this checkout, and find the templates."""
    source = copy_of_the_checkout(tmp_path / "source")
    subprocess.run(
        [sys.executable, "-m", "build", "-q", "--wheel", "-o", tmp_path, source],
        check=True,
    )
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    top = {n.split("/")[0] for n in names if ".dist-info" not in n}
    assert top == {"beacon_mj"}
    assert "beacon_mj/py.typed" in names
    assert "beacon_mj/mjcf_templates/families/cluttered.xml" in names
    assert "beacon_mj/eval/report/templates/report.html.j2" in names
    assert "beacon_mj/recording/layout_files/foxglove.json" in names
    venv.create(tmp_path / "venv", with_pip=True, system_site_packages=False)
    python = tmp_path / "venv" / "bin" / "python"
    subprocess.run(
        [python, "-m", "pip", "install", "-q", "--no-deps", wheel], check=True
    )
    code = (
        "from beacon_mj.mjcf_templates import ROOT\n"
        "import beacon_mj.planners, sys\n"
        "assert 'venv' in str(ROOT), ROOT\n"
        "print(len(list(ROOT.rglob('*.xml'))))"
    )
    done = subprocess.run(
        [python, "-I", "-c", code],
        cwd=tmp_path, check=True, capture_output=True, text=True,
    )  # fmt: skip
    assert int(done.stdout) == len(list((REPOSITORY / "mjcf_templates").rglob("*.xml")))
