"""Planners in a process of their own: equal rows, and nothing that reaches others."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import pytest

from beacon_mj import evaluate
from beacon_mj.errors import PlannerError
from beacon_mj.eval.runs.config import RunConfig
from beacon_mj.eval.runs.isolation import wire
from beacon_mj.eval.runs.isolation.child import TRUTH
from beacon_mj.eval.runs.isolation.host import Child, describe_isolated
from beacon_mj.eval.runs.lineup import line_up, planner_entries
from beacon_mj.eval.runs.run_folder import load_config, load_rows
from beacon_mj.planners.push_through import PushThrough
from tests.eval.misbehaving import Case
from tests.eval.runs.test_runner import HOSTILE, configured, hostile, run, timeless
from tests.eval.runs.test_worker_process import within
from tests.repository import REPOSITORY

HASTY = ("protocol.max_steps=30", "protocol.decision_limit_s=1")


class Own(PushThrough):
    """A planner that only this process has."""


def isolated(config: RunConfig) -> RunConfig:
    replace = msgspec.structs.replace
    entries = tuple(replace(e, isolated=True) for e in config.planners)
    return replace(config, planners=entries)


def details(case: Case, folder: Path, scenes: int = 1) -> list[str]:
    """Return what the rows of a planner in its own process say."""
    spec = case.write(folder)
    config, refs = configured([spec], scenes_per_family=scenes, settings=HASTY)
    assert config.planners[0].isolated
    return [row.detail for row in run(config, refs)]


@pytest.mark.parametrize("name", ["beacon", "dstar-lite"])
def test_rows_are_the_same_in_both_ways(name: str) -> None:
    families = ["cluttered", "collision-required"]
    config, refs = configured([name], families, settings=["protocol.max_steps=400"])
    inside = run(config, refs)
    assert sum(row.contacts for row in inside) > 0 or name != "beacon"
    assert timeless(run(isolated(config), refs)) == timeless(inside)


def test_rows_are_the_same_under_noise_and_occlusion() -> None:
    settings = [
        "protocol.max_steps=100", "protocol.pose_noise_m=0.02",
        "protocol.missed_detection=0.3", "protocol.occlusion=true",
    ]  # fmt: skip
    config, refs = configured(["beacon-voi"], ["cluttered"], settings=settings)
    assert timeless(run(isolated(config), refs)) == timeless(run(config, refs))


def test_files_are_isolated_unless_told_otherwise() -> None:
    specs = [hostile("Harmless"), "bug1"]
    for isolate, expected in ((None, (True, False)), (True, (True,) * 2), (False, ())):
        entries, _ = planner_entries(specs, ["Harmless.at=7"], isolate)
        assert tuple(e.isolated for e in entries) == (expected or (False, False))
        assert entries[0].config == {"at": 7, "seed": -1}


def test_a_file_is_not_imported_here(tmp_path: Path) -> None:
    code = f"open({str(tmp_path / 'seen')!r}, 'a').write(f'{{os.getpid()}} ')"
    config, refs = configured([Case("Who", "import", code, None).write(tmp_path)])
    run(config, refs)
    seen = (tmp_path / "seen").read_text().split()
    assert len({*seen}) == 2  # To read its configuration, and to run it.
    assert str(os.getpid()) not in seen


@pytest.mark.parametrize(
    ("spec", "settings", "message"),
    [
        ("missing.py:Anything", {}, "missing.py: expected a Python file"),
        (hostile("Harmles"), {}, "Did you mean 'Harmless'"),
        (hostile("Unfinished"), {}, "lacks act"),
        (hostile("Harmless"), {"att": "1"}, "field of Harmless 'att'"),
        (
            hostile("Harmless"),
            {"at": "x"},
            "Harmless.at to be an integer but it was 'x'",
        ),
    ],
)
def test_what_cannot_be_loaded_is_refused_in_one_line(
    spec: str, settings: dict[str, str], message: str
) -> None:
    name = spec.rpartition(":")[2]
    with pytest.raises(PlannerError) as refused:
        describe_isolated(spec, settings, name, 30.0, 4096)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("raise ValueError('by hand')", "cannot be imported: ValueError: by hand"),
        ("raise KeyboardInterrupt", "KeyboardInterrupt"),
        ("os._exit(0)", "process died: exit status 0"),
        ("sum(itertools.repeat(0))", "no end of its import within 2 s"),
    ],
)
def test_an_import_that_fails_is_refused_in_one_line(
    tmp_path: Path, code: str, message: str
) -> None:
    spec = Case("Bad", "import", code, None).write(tmp_path)
    with pytest.raises(PlannerError, match=message) as refused:
        describe_isolated(spec, {}, "Bad", 0.1 if "2 s" in message else 30.0, 4096)
    assert spec.rpartition(":")[0] in str(refused.value)


def test_an_oracle_is_not_isolated(tmp_path: Path) -> None:
    seer = tmp_path / "seer.py"
    seer.write_text(
        "from beacon_mj.planners.clairvoyant import Clairvoyant\n"
        "class Seer(Clairvoyant):\n    pass\n"
    )
    for spec, isolate in ((f"{seer}:Seer", None), ("clairvoyant", True)):
        with pytest.raises(PlannerError, match=r"is an oracle.* Use --no-isolate"):
            planner_entries([spec], [], isolate)
    entries, _ = planner_entries([f"{seer}:Seer"], [], False)
    assert not entries[0].isolated


def test_variants_of_an_isolated_planner_are_isolated() -> None:
    found = line_up(
        [hostile("Harmless")],
        vary=["Harmless.at=4,5", "protocol.max_steps=20,30"],
        settings=["protocol.decision_limit_s=20"],
    )
    assert not found.handed
    assert all(entry.isolated for entry in found.entries)
    assert [entry.config["at"] for entry in found.entries] == [4, 4, 5, 5]
    config, refs = configured([hostile("Harmless")])
    config = msgspec.structs.replace(
        config, planners=found.entries, protocol=found.protocol
    )
    rows = {row.planner: row.steps for row in run(config, refs)}
    assert rows == {e.name: e.protocol.max_steps for e in found.entries if e.protocol}


def test_what_cannot_be_isolated_is_refused() -> None:
    config = PushThrough.Config()
    assert line_up([PushThrough], isolate=True).entries[0].isolated
    for choice in (("push-through", config), (hostile("Harmless"), config), Own):
        with pytest.raises(PlannerError, match="in a process of its own, but it was"):
            line_up([choice], isolate=True)


@pytest.mark.parametrize("isolate", [True, False])
@pytest.mark.parametrize(
    ("body", "line"), [("raise ValueError('by hand')", 6), ("return None", 5)]
)
def test_the_line_at_which_a_planner_fails_is_told(
    tmp_path: Path, isolate: bool, body: str, line: int
) -> None:
    path = tmp_path / "fails.py"
    path.write_text(
        "from beacon_mj.planners.base import Planner\n"
        "class Fails(Planner):\n"
        "    def reset(self, task):\n        pass\n"
        f"    def act(self, observation):\n        {body}\n"
    )
    results = evaluate(
        [f"{path}:Fails"],
        families=["sparse"],
        scenes_per_family=1,
        out=tmp_path / "run",
        workers=1,
        isolate=isolate,
    )
    assert [fault.where for fault in results.faults] == [f"{path}:{line}"]
    assert f"({path}:{line})" in results.failures()[0]


@pytest.mark.parametrize("name", TRUTH)
def test_the_truth_cannot_be_imported(name: str, tmp_path: Path) -> None:
    assert (REPOSITORY / name.replace(".", "/")).exists()
    code = f"import {name}.anything" if name == "beacon_mj.eval" else f"import {name}"
    [detail] = details(Case("Spy", "act", code, None), tmp_path)
    assert "is out of reach of a planner in a process of its own" in detail


def test_nothing_that_holds_the_truth_is_loaded(tmp_path: Path) -> None:
    code = (
        "held = [m for m in sys.modules if m.startswith('beacon_mj.')]\n"
        "held += [m for m in sys.modules if m in ('mujoco', 'dm_control')]\n"
        "raise RuntimeError(' '.join(sorted(held)))"
    )
    [detail] = details(Case("Lists", "act", code, None), tmp_path)
    loaded = detail.removeprefix("RuntimeError: ").split()
    assert "beacon_mj.interface" in loaded
    mine = {"beacon_mj.eval", "beacon_mj.eval.runs", "beacon_mj.eval.runs.overrides"}
    mine |= {"beacon_mj.eval.runs.location", "beacon_mj.eval.runs.sandbox"}
    mine.add("beacon_mj.eval.runs.text_values")
    for name in loaded:
        assert not name.startswith(("mujoco", "dm_control"))
        if any(name == t or name.startswith(f"{t}.") for t in TRUTH):
            assert name in mine or name.startswith("beacon_mj.eval.runs.isolation")


def test_one_process_serves_all_episodes_and_is_replaced_when_it_died(
    tmp_path: Path,
) -> None:
    code = "raise RuntimeError(f'process {os.getpid()}')"
    first, *others = details(Case("Same", "act", code, None), tmp_path, 3)
    assert first.startswith("RuntimeError: process ")
    assert {*others} == {first}
    code = (
        "mark = '{}'\nif not os.path.exists(mark):\n    open(mark, 'w').close()\n"
        "    os._exit(9)\nraise RuntimeError('alive')"
    ).format(tmp_path / "died")
    found = details(Case("Once", "act", code, None), tmp_path, 3)
    assert found[0] == "the planner's process died: exit status 9"
    assert found[1:] == ["RuntimeError: alive"] * 2


def test_a_kept_process_reads_an_edited_file_and_follows_to_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tell = "raise RuntimeError(f'{mark} {{os.getpid()}} {{os.getcwd()}}')"
    found = []
    for mark, folder in (("a", tmp_path), ("bc", tmp_path), ("bc", tmp_path / "sub")):
        folder.mkdir(exist_ok=True)
        monkeypatch.chdir(folder)
        case = Case("Teller", "act", tell.format(mark=mark), None)
        found.append(details(case, tmp_path)[0].split()[1:])
    (a, one, here), (b, same, _), (_, other, there) = found
    assert (a, b, here, there) == ("a", "bc", str(tmp_path), str(tmp_path / "sub"))
    assert one == same != other


def test_a_forked_process_ends_with_its_planner(tmp_path: Path) -> None:
    mark = tmp_path / "forked"
    code = (
        "child = os.fork()\nif child == 0:\n    time.sleep(600)\n"
        f"open({str(mark)!r}, 'w').write(str(child))\nwhile True: pass"
    )
    [detail] = details(Case("Forker", "act", code, None), tmp_path)
    assert "no decision within" in detail
    assert within(10.0, lambda: not alive(int(mark.read_text())))


def alive(pid: int) -> bool:
    try:
        text = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False
    return text.rpartition(")")[2].split()[0] not in "ZX"


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (b"\x00\x00\x00\x05hello", "no reply"),
        (b"\xff\xff\xff\xff", "no reply: a message of 4294967295 bytes"),
        (b"\x00\x00\x00\x03\x93\x00\x07\x80", "no reply"),
        (b"\x00\x00\x00\x04\x93\x00\x07\x80", "a reply that nobody asked for"),
        (b"\x00\x00\x00\x04\x93\x00\x07\x80" * 2, "no reply: more than one message"),
    ],
)
def test_what_is_no_reply_ends_the_process(
    tmp_path: Path, body: bytes, why: str
) -> None:
    code = (
        "for fd in range(3, 50):\n    try:\n"
        f"        if os.readlink(f'/proc/self/fd/{{fd}}')[:6] == 'socket': "
        f"os.write(fd, {body!r})\n    except OSError: pass\ntime.sleep(60)"
    )
    [detail] = details(Case("Forger", "act", code, None), tmp_path)
    assert why in detail


def test_replies_are_plain_data() -> None:
    kinds = msgspec.inspect.multi_type_info([wire.Ready, wire.Failed, wire.Decided])
    text = repr(kinds)
    assert "CustomType" not in text
    assert "AnyType" in text  # The configuration: what JSON knows, and no more.


def test_a_process_that_was_not_asked_ends_quietly() -> None:
    child = Child(1024)
    assert child.end() is None
    child.start()
    assert child.end() is None


def test_a_command_keeps_its_output_and_says_who_was_isolated(tmp_path: Path) -> None:
    talks = Case("Talks", "act", "print('thinking', flush=True)", None).write(tmp_path)
    done = subprocess.run(
        [
            sys.executable, "-m", "beacon_mj", "eval", "--planner", talks,
            "--planner", "push-through", "--family", "sparse", "-n", "1",
            "--workers", "1", "--json", "--set", "protocol.max_steps=20",
            "--out", str(tmp_path / "run"),
        ],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Talks" in str(msgspec.json.decode(done.stdout))
    config = load_config(tmp_path / "run")
    assert [(e.name, e.isolated) for e in config.planners] == [
        ("Talks", True),
        ("push-through", False),
    ]
    assert len(load_rows(tmp_path / "run")) == 2


def test_closed_streams_do_not_matter(tmp_path: Path) -> None:
    out = tmp_path / "out"
    code = (
        "import os; os.closerange(0, 3)\n"
        "from beacon_mj.eval.runs.isolation.host import describe_isolated\n"
        f"found = describe_isolated({hostile('Harmless')!r}, {{}}, 'H', 30.0, 4096)\n"
        f"open({str(out)!r}, 'w').write(repr(found.config))"
    )
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
    assert out.read_text() == "{'at': 3, 'seed': -1}"


@pytest.mark.parametrize("planner", ["Hangs", "Harmless"])
def test_the_process_of_a_killed_run_ends(planner: str, tmp_path: Path) -> None:
    parent = subprocess.Popen(
        [
            sys.executable, "-m", "beacon_mj", "eval",
            "--planner", f"{HOSTILE}:{planner}", "--family", "sparse",
            "-n", "200", "--workers", "1",
            "--set", "protocol.decision_limit_s=1000", "--out", str(tmp_path / "run"),
        ],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        logs = tmp_path / "run" / "logs" / planner
        assert within(120.0, lambda: len([*logs.glob("*")]) >= 1)
        time.sleep(1.0)
        found = children(parent.pid)
        assert found
        parent.kill()
        parent.wait()
        assert within(15.0, lambda: not any(alive(pid) for pid in found))
    finally:
        parent.kill()
        parent.wait()
        for pid in [pid for pid in children(parent.pid) if alive(pid)]:
            os.kill(pid, signal.SIGKILL)


def children(parent: int) -> list[int]:
    """Return the isolated planners of a process."""
    command = ["ps", "-eww", "-o", "pid=,ppid=,args="]
    listed = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = [line.split(maxsplit=2) for line in listed.stdout.splitlines()]
    return [
        int(pid)
        for pid, above, *text in lines
        if int(above) == parent and "isolation" in "".join(text)
    ]
