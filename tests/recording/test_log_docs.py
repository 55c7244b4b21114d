"""The programs of docs/logs.md run, and answer what they say."""

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from beacon_mj import cli
from beacon_mj.cli.app import COMMANDS, LOG_COMMANDS
from beacon_mj.eval.runs.run_folder import load_rows
from beacon_mj.recording.schemas import TOPICS
from beacon_mj.scene_gen.generate import generate_scene
from tests.repository import REPOSITORY

PAGE = (REPOSITORY / "docs" / "logs.md").read_text()
SCENES = (("cluttered", 7), ("collision-required", 0), ("collision-shortcut", 2))


def block(words: str) -> str:
    """Return the Python block that holds some words."""
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    [found] = [b for b in blocks if words in b]
    return str(found)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as a reader has it, with a run and a log."""
    folder = tmp_path_factory.mktemp("reader")
    (folder / "scenes").mkdir()
    for family, index in SCENES:
        scene = generate_scene(family, index)
        (folder / "scenes" / f"{scene.name}.json").write_bytes(scene.to_json())
    options = ["--planner", "beacon", "--planner", "push-through", "--workers", "1"]
    where = ["--scene-dir", str(folder / "scenes"), "--out", str(folder / "runs" / "x")]
    assert cli.run(["eval", *options, *where]) == 0
    log = folder / "runs" / "x" / "logs" / "beacon" / "cluttered_0007.mcap"
    shutil.copy(log, folder)
    return folder


def run(code: str) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(code, names)
    return names


def test_a_log_is_read_in_ten_lines(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    names = run(block("log.qpos.shape"))
    assert len(names["trace"].steps) == names["log"].steps > 10
    assert "beacon cluttered_0007 reached" in capsys.readouterr().out


def test_any_other_reader_works(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    run(block("make_reader").replace("beacon/cluttered", "cluttered"))


def test_failed_pushes_and_what_was_believed_before(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    names = run(block("failed = "))
    pushes, rows = names["pushes"], load_rows(folder / "runs" / "x")
    assert len(pushes) == sum(row.pushes for row in rows) > 3
    stalled = pushes.filter(pushes["evidence"] == "not_moved")
    assert len(stalled) == sum(row.failed_pushes for row in rows) > 0
    assert set(stalled["planner"]) <= set(names["failed"]["planner"])
    own = pushes.filter(pushes["planner"] == "beacon")
    total = own.select("safe", "movable", "fragile").sum_horizontal()
    assert len(own) > 0
    assert total.to_list() == pytest.approx([1.0] * len(own))
    assert "movable" in capsys.readouterr().out


def test_every_topic_and_command_is_documented() -> None:
    for topic, schema in TOPICS.items():
        assert f"| `{topic}` | `{schema}` |" in PAGE
    for command in LOG_COMMANDS:
        assert f"`beacon-mj log {command} " in PAGE
    for command in ("replay", "plot", "export"):
        assert command in COMMANDS
        assert f"`beacon-mj {command} LOG" in PAGE
