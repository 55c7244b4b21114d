"""MJCF as public collections of objects write it: honoured, and read as MuJoCo does."""

import math
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from beacon_mj.errors import TemplateError
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import shapes
from beacon_mj.scene_gen.family import load_family
from tests.scene_gen.test_user_mjcf import body, cuboid, extent, nominal, write

BALL = '<geom size="0.2"/>'


def include(folder: Path, *names: str) -> None:
    """Let the family include these obstacles alone."""
    family = folder / "fam.xml"
    text = re.sub(r'<include file="obstacles/[^>]*>', "", family.read_text())
    lines = "".join(f'<include file="obstacles/{name}"/>' for name in names)
    family.write_text(text.replace("<custom>", f"{lines}<custom>"))


def test_files_lie_where_the_model_says(tmp_path: Path) -> None:
    """The assets of an object in a file of their own, in folders that it names."""
    files = {
        "obstacles/cup/cup.xml": '<mujoco><compiler meshdir="shapes" texturedir='
        '"looks"/><include file="assets.xml"/><worldbody><body name="cup">'
        '<include file="body.xml"/></body></worldbody></mujoco>',
        "obstacles/cup/assets.xml": '<mujocoinclude><asset><mesh file="wall.obj"/>'
        '<mesh name="base" file="../shapes/base.obj" scale="2 1 1"/>'
        '<texture name="clay" type="2d" file="clay.png"/>'
        '<material name="clay" texture="clay"/></asset></mujocoinclude>',
        "obstacles/cup/body.xml": '<mujocoinclude><geom type="mesh" mesh="wall" '
        'material="clay"/><geom type="mesh" mesh="base"/></mujocoinclude>',
        "obstacles/cup/shapes/wall.obj": cuboid(0.3, 0.2, 0.5),
        "obstacles/cup/shapes/base.obj": cuboid(0.3, 0.4, 0.1),
        "obstacles/cup/looks/clay.png": "no picture",
    }
    include(write(tmp_path, files), "cup/cup.xml")
    [shape] = nominal(tmp_path).values()
    assert isinstance(shape, shapes.Hulls)
    assert len(shape.parts_m) == 2
    assert extent(shape) == pytest.approx((0.6, 0.4, 0.5), rel=1e-5)
    (tmp_path / "obstacles/cup/looks/clay.png").unlink()
    with pytest.raises(TemplateError, match=r"assets.xml: file 'clay.png' found neith"):
        nominal(tmp_path)


def test_files_are_relative_to_the_object_also_from_what_it_includes(
    tmp_path: Path,
) -> None:
    files = {
        "obstacles/bin.xml": '<mujoco><include file="parts/bin_assets.xml"/>'
        '<worldbody><body name="bin"><geom type="mesh" mesh="bin"/></body>'
        "</worldbody></mujoco>",
        "obstacles/parts/bin_assets.xml": '<mujocoinclude><asset><mesh name="bin" '
        'file="../obstacles/meshes/bin.obj"/></asset></mujocoinclude>',
        "obstacles/meshes/bin.obj": cuboid(0.4, 0.3, 0.2),
    }
    include(write(tmp_path, files), "bin.xml")
    [shape] = nominal(tmp_path).values()
    assert extent(shape) == pytest.approx((0.4, 0.3, 0.2), rel=1e-5)


@pytest.mark.parametrize("name", ["meshdir", "texturedir", "assetdir"])
def test_folders_outside_are_refused(name: str, tmp_path: Path) -> None:
    head = f'<compiler {name}="/etc"/><asset><mesh file="passwd"/></asset>'
    write(tmp_path, {"obstacles/a.xml": body("a", BALL, head=head)})
    with pytest.raises(TemplateError, match=f"expected {name} '/etc' to stay inside"):
        nominal(tmp_path)
    outside = (tmp_path / "obstacles/a.xml").read_text().replace("/etc", "../../..")
    (tmp_path / "obstacles/a.xml").write_text(outside)
    with pytest.raises(TemplateError, match=r"'passwd' (found neither|to stay inside)"):
        nominal(tmp_path)


def test_marks_and_looks_are_no_part(tmp_path: Path) -> None:
    crate = body(
        "crate",
        '<freejoint/><geom type="box" size="0.2 0.1 0.1"/><site name="grip" pos="9 9 9"'
        ' size="1"/><camera pos="0 0 9"/><light pos="0 0 9"/><frame pos="1 0 0">'
        '<site name="rim" size="0.3"/></frame>',
    )
    [shape] = nominal(write(tmp_path, {"obstacles/crate.xml": crate})).values()
    assert extent(shape) == pytest.approx((0.4, 0.2, 0.2))


