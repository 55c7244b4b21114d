"""Scenes of strangers: refused, or they run, are logged and verified."""

import functools
import json
import math
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import msgspec
import pytest

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.errors import SceneError
from beacon_mj.fidelity.benches import bench, block, obstacle
from beacon_mj.planners.push_through import PushThrough
from beacon_mj.recording import Recorder, verify
from beacon_mj.scene import Obstacle, Scene, shapes
from beacon_mj.scene.checks import check_scene
from beacon_mj.scene.files import load_scene, parse_scene
from beacon_mj.scene_gen.generate import generate_scene
from tests.fuzz.harness import Kind, attempt, kept
from tests.fuzz.mutations import WILD, damaged, mutated, nudged, places, text_of
from tests.scene.test_python_scenes import barrel

Change = Callable[[Any, Random], object]


@functools.cache
def bases() -> list[Any]:
    """Return trees of valid scenes, small ones with every shape among them."""
    found: list[Scene] = [
        bench(block("crate")),
        barrel(16),
        bench(obstacle("ball", shapes.Sphere(radius_m=0.2), (3.0, 3.0))),
        bench(obstacle("tin", shapes.Cylinder(radius_m=0.2, height_m=0.3), (3.0, 3.0))),
        bench(obstacle("log", shapes.Capsule(radius_m=0.1, length_m=0.6), (3.0, 3.0))),
        generate_scene("sparse", 0),
        generate_scene("collision-required", 0),
        generate_scene("revisited-rooms", 0),
    ]
    return [json.loads(scene.to_json()) for scene in found]


class Input(NamedTuple):
    """A scene file, and whether it must be refused."""

    data: bytes
    invalid: bool = False


def _missing(tree: Any, rng: Random) -> None:
    del tree[rng.choice([k for k in tree if k not in OPTIONAL])]


def _unknown(tree: Any, rng: Random) -> None:
    rng.choice([p.value for p in places(tree) if isinstance(p.value, dict)])["new"] = 1


def _text_for_number(tree: Any, rng: Random) -> None:
    numbers = [p for p in places(tree) if type(p.value) in (int, float)]
    parent, key = rng.choice(numbers)
    parent[key] = str(parent[key])


def _not_finite(tree: Any, rng: Random) -> None:
    parent, key = rng.choice([p for p in places(tree) if type(p.value) is float])
    parent[key] = rng.choice([math.nan, math.inf, -math.inf])


def _enormous(tree: Any, rng: Random) -> None:
    parent, key = rng.choice([p for p in places(tree) if type(p.value) is float])
    parent[key] = -1e9


def _twice(tree: Any, rng: Random) -> None:
    tree["obstacles"].append(deepcopy(rng.choice(tree["obstacles"])))


def _on_the_goal(tree: Any, rng: Random) -> None:
    first = tree["obstacles"][0]
    first["x_m"], first["y_m"] = tree["goal_m"]


def _outside(tree: Any, rng: Random) -> None:
    rng.choice(tree["obstacles"])["x_m"] = 99.0


def _harmless(tree: Any, rng: Random) -> None:
    """Change what a scene may well have otherwise."""
    for each in tree["obstacles"]:
        key = rng.choice(["x_m", "y_m", "yaw_rad", "density_kgm3", "friction"])
        each[key] = each[key] * rng.uniform(0.98, 1.02)
    tree["robot"]["speed_mps"] = rng.uniform(0.2, 1.0)


#: What a scene may lack.
OPTIONAL = {"sensing", "mission", "day", "days"}
INVALID: tuple[Change, ...] = (
    _missing, _unknown, _text_for_number, _not_finite, _enormous, _twice, _on_the_goal,
    _outside,
)  # fmt: skip


def make(rng: Random) -> Input:
    tree = deepcopy(rng.choice(bases()))
    match rng.randrange(6):
        case 0 | 1:
            rng.choice(INVALID)(tree, rng)
            return Input(text_of(tree), invalid=True)
        case 2:
            return Input(damaged(text_of(tree), rng))
        case 3:
            place = rng.choice(places(tree))
            place.parent[place.key] = rng.choice([*WILD, nudged(place.value, rng)])
            return Input(text_of(tree))
        case 4:
            _harmless(tree, rng)
            return Input(text_of(tree))
        case _:
            return Input(text_of(mutated(tree, rng)))


def check(given: Input, folder: Path) -> bool:
    """Read the scene, drive a little in it, and verify the log."""
    path = folder / "scene.json"
    path.write_bytes(given.data)
    scene = attempt(lambda: load_scene(path))
    assert not (given.invalid and scene is not None)
    if scene is None:
        return True
    goes_all_the_way(scene, folder)
    return False


def goes_all_the_way(scene: Scene, folder: Path) -> None:
    """Check that a scene that was accepted is one in every place that asks."""
    check_scene(scene)
    again = parse_scene(scene.to_json())
    assert again == scene
    assert again.sha256 == scene.sha256
    log, limit = folder / "x.mcap", Protocol(max_steps=3, decision_limit_s=3600.0)
    run_episode(scene, PushThrough(), protocol=limit, listeners=[Recorder(log)])
    found = verify(log)
    assert found.ok, found.problem


SCENES = Kind("scenes", make, check)
test_scenes, test_scenes_long = SCENES.short(), SCENES.long()


def test_kept_scenes(tmp_path: Path) -> None:
    for path in kept("scenes"):
        check(Input(path.read_bytes(), "invalid" in path.name), tmp_path)


def test_made_in_python_read_or_logged_a_scene_passes_the_same_checks() -> None:
    """What a reader refuses is refused too if Python makes it, and the other way."""
    rng, agreed = Random(0), 0
    for _ in range(60):
        tree = deepcopy(rng.choice(bases()))
        rng.choice([*INVALID[4:], _harmless])(tree, rng)
        agreed += _agree(tree)
    assert agreed > 40


def _agree(tree: Any) -> bool:
    """Compare both ways; returns False where Python cannot even hold the tree."""
    scene = attempt(lambda: _as_python_would(tree))
    if scene is None:
        return False
    made, read = _refused(check_scene, scene), _refused(_read, scene)
    assert made == read
    return True


def _refused(way: Callable[[Scene], object], scene: Scene) -> bool:
    try:
        way(scene)
    except SceneError:
        return True
    return False


def _read(scene: Scene) -> None:
    parse_scene(scene.to_json())


def _as_python_would(tree: Any) -> Scene:
    """Return a scene from structs that nothing has checked."""
    base = msgspec.json.decode(text_of(bases()[0]), type=Scene)
    try:
        found = msgspec.convert(tree["obstacles"], tuple[Obstacle, ...])
    except msgspec.ValidationError as error:
        raise SceneError(str(error)) from error
    goal = tuple(tree["goal_m"])
    return msgspec.structs.replace(base, obstacles=found, goal_m=goal)


def test_plain_data_in_place_of_a_record_is_refused() -> None:
    """It would be stored as the record is, and then not be one."""
    scene = bench(block("crate"))
    plain: Any = tuple(msgspec.to_builtins(scene.obstacles))
    with pytest.raises(SceneError, match=r"scene\.obstacles\[0\] was"):
        check_scene(msgspec.structs.replace(scene, obstacles=plain))
