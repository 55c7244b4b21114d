"""A forged run fails at the level that the docs name for it; an honest one at none."""

import json
import os
import shutil
import zipfile
from pathlib import Path
from typing import Any

import msgspec
import pytest

import beacon_mj
from beacon_mj import cli
from beacon_mj.errors import PlannerError, RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.run_folder import RunFolder, load_config, load_rows
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.eval.verification.rates import rate_results
from beacon_mj.scene.files import load_scene
from beacon_mj.scene_gen.generate import generate_scene

SHORT = {"protocol.max_steps": 40, "protocol.decision_limit_s": 3600}
MINE = """
import numpy as np
from beacon_mj.interface import Command
from beacon_mj.planners.base import Planner
from helper import GAIN

class Mine(Planner):
    def reset(self, task):
        self.goal = np.array(task.goal_m)
    def act(self, observation):
        return Command(velocity_mps=GAIN * (self.goal - observation.position_m))
"""


def evaluated(out: Path, planners: list[str], **options: Any) -> Path:
    few: dict[str, Any] = {
        "families": ["sparse"],
        "scenes_per_family": 2,
        "settings": SHORT,
    }
    beacon_mj.evaluate(planners, **(few | options), workers=1, out=out)
    return out


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return evaluated(tmp_path_factory.mktemp("runs") / "run", ["bug1", "clairvoyant"])


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "run"))


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A planner's file and the module that it imports."""
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "mine.py").write_text(MINE)
    (folder / "helper.py").write_text("GAIN = 0.3\n")
    return folder / "mine.py"


def failing(run: Path, **options: object) -> set[str]:
    """Return the levels at which a run fails."""
    found = beacon_mj.verify(run, workers=1, **options)  # type: ignore[arg-type]
    assert found.ok == all(c.ok for c in found.checks)
    return {check.level for check in found.checks if not check.ok}


def rewrite(run: Path, found: list[Row]) -> None:
    """Write the tables anew, as a forger would."""
    (run / "episodes.jsonl").write_bytes(b"")
    (run / "report.html").unlink(missing_ok=True)
    folder = RunFolder(run)
    folder.append(found)
    folder.finish(load_config(run), found, summarize(found))


def test_an_honest_run_holds_at_every_level(made: Path) -> None:
    found = beacon_mj.verify(made, workers=1, rerun=True)
    assert found.ok, found.problems
    assert [c.level for c in found.checks] == ["tables", "scenes", "logs", "planner"]
    assert "4 logs compared in every message" in found.checks[-1].note


def test_a_run_of_whole_rounds_by_default_holds(tmp_path: Path) -> None:
    out = tmp_path / "run"
    beacon_mj.evaluate(
        ["bug1"], families=["sparse"], settings={"protocol.max_steps": 1},
        workers=1, log="none", out=out,
    )  # fmt: skip
    assert load_config(out).scenes_per_family is None
    found = beacon_mj.verify(out, workers=1)
    assert found.ok, found.problems
    assert "100 rows compared" in found.checks[0].note


def test_the_days_of_a_mission_are_run_again_together(tmp_path: Path) -> None:
    run = evaluated(
        tmp_path / "run", ["beacon"], families=["revisited-rooms"], scenes_per_family=3,
        seed=1000, settings=SHORT | {"protocol.max_steps": 60},
    )  # fmt: skip
    assert failing(run, rerun=True) == set()


def test_half_of_the_episodes_removed_fails_tables(run: Path) -> None:
    kept = [row for row in load_rows(run) if row.scene_index == 0]
    rewrite(run, kept)
    for log in run.rglob("*_0001.mcap"):
        log.unlink()
    assert failing(run) == {"tables"}
    [line] = beacon_mj.verify(run, workers=1).problems
    assert "2 of 4 planned episodes are missing" in line


