"""The command line as a user meets it: status, one line of error, help, speed."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import msgspec
import polars as pl
import pytest

from beacon_mj import __version__, cli
from beacon_mj.cli import options
from beacon_mj.cli.app import COMMANDS
from beacon_mj.eval.runs.overrides import flat
from beacon_mj.eval.runs.run_folder import load_rows
from beacon_mj.planners.registry import load_planner
from beacon_mj.scene import PROFILES
from beacon_mj.scene.files import load_scene
from beacon_mj.scene_gen.generate import generate_scene
from tests.eval.runs.test_runner import HOSTILE, timeless
from tests.repository import REPOSITORY

SMALL = [
    "--family", "sparse", "-n", "1", "--workers", "1", "--no-report", "--log", "none",
]  # fmt: skip


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run in an empty folder, so that nothing is found or left by accident."""
    monkeypatch.chdir(tmp_path)


def python(*arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, *arguments],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True,
        text=True,
        check=False,
    )


def refused(capsys: pytest.CaptureFixture[str], arguments: Sequence[str]) -> str:
    """Return the one line with which the command line refuses bad input."""
    before = sorted(Path.cwd().rglob("*"))
    assert cli.run(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert sorted(Path.cwd().rglob("*")) == before
    return err


def evaluated(*arguments: str) -> int:
    return cli.run(["eval", "--planner", "push-through", *SMALL, *arguments])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("evl", "'evl'. Did you mean 'eval'"),
        ("eval", "--planner: expected a planner"),
        ("eval --planner beacno", "'beacno'. Did you mean 'beacon'"),
        ("eval --planner bug1 --family clutered", "Did you mean 'cluttered'"),
        (
            "eval --planner bug1 --scenes-per-famly 3",
            "Did you mean --scenes-per-family",
        ),
        ("eval --planner bug1 -n -3", "Must be >= 1"),
        ("eval --planner bug1 -n 0", "Must be >= 1"),
        ("eval --planner bug1 -n 1.5", "-n: expected a whole number"),
        ("eval --planner bug1 --seed 1e3", "--seed: expected a whole number"),
        ("eval --planner bug1 --seed -1", "Must be >= 0"),
        ("eval --planner bug1 --workers 0", "Must be >= 1"),
        ("eval --planner bug1 --perception nosy", 'Did you mean "noisy"'),
        ("eval --planner bug1 --log some", "--log"),
        ("eval --planner push-through --set push-through.sped=1", "field"),
        ("eval --planner push-through --set push-through.speed_share=nan", "finite"),
        ("eval --planner push-through --set protocol.max_steps=0", "max_steps"),
        ("eval --planner push-through --set bug1.x=1", "target 'bug1'"),
        ("eval --planner missing.py:Planner", "missing.py: expected a Python file"),
        ("eval --planner bug1 --scene-dir nowhere", "nowhere: expected a folder"),
        ("eval --planner bug1 --templates nowhere", "nowhere: expected a folder"),
        (
            "eval --planner bug1 --scene-dir . --templates .",
            "no templates with --scene-dir",
        ),
        ("eval --planner bug1 --out /proc/nowhere", "/proc/nowhere: cannot be written"),
        ("eval --planner bug1 --resume", "--resume: expected --out"),
        ("eval --resume --out nowhere", "nowhere: expected a run folder"),
        ("eval --planner bug1 --cluster a:1 --workers 2", "--workers: expected none"),
        ("eval --planer beacon", "Did you mean --planner"),
        ("eval --resume --out x --seed 4", "--seed: expected no other options"),
        ("eval --resume --out x --set a.b=1", "--set: expected no other options"),
        (
            "sweep --planner beacon --family clutered --out x",
            "Did you mean 'cluttered'",
        ),
        ("sweep --planner beacon --set beacon.x=1 --out x", "field of beacon 'x'"),
        ("regret --planner bug1 --workers 1.5", "--workers: expected a whole number"),
        ("certify . --workers 1.5", "--workers: expected a whole number"),
        ("generate", "--out"),
        ("generate --out /proc/nowhere", "/proc/nowhere: cannot be written"),
        ("generate --out x --family sparce", "Did you mean 'sparse'"),
        ("generate --out x -n -1", "Must be >= 1"),
        ("view nowhere.json --png x.png", "nowhere.json: cannot read"),
        ("planners beacno", "Did you mean 'beacon'"),
        ("families --templates nowhere", "nowhere: expected a folder"),
        ("replay nowhere.mcap --metrics", "nowhere.mcap: cannot read"),
        ("replay nowhere.mcap", "expected what to do with it"),
        ("verify nowhere.mcap", "nowhere.mcap: cannot read"),
        ("verify", "expected a path, or --published"),
        ("eval --planner bug1 --episodes 3", "--episodes was renamed: use --scenes-"),
        ("generate --out x --episodes=3", "--episodes was renamed: use --scenes-per"),
        ("eval --planner bug1 --scenes x", "--scenes was renamed: use --scene-dir"),
        ("replay runs/x --verify", "--verify was renamed: use beacon-mj verify PATH"),
        ("eval --planner bug1 --vary bug1.x=1,2", "field of bug1 'x'"),
        ("eval --planner bug1 --vary bug2.x=1,2", "target 'bug2'"),
        ("eval --planner bug1 --vary protocol.max_steps=9,9", "values that differ"),
        ("eval --planner bug1 --vary protocol.max_steps", "values that differ"),
        ("eval --planner bug1 --vary protocol.max_steps=9,0", "max_steps"),
        ("eval --planner bug1 --vary protocol.x=1,2", "field of protocol 'x'"),
        ("eval --planner bug1 --set protocol.max_steps=9 oops", "--set oops: expected"),
        ("eval --resume --out x --vary a.b=1,2", "--vary: expected no other options"),
        ("fidelity crep", "Did you mean 'creep'"),
    ],
)
def test_bad_input_is_one_line_and_status_2(
    capsys: pytest.CaptureFixture[str], arguments: str, words: str
) -> None:
    assert words in refused(capsys, arguments.split())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text[:100], "not valid JSON"),
        (lambda text: b"\xff\xfe", "not valid JSON"),
        (lambda text: text.replace(b'"start_m": [', b'"start_m": [NaN, '), "JSON"),
        (lambda text: text.replace(b'"seed": 0', b'"seed": -1'), "not a valid scene"),
        (lambda text: text.replace(b'"fixed"', b'"fixd"'), "not a valid scene"),
    ],
)
def test_a_bad_scene_file_is_one_line(
    capsys: pytest.CaptureFixture[str], change: object, words: str
) -> None:
    good = generate_scene("sparse", 0).to_json()
    bad = change(good)  # type: ignore[operator]
    assert bad != good
    Path("scene.json").write_bytes(bad)
    for command in (
        ["eval", "--planner", "bug1", "--scene-dir", "."],
        ["view", "scene.json", "--png", "x.png"],
    ):
        message = refused(capsys, command)
        assert words in message
        assert "scene.json" in message


