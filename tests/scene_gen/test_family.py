"""Family files: read, checked, extended without Python, and kept in their folder."""

import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest

from beacon_mj.errors import GenerationError, TemplateError
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import shapes
from beacon_mj.scene_gen.family import NUMERICS, family_paths, load_family, read_family
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.mjcf import scene_mjcf
from beacon_mj.world import World
from tests.repository import REPOSITORY

CHAIR = """
<mujoco model="chair">
  <asset><mesh name="seat" file="seat.obj"/></asset>
  <worldbody>
    <body name="chair" pos="3 3 0.3">
      <freejoint name="chair"/>
      <geom name="seat" type="mesh" mesh="seat"/>
      <geom name="leg_a" type="cylinder" size="0.02 0.15" pos="0.15 0.15 -0.15"/>
      <geom name="leg_b" type="box" size="0.02 0.02 0.15" pos="-0.15 0.15 -0.15"/>
      <geom name="leg_c" type="box" size="0.02 0.02 0.15" pos="-0.15 -0.15 -0.15"/>
      <geom name="leg_d" type="capsule" size="0.02 0.13" pos="0.15 -0.15 -0.15"/>
    </body>
  </worldbody>
</mujoco>
"""
SEAT = "\n".join(
    [
        f"v {x} {y} {z}"
        for z in (0.0, 0.05)
        for x, y in ((-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2))
    ]
    + [
        "f 1 3 2", "f 1 4 3", "f 5 6 7", "f 5 7 8", "f 1 2 6", "f 1 6 5",
        "f 2 3 7", "f 2 7 6", "f 3 4 8", "f 3 8 7", "f 4 1 5", "f 4 5 8",
    ]
)  # fmt: skip


def edited(folder: Path, changes: dict[str, str], name: str = "mine") -> Path:
    """Copy the sparse family alone into `folder`, with edits."""
    text = (ROOT / "families" / "sparse.xml").read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path = folder / f"{name}.xml"
    path.write_text(text)
    return path


def test_shipped_families_open_in_mujoco_as_they_are(family: str) -> None:
    model = mujoco.MjModel.from_xml_path(str(ROOT / "families" / f"{family}.xml"))
    assert model.nbody >= 10


def test_shipped_families_have_all_nine_shapes(family: str) -> None:
    kinds = {p.name: type(p.nominal) for p in load_family(family).prototypes}
    assert set(kinds) == {
        "sphere", "box", "cylinder", "capsule", "triangle", "trapezoid",
        "parallelogram", "pentagon", "hexagon",
    }  # fmt: skip
    assert shapes.Hulls not in kinds.values()


def test_a_copied_and_edited_family_needs_no_python(tmp_path: Path) -> None:
    edited(
        tmp_path,
        {
            '"obstacle_count" data="5 8"': '"obstacle_count" data="3 3"',
            '"class_mix" data="0.35 0.45 0.2"': '"class_mix" data="0 1 0"',
            '"movable_density" data="60 450"': '"movable_density" data="777 778"',
            '"size" data="0.25 0.6"': '"size" data="0.25 0.3"',
        },
    )
    scene = generate_scene("mine", 0, templates=tmp_path)
    assert scene.family == "mine"
    assert len(scene.obstacles) == 3
    assert {o.interaction for o in scene.obstacles} == {"movable"}
    densities = [
        float(line.split('density="')[1].split('"')[0])
        for line in scene_mjcf(scene).splitlines()
        if 'density="' in line and 'density="0"' not in line
    ]
    assert len(densities) == 3
    assert all(777.0 <= d <= 778.0 for d in densities)


def test_an_edited_family_is_read_again(tmp_path: Path) -> None:
    path = edited(tmp_path, {})
    assert read_family(path).range("obstacle_count") == (5.0, 8.0)
    text = path.read_text().replace('data="5 8"', 'data="6 9"')
    path.unlink()
    path.write_text(text)
    assert read_family(path).range("obstacle_count") == (6.0, 9.0)


def own_obstacle(folder: Path) -> Path:
    (folder / "families").mkdir()
    (folder / "obstacles").mkdir()
    (folder / "obstacles" / "chair.xml").write_text(CHAIR)
    (folder / "obstacles" / "seat.obj").write_text(SEAT)
    shapes_of = [p.stem for p in (ROOT / "obstacles").glob("*.xml")]
    changes = {f'<include file="../obstacles/{s}.xml"/>': "" for s in shapes_of}
    changes['<include file="../obstacles/box.xml"/>'] = (
        '<include file="../obstacles/chair.xml"/>'
    )
    edited(folder / "families", changes, "chairs")
    return folder


def test_an_obstacle_of_meshes_and_primitives_is_generated_and_simulates(
    tmp_path: Path,
) -> None:
    scene = generate_scene("chairs", 0, templates=own_obstacle(tmp_path))
    assert len(scene.obstacles) >= 3
    assert {shapes.name_of(o.shape) for o in scene.obstacles} == {"chair"}
    world = World(scene)
    for i, o in enumerate(scene.obstacles):
        assert isinstance(o.shape, shapes.Hulls)
        assert len(o.shape.parts_m) == 5
        mass = world.model.body(o.id).mass[0]
        assert mass == pytest.approx(o.mass_kg, rel=1e-6)
        np.testing.assert_allclose(world.poses[i, :2], (o.x_m, o.y_m), atol=1e-3)
    for _ in range(40):
        world.step(np.array([0.4, 0.0]))
    assert world.position_m[0] > scene.start_m[0] + 0.3


