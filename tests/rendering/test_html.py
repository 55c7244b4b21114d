"""The HTML replay: one file, no network, and a browser shows it."""

import base64
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import zstandard

from beacon_mj import cli
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.errors import BeaconError, LogError
from beacon_mj.recording import read_log, read_trace
from beacon_mj.rendering import render_page
from tests.recording.samples import PushThrough, record, scene_with_damage

Image = pytest.importorskip("PIL.Image")
html = pytest.importorskip("beacon_mj.rendering.html")

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
#: With BEACON_NEED_CHROMIUM=1 a missing browser is a failure, not a skipped test.
needs_chromium = pytest.mark.skipif(
    CHROMIUM is None and os.environ.get("BEACON_NEED_CHROMIUM") != "1",
    reason="no chromium here: the page is not opened in a browser",
)
WITHOUT_NETWORK = [
    "--proxy-server=127.0.0.1:9",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
]
SOFTWARE_GL = ["--use-gl=angle", "--use-angle=swiftshader"]
SCRUBBER_RGB = (34, 139, 230)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    scene = scene_with_damage()
    steps = run_episode(scene, PushThrough()).steps
    first = next(k for k, s in enumerate(steps) if s.outcome.damages)
    record(folder / "x.mcap", scene, PushThrough(), Protocol(max_steps=first + 5))
    return render_page(folder / "x.mcap", folder / "x.html")


def test_page_is_one_file_without_links(page: Path) -> None:
    text = page.read_text()
    assert 500_000 < len(text) < 3_000_000
    assert set(re.findall(r"https?://[\w.]+", text)) <= {"http://www.w3.org"}
    assert not re.findall(r"<script[^>]+src=|<link[^>]+href=.(?!data:)", text)
    assert re.search(r"<title>[\w-]+_\d{4}, push-through</title>", text)
    assert sorted(p.name for p in page.parent.iterdir()) == ["x.html", "x.mcap"]


def recorded(page: Path) -> dict[str, Any]:
    """Return viser's recording within a page: its length and its timed messages."""
    (data,) = re.findall(r'window.__VISER_EMBED_DATA__="([^"]+)"', page.read_text())
    inner = zstandard.ZstdDecompressor().decompress(
        base64.b64decode(data)[8:], max_output_size=100_000_000
    )
    size = int.from_bytes(inner[:8], "little")
    return dict(msgspec.msgpack.decode(inner[8 : 8 + size]))


def test_page_has_a_legend_and_a_clock_of_simulated_seconds(page: Path) -> None:
    log = read_log(page.with_suffix(".mcap"))
    (legend,) = re.findall(r'<div id="legend".*?</div>', page.read_text())
    for word in ("safe", "movable", "fragile", "broken", "planned path", "force"):
        assert word in legend
    recording = recorded(page)
    simulated_s = log.steps * log.scene.robot.control_period_s
    assert recording["durationSeconds"] == pytest.approx(simulated_s + html.HOLD_S)
    shown = [m for _, m in recording["messages"] if m.get("name", "") == "/text"]
    assert shown


def test_page_has_a_scale_and_a_cross_from_when_something_breaks(page: Path) -> None:
    broken = {
        damage.obstacle: damage.time_s
        for step in read_trace(page.with_suffix(".mcap")).steps
        for damage in step.outcome.damages
    }
    assert broken
    messages = recorded(page)["messages"]
    assert {"/scale/bar", "/scale/text"} <= {m.get("name") for _, m in messages}
    for name, time_s in broken.items():
        own = [(t, m) for t, m in messages if m.get("name") == f"/broken/{name}"]
        (seen_s,) = [t for t, m in own if m.get("visible") is True]
        assert time_s - 1e-9 <= seen_s <= time_s + 0.1 + 1e-9


@needs_chromium
def test_a_browser_without_network_shows_robot_obstacles_and_scrubber(
    page: Path, tmp_path: Path
) -> None:
    assert CHROMIUM is not None, "BEACON_NEED_CHROMIUM=1 but there is no chromium"
    shot = tmp_path / "shot.png"
    subprocess.run(
        [
            CHROMIUM,
            "--headless",
            "--no-sandbox",
            "--no-first-run",
            f"--user-data-dir={tmp_path / 'profile'}",
            *WITHOUT_NETWORK,
            *SOFTWARE_GL,
            "--enable-unsafe-swiftshader",
            "--window-size=900,700",
            "--virtual-time-budget=12000",
            f"--screenshot={shot}",
            page.as_uri(),
        ],
        check=True,
        capture_output=True,
        timeout=180,
    )
    with Image.open(shot) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    bottom, scene = pixels[-60:], pixels[150:-60]
    assert (np.abs(bottom - SCRUBBER_RGB).max(axis=2) < 12).sum() > 100
    blue = (scene[..., 2] > 130) & (scene[..., 0] < 60)
    assert blue.sum() > 30  # The robot's bumper.
    spread = scene.max(axis=2) - scene.min(axis=2)
    assert ((spread > 40) & ~blue).sum() > 2000  # Obstacles, coloured by belief.


def test_command_writes_a_page(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, out = page.with_suffix(".mcap"), page.with_name("y.html")
    assert cli.run(["replay", str(log), "--html", str(out)]) == 0
    captured = capsys.readouterr()
    assert captured.out == ""
    assert str(out) in captured.err
    assert out.is_file()
    out.unlink()


def test_unreadable_log_leaves_no_page(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"gone.mcap: cannot read"):
        render_page(tmp_path / "gone.mcap", tmp_path / "x.html")
    assert not list(tmp_path.iterdir())


def test_missing_package_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "viser", None)
    monkeypatch.delitem(sys.modules, "beacon_mj.rendering.html", raising=False)
    with pytest.raises(BeaconError, match=r"pip install .*'viser"):
        render_page("x.mcap", "x.html")
