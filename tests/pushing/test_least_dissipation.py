"""Pushing by least dissipation, against closed forms and a general minimiser."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.optimize import minimize

from beacon_mj.geometry import Array
from beacon_mj.pushing.least_dissipation import IMMOVABLE, ROBOT, least_dissipation

CORNERS = np.array([(-0.2, -0.15), (0.2, -0.15), (0.2, 0.15), (-0.2, 0.15)])
TRAVEL = np.array([0.001, 0.0])


def solved(
    points: Array,
    friction: Array,
    bodies: list[tuple[int, int]],
    arms: Sequence[tuple[float, ...]],
    gaps: list[float] | None = None,
    travel: Array = TRAVEL,
) -> tuple[Array, Array, float]:
    """Push along x; all normals point that way."""
    c = len(bodies)
    motion, force = np.zeros((len(points), 3)), np.zeros(c)
    left = least_dissipation(
        points, friction, np.array(bodies), np.tile([1.0, 0.0], (c, 1)),
        np.array(arms), np.zeros(c) if gaps is None else np.array(gaps),
        travel, motion, force,
    )  # fmt: skip
    return motion, force, left


def test_a_push_through_the_centre_translates_at_mu_m_g() -> None:
    motion, force, left = solved(
        CORNERS[None], np.full((1, 4), 5.0), [(ROBOT, 0)], [(0, 0, -0.2, 0.0)]
    )
    np.testing.assert_allclose(motion[0], (0.001, 0.0, 0.0), atol=1e-12)
    assert force[0] == pytest.approx(20.0, rel=1e-9)
    assert left <= 1e-12


def test_forces_of_a_row_add_up() -> None:
    points, friction = np.tile(CORNERS, (3, 1, 1)), np.full((3, 4), 2.5)
    bodies = [(ROBOT, 0), (0, 1), (1, 2)]
    arms = [(0, 0, -0.2, 0.0), (0.2, 0.0, -0.2, 0.0), (0.2, 0.0, -0.2, 0.0)]
    motion, force, _ = solved(points, friction, bodies, arms)
    np.testing.assert_allclose(force, (30.0, 20.0, 10.0), rtol=1e-6)
    np.testing.assert_allclose(motion[:, 0], 0.001, rtol=1e-6)


def test_what_cannot_give_way_is_left() -> None:
    bodies, arms = [(ROBOT, 0), (0, IMMOVABLE)], [(0, 0, -0.2, 0.0), (0.2, 0.0, 0, 0)]
    _, force, left = solved(CORNERS[None], np.full((1, 4), 5.0), bodies, arms)
    assert left > 1e-4 or force[0] > 1e3


@pytest.mark.parametrize("offset", [0.01, 0.03, 0.06, 0.1, 0.14])
def test_an_off_centre_push_is_the_minimum_of_the_dissipation(offset: float) -> None:
    friction = np.array([4.0, 6.0, 5.0, 3.0])
    motion, force, _ = solved(
        CORNERS[None], friction[None], [(ROBOT, 0)], [(0, 0, -0.2, offset)]
    )

    def dissipation(q: Array) -> float:
        x, y, turn = q
        ux, uy = x - turn * CORNERS[:, 1], y + turn * CORNERS[:, 0]
        return float((friction * np.hypot(ux, uy)).sum())

    def of_free(free: Array) -> float:
        y, turn = free
        return dissipation(np.array([1.0 + turn * offset, y, turn]))

    best = min(
        minimize(of_free, start, method="Nelder-Mead",
                 options={"xatol": 1e-10, "fatol": 1e-13, "maxiter": 10_000}).fun
        for start in ([0.0, 0.0], [0.1, -1.0], [0.0, 2.0])
    )  # fmt: skip
    x, _, turn = motion[0]
    assert x - turn * offset == pytest.approx(0.001, rel=1e-6)
    assert dissipation(motion[0]) / 0.001 == pytest.approx(best, rel=1e-5)
    assert force[0] == pytest.approx(best, rel=1e-4)


def test_a_ring_obeys_the_moment_balance_of_its_limit_surface() -> None:
    """At the motion found, friction's force and moment balance the contact's."""
    angle = np.arange(64) * (2.0 * math.pi / 64)
    ring = 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    friction = np.full(64, 20.0 / 64)
    motion, force, _ = solved(
        ring[None], friction[None], [(ROBOT, 0)], [(0, 0, -0.2, 0.08)]
    )
    x, y, turn = motion[0]
    slip = np.stack([x - turn * ring[:, 1], y + turn * ring[:, 0]], axis=1)
    pull = -friction[:, None] * slip / np.hypot(*slip.T)[:, None]
    moment = (ring[:, 0] * pull[:, 1] - ring[:, 1] * pull[:, 0]).sum()
    np.testing.assert_allclose(pull.sum(axis=0), (-force[0], 0.0), atol=1e-4)
    assert moment == pytest.approx(force[0] * 0.08, abs=1e-4)


def test_a_gap_is_closed_first() -> None:
    motion, _, _ = solved(
        CORNERS[None], np.full((1, 4), 5.0), [(ROBOT, 0)], [(0, 0, -0.2, 0.0)], [4e-4]
    )
    assert motion[0, 0] == pytest.approx(6e-4, abs=1e-12)
