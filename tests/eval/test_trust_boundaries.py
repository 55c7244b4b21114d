"""What others name or write reaches no page, terminal or table as anything but text."""

import dataclasses
import html
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import msgspec
import numpy as np
import pytest

import beacon_mj
from beacon_mj import cli
from beacon_mj.eval.report.page import render_report
from beacon_mj.eval.report.reproduction import markdown
from beacon_mj.eval.statistics.oracles import NOTE
from beacon_mj.eval.statistics.results import Results, load_results
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle, Truth
from beacon_mj.recording import read_log, rebuild_trace
from beacon_mj.rendering.captions import describe
from beacon_mj.rendering.panel import panel_svg
from tests.eval.report.test_report import Page
from tests.eval.statistics.test_compare import rows, write_run
from tests.recording.samples import PushThrough, record, scene_with_damage
from tests.repository import REPOSITORY

EVIL = "</title><script>alert(1)</script>\x1b[31m$\\frac$|[red]_"


class Seer(Oracle):
    """Is told the truth, and gives up."""

    def set_truth(self, truth: Truth) -> None:
        self.truth = truth

    def reset(self, task: Task) -> None:
        assert self.truth.obstacles

    def act(self, observation: Observation) -> Command:
        return Command(velocity_mps=np.zeros(2), give_up=True)


class Liar(Planner):
    """Asks for the truth, and says that its class is another one."""

    @property
    def __class__(self) -> Any:
        return Seer

    @__class__.setter
    def __class__(self, cls: Any) -> None: ...

    def set_truth(self, truth: Truth) -> None:
        raise AssertionError("it was told the truth")

    def reset(self, task: Task) -> None: ...

    def act(self, observation: Observation) -> Command:
        return Command(velocity_mps=np.zeros(2), give_up=True)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return beacon_mj.evaluate(
        {"beacon": Seer, "mine": Liar, "dstar-lite": "push-through"},
        families=["sparse"],
        scenes_per_family=2,
        protocol=beacon_mj.Protocol(max_steps=5),
        workers=1,
        out=tmp_path_factory.mktemp("oracles") / "run",
    )


def test_an_oracle_is_marked_in_rows_whatever_its_name(run: Results) -> None:
    assert {row.planner: row.oracle for row in run.episodes} == {
        "beacon": True, "mine": False, "dstar-lite": False
    }  # fmt: skip
    assert {row.outcome for row in run.episodes if row.planner == "mine"} == {"gave_up"}
    assert run.rows["oracle"].sum() == 2
    log = read_log(run.log("beacon", "sparse", 0))
    assert beacon_mj.measure(rebuild_trace(log)).oracle
    assert beacon_mj.verify(run.folder, workers=1).ok


def test_an_oracle_is_marked_in_every_table(run: Results) -> None:
    assert run.summary()["oracles"] == ["beacon"]
    table = str(run.table())
    assert table.count("beacon*") == 2
    assert table.rstrip().endswith(NOTE)
    found = beacon_mj.compare(run)
    assert "beacon* against dstar-lite" in str(found)
    assert NOTE in str(found)
    assert [c.first_oracle for c in found] == [True, False]
    page = Page(render_report(run, with_replay=False)).text
    assert page.index("Reference planners") < page.index("beacon*")
    assert "Planners of the paper dstar-lite" in page
    assert "*beacon* (oracle)" in markdown(run)


def test_a_table_without_oracles_has_no_note(run: Results) -> None:
    others = [row for row in run.episodes if not row.oracle]
    assert NOTE not in str(Results(run.folder, run.config, others).table())


def test_names_are_text_in_a_report(tmp_path: Path) -> None:
    names = [EVIL, "_hidden", "mine"]
    found = [row for name in names for row in rows([4.0, 5.0], [True, False], name)]
    found = [msgspec.structs.replace(row, detail=EVIL) for row in found]
    results = load_results(write_run(tmp_path / "r", names, found))
    text = render_report(results, baseline="mine")
    assert "<script" not in text
    assert "\x1b" not in text
    assert "Content-Security-Policy" in text.split("<title>")[0]
    assert "</title><script>alert(1)</script>\\x1b[31m" in Page(text).text
    assert "<script" not in markdown(results).replace("\\<", "")
    shown = str(results.table()) + str(beacon_mj.compare(results, baseline="mine"))
    assert "\x1b" not in shown
    assert "[red]" in "".join(shown.split())


def test_names_are_text_in_drawings_and_captions(tmp_path: Path) -> None:
    record(tmp_path / "x.mcap", scene_with_damage(), PushThrough())
    log = read_log(tmp_path / "x.mcap")
    log = dataclasses.replace(log, config=log.config | {"planner": EVIL})
    words = [e.text or "" for e in ElementTree.fromstring(panel_svg(log)).iter()]
    assert any("<script>alert(1)</script>\\x1b[31m" in word for word in words)
    lines = describe(rebuild_trace(log), 1)
    assert all(line.isprintable() for line in lines)


def test_names_are_text_in_a_replay(tmp_path: Path) -> None:
    render = pytest.importorskip("beacon_mj.rendering.html").render_page
    record(tmp_path / "x.mcap", scene_with_damage(), PushThrough())
    log = read_log(tmp_path / "x.mcap")
    log = dataclasses.replace(log, config=log.config | {"planner": EVIL})
    text = render(log, tmp_path / "x.html").read_text()
    assert "<script>alert" not in text
    assert html.escape("</title><script>alert(1)") in text
    policy = text.partition('http-equiv="Content-Security-Policy" content="')[2]
    assert policy.startswith("default-src 'none'; ")
    assert "http" not in policy.partition('"')[0]


def test_a_replay_within_a_report_is_sandboxed(run: Results) -> None:
    text = render_report(run)
    assert text.count("<iframe ") == text.count('<iframe sandbox="allow-scripts" ') == 1


def test_dask_in_the_docs_listens_on_this_machine_alone() -> None:
    pages = "\n".join(p.read_text() for p in (REPOSITORY / "docs").glob("*.md"))
    lines = re.findall(r"^\s*dask (?:scheduler|worker) .*$", pages, re.M)
    assert len(lines) >= 2
    for line in lines:
        assert "--host 127.0.0.1" in line
        assert "--no-dashboard" in line or "--dashboard-address 127.0.0.1" in line


def test_linked_log_folders_are_verified(run: Results, tmp_path: Path) -> None:
    logs = run.folder / "logs"
    logs.rename(tmp_path / "elsewhere")
    logs.symlink_to(tmp_path / "elsewhere")
    assert len(beacon_mj.verify(run.folder, workers=1).logs) == 6
    damaged = tmp_path / "elsewhere" / "mine" / "sparse_0001.mcap"
    damaged.write_bytes(damaged.read_bytes()[:-200])
    assert cli.run(["verify", str(run.folder), "--workers", "1"]) == 1