BAD = {
    "unknown numeric": (
        {'name="spacing"': 'name="spacin"'},
        r"mine.xml: Unknown numeric 'spacin'. Did you mean 'spacing'\?",
    ),
    "reversed range": (
        {'"size" data="0.25 0.6"': '"size" data="0.6 0.25"'},
        r"numeric 'size' to be a range \(low, high\)",
    ),
    "out of bounds": (
        {'"movable_friction" data="0.3 0.6"': '"movable_friction" data="-1 0.6"'},
        r"numeric 'movable_friction' to be 2 value\(s\) in",
    ),
    "not a number": (
        {'"spacing" data="0.1"': '"spacing" data="nan"'},
        r"numeric 'spacing' to be 1 value\(s\) in",
    ),
    "no weight": (
        {'"class_mix" data="0.35 0.45 0.2"': '"class_mix" data="0 0 0"'},
        "'class_mix' to have a weight",
    ),
    "unknown layout": (
        {'name="layout" data="scatter"': 'name="layout" data="scater"'},
        r"Unknown layout 'scater'. Did you mean 'scatter'\?",
    ),
    "no layout": (
        {'<text name="layout" data="scatter"/>': ""},
        'expected <text name="layout"',
    ),
    "no class": (
        {'<default class="fragile">': '<default class="brittle">'},
        'expected <default class="fragile">',
    ),
    "broken XML": ({"</mujoco>": ""}, "mine.xml: not valid XML"),
    "no MJCF": (
        {"<custom>": "<custom><nonsense/>"},
        "mine.xml:15: expected no <nonsense> in <custom>",
    ),
    "double quotes": (
        {"../obstacles/box.xml": "../../../../etc/passwd"},
        "to stay inside the template folder",
    ),
    "absolute": (
        {"../obstacles/box.xml": "/etc/passwd"},
        "to stay inside the template folder",
    ),
    "single quotes": (
        {'file="../obstacles/box.xml"': "file='/etc/passwd'"},
        "to stay inside the template folder",
    ),
    "character reference": (
        {"../obstacles/box.xml": "&#x2f;etc/passwd"},
        "to stay inside the template folder",
    ),
    "parent of a flat folder": (
        {"../obstacles/box.xml": "../secret.xml"},
        "found neither in",
    ),
    "mesh file": (
        {"<custom>": "<asset><mesh name='m' file='/etc/passwd'/></asset><custom>"},
        "to stay inside the template folder",
    ),
    "meshdir": (
        {"<custom>": "<compiler meshdir='/etc'/><custom>"},
        "expected meshdir '/etc' to stay inside the template folder",
    ),
    "entity": (
        {"<custom>": "<!ENTITY x SYSTEM 'file:///etc/passwd'><custom>"},
        "no document type or entities",
    ),
    "include cycle": (
        {"../obstacles/box.xml": "mine.xml"},
        "expected no file to include itself",
    ),
    "missing include": (
        {"../obstacles/box.xml": "../obstacles/boxx.xml"},
        "'../obstacles/boxx.xml' found neither",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_templates_are_refused_in_one_line(case: str, tmp_path: Path) -> None:
    changes, message = BAD[case]
    folder = tmp_path / "templates"
    folder.mkdir()
    (tmp_path / "secret.xml").write_text("<mujoco/>")
    edited(folder, changes)
    with pytest.raises(TemplateError, match=message) as caught:
        generate_scene("mine", 0, templates=folder)
    assert "\n" not in str(caught.value)


def test_unknown_family_and_missing_folder_name_what_exists(tmp_path: Path) -> None:
    with pytest.raises(TemplateError, match=r"Did you mean 'sparse'\?.*cluttered"):
        load_family("spars")
    with pytest.raises(TemplateError, match="expected a folder of templates"):
        family_paths(tmp_path / "nowhere")
    with pytest.raises(TemplateError, match="expected a family file"):
        family_paths(tmp_path)


def test_a_link_out_of_the_template_folder_is_not_followed(tmp_path: Path) -> None:
    folder = tmp_path / "templates"
    folder.mkdir()
    secret = tmp_path / "secret.xml"
    shutil.copy(ROOT / "obstacles" / "box.xml", secret)
    (folder / "link.xml").symlink_to(secret)
    path = edited(folder, {"../obstacles/box.xml": "link.xml"})
    with pytest.raises(TemplateError, match=r"'link.xml' is a link that leaves"):
        read_family(path)


def test_every_numeric_of_the_shipped_families_is_documented() -> None:
    text = (REPOSITORY / "docs" / "families.md").read_text()
    missing = [name for name in NUMERICS if f"`{name}`" not in text]
    assert not missing


def test_a_family_that_cannot_fit_says_so_soon(tmp_path: Path) -> None:
    text = (ROOT / "families" / "cluttered.xml").read_text()
    crowded = text.replace(
        '"obstacle_count" data="18 28"', '"obstacle_count" data="300 300"'
    )
    assert crowded != text
    (tmp_path / "crowded.xml").write_text(crowded)
    with pytest.raises(GenerationError, match="no room for that many obstacles"):
        generate_scene("crowded", 0, templates=tmp_path)
