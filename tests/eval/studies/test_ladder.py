"""The ladder of memory: its rungs, who stands on them, and gains that are paired."""

from pathlib import Path

import msgspec
import pytest

from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.overrides import dotted
from beacon_mj.eval.studies.ablation import SITUATIONS, ablation_runs, rungs_of
from beacon_mj.eval.studies.ablation_table import Ablation
from beacon_mj.eval.studies.ladder import (
    RUNGS,
    ladder_of,
    own_rung,
    rungs_below,
)
from tests.eval.traces import trace

NAMES = (
    "none", "failures", "belief", "shared by kind", "shared by scale", "shared by both",
)  # fmt: skip


def test_the_order_of_the_rungs_is_that_of_what_is_kept() -> None:
    assert tuple(rung.name for rung in RUNGS) == NAMES
    by_name = {rung.name: rung for rung in RUNGS}
    for rung in RUNGS[1:]:
        assert rung.below is not None
        assert by_name[rung.below] in rungs_below(rung)
    assert rungs_below(by_name["none"]) == []
    kind = [rung.name for rung in rungs_below(by_name["shared by kind"])]
    assert kind == ["belief", "failures", "none"]


@pytest.mark.parametrize(
    ("planner", "own"),
    [
        ("beacon", "belief"),
        ("beacon-kinds", "shared by kind"),
        ("beacon-voi", "shared by both"),
    ],
)
def test_each_planner_is_taken_down_its_own_ladder(planner: str, own: str) -> None:
    runs, _ = ablation_runs(planner, families=["sparse"], scenes_per_family=1)
    found = rungs_of(runs["noisy"].planners)
    expected = NAMES[: NAMES.index(own) + 1]
    assert tuple(n for n in NAMES if n in found) == expected
    for name, entry in found.items():
        rung = own_rung(dotted(entry.config))
        assert rung is not None
        assert rung.name == name
    assert found[own].name == planner
    assert all(len(e.varied) == 1 for n, e in found.items() if n != own)


def test_a_planner_without_memory_has_no_ladder() -> None:
    runs, _ = ablation_runs("bug2", families=["sparse"], scenes_per_family=1)
    assert rungs_of(runs["noisy"].planners) == {}
    assert ladder_of("noisy", {}, []) == []


def row(planner: str, index: int, steps: int) -> Row:
    return msgspec.structs.replace(
        measure(trace([])),
        planner=planner,
        family="a",
        scene_index=index,
        steps=steps,
        success=True,
        clean_success=True,
    )


def test_gains_are_paired_with_the_rung_below() -> None:
    runs, _ = ablation_runs("beacon-voi", families=["sparse"], scenes_per_family=1)
    found = rungs_of(runs["noisy"].planners)
    saved = dict(zip(NAMES, (50, 40, 30, 10, 25, 5), strict=True))
    rows = [
        row(found[name].name, i, 100 + 70 * i + more)
        for name, more in saved.items()
        for i in range(3)
    ]
    steps = {s.rung: s for s in ladder_of("noisy", found, rows) if s.family == "a"}
    assert tuple(steps) == NAMES
    assert steps["none"].gains is None
    for step in (steps[name] for name in NAMES[1:]):
        assert step.below is not None
        assert step.gains is not None
        gain = float(saved[step.rung] - saved[step.below])
        # Scenes differ by seventy steps, the rungs by the same in each.
        assert step.gains["steps"] == pytest.approx((gain, gain, gain))
    shown = str(Ablation("beacon-voi", [], [*steps.values()], Path("out")))
    assert "-20.0 [-20.0,-20.0]" in shown
    assert max(map(len, shown.splitlines())) <= 80


def test_situations_are_those_that_a_family_can_be_perceived_in() -> None:
    families = ["sparse", "lookalike-doors", "hard-required"]
    runs, _ = ablation_runs("beacon", families=families, scenes_per_family=1)
    assert [*runs] == [*SITUATIONS]
    assert {name: [*run.families] for name, run in runs.items()} == {
        "noisy": families,
        "truth": families,
        "misleading": ["sparse", "hard-required"],
        "noisy, 0.5 m": ["sparse"],
        "noisy, 1 m": ["lookalike-doors", "hard-required"],
        "noisy, 2 m": ["sparse"],
    }
    assert all({*run.scenes} == {*run.families} for run in runs.values())
    only, refs = ablation_runs("beacon", suites=["learning-v1"])
    assert [*only] == ["noisy", "truth", "noisy, 1 m"]
    assert len(refs) == 3 * 102 + 2 * 100 + 2 * 90
