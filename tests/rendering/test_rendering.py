"""Pictures are made without a screen and show what the log holds."""

import dataclasses
import subprocess
import sys
from itertools import product
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
import shapely
from PIL import Image, ImageFont

from beacon_mj import cli
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.errors import BeaconError, LogError
from beacon_mj.interface import Command, Observation, PlannerInfo
from beacon_mj.recording import read_log, read_trace
from beacon_mj.rendering import (
    annotations,
    filmstrip,
    gl,
    overlay,
    panel,
    playback,
    plot_panel,
    render_scene,
    render_strip,
    render_video,
    view_scene,
)
from beacon_mj.rendering.camera import camera_over
from beacon_mj.rendering.captions import describe, summary
from beacon_mj.rendering.legend import entries
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import World
from tests.recording.samples import PushThrough, record, scene_with_damage
from tests.repository import REPOSITORY

av = pytest.importorskip("av")


def _can_draw() -> bool:
    try:
        gl.backend()
    except gl.RenderError:
        return False
    return True


needs_gl = pytest.mark.skipif(not _can_draw(), reason="no headless OpenGL here")


@needs_gl
def test_one_command_replays_a_log_as_video_strip_and_page(
    log_path: Path, tmp_path: Path
) -> None:
    pytest.importorskip("mjviser")
    wanted = {kind: tmp_path / f"out.{kind}" for kind in ("mp4", "png", "html")}
    options = zip(
        ("--video", "--png", "--html"), map(str, wanted.values()), strict=True
    )
    assert cli.run(["replay", str(log_path), *(w for o in options for w in o)]) == 0
    assert {p.name for p in tmp_path.iterdir()} == {p.name for p in wanted.values()}
    with av.open(str(wanted["mp4"])) as video:
        assert next(video.decode(video=0)).width > 100
    with Image.open(wanted["png"]) as strip:
        assert strip.width > 100
    assert "<html" in wanted["html"].read_text().lower()


class Pathless(PushThrough):
    """Plans no path, which has the colour of the bumper."""

    def act(self, observation: Observation) -> Command:
        return dataclasses.replace(super().act(observation), info=PlannerInfo())


@pytest.fixture(scope="module")
def log_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that ends soon after something broke."""
    scene = scene_with_damage()
    steps = run_episode(scene, PushThrough()).steps
    first = next(k for k, s in enumerate(steps) if s.outcome.damages)
    path = tmp_path_factory.mktemp("logs") / "x.mcap"
    record(path, scene, PushThrough(), Protocol(max_steps=first + 5))
    return path


def _blue_centre(picture: np.ndarray) -> np.ndarray:
    """Return the mean pixel (row, column) of the bumper's colour."""
    pixels = picture.astype(float) / 255.0
    blue = (pixels[..., 2] > 0.45) & (pixels[..., 0] < 0.25)
    assert blue.sum() > 20
    return np.asarray(np.argwhere(blue).mean(axis=0))


@pytest.mark.parametrize("aspect", [0.8, 15 / 13, 2.0, 3.0])
@pytest.mark.parametrize(
    "size_m", [(6.0, 6.0), (11.8, 5.4), (9.1, 7.0), (3.0, 3.0), (5.0, 12.0), (50, 50)]
)
def test_the_whole_room_is_in_the_picture(
    size_m: tuple[float, float], aspect: float
) -> None:
    """By the view that MuJoCo makes of the camera; nor is the room small in it."""
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    data, view = mujoco.MjData(model), mujoco.MjvScene(model, 1)
    found = camera_over((0.0, 0.0, *size_m), aspect)
    every = mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, found, every, view)
    eye = view.camera[0]
    # Of two eyes; a picture is taken from between them.
    place = 0.5 * (view.camera[0].pos + view.camera[1].pos)
    forward, up = np.array(eye.forward), np.array(eye.up)
    shares = []
    for x, y, z in product((-0.1, size_m[0] + 0.1), (-0.1, size_m[1] + 0.1), (0, 0.2)):
        ray = np.array([x, y, z]) - place
        depth = ray @ forward / eye.frustum_near
        right = ray @ np.cross(forward, up) / depth
        top = eye.frustum_top
        shares += [abs(right) / (aspect * top), abs(ray @ up) / depth / top]
    assert 0.85 < max(shares) < 0.975


