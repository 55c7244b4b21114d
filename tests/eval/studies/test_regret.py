"""Regret: the parts add up, only what all solved counts, and the runs are right."""

import json
import math

import msgspec
import pytest

from beacon_mj.cli import BAD_INPUT, run
from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.studies.certify import ORACLE
from beacon_mj.eval.studies.regret import (
    LEVELS,
    MEASURES,
    PARTS,
    Price,
    decompose,
    regret_runs,
)
from tests.eval.traces import trace

COSTS = {ORACLE: 100, "told": 110, "near": 125, "uncertain": 145}


def row(family: str, index: int, steps: int, *, success: bool = True) -> Row:
    return msgspec.structs.replace(
        measure(trace([])),
        family=family,
        scene_index=index,
        steps=steps,
        path_length_m=0.05 * steps,
        energy_j=float(steps),
        success=success,
    )


def rows(family: str, index: int, extra: int = 0) -> list[tuple[str, Row]]:
    return [
        (name, row(family, index, steps + (extra if name == "uncertain" else 0)))
        for name, steps in COSTS.items()
    ]


def by_part(prices: list[Price], family: str) -> dict[str, Price]:
    return {p.part: p for p in prices if p.family == family}


def test_the_parts_are_differences_of_the_runs() -> None:
    found = by_part(decompose(rows("a", 0) + rows("a", 1)), "a")
    steps = {part: price.costs["steps"].estimate for part, price in found.items()}
    assert steps == {ORACLE: 100, "planning": 10, "geometry": 15, "class": 20,
                     "regret": 45}  # fmt: skip
    assert found["regret"].share["steps"] == pytest.approx(0.45)
    assert found["regret"].costs["path_length_m"].estimate == pytest.approx(2.25)


def test_the_parts_add_up_to_the_regret() -> None:
    many = [r for k in range(7) for r in rows("ab"[k % 2], k, extra=k * k)]
    for family in ("overall", "a", "b"):
        found = by_part(decompose(many), family)
        for measure_name in MEASURES:
            parts = [
                found[p].costs[measure_name].estimate for p in PARTS if p != "regret"
            ]
            assert sum(parts) == pytest.approx(
                found["regret"].costs[measure_name].estimate
            )


def test_a_scene_counts_only_where_all_runs_solved_it() -> None:
    failed = [(n, msgspec.structs.replace(r, success=n != "near"))
              for n, r in rows("a", 1)]  # fmt: skip
    missing = rows("a", 2)[:-1]
    price = by_part(decompose(rows("a", 0) + failed + missing), "a")["regret"]
    assert (price.scenes, price.of) == (1, 3)
    assert price.costs["steps"].estimate == 45
    none = by_part(decompose(failed), "a")["regret"]
    assert none.scenes == 0
    assert math.isnan(none.costs["steps"].estimate)


def test_the_runs_differ_in_nothing_but_what_is_known() -> None:
    runs, refs = regret_runs("beacon", families=["sparse"], scenes_per_family=3, seed=5)
    assert len(refs) == 3
    assert list(runs) == [ORACLE, *LEVELS]
    told, near, uncertain = (runs[name] for name in LEVELS)
    assert told.protocol.sensing_radius_m == 100.0
    assert near.protocol == uncertain.protocol == runs[ORACLE].protocol
    assert told.perception == near.perception == "truth"
    assert uncertain.perception == "noisy"
    assert {c.seed for c in runs.values()} == {5}
    assert told.planners == near.planners == uncertain.planners


#: Fields of the protocol that hide nothing from a planner.
RULES = {
    "max_steps", "goal_tolerance_m", "motion_cost_jpm", "battery_ends_episode",
    "stuck_after_s", "stuck_radius_m", "decision_limit_s", "memory_limit_mib",
    "timestep_s", "overnight", "robot", "world", "planar_push",
}  # fmt: skip
NOISE = sorted(set(Protocol.__struct_fields__) - RULES)
NOISY = ["protocol.sensing_radius_m=0.5", "protocol.occlusion=true",
         "protocol.pose_noise_m=0.05", "protocol.missed_detection=0.2",
         "protocol.robot_pose_noise_m=0.02", "protocol.force_noise=0.1",
         "protocol.lidar_beams=8", "protocol.lidar_range_m=2",
         "protocol.lidar_noise_m=0.1", "protocol.lidar_dropout=0.1",
         "protocol.obstacles=none", "protocol.max_steps=77"]  # fmt: skip


def test_who_is_told_everything_is_told_it_exactly() -> None:
    runs, _ = regret_runs("beacon", NOISY, families=["sparse"], scenes_per_family=1)
    assert runs["told"].protocol == Protocol(
        sensing_radius_m=100.0,
        occlusion=False,
        pose_noise_m=0.0,
        missed_detection=0.0,
        robot_pose_noise_m=0.0,
        force_noise=0.0,
        max_steps=77,
    )
    assert runs["near"].protocol.missed_detection == 0.2
    assert runs["near"].protocol.occlusion


@pytest.mark.parametrize("field", NOISE)
def test_no_field_of_the_sensor_is_left_on(field: str) -> None:
    """A new field of the protocol is one of `RULES`, or it says how it is switched off.

    Then what a certain protocol holds of it does not depend on what it was.
    """
    runs, _ = regret_runs("beacon", NOISY, families=["sparse"], scenes_per_family=1)
    value = getattr(runs["near"].protocol, field)
    changed = msgspec.structs.replace(Protocol(), **{field: value})
    assert changed != Protocol()
    assert changed.certain() == Protocol().certain() == Protocol().certain().certain()


def test_the_clairvoyant_has_no_regret() -> None:
    with pytest.raises(RunError, match="other than clairvoyant"):
        regret_runs("clairvoyant", families=["sparse"], scenes_per_family=1)


def test_the_command_prints_every_part(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--family", "sparse", "-n", "2", "--seed", "4000"]
    arguments = ["regret", "--planner", "dstar-lite", *options, "--workers", "1"]
    assert run([*arguments, "--json"]) == 0
    prices = json.loads(capsys.readouterr().out)
    assert [p["part"] for p in prices if p["family"] == "sparse"] == [ORACLE, *PARTS]
    assert all(p["scenes"] == p["of"] == 2 for p in prices)
    assert run(arguments) == 0
    out = capsys.readouterr().out
    assert all(part in out for part in PARTS)
    assert max(len(line) for line in out.splitlines()) <= 80


def test_bad_input_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["regret", "--planner", "all"]) == BAD_INPUT
    assert len(capsys.readouterr().err.splitlines()) == 1