def test_a_suite_that_rows_and_configuration_only_claim_fails_scenes(run: Path) -> None:
    replace = msgspec.structs.replace
    rewrite(run, [replace(row, suite="hard-v1") for row in load_rows(run)])
    assert "scenes" in failing(run)
    problems = "\n".join(beacon_mj.verify(run, workers=1).problems)
    assert "is of hard-v1 in the rows, but of paper-v1" in problems
    rewrite(run, [replace(row, suite="paper-v1") for row in load_rows(run)])
    assert failing(run) == set()
    stored = json.loads((run / "config.json").read_text())
    for each in stored["scenes"].values():
        each["suite"] = "hard-v1"
    (run / "config.json").write_text(json.dumps(stored))
    assert "scenes" in failing(run)


def test_an_edited_summary_fails_tables(run: Path) -> None:
    path = run / "summary.json"
    summary = json.loads(path.read_text())
    summary["tables"]["bug1"]["overall"]["success"]["count"] = 2
    path.write_text(json.dumps(summary))
    assert failing(run) == {"tables"}


@pytest.mark.parametrize(
    ("part", "change", "told"),
    [
        (
            ("protocol",),
            {"max_steps": 41},
            "its protocol is not that of the run in max",
        ),
        (("versions",), {"numpy": "1.0.0"}, "recorded with numpy"),
        (("planners", 0, "config"), {"speed": 9}, "its planner_config is not that"),
        (("planners", 0), {"name": "other"}, "'bug1' is no planner of the run"),
    ],
)
def test_logs_that_were_recorded_otherwise_fail_logs(
    run: Path, part: tuple[str | int, ...], change: dict[str, object], told: str
) -> None:
    stored = json.loads((run / "config.json").read_text())
    found: Any = stored
    for key in part:
        found = found[key]
    found.update(change)
    (run / "config.json").write_text(json.dumps(stored))
    checks = beacon_mj.verify(run, workers=1).checks
    [logs] = [check for check in checks if check.level == "logs"]
    assert told in "\n".join(logs.problems)


def test_commands_of_the_clairvoyant_under_another_name_fail_planner(
    tmp_path: Path, made: Path
) -> None:
    """Its logs prove their rows; only running the named planner shows the lie."""
    truth = made / "logs" / "clairvoyant" / "sparse_0000.mcap"
    forged = evaluated(tmp_path / "forged", [str(_told(tmp_path, truth))])
    run = tmp_path / "run"
    shutil.copytree(forged, run)
    config = load_config(run)
    entry = msgspec.structs.replace(config.planners[0], spec="bug1", home="", code={})
    config = msgspec.structs.replace(config, planners=(entry,))
    stored = json.loads((run / "config.json").read_text())
    stored["planners"] = msgspec.to_builtins(config.planners)
    (run / "config.json").write_text(json.dumps(stored))
    assert "planner" not in failing(run)
    assert "planner" in failing(run, rerun=True)


def _told(folder: Path, log: Path) -> str:
    """Return a planner that replays the commands of a log, whoever gave them."""
    commands = [
        step.command.velocity_mps.tolist() for step in beacon_mj.read_trace(log).steps
    ]
    (folder / "told.py").write_text(
        "from beacon_mj.interface import Command\n"
        "from beacon_mj.planners.base import Planner\n"
        f"COMMANDS = {commands!r}\n"
        "class Bug1(Planner):\n"
        "    def reset(self, task):\n        self.k = -1\n"
        "    def act(self, observation):\n"
        "        self.k = min(self.k + 1, len(COMMANDS) - 1)\n"
        "        return Command(velocity_mps=COMMANDS[self.k])\n"
    )
    return f"{folder / 'told.py'}:Bug1"


UNSTEADY = """
import os
from beacon_mj.interface import Command
from beacon_mj.planners.base import Planner

class Unsteady(Planner):
    bit_reproducible = {says}
    def reset(self, task):
        self.goal = task.goal_m
    def act(self, observation):
        shake = 1e-9 * int.from_bytes(os.urandom(2), "big")
        return Command(velocity_mps=0.3 * (self.goal - observation.position_m) + shake)
"""


