"""A folder of logs proves the tables of its run, and says where it does not."""

import json
import shutil
from pathlib import Path

import polars as pl
import pytest

from beacon_mj import cli
from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import COLUMNS
from beacon_mj.eval.runs.run_folder import load_rows
from beacon_mj.eval.runs.verify import (
    logs_below,
    missing_logs,
    run_of,
    tables_of,
    verify_log,
    verify_logs,
)
from beacon_mj.recording import read_trace
from tests.recording.samples import record


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small run with its logs."""
    out = tmp_path_factory.mktemp("runs") / "run"
    options = "--planner bug1 --planner beacon --family sparse -n 2 --workers 1"
    limit = ["--set", "protocol.max_steps=25", "--out", str(out)]
    assert cli.run(["eval", *options.split(), *limit]) == 0
    return out


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "run"))


def test_every_log_of_a_run_proves_its_row(made: Path) -> None:
    paths = logs_below(made)
    found = list(verify_logs(paths))
    assert [f.path for f in found] == paths
    assert len(found) == 4
    assert all(f.ok and f.steps == 25 and f.row_checked for f in found), found
    assert set(tables_of(made)) == {"episodes.jsonl", "episodes.parquet"}


def test_metrics_of_the_log_are_the_tables_in_every_column(made: Path) -> None:
    rows = {row.key: row for row in load_rows(made)}
    parquet = {
        (r["planner"], r["family"], r["scene_index"]): r
        for r in pl.read_parquet(made / "episodes.parquet").to_dicts()
    }
    compared = 0
    for path in logs_below(made):
        measured = measure(read_trace(path))
        for column in set(COLUMNS) - WALL_CLOCK_COLUMNS:
            value = getattr(measured, column)
            assert value == getattr(rows[measured.key], column), column
            assert value == parquet[measured.key][column], column
            compared += 1
    assert compared == 4 * (len(COLUMNS) - len(WALL_CLOCK_COLUMNS))


@pytest.mark.parametrize(
    ("column", "value"),
    [("path_length_m", 1.5), ("outcome", "reached"), ("brier_posterior", None)],
)
def test_a_doctored_line_is_named_with_its_column(
    run: Path, column: str, value: object
) -> None:
    lines = run / "episodes.jsonl"
    rows = [json.loads(line) for line in lines.read_text().splitlines()]
    for row in rows:
        row[column] = value
    lines.write_text("".join(json.dumps(row) + "\n" for row in rows))
    for found in verify_logs(logs_below(run / "logs" / "beacon")):
        assert found.problem is not None
        assert f"differs from episodes.jsonl: {column} is " in found.problem


def test_a_doctored_table_is_named_with_its_column(run: Path) -> None:
    path = run / "episodes.parquet"
    frame = pl.read_parquet(path)
    changed = frame.with_columns(pl.col("energy_j") + 1e-9)
    changed.write_parquet(path)
    for found in verify_logs(logs_below(run)):
        assert found.problem is not None
        assert "differs from episodes.parquet: energy_j is " in found.problem


def test_wall_clock_columns_may_differ(run: Path) -> None:
    path = run / "episodes.parquet"
    columns = [pl.col(name) + 1.0 for name in sorted(WALL_CLOCK_COLUMNS)]
    pl.read_parquet(path).with_columns(columns).write_parquet(path)
    assert all(found.ok for found in verify_logs(logs_below(run)))


def test_a_log_under_another_name_is_caught(run: Path) -> None:
    first, second = logs_below(run / "logs" / "beacon")
    first.write_bytes(second.read_bytes())
    [found] = verify_logs([first])
    assert found.problem is not None
    assert "episodes.jsonl has no beacon in sparse_0001" in found.problem


def test_a_log_without_a_row_is_caught(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    record(path)
    problem = verify_log(path).problem
    assert problem is not None
    assert "row" in problem


def test_a_log_elsewhere_has_no_run(run: Path, tmp_path: Path) -> None:
    log = logs_below(run)[0]
    assert run_of(log) == run
    shutil.copy(log, tmp_path / "x.mcap")
    assert run_of(tmp_path / "x.mcap") is None
    assert verify_log(tmp_path / "x.mcap").ok
    assert missing_logs(run) == 0
    log.unlink()
    assert missing_logs(run) == 1


def test_a_folder_without_logs_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"expected a folder with logs"):
        logs_below(tmp_path)


def test_the_command_verifies_a_folder_on_two_processes(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert cli.run(["verify", str(run), "--workers", "2"]) == 0
    out, err = capsys.readouterr()
    assert "4 of 4 logs verified, 100 steps simulated again" in out
    assert "episodes.jsonl and episodes.parquet" in out
    assert "error" not in err


def test_the_command_prints_only_failures_and_a_summary(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = logs_below(run)[1]
    log.write_bytes(log.read_bytes()[:-2000])
    (run / "logs" / "bug1" / "sparse_0009.mcap.part").touch()
    capsys.readouterr()
    assert cli.run(["verify", str(run), "--workers", "1"]) == 1
    out, err = capsys.readouterr()
    errors = [line for line in err.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert str(log) in errors[0]
    assert "3 of 4 logs verified" in out
    assert "1 unfinished logs" in out


def test_the_command_names_the_column_of_one_log(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = run / "episodes.parquet"
    pl.read_parquet(path).with_columns(pl.col("pushes") + 1).write_parquet(path)
    log = str(logs_below(run)[0])
    capsys.readouterr()
    assert cli.run(["verify", log]) == 1
    assert "differs from episodes.parquet: pushes is " in capsys.readouterr().err


def test_metrics_as_table_and_json(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = logs_below(made)[0]
    assert cli.run(["replay", str(log), "--metrics"]) == 0
    table = capsys.readouterr().out
    assert all(name in table for name in set(COLUMNS) - WALL_CLOCK_COLUMNS)
    assert cli.run(["replay", str(log), "--metrics", "--json"]) == 0
    row = json.loads(capsys.readouterr().out)
    assert list(row) == list(COLUMNS)


@pytest.mark.parametrize("option", ["--metrics", "--view", "--png=x.png"])
def test_only_verify_takes_a_folder(
    made: Path, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["replay", str(made), option]) == 2
    assert "only `verify` takes one" in capsys.readouterr().err
