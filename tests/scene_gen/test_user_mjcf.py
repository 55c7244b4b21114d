"""MJCF that a user writes is honoured or refused by name, never dropped."""

import math
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import shapely

from beacon_mj.errors import TemplateError
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import shapes
from beacon_mj.scene_gen.family import family_paths, family_sha256, load_family
from beacon_mj.scene_gen.generate import generate_scene

CUBE = "\n".join(f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1))
FACES = "\n".join(
    f"f {a} {b} {c}"
    for a, b, c in ((1, 2, 4), (1, 4, 3), (5, 7, 8), (5, 8, 6), (1, 5, 6), (1, 6, 2),
                    (3, 4, 8), (3, 8, 7), (1, 3, 7), (1, 7, 5), (2, 6, 8), (2, 8, 4))
)  # fmt: skip


def cuboid(length: float, width: float, height: float) -> str:
    """Return an OBJ file of a block."""
    lines = [line.split() for line in CUBE.splitlines()]
    scaled = [
        f"v {float(x) * length} {float(y) * width} {float(z) * height}"
        for _, x, y, z in lines
    ]
    return "\n".join([*scaled, FACES])


def write(folder: Path, files: dict[str, str], family: str = "") -> Path:
    """Write obstacle files, and a family that includes those that are MJCF."""
    includes = family
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        if name.startswith("obstacles/") and name.endswith(".xml"):
            includes += f'<include file="{name}"/>'
    text = (ROOT / "families" / "sparse.xml").read_text()
    for shipped in (ROOT / "obstacles").glob("*.xml"):
        text = text.replace(f'<include file="../obstacles/{shipped.name}"/>', "")
    (folder / "fam.xml").write_text(text.replace("<custom>", includes + "<custom>"))
    return folder


def body(name: str, inside: str, attributes: str = "", head: str = "") -> str:
    return (
        f'<mujoco model="{name}">{head}<worldbody>\n'
        f'<body name="{name}" pos="3 3 0.3" {attributes}>{inside}</body>\n'
        "</worldbody></mujoco>"
    )


def nominal(folder: Path) -> dict[str, shapes.Shape]:
    return {p.name: p.nominal for p in load_family("fam", folder).prototypes}


def extent(shape: shapes.Shape) -> tuple[float, float, float]:
    """Return length, width and height of a shape's bounding box [m]."""
    west, south, east, north = shapely.bounds(shapes.footprint(shape).polygon())
    return float(east - west), float(north - south), shape.height_m


def test_bodies_in_bodies_are_parts_of_the_obstacle(tmp_path: Path) -> None:
    cart = body(
        "cart",
        '<freejoint name="cart"/><geom name="tray" type="box" size="0.25 0.15 0.02"/>'
        '<body name="handle" pos="-0.3 0 0.2">'
        '<geom name="bar" type="box" size="0.02 0.15 0.2"/></body>'
        '<body name="wheels" pos="0 0 -0.1">'
        '<geom name="axle" type="box" size="0.2 0.12 0.08"/></body>',
    )
    [shape] = nominal(write(tmp_path, {"obstacles/cart.xml": cart})).values()
    assert isinstance(shape, shapes.Hulls)
    assert len(shape.parts_m) == 3
    # From the handle at x = -0.32 to the tray at 0.25, from -0.18 to 0.4 in z.
    assert extent(shape) == pytest.approx((0.57, 0.3, 0.58))


def test_turned_bodies_in_turned_bodies(tmp_path: Path) -> None:
    """Two quarter turns about z and y: the inner body's x axis points up."""
    inner = (
        '<geom name="base" type="box" size="0.1 0.05 0.02"/>'
        '<body name="arm" quat="0.70710678118654757 0 -0.70710678118654757 0">'
        '<geom name="arm" type="box" size="0.02 0.01 0.01" pos="0.3 0 0"/></body>'
    )
    turned = 'quat="0.70710678118654757 0 0 0.70710678118654757"'
    mast = body("mast", inner, turned)
    [shape] = nominal(write(tmp_path, {"obstacles/mast.xml": mast})).values()
    assert extent(shape) == pytest.approx((0.1, 0.2, 0.34))


@pytest.mark.parametrize("nested", [False, True])
def test_an_obstacle_stands_as_it_is_drawn(nested: bool, tmp_path: Path) -> None:
    geoms = (
        '<geom name="case" type="box" size="0.2 0.5 0.15"/>'
        '<geom name="top" type="box" size="0.1 0.02 0.1" pos="0 0.52 0"/>'
    )
    turn = 'quat="0.70710678118654757 0.70710678118654757 0 0"'
    locker = (
        body("locker", f'<body name="inside" {turn}>{geoms}</body>')
        if nested
        else body("locker", f'<freejoint name="locker"/>{geoms}', turn)
    )
    [shape] = nominal(write(tmp_path, {"obstacles/locker.xml": locker})).values()
    assert extent(shape) == pytest.approx((0.4, 0.3, 1.04))
    parts = getattr(shape, "parts_m", ())
    tops = [np.array(part)[:, 2].max() for part in parts]
    assert tops[1] > tops[0]  # The top is on top, not below.