def unsteady(folder: Path, says: object) -> str:
    """Return a planner that does not decide the same twice."""
    path = folder / "unsteady.py"
    path.write_text(UNSTEADY.format(says=says))
    return f"{path}:Unsteady"


def test_a_planner_that_need_not_repeat_is_told_in_tables_and_proved_by_rates(
    tmp_path: Path,
) -> None:
    run = evaluated(tmp_path / "run", [unsteady(tmp_path, False), "bug1"])
    told = "Unsteady: says that its rows need not be the same another time"
    assert told in str(beacon_mj.load_results(run).table())
    assert told in beacon_mj.write_report(run, replay=False).read_text()
    found = beacon_mj.verify(run, workers=1, rerun=True, trust_code=True)
    assert found.ok, found.problems
    assert "of Unsteady only the rates" in found.checks[-1].note
    better = [
        msgspec.structs.replace(row, success=True, clean_success=True, scene_index=k)
        for k in range(40)
        for row in load_rows(run)[:1]
    ]
    assert not all(each.consistent for each in rate_results(better, load_rows(run)))


def test_a_planner_that_does_not_say_so_must_repeat(tmp_path: Path) -> None:
    run = evaluated(tmp_path / "run", [unsteady(tmp_path, True)])
    assert "planner" in failing(run, rerun=True, trust_code=True)
    # Nor does it help that its record says so.
    stored = json.loads((run / "config.json").read_text())
    stored["planners"][0]["bit_reproducible"] = False
    (run / "config.json").write_text(json.dumps(stored))
    assert "planner" in failing(run, rerun=True, trust_code=True)


@pytest.mark.parametrize("says", [True, False])
def test_the_check_of_planners_asks_for_what_a_planner_promises(
    tmp_path: Path, says: bool
) -> None:
    cls = beacon_mj.load_planner(unsteady(tmp_path, says))[1]
    if not says:
        beacon_mj.check_planner(cls)
        return
    with pytest.raises(PlannerError, match="the same commands after the same task"):
        beacon_mj.check_planner(cls)


def test_a_planner_that_knows_the_scenes_of_its_seed_fails_fresh(
    tmp_path: Path,
) -> None:
    """It isolates well, its logs prove their rows, and it gives its commands again."""
    found = beacon_mj.evaluate(
        ["clairvoyant"], families=["sparse"], scenes_per_family=6, workers=1,
        out=tmp_path / "told",
    )  # fmt: skip
    commands = {}
    for row in found.episodes:
        trace = beacon_mj.read_trace(
            found.log("clairvoyant", "sparse", row.scene_index)
        )
        key = (*trace.scene.start_m, *trace.scene.goal_m)
        commands[key] = [s.command.velocity_mps.tolist() for s in trace.steps]
    (tmp_path / "knows.py").write_text(
        "from beacon_mj.interface import Command\n"
        "from beacon_mj.planners.base import Planner\n"
        f"COMMANDS = {commands!r}\n"
        "class Knows(Planner):\n"
        "    def reset(self, task):\n"
        "        key = (*task.start_m.tolist(), *task.goal_m.tolist())\n"
        "        self.left = iter(COMMANDS.get(key, ()))\n"
        "    def act(self, observation):\n"
        "        return Command(velocity_mps=next(self.left, (0.0, 0.0)))\n"
    )
    run = tmp_path / "run"
    results = beacon_mj.evaluate(
        [f"{tmp_path / 'knows.py'}:Knows"], families=["sparse"], scenes_per_family=6,
        settings={"protocol.max_steps": 150}, workers=1, out=run,
    )  # fmt: skip
    assert all(row.success for row in results.episodes)
    fresh = {"fresh_seed": 4000, "trust_code": True}
    assert failing(run, rerun=True, **fresh) == {"fresh"}


