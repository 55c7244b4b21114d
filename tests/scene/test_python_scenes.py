"""Scenes made in Python are checked as those that are read, before anything runs."""

import json
import math
import os
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from beacon_mj.episode.run import run_episode
from beacon_mj.errors import MalformedSceneError, SceneError
from beacon_mj.fidelity.benches import bench, block, obstacle
from beacon_mj.planners.push_through import PushThrough
from beacon_mj.recording import Recorder
from beacon_mj.scene import Scene, shapes
from beacon_mj.scene.checks import MAX_BYTES, MAX_CORNERS, check_scene
from beacon_mj.scene.files import load_scene, parse_scene
from beacon_mj.scene.shapes import Box
from beacon_mj.world import World


def barrel(corners: int, name: str = "barrel", x_m: float = 3.0) -> Scene:
    """Return a scene with an authored body of one part of so many corners."""
    around = np.arange(corners // 2) * (4.0 * math.pi / corners)
    rim = [(0.2 * math.cos(t), 0.2 * math.sin(t)) for t in around.tolist()]
    part = tuple((x, y, z) for z in (-0.3, 0.3) for x, y in rim)
    volume = shapes.hull_volume(np.array(part))
    shape = shapes.Hulls(name="barrel", parts_m=(part,), volume_m3=volume)
    return bench(obstacle(name, shape, (x_m, 3.0)))


def renamed(**changes: object) -> Scene:
    return msgspec.structs.replace(bench(block("crate")), **changes)


CASES: dict[str, tuple[Callable[[], Scene], str]] = {
    "mesh of 300 corners": (lambda: barrel(300), "length <= 256"),
    "family 2rooms": (lambda: renamed(family="2rooms"), r"\$\.family"),
    "family with a space": (lambda: renamed(family="a b"), r"\$\.family"),
    "obstacle world": (lambda: bench(block("world")), "id other than 'world'"),
    "obstacle in capitals": (lambda: bench(block("Crate")), r"obstacles\[0\]\.id"),
    "other version": (lambda: renamed(schema_version=2), "Invalid enum value 2"),
    "not a number": (
        lambda: renamed(start_m=(math.nan, 3.0)),
        r"start_m\[0\] to be finite",
    ),
    "number of NumPy": (lambda: renamed(start_m=(np.float64(1.0), 3.0)), "numpy"),
    "whole number for a float": (
        lambda: renamed(start_m=(1, 3.0)),
        r"to be a float .* but scene\.start_m\[0\] was 1",
    ),
    "wrong type": (lambda: renamed(seed="0"), "Expected `int`, got `str`"),
    "negative seed": (lambda: renamed(seed=-1), ">= 0"),
    "too many obstacles": (
        lambda: renamed(obstacles=(block("a"),) * 2501),
        "length <= 2500",
    ),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("use", ["check", "world", "episode", "log"])
def test_what_no_reader_takes_does_not_run(case: str, use: str, tmp_path: Path) -> None:
    make, message = CASES[case]
    log = tmp_path / "x.mcap"
    uses: dict[str, Callable[[Scene], object]] = {
        "check": check_scene,
        "world": World,
        "episode": lambda scene: run_episode(scene, PushThrough()),
        "log": lambda scene: run_episode(
            scene, PushThrough(), listeners=[Recorder(log)]
        ),
    }
    with pytest.raises(SceneError, match=message) as caught:
        uses[use](make())
    assert "\n" not in str(caught.value)
    assert not [*tmp_path.iterdir()]


def test_a_body_of_256_corners_goes_all_the_way(tmp_path: Path) -> None:
    scene = barrel(256)
    assert World(scene).model.nbody > 1
    assert parse_scene(scene.to_json()) == scene


def test_the_corners_of_a_scene_are_bounded_before_any_hull_is_made() -> None:
    part = barrel(256).obstacles[0].shape
    assert isinstance(part, shapes.Hulls)
    wheel = msgspec.structs.replace(part, parts_m=part.parts_m * 32)
    crowd = tuple(obstacle(f"o{k}", wheel) for k in range(7))
    assert 7 * 32 * 256 > MAX_CORNERS
    with pytest.raises(SceneError, match="at most 50000 corners of meshes"):
        check_scene(bench(*crowd))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.pop("schema_version"), "missing required field `schema_version`"),
        (lambda d: d.update(schema_version=None), "schema_version"),
        (lambda d: d.update(schema_version=2), "Invalid enum value 2"),
    ],
)
def test_a_file_says_which_schema_it_has(
    change: Callable[[dict[str, object]], object], message: str, tmp_path: Path
) -> None:
    data = json.loads(bench(block("crate")).to_json())
    change(data)
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(data))
    with pytest.raises(SceneError, match=message):
        load_scene(path)


def test_a_change_is_checked_again() -> None:
    scene = bench(block("crate"))
    check_scene(scene)
    changed = [
        msgspec.structs.replace(scene, family="2rooms"),
        msgspec.structs.replace(scene, obstacles=(block("world"),)),
    ]
    for other in changed:
        with pytest.raises(SceneError):
            check_scene(other)
    check_scene(scene)


def test_what_mujoco_cannot_compile_is_one_line() -> None:
    tiny = Box(length_m=0.001, width_m=0.001, height_m=0.001)
    crumb = obstacle("crumb", tiny, mass_kg=1e-9)
    scene = bench(crumb)
    check_scene(scene)
    with pytest.raises(SceneError, match=r"MuJoCo cannot compile it: .*mass and ine"):
        World(scene)


def test_a_world_of_another_scene_is_refused() -> None:
    world = World(bench(block("crate")))
    with pytest.raises(SceneError, match="Expected a world of scene"):
        run_episode(bench(block("crate", 0.2)), PushThrough(), world=world)


def test_deep_json_is_refused(tmp_path: Path) -> None:
    for text in (b"[" * 10**6, b'{"x":' + b"[" * 10**6, b'{"robot":' * 10**5):
        with pytest.raises(SceneError, match=r"not (valid JSON|a valid scene)"):
            parse_scene(text)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_only_regular_files_of_bounded_size_are_read(tmp_path: Path) -> None:
    pipe, huge = tmp_path / "pipe.json", tmp_path / "huge.json"
    os.mkfifo(pipe)
    with huge.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    for path, message in (
        (pipe, "expected a regular file"),
        (Path("/dev/zero"), "expected a regular file"),
        (tmp_path, "Is a directory"),
        (huge, f"expected at most {MAX_BYTES} bytes"),
    ):
        with pytest.raises(SceneError, match=message):
            load_scene(path)


def test_a_scene_without_file_is_malformed_and_a_wrong_one_is_not() -> None:
    with pytest.raises(MalformedSceneError):
        check_scene(renamed(family="2rooms"))
    with pytest.raises(SceneError) as caught:
        check_scene(bench(block("world")))
    assert not isinstance(caught.value, MalformedSceneError)
