"""Streams as shells give them: closed, broken, full, or shared with what prints."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from beacon_mj import cli
from beacon_mj.eval.runs.run_folder import load_rows
from tests.repository import REPOSITORY

SMALL = "--family sparse -n 1 --workers 1 --log none --set protocol.max_steps=3"
GENERATE = ["generate", "--family", "sparse", "-n", "1", "--out"]
TALKS = '''
import os
from dataclasses import dataclass
import numpy as np
from beacon_mj import Command, Planner


@dataclass(frozen=True, kw_only=True, slots=True)
class Config:
    #: Speed [m/s], see [/etc/robot] and [red]here[/] :warning:.
    speed_mps: float = 0.1


class Talks(Planner):
    """Drives [red]hard[/] at [/goal] things \\x1b[31m."""

    Config = Config

    def reset(self, task):
        print("thinking")
        os.write(1, b"even louder\\n")

    def act(self, observation):
        return Command(velocity_mps=np.array([self.config.speed_mps, 0.0]))
'''


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def shell(command: str) -> "subprocess.CompletedProcess[str]":
    """Run a line of bash in which `beacon-mj` is this checkout's."""
    line = command.replace("beacon-mj", f"{sys.executable} -m beacon_mj")
    return subprocess.run(
        ["bash", "-o", "pipefail", "-c", line],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True, text=True,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("command", "status"),
    [
        ("beacon-mj families >&-", 0),
        ("beacon-mj families 2>&- >/dev/null", 0),
        ("beacon-mj families | head -n 1 >/dev/null", 0),
        ("beacon-mj families >/dev/full", 2),
        ("beacon-mj families --help >/dev/full", 2),
        ("beacon-mj nosuch 2>/dev/full", 2),
    ],
)
def test_a_stream_that_is_no_good(command: str, status: int) -> None:
    done = shell(command)
    assert (done.returncode, done.stdout) == (status, "")
    assert "Traceback" not in done.stderr
    assert "Exception" not in done.stderr
    assert done.stderr.count("\n") == ("/dev/full" in command and "2>" not in command)


def test_an_evaluation_without_streams_is_whole() -> None:
    run = f"beacon-mj eval --planner push-through {SMALL} --out run <&- >&- 2>&-"
    assert shell(run).returncode == 0
    assert len(load_rows(Path("run"))) == 1
    lines = Path("run/episodes.jsonl").read_bytes().splitlines()
    assert [msgspec.json.decode(line)["steps"] for line in lines] == [3]


@pytest.mark.parametrize("workers", ["1", "2"])
def test_stdout_holds_the_result_alone(workers: str) -> None:
    Path("talks.py").write_text(TALKS)
    small = SMALL.replace("-n 1 --workers 1", f"-n 2 --workers {workers}")
    done = shell(
        f"beacon-mj eval --planner talks.py:Talks --no-isolate {small} --json --out run"
    )
    assert done.returncode == 0, done.stderr
    assert msgspec.json.decode(done.stdout)["episodes"] == 2
    assert done.stderr.count("thinking") == done.stderr.count("even louder") == 2


def test_text_is_shown_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    Path("talks.py").write_text(TALKS)
    assert cli.run(["planners", "talks.py:Talks"]) == 0
    out, _ = capsys.readouterr()
    assert "Drives [red]hard[/] at [/goal] things \\x1b[31m." in out
    told = " ".join(out.split())
    for word in ("[m/s],", "[/etc/robot]", "[red]here[/]", ":warning:"):
        assert word in told
    assert "\x1b" not in out


def test_an_error_sends_no_control_characters(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert cli.run(["log", "info", "\x1b]0;x\x07\udcff.mcap"]) == 2
    _, err = capsys.readouterr()
    assert "\\x1b]0;x\\x07\\udcff.mcap: cannot read" in err
    assert err.strip().isprintable()


def test_commands_print_from_one_place() -> None:
    found = {
        path.name
        for path in (REPOSITORY / "beacon_mj" / "cli").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call)
        and (
            ast.unparse(node.func) == "print"
            or ast.unparse(node.func).startswith(("sys.stdout.", "sys.stderr.write"))
        )
    }
    assert found == {"console.py", "standard_streams.py"}


def test_a_run_in_a_folder_whose_name_is_no_utf8() -> None:
    name = os.fsdecode(b"n\xff")
    arguments = [*SMALL.replace("--log none", "").split(), "--planner", "push-through"]
    assert cli.run(["eval", *arguments, "--out", name]) == 0
    assert cli.run(["verify", name]) == 0
    assert cli.run(["report", name, "--no-replay"]) == 0
    assert cli.run([*GENERATE, "s\udcff"]) == 0


def test_an_option_that_utf8_cannot_hold_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert cli.run([*GENERATE, "s\udcff"]) == 0
    capsys.readouterr()
    arguments = ["eval", "--planner", "push-through", "--scene-dir", "s\udcff"]
    assert cli.run([*arguments, "--workers", "1", "--out", "run"]) == 2
    assert "config.json can hold, as UTF-8" in capsys.readouterr().err
    assert not Path("run").exists()
