"""A robot through a whole evaluation: recorded, logged, verified, and not mixed up."""

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

import beacon_mj
from beacon_mj.cli import run
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.errors import RunError, TemplateError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import COLUMNS
from beacon_mj.eval.runs.run_folder import load_config, load_rows
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import Planner
from beacon_mj.recording import Recorder, read_log, read_trace
from beacon_mj.recording.verify import verify
from beacon_mj.scene_gen.robots import RobotFile, shipped_robot
from tests.own_robot import OWN_ROBOT
from tests.worlds import cached_scene

SMALL: dict[str, Any] = {
    "families": ["sparse"],
    "scenes_per_family": 1,
    "workers": 1,
    "report": False,
}


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "mine" / "porter.xml"
    path.parent.mkdir()
    path.write_text(OWN_ROBOT)
    return path


def test_a_robot_that_is_not_ours_is_checked_used_logged_and_verified(
    robot: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["robots", "--check", str(robot)]) == 0
    assert "porter" in capfd.readouterr().out
    out = tmp_path / "run"
    found = beacon_mj.evaluate(["dstar-lite"], robot=robot, out=out, **SMALL)
    [row] = found.episodes
    assert row.success
    assert row.robot == "porter.xml"
    assert list(row.as_dict()) == [
        *COLUMNS[: COLUMNS.index("outcome")],
        "robot",
        *COLUMNS[COLUMNS.index("outcome") :],
    ]
    assert found.rows["robot"].to_list() == ["porter.xml"]
    config = load_config(out)
    assert isinstance(config.protocol.robot, RobotFile)
    assert config.protocol.robot.mjcf == OWN_ROBOT
    assert load_rows(out) == [row]
    robot.unlink()  # All that is needed is in the record.
    log = read_log(out / "logs" / "dstar-lite" / "sparse_0000.mcap")
    assert log.protocol.robot == config.protocol.robot
    assert 'name="hull"' in log.mjcf
    assert (log.row or {})["robot"] == "porter.xml"
    assert len(log.qpos[0]) % 7 == 9 % 7
    assert beacon_mj.verify(out).ok
    turned = [m.transforms[0].rotation.z for _, m in log.messages["/tf"]]
    assert max(map(abs, turned)) > 0.01


def test_metrics_are_of_that_robot(robot: Path, tmp_path: Path) -> None:
    found = beacon_mj.evaluate(["dstar-lite"], robot=robot, out=tmp_path / "a", **SMALL)
    [row] = found.episodes
    kappa = 0.2 * 14.6 * 9.81
    assert row.motion_energy_j == pytest.approx(kappa * row.path_length_m)


def test_the_disc_leaves_no_trace_of_itself(tmp_path: Path) -> None:
    plain = beacon_mj.evaluate(["dstar-lite"], out=tmp_path / "a", **SMALL)
    named = beacon_mj.evaluate(
        ["dstar-lite"], robot="disc", out=tmp_path / "b", **SMALL
    )
    assert tuple(plain.rows.columns) == COLUMNS
    ours, theirs = (r.episodes[0].as_dict() for r in (plain, named))
    clock = {"wall_time_s", "plan_ms_p50", "plan_ms_p99"}
    assert {k: v for k, v in ours.items() if k not in clock} == {
        k: v for k, v in theirs.items() if k not in clock
    }
    text = (tmp_path / "a" / "config.json").read_text()
    assert "robot" not in msgspec.json.decode(text)["protocol"]


def test_another_robot_is_another_run(robot: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    beacon_mj.evaluate(["dstar-lite"], robot=robot, out=out, **SMALL)
    for other in (None, "diff-drive"):
        with pytest.raises(RunError, match="protocol differs"):
            beacon_mj.evaluate(
                ["dstar-lite"], robot=other, out=out, resume=True, **SMALL
            )
    robot.write_text(OWN_ROBOT.replace('mass="13"', 'mass="14"'))
    with pytest.raises(RunError, match="protocol differs"):
        beacon_mj.evaluate(["dstar-lite"], robot=robot, out=out, resume=True, **SMALL)


def test_shards_of_two_robots_do_not_merge(robot: Path, tmp_path: Path) -> None:
    small = SMALL | {"scenes_per_family": 2}
    shards = [tmp_path / "1", tmp_path / "2"]
    beacon_mj.evaluate(["bug1"], robot=robot, out=shards[0], shard="1/2", **small)
    robot.write_text(OWN_ROBOT.replace('mass="13"', 'mass="14"'))
    beacon_mj.evaluate(["bug1"], robot=robot, out=shards[1], shard="2/2", **small)
    with pytest.raises(RunError, match="protocol"):
        beacon_mj.merge(tmp_path / "whole", shards)


def test_robots_side_by_side(tmp_path: Path) -> None:
    found = beacon_mj.evaluate(
        ["dstar-lite"],
        vary=["protocol.robot=disc,diff-drive"],
        out=tmp_path / "run",
        **SMALL,
    )
    table = found.rows
    assert table["set.protocol.robot"].to_list() == ["diff-drive", "disc"]
    assert table["robot"].to_list() == ["diff-drive", None]
    assert beacon_mj.verify(tmp_path / "run").ok


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("<mujoco/>", "base"),
        (OWN_ROBOT.replace("wheel_left", "wheel_port"), "wheel_left"),
    ],
)
def test_faults_are_lines_and_status_2(
    robot: Path, text: str, word: str, capfd: pytest.CaptureFixture[str]
) -> None:
    robot.write_text(text)
    assert run(["robots", "--check", str(robot)]) == 2
    lines = capfd.readouterr().err.splitlines()
    assert len(lines) > 1
    assert any(word in line for line in lines)
    assert all(line.startswith(f"{robot}: expected") for line in lines)
    with pytest.raises(TemplateError, match="expected"):
        beacon_mj.evaluate(["bug1"], robot=robot, **SMALL)
    assert beacon_mj.check_robot(robot).faults


