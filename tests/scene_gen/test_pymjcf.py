"""What dm-control is for: worlds checked by a second reader, obstacles from PyMJCF.

It has no release for Python 3.13 and later; everything else works without it.
"""

import math
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import shapely

from beacon_mj import save_obstacle
from beacon_mj.errors import TemplateError
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import Obstacle, Scene, shapes
from beacon_mj.scene_gen.family import load_family
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.mjcf import scene_mjcf
from tests.worlds import FAMILIES, cached_scene

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # It warns where there is no display.
    mjcf = pytest.importorskip("dm_control.mjcf", reason="no dm-control here")


def parsed(scene: Scene) -> Any:
    return mjcf.from_xml_string(scene_mjcf(scene), escape_separators=False)


def test_pymjcf_reads_the_same_world(family: str) -> None:
    """An independent parser finds every obstacle, its pose, density and friction."""
    scene = cached_scene(family, 0)
    root = parsed(scene)
    bodies = {b.name: b for b in root.worldbody.body}
    assert set(bodies) == {"base"} | {o.id for o in scene.obstacles}
    for o in scene.obstacles:
        body = bodies[o.id]
        np.testing.assert_allclose(body.pos[:2], (o.x_m, o.y_m), atol=1e-12)
        yaw = 2.0 * math.atan2(body.quat[3], body.quat[0])
        assert math.cos(yaw - o.yaw_rad) == pytest.approx(1.0)
        assert (body.find_all("joint") != []) is not o.fixed or body.freejoint
        assert (body.freejoint is None) is o.fixed
        geom = next(g for g in body.geom if g.name == o.id)
        assert geom.dclass.dclass == o.interaction
        assert geom.density == o.density_kgm3
        assert geom.friction[0] == o.friction


def solids(physics: Any, o: Obstacle) -> list[int]:
    """Return the geoms of an obstacle but for the feet that prisms stand on."""
    model = physics.model
    body = model.name2id(o.id, "body")
    geoms = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body]
    return [g for g in geoms if "_foot_" not in model.id2name(g, "geom")]


def corners(physics: Any, geom: int) -> np.ndarray:
    """Return the corners of a box or mesh in the world, (k, 3) [m]."""
    model, data = physics.model, physics.data
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
        signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
        local = signs * model.geom_size[geom]
    else:
        mesh = model.geom_dataid[geom]
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        local = model.mesh_vert[start : start + count].astype(float)
    return np.asarray(
        local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    )


def shadow(physics: Any, o: Obstacle) -> tuple[shapely.Geometry, float, float]:
    """Return outline, lowest and highest point of an obstacle as simulated."""
    geoms = solids(physics, o)
    model, data = physics.model, physics.data
    kinds = {int(model.geom_type[g]) for g in geoms}
    if kinds <= {int(mujoco.mjtGeom.mjGEOM_BOX), int(mujoco.mjtGeom.mjGEOM_MESH)}:
        points = np.concatenate([corners(physics, g) for g in geoms])
        outline = shapely.MultiPoint(points[:, :2]).convex_hull
        return outline, float(points[:, 2].min()), float(points[:, 2].max())
    [geom] = geoms
    radius, half = (float(v) for v in model.geom_size[geom][:2])
    axis, centre = data.geom_xmat[geom].reshape(3, 3)[:, 2], data.geom_xpos[geom]
    if kinds == {int(mujoco.mjtGeom.mjGEOM_CYLINDER)}:
        assert abs(axis[2]) == pytest.approx(1.0)
        outline = shapely.Point(centre[:2]).buffer(radius, quad_segs=64)
        return outline, centre[2] - half, centre[2] + half
    half = half if kinds == {int(mujoco.mjtGeom.mjGEOM_CAPSULE)} else 0.0
    ends = np.array([centre - half * axis, centre + half * axis])[:, :2]
    outline = shapely.LineString(ends).buffer(radius, quad_segs=64)
    return outline, centre[2] - radius, centre[2] + radius


