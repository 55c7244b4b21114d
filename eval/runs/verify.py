"""Does every log of a run prove its row, and is that row the one in the tables?"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.episode.trace import Trace
from beacon_mj.errors import BeaconError, LogError, RunError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import OPTIONAL
from beacon_mj.eval.runs.frame import varied_settings
from beacon_mj.eval.runs.log_files import log_file
from beacon_mj.eval.runs.run_folder import (
    LINES,
    TABLE,
    load_config,
    load_rows,
    read_table,
)
from beacon_mj.eval.runs.scene_cache import released_scene_suite
from beacon_mj.eval.runs.variants import text_of
from beacon_mj.eval.runs.worker_process import in_parallel
from beacon_mj.files import files_below
from beacon_mj.recording.verify import Verification, verify

Key = tuple[str, str, int]
Rows = Mapping[Key, Mapping[str, Any]]


def logs_below(folder: Path) -> list[Path]:
    """Return all finished logs below a folder, sorted.

    Raises:
        RunError: If there is none.
    """
    found = files_below(folder, ".mcap")
    if not found:
        raise RunError(f"{folder}: expected a folder with logs (*.mcap).")
    return found


def run_of(log: Path) -> Path | None:
    """Return the run folder of a log `RUN/logs/PLANNER/SCENE.mcap`, or None."""
    parents = log.absolute().parents
    if len(parents) < 3 or parents[1].name != "logs":
        return None
    return parents[2] if (parents[2] / LINES).is_file() else None


def tables_of(run: Path) -> dict[str, Rows]:
    """Return the stored rows of a run by key, of every table that it has.

    Raises:
        RunError: If a table cannot be read.
    """
    out: dict[str, Rows] = {LINES: {row.key: row.as_dict() for row in load_rows(run)}}
    if (run / TABLE).is_file():
        columns = varied_settings(load_config(run))
        out[TABLE] = {
            _key(row): _without_settings(_set(row), columns)
            for row in read_table(run / TABLE).to_dicts()
        }
    return out


def _set(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row of a table without columns that only others of its rows have."""
    return {n: v for n, v in row.items() if v is not None or n not in OPTIONAL}


def _without_settings(
    row: Mapping[str, Any], columns: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    """Return a row without the varied settings that are those of its planner.

    One that differs stays, and so becomes a difference from the log's row.
    """
    planner = str(row.get("planner"))
    expected = {
        name: text_of(values[planner]) if planner in values else None
        for name, values in columns.items()
    }
    return {
        name: value
        for name, value in row.items()
        if name not in expected or not _same(value, expected[name])
    }


def _same(value: object, expected: str | None) -> bool:
    if isinstance(value, float) and expected is not None:
        return value == float(expected)
    return (None if value is None else text_of(value)) == expected


def verify_log(path: Path, tables: Mapping[str, Rows] | None = None) -> Verification:
    """Simulate a log again, measure it again, and compare its row with the tables.

    Args:
        path: The log.
        tables: Stored rows of its run, by the name of their file; see `tables_of`.
    """
    try:
        found = verify(path, _row)
        problem = found.problem or _difference(found, tables or {})
    except BeaconError as error:
        found = Verification(
            path=path, steps=0, row_checked=False, row=None, problem=""
        )
        problem = str(error)
    return replace(found, problem=problem)


def _row(trace: Trace) -> dict[str, Any]:
    """Return the row that an episode must have; a suite that it claims is proved."""
    if trace.suite is not None:
        trace = replace(trace, suite=released_scene_suite(trace.scene))
    return measure(trace).as_dict()


def verify_logs(paths: Sequence[Path], workers: int = 1) -> Iterator[Verification]:
    """Verify logs and yield what came of each as it is done, in any order.

    Args:
        paths: The logs; each is compared with the tables of the run it lies in.
        workers: Processes; with 1 everything runs in this one.
    """
    runs = {path: run_of(path) for path in paths}
    known = {run: tables_of(run) if run else {} for run in {*runs.values()}}
    jobs = [(path, _only(path, known[runs[path]])) for path in paths]
    yield from in_parallel(verify_log, jobs, workers)


def missing_logs(run: Path) -> int:
    """Return how many rows of a run have no finished log."""
    logs = (log_file(run, row.planner, row.scene_name) for row in load_rows(run))
    return sum(not log.is_file() for log in logs)


def _only(path: Path, tables: Mapping[str, Rows]) -> dict[str, Rows]:
    """Return the few rows that can be this log's, for its worker."""
    return {
        name: {
            key: row
            for key, row in rows.items()
            if log_file(Path(), key[0], f"{key[1]}_{key[2]:04d}").parts[-2:]
            == path.parts[-2:]
        }
        for name, rows in tables.items()
    }


def _difference(found: Verification, tables: Mapping[str, Rows]) -> str | None:
    """Return how a log's row differs from the tables', naming the column."""
    if not found.row_checked or found.row is None:
        return f"{found.path}: expected a row in its result but there is none."
    for name, rows in tables.items():
        stored = rows.get(_key(found.row))
        if stored is None:
            planner, family, index = _key(found.row)
            episode = f"{planner} in {family}_{index:04d}"
            return f"{found.path}: {name} has no {episode} for a log of this name."
        if problem := _first_column(found.row, _as_json(stored)):
            return f"{found.path}: its row differs from {name}: {problem}"
    return None


def _first_column(log: Mapping[str, Any], stored: Mapping[str, Any]) -> str | None:
    """Return the first column in which two rows differ, the clock's left out."""
    for column in dict.fromkeys([*stored, *log]):
        if column in WALL_CLOCK_COLUMNS:
            continue
        ours, theirs = log.get(column), stored.get(column)
        if ours != theirs or (column in log) != (column in stored):
            return f"{column} is {ours!r} in the log but {theirs!r} there."
    return None


def _key(row: Mapping[str, Any]) -> Key:
    try:
        return str(row["planner"]), str(row["family"]), int(row["scene_index"])
    except (KeyError, TypeError, ValueError) as error:
        raise LogError(
            "Expected a row with planner, family and index but one lacks them."
        ) from error


def _as_json(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row as JSON gives it back: NaN and infinity become None."""
    return dict(msgspec.json.decode(msgspec.json.encode(row)))