def test_classes_that_also_say_how_joints_and_motors_are(tmp_path: Path) -> None:
    head = (
        '<default><default class="can"><joint damping="2" limited="true"/>'
        '<geom contype="0" conaffinity="0" group="1"/><site rgba="1 0 0 1"/>'
        '<position ctrllimited="true" ctrlrange="0 1.57"/><default class="can_hit">'
        '<geom contype="1" conaffinity="1" group="4" margin="0.001"/></default>'
        "</default></default>"
    )
    geoms = (
        '<geom size="0.5"/>'
        '<geom class="can_hit" type="capsule" fromto="0 0 0 0.4 0 0" size="0.05"/>'
    )
    can = body("can", geoms, 'childclass="can"', head)
    [shape] = nominal(write(tmp_path, {"obstacles/can.xml": can})).values()
    assert extent(shape) == pytest.approx((0.5, 0.1, 0.1), rel=0.02)


def test_obstacles_without_a_name_are_called_after_their_file(tmp_path: Path) -> None:
    inside = '<body name="{}"><geom size="0.2"/></body>'
    files = {
        "obstacles/kettle.xml": "<mujoco><worldbody>"
        f"<body>{inside.format('kettle')}</body><body>{BALL}</body>"
        "</worldbody></mujoco>",
        "obstacles/mug.xml": f"<mujoco><worldbody><body>{BALL}</body></worldbody>"
        "</mujoco>",
    }
    write(tmp_path, files)
    assert [*nominal(tmp_path)] == ["kettle_2", "kettle_3", "mug"]


def test_names_within_an_obstacle_are_its_own(tmp_path: Path) -> None:
    """Both have a mesh, a material, a class, a site and a body of the same name."""
    text = (
        '<mujoco><compiler inertiagrouprange="{group} {group}"/><asset>'
        '<mesh name="contact" vertex="{corners}"/><material name="look"/></asset>'
        '<default><default class="part"><geom type="mesh" contype="{hits}" conaffinity='
        '"{hits}"/></default></default><worldbody><body name="{name}"><freejoint '
        'name="free"/><body name="object" childclass="part"><geom name="g" '
        'mesh="contact" material="look"/><site name="goal"/></body>'
        '<geom size="0.1"/></body></worldbody></mujoco>'
    )
    corners = "0 0 0 {0} 0 0 0 {0} 0 0 0 {0}"
    files = {
        "obstacles/one.xml": text.format(
            name="one", hits=1, group=3, corners=corners.format(0.5)
        ),
        "obstacles/two.xml": text.format(
            name="two", hits=0, group=4, corners=corners.format(0.9)
        ),
    }
    both = nominal(write(tmp_path, files))
    for name in ("one", "two"):
        include(tmp_path, f"{name}.xml")
        assert nominal(tmp_path) == {name: both[name]}
    assert len(getattr(both["one"], "parts_m", ())) == 2
    assert len(getattr(both["two"], "parts_m", ())) == 1


def test_obstacles_of_one_name_are_refused(tmp_path: Path) -> None:
    files = {f"obstacles/{k}.xml": body("crate", BALL) for k in "ab"}
    with pytest.raises(TemplateError, match=r"b.xml: .*repeated name 'crate' in body"):
        nominal(write(tmp_path, files))


def test_an_obstacle_may_say_its_unit_in_any_of_its_files(tmp_path: Path) -> None:
    files = {
        "obstacles/desk.xml": '<mujoco><include file="desk_assets.xml"/><worldbody>'
        '<include file="desk_body.xml"/></worldbody></mujoco>',
        "obstacles/desk_assets.xml": "<mujocoinclude/>",
        "obstacles/desk_body.xml": '<mujocoinclude>\n<body name="desk"><geom type="box"'
        f' size=".3 .1 .1" euler="{0.5 * math.pi} 0 0"/></body></mujocoinclude>',
    }
    include(write(tmp_path, files), "desk.xml")
    with pytest.raises(
        TemplateError, match=r"desk_body.xml:2: expected desk.xml to sa"
    ):
        nominal(tmp_path)
    said = '<mujocoinclude><compiler angle="radian"/></mujocoinclude>'
    (tmp_path / "obstacles/desk_assets.xml").write_text(said)
    [shape] = nominal(tmp_path).values()
    assert extent(shape) == pytest.approx((0.6, 0.2, 0.2))