@needs_gl
def test_robot_moves_across_the_picture(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    live = record(path, planner=Pathless(), protocol=Protocol(max_steps=30))
    with playback.Playback(read_log(path), 320, 240) as frames:
        first, last = frames.picture(0), frames.picture(frames.steps)
    assert first.shape == (240, 320, 3)
    assert first.std() > 10.0
    metres = live.steps[-1].outcome.position_m[0] - live.start_m[0]
    assert metres > 1.0
    # The blue start disc stays, so the mean moves less than the robot.
    assert _blue_centre(last)[1] - _blue_centre(first)[1] > 5.0 * metres


@needs_gl
def test_broken_obstacle_changes_colour(log_path: Path) -> None:
    trace = read_trace(log_path)
    broken = {d.obstacle for s in trace.steps for d in s.outcome.damages}
    numbers = [i for i, o in enumerate(trace.scene.obstacles) if o.id in broken]
    with playback.Playback(read_log(log_path), 64, 48) as frames:
        before, after = (frames.obstacle_colours(k) for k in (0, frames.steps))
    assert numbers
    assert np.abs(before[numbers] - after[numbers]).max(axis=1).min() > 0.2


def video_frames(path: Path) -> list[np.ndarray]:
    """Return the pictures of a video at 20 Hz."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.average_rate == 20
        return [f.to_ndarray(format="rgb24") for f in container.decode(stream)]


@needs_gl
def test_video_has_a_frame_per_step_and_they_differ(
    log_path: Path, tmp_path: Path
) -> None:
    out = render_video(log_path, tmp_path / "x.mp4", width=480, height=640)
    frames = video_frames(out)
    assert frames[0].shape == (640, 480, 3)
    steps = len(read_trace(log_path).steps)
    assert len(frames) == steps + 1 + 30
    changes = [
        np.abs(a[:240].astype(int) - b[:240]).mean()
        for a, b in zip(frames, frames[10:steps], strict=False)
    ]
    assert min(changes) > 0.05
    assert sorted(p.name for p in tmp_path.iterdir()) == ["x.mp4"]


@needs_gl
def test_video_has_the_legend_of_the_strip_and_loses_no_text(
    log_path: Path, tmp_path: Path
) -> None:
    """A line of text that is wider than the video goes on in the next."""
    log, trace = read_log(log_path), read_trace(log_path)
    out = render_video(log, tmp_path / "x.mp4", width=320, height=560)
    foot = np.asarray(overlay.legend(entries(log.scene), 320))
    told = [describe(trace, step) for step in range(log.steps + 1)]
    wraps = [[p for line in t for p in overlay.wrapped(line, 304)] for t in told]
    rows = max(map(len, wraps))
    assert rows > max(map(len, told))
    frames = video_frames(out)
    for step in (0, log.steps):
        text = np.asarray(overlay.text_band(wraps[step], 320, rows))
        below = np.vstack([text, foot])
        assert _difference(frames[step][-len(below) :], below) < 4.0
        # It is about this step: the other one's text would not do.
        other = np.asarray(overlay.text_band(wraps[log.steps - step], 320, rows))
        assert _difference(frames[step][-len(below) : -len(foot)], other) > 4.0


def _difference(a: np.ndarray, b: np.ndarray) -> float:
    """Return how much two pictures differ on average, of 255."""
    return float(np.abs(a.astype(int) - b).mean())


@needs_gl
def test_video_without_room_for_the_scene_is_refused(
    log_path: Path, tmp_path: Path
) -> None:
    with pytest.raises(gl.RenderError, match=r"a height of \d+ pixels or more"):
        render_video(log_path, tmp_path / "x.mp4", width=320, height=120)
    assert not list(tmp_path.iterdir())


@needs_gl
def test_strip_shows_start_pushes_and_end(log_path: Path, tmp_path: Path) -> None:
    out = render_strip(log_path, tmp_path / "x.png", width=200, height=160)
    with Image.open(out) as image:
        pixels = np.asarray(image)
    head = overlay.captions([summary(read_trace(log_path))], 3 * 208)[0].height
    assert pixels.shape[1] == 3 * 208
    cells = [pixels[head : head + 160, k * 208 : k * 208 + 200] for k in range(3)]
    assert min(c.std() for c in cells) > 10.0
    assert not np.array_equal(cells[0], cells[2])
    # The colours of the three classes stand in the legend below.
    scene = read_log(log_path).scene
    foot = overlay.legend(entries(scene), pixels.shape[1])
    below = pixels[-foot.height :].reshape(-1, 3)
    for surface in scene.surfaces:
        colour = np.round(255 * np.array(surface.rgba[:3])).astype(int)
        assert (np.abs(below - colour).max(axis=1) <= 1).sum() > 100


@needs_gl
def test_what_a_lidar_hits_is_dotted(tmp_path: Path) -> None:
    found = []
    for beams in (0, 90):
        path = tmp_path / f"{beams}.mcap"
        record(path, protocol=Protocol(lidar_beams=beams, max_steps=2))
        with playback.Playback(read_log(path), 480, 360) as frames:
            pixels = frames.picture(0).astype(int).reshape(-1, 3)
        red, green, blue = pixels.T
        found.append(((red > 150) & (green < 0.75 * red) & (blue < 0.25 * red)).sum())
    assert found[0] + 60 < found[1]


@needs_gl
def test_what_is_broken_is_marked_by_more_than_colour(
    log_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def pictures() -> list[np.ndarray]:
        with playback.Playback(read_log(log_path), 480, 360) as frames:
            return [frames.picture(k) for k in (0, frames.steps)]

    crossed = pictures()
    monkeypatch.setattr(annotations.Marks, "_mark_broken", lambda *_: None)
    plain = pictures()
    assert np.array_equal(crossed[0], plain[0])
    changed = (crossed[1] != plain[1]).any(axis=2)
    assert changed.sum() > 20
    assert crossed[1][changed].mean() > plain[1][changed].mean() + 60.0


@needs_gl
def test_pictures_have_a_scale_bar(
    log_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """North of the room, as dark as its label, and as long as it says."""

    def picture() -> np.ndarray:
        with playback.Playback(read_log(log_path), 480, 416) as frames:
            return frames.picture(0)

    with_bar = picture()
    monkeypatch.setattr(annotations.Marks, "_draw_scale", lambda *_: None)
    bar = (with_bar != picture()).any(axis=2)
    rows, columns = np.nonzero(bar)
    assert bar.sum() > 50
    assert rows.max() < 0.2 * 416
    assert with_bar[bar].min(axis=0).max() < 60
    assert columns.min() > 0


@pytest.mark.parametrize("width", [40, 120, 600])
def test_captions_are_wrapped_and_lose_no_word(width: int) -> None:
    text = "t = 4.7 s; push: obstacle_16 not moved at 11.7 N; " + "x" * 70
    lines = overlay.wrapped(text, width)
    assert len(lines) > 1
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")
    font = ImageFont.load_default(overlay.TEXT_PIXELS)
    assert max(font.getlength(line) for line in lines) <= width
    images = overlay.captions([text, "short"], width + 16)
    assert len({image.size for image in images}) == 1


def test_moments_hold_ends_and_what_happened(log_path: Path) -> None:
    trace = read_trace(log_path)
    told = [k + 1 for k, s in enumerate(trace.steps) if s.outcome.attempts]
    chosen = filmstrip.moments(trace, 6)
    assert chosen == sorted(set(chosen))
    assert (chosen[0], chosen[-1], len(chosen)) == (0, len(trace.steps), 6)
    assert set(told) & set(chosen)
    trace.steps[:] = trace.steps[:2]
    assert filmstrip.moments(trace, 6) == [0, 1, 2]


def test_moments_are_those_of_change(log_path: Path) -> None:
    """Another action, another target, and beliefs that shift are all shown."""
    trace = read_trace(log_path)
    info = dataclasses.replace(
        trace.steps[0].command.info, action="move", target=None,
        beliefs={"a": (0.8, 0.1, 0.1), "b": (0.1, 0.8, 0.1)},
    )  # fmt: skip
    quiet = dataclasses.replace(trace.steps[0].outcome, contacts=(), attempts=())
    changes: dict[int, dict[str, Any]] = {
        12: {"action": "push", "target": "a"},
        31: {"action": "push", "target": "b"},
        44: {"beliefs": {"a": (0.1, 0.8, 0.1), "b": (0.1, 0.1, 0.8)}},
    }
    steps = []
    for k in range(60):
        info = dataclasses.replace(info, **changes.get(k, {}))
        command = dataclasses.replace(trace.steps[0].command, info=info)
        steps.append(
            dataclasses.replace(trace.steps[0], command=command, outcome=quiet)
        )
    trace.steps[:] = steps
    assert filmstrip.moments(trace, 5) == [0, 12, 31, 44, 60]


@needs_gl
def test_text_names_decision_costs_and_end(log_path: Path) -> None:
    with playback.Playback(read_log(log_path), 64, 48) as frames:
        lines = "\n".join(describe(frames.trace, frames.steps))
        pushed = next(
            k + 1
            for k, s in enumerate(frames.trace.steps)
            if s.command.info.cost_push is not None
        )
        costs = "\n".join(describe(frames.trace, pushed))
    assert "straight through" in lines
    assert "END: timeout" in lines
    assert "cost_push = 1.5" in costs
    assert "cost_detour = inf" in costs


@needs_gl
def test_scene_picture(tmp_path: Path, log_path: Path) -> None:
    scene = read_log(log_path).scene
    out = render_scene(scene, tmp_path / "s.png", width=320, height=240)
    with Image.open(out) as image:
        assert image.size == (320, 240)
        assert np.asarray(image).std() > 10.0
    with pytest.raises(BeaconError, match=r"s.png.s.png: cannot write"):
        render_scene(scene, tmp_path / "s.png" / "s.png", width=64, height=48)


def parts(log_path: Path, out: Path) -> tuple[ElementTree.Element, list[str], str]:
    """Return the drawing within a panel, the marks of its legend, and its text."""
    text = plot_panel(log_path, out).read_text()
    root = ElementTree.fromstring(text)
    drawing, *marks = [e for e in root if e.tag.endswith("}g")]
    assert drawing.get("transform") == "scale(1,-1)"
    return drawing, [ElementTree.tostring(m, "unicode") for m in marks], text


def test_panel_shows_way_footprints_and_events(log_path: Path, tmp_path: Path) -> None:
    trace = read_trace(log_path)
    drawing, _, _ = parts(log_path, tmp_path / "panel.svg")
    polygons = [e for e in drawing.iter() if e.tag.endswith("polygon")]
    before = [e for e in polygons if e.get("stroke-dasharray")]
    moved = {d.obstacle for s in trace.steps for d in s.outcome.displacements}
    assert moved
    assert len(before) == len(moved)
    assert len(polygons) == len(before) + len(trace.scene.obstacles)
    ways = [e.get("points", "") for e in drawing.iter() if e.tag.endswith("polyline")]
    assert [len(way.split()) for way in ways] == [len(trace.steps) + 1] * 2
    x, y = trace.steps[-1].outcome.position_m
    assert ways[0].endswith(f"{x:.4f},{y:.4f}")


def test_panel_names_obstacles_and_shows_what_broke_and_the_last_pose(
    log_path: Path, tmp_path: Path
) -> None:
    trace = read_trace(log_path)
    drawing, _, text = parts(log_path, tmp_path / "panel.svg")
    broken = {d.obstacle for s in trace.steps for d in s.outcome.damages}
    crosses = [e for e in drawing if e.get("class") == "broken"]
    assert broken
    assert len(crosses) == 2 * len(broken)  # White within dark.
    names = [e.text for e in drawing if e.tag.endswith("text")]
    assert names == [o.id.removeprefix("obstacle_") for o in trace.scene.obstacles]
    x, y = trace.steps[-1].outcome.position_m
    ends = [
        e for e in drawing
        if (e.get("cx"), e.get("cy")) == (f"{x:.4f}", f"{y:.4f}") and e.get("stroke")
    ]  # fmt: skip
    assert [float(e.get("r", "")) for e in ends if e.get("fill") != "none"] == [
        trace.scene.robot.radius_m
    ]
    assert ">1 m</text>" in text


def test_the_legend_of_a_panel_repeats_the_marks_of_the_drawing(
    log_path: Path, tmp_path: Path
) -> None:
    drawing, marks, text = parts(log_path, tmp_path / "panel.svg")
    styles = ("fill", "stroke", "stroke-dasharray", "stroke-width", "opacity")

    def style(element: ElementTree.Element) -> tuple[str, ...]:
        return (element.tag, *(element.get(name, "") for name in styles))

    shown = {style(e) for e in drawing if not e.tag.endswith(("polygon", "text"))}
    explained = {style(e) for mark in marks for e in ElementTree.fromstring(mark)}
    # Arena, what it cuts off, and the way and its band, which are samples there.
    assert {tag.rpartition("}")[2] for tag, *_ in shown - explained} <= {
        "rect", "clipPath", "polyline",
    }  # fmt: skip
    for word in ("safe", "fragile", "broken", "contact", "push: not moved", "goal"):
        assert f">{word}</text>" in text


def test_panel_is_no_png(log_path: Path, tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"panel.png: expected a name .* \.svg"):
        plot_panel(log_path, tmp_path / "panel.png")
    assert not list(tmp_path.iterdir())


def test_panel_outlines_are_the_worlds_own(log_path: Path) -> None:
    log = read_log(log_path)
    world = World(log.scene)
    model = world.model
    for obstacle, outline in zip(log.scene.obstacles, world.outlines, strict=True):
        drawn = shapely.Polygon(panel.outline(log, model, obstacle, 0))
        true = outline.polygon()
        assert drawn.symmetric_difference(true).area < 0.02 * true.area


def test_unreadable_log_leaves_no_output(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"gone.mcap: cannot read"):
        render_video(tmp_path / "gone.mcap", tmp_path / "x.mp4")
    assert not list(tmp_path.iterdir())


def test_viewer_without_display_says_what_to_do(
    log_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(BeaconError, match=r"--png out.png"):
        view_scene(read_log(log_path).scene)


def test_missing_backend_names_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(gl, "_works", lambda name: False)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    gl.backend.cache_clear()
    with pytest.raises(gl.RenderError, match=r"apt-get install libosmesa6"):
        gl.backend()
    monkeypatch.setenv("MUJOCO_GL", "egl")
    with pytest.raises(gl.RenderError, match=r"MUJOCO_GL=egl asks for it"):
        gl.backend()
    gl.backend.cache_clear()


def test_import_is_light() -> None:
    code = (
        "import sys, beacon_mj, beacon_mj.rendering; "
        "assert not {'av', 'PIL', 'mcap', 'OpenGL'} & sys.modules.keys()"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=REPOSITORY)


def test_kinds_are_written_into_the_drawing_and_the_log(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    scene = generate_scene("lookalike-doors", 0, 2000)
    record(path, scene, PushThrough(), Protocol(max_steps=3))
    text = plot_panel(path, tmp_path / "panel.svg").read_text()
    for kind in ("crate", "bin", "cabinet"):
        assert text.count(f">{kind}</text>") == 4
    assert ">wall</text>" not in text
    log = read_log(path)
    kinds = {o.obstacle: o.kind for _, m in log.messages["/sensed"] for o in m.updated}
    assert kinds == {o.id: o.perceived.kind for o in scene.obstacles}
    ((_, picture), *_) = log.messages["/scene"]
    facts = [dict((f.key, f.value) for f in e.metadata) for e in picture.entities]
    assert sum(f.get("kind") == "crate" for f in facts) == 4
    plain = tmp_path / "plain.mcap"
    record(plain, generate_scene("sparse", 0), PushThrough(), Protocol(max_steps=3))
    sensed = [o for _, m in read_log(plain).messages["/sensed"] for o in m.updated]
    assert sensed
    assert not any(o.HasField("kind") for o in sensed)