@pytest.mark.parametrize("index", range(3))
def test_dm_control_simulates_the_same_masses_frictions_and_shapes(
    family: str, index: int
) -> None:
    scene = cached_scene(family, index)
    physics = mjcf.Physics.from_mjcf_model(parsed(scene))
    assert scene.obstacles
    for o in scene.obstacles:
        assert physics.named.model.body_mass[o.id] == pytest.approx(o.mass_kg, rel=1e-6)
        for geom in solids(physics, o):
            assert physics.model.geom_friction[geom, 0] == o.friction
        outline, low, high = shadow(physics, o)
        expected = o.footprint.polygon()
        difference = outline.symmetric_difference(expected).area
        assert difference < 0.01 * expected.area
        assert low == pytest.approx(0.0, abs=1e-5)
        assert high == pytest.approx(o.shape.height_m, abs=1e-5)


def test_all_kinds_of_shapes_were_compared() -> None:
    compared = [
        o for f in FAMILIES for i in range(3) for o in cached_scene(f, i).obstacles
    ]
    assert len({shapes.name_of(o.shape) for o in compared}) == 9


def stool(name: str = "stool", leg_m: float = 0.15) -> Any:
    """Return a PyMJCF model with a default, a mesh and an attached model."""
    model = mjcf.RootElement(model=name)
    model.default.geom.rgba = [1, 0, 0, 1]
    seat = np.array(np.meshgrid((-0.2, 0.2), (-0.2, 0.2), (0.0, 0.04))).reshape(3, -1).T
    model.asset.add("mesh", name="seat", vertex=seat.ravel())
    body = model.worldbody.add("body", name=name, pos=[3, 3, 0.3])
    body.add("freejoint", name=name)
    body.add("geom", name="seat", type="mesh", mesh="seat")
    leg = mjcf.RootElement(model="leg")
    size = [0.02, 0.02, leg_m]
    leg.worldbody.add("geom", name="leg", type="box", size=size, pos=[0, 0, -leg_m])
    body.add("site", name="below").attach(leg)
    return model


def family_of(folder: Path, names: list[str]) -> None:
    text = (ROOT / "families" / "sparse.xml").read_text()
    for shipped in (ROOT / "obstacles").glob("*.xml"):
        text = text.replace(f'<include file="../obstacles/{shipped.name}"/>', "")
    includes = "".join(f'<include file="obstacles/{n}.xml"/>' for n in names)
    (folder / "mine.xml").write_text(text.replace("<custom>", includes + "<custom>"))


def test_obstacles_written_with_pymjcf_are_generated(tmp_path: Path) -> None:
    paths = [save_obstacle(stool(n, leg), tmp_path) for n, leg in
             (("stool", 0.15), ("table", 0.3))]  # fmt: skip
    assert paths == [tmp_path / "obstacles" / f"{n}.xml" for n in ("stool", "table")]
    family_of(tmp_path, ["stool", "table"])
    found = {p.name: p.nominal for p in load_family("mine", tmp_path).prototypes}
    assert set(found) == {"stool", "table"}
    assert found["stool"].height_m == pytest.approx(0.34)
    assert found["table"].height_m == pytest.approx(0.64)
    for shape in found.values():
        assert isinstance(shape, shapes.Hulls)
        assert len(shape.parts_m) == 2
    scene = generate_scene("mine", 0, templates=tmp_path)
    assert {shapes.name_of(o.shape) for o in scene.obstacles} <= {"stool", "table"}


def test_a_pymjcf_model_without_one_body_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TemplateError, match=r"'empty' to have one named body"):
        save_obstacle(mjcf.RootElement(model="empty"), tmp_path)
    with pytest.raises(TemplateError, match=r"name .* but it was 'a b'"):
        save_obstacle(mjcf.RootElement(model="a b"), tmp_path)
    assert not list(tmp_path.iterdir())


def test_nothing_of_the_package_imports_dm_control() -> None:
    code = (
        "import sys\n"
        "sys.modules['dm_control'] = None\n"
        "from beacon_mj import generate_scene\n"
        "print(generate_scene('sparse', 0).sha256)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == cached_scene("sparse", 0).sha256, done.stderr