def test_an_empty_world_under_a_certified_name_fails_scenes(tmp_path: Path) -> None:
    scene = generate_scene("sparse", 0)
    empty = msgspec.structs.replace(
        scene,
        obstacles=(),
        certificate=msgspec.structs.replace(scene.certificate, door_ids=()),
    )
    scenes = tmp_path / "scenes"
    scenes.mkdir()
    (scenes / "scene_0000.json").write_bytes(empty.to_json())
    run = evaluated(
        tmp_path / "run", ["bug1"], families=(), scenes_per_family=None,
        scene_dir=scenes,
    )  # fmt: skip
    assert failing(run) == {"scenes"}
    # Nor does it help to say that the scenes were generated.
    stored = json.loads((run / "config.json").read_text())
    stored |= {"scene_dir": None, "scenes_per_family": 1, "perception": "noisy"}
    (run / "config.json").write_text(json.dumps(stored))
    assert "scenes" in failing(run)


@pytest.mark.parametrize("length_m", [1.0, 40.0])
def test_a_lying_certificate_is_proved_anew_on_loading(
    tmp_path: Path, length_m: float
) -> None:
    scene = generate_scene("cluttered", 0)
    lie = msgspec.structs.replace(
        scene.certificate, reference_length_m=length_m, simulated="clean"
    )
    path = tmp_path / "scene.json"
    path.write_bytes(msgspec.structs.replace(scene, certificate=lie).to_json())
    assert load_scene(path) == scene


def test_a_room_edited_by_hand_gets_its_own_straight_line(tmp_path: Path) -> None:
    scene = generate_scene("sparse", 0)
    wide = msgspec.structs.replace(
        scene, workspace_m=(0.0, 0.0, 12.0, 6.0), goal_m=(11.0, 3.0)
    )
    path = tmp_path / "scene.json"
    path.write_bytes(wide.to_json())
    found = load_scene(path).certificate
    west, south = scene.start_m
    expected = ((11.0 - west) ** 2 + (3.0 - south) ** 2) ** 0.5
    assert found.straight_line_m == pytest.approx(expected, abs=1e-6)
    assert found.reference_length_m >= found.straight_line_m - 1e-6


