"""The report: every run renders, nothing is loaded from elsewhere, and it says so."""

import html
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path

import msgspec
import pytest

from beacon_mj import cli
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.report import episodes, figures
from beacon_mj.eval.report.check import page_problem
from beacon_mj.eval.report.command import command_of
from beacon_mj.eval.report.page import calibrations, render_report
from beacon_mj.eval.report.reproduction import BEGIN, END, markdown
from beacon_mj.eval.statistics.results import load_results
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.eval.studies.calibration import (
    FIRST,
    PUSHED_FIRST,
    PUSHED_LAST,
    Forecast,
    read_beliefs,
    reliability,
)
from tests.eval.statistics.test_compare import rows, write_run

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


class Page(HTMLParser):
    """What a page refers to, its text, and whether its elements are closed."""

    VOID = ("meta", "link", "img", "br", "hr", "input", "source")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.words: list[str] = []
        self.tables = 0
        self._open: list[str] = []
        self.feed(text)
        assert self._open == []

    def handle_starttag(
        self, tag: str, attrs: Sequence[tuple[str, str | None]]
    ) -> None:
        given = dict(attrs)
        self.sources += [given[k] or "" for k in ("src", "href") if k in given]
        self.tables += tag == "table"
        assert tag != "img" or given["alt"]
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def crashed(planner: str) -> list[Row]:
    return [
        msgspec.structs.replace(
            row,
            outcome="planner_error",
            steps=0,
            path_length_m=0.0,
            energy_j=0.0,
            plan_ms_p50=None,
            plan_ms_p99=None,
            detail="ValueError: <b>bad</b> & worse",
        )
        for row in rows([1.0, 1.0, 1.0], [False] * 3, planner)
    ]


WON = [True, True, True]
RUNS = {
    "several planners": rows([4.0, 5.0, 6.0], WON, "beacon")
    + rows([5.0, 5.0, 5.0], [True, False, True], "dstar-lite"),
    "zero successes": rows([4.0, 5.0, 6.0], [False] * 3, "beacon")
    + rows([4.0, 5.0, 6.0], [False] * 3, "bug1"),
    "one scene": rows([4.0], [True], "beacon") + rows([5.0], [True], "dstar-lite"),
    "one planner": rows([4.0, 5.0, 6.0], WON, "mine"),
    "always crashes": crashed("beacon") + rows([5.0, 5.0, 6.0], WON, "dstar-lite"),
    "one episode": rows([4.0], [False], "mine"),
    "two families": rows([4.0, 5.0], [True, False], "beacon")
    + rows([4.0, 5.0], [True, True], "beacon", "g"),
}


@pytest.mark.parametrize("name", RUNS)
def test_every_run_renders(name: str, tmp_path: Path) -> None:
    planners = list(dict.fromkeys(row.planner for row in RUNS[name]))
    run = load_results(write_run(tmp_path / "run", planners, RUNS[name]))
    text = render_report(run)
    page = Page(text)
    assert len(page.sources) > 8
    assert all(s.startswith(("data:", "#")) for s in page.sources)
    assert not re.search(r"https?://(?!www\.w3\.org)", text)
    assert page.tables >= 2
    assert "nan" not in page.text
    assert "None" not in page.text.split("How it was run")[-2]
    assert "no logs of" in page.text
    assert render_report(run) == text
    assert page_problem(text, run) is None
    said = {
        "zero successes": "No episode of this run reached its goal",
        "one scene": "One scene only",
        "one planner": "nothing to pair",
        "always crashes": "planner error: ValueError: <b>bad</b> & worse",
        "one episode": "No episode of this run reached its goal",
    }
    assert said.get(name, "Paired differences") in page.text


def test_the_chart_of_all_planners_comes_before_the_tables(tmp_path: Path) -> None:
    run = write_run(tmp_path / "r", ["beacon", "dstar-lite"], RUNS["several planners"])
    body = render_report(load_results(run)).partition("<main>")[2]
    assert 0 < body.index('<figure class="overview">') < body.index("<table>")


def test_forces_are_drawn_only_where_there_were_contacts(tmp_path: Path) -> None:
    for force, shown in ((0.0, False), (12.0, True)):
        found = [
            msgspec.structs.replace(row, filtered_peak_force_n=force)
            for row in RUNS["one planner"]
        ]
        run = load_results(write_run(tmp_path / str(shown), ["mine"], found))
        text = render_report(run)
        assert ("Peak forces by planner" in text) is shown
        assert ("No episode of this run had a contact." in text) is not shown


def test_every_table_scrolls_by_itself_and_says_so_on_a_phone(tmp_path: Path) -> None:
    run = write_run(tmp_path / "r", ["beacon", "dstar-lite"], RUNS["several planners"])
    text = render_report(load_results(run))
    framed = re.findall(
        r'<figure class="table[^"]*">\n<figcaption>[^<]+</figcaption>\n'
        r'<div class="scroll" tabindex="0"[^>]*>\n<table>',
        text,
    )
    assert len(framed) == Page(text).tables >= 4
    phone = text.partition("@media (max-width: 40rem)")[2].partition("@media")[0]
    assert '.table > figcaption::after { content: " (scroll sideways' in phone
    assert ".scroll { overflow-x: auto;" in text


