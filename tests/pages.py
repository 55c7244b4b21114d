"""Reading code blocks from pages of documentation, and running what they say."""

import os
import re
import subprocess
import sys
from pathlib import Path

from tests.repository import REPOSITORY


def blocks(text: str, language: str) -> list[str]:
    """Return the contents of a page's code blocks of one language."""
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def commands(text: str) -> list[str]:
    """Return the lines of a page's shell blocks."""
    return [line for block in blocks(text, "bash") for line in block.splitlines()]


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command as a reader would, with `beacon-mj` of this checkout."""
    program = f"{sys.executable} -m beacon_mj "
    return subprocess.run(
        command.replace("beacon-mj ", program, 1),
        shell=True, cwd=folder, env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True, text=True,
    )  # fmt: skip
