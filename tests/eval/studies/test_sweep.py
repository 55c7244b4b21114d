"""The sweep: Table I's grid, the criterion, two splits, resuming, optuna."""

import math
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from operator import attrgetter
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

import beacon_mj
from beacon_mj import cli
from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import BeaconError, RunError
from beacon_mj.eval.runs.run_folder import load_config, load_rows
from beacon_mj.eval.runs.variants import variant
from beacon_mj.eval.statistics.summary import rate
from beacon_mj.eval.studies import search
from beacon_mj.eval.studies.parameter_grid import TABLE_I, settings_of, swept
from beacon_mj.eval.studies.sweep import (
    Score,
    SweepRequest,
    base_entry,
    best,
    best_alone,
    combination,
    order_agreement,
    report_config,
    select_config,
    swept_lines,
)
from beacon_mj.eval.studies.sweep_run import Result, run_sweep
from beacon_mj.planners.beacon import BeaconConfig
from beacon_mj.scene import Robot

TINY = SweepRequest(
    planner="beacon",
    settings=("protocol.max_steps=12",),
    families=("sparse",),
    scenes_per_family=1,
    against=("push-through",),
)


def made(won: int, energy_j: float, **settings: str) -> Score:
    return Score(
        settings=settings,
        success=rate([k < won for k in range(10)]),
        energy_j=(energy_j, energy_j, energy_j),
        steps=100.0,
    )


@contextmanager
def silent(name: str, total: int) -> Iterator[object]:
    assert total > 0
    yield lambda rows: None


def run(request: SweepRequest, out: Path) -> Result:
    return run_sweep(request, out, 1, silent)  # type: ignore[arg-type]


def test_the_grid_is_the_papers() -> None:
    assert [line.field for line in TABLE_I] == [
        "robot_radius_m", "weights.w_e", "lambda_occ", "lambda_sem", "push_bias",
        "detour_margin",
    ]  # fmt: skip
    defaults = BeaconConfig()
    for line in TABLE_I[1:]:
        assert float(line.default) == attrgetter(line.field)(defaults)
        assert line.default in line.values
    # 0 stands for the robot's own.
    assert defaults.robot_radius_m == 0.0
    assert float(TABLE_I[0].default) == Robot().radius_m


def test_one_at_a_time_changes_one_and_full_is_the_product() -> None:
    singles = settings_of(TABLE_I, "one-at-a-time")
    assert singles[0] == {}
    assert [len(s) for s in singles[1:]] == [1] * 11
    full = settings_of(TABLE_I, "full")
    assert full[0] == {}
    assert len({tuple(s.items()) for s in full}) == len(full) == 2 * 3**5
    assert all(single in full for single in singles)


def test_a_variant_is_the_planner_with_other_values() -> None:
    base = base_entry(
        msgspec.structs.replace(TINY, settings=("beacon.weights.w_t=0.7",))
    )
    found = variant(base, {"weights.w_e": "0.5", "push_bias": "0.20"}, Protocol())
    assert found.name == "beacon[weights.w_e=0.5,push_bias=0.20]"
    assert found.config["weights"]["w_e"] == 0.5
    assert found.config["push_bias"] == 0.2
    assert found.config["weights"]["w_t"] == 0.7
    assert variant(base, {}, Protocol()).config == base.config


def test_what_is_varied_is_swept_in_place_of_table_i() -> None:
    vary = ("beacon.push_bias=0.2,0.350", "protocol.max_steps=50,60")
    request = msgspec.structs.replace(TINY, vary=vary, settings=())
    bias, steps = swept_lines(request)
    assert (bias.field, bias.default, bias.values) == (
        "push_bias", "0.350", ("0.2", "0.350"),
    )  # fmt: skip
    assert (steps.field, steps.default) == ("protocol.max_steps", "None")
    assert steps.values == ("None", "50", "60")
    full = settings_of((bias, steps), "full")
    assert len(full) == 6
    entries = select_config(request, full)[0].planners
    protocols = [(e.protocol.max_steps if e.protocol else None) for e in entries]
    assert Counter(protocols) == {50: 2, 60: 2, None: 2}
    with pytest.raises(RunError, match="target 'bug1'"):
        swept_lines(msgspec.structs.replace(TINY, vary=("bug1.x=1,2",)))