@pytest.mark.parametrize(
    ("name", "geom"),
    [
        ("box", 'type="box" size="0.1 0.2 0.3" euler="1.5707963267948966 0 0"'),
        ("cylinder", 'type="cylinder" size="0.1 0.3" euler="1.5707963267948966 0 0"'),
        ("capsule", 'type="capsule" size="0.1 0.3"'),
    ],
)
def test_a_simple_shape_that_is_turned_stays_turned(
    name: str, geom: str, tmp_path: Path
) -> None:
    text = body(name, f"<geom {geom}/>", head='<compiler angle="radian"/>')
    [shape] = nominal(write(tmp_path, {f"obstacles/{name}.xml": text})).values()
    expected = {
        "box": (0.2, 0.6, 0.4),
        "cylinder": (0.2, 0.6, 0.2),
        "capsule": (0.2, 0.2, 0.8),
    }
    assert extent(shape) == pytest.approx(expected[name], rel=0.01)


def test_what_cannot_touch_is_no_part(tmp_path: Path) -> None:
    chair = body(
        "chairv",
        '<freejoint name="chairv"/><geom name="col" type="box" size="0.2 0.2 0.02"/>'
        '<geom type="box" size="0.2 0.2 0.02" contype="0" conaffinity="0" mass="0"/>'
        '<geom type="sphere" size="0.45" contype="0" conaffinity="0" mass="0"/>',
    )
    [shape] = nominal(write(tmp_path, {"obstacles/chairv.xml": chair})).values()
    assert isinstance(shape, shapes.Hulls)
    assert len(shape.parts_m) == 1
    assert shape.volume_m3 == pytest.approx(0.4 * 0.4 * 0.04)


def test_meshes_are_told_apart_by_their_files(tmp_path: Path) -> None:
    mesh = '<asset><mesh name="{0}_mesh" file="model.obj"/></asset>'
    files = {}
    sizes = {"pole": (0.1, 0.1, 1.0), "crate": (0.6, 0.6, 0.6)}
    for name, size in sizes.items():
        geom = f'<geom name="{name}" type="mesh" mesh="{name}_mesh"/>'
        files[f"obstacles/{name}/{name}.xml"] = body(name, geom, head=mesh.format(name))
        files[f"obstacles/{name}/model.obj"] = cuboid(*size)
    found = nominal(write(tmp_path, files))
    for name, size in sizes.items():
        assert extent(found[name]) == pytest.approx(size, rel=1e-5)
    before = family_sha256("fam", tmp_path)
    (tmp_path / "obstacles/crate/model.obj").write_text(cuboid(0.6, 0.6, 0.7))
    assert family_sha256("fam", tmp_path) != before
    assert extent(nominal(tmp_path)["crate"]) == pytest.approx(
        (0.6, 0.6, 0.7), rel=1e-5
    )


CRATE = body(
    "crate",
    '<geom name="crate" type="mesh" mesh="crate"/>',
    head='<asset><mesh file="crate.obj"/></asset>',
)


def test_a_link_inside_the_folder_is_followed(tmp_path: Path) -> None:
    folder = write(tmp_path, {"obstacles/crate.xml": CRATE,
                              "store/crate.obj": cuboid(0.5, 0.4, 0.3)})  # fmt: skip
    (folder / "obstacles/crate.obj").symlink_to("../store/crate.obj")
    [shape] = nominal(folder).values()
    assert extent(shape) == pytest.approx((0.5, 0.4, 0.3), rel=1e-5)


@pytest.mark.parametrize("kind", ["file", "folder", "dangling"])
def test_a_link_that_leaves_the_folder_is_named(kind: str, tmp_path: Path) -> None:
    folder, store = tmp_path / "templates", tmp_path / "store"
    store.mkdir()
    (store / "crate.obj").write_text(cuboid(0.5, 0.4, 0.3))
    if kind == "folder":
        (store / "crate.xml").write_text(CRATE)
        write(folder, {"obstacles/crate.xml": CRATE})
        shutil.rmtree(folder / "obstacles")
        (folder / "obstacles").symlink_to(store)
    else:
        write(folder, {"obstacles/crate.xml": CRATE})
        target = store / ("crate.obj" if kind == "file" else "gone.obj")
        (folder / "obstacles/crate.obj").symlink_to(target)
    with pytest.raises(TemplateError, match=r"crate.*is a link that leaves .*store"):
        nominal(folder)


