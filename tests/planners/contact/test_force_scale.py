"""The belief about the scale of forces against closed forms and samples."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.planners.contact.force_scale import OVERSHOOT, ScaleBelief


@given(st.floats(0.1, 1.0), st.floats(0.05, 0.4), st.floats(5.0, 100.0))
def test_without_evidence_forces_are_log_normal(
    scale: float, own: float, perceived_n: float
) -> None:
    belief = ScaleBelief(scale, own)
    sigma = math.sqrt(scale * scale + own * own)
    for limit in (20.0, 60.0):
        expected = 0.5 * math.erfc(-math.log(limit / perceived_n) / sigma / 2**0.5)
        assert belief.probability_below(perceived_n, limit) == pytest.approx(
            expected, abs=5e-3
        )
    assert belief.factor == pytest.approx(1.0)


def test_a_scale_known_to_be_one_learns_nothing() -> None:
    belief = ScaleBelief(0.0, 0.2)
    before = belief.probability_below(50.0, 60.0)
    belief.learn(50.0, "not_moved", 60.0, 0.9)
    assert belief.probability_below(50.0, 60.0) == before
    assert belief.factor == 1.0


@pytest.mark.parametrize("event", ["moved", "not_moved"])
def test_the_scale_is_the_posterior_of_samples(event: str) -> None:
    """Rejection sampling from the model itself."""
    rng = np.random.default_rng(1000)
    scale = 0.6 * rng.standard_normal(400_000)
    own = 0.1 * rng.standard_normal(400_000)
    movable = rng.random(400_000) < 0.9
    force = 40.0 * np.exp(scale + own)
    belief = ScaleBelief(0.6, 0.1)
    if event == "moved":
        belief.learn(40.0, "moved", 30.0, 0.9)
        kept = (force > 30.0 / OVERSHOOT[1]) & (force < 30.0 / OVERSHOOT[0])
    else:
        belief.learn(40.0, "not_moved", 60.0, 0.9)
        kept = ~movable | (force > 60.0)
    assert kept.sum() > 10_000
    assert belief.factor == pytest.approx(np.exp(scale[kept].mean()), rel=0.02)
    other = 50.0 * np.exp(scale + 0.1 * rng.standard_normal(400_000))
    expected = float((other[kept] < 60.0).mean())
    assert belief.probability_below(50.0, 60.0) == pytest.approx(expected, abs=0.01)