def test_a_run_and_its_outputs(capsys: pytest.CaptureFixture[str]) -> None:
    assert evaluated("--out", "run") == 0
    out, err = capsys.readouterr()
    assert "1/1" in out
    assert "push-through" in out
    assert max(map(len, out.splitlines())) <= 80
    assert "1/1 episodes, 100 % solved, done" in err
    assert pl.read_parquet("run/episodes.parquet")["success"].to_list() == [True]
    message = refused(capsys, ["eval", "--planner", "bug1", *SMALL, "--out", "run"])
    assert "Use --resume" in message


def test_an_unknown_baseline_of_a_report_is_one_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert evaluated("--out", "run", "--set", "protocol.max_steps=3") == 0
    capsys.readouterr()
    message = refused(capsys, ["report", "run", "--baseline", "pushthrough"])
    assert "Did you mean 'push-through'" in message


def test_runs_without_a_name_get_one_each() -> None:
    assert evaluated() == 0
    assert evaluated() == 0
    assert sorted(p.name for p in Path("runs").iterdir()) == [
        "push-through-seed0",
        "push-through-seed0-2",
    ]


def test_json_is_all_that_stdout_gets(capsys: pytest.CaptureFixture[str]) -> None:
    assert evaluated("--out", "run", "--json") == 0
    out, _ = capsys.readouterr()
    summary = msgspec.json.decode(out)
    assert summary == msgspec.json.decode(Path("run/summary.json").read_bytes())
    assert summary["tables"]["push-through"]["sparse"]["success"]["n"] == 1


