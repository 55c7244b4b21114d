"""Which outlines are near is what a test of all of them says."""

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.scene_gen.neighbours import Neighbours, inscribed_m


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


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32), reach=st.sampled_from([0.0, 0.1, 0.5]))
def test_a_disc_that_is_near_says_that_the_outline_is(seed: int, reach: float) -> None:
    """Of rectangles, which are discs nowhere; and of most that overlap it says so."""
    rng = np.random.default_rng(seed)
    sizes, places = rng.uniform(0.1, 2.0, (40, 2)), rng.uniform(-4.0, 4.0, (40, 2))
    low, high = places - 0.5 * sizes, places + 0.5 * sizes
    outlines = shapely.box(*low.T, *high.T)
    neighbours = Neighbours(outlines[:20])
    said = found = 0
    for outline, place in zip(outlines[20:], places[20:], strict=True):
        inner_m = inscribed_m(outline, (place[0], place[1]))
        near = bool((shapely.distance(outline, outlines[:20]) < reach).any())
        disc = neighbours.disc_within((place[0], place[1]), inner_m, reach)
        assert near or not disc
        said, found = said + disc, found + near
    assert said >= found // 4


def test_a_point_outside_has_no_disc_within() -> None:
    assert inscribed_m(shapely.box(0.0, 0.0, 2.0, 1.0), (1.0, 0.5)) == 0.5
    assert inscribed_m(shapely.box(0.0, 0.0, 2.0, 1.0), (3.0, 0.5)) == 0.0
