"""Planners that are programs: the protocol, the clients, and what failing costs."""

import json
import math
import shutil
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import pytest

import beacon_mj
from beacon_mj import cli
from beacon_mj.errors import BeaconError, PlannerError, RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.isolation import lines, wire
from beacon_mj.eval.runs.isolation.host import describe_isolated
from beacon_mj.eval.runs.run_folder import load_config
from beacon_mj.scene_gen.robots import shipped_robot
from tests.eval.runs.test_isolation import alive
from tests.eval.runs.test_runner import configured, run, timeless
from tests.repository import REPOSITORY

CLIENT = REPOSITORY / "examples" / "exec_python.py"
SCHEMA = REPOSITORY / "docs" / "reference" / "exec-v1.schema.json"
HASTY = ("protocol.max_steps=30", "protocol.decision_limit_s=1")

#: A client that answers as it should, but for what a test puts in.
TEMPLATE = """
import json, os, sys, time
steps = 0
for line in sys.stdin:
    message = json.loads(line)
    kind, reply = message["type"], {{"id": message["id"]}}
    if kind == "hello":
        reply |= {{"type": "hello", "protocol": 1, "config": {{"speed": 0.01}}}}
    elif kind in ("reset", "next_day"):
        reply |= {{"type": "ready"}}
    else:
        steps += 1
        reply |= {{"type": "command", "velocity_mps": [0.01, 0.0]}}
    text = json.dumps(reply)
    {code}
    print(text, flush=True)
"""


def program(folder: Path, code: str = "pass", name: str = "client") -> str:
    """Write a client; return what it is loaded by."""
    path = folder / f"{name}.py"
    path.write_text(TEMPLATE.format(code=code))
    return f"exec:{sys.executable} {path}"


def rows(spec: str, scenes: int = 1) -> list[Row]:
    config, refs = configured([spec], ("sparse",), scenes, HASTY)
    assert config.planners[0].isolated
    return run(config, refs)