def test_a_planner_without_the_parameters_is_refused() -> None:
    with pytest.raises(RunError, match="bug1: expected a planner with parameters of"):
        swept("bug1")
    with pytest.raises(BeaconError, match="Did you mean 'beacon'"):
        swept("beacno")


@pytest.mark.parametrize(("select", "seed"), [(0, 5), (999, 0), (1000, 1000)])
def test_splits_are_kept_apart(select: int, seed: int) -> None:
    with pytest.raises(RunError, match="--select-seed: expected 1000 or more"):
        SweepRequest(planner="beacon", select_seed=select, seed=seed)


def test_the_splits_differ_in_the_seed_alone() -> None:
    one, refs = select_config(TINY, [{}, {"weights.w_e": "0.5"}])
    two, others = report_config(TINY, {"weights.w_e": "0.5"})
    assert refs == others
    assert (one.seed, two.seed) == (1000, 0)
    assert [e.name for e in one.planners] == ["beacon", "beacon[weights.w_e=0.5]"]
    assert [e.name for e in two.planners] == [
        "push-through", "beacon", "beacon[weights.w_e=0.5]",
    ]  # fmt: skip
    assert [e.name for e in report_config(TINY, {})[0].planners] == [
        "push-through", "beacon",
    ]  # fmt: skip


def test_success_selects_then_energy_then_order() -> None:
    few = made(8, 1.0)
    assert best([few, made(9, 99.0, **{"weights.w_e": "0.5"})]).settings == {
        "weights.w_e": "0.5"
    }
    assert best([made(9, 50.0), made(9, 49.0, **{"weights.w_e": "1.5"})]).settings == {
        "weights.w_e": "1.5"
    }
    assert best([made(9, 50.0), made(9, 50.0, **{"weights.w_e": "1.5"})]).settings == {}


def test_the_best_alone_are_combined() -> None:
    found = [
        made(8, 50.0),
        made(9, 60.0, **{"weights.w_e": "0.5"}),
        made(8, 51.0, lambda_occ="7.5"),
        made(8, 49.0, push_bias="0.20"),
    ]
    assert best_alone(found, TABLE_I[1]) == "0.5"
    assert best_alone(found, TABLE_I[2]) == "5.0"
    assert combination(found, TABLE_I) == {"weights.w_e": "0.5", "push_bias": "0.20"}


@given(
    st.tuples(st.integers(0, 10), st.floats(0.0, 1e4)),
    st.tuples(st.integers(0, 10), st.floats(0.0, 1e4)),
)
def test_one_number_keeps_the_order_of_the_criterion(
    one: tuple[int, float], two: tuple[int, float]
) -> None:
    first, second = made(*one), made(*two)
    if first.merit > second.merit:
        assert search.merit(first) >= search.merit(second)
    if first.merit[0] > second.merit[0]:
        assert search.merit(first) > search.merit(second) - 1e-9


def test_a_sweep_and_its_folder(tmp_path: Path) -> None:
    result = run(TINY, tmp_path / "s")
    assert len(load_rows(tmp_path / "s/select")) == len(result.scores) == 12
    assert load_config(tmp_path / "s/select").seed == 1000
    assert load_config(tmp_path / "s/report").seed == 0
    assert {row.scene_sha256 for row in load_rows(tmp_path / "s/select")}.isdisjoint(
        row.scene_sha256 for row in load_rows(tmp_path / "s/report")
    )
    assert [line.field for line in result.table_i] == [k.field for k in TABLE_I]
    assert {"beacon", "push-through"} <= set(result.report["tables"])
    text = (tmp_path / "s/sweep.json").read_bytes()
    assert msgspec.json.decode(text, type=Result) == msgspec.json.decode(
        msgspec.json.encode(result), type=Result
    )


def timeless(result: Result) -> object:
    plain = msgspec.to_builtins(result)
    for cells in plain["report"]["tables"].values():
        for cell in cells.values():
            for mean in (cell["mean"], cell["mean_over_successes"]):
                del mean["plan_ms_p50"], mean["plan_ms_p99"]
    return plain


