"""The arithmetic that is alike everywhere is right, and does what it says in order."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj import numerics

LENGTH = st.floats(-50.0, 50.0)
ANGLE = st.floats(-10.0, 10.0)
VECTORS = st.lists(st.tuples(LENGTH, LENGTH), min_size=1, max_size=40)


@given(VECTORS, ANGLE)
def test_planar_functions_are_scalar_arithmetic_bit_for_bit(
    pairs: list[tuple[float, float]], angle: float
) -> None:
    vectors = np.array(pairs)
    c, s = math.cos(angle), math.sin(angle)
    turned = [[x * c - y * s, x * s + y * c] for x, y in pairs]
    assert numerics.rotated(vectors, angle).tolist() == turned
    assert numerics.rotated(vectors[0], angle).tolist() == turned[0]
    lengths = [math.sqrt(x * x + y * y) for x, y in pairs]
    assert numerics.norms(vectors).tolist() == lengths
    assert [numerics.norm(v) for v in vectors] == lengths
    assert numerics.angles_of(vectors).tolist() == [math.atan2(y, x) for x, y in pairs]


@given(st.lists(ANGLE, min_size=0, max_size=40))
def test_unit_vectors_point_along_their_angles(angles: list[float]) -> None:
    found = numerics.unit_vectors(np.array(angles, dtype=np.float64))
    assert found.shape == (len(angles), 2)
    assert found.tolist() == [[math.cos(a), math.sin(a)] for a in angles]


@given(st.lists(st.tuples(LENGTH, LENGTH), max_size=30))
def test_a_product_is_summed_from_the_left(pairs: list[tuple[float, float]]) -> None:
    a, b = np.array(pairs).reshape(-1, 2).T
    total = 0.0
    for x, y in pairs:
        total += x * y
    assert numerics.dot(a, b) == total
    assert numerics.dot(a, b) == pytest.approx(float(np.dot(a, b)), abs=1e-9)


def test_a_product_of_vectors_of_two_lengths_is_an_error() -> None:
    with pytest.raises(ValueError, match="shorter"):
        numerics.dot(np.zeros(3), np.zeros(2))


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 9), st.integers(1, 20))
def test_a_rotation_in_space_is_the_matrix_product(
    entries: tuple[float, ...], count: int
) -> None:
    matrix = np.array(entries).reshape(3, 3)
    points = np.linspace(-2.0, 3.0, 3 * count).reshape(count, 3)
    np.testing.assert_allclose(
        numerics.rotated_3d(points, matrix), points @ matrix.T, atol=1e-14
    )