def test_the_hull_that_a_template_limits_is_the_hull(tmp_path: Path) -> None:
    ball = '<mesh name="ball" builtin="sphere" params="3"/>'
    geom = '<geom type="mesh" mesh="ball"/>'
    write(tmp_path, {"obstacles/b.xml": body("b", geom, head=f"<asset>{ball}</asset>")})
    with pytest.raises(TemplateError, match=r'give a mesh maxhullvert="64"\)'):
        nominal(tmp_path)
    family = tmp_path / "fam.xml"
    coarse = '<default><mesh maxhullvert="30"/></default><custom>'
    family.write_text(family.read_text().replace("<custom>", coarse))
    [shape] = nominal(tmp_path).values()
    assert isinstance(shape, shapes.Hulls)
    assert [len(part) for part in shape.parts_m] == [30]
    assert extent(shape) == pytest.approx((2.0, 2.0, 2.0), rel=0.1)


def test_pictures_are_not_made(tmp_path: Path) -> None:
    """They would take gigabytes, and no scene has them."""
    head = "".join(
        f'<texture name="{kind}" type="{kind}" builtin="flat" width="40000" '
        f'height="40000"/><material name="{kind}" texture="{kind}"/>'
        for kind in ("2d", "cube", "skybox")
    )
    geom = '<geom size="0.2" material="2d"/>'
    text = body("a", geom, head=f"<asset>{head}</asset>")
    assert nominal(write(tmp_path, {"obstacles/a.xml": text}))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (body("a", BALL, 'gravcomp="1"'), 'expected no gravcomp="1"'),
        (body("a", BALL, 'mocap="true"'), 'expected no mocap="true"'),
        ('<mujoco><compiler strippath="true"/></mujoco>', "expected no strippath"),
        ("<mujoco><worldbody><geom type='plane'/></worldbody></mujoco>", "has a floor"),
        ("<mujoco><option timestep='0.01'/></mujoco>", "The physics is the same"),
    ],
)
def test_what_would_be_lost_is_refused(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(TemplateError, match=f"a.xml:[12]: expected no .*{message}|"
                       f"a.xml:[12]: {message}"):  # fmt: skip
        nominal(write(tmp_path, {"obstacles/a.xml": text}))


def test_an_object_is_as_large_as_mujoco_finds_it_alone(tmp_path: Path) -> None:
    """All that a body can say about where its geoms are, against MuJoCo's own boxes."""
    text = body(
        "tool",
        '<freejoint/><inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/>'
        '<geom type="box" size="0.1 0.2 0.05" quat="0.9 0.1 0.3 0.2" pos="0.1 0 0"/>'
        '<body pos="0.2 0.1 0" axisangle="0 1 1 0.7"><frame euler="0.1 0.2 0.3">'
        '<geom type="box" size="0.3 0.02 0.02" xyaxes="1 1 0 0 0 1"/></frame>'
        '<geom type="box" size="0.02 0.3 0.02" zaxis="1 0 1"/>'
        '<geom type="mesh" mesh="wedge" pos="0 0 0.2"/>'
        '<geom type="box" mesh="wedge" pos="0 0.3 0.2"/></body>',
        'quat="0.8 0 0.6 0"',
        '<compiler angle="radian"/><asset><mesh name="wedge" scale="0.2 -0.3 0.4" '
        'refpos="0.1 0 0" refquat="0.9 0.1 0 0" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>'
        "</asset>",
    )
    write(tmp_path, {"obstacles/tool.xml": text})
    [shape] = nominal(tmp_path).values()
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "obstacles/tool.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    ends = np.array([_box(model, data, g) for g in range(model.ngeom)])
    size = ends[:, 1].max(axis=0) - ends[:, 0].min(axis=0)
    assert extent(shape) == pytest.approx(tuple(size), rel=1e-5)


def _box(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> np.ndarray:
    """Return the two ends of a geom's bounding box in the world, (2, 3) [m]."""
    turn, size = data.geom_xmat[geom].reshape(3, 3), model.geom_size[geom]
    corners = size * np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1)
                               for z in (-1, 1)])  # fmt: skip
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        first = model.mesh_vertadr[model.geom_dataid[geom]]
        count = model.mesh_vertnum[model.geom_dataid[geom]]
        corners = model.mesh_vert[first : first + count]
    points = corners @ turn.T + data.geom_xpos[geom]
    return np.array([points.min(axis=0), points.max(axis=0)])


def test_shipped_families_have_no_names_changed() -> None:
    for path in (ROOT / "families").glob("*.xml"):
        names = [p.name for p in load_family(path.stem).prototypes]
        assert names
        assert not [n for n in names if n[-1].isdigit()]