def test_code_that_a_run_names_needs_trust(
    tmp_path: Path, mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(mine.parent)
    run = evaluated(tmp_path / "run", ["mine.py:Mine"])
    lines = (run / "episodes.jsonl").read_bytes().splitlines(keepends=True)
    (run / "episodes.jsonl").write_bytes(lines[0])
    monkeypatch.chdir(tmp_path)  # The file is found again from elsewhere.
    with pytest.raises(RunError, match=r"--trust-code.*mine\.py"):
        beacon_mj.evaluate(out=run, resume=True, workers=1)
    with pytest.raises(RunError, match=r"--trust-code.*mine\.py"):
        beacon_mj.verify(run, rerun=True)
    results = beacon_mj.evaluate(out=run, resume=True, workers=1, trust_code=True)
    assert [row.outcome for row in results.episodes] == ["max_steps"] * 2 or all(
        row.outcome != "planner_error" for row in results.episodes
    )


@pytest.mark.parametrize("name", ["mine.py", "helper.py"])
def test_an_edited_file_is_named_and_refused(
    tmp_path: Path, mine: Path, name: str
) -> None:
    spec = f"{mine}:Mine"
    first = evaluated(tmp_path / "first", [spec])
    part = evaluated(tmp_path / "part1", [spec], shard="1/2")
    path = mine.parent / name
    path.write_text(path.read_text() + "\n# edited\n")
    with pytest.raises(RunError, match=f"{name} is another file"):
        beacon_mj.evaluate(out=first, resume=True, workers=1, trust_code=True)
    with pytest.raises(RunError, match=f"{name} is another file"):
        beacon_mj.bundle(first, tmp_path / "x.zip")
    other = evaluated(tmp_path / "part2", [spec], shard="2/2")
    with pytest.raises(RunError, match=f"{name} is another file"):
        beacon_mj.merge(tmp_path / "merged", [part, other])
    second = evaluated(tmp_path / "second", [spec])
    with pytest.raises(RunError, match=f"{name} is another file.*--allow-differences"):
        beacon_mj.compare(first, second)
    assert len(beacon_mj.compare(first, second, allow_differences=True)) == 1


def test_two_evaluations_in_one_folder(made: Path, tmp_path: Path) -> None:
    config = load_config(made)
    first = RunFolder(tmp_path / "run")
    first.create(config)
    for second in (RunFolder(first.path).resume, RunFolder(first.path).create):
        with pytest.raises(
            RunError, match=r"another evaluation is running|holds files"
        ):
            second(config)
    first.close()
    assert RunFolder(first.path).resume(config) == []


def test_a_folder_moved_in_mid_run_loses_nothing(made: Path, tmp_path: Path) -> None:
    config, [row, *_] = load_config(made), load_rows(made)
    folder = RunFolder(tmp_path / "run")
    folder.create(config)
    os.rename(folder.path, tmp_path / "moved")
    with pytest.raises(RunError, match="moved or deleted"):
        folder.append([row])
    folder.close()
    assert not folder.path.exists()
    assert load_rows(tmp_path / "moved") == [row]


def test_a_bundle_is_the_same_bytes_and_verifies(
    tmp_path: Path, mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = evaluated(tmp_path / "run", [f"{mine}:Mine"])
    for name in ("a.zip", "b.zip"):
        assert cli.run(["bundle", str(run), "--out", str(tmp_path / name)]) == 0
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert {"planners/Mine/mine.py", "planners/Mine/helper.py"} <= {
            *archive.namelist()
        }
    shutil.rmtree(run)
    shutil.rmtree(mine.parent)  # The bundle has all that is needed.
    bundle = tmp_path / "a.zip"
    with pytest.raises(RunError, match="--trust-code"):
        beacon_mj.verify(bundle, rerun=True)
    found = beacon_mj.verify(
        bundle, rerun=True, fresh_seed=9, trust_code=True, workers=1
    )
    assert found.ok, found.problems
    assert [c.level for c in found.checks] == [
        "tables", "scenes", "logs", "planner", "fresh",
    ]  # fmt: skip
    assert {each.column for each in found.fresh} == {
        "success", "clean_success", "steps",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("../x", "a name inside"),
        ("/etc/x", "a name inside"),
        ("run/../../x", "a name inside"),
        ("run\\x", "a name inside"),
        ("else/x", "a file below"),
        ("run/unlisted", "not in the manifest"),
    ],
)
def test_a_bundle_with_a_bad_name_is_refused(
    made: Path, tmp_path: Path, name: str, words: str
) -> None:
    bundle = beacon_mj.bundle(made, tmp_path / "x.zip")
    with zipfile.ZipFile(bundle, "a") as archive:
        archive.writestr(name, b"x")
    with pytest.raises(RunError, match=words):
        beacon_mj.verify(bundle, workers=1)


def test_a_bundle_with_a_link_or_another_content_is_refused(
    made: Path, tmp_path: Path
) -> None:
    bundle = beacon_mj.bundle(made, tmp_path / "x.zip")
    link = zipfile.ZipInfo("run/link")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(bundle, "a") as archive:
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(RunError, match="a regular file"):
        beacon_mj.verify(bundle, workers=1)
    good, bad = beacon_mj.bundle(made, tmp_path / "y.zip"), tmp_path / "z.zip"
    with zipfile.ZipFile(good) as source, zipfile.ZipFile(bad, "w") as target:
        for entry in source.infolist():
            data = source.read(entry)
            changed = entry.filename == "run/episodes.jsonl"
            target.writestr(entry.filename, data + b"\n" if changed else data)
    with pytest.raises(RunError, match="not the file in the manifest"):
        beacon_mj.verify(bad, workers=1)