def test_an_unfinished_run_says_so(tmp_path: Path) -> None:
    found = rows([4.0, 5.0], [True, True], "beacon") + rows([5.0], [True], "bug1")
    path = write_run(tmp_path / "run", ["beacon", "bug1"], found)
    (path / "episodes.parquet").unlink()
    page = Page(render_report(load_results(path)))
    assert "This run is not finished" in page.text
    assert "Up to 1 scenes that only one of two planners has run" in page.text


def test_yardsticks_stand_apart(tmp_path: Path) -> None:
    names = ["beacon", "clairvoyant", "stranger"]
    found = [row for name in names for row in rows([4.0, 5.0], [True, True], name)]
    text = Page(
        render_report(load_results(write_run(tmp_path / "r", names, found)))
    ).text
    places = [
        text.index(word) for word in ("Planners of", "Further", "Reference planners")
    ]
    assert places == sorted(places)


def test_figures_are_repeatable() -> None:
    found = RUNS["several planners"]
    assert figures.peak_forces(found) == figures.peak_forces(found)
    summary = summarize(found)
    svg = figures.pareto(summary, "energy_j", "energy")
    assert svg == figures.pareto(summary, "energy_j", "energy")
    assert "<dc:date>" not in svg


def test_calibration_error_on_paper() -> None:
    found = [Forecast(0.9, True)] * 3 + [Forecast(0.9, False)] + [Forecast(0.5, True)]
    curve = reliability(found)
    assert [(b.n, b.correct) for b in curve.bins] == [(1, 1.0), (4, 0.75)]
    assert curve.error == pytest.approx(0.8 * 0.15 + 0.2 * 0.5)
    assert reliability([Forecast(1.0, True)]).error == 0.0
    assert reliability([]).error is None


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a run with logs: beacon pushes its way through one scene."""
    path = tmp_path_factory.mktemp("real") / "run"
    arguments = "eval --planner beacon --planner bug1 --family collision-required"
    small = ["-n", "1", "--workers", "1", "--out", str(path)]
    short = ["--set", "protocol.max_steps=300"]
    assert cli.run([*arguments.split(), *small, *short]) == 0
    return path


def test_beliefs_from_logs(real: Path) -> None:
    found = read_beliefs(sorted((real / "logs/beacon").glob("*.mcap")))
    assert (found.logs, found.unreadable) == (1, 0)
    n = {what: len(found.forecasts[what]) for what in found.forecasts}
    [row] = load_results(real).planners["beacon"]
    assert row.pushes > 0
    assert n[FIRST] >= n[PUSHED_FIRST] == n[PUSHED_LAST] > 0
    (real / "bad.mcap").write_bytes(b"no log")
    assert read_beliefs([real / "bad.mcap"])[:2] == (0, 1)


def test_a_page_with_episodes(real: Path, tmp_path: Path) -> None:
    out = tmp_path / "page.html"
    assert cli.run(["report", str(real), "--out", str(out), "--no-replay"]) == 0
    page = Page(out.read_text())
    shown = "median path and most obstacles moved: beacon in collision-required_0000"
    assert page.text.count(f"{shown}, reached") == 1
    assert page.text.count("a failure: bug1 in collision-required_0000") == 1
    assert page.text.count("a failure: ") == 1
    assert "Expected calibration error" in page.text
    assert "protocol.max_steps=300" in page.text
    assert not [*tmp_path.glob("*.part")]


def test_a_reader_chooses_the_planner_without_a_script(real: Path) -> None:
    text = render_report(load_results(real), with_replay=False)
    assert "script" not in text.partition("<body>")[0]
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    assert f'content="{policy}"' in html.unescape(text)
    chosen = re.findall(r'<input type="radio" name="planner" id="(choose-\d+)"', text)
    assert chosen == ["choose-1"]  # The failure of bug1 is shown above.
    for name in chosen:
        block = name.replace("choose", "choice")
        assert f'<label for="{name}">beacon</label>' in text
        assert f"#{name}:checked ~ #{block} {{ display: block; }}" in text
        assert f'id="{block}"' in text


def with_logs(run: Path, found: Sequence[Row]) -> Path:
    for row in found:
        log = episodes.log_of(run, row)
        log.parent.mkdir(parents=True, exist_ok=True)
        log.touch()
    return run


def test_there_is_no_median_and_no_calibration_of_partial_logs(tmp_path: Path) -> None:
    found = [
        msgspec.structs.replace(row, brier_prior=0.5)
        for row in rows([4.0, 5.0, 6.0], WON, "beacon")
    ]
    run = load_results(write_run(tmp_path / "run", ["beacon"], found))
    with_logs(run.folder, found[:2])
    assert episodes.picks(run.folder, found, by_family=True) == []
    [none] = calibrations(run)
    assert none.figure is None
    assert none.note.startswith("2 of 3 episodes left a log")
    with_logs(run.folder, found)
    [pick] = episodes.picks(run.folder, found, by_family=True)
    assert (pick.why, pick.row.path_length_m) == ("median path", 5.0)


def test_no_episode_is_shown_twice(tmp_path: Path) -> None:
    found = rows([4.0, 5.0, 6.0], WON, "beacon")
    found[1] = msgspec.structs.replace(found[1], obstacles_moved=2)
    [pick] = episodes.picks(with_logs(tmp_path, found), found, by_family=True)
    assert pick.why == "median path and most obstacles moved"


def test_failures_of_every_planner_come_first(tmp_path: Path) -> None:
    planners = {
        "mine": rows([4.0, 5.0], [True, False], "mine"),
        "good": rows([4.0, 5.0], [True, True], "good"),
        **{f"bad{k}": rows([4.0, 5.0], [False] * 2, f"bad{k}") for k in range(9)},
    }
    for found in planners.values():
        with_logs(tmp_path, found)
    failed = episodes.failures(tmp_path, planners)
    bad = [f"bad{k}" for k in range(9)]
    assert [pick.row.planner for pick in failed] == ["mine", *bad]
    assert [name for name, _, _ in episodes.reasons(planners)] == ["mine", *bad]


def test_axes_show_differences_and_nothing_below_zero() -> None:
    close = rows([4.0] * 40, [True] * 39 + [False], "beacon") + rows(
        [4.0] * 40, [True] * 38 + [False] * 2, "bug1"
    )
    _, axes = figures.panel("x", "y")
    axes.plot([0.0, 0.0], [1.0, 2.0])
    figures.not_below_zero(axes)
    assert axes.get_xlim() == (-0.04, 1.0)
    svg = figures.pareto(summarize(close), "obstacles_broken", "broken")
    ticks = [float(text) for text in re.findall(r"<!-- ([\d.]+) -->", svg)]
    assert max(ticks) >= 90.0  # Success is near 100 %, and the axis too.
    assert not [tick for tick in ticks if 2.0 < tick < 70.0]
    assert figures.overview(summarize(close), wide=True).count("<svg") == 1


def test_the_command_repeats_the_run(real: Path) -> None:
    assert command_of(load_results(real).config) == (
        "beacon-mj eval --planner beacon --planner bug1 --set protocol.max_steps=300 "
        "--family collision-required --scenes-per-family 1 --seed 0 --perception noisy"
    )


def test_the_papers_tables_are_filled_in(tmp_path: Path) -> None:
    run = write_run(
        tmp_path / "run", ["beacon", "dstar-lite"], RUNS["several planners"]
    )
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    assert cli.run(["report", str(run), "--tables", str(page)]) == 0
    text = page.read_text()
    assert text.startswith(f"before\n{BEGIN}\n")
    assert text.endswith(f"{END}\nafter\n")
    assert "old" not in text
    assert "| beacon | 100.00 [43.85, 100.00] | 96.75 |" in text
    assert markdown(load_results(run)) in text
    assert cli.run(["report", str(run), "--tables", str(page)]) == 0
    assert page.read_text() == text


def test_bad_input_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = write_run(tmp_path / "run", ["mine"], RUNS["one planner"])
    page = tmp_path / "page.md"
    page.write_text("no block\n")
    for arguments, words in (
        (["nowhere"], "expected a run folder"),
        ([str(run), "--baseline", "nobody"], "Unknown planner 'nobody'"),
        ([str(run), "--tables", str(page)], "expected a block"),
        ([str(run), "--tables", "nowhere.md"], "cannot be read"),
    ):
        assert cli.run(["report", *arguments]) == 2
        err = capsys.readouterr().err
        assert words in err.splitlines()[-1]
        assert "Traceback" not in err


def test_reading_the_command_line_needs_no_matplotlib() -> None:
    code = "import sys, beacon_mj.cli.report; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no browser")
def test_in_a_browser(real: Path, tmp_path: Path) -> None:
    """No error on the console, and every image has a size."""
    text = render_report(load_results(real), with_replay=False)
    # Before the page's policy, which lets nothing else run.
    probe = (
        "<script>addEventListener('load', () => { document.title = "
        "[...document.images].filter(i => !i.naturalWidth).length + ' missing of ' "
        "+ document.images.length + ', overflow ' "
        "+ (document.documentElement.scrollWidth > innerWidth); });</script>"
    )
    (tmp_path / "page.html").write_text(text.replace("<head>", f"<head>{probe}", 1))
    flags = (
        "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
        "--disable-background-networking --disable-component-update --disable-sync "
        "--window-size=500,900 --enable-logging=stderr --dump-dom"
    )
    done = subprocess.run(
        [
            str(CHROMIUM),
            *flags.split(),
            f"--user-data-dir={tmp_path / 'profile'}",
            (tmp_path / "page.html").as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    found = re.search(r"<title>(.*?)</title>", done.stdout)
    assert found is not None
    assert re.fullmatch(r"0 missing of [1-9]\d*, overflow false", found[1]), found[1]
    assert "CONSOLE" not in done.stderr
