"""Reading code blocks from pages of documentation, and doing what they say.

A block with a title, such as `title="mine.py"`, is a file that the reader saves. Shell
and Python blocks are run in order. One that cannot be run here has a line before it
that says why: `<!-- not run: it opens a window -->`.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.repository import REPOSITORY

_BLOCK = re.compile(
    r"(?:^<!-- not run: (?P<why>[^\n]+) -->\n\n?)?"
    r"^ *```(?P<language>\w*)(?: title=\"(?P<title>[^\"]+)\")?\n(?P<text>.*?)^ *```$",
    re.MULTILINE | re.DOTALL,
)
#: Installing is what .ci/run does, in an environment of its own.
_INSTALLS = re.compile(r"(python3 -m venv|\.venv/bin/pip|pip install|apt) ")
_STUDIES = re.compile(r"beacon-mj (eval|ablate|regret|sweep|generate) ")
_SCENES = re.compile(r"(?<= )(?:-n|--scenes-per-family) (\d+)")


@dataclass(frozen=True, kw_only=True, slots=True)
class Block:
    """One block of code of a page."""

    language: str
    title: str | None
    text: str
    not_run: str | None

    @property
    def commands(self) -> list[str]:
        """The commands of a shell block: no comments, continued lines joined."""
        text = self.text.replace("\\\n", " ")
        lines = (re.sub(r"(^|\s)#.*", "", line).strip() for line in text.splitlines())
        return [line for line in lines if line]


def parts(text: str) -> list[Block]:
    """Return the blocks of a page, in order."""
    return [
        Block(
            language={"sh": "bash"}.get(found["language"], found["language"]),
            title=found["title"],
            text=found["text"],
            not_run=found["why"],
        )
        for found in _BLOCK.finditer(text)
    ]


def blocks(text: str, language: str) -> list[str]:
    """Return the contents of a page's code blocks of one language."""
    return [block.text for block in parts(text) if block.language == language]


def commands(text: str) -> list[str]:
    """Return the lines of a page's shell blocks."""
    return [line for block in blocks(text, "bash") for line in block.splitlines()]


def in_small(command: str) -> str:
    """Return a command as it runs here: a study over as few scenes as will do."""
    if not _STUDIES.match(command) or "--scene-dir" in command:
        return command
    command = re.sub(r"--trials \d+", "--trials 2", command)
    few = 3 if "revisited" in command else 1  # Missions are whole, of three days.
    if found := _SCENES.search(command):
        return command if int(found[1]) <= 10 else _SCENES.sub(f"-n {few}", command)
    # What goes on with a run has the options of the run, or names none.
    named = "--planner" in command or "--resume" not in command
    return f"{command} -n {few}" if named else command


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command as a reader would, with `beacon-mj` of this checkout."""
    program = f"{sys.executable} -m beacon_mj "
    return subprocess.run(
        re.sub(r"\bbeacon-mj (?=[a-z-])", program, command),
        shell=True, cwd=folder, capture_output=True, text=True,
        executable="/bin/bash", env=os.environ | {
            "PYTHONPATH": str(REPOSITORY),
            "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        },
    )  # fmt: skip


def reader(folder: Path) -> Path:
    """Return a folder as a reader has it: the root of a checkout."""
    for name in ("mjcf_templates", "examples", "tests"):
        (folder / name).symlink_to(REPOSITORY / name)
    shutil.copytree(REPOSITORY / "docs", folder / "docs")
    return folder


def follow(text: str, folder: Path) -> Iterator[str]:
    """Do what a page says; yield every command and program that ran.

    Raises:
        AssertionError: If one fails.
    """
    for k, block in enumerate(parts(text)):
        if block.title is not None:
            path = folder / block.title
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text)
        elif block.not_run is not None:
            continue
        elif block.language == "bash":
            for command in block.commands:
                if not _INSTALLS.match(command):
                    yield succeed(in_small(command), folder)
        elif block.language == "python":
            (folder / f"block{k}.py").write_text(block.text)
            yield succeed(f"python block{k}.py", folder)


def succeed(command: str, folder: Path) -> str:
    """Run a command that has to end well, and return it."""
    done = run(command, folder)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return command
