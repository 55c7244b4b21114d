"""The tables of a run."""

import math

import msgspec
import pytest

from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row, rows_sha256
from beacon_mj.eval.statistics.intervals import wilson_interval
from beacon_mj.eval.statistics.summary import summarize
from tests.eval.traces import step, trace


def row(
    family: str, index: int, success: bool, path_m: float, planner: str = "p"
) -> Row:
    made = measure(trace([step(1, x_m=path_m)]))
    return msgspec.structs.replace(
        made,
        planner=planner,
        family=family,
        scene_index=index,
        scene_sha256=f"{family}{index}",
        success=success,
        clean_success=success and index == 0,
        outcome="reached" if success else "stuck",
        excess_length_m=1.0 if success else None,
    )


def test_counts_intervals_and_both_kinds_of_means() -> None:
    rows = [
        row("one", 0, True, 4.0),
        row("one", 1, False, 10.0),
        row("two", 0, True, 6.0),
        row("two", 1, True, 8.0),
    ]
    summary = summarize(rows[::-1])
    assert summary["episodes"] == 4
    cells = summary["tables"]["p"]
    assert list(cells) == ["overall", "one", "two"]
    low, high = wilson_interval(3, 4)
    assert cells["overall"]["success"] == {
        "count": 3,
        "n": 4,
        "rate": 0.75,
        "low": low,
        "high": high,
    }
    assert cells["overall"]["clean_success"]["count"] == 2
    assert cells["one"]["success"]["rate"] == 0.5
    path = cells["overall"]["mean"]["path_length_m"]
    assert (path["mean"], path["n"]) == (pytest.approx(7.0), 4)
    assert 4.0 <= path["low"] < 7.0 < path["high"] <= 10.0
    solved = cells["overall"]["mean_over_successes"]
    assert solved["path_length_m"]["mean"] == pytest.approx(6.0)
    assert solved["path_length_m"]["n"] == 3
    assert cells["overall"]["outcomes"]["stuck"] == 1
    assert sum(cells["overall"]["outcomes"].values()) == 4
    nothing = {"mean": None, "n": 0, "low": None, "high": None}
    assert cells["one"]["mean"]["excess_length_m"] == nothing | {"mean": 1.0, "n": 1}
    assert cells["one"]["mean"]["brier_prior"] == nothing


def test_a_planner_that_never_succeeds_still_has_its_tables() -> None:
    summary = summarize([row("one", 0, False, 1.0), row("one", 0, True, 1.0, "q")])
    cell = summary["tables"]["p"]["overall"]
    assert (cell["success"]["count"], cell["success"]["n"]) == (0, 1)
    assert cell["mean_over_successes"]["path_length_m"]["mean"] is None
    assert msgspec.json.decode(msgspec.json.encode(summary)) == summary


def test_the_digest_of_rows_is_of_their_numbers_and_not_of_the_clock() -> None:
    rows = [row("one", 0, True, 4.0), row("two", 1, False, 10.0)]
    digest = rows_sha256(rows)
    assert summarize(rows)["rows_sha256"] == digest
    assert rows_sha256(rows[::-1]) == digest
    slower = [
        msgspec.structs.replace(r, wall_time_s=9.0, plan_ms_p50=1.0) for r in rows
    ]
    assert rows_sha256(slower) == digest
    last_bit = math.nextafter(rows[0].path_length_m, math.inf)
    other = msgspec.structs.replace(rows[0], path_length_m=last_bit)
    assert rows_sha256([other, rows[1]]) != digest
    assert rows_sha256(rows[:1]) != digest
