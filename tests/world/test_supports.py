"""Support points and their loads."""

import numpy as np
import pytest

from beacon_mj.fidelity.benches import SURFACE
from beacon_mj.geometry import Array
from beacon_mj.scene import shapes
from beacon_mj.world.supports import load_shares, support_points

TRIANGLE = ((0.2, -0.1), (0.0, 0.2), (-0.2, -0.1))
SHAPES: dict[str, shapes.Shape] = {
    "sphere": shapes.Sphere(radius_m=0.1),
    "box": shapes.Box(length_m=0.4, width_m=0.3, height_m=0.3),
    "cylinder": shapes.Cylinder(radius_m=0.1, height_m=0.3),
    "capsule": shapes.Capsule(radius_m=0.08, length_m=0.5),
    "prism": shapes.Prism(kind="triangle", vertices_m=TRIANGLE, height_m=0.3),
}


@pytest.mark.parametrize("name", [*SHAPES])
def test_loads_carry_the_weight_at_the_centre_of_mass(name: str) -> None:
    points = support_points(SHAPES[name], SURFACE)
    shares = load_shares(points)
    assert (shares >= 0.0).all()
    assert shares.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(shares @ points, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "count"), [("sphere", 4), ("box", 4), ("cylinder", 8), ("capsule", 2)]
)
def test_supports_are_those_of_the_shape(name: str, count: int) -> None:
    points = support_points(SHAPES[name], SURFACE)
    assert len(points) == count


@pytest.mark.parametrize("centre", [(0.02, 0.0), (0.1, 0.05), (0.19, 0.0)])
def test_loads_follow_the_centre_of_pressure(centre: tuple[float, float]) -> None:
    points, c = support_points(SHAPES["box"], SURFACE), np.array(centre)
    shares = load_shares(points, c)
    assert (shares >= 0.0).all()
    np.testing.assert_allclose(shares @ points, c, atol=1e-12)


def test_beyond_the_supports_nothing_lifts_below_zero() -> None:
    points: Array = support_points(SHAPES["box"], SURFACE)
    shares = load_shares(points, np.array([0.5, 0.0]))
    assert (shares >= 0.0).all()
    assert shares.sum() == pytest.approx(1.0)
