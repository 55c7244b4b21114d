"""Whatever a planner does costs its own episode, and its row says what it was."""

import functools
from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest

from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import PlannerEntry, RunConfig
from beacon_mj.eval.runs.jobs import Job
from beacon_mj.eval.runs.runner import plan, run_jobs
from tests.eval import misbehaving as bad
from tests.eval.misbehaving import LATE, Case
from tests.eval.runs.test_runner import configured, timeless

SETTINGS = ("protocol.max_steps=30", "protocol.memory_limit_mib=1024")
#: For cases that wait for it; all others may meet a machine that is busy.
SHORT = "protocol.decision_limit_s=0.3"
GOOD = "push-through"
#: Cases that end the process, or cannot be ended, without isolation.
IN_PROCESS = [
    *(c for c in bad.raising() if c.place != "import"),
    *bad.answers(),
    *bad.writes(),
    *bad.states(),
    next(c for c in bad.loops() if c.name == "LoopAtAct"),
]
#: One of each kind, and each place: a process each, so not all of them every time.
SAMPLE = {
    "ValueErrorAtImport", "InterruptAtConstruct", "BadTextAtReset", "BaseAtAct",
    "LoopAtAct", "SwallowsAtAct", "CompiledAtAct", "DisarmsAtAct", "LeavesZeroAtAct",
    "CrashesAtReset", "KilledAtImport", "HangupAtAct", "AsksAtAct", "Nothing", "Nan",
    "LoneReason", "MovesGoal", "ForcesGoal", "ChangesFolder", "ShallowStack", "Talks",
    "ClosesStdout", "Forks", "LeavesThread", "DeletesForEver",
}  # fmt: skip
ALL = [
    *bad.raising(),
    *bad.loops(),
    *bad.ends(),
    *bad.answers(),
    *bad.writes(),
    *bad.states(),
    *bad.worse_states(),
    *bad.closes(),
]


def run(
    cases: Sequence[Case], folder: Path, workers: int, *, isolated: bool
) -> dict[str, Row]:
    """Run all cases, and a good planner after them, through one scene, with logs."""
    rows: dict[str, Row] = {}
    for late in (True, False):
        own = [case for case in cases if (case.why == LATE) == late]
        settings = (*SETTINGS, SHORT) if late else SETTINGS
        rows |= run_with(settings, own, folder, workers, isolated=isolated)
    return rows


def run_with(
    settings: Sequence[str],
    cases: Sequence[Case],
    folder: Path,
    workers: int,
    *,
    isolated: bool,
) -> dict[str, Row]:
    config, refs = configured([GOOD], settings=settings)
    entries = [
        PlannerEntry(
            name=case.name,
            spec=case.write(folder),
            settings={},
            config={},
            isolated=isolated,
        )
        for case in cases
    ]
    config = msgspec.structs.replace(
        config, planners=(*entries, *config.planners), log="all"
    )
    jobs = [single for job in plan(config, refs) for single in _cut(job, config)]
    found = run_jobs(config, jobs, folder, workers)
    return {row.planner: row for rows in found for row in rows}


def _cut(job: Job, config: RunConfig) -> list[Job]:
    """Cut a job in pieces for several workers; the good planner is in the last."""
    names = [e.name for e in config.planners]
    return [Job(job.refs, tuple(names[k : k + 20])) for k in range(0, len(names), 20)]


@functools.cache
def alone() -> list[dict[str, object]]:
    config, refs = configured([GOOD], settings=SETTINGS)
    return timeless([r for rows in run_jobs(config, plan(config, refs)) for r in rows])


def check(cases: Sequence[Case], rows: dict[str, Row]) -> None:
    assert {*rows} == {GOOD, *(case.name for case in cases)}
    assert timeless([rows[GOOD]]) == alone()
    for case in cases:
        row = rows[case.name]
        assert not row.success, case.name
        if case.why is None:
            assert (row.outcome, row.steps) == ("timeout", 30), (case.name, row.detail)
        else:
            assert row.outcome == "planner_error", case.name
            assert case.why in row.detail, (case.name, row.detail)
            assert len(row.detail) <= 1000
            assert row.detail.isprintable()


def test_the_table_is_long() -> None:
    assert len({case.name for case in ALL}) == len(ALL) > 150
    assert len(IN_PROCESS) > 60
    assert {case.name for case in ALL} > SAMPLE


def test_a_planner_in_this_process_costs_its_own_episode(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    check(IN_PROCESS, run(IN_PROCESS, Path(), 1, isolated=False))


def test_an_isolated_planner_costs_its_own_episode(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    cases = [case for case in ALL if case.name in SAMPLE]
    check(cases, run(cases, Path(), 1, isolated=True))
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_every_isolated_planner_costs_its_own_episode(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, workers: int
) -> None:
    monkeypatch.chdir(tmp_path)
    check(ALL, run(ALL, tmp_path, workers, isolated=True))


@pytest.mark.slow
def test_a_planner_in_a_worker_costs_its_own_episode(tmp_path: Path) -> None:
    check(IN_PROCESS, run(IN_PROCESS, tmp_path, 2, isolated=False))