def test_a_sweep_that_was_cut_off_goes_on(tmp_path: Path) -> None:
    whole = run(TINY, tmp_path / "whole")
    run(TINY, tmp_path / "cut")
    lines = tmp_path / "cut/select/episodes.jsonl"
    lines.write_bytes(b"".join(lines.read_bytes().splitlines(True)[:5])[:-7])
    (tmp_path / "cut/report/episodes.jsonl").write_bytes(b"")
    (tmp_path / "cut/sweep.json").unlink()
    assert timeless(run(TINY, tmp_path / "cut")) == timeless(whole)
    other = msgspec.structs.replace(TINY, scenes_per_family=2)
    with pytest.raises(RunError, match="cut: expected the options that the sweep"):
        run(other, tmp_path / "cut")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/precious").touch()
    with pytest.raises(RunError, match="mine: expected a new folder or a sweep"):
        run(TINY, tmp_path / "mine")


def test_optuna_goes_on_where_it_stopped(tmp_path: Path) -> None:
    pytest.importorskip("optuna")
    request = msgspec.structs.replace(TINY, trials=3)
    found = [made(8, 50.0), made(9, 60.0, **{"weights.w_e": "0.5"})]

    def tried(number: int, settings: object) -> Score:
        if stop == number:
            raise KeyboardInterrupt
        assert isinstance(settings, dict)
        energy = math.fsum(float(value) for value in settings.values())
        return made(9, energy, **settings)

    stop = -1
    (tmp_path / "whole").mkdir()
    whole = search.search(request, tmp_path / "whole", found, tried)
    assert len(whole) == 3
    assert len({tuple(score.settings.values()) for score in whole}) == 3
    assert set(whole[0].settings) == {line.field for line in TABLE_I}
    (tmp_path / "cut").mkdir()
    for stop in (0, 2):  # noqa: B007 - `tried` looks at it.
        with pytest.raises(KeyboardInterrupt):
            search.search(request, tmp_path / "cut", found, tried)
    stop = -1
    assert search.search(request, tmp_path / "cut", found, tried) == whole


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "s")
    arguments = [
        "sweep", "--planner", "beacon", "--family", "sparse", "-n", "1",
        "--workers", "1", "--set", "protocol.max_steps=12", "--out", out,
    ]  # fmt: skip
    assert cli.run(arguments) == 0
    text, _ = capsys.readouterr()
    for word in ("Table I", "Table III", "robot_radius_m", "0/1", "[0,79]", "dstar"):
        assert word in text
    assert max(map(len, text.splitlines())) <= 80
    assert cli.run(arguments) == 2
    assert "Use --resume" in capsys.readouterr().err
    assert cli.run([*arguments, "--resume", "--json"]) == 0
    assert msgspec.json.decode(capsys.readouterr().out, type=Result).selected == {}


def test_a_planar_sweep_screens_in_the_plane_and_confirms_in_mujoco(
    tmp_path: Path,
) -> None:
    found = beacon_mj.sweep(
        "beacon",
        vary={"beacon.push_bias": [0.2, 0.35], "beacon.robot_radius_m": [0.12, 0.45]},
        grid="full",
        world="planar",
        families=["collision-required"],
        scenes_per_family=2,
        workers=1,
        out=tmp_path / "sweep",
    )
    worlds = {
        stage: load_config(tmp_path / "sweep" / stage).protocol.is_planar
        for stage in ("select", "confirm", "report")
    }
    assert worlds == {"select": True, "confirm": False, "report": False}
    confirmed = found.result.confirmed
    assert not isinstance(confirmed, msgspec.UnsetType)
    assert len(confirmed) == len(found.result.scores) == 6
    best = max(confirmed, key=lambda score: score.merit)
    assert found.result.selected == best.settings
    assert "rank correlation of both worlds" in str(found)


def test_the_order_of_two_worlds_is_compared_by_rank() -> None:
    def scored(*successes: int) -> list[Score]:
        return [
            Score(
                settings={"x": str(k)},
                success={"count": count},
                energy_j=(1.0, None, None),
                steps=1.0,
            )
            for k, count in enumerate(successes)
        ]

    up, down = scored(1, 2, 3, 4, 5), scored(5, 4, 3, 2, 1)
    assert order_agreement(up, up)[0] == pytest.approx(1.0)
    assert order_agreement(up, down)[0] == pytest.approx(-1.0)
    value, low, high = order_agreement(up, scored(1, 2, 3, 5, 4))
    assert value == pytest.approx(0.9)
    assert low is not None
    assert high is not None
    assert low < 0.9 < high
