"""Scene files: the same after a round trip, and refused for a stated reason."""

import itertools
import json
import math
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest

from beacon_mj.errors import SceneError
from beacon_mj.fidelity.benches import bench, block, obstacle
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import Scene
from beacon_mj.scene.checks import RESERVED_IDS, check_scene
from beacon_mj.scene.files import load_scene, parse_scene, scene_schema
from beacon_mj.scene.shapes import Box
from tests.worlds import cached_scene


def test_round_trip_keeps_every_byte(family: str) -> None:
    scene = cached_scene(family, 0)
    data = scene.to_json()
    again = parse_scene(data)
    assert again == scene
    assert again.to_json() == data
    assert again.sha256 == scene.sha256
    assert len(scene.sha256) == 64


def test_different_scenes_have_different_identities() -> None:
    shas = {cached_scene("sparse", i).sha256 for i in range(4)}
    assert len(shas) == 4


def test_load_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_bytes(cached_scene("sparse", 0).to_json())
    assert load_scene(path) == cached_scene("sparse", 0)
    path.write_text("{")
    with pytest.raises(SceneError, match=r"scene\.json: not valid JSON"):
        load_scene(path)
    with pytest.raises(SceneError, match=r"nothing\.json: cannot read the scene file"):
        load_scene(tmp_path / "nothing.json")


def test_schema_is_json_and_names_every_field() -> None:
    schema = json.loads(json.dumps(scene_schema()))
    properties = schema["$defs"]["Scene"]["properties"]
    assert set(properties) == set(Scene.__struct_fields__)
    assert schema["$defs"]["Scene"]["additionalProperties"] is False


def document() -> dict[str, Any]:
    """A small valid scene as plain data."""
    pillar = obstacle(
        "pillar",
        Box(length_m=0.3, width_m=0.3, height_m=0.3),
        (3.0, 1.0),
        interaction="safe",
        fixed=True,
    )
    vase = obstacle(
        "vase",
        Box(length_m=0.2, width_m=0.2, height_m=0.3),
        (3.0, 5.0),
        interaction="fragile",
        break_force_n=20.0,
    )
    data: dict[str, Any] = json.loads(bench(block("crate"), pillar, vase).to_json())
    return data


Edit = Callable[[dict[str, Any]], None]


def change(path: str, value: Any) -> Edit:
    """Return an edit that sets one value, such as `obstacles.0.x_m`."""

    def edit(data: Any) -> None:
        *parents, last = path.split(".")
        for key in parents:
            data = data[int(key)] if isinstance(data, list) else data[key]
        data[int(last) if isinstance(data, list) else last] = value

    return edit


def remove(path: str) -> Edit:
    def edit(data: Any) -> None:
        *parents, last = path.split(".")
        for key in parents:
            data = data[int(key)] if isinstance(data, list) else data[key]
        del data[last]

    return edit


def hulls(
    depth: float = 0.15, volume: float = 0.006, shift: float = 0.0
) -> dict[str, Any]:
    """A box of 0.2 x 0.1 x 0.3 m as an authored body, or a wrong one."""
    corners = itertools.product((-0.1, 0.1), (-0.05, 0.05), (-depth, depth))
    part = [[x, y, z + shift] for x, y, z in corners]
    return {"type": "hulls", "name": "plank", "parts_m": [part], "volume_m3": volume}


