"""Shards and their merge: the run they make up, and what is refused."""

import os
import shutil
from pathlib import Path

import msgspec
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj import cli
from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.errors import RunError
from beacon_mj.eval.runs.run_folder import load_config, load_rows
from beacon_mj.eval.runs.shards import Shard, parse_shard, share
from beacon_mj.eval.studies.merge import merge

SMALL = [
    "eval", "--planner", "push-through", "--planner", "bug1", "--family", "sparse",
    "--family", "collision-required", "-n", "2", "--workers", "1",
    "--set", "protocol.max_steps=60", "--no-report",
]  # fmt: skip


def evaluate(out: Path, *arguments: str) -> None:
    assert cli.run([*SMALL, "--out", str(out), *arguments]) == 0


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a whole run and its four shards."""
    path = tmp_path_factory.mktemp("shards")
    evaluate(path / "whole")
    for i in range(1, 5):
        evaluate(path / f"part{i}", "--shard", f"{i}/4")
    return path


@pytest.fixture
def parts(runs: Path, tmp_path: Path) -> list[Path]:
    """Return copies of the four shards, to do harm to."""
    for i in range(1, 5):
        shutil.copytree(runs / f"part{i}", tmp_path / f"part{i}")
    return [tmp_path / f"part{i}" for i in range(1, 5)]


def table(run: Path) -> pl.DataFrame:
    return pl.read_parquet(run / "episodes.parquet").drop(*WALL_CLOCK_COLUMNS)


def without_wall_clock(run: Path) -> object:
    summary = msgspec.json.decode((run / "summary.json").read_bytes())
    for cells in summary["tables"].values():
        for cell in cells.values():
            for name in WALL_CLOCK_COLUMNS:
                cell["mean"].pop(name, None)
                cell["mean_over_successes"].pop(name, None)
    return summary


@given(st.integers(1, 40), st.integers(0, 60))
def test_shares_are_a_partition(of: int, more: int) -> None:
    items = range(of + more)
    shares = [share(items, Shard(i, of)) for i in range(1, of + 1)]
    assert sorted(k for part in shares for k in part) == list(items)
    assert max(map(len, shares)) - min(map(len, shares)) <= 1


def test_too_many_shards_are_refused() -> None:
    assert share([1, 2], None) == [1, 2]
    with pytest.raises(RunError, match="at most as many shards as scenes"):
        share([1, 2], Shard(1, 3))


@pytest.mark.parametrize("text", ["", "3", "0/4", "5/4", "1/0", "-1/4", "1/4/2", "a/b"])
def test_what_is_no_shard_is_refused(text: str) -> None:
    with pytest.raises(RunError, match=r"such as 3/8"):
        parse_shard(text)
    assert str(parse_shard("3/8")) == "3/8"


def test_merged_shards_equal_the_uninterrupted_run(runs: Path, tmp_path: Path) -> None:
    parts = [runs / f"part{i}" for i in (3, 1, 4, 2)]
    assert [len(load_rows(part)) for part in parts] == [2, 2, 2, 2]
    assert cli.run(["merge", str(tmp_path / "out"), *map(str, parts)]) == 0
    out, whole = tmp_path / "out", runs / "whole"
    assert len(table(whole)) == 8
    assert table(out).equals(table(whole))
    assert table(out).schema == table(whole).schema
    assert without_wall_clock(out) == without_wall_clock(whole)
    assert load_config(out) == load_config(whole)
    hashes = [(run / "config.json").read_bytes() for run in (out, whole)]
    assert hashes[0] == hashes[1]


def test_logs_are_linked(runs: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    merge(out, [runs / f"part{i}" for i in range(1, 5)])
    logs = [p.relative_to(out) for p in sorted(out.rglob("*.mcap"))]
    assert logs == [
        p.relative_to(runs / "whole") for p in sorted((runs / "whole").rglob("*.mcap"))
    ]
    assert len(logs) == 8
    first = logs[0]
    [source] = [p for i in range(1, 5) if (p := runs / f"part{i}" / first).exists()]
    assert (out / first).read_bytes() == source.read_bytes()


def test_logs_are_copied_where_links_cannot_be(
    parts: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: object) -> None:
        raise OSError("another device")

    monkeypatch.setattr(os, "link", refuse)
    merge(tmp_path / "out", parts)
    assert len([*(tmp_path / "out").rglob("*.mcap")]) == 8


def refused(out: Path, parts: list[Path], words: str) -> None:
    with pytest.raises(RunError, match=words):
        merge(out, parts)
    assert not out.exists()


def test_missing_shards_are_named(parts: list[Path], tmp_path: Path) -> None:
    refused(tmp_path / "out", parts[1:3], r"but 1/4, 4/4 are missing")
    refused(tmp_path / "out", [], "none")


def test_overlapping_shards_are_named(parts: list[Path], tmp_path: Path) -> None:
    again = tmp_path / "again"
    shutil.copytree(parts[1], again)
    refused(tmp_path / "out", [*parts, again], r"part2, .*again: both are 2/4")
    refused(tmp_path / "out", [*parts[:3], parts[0]], r"but 4/4 are missing")


def test_a_whole_run_is_no_shard(runs: Path, tmp_path: Path) -> None:
    refused(tmp_path / "out", [runs / "whole"], "whole: expected a shard")


def change(part: Path, **values: object) -> None:
    config = msgspec.structs.replace(load_config(part), **values)
    (part / "config.json").write_bytes(msgspec.json.encode(config))


def test_shards_of_other_options_are_refused(parts: list[Path], tmp_path: Path) -> None:
    change(parts[2], seed=3)
    refused(tmp_path / "out", parts, r"part3: expected the options of .*part1 but seed")
    change(parts[2], seed=0, shard=Shard(3, 5))
    refused(tmp_path / "out", parts, r"part3: expected a shard I/4.* but it is 3/5")


def test_an_unfinished_shard_is_named(parts: list[Path], tmp_path: Path) -> None:
    lines = parts[3] / "episodes.jsonl"
    kept = lines.read_bytes().splitlines(keepends=True)
    lines.write_bytes(kept[0])
    refused(
        tmp_path / "out",
        parts,
        r"part4: .* lacks \S+ collision-required_0001; .*--resume --out",
    )
    lines.write_bytes(b"".join([*kept, (parts[0] / lines.name).read_bytes()]))
    refused(tmp_path / "out", parts, r"part4: expected only its own episodes but has")
