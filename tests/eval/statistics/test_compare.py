"""Comparing arms: what is paired, what is refused, and what a gate catches."""

from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj import cli
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.run_folder import RunFolder
from beacon_mj.eval.statistics.compare import Comparison, compare_pairs
from beacon_mj.eval.statistics.intervals import mcnemar, paired_interval
from beacon_mj.eval.statistics.pairing import Arm, comparisons, match
from beacon_mj.eval.statistics.regression_gates import parse_gate, violations
from beacon_mj.eval.statistics.results import load_results
from beacon_mj.eval.statistics.summary import summarize
from tests.eval.runs.test_runner import configured
from tests.eval.statistics.test_summary import row


def rows(
    lengths: Sequence[float], won: Sequence[bool], planner: str = "p", family: str = "f"
) -> list[Row]:
    return [
        row(family, k, success, length, planner)
        for k, (length, success) in enumerate(zip(lengths, won, strict=True))
    ]


def arm(label: str, lengths: Sequence[float], won: Sequence[bool]) -> Arm:
    return Arm(label, rows(lengths, won))


def only(first: Arm, baseline: Arm) -> Comparison:
    [found] = compare_pairs([match(first, baseline)])
    return found


def write_run(path: Path, planners: Sequence[str], found: Sequence[Row]) -> Path:
    """Write a whole run folder with the given rows."""
    config = configured(["push-through"])[0]
    entries = tuple(
        msgspec.structs.replace(config.planners[0], name=name) for name in planners
    )
    config = msgspec.structs.replace(config, planners=entries)
    folder = RunFolder(path)
    folder.create(config)
    folder.append(found)
    folder.finish(config, found, summarize(found))
    return path


A = arm("a", [4.0, 5.0, 6.0, 9.0], [True, True, False, True])
B = arm("b", [5.0, 5.0, 4.0, 8.0], [True, True, True, False])


def test_success_is_judged_by_mcnemar() -> None:
    success = only(A, B).cells["overall"].rates["success"]
    assert (success.only_first, success.only_baseline) == (1, 1)
    assert success.difference.estimate == 0.0
    won = [[r.success for r in a.rows] for a in (A, B)]
    assert success.p_value == mcnemar(won[0], won[1])


def test_costs_are_compared_where_both_solved_and_over_all() -> None:
    path = only(A, B).cells["overall"].costs["path_length_m"]
    assert path.solved.n == 2
    assert path.solved.estimate == pytest.approx(-0.5)
    assert (path.solved.first, path.solved.baseline) == pytest.approx((4.5, 5.0))
    assert path.all.n == 4
    assert path.all.estimate == pytest.approx(0.5)
    # Shorter, equal, lost the scene, won it: (1 + 1/2 + 0 + 1) / 4.
    assert path.improvement.probability == pytest.approx(2.5 / 4.0)


def test_swapping_the_arms_turns_every_sign() -> None:
    there, back = only(A, B).cells["f"], only(B, A).cells["f"]
    for name, cost in there.costs.items():
        other = back.costs[name]
        assert cost.all.estimate == pytest.approx(-other.all.estimate)  # type: ignore[operator]
        total = cost.improvement.probability + other.improvement.probability
        assert total == pytest.approx(1.0)


def test_intervals_are_those_of_the_paired_bootstrap() -> None:
    rng = np.random.default_rng(3)
    x, y = rng.gamma(3.0, size=40), rng.gamma(3.0, size=40)
    found = only(arm("a", [*x], [True] * 40), arm("b", [*y], [True] * 40))
    path = found.cells["overall"].costs["path_length_m"].solved
    first, second = (
        [r.path_length_m for r in rows([*values], [True] * 40)] for values in (x, y)
    )
    expected = paired_interval(first, second)
    assert (path.low, path.high) == pytest.approx(expected[1:])


def test_nothing_solved_by_both_is_said_and_not_invented() -> None:
    cell = only(arm("a", [1.0], [True]), arm("b", [1.0], [False])).cells["overall"]
    path = cell.costs["path_length_m"]
    assert (path.solved.n, path.solved.estimate, path.solved.low) == (0, None, None)
    assert (path.all.estimate, path.all.low) == (0.0, None)
    assert path.improvement.probability == 1.0


def test_p_values_are_adjusted_for_their_number() -> None:
    n = 12
    base = arm("base", [1.0] * n, [False] * n)
    arms = [arm("x", [1.0] * n, [True] * k + [False] * (n - k)) for k in (6, 8, 12)]
    found = compare_pairs([match(a, base) for a in arms])
    raw = [c.cells["overall"].rates["success"].p_value for c in found]
    assert [c.p_holm for c in found] == pytest.approx(
        [raw[0], max(2 * raw[1], 3 * raw[2]), 3 * raw[2]]
    )


def test_order_of_rows_does_not_matter() -> None:
    turned = Arm("a", A.rows[::-1])
    assert only(turned, B) == only(A, B)


def test_other_scenes_are_refused_and_named() -> None:
    fewer = Arm("fewer", B.rows[:2])
    with pytest.raises(RunError, match=r"2 are missing in fewer: f_0002, f_0003"):
        match(fewer, A)
    changed = msgspec.structs.replace(B.rows[0], scene_sha256="other")
    with pytest.raises(RunError, match=r"1 are other scenes of the same name: f_0000"):
        match(Arm("changed", [changed, *B.rows[1:]]), A)


