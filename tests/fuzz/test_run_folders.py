"""Run folders of strangers: configuration, rows, table and summary with anything in."""

import functools
import json
import tempfile
from pathlib import Path
from random import Random
from typing import NamedTuple

import beacon_mj
from tests.fuzz.harness import Kind, attempt
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
