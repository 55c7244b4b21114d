"""The column `suite`: in rows, logs, tables, and only where it is shown."""

import shutil
from pathlib import Path
from typing import Any

import msgspec
import pytest

import beacon_mj
from beacon_mj import cli
from beacon_mj.errors import BeaconError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.scene_cache import released_scene_suite
from beacon_mj.eval.statistics.compare import compare_pairs
from beacon_mj.eval.statistics.pairing import Arm, match
from beacon_mj.eval.statistics.regression_gates import parse_gate, violations
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.eval.statistics.summary_table import SummaryTable
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene_gen.generate import generate_scene
from tests.eval.traces import step, trace

FEW: dict[str, Any] = {
    "scenes_per_family": 1, "workers": 1, "settings": ["protocol.max_steps=60"],
}  # fmt: skip


def suites(results: beacon_mj.Results) -> dict[str, str | None]:
    return {row.family: row.suite for row in results.episodes}


def test_rows_config_and_logs_name_the_suite(tmp_path: Path) -> None:
    results = beacon_mj.evaluate(
        "push-through", suite="hard-v1", out=tmp_path / "run", **FEW
    )
    assert suites(results) == dict.fromkeys(
        ("hard-required", "hard-shortcut"), "hard-v1"
    )
    columns = results.rows.columns
    assert columns.index("suite") == columns.index("family") - 1
    assert results.config.scenes["hard-required"].suite == "hard-v1"
    assert results.config.scenes["hard-required"].count == 1
    log = beacon_mj.read_log(results.log("push-through", "hard-required", 0))
    assert log.config["suite"] == "hard-v1"
    assert beacon_mj.measure_log(log).row.suite == "hard-v1"
    assert beacon_mj.verify(results).ok


def test_a_copy_has_no_suite_and_a_log_that_claims_one_is_found_out(
    tmp_path: Path,
) -> None:
    templates = tmp_path / "templates"
    templates.mkdir()
    text = (ROOT / "families" / "sparse.xml").read_text()
    (templates / "sparse.xml").write_text(text.replace('"5 8"', '"4 4"'))
    options = FEW | {"families": ["sparse"], "templates": templates}
    results = beacon_mj.evaluate("push-through", out=tmp_path / "run", **options)
    assert suites(results) == {"sparse": None}
    log = beacon_mj.read_log(results.log("push-through", "sparse", 0))
    assert log.config["suite"] == ""
    assert beacon_mj.verify(results).ok
    # The same episode, recorded by somebody who says that it is of the suite.
    from beacon_mj.episode.run import run_episode
    from beacon_mj.planners.push_through import PushThrough
    from beacon_mj.recording import Recorder

    claimed = tmp_path / "claimed.mcap"
    recorder = Recorder(
        claimed, planner_config={}, seed=0, row=lambda t: measure(t).as_dict()
    )
    run_episode(
        log.scene, PushThrough(), "push-through", log.protocol,
        listeners=[recorder], suite="paper-v1",
    )  # fmt: skip
    (problem,) = beacon_mj.verify(claimed).problems
    assert "row.suite is 'paper-v1' in the log but None" in problem


def test_stored_scenes_are_of_a_suite_if_they_are_its_scenes(tmp_path: Path) -> None:
    scene = generate_scene("sparse", 3, 5)
    assert released_scene_suite(scene) == "paper-v1"
    moved = msgspec.structs.replace(
        scene, goal_m=(scene.goal_m[0], scene.goal_m[1] + 0.001)
    )
    assert released_scene_suite(moved) is None
    renamed = msgspec.structs.replace(scene, family="cluttered")
    assert released_scene_suite(renamed) is None
    stranger = msgspec.structs.replace(scene, family="mine")
    assert released_scene_suite(stranger) is None
    (tmp_path / "a.json").write_bytes(scene.to_json())
    other = msgspec.structs.replace(moved, index=4)
    (tmp_path / "b.json").write_bytes(other.to_json())
    results = beacon_mj.evaluate(
        "push-through", scene_dir=tmp_path, workers=1, log="none",
        settings=["protocol.max_steps=20"], out=tmp_path / "run",
    )  # fmt: skip
    found = {row.scene_index: row.suite for row in results.episodes}
    assert found == {3: "paper-v1", 4: None}


