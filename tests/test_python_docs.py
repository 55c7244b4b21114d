"""docs/python.md alone: every program runs, in order, in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import beacon_mj
from tests.pages import blocks
from tests.repository import REPOSITORY

PAGE = (REPOSITORY / "docs" / "python.md").read_text()
PROGRAMS = blocks(PAGE, "python")


def run(path: Path) -> str:
    done = subprocess.run(
        [sys.executable, path.name],
        cwd=path.parent, env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, f"{path.name}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """Return the folder, and what each program printed."""
    folder = tmp_path_factory.mktemp("reader")
    names = ["study.py", *(f"program{k}.py" for k in range(1, len(PROGRAMS)))]
    printed = []
    for name, text in zip(names, PROGRAMS, strict=True):
        (folder / name).write_text(text)
        printed.append(run(folder / name))
    return folder, printed


def test_the_page_has_its_programs(outputs: tuple[Path, list[str]]) -> None:
    _, printed = outputs
    assert len(printed) == 5
    assert "workers=2" in PROGRAMS[0]


def test_an_own_planner_runs_in_two_workers(outputs: tuple[Path, list[str]]) -> None:
    folder, printed = outputs
    assert "Straight" in printed[0]
    results = beacon_mj.load_results(folder / "runs" / "study")
    assert [*results.planners] == ["dstar-lite", "Straight"]
    assert len(results) == 4
    assert all(row.outcome != "planner_error" for row in results.episodes)
    assert all(row.path_length_m > 0.5 for row in results.planners["Straight"])


def test_a_figure_comes_from_the_rows(outputs: tuple[Path, list[str]]) -> None:
    folder, _ = outputs
    assert (folder / "energy.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "energy.png").stat().st_size > 5000


def test_settings_are_columns(outputs: tuple[Path, list[str]]) -> None:
    folder, printed = outputs
    assert "set.protocol.max_steps" in printed[3]
    rows = beacon_mj.load_results(folder / "runs" / "speeds").rows
    assert rows["set.push-through.speed_share"].to_list() == [0.5, 0.5, 1.0, 1.0]
    assert sorted(rows["set.protocol.max_steps"].to_list()) == [100, 100, 400, 400]


def test_a_run_is_compared_and_verified(outputs: tuple[Path, list[str]]) -> None:
    folder, printed = outputs
    assert "Straight against dstar-lite" in printed[4]
    assert "\nTrue " in printed[4]
    assert (folder / "panel.svg").read_text().startswith("<svg")


@pytest.mark.parametrize("name", sorted(set(beacon_mj.__all__) - {"__version__"}))
def test_every_public_call_that_is_named_exists(name: str) -> None:
    found = getattr(beacon_mj, name)
    assert (found.__doc__ or "").strip(), f"{name} has no documentation"


def test_the_page_names_nothing_that_is_not_there() -> None:
    named = set(re.findall(r"`(\w+)\(", PAGE.split("## After a run")[1]))
    assert len(named) > 10
    assert named <= set(beacon_mj.__all__)