def test_options_from_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    Path("beacon.toml").write_text(
        '[eval]\nplanner = ["push-through"]\nfamily = ["sparse"]\n'
        "scenes_per_family = 2\n"
        'set = ["protocol.max_steps=5"]\nworkers = 1\nlog = "none"\n'
    )
    assert cli.run(["eval", "--out", "run", "-n", "1"]) == 0
    rows = load_rows(Path("run"))
    assert [(r.planner, r.scene_index, r.steps) for r in rows] == [
        ("push-through", 0, 5)
    ]
    Path("beacon.toml").write_text("[eval]\nepisodes = 3\n")
    capsys.readouterr()
    message = refused(capsys, ["eval", "--planner", "bug1"])
    assert "--episodes was renamed: use --scenes-per-family" in message
    Path("beacon.toml").write_text("[eval]\nplaner = 3\n")
    capsys.readouterr()
    assert "planer" in refused(capsys, ["eval", "--planner", "bug1"])
    Path("beacon.toml").write_text("[eval\n")
    message = refused(capsys, ["eval", "--planner", "bug1"])
    assert "beacon.toml: not valid TOML" in message


def test_logs_of_failures_only() -> None:
    arguments = ["eval", "--planner", "push-through", *SMALL[:-2], "--log", "failures"]
    assert cli.run([*arguments, "--out", "good"]) == 0
    assert [*Path("good").rglob("*.mcap")] == []
    short = ["--set", "protocol.max_steps=3", "--out", "bad"]
    assert cli.run([*arguments, *short]) == 0
    [log] = Path("bad").rglob("*.mcap")
    assert log == Path("bad/logs/push-through/sparse_0000.mcap")


