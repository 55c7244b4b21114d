"""A page of submissions: those that hold are listed, the others named, all escaped."""

import html
import re
import shutil
from pathlib import Path

import msgspec
import pytest

import beacon_mj
from beacon_mj import cli
from beacon_mj.episode.protocol import PRESETS, Protocol
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import rows_sha256
from beacon_mj.eval.report.leaderboard import render_leaderboard
from beacon_mj.eval.runs.run_folder import load_rows
from beacon_mj.eval.verification.submissions import told

SHORT = {"protocol.max_steps": 30, "protocol.decision_limit_s": 3600}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "run"
    beacon_mj.evaluate(
        ["bug1", "clairvoyant"], families=["sparse"], scenes_per_family=2,
        settings=SHORT, workers=1, out=out,
    )  # fmt: skip
    return out


@pytest.fixture(scope="module")
def good(run: Path) -> Path:
    return beacon_mj.bundle(run, run.parent / "good.zip")


@pytest.fixture(scope="module")
def forged(run: Path) -> Path:
    """A bundle whose rows were edited, under a name that is markup."""
    copy = Path(shutil.copytree(run, run.parent / "forged"))
    lines = (copy / "episodes.jsonl").read_text()
    (copy / "episodes.jsonl").write_text(lines.replace('"steps":30', '"steps":3'))
    return beacon_mj.bundle(copy, run.parent / "<script>alert(1)<script>.zip")


def test_what_holds_is_listed_and_what_does_not_is_named(
    run: Path, good: Path, forged: Path, tmp_path: Path
) -> None:
    found = beacon_mj.leaderboard([good, forged], tmp_path / "site", workers=1)
    assert [line.planner for line in found.lines] == ["bug1", "clairvoyant"]
    assert [each.submission for each in found.refused] == [forged.name]
    assert not found.ok
    assert found.problems[0].startswith(f"{forged.name}: ")
    page = found.path.read_text()
    assert found.path == tmp_path / "site" / "index.html"
    text = html.unescape(re.sub(r"<[^>]+>", " ", page))
    for words in (
        "suite paper-v1, perception noisy, protocol paper, ",
        "max_steps=30",
        "clairvoyant* (oracle)",
        "0.0 [0.0, 65.8]",  # Wilson's interval of 0 of 2.
        "logs: 4 logs simulated again, every message bit for bit",
        "2 of sparse; seed 0",
        f"beacon-mj {beacon_mj.__version__}",
        rows_sha256(load_rows(run)),
    ):
        assert words in text, words
    assert "<script" not in page.lower()
    assert "&lt;script&gt;" in page
    assert str(run.parent) not in page
    assert "default-src &#39;none&#39;" in page or "default-src 'none'" in page
    assert not re.search(r"(src|href)\s*=|url\(|@import", page)
    assert "<figcaption>2 planners</figcaption>" in page  # Says on phones: scroll.


@pytest.mark.parametrize("name", PRESETS)
def test_a_protocol_is_told_as_the_nearest_preset_and_what_differs(name: str) -> None:
    preset = Protocol.preset(name)
    assert told(preset) == f"protocol {name}"
    other = msgspec.structs.replace(preset, max_steps=30)
    assert told(other) == f"protocol {name}, max_steps=30"


def test_a_run_again_is_a_higher_proof(good: Path, tmp_path: Path) -> None:
    found = beacon_mj.leaderboard([good], tmp_path, workers=1, rerun=True)
    assert found.ok
    assert all(
        line.proof == "planner: 4 episodes run again, 4 logs compared in every message"
        for line in found.lines
    )


def test_the_best_stand_first_and_oracles_last(good: Path, tmp_path: Path) -> None:
    [line, oracle] = beacon_mj.leaderboard([good], tmp_path, workers=1).lines
    better = line._replace(
        planner="better", clean=line.clean._replace(percent=99.0), steps_mean=1e6
    )
    quicker = line._replace(planner="quicker", steps_mean=1.0)
    page = render_leaderboard([oracle, line, quicker, better], [])
    names = re.findall(r'<th scope="row">([\w-]+)', page)
    assert names == ["better", "quicker", "bug1", "clairvoyant"]
    other = line._replace(conditions="suite hard-v1")
    assert render_leaderboard([line, other], []).count("<table>") == 2


def test_the_command_ends_with_1_where_one_is_refused(
    good: Path, forged: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--out", str(tmp_path / "site"), "--workers", "1"]
    assert cli.run(["leaderboard", str(good), *arguments]) == 0
    no_bundle = tmp_path / "rows.jsonl"
    no_bundle.write_text("{}")
    assert cli.run(["leaderboard", str(no_bundle), *arguments]) == 1
    assert "rows.jsonl: rows.jsonl: expected a bundle" in capsys.readouterr().err
    assert "No submission holds." in (tmp_path / "site" / "index.html").read_text()
    assert cli.run(["leaderboard", *arguments]) == 2
    with pytest.raises(RunError, match="file names of their own"):
        beacon_mj.leaderboard([good, good], tmp_path)