def test_a_round_that_is_cut_is_noted_before_and_under_the_tables(
    tmp_path: Path,
) -> None:
    told: list[str] = []
    results = beacon_mj.evaluate(
        "push-through", families=["lookalike-doors"], out=tmp_path / "run",
        tell=told.append, **FEW,
    )  # fmt: skip
    (line,) = told
    assert "lookalike-doors: 1 scenes cut a round of 6" in line
    assert results.notes() == [line]
    assert line in str(results.table())
    page = beacon_mj.write_report(results, tmp_path / "report.html", replay=False)
    assert "cut a round of 6" in page.read_text()


def test_wrong_options_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = ["eval", "--planner", "bug2", "--out", str(tmp_path / "run")]
    shutil.copy(ROOT / "families" / "sparse.xml", tmp_path / "mine.xml")
    for options, expected in (
        (["--suite", "paper-v2"], "Unknown suite 'paper-v2'. Did you mean 'paper-v1'"),
        (["--suite", "hard-v1", "--family", "sparse"], "expected no --family"),
        (["--suite", "hard-v1", "--scene-dir", "x"], "expected none with --scene-dir"),
    ):
        assert cli.run([*run, *options]) == cli.BAD_INPUT
        err = capsys.readouterr().err
        assert expected in err
        assert len(err.splitlines()) == 1
    assert not (tmp_path / "run").exists()
    with pytest.raises(BeaconError, match="Unknown suite"):
        beacon_mj.sweep("beacon", suite="x", out=tmp_path / "sweep")
    with pytest.raises(BeaconError, match="Unknown suite"):
        beacon_mj.regret("beacon", suite="x")
    with pytest.raises(BeaconError, match="Unknown suite"):
        beacon_mj.generate_scenes(tmp_path / "scenes", suite="x")


def row(planner: str, suite: str | None, family: str, index: int, x_m: float) -> Row:
    return msgspec.structs.replace(
        measure(trace([step(1, x_m=x_m)])),
        planner=planner,
        suite=suite,
        family=family,
        scene_index=index,
        scene_sha256=f"{family}{index}",
    )


MIXED = (
    ("hard-v1", "x"), ("paper-v1", "b"), ("hard-v1", "y"), ("paper-v1", "a"),
    (None, "mine"),
)  # fmt: skip
TABLES = ["overall", "suite paper-v1", "a", "b", "mine", "suite hard-v1", "x", "y"]


def test_tables_stand_suite_by_suite_where_there_are_several() -> None:
    rows = {
        p: [row(p, s, f, i, 1.0 + k) for s, f in MIXED for i in range(2)]
        for k, p in enumerate(("p", "q"))
    }
    summary = summarize([r for own in rows.values() for r in own])
    cells = summary["tables"]["p"]
    assert [*cells] == TABLES
    counts = [cells[name]["n"] for name in TABLES]
    assert counts == [10, 4, 2, 2, 2, 4, 2, 2]
    assert "suite hard-v1, 4 scenes" in str(SummaryTable(summary))
    (found,) = compare_pairs([match(Arm("q", rows["q"]), Arm("p", rows["p"]))])
    assert {*found.cells} == {*TABLES}
    assert found.cells["suite hard-v1"].scenes == 4
    gate = parse_gate("suite hard-v1/path_length_m:all > 0.5")
    assert len(violations([gate], [found])) == 1


def test_one_suite_alone_has_the_tables_of_before() -> None:
    rows = [row("p", "paper-v1", f, 0, 1.0) for f in ("a", "b")]
    assert [*summarize(rows)["tables"]["p"]] == ["overall", "a", "b"]
