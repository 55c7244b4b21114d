"""Points put into a path before it is pulled tight."""

import hypothesis.strategies as st
import numpy as np
from hypothesis import given
from hypothesis.extra.numpy import arrays

from beacon_mj.geometry import Array, segment_lengths
from beacon_mj.motion.string_pulling import _densify

places = st.integers(-30, 30).map(lambda n: n / 7.0)  # Some points coincide.


@given(arrays(float, st.tuples(st.integers(2, 8), st.just(2)), elements=places))
def test_points_are_those_of_numpy_to_the_last_bit(path: Array) -> None:
    steps = segment_lengths(path)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    counts = np.maximum(np.ceil(steps / 0.04), 1.0).astype(int)
    at = [
        arc[i] + steps[i] * k / counts[i]
        for i in range(len(steps))
        for k in range(counts[i])
    ]
    expected = np.column_stack([np.interp(at, arc, path[:, axis]) for axis in (0, 1)])
    assert _densify(path, 0.04).tobytes() == np.vstack([expected, path[-1]]).tobytes()