def test_hidden_files_are_no_families(tmp_path: Path) -> None:
    write(tmp_path, {"obstacles/a.xml": body("a", '<geom size="0.2"/>')})
    (tmp_path / "._fam.xml").write_bytes(b"\x00\x05\x16\x07AppleDouble")
    assert "._fam" not in family_paths(tmp_path)
    assert generate_scene("fam", 0, templates=tmp_path).obstacles


def test_an_unchanged_copy_of_the_shipped_folder_is_the_same(tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(ROOT, copy)
    copied = generate_scene("sparse", 0, templates=copy)
    assert copied.sha256 == generate_scene("sparse", 0).sha256


@pytest.mark.parametrize("name", ["arena.xml", "robot.xml"])
def test_a_room_or_robot_of_ones_own_is_refused(name: str, tmp_path: Path) -> None:
    write(tmp_path, {"obstacles/a.xml": body("a", '<geom size="0.2"/>')})
    family = tmp_path / "fam.xml"
    family.write_text(family.read_text().replace("../arena.xml", "arena.xml"))
    shutil.copy(ROOT / "arena.xml", tmp_path)
    shutil.copy(ROOT / "robots" / "disc.xml", tmp_path / "robot.xml")
    assert nominal(tmp_path)
    own = tmp_path / name
    own.write_text(own.read_text().replace('friction="0.', 'friction="1.'))
    with pytest.raises(TemplateError, match=f"{name}: expected no room or robot other"):
        nominal(tmp_path)


def test_angles_mean_the_same_alone_and_in_the_family(tmp_path: Path) -> None:
    geom = '<freejoint/><geom type="box" size=".3 .1 .1" euler="{} 0 0"/>'
    desk = body("deske", geom.format(90))
    with pytest.raises(
        TemplateError,
        match=r'deske.xml:2: expected deske.xml to say <compiler angle="radian"',
    ):
        nominal(write(tmp_path, {"obstacles/deske.xml": desk}))
    radian = '<compiler angle="radian"/>'
    said = body("deske", geom.format(0.5 * math.pi), head=radian)
    [shape] = nominal(write(tmp_path, {"obstacles/deske.xml": said})).values()
    assert extent(shape) == pytest.approx((0.6, 0.2, 0.2))


REFUSED = {
    "plane": (
        body("a", '<geom type="plane" size=".4 .4 .1"/>'),
        r"a.xml:2: expected the geoms of body 'a' to be solid .* one is a plane",
    ),
    "hinge": (
        body("a", '<joint name="h"/><geom size="0.2"/>'),
        r"a.xml:2: expected body 'a' to be rigid, .* but it has joint 'h'",
    ),
    "a door in a cupboard": (
        body("a", '<geom size="0.2"/><body><joint name="h"/><geom size="0.1"/></body>'),
        r"a.xml:2: expected body 'a' to be rigid, .* but it has joint 'h'",
    ),
    "nothing collides": (
        body("a", '<geom size="0.2" contype="0" conaffinity="0"/>'),
        r"body 'a' to have a geom that collides",
    ),
    "no geom": (body("a", ""), r"a.xml:2: expected body 'a' to have a geom\."),
    "replicate": (
        body("a", '<geom size="0.2"/>\n<replicate count="3"/>'),
        r"a.xml:3: expected no <replicate> in <body> of a template but one of: body,",
    ),
    "world geom": (
        '<mujoco><worldbody><geom name="pillar" size="0.2"/></worldbody></mujoco>',
        r"a.xml:1: expected no <geom> 'pillar' in <worldbody>",
    ),
    "option": (
        '<mujoco><option gravity="0 0 -1"/></mujoco>',
        r"a.xml:1: expected no <option> in <mujoco>",
    ),
    "actuator": ("<mujoco><actuator/></mujoco>", r"expected no <actuator> in"),
    "plugin": (
        '<mujoco><extension><plugin plugin="x"/></extension></mujoco>',
        r"expected no <extension> in",
    ),
    "model": (
        '<mujoco><asset><model name="m" file="a.xml"/></asset></mujoco>',
        r"expected no <model> 'm' in <asset>|to include itself",
    ),
    "fused": (
        '<mujoco><compiler fusestatic="true"/></mujoco>',
        r'a.xml:1: expected no fusestatic="true"',
    ),
    "bad size": (
        body("a", '<geom type="box" size="0.1 0.1 -1"/>'),
        r"a.xml: (not valid MJCF|MuJoCo cannot compile it): .*line 2",
    ),
    "many elements": (
        body("a", '<geom size="0.2"/>' * 20_000),
        r"fam.xml: expected at most 20000 elements",
    ),
    "attribute": (
        body("a", '<geom siz="0.1"/>'),
        r"a.xml: not valid MJCF: .*'siz'.*line 2",
    ),
    "deep": (
        body("a", "<body>" * 100 + "</body>" * 100),
        r"a.xml: expected at most 60 elements in each other",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_has_no_place_in_a_scene_is_refused_by_name(
    case: str, tmp_path: Path
) -> None:
    text, message = REFUSED[case]
    with pytest.raises(TemplateError, match=message) as caught:
        nominal(write(tmp_path, {"obstacles/a.xml": text}))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("levels", "times", "message"),
    [(7, 6, "fam.xml: expected at most 500 references to files"),
     (40, 1, "8.xml: expected at most 8 files to include one another")],
)  # fmt: skip
def test_files_that_include_each_other_without_end_are_refused(
    levels: int, times: int, message: str, tmp_path: Path
) -> None:
    write(tmp_path, {"obstacles/a.xml": body("a", '<geom size="0.2"/>')})
    for k in range(levels):
        lines = f'<include file="{k + 1}.xml"/>' * times
        (tmp_path / f"obstacles/{k}.xml").write_text(f"<mujoco>{lines}</mujoco>")
    (tmp_path / f"obstacles/{levels}.xml").write_text("<mujoco/>")
    family = tmp_path / "fam.xml"
    family.write_text(family.read_text().replace("obstacles/a.xml", "obstacles/0.xml"))
    with pytest.raises(TemplateError, match=message):
        nominal(tmp_path)


def test_a_mesh_of_too_many_corners_is_refused_at_once(tmp_path: Path) -> None:
    around = np.arange(150) * (2.0 * math.pi / 150)
    corners = [
        f"{0.3 * math.cos(t)} {0.3 * math.sin(t)} {z}"
        for z in (0.0, 0.8)
        for t in around
    ]
    mesh = f'<asset><mesh name="barrel" vertex="{" ".join(corners)}"/></asset>'
    barrel = body("barrel", '<geom type="mesh" mesh="barrel"/>', head=mesh)
    with pytest.raises(TemplateError, match=r"barrel.xml:2: .*at most 256 corners"):
        nominal(write(tmp_path, {"obstacles/barrel.xml": barrel}))


@pytest.mark.parametrize(
    "name", ["2rooms", "halle-büro", "cluttered[v2]", "a b", "v.2"]
)
def test_a_name_that_no_scene_may_have_is_refused(name: str, tmp_path: Path) -> None:
    write(tmp_path, {"obstacles/a.xml": body("a", '<geom size="0.2"/>')})
    (tmp_path / "fam.xml").rename(tmp_path / f"{name}.xml")
    with pytest.raises(TemplateError, match=r"to be called by a letter and at most 60"):
        generate_scene(name, 0, templates=tmp_path)


def test_document_types_in_any_encoding_are_refused(tmp_path: Path) -> None:
    write(tmp_path, {"obstacles/a.xml": ""})
    text = '<?xml version="1.0" encoding="utf-16"?><!DOCTYPE mujoco><mujoco/>'
    (tmp_path / "obstacles/a.xml").write_text(text, encoding="utf-16")
    with pytest.raises(TemplateError, match="no document type or entities"):
        nominal(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_only_regular_files_are_read(tmp_path: Path) -> None:
    write(tmp_path, {"obstacles/crate.xml": CRATE})
    os.mkfifo(tmp_path / "obstacles/crate.obj")
    with pytest.raises(
        TemplateError,
        match=r"crate.obj: cannot read the template: expected a regular file",
    ):
        nominal(tmp_path)


def test_numbers_of_a_class_are_inherited_as_in_mujoco(tmp_path: Path) -> None:
    write(tmp_path, {"obstacles/a.xml": body("a", '<geom size="0.2"/>')})
    family = tmp_path / "fam.xml"
    text = family.read_text()
    for name, friction in (("safe", "0.6 0.005 0.004"),):
        old = f'friction="{friction}"'
        assert text.count(old) == 1, name
        text = text.replace(old, 'friction="0.6"')
    family.write_text(text)
    assert load_family("fam", tmp_path).surfaces[0].rolling_friction_m == 0.004
    main = '<default><geom friction="0.5 0.01 0.02"/></default><custom>'
    family.write_text(text.replace("<custom>", main))
    safe = load_family("fam", tmp_path).surfaces[0]
    assert (safe.torsional_friction_m, safe.rolling_friction_m) == (0.01, 0.02)
