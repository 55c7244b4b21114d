"""Published tables: written from a run, run again here, and compared."""

import json
import re
from collections.abc import Mapping
from pathlib import Path

import msgspec
import pytest

import beacon_mj
from beacon_mj import cli
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import rows_sha256
from beacon_mj.eval.runs.run_folder import load_config, load_rows
from beacon_mj.eval.verification.checks import Check
from beacon_mj.eval.verification.publish import main, publish
from beacon_mj.eval.verification.published import check_published, sample
from beacon_mj.eval.verification.records import RECORDS, read_records
from beacon_mj.recording.tolerance import TOLERANCE_M
from tests.repository import REPOSITORY

SHORT = {"protocol.max_steps": 25, "protocol.decision_limit_s": 3600}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three planners on two scenes and one mission of three days."""
    out = tmp_path_factory.mktemp("runs") / "run"
    beacon_mj.evaluate(
        ["bug1", "push-through", ("beacon", {"belief.overnight": "belief"})],
        families=["sparse", "revisited-rooms"],
        scenes_per_family=3,
        settings=SHORT,
        workers=1,
        log="none",
        out=out,
    )
    return out


@pytest.fixture
def records(run: Path, tmp_path: Path) -> Path:
    publish(run, "table", tmp_path / "records")
    return tmp_path / "records"


def checked(records: Path, fraction: float | None = 1.0) -> Check:
    [check] = check_published(records, fraction=fraction, workers=1)
    return check


def edit_table(records: Path, **changes: object) -> None:
    path = records / "table.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def edit_episode(records: Path, name: str, value: object) -> None:
    """Change a column of the first published episode."""
    import polars as pl

    path = records / "table.parquet"
    frame = pl.read_parquet(path)
    values = [value, *frame[name].to_list()[1:]]
    frame.with_columns(pl.Series(name, values)).write_parquet(path)


def as_recorded_elsewhere(records: Path) -> None:
    config = json.loads((records / "table.json").read_text())["config"]
    config["versions"]["machine"] = "Linux aarch64"
    edit_table(records, config=config)


def test_a_published_table_is_that_of_its_run(run: Path, records: Path) -> None:
    [record] = read_records(records)
    assert record.table.rows_sha256 == rows_sha256(load_rows(run))
    assert record.table.rows == len(record.episodes) == 18
    size = sum(path.stat().st_size for path in records.iterdir())
    assert size < 20_000


def test_all_of_it_run_again_is_equal_with_its_digest(records: Path) -> None:
    check = checked(records)
    assert check.ok, check.problems
    assert check.note == "table: 18 of 18 episodes run again, rows bit for bit"


def test_the_sample_has_every_planner_and_family(run: Path) -> None:
    config = load_config(run)
    jobs = sample(config, None)
    assert {name for job in jobs for name in job.planners} == {
        entry.name for entry in config.planners
    }
    assert {job.refs[0].family for job in jobs} == {"sparse", "revisited-rooms"}
    [mission] = [job for job in jobs if job.refs[0].family == "revisited-rooms"]
    assert len(mission.refs) == 3  # Its days belong together.
    assert jobs == sample(config, None)


@pytest.mark.parametrize("fraction", [0.01, 0.5, 1.0])
def test_a_fraction_is_of_scenes_for_every_planner(run: Path, fraction: float) -> None:
    jobs = sample(load_config(run), fraction)
    assert len(jobs) == {0.01: 1, 0.5: 2, 1.0: 4}[fraction]
    assert all(len(job.planners) == 3 for job in jobs)


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("outcome", "reached", "outcome is 'reached' as published but 'timeout'"),
        ("steps", 24, "steps is 24 as published but 25 here"),
        ("path_length_m", 1.25, "path_length_m is 1.25 as published but "),
        ("sha256", "0" * 16, "another column than outcome, steps and path differs"),
    ],
)
def test_a_difference_is_named_by_episode_and_column(
    records: Path, name: str, value: object, told: str
) -> None:
    edit_episode(records, name, value)
    [problem] = checked(records).problems
    assert re.match(r"table: beacon in revisited-rooms_000\d: ", problem)
    assert told in problem


def test_a_digest_that_no_episode_explains_is_named(records: Path) -> None:
    edit_table(records, rows_sha256="0" * 64)
    [problem] = checked(records).problems
    assert "the SHA-256 of its rows is 0000" in problem
    assert checked(records, None).ok  # A sample cannot see it.


def test_another_kind_of_machine_is_compared_within_a_tolerance(records: Path) -> None:
    as_recorded_elsewhere(records)
    edit_episode(records, "sha256", "0" * 16)
    path_m = next(iter(read_records(records)[0].episodes.values())).path_length_m
    edit_episode(records, "path_length_m", path_m + 0.9 * TOLERANCE_M)
    check = checked(records)
    assert check.ok, check.problems
    assert "another kind of machine: outcomes and steps exactly, paths" in check.note
    edit_episode(records, "path_length_m", path_m + 1.1 * TOLERANCE_M)
    assert "path_length_m is" in checked(records).problems[0]
    edit_episode(records, "outcome", "reached")
    assert "outcome is" in checked(records).problems[0]


def test_other_versions_are_named(records: Path) -> None:
    config = json.loads((records / "table.json").read_text())["config"]
    config["versions"]["mujoco"] = "3.0.0"
    edit_table(records, config=config)
    assert "mujoco 3.0.0 there" in checked(records, None).note


def test_another_family_is_named_before_anything_runs(records: Path) -> None:
    config = json.loads((records / "table.json").read_text())["config"]
    config["families"]["sparse"] = "0" * 64
    edit_table(records, config=config)
    assert not checked(records, None).ok


def test_records_that_are_damaged_or_missing_get_one_line(records: Path) -> None:
    edit_table(records, rows=17)
    with pytest.raises(RunError, match="expected 17 episodes but there are 18"):
        read_records(records)
    (records / "table.json").write_text("{}")
    with pytest.raises(RunError, match=r"table\.json: not a record"):
        read_records(records)
    (records / "table.json").unlink()
    with pytest.raises(RunError, match="expected published tables but there is none"):
        read_records(records)


def forged(run: Path, folder: Path, **changes: object) -> Path:
    """Return a copy of a run with another configuration."""
    folder.mkdir()
    for path in run.iterdir():
        if path.is_file():
            (folder / path.name).write_bytes(path.read_bytes())
    config = json.loads((run / "config.json").read_text()) | changes
    (folder / "config.json").write_text(json.dumps(config))
    return folder


def test_what_cannot_be_published_is_refused(run: Path, tmp_path: Path) -> None:
    planners = msgspec.to_builtins(load_config(run).planners)
    mine = [planners[0] | {"name": "Mine", "spec": "mine.py:Mine"}]
    cases: list[tuple[Mapping[str, object], str]] = [
        ({"shard": [1, 2]}, "a whole run, not a shard"),
        ({"templates": "mine"}, "generated scenes of shipped families"),
        ({"planners": mine}, "shipped planners, not Mine"),
        ({"scenes": {}, "scenes_per_family": 6}, "18 of 36 planned episodes are miss"),
    ]
    for k, (changes, told) in enumerate(cases):
        other = forged(run, tmp_path / str(k), **changes)
        with pytest.raises(RunError, match=told):
            publish(other, None, tmp_path / "records")
    edited = forged(run, tmp_path / "edited")
    rows = (edited / "episodes.jsonl").read_text()
    (edited / "episodes.jsonl").write_text(rows.replace('"steps":25', '"steps":24', 1))
    with pytest.raises(RunError, match="in column steps"):
        publish(edited, None, tmp_path / "records")
    assert not (tmp_path / "records").exists()


def test_a_record_of_another_table_is_not_replaced_by_mistake(
    run: Path, records: Path, tmp_path: Path
) -> None:
    publish(run, "table", records)
    config = json.loads((records / "table.json").read_text())["config"]
    edit_table(records, config=config | {"planners": config["planners"][:1]})
    with pytest.raises(RunError, match="of other planners or families: give another"):
        publish(run, "table", records)


def test_the_maintainers_command_says_what_it_did(
    run: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([]) == 2
    assert main([str(tmp_path / "none")]) == 2
    assert "expected a run folder" in capsys.readouterr().err
    written = []

    def kept(folder: Path, name: str | None = None) -> Path:
        written.append(publish(folder, name, tmp_path / "records"))
        return written[0]

    monkeypatch.setattr("beacon_mj.eval.verification.publish.publish", kept)
    assert main([str(run)]) == 0
    assert written[0].name == "paper-v1-learning-v1-seed-0.json"
    assert rows_sha256(load_rows(run)) in capsys.readouterr().out


def test_options_of_verify_that_do_not_go_together(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for arguments, told in (
        ([], "expected a path, or --published"),
        ([str(run), "--published"], "expected no path"),
        (["--published", "--rerun"], "no option but --fraction"),
        ([str(run), "--fraction", "1"], "with --published only"),
        (["--published", "--fraction", "0"], "more than 0 and at most 1"),
        (["--published", "--fraction", "nan"], "more than 0 and at most 1"),
    ):
        assert cli.run(["verify", *arguments]) == 2
        assert told in capsys.readouterr().err


def test_the_command_reports_a_table_that_holds_and_one_that_does_not(
    records: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("beacon_mj.eval.api.published.RECORDS", records)
    assert cli.run(["verify", "--published", "--workers", "1"]) == 0
    assert "published: holds; table: " in capsys.readouterr().out
    edit_table(records, rows_sha256="0" * 64)
    assert cli.run(["verify", "--published", "--fraction=1", "--workers=1"]) == 1
    told = capsys.readouterr()
    assert "error: published: table: the SHA-256" in told.err
    assert "published: FAILS" in told.out


def digests_in_docs() -> list[tuple[str, str]]:
    pages = [REPOSITORY / "README.md", *(REPOSITORY / "docs").glob("*.md")]
    pattern = re.compile(r"SHA-256 of the rows: `([0-9a-f]{64})`")
    return [(p.name, d) for p in pages for d in pattern.findall(p.read_text())]


@pytest.mark.skipif(not RECORDS.is_dir(), reason="no table is published yet")
def test_every_table_in_the_docs_is_published() -> None:
    known = {record.table.rows_sha256 for record in read_records()}
    found = digests_in_docs()
    assert found
    for page, digest in found:
        assert digest in known, f"{page}: {digest} is that of no published table"


@pytest.mark.slow
@pytest.mark.skipif(not RECORDS.is_dir(), reason="no table is published yet")
def test_a_sample_of_the_published_tables_is_equal_here() -> None:
    found = beacon_mj.verify_published()
    assert found.ok, found.problems
