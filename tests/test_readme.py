"""Every command and every program of the README runs."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.pages import blocks, run
from tests.repository import REPOSITORY

README = (REPOSITORY / "README.md").read_text()
#: The command that makes the published table takes minutes: run it in small.
IN_SMALL = {"beacon-mj eval --planner all --out runs/table": " -n 1"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as a reader has it: the templates beside, and mine.py written."""
    folder = tmp_path_factory.mktemp("reader")
    (folder / "mjcf_templates").symlink_to(REPOSITORY / "mjcf_templates")
    (folder / "mine.py").write_text(blocks(README, "python")[1])
    return folder


def test_the_first_block_is_two_commands_that_work_alone() -> None:
    lines = blocks(README, "bash")[0].splitlines()
    assert len(lines) == 2
    assert all(line.startswith("python3 -m venv ") for line in lines)
    assert lines[0].endswith("beacon-mj eval --planner beacon")
    assert "pytest" in lines[1]


@pytest.mark.slow
def test_every_shell_command_runs(folder: Path) -> None:
    commands = [c for block in blocks(README, "bash")[1:] for c in block.splitlines()]
    inline = re.findall(r"`(beacon-mj [^`]*mine\.py[^`]*)`", README)
    assert len(commands) > 8
    assert inline
    for command in [*commands, *inline]:
        done = run(command + IN_SMALL.get(command, ""), folder)
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"


def test_the_python_example_runs(folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", blocks(README, "python")[0]],
        cwd=folder, env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("reached")
    assert "moved" in done.stdout


@pytest.mark.parametrize("link", sorted(set(re.findall(r"\]\(([^)#]+)\)", README))))
def test_links_lead_somewhere(link: str) -> None:
    if not link.startswith("http"):
        assert (REPOSITORY / link).exists()
