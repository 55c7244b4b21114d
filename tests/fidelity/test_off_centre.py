"""The rows on off-centre pushes would notice another world."""

import pytest

from beacon_mj.fidelity import off_centre
from beacon_mj.world import World
from beacon_mj.world.planar import PlanarWorld


def test_a_pyramidal_cone_would_fail_the_row() -> None:
    """Design 10.2: it turns 40 to 60 % more."""
    scene = off_centre._scene(off_centre._box(), 0.06, mass_kg=4.0, friction=0.5)
    expected = off_centre.pushed(off_centre._reference(scene)).angle_rad
    world = World(scene)
    world.model.opt.cone = 0  # mjCONE_PYRAMIDAL
    world.model.opt.impratio = 1.0
    assert off_centre.pushed(world).angle_rad / expected > 1.3


@pytest.mark.parametrize(
    ("offset", "angle_deg"), [(0.02, 1.96), (0.04, 3.83), (0.06, 5.55), (0.08, 7.06)]
)
def test_the_reference_is_the_limit_surface_of_the_design(
    offset: float, angle_deg: float
) -> None:
    """Computed beforehand by another solver, with loads that shift ahead."""
    scene = off_centre._scene(off_centre._box(), offset, mass_kg=4.0, friction=0.5)
    found = off_centre.pushed(PlanarWorld(scene, push="limit-surface"))
    assert -found.angle_rad * 57.29578 == pytest.approx(angle_deg, rel=0.015)
