"""`beacon-mj certify`: verdicts, identities, exit status, bad input."""

from pathlib import Path

import pytest

from beacon_mj.cli import BAD_INPUT, FAILED, run
from beacon_mj.scene.files import load_scene
from beacon_mj.scene_gen.generate import generate_scene

SEED = 4000  # Neither the tuning nor the reported scenes.


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for index in range(2):
        scene = generate_scene("sparse", index, SEED)
        (tmp_path / f"scene_{index:04d}.json").write_bytes(scene.to_json())
    return tmp_path


def paths(folder: Path) -> list[Path]:
    found = sorted(folder.glob("*.json"))
    assert len(found) == 2
    return found


def test_a_solved_scene_says_so_and_keeps_its_identity(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = [load_scene(path) for path in paths(folder)]
    assert [s.certificate.simulated for s in before] == [None, None]
    assert run(["certify", str(folder), "--workers", "1"]) == 0
    after = [load_scene(path) for path in paths(folder)]
    assert [s.certificate.simulated for s in after] == ["clean", "clean"]
    assert [s.sha256 for s in after] == [s.sha256 for s in before]
    assert "2 of 2 scenes solved without damage" in capsys.readouterr().out
    assert not list(folder.glob("*.part"))


def test_certifying_twice_changes_no_byte(folder: Path) -> None:
    assert run(["certify", str(folder), "--workers", "1"]) == 0
    before = [(p.read_bytes(), p.stat().st_mtime_ns) for p in paths(folder)]
    assert run(["certify", str(folder), "--workers", "1"]) == 0
    assert [(p.read_bytes(), p.stat().st_mtime_ns) for p in paths(folder)] == before


def test_a_scene_that_is_not_solved_fails(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hurry = ["--set", "protocol.max_steps=20"]
    assert run(["certify", str(folder), "--workers", "1", *hurry]) == FAILED
    verdicts = [load_scene(path).certificate.simulated for path in paths(folder)]
    assert verdicts == ["gave_up", "gave_up"]
    printed = capsys.readouterr()
    assert "sparse_0001: gave_up" in printed.err
    assert "0 of 2 scenes" in printed.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "expected a folder of scenes"),
        ([], "SCENES"),
        ([".", "--set", "clairvoyant.rehearsals=0"], "rehearsals"),
        ([".", "--set", "beacon.w_e=1"], "Unknown target"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str],
    message: str,
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(folder)
    assert run(["certify", *arguments]) == BAD_INPUT
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert message in lines[0]


def test_a_broken_scene_is_named(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = folder / "scene_0002.json"
    bad.write_text("{")
    assert run(["certify", str(folder)]) == BAD_INPUT
    assert str(bad) in capsys.readouterr().err
    assert load_scene(folder / "scene_0000.json").certificate.simulated is None


def test_scenes_can_be_certified_when_they_are_made(tmp_path: Path) -> None:
    out = tmp_path / "new"
    options = ["--family", "sparse", "-n", "1", "--seed", str(SEED)]
    assert run(["generate", "--out", str(out), "--certify", *options]) == 0
    assert load_scene(out / "scene_0000.json").certificate.simulated == "clean"
