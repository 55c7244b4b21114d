"""The page that ends an evaluation: when it is written, and what is said of it."""

from pathlib import Path

import pytest

import beacon_mj
from beacon_mj import cli
from beacon_mj.eval.api import reports
from beacon_mj.eval.report.check import page_problem
from beacon_mj.eval.runs.run_folder import RunFolder, load_rows
from beacon_mj.eval.statistics.results import load_results

SMALL = [
    "eval", "--planner", "push-through", "--family", "sparse", "-n", "2",
    "--workers", "1", "--set", "protocol.max_steps=40",
]  # fmt: skip


def evaluate(out: Path, *arguments: str) -> None:
    assert cli.run([*SMALL, "--out", str(out), *arguments]) == 0


@pytest.mark.parametrize("log", ["all", "failures", "none"])
def test_a_run_ends_with_its_page(
    log: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    evaluate(tmp_path / "run", "--log", log)
    page = tmp_path / "run" / "report.html"
    assert capsys.readouterr().err.splitlines()[-1] == f"report: {page}"
    assert "2 episodes" in page.read_text()
    assert page_problem(page.read_text(), load_results(tmp_path / "run")) is None


def test_a_run_without_its_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    evaluate(tmp_path / "run", "--log", "none", "--no-report")
    assert "report:" not in capsys.readouterr().err
    assert not (tmp_path / "run" / "report.html").exists()


def test_an_evaluation_in_python_ends_with_its_page(tmp_path: Path) -> None:
    for report in (True, False):
        results = beacon_mj.evaluate(
            ["push-through"], families=["sparse"], scenes_per_family=1, workers=1,
            settings=["protocol.max_steps=40"], log="none", report=report,
            out=tmp_path / str(report),
        )  # fmt: skip
        assert (results.folder / "report.html").is_file() is report


@pytest.fixture
def half(tmp_path: Path) -> Path:
    """A run that was interrupted, with a page of its one episode."""
    run = tmp_path / "run"
    evaluate(run, "--log", "none", "--no-report")
    lines = run / "episodes.jsonl"
    lines.write_bytes(lines.read_bytes().splitlines(keepends=True)[0])
    (run / "episodes.parquet").unlink()
    assert cli.run(["report", str(run)]) == 0
    assert "This run is not finished" in (run / "report.html").read_text()
    return run


def test_a_run_that_goes_on_writes_its_page_anew(half: Path) -> None:
    assert cli.run(["eval", "--resume", "--out", str(half)]) == 0
    assert len(load_rows(half)) == 2
    assert "This run is not finished" not in (half / "report.html").read_text()


def test_a_run_that_goes_on_without_a_page_keeps_no_old_one(half: Path) -> None:
    resume = ["eval", "--resume", "--out", str(half), "--no-report"]
    assert cli.run(resume) == 0
    assert len(load_rows(half)) == 2
    assert not (half / "report.html").exists()
    # A page of all episodes stays.
    assert cli.run(["report", str(half)]) == 0
    assert cli.run(resume) == 0
    text = (half / "report.html").read_text()
    assert page_problem(text, load_results(half)) is None


def test_a_page_goes_as_soon_as_there_is_another_row(
    half: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that a run which is killed leaves none of fewer episodes."""

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(RunFolder, "finish", killed)
    assert cli.run(["eval", "--resume", "--out", str(half)]) == 130
    assert len(load_rows(half)) == 2
    assert not (half / "report.html").exists()


def test_shards_have_no_page_but_their_merge_has(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    parts = [tmp_path / name for name in ("a", "b")]
    for k, part in enumerate(parts, start=1):
        evaluate(part, "--log", "none", "--shard", f"{k}/2")
        assert not (part / "report.html").exists()
    whole = tmp_path / "whole"
    capsys.readouterr()
    assert cli.run(["merge", str(whole), *map(str, parts)]) == 0
    assert f"report: {whole / 'report.html'}" in capsys.readouterr().err
    assert "2 episodes" in (whole / "report.html").read_text()
    beacon_mj.merge(tmp_path / "again", parts, report=False)
    assert not (tmp_path / "again" / "report.html").exists()


def test_a_page_that_cannot_be_written_costs_no_result(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    evaluate(tmp_path / "run", "--log", "none", "--no-report")
    (tmp_path / "run" / "report.html").mkdir()
    capsys.readouterr()
    assert cli.run(["eval", "--resume", "--out", str(tmp_path / "run")]) == 0
    out, err = capsys.readouterr()
    assert "push-through" in out
    (note,) = [line for line in err.splitlines() if line.startswith("note: ")]
    assert "no report.html: " in note
    assert "no regular file" in note


def test_an_interrupted_page_says_that_the_run_is_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(_: object) -> Path:
        raise KeyboardInterrupt

    monkeypatch.setattr(reports, "write_report", interrupted)
    out = tmp_path / "run"
    assert cli.run([*SMALL, "--log", "none", "--out", str(out)]) == 130
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.endswith(f"write it with: beacon-mj report {out}")
    assert (out / "episodes.parquet").is_file()
