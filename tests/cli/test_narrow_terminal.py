"""On a real terminal of 60 columns no line is wider, and no name is broken."""

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from beacon_mj.planners.registry import PAPER
from beacon_mj.scene_gen.suites import RELEASED
from tests.repository import REPOSITORY

COLUMNS = 60
#: Colours, and the movements of the cursor that redraw a bar.
CODES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
EVALUATE = [
    "eval", "--planner", "push-through", "bug1", "--family", "sparse", "-n", "2",
    "--workers", "1", "--no-report", "--out", "run", "--set", "protocol.max_steps=30",
]  # fmt: skip


def on_terminal(folder: Path, *arguments: str) -> list[str]:
    """Run a command in a terminal; return the lines that it wrote, stderr included."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, COLUMNS, 0, 0))
    kept = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES")}
    process = subprocess.Popen(
        [sys.executable, "-m", "beacon_mj", *arguments],
        cwd=folder, stdin=theirs, stdout=theirs, stderr=theirs,
        env=kept | {"PYTHONPATH": str(REPOSITORY), "TERM": "xterm"},
    )  # fmt: skip
    os.close(theirs)
    found = b""
    while data := _read(ours):
        found += data
    os.close(ours)
    assert process.wait() == 0, found.decode()
    lines = re.split(r"[\r\n]+", CODES.sub("", found.decode()))
    return [line.rstrip() for line in lines if line.strip()]


def _read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 65536)
    except OSError:  # Whoever wrote to it is gone.
        return b""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """A folder with a run, and what its evaluation wrote."""
    folder = tmp_path_factory.mktemp("narrow")
    return folder, on_terminal(folder, *EVALUATE)


def test_an_evaluation_fits(run: tuple[Path, list[str]]) -> None:
    text = "\n".join(run[1])
    assert max(map(len, run[1])) <= COLUMNS
    assert "4/4" in text
    assert "push-through" in text
    assert "\u2026" not in text


@pytest.mark.parametrize(
    ("command", "names"),
    [
        (["planners"], PAPER),
        (["families"], [f for suite in RELEASED.values() for f in suite]),
        (["compare", "run", "--baseline", "bug1"], ["push-through", "sparse"]),
        (["verify", "run"], ["tables: holds;", "logs: holds;"]),
    ],
    ids=["planners", "families", "compare", "verify"],
)
def test_a_result_fits_and_names_are_whole(
    run: tuple[Path, list[str]], command: list[str], names: list[str]
) -> None:
    lines = on_terminal(run[0], *command)
    paths = [line for line in lines if line.startswith("/")]
    assert max(len(line) for line in lines if line not in paths) <= COLUMNS
    for name in names:
        assert any(name in line for line in lines), name
    assert not any("\u2026" in line for line in lines)
