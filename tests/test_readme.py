"""The README: short, and true. tests/test_docs_run.py runs what it says."""

import os
import re
import subprocess
import sys

import pytest

from tests.pages import blocks
from tests.repository import REPOSITORY

README = (REPOSITORY / "README.md").read_text()
MOST_WORDS = 800
#: What a reader who knows robotics, but not this project, finds in one click.
ONE_CLICK = {
    "what fragile means": "docs/scenes.md#classes",
    "how to write a planner": "docs/planner-api.md",
    "what verify proves": "docs/verification.md#what-each-level-proves",
    "which numbers to cite": "docs/benchmark-card.md#how-to-cite-a-number",
}


def test_it_is_short() -> None:
    assert 400 < len(README.split()) <= MOST_WORDS


def test_the_first_block_is_two_commands_that_work_alone() -> None:
    lines = blocks(README, "bash")[0].splitlines()
    assert len(lines) == 2
    assert all(line.startswith("python3 -m venv ") for line in lines)
    assert lines[0].endswith("beacon-mj eval --planner beacon")
    assert "pytest" in lines[1]


def test_the_python_example_runs() -> None:
    done = subprocess.run(
        [sys.executable, "-c", blocks(README, "python")[0]],
        cwd=REPOSITORY, env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("reached")
    assert "moved" in done.stdout


@pytest.mark.parametrize("question", ONE_CLICK)
def test_the_reader_finds_it_in_one_click(question: str) -> None:
    assert f"]({ONE_CLICK[question]})" in README


def test_every_extra_is_named() -> None:
    project = (REPOSITORY / "pyproject.toml").read_text()
    table = project.partition("[project.optional-dependencies]")[2].partition("\n[")[0]
    extras = re.findall(r"^(\w+) = \[", table, re.M)
    assert len(extras) > 5
    assert all(f"`{extra}`" in README for extra in extras)
