"""Planners as names, classes and pairs; variants; what they leave in a run."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import beacon_mj
from beacon_mj import Command, Observation, Planner, Task, cli
from beacon_mj.errors import BeaconError, PlannerError, RunError
from beacon_mj.eval.report.command import command_of
from beacon_mj.eval.runs.code_record import MAX_DATA_BYTES, data_of
from beacon_mj.eval.runs.lineup import line_up
from beacon_mj.eval.runs.run_folder import load_config
from beacon_mj.eval.runs.variants import alternatives, text_of, texts_of
from beacon_mj.planners.ppo import SHIPPED
from beacon_mj.planners.push_through import PushThrough
from tests.eval.runs.test_runner import timeless

FEW: dict[str, Any] = {"families": ["sparse"], "workers": 1, "log": "none"}


@dataclass(frozen=True, kw_only=True, slots=True)
class NorthConfig:
    """How `North` drives."""

    speed_mps: float = 0.1


class North(Planner):
    """Drives north."""

    Config = NorthConfig

    def reset(self, task: Task) -> None:
        """Begin."""

    def act(self, observation: Observation) -> Command:
        """Return the one command."""
        return Command(velocity_mps=np.array((0.0, self.config.speed_mps)))


class Broken(North):
    """Fails in its first decision."""

    def act(self, observation: Observation) -> Command:
        """Raise."""
        raise ZeroDivisionError("[here]")  # The line that is named.


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def names(planners: Any, **options: Any) -> list[str]:
    return [entry.name for entry in line_up(planners, **options).entries]


def test_a_registered_class_is_its_name() -> None:
    found = line_up([PushThrough])
    assert found.entries == line_up(["push-through"]).entries
    assert found.handed == {}


@pytest.mark.parametrize(
    ("choice", "speed"),
    [
        (North, 0.1),
        ((North, {"speed_mps": 0.2}), 0.2),
        ((North, NorthConfig(speed_mps=0.3)), 0.3),
    ],
)
def test_a_class_comes_with_its_configuration(choice: Any, speed: float) -> None:
    for planners in (choice, [choice], {"North": choice}):
        found = line_up(planners)
        [entry] = found.entries
        assert (entry.name, entry.config["speed_mps"]) == ("North", speed)
        assert found.handed["North"].cls is North


def test_a_mapping_gives_names() -> None:
    assert names({"a": "bug1", "b": "bug1"}) == ["a", "b"]


@pytest.mark.parametrize(
    ("planners", "options", "words"),
    [
        ([North, North], {}, "'North' repeats"),
        ([3], {}, "subclass of Planner but it was 3"),
        ([Planner], {}, "lacks act, reset"),
        ([(North, 3)], {}, "an instance of NorthConfig"),
        ({"a/b": North}, {}, "can name a folder"),
        ({"a[b]": North}, {}, "can name a folder"),
        ([(North, NorthConfig())], {"vary": {"North.speed_mps": [1]}}, "--vary North"),
        ([(North, NorthConfig())], {"settings": ["North.speed_mps=1"]}, "--set North"),
        ([North], {"vary": {"North.speed_mps": []}}, "values that differ"),
        ([North], {"vary": {"North.speed_mps": ["a/b", "c"]}}, "speed_mps"),
    ],
)
def test_what_is_no_lineup_is_refused(
    planners: Any, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(BeaconError, match=words):
        line_up(planners, **options)


def test_variants_are_every_combination_of_what_a_planner_has() -> None:
    vary = ["North.speed_mps=0.1,0.2", "protocol.max_steps=5,6"]
    found = line_up([North, "bug1"], vary=vary)
    assert [e.name for e in found.entries] == [
        "North[speed_mps=0.1,protocol.max_steps=5]",
        "North[speed_mps=0.1,protocol.max_steps=6]",
        "North[speed_mps=0.2,protocol.max_steps=5]",
        "North[speed_mps=0.2,protocol.max_steps=6]",
        "bug1[protocol.max_steps=5]",
        "bug1[protocol.max_steps=6]",
    ]
    assert [e.protocol.max_steps for e in found.entries if e.protocol] == [5, 6] * 3
    assert {e.base for e in found.entries} == {"North", "bug1"}
    assert set(found.handed) == {e.name for e in found.entries[:4]}
    mapping: dict[str, list[object]] = {
        "North.speed_mps": [0.1, 0.2],
        "protocol.max_steps": [5, 6],
    }
    assert line_up([North, "bug1"], vary=mapping) == found


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("1,2", ["1", "2"]),
        ("1,2;3,4", ["1,2", "3,4"]),
        ("1,2;", ["1,2"]),
        ("[a,b],[]", ["[a,b]", "[]"]),
    ],
)
def test_alternatives_keep_brackets_together(text: str, values: list[str]) -> None:
    assert alternatives(text) == values


def test_values_become_the_texts_of_set() -> None:
    assert texts_of({"a.b": True, "a.c": (1, 2.5)}) == ["a.b=true", "a.c=1,2.5"]
    assert text_of(None) == "None"


def test_a_varied_run_has_columns_and_survives_everything() -> None:
    vary = ["--vary", "push-through.speed_share=0.5,1", "protocol.max_steps=20,30"]
    words = ["eval", "--planner", "push-through", "--family", "sparse", "-n", "2"]
    small = [*words, *vary, "--workers", "1"]
    assert cli.run([*small, "--out", "whole"]) == 0
    for part in ("1/2", "2/2"):
        assert cli.run([*small, "--out", part[0], "--shard", part]) == 0
    assert cli.run(["merge", "merged", "1", "2"]) == 0
    whole, merged = (beacon_mj.load_results(path) for path in ("whole", "merged"))
    assert timeless(merged.episodes) == timeless(whole.episodes)
    columns = ["set.push-through.speed_share", "set.protocol.max_steps"]
    rows = pl.read_parquet("merged/episodes.parquet")
    assert rows.columns[-2:] == columns
    assert rows.select(columns).unique().height == 4
    assert rows["steps"].to_list() == rows[columns[1]].to_list()
    assert beacon_mj.verify(whole).ok
    assert beacon_mj.verify(merged).ok
    assert cli.run(["eval", "--resume", "--out", "whole", "--workers", "1"]) == 0
    assert timeless(beacon_mj.load_results("whole").episodes) == timeless(
        whole.episodes
    )
    assert len(beacon_mj.compare(whole)) == 3
    assert beacon_mj.write_report(whole, replay=False).stat().st_size > 10_000
    command = command_of(load_config(Path("whole")))
    assert "--vary push-through.speed_share=0.5,1" in command
    assert "--vary protocol.max_steps=20,30" in command


def test_an_edited_setting_in_the_table_is_found() -> None:
    beacon_mj.evaluate(
        "push-through", scenes_per_family=1, out="run",
        vary={"protocol.max_steps": [10, 20]}, **(FEW | {"log": "all"}),
    )  # fmt: skip
    assert beacon_mj.verify("run").ok
    path = Path("run/episodes.parquet")
    rows = pl.read_parquet(path)
    rows.with_columns(pl.lit(10).alias("set.protocol.max_steps")).write_parquet(path)
    problems = beacon_mj.verify("run").problems
    assert any("set.protocol.max_steps is " in problem for problem in problems)


def test_a_failing_planner_is_named_with_its_line() -> None:
    results = beacon_mj.evaluate(
        [Broken, "push-through"], scenes_per_family=2, out="run", **FEW
    )
    [line] = results.failures()
    number = Path(__file__).read_text().splitlines().index(
        '        raise ZeroDivisionError("[here]")  # The line that is named.'
    )  # fmt: skip
    assert line.startswith("Broken: failed in 2 of 2 episodes; first in sparse_0000")
    assert f"ZeroDivisionError: [here] ({__file__}:{number + 1})" in line
    assert results.episodes[0].detail == "ZeroDivisionError: [here]"
    [bare] = beacon_mj.load_results("run").failures()
    assert "(" not in bare


def test_the_command_names_the_line_too(capsys: pytest.CaptureFixture[str]) -> None:
    Path("mine.py").write_text(
        "from beacon_mj import Planner\nfrom dataclasses import dataclass\n"
        "@dataclass(frozen=True)\nclass C:\n    x: int = 0\n"
        "class Mine(Planner):\n    Config = C\n    def reset(self, task): pass\n"
        "    def act(self, observation): return 1 / 0\n"
    )
    words = ["eval", "--planner", "mine.py:Mine", "--family", "sparse", "-n", "3"]
    more = ["--workers", "2", "--log", "none", "--json"]
    assert cli.run([*words, *more]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("{")
    assert err.count("mine.py:9)") == 1
    assert "Mine: failed in 3 of 3 episodes" in err
    text = Path("mine.py").read_text()  # Workers that live on see what was edited.
    Path("mine.py").write_text(text.replace("1 / 0", "[][1]"))
    assert cli.run([*words, *more]) == 0
    assert "IndexError" in capsys.readouterr().err


def test_a_run_of_a_class_goes_on_in_python_only() -> None:
    options: dict[str, Any] = FEW | {"settings": {"protocol.max_steps": 5}}
    first = beacon_mj.evaluate([North], scenes_per_family=2, out="run", **options)
    lines = Path("run/episodes.jsonl")
    lines.write_bytes(lines.read_bytes().splitlines(keepends=True)[0])
    with pytest.raises(BeaconError, match="given as a Python class"):
        beacon_mj.evaluate(out="run", resume=True)
    again = beacon_mj.evaluate(
        [North], scenes_per_family=2, out="run", resume=True, **options
    )
    assert timeless(again.episodes) == timeless(first.episodes)
    assert len(again) == 2


def test_results_show_themselves() -> None:
    results = beacon_mj.evaluate("push-through", scenes_per_family=1, out="r", **FEW)
    assert results.folder == Path("r")
    assert max(map(len, str(results.table()).splitlines())) <= 80
    assert "<pre" in results._repr_html_()
    assert "push-through" in results.table()._repr_html_()
    assert results.to_dicts() == results.rows.to_dicts()
    assert repr(results) == "Results('r', 1 episodes)"


def test_studies_take_classes() -> None:
    few: dict[str, Any] = {"families": ["sparse"], "scenes_per_family": 1, "workers": 1}
    found = beacon_mj.regret(North, settings=["protocol.max_steps=30"], **few)
    assert found.planner == "North"
    assert "North, sparse: 0 of 1 scenes" in str(found)
    with pytest.raises(BeaconError, match="expected its values as a mapping"):
        beacon_mj.ablate((North, NorthConfig()), **few)


def test_the_files_that_settings_name_are_part_of_the_record(tmp_path: Path) -> None:
    weights, out = tmp_path / "weights.npz", tmp_path / "run"
    shipped = dict(np.load(SHIPPED))
    np.savez(weights, **shipped)
    settings = {"ppo.weights": weights, "protocol.max_steps": 5}
    options: dict[str, Any] = {"scenes_per_family": 1, "report": False, **FEW}
    beacon_mj.evaluate("ppo", settings=settings, out=out, **options)
    [entry] = load_config(out).planners
    digest = hashlib.sha256(weights.read_bytes()).hexdigest()
    assert entry.code == {str(weights): digest}
    np.savez(weights, **(shipped | {"bias_2": shipped["bias_2"] + 1}))
    with pytest.raises(RunError, match=r"weights\.npz"):
        beacon_mj.evaluate("ppo", settings=settings, out=out, resume=True, **options)
    with pytest.raises(RunError, match=r"expected the code and the data"):
        beacon_mj.bundle(out, tmp_path / "run.zip")


def test_a_varied_file_is_part_of_the_record_of_its_variant(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    paths = ["a.npz", "b.npz"]
    for path in paths:
        Path(path).write_bytes(SHIPPED.read_bytes())
    found = line_up(["ppo"], vary={"ppo.weights": paths}).entries
    assert [[*entry.code] for entry in found] == [[path] for path in paths]


def test_a_huge_file_that_a_setting_names_is_refused_before_it_is_read(
    tmp_path: Path,
) -> None:
    huge = tmp_path / "huge.npz"
    with huge.open("wb") as file:
        file.truncate(MAX_DATA_BYTES + 1)  # Takes no room on the disk.
    with pytest.raises(PlannerError, match=r"cannot read the file .* at most"):
        data_of({"weights": str(huge)})
