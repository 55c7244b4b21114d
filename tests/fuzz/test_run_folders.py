"""Run folders of strangers: configuration, rows, table and summary with anything in."""

import functools
import json
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import NamedTuple

import pytest

import beacon_mj
from tests.fuzz.harness import SECONDS, Kind, attempt
from tests.fuzz.mutations import damaged, mutated, text_of

FILES = ("config.json", "episodes.jsonl", "summary.json", "episodes.parquet")


@functools.cache
def base() -> dict[str, bytes]:
    """Return the files of a run of two planners, by path below its folder."""
    limits = {"protocol.max_steps": 3, "protocol.decision_limit_s": 3600}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        beacon_mj.evaluate(
            ["push-through", "bug1"],
            families=["sparse"],
            scenes_per_family=1,
            settings=limits,
            vary={"bug1.turn": ["left", "right"]},
            workers=1,
            report=False,
            out=out,
        )
        files = [path for path in out.rglob("*") if path.is_file()]
        return {str(path.relative_to(out)): path.read_bytes() for path in files}


class Input(NamedTuple):
    """New content of a file of the run."""

    name: str
    data: bytes


def make(rng: Random) -> Input:
    name = rng.choice(FILES)
    data = base()[name]
    if name == "episodes.parquet" or rng.random() < 0.3:
        return Input(name, damaged(data, rng))
    if name == "episodes.jsonl":
        lines = data.splitlines()
        k = rng.randrange(len(lines))
        lines[k] = text_of(mutated(json.loads(lines[k]), rng))
        return Input(name, b"\n".join([*lines, b""]))
    return Input(name, text_of(mutated(json.loads(data), rng)))


def check(given: Input, folder: Path) -> bool:
    """Load, tabulate and verify the run."""
    run = folder / "run"
    for name, data in {**base(), given.name: given.data}.items():
        (run / name).parent.mkdir(parents=True, exist_ok=True)
        (run / name).write_bytes(data)
    results = attempt(lambda: beacon_mj.load_results(run))
    if results is not None:
        attempt(lambda: (results.summary(), str(results.table()), results.rows))
    found = attempt(lambda: beacon_mj.verify(run, workers=1))
    assert found is None or found.ok or found.problems
    return found is None or not found.ok


RUN_FOLDERS = Kind("run folders", make, check)
test_run_folders, test_run_folders_long = RUN_FOLDERS.short(), RUN_FOLDERS.long()


def test_the_run_that_is_changed_is_sound(tmp_path: Path) -> None:
    assert not check(Input("summary.json", base()["summary.json"]), tmp_path)


def _row(**changes: object) -> bytes:
    first = json.loads(base()["episodes.jsonl"].splitlines()[0])
    return text_of(first | changes) + b"\n"


def _config(**changes: object) -> bytes:
    return text_of(json.loads(base()["config.json"]) | changes)


def _planner(**changes: object) -> bytes:
    config = json.loads(base()["config.json"])
    config["planners"][0] |= changes
    return text_of(config)


DEEP = b'"x": ' + b"[" * 50_000 + b"]" * 50_000
#: Inputs that once ended in a traceback, or took all memory.
FOUND: dict[str, Callable[[], Input]] = {
    "index that no table holds": lambda: Input(
        "episodes.jsonl", _row(scene_index=10**30)
    ),
    "steps below zero": lambda: Input("episodes.jsonl", _row(steps=-(10**20))),
    "setting that is only claimed": lambda: Input(
        "config.json", _planner(varied={"push-through.nope.x": "1"})
    ),
    "protocol's setting that is only claimed": lambda: Input(
        "config.json", _planner(varied={"protocol.nope": "1"})
    ),
    "deep configuration": lambda: Input(
        "config.json", _planner(config={"x": 0}).replace(b'"x": 0', DEEP)
    ),
    "deep summary": lambda: Input("summary.json", b"[" * 200_000),
    "a million scenes of each of a thousand families": lambda: Input(
        "config.json",
        _config(
            families={f"f{k}": "0" for k in range(1000)},
            scenes={},
            scenes_per_family=10**6,
        ),
    ),
    "no UTF-8": lambda: Input(
        "config.json", _planner(home="HOME").replace(b"HOME", b"\xff\xfe")
    ),
}


@pytest.mark.parametrize("name", FOUND)
def test_run_folders_that_were_once_found(name: str, tmp_path: Path) -> None:
    began = time.process_time()
    assert check(FOUND[name](), tmp_path)
    assert time.process_time() - began < SECONDS


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize("name", FILES)
def test_only_regular_files_of_a_run_are_read(name: str, tmp_path: Path) -> None:
    assert not check(Input(name, base()[name]), tmp_path)
    (tmp_path / "run" / name).unlink()
    os.mkfifo(tmp_path / "run" / name)
    if name in FILES[:2]:
        assert attempt(lambda: beacon_mj.load_results(tmp_path / "run")) is None
    else:
        found = attempt(lambda: beacon_mj.verify(tmp_path / "run", workers=1))
        assert found is None or not found.ok
