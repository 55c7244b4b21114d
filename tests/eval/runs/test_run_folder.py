"""The run folder: what is on disk, and when."""

import json
from pathlib import Path

import msgspec
import polars as pl
import pytest

from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import COLUMNS, Row
from beacon_mj.eval.runs.config import RunConfig
from beacon_mj.eval.runs.run_folder import (
    RunFolder,
    load_config,
    load_rows,
    write_table,
)
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.recording.machine import machine
from tests.eval.runs.test_runner import configured
from tests.eval.traces import step, trace


def row(index: int, planner: str = "one") -> Row:
    made = measure(trace([step(1, x_m=1.0)]))
    return msgspec.structs.replace(made, scene_index=index, planner=planner)


@pytest.fixture
def config() -> RunConfig:
    return configured(["push-through"])[0]


def test_a_run_on_disk(tmp_path: Path, config: RunConfig) -> None:
    folder = RunFolder(tmp_path / "run")
    folder.create(config)
    here = msgspec.structs.replace(config, machines=(machine(),))
    assert load_config(folder.path) == here
    assert load_rows(folder.path) == []
    folder.append([row(1), row(0, "two")])
    folder.append([row(0)])
    assert [r.key[::2] for r in load_rows(folder.path)] == [
        ("one", 0),
        ("one", 1),
        ("two", 0),
    ]
    assert not (folder.path / "episodes.parquet").exists()
    rows = load_rows(folder.path)
    folder.finish(config, rows, summarize(rows))
    names = {path.name for path in folder.path.iterdir()}
    assert names == {
        "config.json",
        "episodes.jsonl",
        "episodes.parquet",
        "summary.json",
    }
    here = msgspec.structs.replace(config, machines=(machine(),))
    assert load_config(folder.path) == here
    hashes = msgspec.json.decode((folder.path / "config.json").read_bytes())
    assert hashes["scene_sha256"] == {
        "paper_0000": row(0).scene_sha256,
        "paper_0001": row(0).scene_sha256,
    }


def test_the_table_is_typed_ordered_and_repeatable(tmp_path: Path) -> None:
    rows = [row(1), row(0, "two"), row(0)]
    write_table(rows, tmp_path / "a.parquet")
    write_table(rows[::-1], tmp_path / "b.parquet")
    assert (tmp_path / "a.parquet").read_bytes() == (
        tmp_path / "b.parquet"
    ).read_bytes()
    frame = pl.read_parquet(tmp_path / "a.parquet")
    assert tuple(frame.columns) == COLUMNS
    assert frame["planner"].to_list() == ["one", "one", "two"]
    assert frame.schema["brier_prior"] == pl.Float64  # Though every value is null.
    assert frame.schema["steps"] == pl.Int64
    assert frame.schema["success"] == pl.Boolean
    assert frame.row(0, named=True) == row(0).as_dict()


def test_a_folder_with_files_is_not_overwritten(
    tmp_path: Path, config: RunConfig
) -> None:
    (tmp_path / "mine.txt").write_text("precious")
    with pytest.raises(RunError, match="new or empty folder"):
        RunFolder(tmp_path).create(config)
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


def test_resuming_drops_a_line_that_was_cut_off(
    tmp_path: Path, config: RunConfig
) -> None:
    folder = RunFolder(tmp_path / "run")
    folder.create(config)
    folder.append([row(0)])
    lines = folder.path / "episodes.jsonl"
    whole = lines.read_bytes()
    lines.write_bytes(whole + whole[:40])
    assert folder.resume(config) == [row(0)]
    folder.append([row(1)])
    assert load_rows(folder.path) == [row(0), row(1)]


def test_resuming_needs_the_same_options(tmp_path: Path, config: RunConfig) -> None:
    folder = RunFolder(tmp_path / "run")
    folder.create(config)
    other = msgspec.structs.replace(config, seed=7)
    with pytest.raises(RunError, match="but seed differs"):
        folder.resume(other)
    assert folder.resume(msgspec.structs.replace(config, log="all")) == []


def test_a_run_goes_on_with_another_machine_and_knows_both(
    tmp_path: Path, config: RunConfig
) -> None:
    other = {"cpu": "another"}
    RunFolder(tmp_path / "run").create(
        msgspec.structs.replace(config, machines=(other,))
    )
    folder = RunFolder(tmp_path / "run")
    assert folder.resume(config) == []
    assert load_config(folder.path).machines == (other, machine())
    folder.append([row(0)])
    folder.finish(config, [row(0)], {})
    assert load_config(folder.path).machines == (other, machine())
    assert RunFolder(folder.path).resume(config) == [row(0)]
    assert load_config(folder.path).machines == (other, machine())


@pytest.mark.parametrize("planner", ["beacon", "push-through"])
def test_resuming_knows_options_that_were_read_back(
    tmp_path: Path, planner: str
) -> None:
    folder = RunFolder(tmp_path / "run")
    folder.create(configured([planner])[0])
    assert folder.resume(configured([planner])[0]) == []


def test_a_run_that_was_killed_before_it_began_is_unborn(
    tmp_path: Path, config: RunConfig
) -> None:
    folder = RunFolder(tmp_path)
    (tmp_path / "episodes.jsonl").touch()
    (tmp_path / "config.json.part").write_text("{")
    assert folder.is_unborn()
    folder.create(config)
    assert not folder.is_unborn()
    assert folder.resume(config) == []


def test_a_damaged_line_is_named(tmp_path: Path, config: RunConfig) -> None:
    folder = RunFolder(tmp_path / "run")
    folder.create(config)
    (folder.path / "episodes.jsonl").write_text('{"planner": 1}\n')
    with pytest.raises(RunError, match=r"episodes.jsonl:1: not a valid row"):
        load_rows(folder.path)


def test_no_run_is_no_run(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="expected a run folder"):
        load_config(tmp_path)
    (tmp_path / "config.json").write_text('{"schema": 2}')
    with pytest.raises(RunError, match="not a valid configuration"):
        load_config(tmp_path)


def test_a_run_of_another_schema_gets_one_clear_line(
    tmp_path: Path, config: RunConfig
) -> None:
    path = tmp_path / "old"
    RunFolder(path).create(config)
    stored = json.loads((path / "config.json").read_text())
    del stored["schema"]
    stored["versions"]["beacon-mj"] = "0.1.0"
    stored["renamed"] = "since"
    (path / "config.json").write_text(json.dumps(stored))
    for load in (load_config, load_rows):
        with pytest.raises(RunError, match=r"schema 2 but it is of schema 1.*0\.1\.0"):
            load(path)