def test_the_list_of_robots(capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["robots"]) == 0
    out = capfd.readouterr().out
    assert "diff-drive" in out
    assert "disc" in out
    assert [r.drive for r in beacon_mj.list_robots()] == ["differential", "holonomic"]


class Arcs(Planner):
    """Drives itself, by (v, omega): turns to the goal, and arcs on its way."""

    def reset(self, task: Task) -> None:
        self.task = task

    def act(self, observation: Observation) -> Command:
        assert observation.heading_rad is not None
        ahead = self.task.goal_m - observation.position_m
        error = np.arctan2(ahead[1], ahead[0]) - observation.heading_rad
        error = (error + np.pi) % (2.0 * np.pi) - np.pi
        speed = 0.4 if abs(error) < 0.5 else 0.0
        return Command(
            velocity_mps=np.array([speed, 0.0]), turn_rate_radps=float(2.0 * error)
        )


def test_a_planner_that_drives_itself_is_logged_and_verified(tmp_path: Path) -> None:
    log = tmp_path / "arcs.mcap"
    protocol = Protocol(robot=shipped_robot("diff-drive"), max_steps=60)

    def row(trace: beacon_mj.Trace) -> dict[str, object]:
        return measure(trace).as_dict()

    trace = run_episode(
        cached_scene("sparse", 0),
        Arcs(),
        protocol=protocol,
        listeners=[Recorder(log, row=row)],
    )
    assert trace.outcome in ("reached", "timeout")
    rates = [r.command.turn_rate_radps for r in trace.steps]
    assert None not in rates
    assert [r.command.turn_rate_radps for r in read_trace(log).steps] == rates
    found = verify(log, row)
    assert found.ok, found.problem


def test_a_planner_that_drives_itself_cannot_drive_the_disc() -> None:
    class Turning(Arcs):
        def act(self, observation: Observation) -> Command:
            return Command(velocity_mps=np.zeros(2), turn_rate_radps=1.0)

    trace = run_episode(cached_scene("sparse", 0), Turning())
    assert trace.outcome == "planner_error"
    assert "does not turn" in trace.detail


def test_sideways_is_no_way_to_drive() -> None:
    class Crab(Arcs):
        def act(self, observation: Observation) -> Command:
            return Command(velocity_mps=np.array([0.1, 0.1]), turn_rate_radps=1.0)

    protocol = Protocol(robot=shipped_robot("diff-drive"))
    trace = run_episode(cached_scene("sparse", 0), Crab(), protocol=protocol)
    assert trace.outcome == "planner_error"
    assert "(v, 0)" in trace.detail


def test_an_isolated_planner_drives_itself_too(tmp_path: Path) -> None:
    file = tmp_path / "turner.py"
    file.write_text(
        "import numpy as np\n"
        "from beacon_mj import Command, Planner\n\n\n"
        "class Turner(Planner):\n"
        "    def reset(self, task):\n"
        "        self.task = task\n\n"
        "    def act(self, seen):\n"
        "        assert self.task.drive == 'differential'\n"
        "        assert abs(seen.turn_rate_radps) <= 2.0\n"
        "        return Command(\n"
        "            velocity_mps=np.zeros(2), turn_rate_radps=0.5,\n"
        "            give_up=seen.heading_rad > 1.0,\n"
        "        )\n"
    )
    found = beacon_mj.evaluate(
        [f"{file}:Turner"], robot="diff-drive", out=tmp_path / "run", **SMALL
    )
    [row] = found.episodes
    assert (row.outcome, row.detail) == ("gave_up", "")
    assert 18 <= row.steps <= 24
