"""Ablations: what is switched off, that effects are paired, and the command."""

import json
from pathlib import Path

import msgspec
import pytest

from beacon_mj.cli import BAD_INPUT, run
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import PlannerEntry
from beacon_mj.eval.studies.ablation import (
    ablation_runs,
    effects_of,
    switches,
)
from beacon_mj.eval.studies.ladder import RUNGS
from tests.eval.traces import trace

SWITCHES = (
    "predict_cascades", "battery_reweighting", "belief.replan_on_belief",
)  # fmt: skip
#: The situations of a family that is sensed as the protocol says.
USUAL = ("noisy", "truth", "misleading", "noisy, 0.5 m", "noisy, 2 m")
LADDER = ({"belief.memory": "failures"}, {"belief.memory": "none"})


def row(planner: str, index: int, steps: int, *, clean: bool = True) -> Row:
    return msgspec.structs.replace(
        measure(trace([])),
        planner=planner,
        family="a",
        scene_index=index,
        steps=steps,
        success=True,
        clean_success=clean,
        obstacles_broken=0 if clean else 1,
    )


def value(entry: PlannerEntry, field: str) -> object:
    """The value of a dotted field in a planner's recorded configuration."""
    found: object = entry.config
    for name in field.split("."):
        assert isinstance(found, dict)
        found = found[name]
    return found


def test_the_switches_of_beacon_are_the_papers_parts() -> None:
    assert switches("beacon") == SWITCHES
    assert switches("bug2") == ()


def test_a_run_for_each_situation_with_every_variant() -> None:
    runs, refs = ablation_runs(
        "beacon", scenes_per_family=3, families=["sparse"], seed=7
    )
    assert [*runs] == [*USUAL]
    assert len(refs) == 3
    for config in runs.values():
        assert [dict(e.settings) for e in config.planners] == [
            {}, *LADDER, *({switch: "false"} for switch in SWITCHES)
        ]  # fmt: skip
        assert all(
            value(e, s) is (s not in e.settings)
            for e in config.planners
            for s in SWITCHES
        )
    assert runs["misleading"].perception == "misleading"
    assert runs["noisy, 2 m"].protocol.sensing_radius_m == 2.0
    assert runs["noisy"].protocol.sensing_radius_m is None  # The scene's, or 1 m.


def test_what_the_user_switched_off_stays_off() -> None:
    settings = ["beacon.predict_cascades=false", "beacon.belief.memory=failures"]
    runs, _ = ablation_runs("beacon", settings, scenes_per_family=1)
    whole, *variants = runs["noisy"].planners
    assert value(whole, "predict_cascades") is False
    assert len(variants) == len(SWITCHES)  # One switch less, and one rung.
    assert all(value(v, "predict_cascades") is False for v in variants)
    memories = [value(v, "belief.memory") for v in variants]
    assert memories == ["none", "failures", "failures"]


def test_effects_are_paired_differences_to_the_whole_planner() -> None:
    entries = ablation_runs("beacon", scenes_per_family=1)[0]["noisy"].planners[:2]
    names = [entry.name for entry in entries]
    rows = [row(names[0], i, 100 + 50 * i) for i in range(3)]
    rows += [row(names[1], i, 107 + 50 * i, clean=i > 0) for i in range(3)]
    effects = {
        (e.family, e.variant): e for e in effects_of("noisy", entries, rows[::-1])
    }
    whole, off = effects["a", ""], effects["a", "belief.memory=failures"]
    assert whole.costs["steps"].estimate == pytest.approx(150.0)
    assert whole.clean == 3
    # Scenes differ by fifty steps, the variant by seven in each: no spread is left.
    assert off.costs["steps"] == pytest.approx((7.0, 7.0, 7.0))
    assert off.costs["obstacles_broken"].estimate == pytest.approx(1.0 / 3.0)
    assert off.clean_rate.estimate == pytest.approx(-1.0 / 3.0)
    assert (off.success, off.clean) == (3, 2)
    assert effects["overall", "belief.memory=failures"].costs == off.costs


def test_several_planners_are_refused() -> None:
    with pytest.raises(RunError, match="one planner"):
        ablation_runs("all")


def test_the_command_runs_resumes_and_prints(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "ablation"
    command = ["ablate", "--planner", "beacon-voi", "--family", "sparse",
               "-n", "1", "--workers", "1", "--out", str(out)]  # fmt: skip
    assert run([*command, "--json"]) == 0
    effects = json.loads(capfd.readouterr().out)
    assert {e["situation"] for e in effects} == {*USUAL}
    assert json.loads((out / "ablation.json").read_text()) == effects
    ladder = json.loads((out / "ladder.json").read_text())
    assert [s["rung"] for s in ladder if s["situation"] == "noisy"] == 2 * [
        rung.name for rung in RUNGS
    ]
    rows = (out / "noisy-2m" / "episodes.jsonl").read_bytes()
    assert run(command) == 0
    assert (out / "noisy-2m" / "episodes.jsonl").read_bytes() == rows
    shown = capfd.readouterr().out
    assert "misleading" in shown
    assert max(map(len, shown.splitlines())) <= 80


def test_an_unknown_planner_is_one_line(capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["ablate", "--planner", "becon"]) == BAD_INPUT
    err = capfd.readouterr().err
    assert "beacon" in err
    assert len(err.splitlines()) == 1
