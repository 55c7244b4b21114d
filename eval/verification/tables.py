"""Level `tables`: every planned episode has its row, and every table is of the rows."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from beacon_mj.errors import BeaconError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig, SceneRef
from beacon_mj.eval.runs.frame import frame
from beacon_mj.eval.runs.run_folder import (
    BAD_JSON,
    CONFIG,
    LINES,
    MAX_BYTES,
    REPORT,
    SUMMARY,
    TABLE,
    load_config,
    load_rows,
    read_table,
)
from beacon_mj.eval.runs.runner import plan
from beacon_mj.eval.statistics.results import Results
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.eval.verification.checks import Check
from beacon_mj.regular_files import read_regular

TOLERANCE = 1e-9  #: Relative; means and bootstraps are no part of what is bit-equal.


def check_tables(run: Path, refs: Sequence[SceneRef]) -> Check:
    """Compare a run's files with its rows, and its rows with what was planned.

    Args:
        run: The run folder.
        refs: The scenes that its configuration plans.
    """
    config, rows = load_config(run), load_rows(run)
    problems = [
        *_unplanned(run, config, refs, rows),
        *_repeated(run, rows),
        *_hashes(run, rows),
        *_table(run, config, rows),
        *_summary(run, rows),
        *_report(run, config, rows),
    ]
    names = [n for n in (LINES, TABLE, SUMMARY, REPORT) if (run / n).is_file()]
    return Check(
        level="tables",
        problems=tuple(problems),
        note=f"{len(rows)} rows compared with the plan; {', '.join(names)}",
    )


def _unplanned(
    run: Path, config: RunConfig, refs: Sequence[SceneRef], rows: Sequence[Row]
) -> Iterator[str]:
    """Yield how the episodes differ from those that are planned."""
    planned = {
        (name, ref.family, ref.index)
        for job in plan(config, refs)
        for ref in job.refs
        for name in job.planners
    }
    have = {row.key for row in rows}
    if missing := sorted(planned - have):
        yield (
            f"{run}: {len(missing)} of {len(planned)} planned episodes are missing, "
            f"such as {_episode(missing[0])}"
        )
    if foreign := sorted(have - planned):
        yield (
            f"{run}: {len(foreign)} episodes were never planned, such as "
            f"{_episode(foreign[0])}"
        )
    if not planned:
        yield f"{run}: plans no episode at all"


def _episode(key: tuple[str, str, int]) -> str:
    return f"{key[0]} in {key[1]}_{key[2]:04d}"


def _repeated(run: Path, rows: Sequence[Row]) -> Iterator[str]:
    """Yield whether an episode has several lines, of which only the first counts."""
    lines = (run / LINES).read_bytes().count(b"\n")
    if lines != len(rows):
        yield f"{run / LINES}: {lines} lines hold {len(rows)} episodes"


def _hashes(run: Path, rows: Sequence[Row]) -> Iterator[str]:
    """Yield which scene is not the same one for every planner."""
    known: dict[str, str] = {}
    for row in rows:
        if known.setdefault(row.scene_name, row.scene_sha256) != row.scene_sha256:
            yield f"{run / LINES}: {row.scene_name} is not one scene for every planner"
            return
    stored = msgspec.json.decode((run / CONFIG).read_bytes()).get("scene_sha256")
    if stored != known:
        yield f"{run / CONFIG}: its scene_sha256 are not those of {LINES}"


def _table(run: Path, config: RunConfig, rows: Sequence[Row]) -> Iterator[str]:
    """Yield how the Parquet table differs from the rows."""
    path = run / TABLE
    if not path.is_file():
        yield f"{path}: is not there: the run is unfinished"
        return
    stored, ours = read_table(path), frame(rows, config)
    if stored.schema != ours.schema:
        yield f"{path}: its columns are not those of the rows"
    elif len(stored) != len(ours):
        yield f"{path}: has {len(stored)} rows where {LINES} has {len(ours)}"
    else:
        for name in ours.columns:
            if not stored[name].equals(ours[name], null_equal=True):
                yield f"{path}: differs from {LINES} in column {name}"
                return


def _summary(run: Path, rows: Sequence[Row]) -> Iterator[str]:
    """Yield where the summary is not that of the rows."""
    path = run / SUMMARY
    if not path.is_file():
        yield f"{path}: is not there: the run is unfinished"
        return
    try:
        stored = msgspec.json.decode(read_regular(path, MAX_BYTES))
    except (*BAD_JSON, OSError) as error:
        yield f"{path}: not valid JSON: {error}"
        return
    ours = msgspec.json.decode(msgspec.json.encode(summarize(rows)))
    if (where := first_difference(stored, ours)) is not None:
        yield f"{path}: is not the summary of {LINES}: {where}"


def first_difference(stored: Any, ours: Any, path: str = "") -> str | None:
    """Say where two values of JSON differ, up to rounding, or return None."""
    if isinstance(stored, dict) and isinstance(ours, dict):
        for key in dict.fromkeys([*ours, *stored]):
            if key not in stored or key not in ours:
                return f"{path}{key} is only in one of them"
            if found := first_difference(stored[key], ours[key], f"{path}{key}."):
                return found
        return None
    if isinstance(stored, list) and isinstance(ours, list) and len(stored) == len(ours):
        for k, (a, b) in enumerate(zip(stored, ours, strict=True)):
            if found := first_difference(a, b, f"{path}{k}."):
                return found
        return None
    if _same(stored, ours):
        return None
    return f"{path.rstrip('.')} is {stored!r} there but {ours!r} by the rows"


def _same(stored: Any, ours: Any) -> bool:
    numbers = all(
        isinstance(v, int | float) and not isinstance(v, bool) for v in (stored, ours)
    )
    if numbers:
        return math.isclose(stored, ours, rel_tol=TOLERANCE, abs_tol=1e-12)
    return type(stored) is type(ours) and bool(stored == ours)


def _report(run: Path, config: RunConfig, rows: Sequence[Row]) -> Iterator[str]:
    """Yield whether the tables of the page are not those of the rows."""
    path = run / REPORT
    if not path.is_file():
        return
    from beacon_mj.eval.report.check import page_problem  # Draws: half a second.

    try:
        page = read_regular(path, MAX_BYTES).decode()
        problem = page_problem(page, Results(run, config, rows))
    except (BeaconError, OSError, UnicodeDecodeError) as error:
        problem = str(error)
    if problem is not None:
        yield f"{path}: {problem}"
