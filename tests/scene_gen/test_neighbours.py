"""Which outlines are near is what a test of all of them says."""

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.scene_gen.neighbours import Neighbours


@settings(max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    count=st.integers(0, 60),
    reach=st.sampled_from([0.0, 0.1, 0.5, 2.0]),
)
def test_neighbours_are_those_of_all_outlines(
    seed: int, count: int, reach: float
) -> None:
    rng = np.random.default_rng(seed)
    sizes = rng.uniform(0.05, 2.5, count + 20)
    places = rng.uniform(-8.0, 8.0, (count + 20, 2))
    outlines = shapely.buffer(shapely.points(places), 0.5 * sizes)
    placed, asked = outlines[:count], outlines[count:]
    neighbours = Neighbours(placed[: count // 2])
    for outline in placed[count // 2 :]:
        neighbours.add(outline)
    for outline in asked:
        expected = bool((shapely.distance(outline, placed) < reach).any())
        assert neighbours.within(outline, reach) is expected
