"""Warehouses keep what they promise, and rooms have a largest size."""

import functools
import itertools
from pathlib import Path

import msgspec
import numpy as np
import pytest
import shapely

from beacon_mj.errors import GenerationError, SceneError, TemplateError
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import Scene
from beacon_mj.scene.certificates import certify
from beacon_mj.scene.checks import check_scene
from beacon_mj.scene_gen.family import load_family
from beacon_mj.scene_gen.generate import MARGIN_M, generate_scene
from tests.worlds import cached_scene

DISC_M = 0.24


@functools.cache
def warehouse(index: int) -> Scene:
    return generate_scene("warehouse-12", index, 1000)


@pytest.mark.parametrize("index", range(3))
def test_the_way_round_is_a_quarter_longer_than_the_way_through(index: int) -> None:
    scene = warehouse(index)
    check_scene(scene)
    assert len(scene.obstacles) == 160
    certificate = scene.certificate
    assert certificate == certify(scene, MARGIN_M)
    free = certificate.collision_free_length_m
    assert free is not None
    assert free >= 1.25 * certificate.reference_length_m


@pytest.mark.parametrize("index", range(3))
def test_every_row_has_pallets_that_leave_no_way_and_a_cross_aisle_that_is_open(
    index: int,
) -> None:
    scene = warehouse(index)
    racks = [o for o in scene.obstacles if o.fixed and o.shape.height_m >= 0.6]
    for x in sorted({round(o.x_m, 3) for o in racks}):
        line = shapely.LineString([(x, 0.0), (x, 12.0)])
        row = [o for o in scene.obstacles if o.outline.intersects(line)]
        pallets = [o for o in row if o not in racks]
        assert pallets
        for o in pallets:
            assert o.interaction == "movable"
            assert o.breakaway_force_n <= 0.85 * scene.robot.force_max_n
            others = [p.outline for p in row if p is not o]
            assert np.sort(shapely.distance(o.outline, others))[1] < DISC_M
        spans = sorted(o.outline.bounds[1::2] for o in row)
        gaps = [b[0] - a[1] for a, b in itertools.pairwise(spans)]
        assert max(gaps) > 0.55


@pytest.mark.parametrize(("size", "count"), [(12, 160), (24, 640), (48, 2000)])
def test_the_three_sizes_are_one_family(size: int, count: int) -> None:
    family = load_family(f"warehouse-{size}")
    assert family.range("workspace") == (size, size)
    assert family.range("obstacle_count") == (count, count)
    numbers = {**family.numerics}
    smallest = {**load_family("warehouse-12").numerics}
    assert numbers.keys() == smallest.keys()
    differ = {name for name in numbers if numbers[name] != smallest[name]}
    assert differ <= {"workspace", "obstacle_count", "rack_length"}


def test_more_obstacles_than_a_scene_may_have_are_refused_in_one_line(
    tmp_path: Path,
) -> None:
    text = (ROOT / "families" / "warehouse-12.xml").read_text()
    (tmp_path / "mine.xml").write_text(text.replace("160 160", "2501 2501"))
    with pytest.raises(TemplateError, match=r"'obstacle_count' .* in \[0, 2500\]"):
        load_family("mine", tmp_path)
    scene = cached_scene("sparse", 0)
    many = [
        msgspec.structs.replace(scene.obstacles[0], id=f"o_{i}") for i in range(2501)
    ]
    with pytest.raises(SceneError, match="of length <= 2500") as error:
        check_scene(msgspec.structs.replace(scene, obstacles=tuple(many)))
    assert "\n" not in str(error.value)


def test_a_warehouse_that_is_too_full_says_so(tmp_path: Path) -> None:
    text = (ROOT / "families" / "warehouse-12.xml").read_text()
    (tmp_path / "full.xml").write_text(text.replace("160 160", "2500 2500"))
    with pytest.raises(GenerationError, match="no room for that many obstacles"):
        generate_scene("full", 0, templates=tmp_path)