def test_a_log_proves_its_row(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--log", "all", "--set", "protocol.max_steps=20", "--out", "run"]
    assert cli.run(["eval", "--planner", "bug1", *SMALL[:-2], *arguments]) == 0
    [log] = Path("run").rglob("*.mcap")
    [row] = load_rows(Path("run"))
    capsys.readouterr()
    assert cli.run(["replay", str(log), "--metrics", "--json"]) == 0
    out, _ = capsys.readouterr()
    measured = msgspec.json.decode(out, type=type(row))
    assert timeless([measured]) == timeless([row])
    assert cli.run(["verify", str(log)]) == 0
    assert "verified, 20 steps" in capsys.readouterr().out


def test_generate_writes_scenes_and_worlds(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["generate", "--family", "sparse", "-n", "2", "--out", "s"]
    assert cli.run(arguments) == 0
    assert sorted(p.name for p in Path("s").iterdir()) == [
        f"scene_000{k}.{suffix}" for k in range(2) for suffix in ("json", "xml")
    ]
    assert load_scene("s/scene_0001.json") == generate_scene("sparse", 1)
    capsys.readouterr()
    assert "new or empty folder" in refused(capsys, arguments)
    both = ["--family", "cluttered", "--family", "sparse", "-n", "1"]
    assert cli.run(["generate", *both, "--out", "t"]) == 0
    assert Path("t/cluttered/scene_0000.xml").is_file()
    stored = ["eval", "--planner", "push-through", "--scene-dir", "t", "--log", "none"]
    assert cli.run([*stored, "--workers", "1", "--out", "run"]) == 0
    assert [r.family for r in load_rows(Path("run"))] == ["cluttered", "sparse"]


def test_lists(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["planners"]) == 0
    assert cli.run(["planners", "push-through"]) == 0
    planners, _ = capsys.readouterr()
    assert cli.run(["families"]) == 0
    out, _ = capsys.readouterr()
    for word in ("bug1, bug", "dstar-lite", "push-through.speed_share", "collision-"):
        assert word in planners + out
    (line,) = [row for row in out.splitlines() if "lookalike-doors " in row]
    assert line.split() == [
        "lookalike-doors",
        "look-alikes",
        "-",
        ">=",
        "6",
        "s",
        "102",
    ]
    assert "suite learning-v1" in out
    assert max(len(row) for row in out.splitlines() if "/" not in row) <= 80


def test_the_families_of_a_suite(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["families", "--suite", "hard-v1"]) == 0
    out, _ = capsys.readouterr()
    assert "hard-shortcut" in out
    assert "lookalike" not in out
    assert cli.run(["families", "--suite", "hard"]) == cli.BAD_INPUT
    _, err = capsys.readouterr()
    assert "Unknown suite 'hard'. Did you mean 'hard-v1'?" in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("planner", ["beacon", "beacon-voi", "semantic", "impact"])
def test_every_name_that_can_be_set_is_printed_whole(
    planner: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["planners", planner]) == 0
    printed = capsys.readouterr().out.split()
    names = [f"{planner}.{f}" for f in flat(load_planner(planner)[1].Config())]
    assert len(names) > 4
    assert set(names) <= set(printed)


def start(*arguments: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-m", "beacon_mj", "eval", *arguments],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_for_lines(path: Path, count: int) -> None:
    deadline = time.monotonic() + 120.0
    while not path.exists() or path.read_bytes().count(b"\n") < count:
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.parametrize("workers", ["1", "2"])
def test_ctrl_c_keeps_finished_episodes_and_the_run_can_go_on(workers: str) -> None:
    arguments = [
        "--planner", f"{HOSTILE}:Harmless", "--planner", "push-through",
        "--family", "sparse", "-n", "150", "--log", "none", "--out", "run",
        "--set", "protocol.max_steps=300", "--workers", workers,
    ]  # fmt: skip
    process = start(*arguments)
    wait_for_lines(Path("run/episodes.jsonl"), 4)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60.0)
    assert process.returncode == 130
    assert "interrupted: " in err
    assert "Traceback" not in err
    rows = load_rows(Path("run"))
    assert 4 <= len(rows) < 300
    assert not Path("run/episodes.parquet").exists()


def test_a_resumed_run_equals_an_uninterrupted_one() -> None:
    arguments = [
        "eval", "--planner", "push-through", "--planner", "bug1", "--family", "sparse",
        "-n", "3", "--log", "none", "--workers", "1",
    ]  # fmt: skip
    assert cli.run([*arguments, "--out", "whole"]) == 0
    assert cli.run([*arguments, "--out", "cut"]) == 0
    lines = Path("cut/episodes.jsonl")
    kept = b"".join(lines.read_bytes().splitlines(keepends=True)[:4])[:-30]
    assert kept.count(b"\n") == 3
    lines.write_bytes(kept)
    Path("cut/episodes.parquet").unlink()
    assert cli.run(["eval", "--resume", "--out", "cut", "--workers", "1"]) == 0
    assert timeless(load_rows(Path("cut"))) == timeless(load_rows(Path("whole")))
    columns = ["planner", "family", "scene_index", "path_length_m", "outcome", "ins"]
    whole = pl.read_parquet("whole/episodes.parquet", columns=columns)
    assert pl.read_parquet("cut/episodes.parquet", columns=columns).equals(whole)
    assert len(whole) == 6


def test_version_and_help() -> None:
    assert python("-m", "beacon_mj", "--version").stdout.strip() == __version__
    found = python("-m", "beacon_mj", "--help")
    assert found.returncode == 0
    for command in COMMANDS:
        assert command in found.stdout


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; from beacon_mj.cli import run; run(['eval', '--help']); "
        "print([m for m in ('mujoco', 'numba', 'scipy', 'polars') if m in sys.modules])"
    )
    found = python("-c", code)
    assert found.returncode == 0
    assert found.stdout.strip().endswith("[]")


def test_import_is_light() -> None:
    heavy = "['matplotlib', 'polars', 'scipy.stats', 'numba', 'mujoco', 'dm_control']"
    code = f"import sys, beacon_mj; print([m for m in {heavy} if m in sys.modules])"
    assert python("-c", code).stdout.strip() == "[]"
    time_it = "import time; t = time.perf_counter(); import {}; "
    time_it += "print(time.perf_counter() - t)"

    def seconds(module: str) -> float:
        code = time_it.format(module)
        return min(float(python("-c", code).stdout) for _ in range(3))

    assert seconds("beacon_mj") <= seconds("mujoco") + 0.3


def test_every_public_name_exists() -> None:
    import beacon_mj

    assert len(beacon_mj.__all__) > 15
    for name in beacon_mj.__all__:
        assert getattr(beacon_mj, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = beacon_mj.nothing


def test_the_version_is_the_projects() -> None:
    import tomllib

    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    assert project["version"] == __version__


def test_profiles_are_the_scenes() -> None:
    assert get_args(options.Profile) == PROFILES