def test_common_scenes_are_compared_on_demand() -> None:
    found = match(Arm("fewer", B.rows[:3]), A, common=True)
    assert (len(found.pairs), found.left_out) == (3, 1)
    stranger = msgspec.structs.replace(B.rows[0], scene_sha256="other")
    with pytest.raises(RunError, match="they share none"):
        match(Arm("stranger", [stranger]), A, common=True)


@pytest.mark.parametrize(
    ("text", "fails"),
    [
        ("success < -0.02", False),
        ("success <= 0", True),
        ("path_length_m < 0", True),
        ("path_length_m:all < 0", False),
        ("path_length_m:all > 0", True),
        ("f/path_length_m < -0.4", True),
        ("success.low < -0.3", True),
        ("energy_j.high < -1e6", False),
    ],
)
def test_gates(text: str, fails: bool) -> None:
    lines = violations([parse_gate(text)], [only(A, B)])
    assert bool(lines) == fails
    assert all(line.startswith(f"{text}: a against b: it is ") for line in lines)


def test_a_gate_over_nothing_fails() -> None:
    found = only(arm("a", [1.0], [True]), arm("b", [1.0], [False]))
    [line] = violations([parse_gate("path_length_m > 1")], [found])
    assert "no such difference" in line


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sucess < 0", "Did you mean 'success'"),
        ("success", "such as 'success < -0.02'"),
        ("success < x", "and a number"),
        ("success < nan", "and a number"),
        ("", "and a number"),
    ],
)
def test_a_bad_gate_is_refused(text: str, words: str) -> None:
    with pytest.raises(RunError, match=words):
        parse_gate(text)


def test_a_gate_on_an_unknown_family_is_refused() -> None:
    with pytest.raises(RunError, match="family 'g'"):
        violations([parse_gate("g/success < 0")], [only(A, B)])


@pytest.fixture
def run(tmp_path: Path) -> Path:
    found = rows([4.0, 5.0], [True, True], "x") + rows([5.0, 6.0], [True, False], "y")
    return write_run(tmp_path / "run", ["x", "y"], found)


def labels(found: Sequence[tuple[Arm, Arm]]) -> list[tuple[str, str]]:
    return [(a.label, b.label) for a, b in found]


def test_arms_of_one_run(run: Path) -> None:
    assert labels(comparisons([load_results(run)])) == [("y", "x")]
    assert labels(comparisons([load_results(run)], "y")) == [("x", "y")]


def test_arms_of_several_runs(run: Path, tmp_path: Path) -> None:
    one = write_run(tmp_path / "new", ["x"], rows([4.0, 4.0], [True, True], "x"))
    other = write_run(tmp_path / "z", ["z"], rows([4.0, 4.0], [True, True], "z"))
    first, new, z = load_results(run), load_results(one), load_results(other)
    assert labels(comparisons([first, new])) == [("x (new)", "x (run)")]
    assert labels(comparisons([new, z])) == [("z (z)", "x (new)")]
    assert labels(comparisons([first, z], "y")) == [("z (z)", "y (run)")]
    with pytest.raises(RunError, match="--baseline to compare"):
        comparisons([first, z])


def test_a_run_of_one_planner_has_nothing_to_compare(tmp_path: Path) -> None:
    path = write_run(tmp_path / "run", ["x"], rows([1.0], [True], "x"))
    with pytest.raises(RunError, match="expected a planner to compare with 'x'"):
        comparisons([load_results(path)])


Refused = Callable[[Sequence[str]], str]


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Refused:
    def call(arguments: Sequence[str]) -> str:
        assert cli.run(["compare", *arguments]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.count("\n") == 1
        return err

    return call


def test_bad_input_is_one_line(run: Path, tmp_path: Path, refused: Refused) -> None:
    assert "expected a run folder" in refused([str(tmp_path / "nowhere")])
    assert "planner 'w'" in refused([str(run), "--baseline", "w"])
    assert "Did you mean 'success'" in refused([str(run), "--fail-if", "succes < 0"])
    fewer = write_run(tmp_path / "fewer", ["x"], rows([4.0], [True], "x"))
    assert "missing in x (fewer): f_0001" in refused([str(run), str(fewer)])
    empty = write_run(tmp_path / "empty", ["x"], [])
    assert "expected finished episodes" in refused([str(empty)])


def test_the_command(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["compare", str(run)]) == 0
    out, _ = capsys.readouterr()
    assert "y against x" in out
    assert max(map(len, out.splitlines())) <= 80
    gate = ["--fail-if", "success < -0.02", "--fail-if", "steps > 99"]
    assert cli.run(["compare", str(run), *gate, "--json"]) == 1
    out, err = capsys.readouterr()
    found = msgspec.json.decode(out)
    assert found["comparisons"][0]["cells"]["f"]["scenes"] == 2
    assert err == "failed: success < -0.02: y against x: it is -0.5\n"
    assert found["failed"] == ["success < -0.02: y against x: it is -0.5"]


def test_a_run_equals_itself(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gates = ["--fail-if", "success < 0", "--fail-if", "path_length_m > 0"]
    assert cli.run(["compare", str(run), str(run), *gates]) == 0
    assert "x" in capsys.readouterr().out


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=6))
def test_every_scene_is_counted(won: list[tuple[bool, bool]]) -> None:
    n = len(won)
    found = only(
        arm("a", [1.0] * n, [a for a, _ in won]),
        arm("b", [1.0] * n, [b for _, b in won]),
    )
    cell = found.cells["overall"]
    success = cell.rates["success"]
    both = cell.costs["steps"].solved.n
    neither = sum(not (a or b) for a, b in won)
    assert both + neither + success.only_first + success.only_baseline == n
    assert cell.scenes == n