@pytest.fixture(scope="module")
def go_round(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The client in C++, built."""
    compiler = next((c for c in ("c++", "g++", "clang++") if shutil.which(c)), None)
    if compiler is None:
        pytest.skip("no C++ compiler here")
    source = REPOSITORY / "examples" / "exec_cpp" / "go_round.cpp"
    out = tmp_path_factory.mktemp("built") / "go_round"
    warnings = ["-Wall", "-Wextra", "-Werror"]
    command = [compiler, "-O2", "-std=c++17", *warnings, "-o", str(out), str(source)]
    subprocess.run(command, check=True)
    return f"exec:{out}"


def test_the_client_in_cpp_keeps_the_contract_and_arrives(go_round: str) -> None:
    beacon_mj.check_planner(go_round)
    config, refs = configured([go_round], ("sparse", "cluttered"), 3, ())
    found = run(config, refs)
    assert [row.planner for row in found] == ["go_round"] * 6
    assert [row.outcome for row in found] == ["reached"] * 6
    assert timeless(run(config, refs)) == timeless(found)


def test_the_client_in_python_needs_no_package_and_arrives() -> None:
    code = CLIENT.read_text()
    assert "beacon_mj" not in [line.split()[1] for line in code.splitlines()
                               if line.startswith(("import ", "from "))]  # fmt: skip
    spec = f"exec:{sys.executable} -I {CLIENT}"
    beacon_mj.check_planner(spec)
    found = rows(spec, 2)
    assert [row.planner for row in found] == ["exec_python"] * 2
    assert all(row.path_length_m > 1.0 for row in found)


def test_every_message_is_of_the_schema(tmp_path: Path) -> None:
    jsonschema = pytest.importorskip("jsonschema", reason="no jsonschema here")
    shipped = REPOSITORY / "eval" / "runs" / "isolation" / SCHEMA.name
    assert shipped.read_text() == SCHEMA.read_text()
    schema = json.loads(SCHEMA.read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    said = tmp_path / "said"
    code = f"open({str(said)!r}, 'a').write(line + text + chr(10))"
    config, refs = configured(
        [program(tmp_path, code)],
        ("collision-required",),
        1,
        ("protocol.max_steps=60",),
    )
    run(config, refs)
    messages = [json.loads(line) for line in said.read_text().splitlines()]
    kinds = {message["type"] for message in messages}
    assert kinds == {"hello", "reset", "ready", "act", "command"}
    assert messages[-2]["observation"]["obstacles"]
    validator = jsonschema.Draft202012Validator(schema)
    for message in messages:
        validator.validate(message)
    wrong = {"type": "command", "id": 1, "velocity": [0.0, 0.0]}
    with pytest.raises(jsonschema.ValidationError):
        validator.validate(wrong)


def test_floats_cross_as_they_are(tmp_path: Path) -> None:
    """An echo of the position is the position, bit for bit."""
    code = (
        "if kind == 'act':\n"
        "        seen = message['observation']\n"
        "        reply['info'] = {'path_m': [seen['position_m']]}\n"
        "        reply['velocity_mps'] = [0.3, 0.1 / 3.0]\n"
        "        text = json.dumps(reply)"
    )
    from beacon_mj.eval.runs.isolation.program import External, Program

    process = Program(program(tmp_path, code), 4096)
    scene = beacon_mj.generate_scene("cluttered", 0)
    protocol = beacon_mj.Protocol(max_steps=30)
    try:
        planner = External(process, (), "echo", 30.0)
        trace = beacon_mj.run_episode(scene, planner, protocol=protocol)
    finally:
        process.end()
    assert len(trace.steps) == 30
    before = trace.start_m
    for step in trace.steps:
        assert step.command.info.path_m is not None
        assert step.command.info.path_m[0].tolist() == before.tolist()
        assert step.command.velocity_mps.tolist() == [0.3, 0.1 / 3.0]
        before = step.outcome.position_m


def test_a_program_drives_wheels_itself(tmp_path: Path) -> None:
    """It is told how the robot stands, and its turn rates are obeyed."""
    code = (
        "if kind == 'reset':\n"
        "        assert message['task']['drive'] == 'differential'\n"
        "        assert message['task']['turn_rate_max_radps'] > 1.0\n"
        "    if kind == 'act':\n"
        "        heading = message['observation']['heading_rad']\n"
        "        reply['velocity_mps'] = [0.0, 0.0]\n"
        "        reply['turn_rate_radps'] = 0.5\n"
        "        reply['info'] = {'terms': {'heading': heading}}\n"
        "        text = json.dumps(reply)"
    )
    from beacon_mj.eval.runs.isolation.program import External, Program

    process = Program(program(tmp_path, code), 4096)
    scene = beacon_mj.generate_scene("sparse", 0)
    protocol = beacon_mj.Protocol(robot=shipped_robot("diff-drive"), max_steps=20)
    try:
        planner = External(process, (), "turner", 30.0)
        trace = beacon_mj.run_episode(scene, planner, protocol=protocol)
    finally:
        process.end()
    assert trace.outcome == "timeout", trace.detail
    assert [s.command.turn_rate_radps for s in trace.steps] == [0.5] * 20
    told = [s.command.info.terms["heading"] for s in trace.steps]
    turned = (told[-1] - told[0] + math.pi) % (2.0 * math.pi) - math.pi
    assert turned == pytest.approx(0.5 * 1.9, abs=0.1)


@pytest.mark.parametrize(
    ("code", "why"),
    [
        ("if steps == 3: sys.exit(7)", "process died: exit status 7"),
        ("if steps == 3: os.kill(os.getpid(), 9)", "process died: SIGKILL"),
        ("if steps == 3: time.sleep(60)", "no decision within 1 s"),
        ("if steps == 3: text = 'thinking'", "no reply: JSON is malformed"),
        ("if steps == 3: print('thinking')", "thinking"),
        ("if steps == 3: text += chr(10) + text", "expected one line but there are"),
        ("if steps == 3: text = text.replace('0.0]', '0, 0]')", "length 2"),
        ("if steps == 3: text = text.replace('0.01', '1e9')", "at most 1e6 m/s"),
        ("if steps == 3: text = text.replace('velocity', 'speed')", "speed_mps"),
        (
            "if steps == 3: text = json.dumps({'type': 'ready', 'id': message['id']})",
            "a reply that nobody asked for",
        ),
        (
            "if steps == 3: text = text.replace(str(message['id']), '999', 1)",
            "a reply that nobody asked for",
        ),
        (
            "if steps == 3: text = json.dumps("
            "{'type': 'error', 'id': message['id'], 'text': 'by hand'})",
            "by hand",
        ),
        ("if kind == 'reset': sys.exit(3)", "process died: exit status 3"),
    ],
)
def test_what_a_program_does_costs_its_own_episode(
    tmp_path: Path, code: str, why: str
) -> None:
    [row] = rows(program(tmp_path, code))
    assert row.outcome == "planner_error"
    assert why in row.detail
    assert "\n" not in row.detail


def test_a_killed_program_is_started_anew(tmp_path: Path) -> None:
    mark = tmp_path / "died"
    code = (
        f"if steps == 3 and not os.path.exists({str(mark)!r}):\n"
        f"        open({str(mark)!r}, 'w').write(str(os.getpid()))\n"
        "        os.kill(os.getpid(), 9)"
    )
    found = rows(program(tmp_path, code), scenes=3)
    assert [row.outcome for row in found] == ["planner_error", "timeout", "timeout"]
    assert not alive(int(mark.read_text()))


def test_other_planners_of_a_run_go_on(tmp_path: Path) -> None:
    code = "if steps == 3: os.kill(os.getpid(), 9)"
    specs = [program(tmp_path, code), "push-through"]
    config, refs = configured(specs, settings=HASTY)
    found = {row.planner: row.outcome for row in run(config, refs)}
    assert found == {"client": "planner_error", "push-through": "timeout"}


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("exec:", "there is no command"),
        ("exec:'no end", "expected a command: No closing quotation"),
        ("exec:no-such-program here", "there is no 'no-such-program'"),
        ("exec:true", "process died"),
        ("exec:cat", "its process sent no reply"),
    ],
)
def test_what_is_no_program_is_refused_in_one_line(spec: str, message: str) -> None:
    with pytest.raises(PlannerError) as refused:
        describe_isolated(spec, {}, "name", 30.0, 4096)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_another_version_of_the_protocol_is_refused() -> None:
    with pytest.raises(ValueError, match="expected protocol 1 but it speaks 2"):
        lines.parsed(b'{"type":"hello","id":0,"protocol":2}\n')
    said = lines.parsed(b'{"type":"hello","id":0,"protocol":1}\n')
    assert said == wire.Ready(0)


def test_values_are_set_by_name_and_checked(tmp_path: Path) -> None:
    mark = tmp_path / "config"
    code = f"if kind == 'reset': open({str(mark)!r}, 'w').write(line)"
    spec = program(tmp_path, code)
    settings = [*HASTY, "client.speed=0.5"]
    config, refs = configured([spec], settings=settings)
    assert config.planners[0].config == {"speed": 0.5}
    run(config, refs)
    assert json.loads(mark.read_text())["config"] == {"speed": 0.5}
    with pytest.raises(PlannerError, match=r"field of client 'sped'\. Did you mean"):
        configured([spec], settings=["client.sped=0.5"])
    with pytest.raises(
        PlannerError, match="speed to be a finite number but it was 'x'"
    ):
        configured([spec], settings=["client.speed=x"])


def test_a_run_records_the_program_and_goes_on_only_when_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    program(tmp_path)
    spec = f"exec:{sys.executable} client.py"
    out = tmp_path / "run"
    results = beacon_mj.evaluate(
        [spec], families=["sparse"], scenes_per_family=1, settings=HASTY,
        workers=1, report=False, out=out,
    )  # fmt: skip
    [entry] = load_config(out).planners
    assert (entry.name, entry.isolated, [*entry.code][-1]) == (
        "client", True, "client.py",
    )  # fmt: skip
    assert entry.loaded_from == f"exec:{sys.executable} " + str(tmp_path / "client.py")
    (tmp_path / "sub").mkdir()
    monkeypatch.chdir(tmp_path / "sub")
    with pytest.raises(RunError, match=r"--trust-code, .* would run exec:.*client\.py"):
        beacon_mj.verify(out, rerun=True)
    assert beacon_mj.verify(out, rerun=True, trust_code=True, workers=1).ok
    (tmp_path / "client.py").write_text(TEMPLATE.format(code="steps = 0"))
    with pytest.raises(BeaconError, match=r"client\.py is another file"):
        beacon_mj.bundle(results.folder, tmp_path / "run.zip")


def test_a_program_ends_with_its_evaluation(tmp_path: Path) -> None:
    mark = tmp_path / "pid"
    code = f"open({str(mark)!r}, 'w').write(str(os.getpid()))"
    spec = program(tmp_path, code)
    call = (
        "from beacon_mj.eval.runs.isolation.program import Program\n"
        "import os, time\n"
        f"process = Program({spec!r}, 1024)\n"
        "process.start()\nos.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", call], cwd=REPOSITORY, check=False)
    pid, deadline = int(mark.read_text()), time.monotonic() + 10.0
    while alive(pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive(pid)


def test_the_command_checks_planners_of_all_kinds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["check-planner", "push-through", "--steps", "5"]) == 0
    assert cli.run(["check-planner", program(tmp_path), "--steps", "5"]) == 0
    assert capsys.readouterr().out.count("keeps the contract") == 2
    code = "if kind == 'act': text = text.replace('0.01', str(time.time() % 1))"
    fickle = program(tmp_path, code, "fickle")
    assert cli.run(["check-planner", fickle, "--steps", "5"]) == 2
    error = capsys.readouterr().err
    assert "fickle: expected the same commands" in error
    assert error.count("\n") == 1


def test_a_program_that_says_so_may_be_fickle(tmp_path: Path) -> None:
    code = (
        "if kind == 'act': text = text.replace('0.01', str(time.time() % 1))\n"
        "    if kind == 'hello': text = text[:-1] + ', \"bit_reproducible\": false}'"
    )
    beacon_mj.check_planner(program(tmp_path, code), steps=5)


def test_replies_are_plain_data() -> None:
    kinds = msgspec.inspect.type_info(lines.Reply)
    assert "CustomType" not in repr(kinds)