BAD: dict[str, tuple[Edit, str]] = {
    "unknown field": (change("colour", 1), "contains unknown field `colour`"),
    "unknown inner field": (
        change("obstacles.0.mass", 1.0),
        r"unknown field `mass` - at `\$.obstacles\[0\]`",
    ),
    "missing field": (remove("robot"), "missing required field `robot`"),
    "wrong type": (change("obstacles.0.x_m", "3"), "Expected `float`, got `str`"),
    "not finite": (change("obstacles.0.x_m", math.nan), "not valid JSON"),
    "infinite": (change("obstacles.0.x_m", math.inf), "not valid JSON"),
    "huge": (change("obstacles.0.x_m", 1e300), r"<= 100\.0"),
    "zero size": (change("obstacles.0.shape.length_m", 0.0), r">= 0\.001"),
    "zero density": (change("obstacles.0.density_kgm3", 0.0), r">= 1\.0"),
    "negative friction": (change("obstacles.0.friction", -0.1), r">= 0\.01"),
    "zero control period": (change("robot.control_period_s", 0.0), r">= 0\.01"),
    "unknown class": (change("obstacles.0.interaction", "soft"), "Invalid enum"),
    "unknown shape": (change("obstacles.0.shape.type", "torus"), "'torus'"),
    "unknown profile": (change("perception", "psychic"), "Invalid enum"),
    "other version": (change("schema_version", 2), "Invalid enum value 2"),
    "bad id": (change("obstacles.0.id", "Box 1"), "matching regex"),
    "id with a line break": (change("obstacles.0.id", "crate\n"), "matching regex"),
    "reserved id": (change("obstacles.0.id", "bumper"), "other than 'bumper'"),
    "wall as id": (change("obstacles.0.id", "wall"), "other than 'wall'"),
    "part as id": (change("obstacles.0.id", "a_part_1"), "other than 'a_part_1'"),
    "foot as id": (change("obstacles.0.id", "a_foot_1"), "other than 'a_foot_1'"),
    "duplicate id": (
        change("obstacles.0.id", "vase"),
        "ids to be unique but 'vase' repeats",
    ),
    "overlap": (
        lambda data: data["obstacles"][0].update(x_m=2.9, y_m=4.9),
        "not to overlap but '(crate|vase)' and '(crate|vase)' do",
    ),
    "outside": (
        change("obstacles.0.y_m", 5.9),
        "'crate' to lie inside the workspace",
    ),
    "fixed movable": (
        change("obstacles.0.fixed", True),
        "'crate': expected a fixed obstacle to be of class 'safe'",
    ),
    "fragile without break force": (
        change("obstacles.2.break_force_n", None),
        "'vase': expected break_force_n for class 'fragile'",
    ),
    "movable with break force": (
        change("obstacles.0.break_force_n", 5.0),
        "'crate': expected break_force_n for class 'fragile' and for no other",
    ),
    "no scores": (
        change("obstacles.0.perceived.scores", [0.0, 0.0, 0.0]),
        "'crate': expected perceived.scores to have a positive sum",
    ),
    "score above one": (
        change("obstacles.0.perceived.scores", [2.0, 0.0, 0.0]),
        r"<= 1\.0",
    ),
    "capsule that is a ball": (
        change(
            "obstacles.0.shape", {"type": "capsule", "radius_m": 0.1, "length_m": 0.2}
        ),
        "capsule's length_m to exceed twice",
    ),
    "clockwise prism": (
        change(
            "obstacles.0.shape",
            {
                "type": "prism",
                "kind": "triangle",
                "vertices_m": [[0.0, 0.0], [0.0, 0.2], [0.2, 0.0]],
                "height_m": 0.3,
            },
        ),
        "strictly convex and counter-clockwise",
    ),
    "star prism": (
        change(
            "obstacles.0.shape",
            {
                "type": "prism",
                "kind": "pentagon",
                "vertices_m": [
                    [
                        0.2 * math.cos(0.8 * math.pi * k),
                        0.2 * math.sin(0.8 * math.pi * k),
                    ]
                    for k in range(5)
                ],
                "height_m": 0.3,
            },
        ),
        "strictly convex and counter-clockwise",
    ),
    "prism beside its origin": (
        change(
            "obstacles.0.shape",
            {
                "type": "prism",
                "kind": "triangle",
                "vertices_m": [[0.0, 0.0], [0.2, 0.0], [0.0, 0.2]],
                "height_m": 0.3,
            },
        ),
        "'crate': expected its footprint's centroid at the origin",
    ),
    "flat part": (
        change("obstacles.0.shape", hulls(depth=0.0)),
        "'crate': expected every part of parts_m to be a solid",
    ),
    "false volume": (
        change("obstacles.0.shape", hulls(volume=1.0)),
        "'crate': expected volume_m3 to be that of its parts, 0.006000000",
    ),
    "sunk part": (
        change("obstacles.0.shape", hulls(shift=-0.1)),
        "'crate': expected parts_m to reach as far below",
    ),
    "prism of two vertices": (
        change(
            "obstacles.0.shape",
            {
                "type": "prism",
                "kind": "triangle",
                "vertices_m": [[0.0, 0.0], [0.0, 0.2]],
                "height_m": 0.3,
            },
        ),
        "length >= 3",
    ),
    "start in an obstacle": (
        change("start_m", [3.0, 1.0]),
        "start_m to be free but the robot would overlap 'pillar'",
    ),
    "goal outside": (change("goal_m", [5.95, 3.0]), "goal_m to leave the robot inside"),
    "workspace inside out": (
        change("workspace_m", [6.0, 0.0, 0.0, 6.0]),
        "west < east",
    ),
    "unknown door": (
        change("certificate.door_ids", ["door"]),
        r"door_ids to name obstacles but \['door'\] do not exist",
    ),
    "too many obstacles": (
        lambda data: data.update(obstacles=data["obstacles"][:1] * 2501),
        "length <= 2500",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_scenes_are_refused_in_one_line(case: str) -> None:
    edit, message = BAD[case]
    data = document()
    edit(data)
    with pytest.raises(SceneError, match=message) as caught:
        parse_scene(json.dumps(data).encode(), "file.json")
    assert str(caught.value).startswith("file.json: ")
    assert "\n" not in str(caught.value)


def test_an_authored_body_is_valid() -> None:
    data = document()
    data["obstacles"][0]["shape"] = hulls()
    assert len(parse_scene(json.dumps(data).encode()).obstacles) == 3


def test_the_document_itself_is_valid() -> None:
    scene = parse_scene(json.dumps(document()).encode())
    assert [o.id for o in scene.obstacles] == ["crate", "pillar", "vase"]


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_numbers_made_in_python_must_be_finite(value: float) -> None:
    crate = msgspec.structs.replace(block("crate"), yaw_rad=value)
    with pytest.raises(SceneError, match=r"obstacles\[0\]\.yaw_rad to be finite"):
        check_scene(bench(crate))


def test_touching_is_allowed() -> None:
    check_scene(bench(block("a", 0.1), block("b", 0.5)))
    with pytest.raises(SceneError, match="not to overlap but 'a' and 'b' do"):
        check_scene(bench(block("a", 0.1), block("b", 0.499)))


def test_reserved_ids_are_the_names_of_the_templates() -> None:
    named = {
        element.attrib["name"]
        for file in (ROOT / "arena.xml", *(ROOT / "robots").glob("*.xml"))
        for element in ET.parse(file).iter()
        if "name" in element.attrib
    }
    assert named | {"robot", "wall", "world"} == RESERVED_IDS


def test_mass_force_and_pushability() -> None:
    crate = block("crate", mass_kg=4.0, friction=0.5)
    assert crate.mass_kg == pytest.approx(4.0)
    assert crate.breakaway_force_n == pytest.approx(19.62)
    assert crate.pushable(20.0)
    assert not crate.pushable(19.0)
    vase = block("vase", mass_kg=4.0, break_force_n=15.0)
    assert not vase.pushable(60.0)
    pillar = obstacle("pillar", crate.shape, interaction="safe", fixed=True)
    assert math.isinf(pillar.breakaway_force_n)
    assert not pillar.pushable(1e9)
