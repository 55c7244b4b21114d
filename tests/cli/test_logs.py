"""The commands that take a log: recover, describe, lay out, plot."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from beacon_mj import cli
from beacon_mj.episode.protocol import Protocol
from beacon_mj.recording import read_log
from tests.recording.samples import record


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "x.mcap"
    record(path, protocol=Protocol(max_steps=40))
    return path


@pytest.fixture
def part(log: Path, tmp_path: Path) -> Path:
    """A log that broke off."""
    path = tmp_path / "x.mcap.part"
    path.write_bytes(log.read_bytes()[: int(0.8 * log.stat().st_size)])
    return path


def test_recover_writes_a_whole_file_beside_the_part(
    part: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    steps = read_log(part).steps
    assert cli.run(["log", "recover", str(part)]) == 0
    out = part.with_name("x.recovered.mcap")
    assert read_log(out).steps == steps > 10
    assert f"{out}: {steps} whole steps" in capsys.readouterr().err
    assert part.is_file()
    assert cli.run(["log", "recover", str(part)]) == 2
    assert "cannot write" in capsys.readouterr().err
    assert cli.run(["log", "recover", str(part), "--out", str(out) + "2"]) == 0


def test_info_says_what_a_log_holds(
    log: Path, part: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["log", "info", str(log)]) == 0
    out = capsys.readouterr().out
    for words in ("push-through", "40, 4.0 s", "timeout", "/step 41", "mujoco 3."):
        assert words in out
    assert cli.run(["log", "info", str(part)]) == 0
    assert "unfinished: it broke off" in capsys.readouterr().out


def test_layouts_go_to_a_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["log", "layout", "--out", str(tmp_path / "new")]) == 0
    names = sorted(p.name for p in (tmp_path / "new").iterdir())
    assert names == ["beacon-mj.foxglove.json", "beacon-mj.lichtblick.json"]
    assert capsys.readouterr().out == ""


def test_plot_is_an_svg_named_after_the_log(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.run(["plot", str(log)]) == 0
    assert cli.run(["plot", str(log), "--out", "panel.svg"]) == 0
    assert (tmp_path / "x.svg").read_bytes() == (tmp_path / "panel.svg").read_bytes()
    assert ElementTree.parse("x.svg").getroot().tag.endswith("svg")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("log inf x.mcap", "Did you mean 'info'"),
        ("log info gone.mcap", "gone.mcap: cannot read"),
        ("log recover gone.mcap.part", "gone.mcap.part: cannot read"),
        ("plot gone.mcap", "gone.mcap: cannot read"),
        ("export gone.mcap --ros2 bag", "gone.mcap: cannot read"),
        ("verify gone.mcap", "gone.mcap: cannot read"),
        ("replay gone.mcap --view", "gone.mcap: cannot read"),
    ],
)
def test_bad_input_is_one_line(
    arguments: str,
    words: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.run(arguments.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert words in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())
