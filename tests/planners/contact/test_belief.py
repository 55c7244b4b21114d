"""Belief: Bayes' rule against hand computation, calibration laws, and bounds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.errors import PlannerError
from beacon_mj.interface import Evidence, PushEvidence
from beacon_mj.planners.contact.belief import (
    BeliefMap,
    BeliefSettings,
    Likelihoods,
    posterior,
    prior,
)
from tests.sensed import sensed_box

EVIDENCE: tuple[Evidence, ...] = ("moved", "not_moved", "broken")
probabilities = st.lists(st.floats(0.01, 1.0), min_size=3, max_size=3)


def test_prior_normalises_scores() -> None:
    np.testing.assert_allclose(prior((2.0, 1.0, 1.0)), (0.5, 0.25, 0.25))


@pytest.mark.parametrize("scores", [(0.0, 0.0, 0.0), (-0.1, 1.0, 0.1)])
def test_prior_refuses_what_is_no_score(scores: tuple[float, float, float]) -> None:
    with pytest.raises(PlannerError, match="Expected scores >= 0"):
        prior(scores)


def test_posterior_by_hand() -> None:
    # P(moved) = 0.5 * 0.03 + 0.3 * 0.9 + 0.2 * 0.75 = 0.435.
    after = posterior(np.array([0.5, 0.3, 0.2]), Likelihoods().of("moved"))
    np.testing.assert_allclose(after, (0.015 / 0.435, 0.27 / 0.435, 0.15 / 0.435))


def test_one_hot_prior_cannot_be_revised() -> None:
    sure = np.array([1.0, 0.0, 0.0])
    np.testing.assert_array_equal(posterior(sure, Likelihoods().of("moved")), sure)


@given(probabilities, st.sampled_from(EVIDENCE), st.sampled_from(EVIDENCE))
def test_order_of_evidence_does_not_matter(
    scores: list[float], first: Evidence, second: Evidence
) -> None:
    table, b = Likelihoods(), prior((scores[0], scores[1], scores[2]))
    one = posterior(posterior(b, table.of(first)), table.of(second))
    two = posterior(posterior(b, table.of(second)), table.of(first))
    np.testing.assert_allclose(one, two, atol=1e-12)
    assert one.sum() == pytest.approx(1.0)


@given(probabilities)
def test_expected_posterior_is_the_prior(scores: list[float]) -> None:
    """The martingale law: evidence moves a belief, but not on average."""
    table, b = Likelihoods(), prior((scores[0], scores[1], scores[2]))
    average = np.zeros(3)
    for e in EVIDENCE:
        likelihood = table.of(e)
        average += float(b @ likelihood) * posterior(b, likelihood)
    np.testing.assert_allclose(average, b, atol=1e-12)


def test_likelihoods_must_be_distributions() -> None:
    with pytest.raises(PlannerError, match="sum to one"):
        Likelihoods(moved=(0.5, 0.9, 0.75))


def test_evidence_moves_belief_and_bounds() -> None:
    beliefs, box = BeliefMap(), sensed_box("a", scores=(0.4, 0.4, 0.2))
    assert beliefs.sight(box)
    assert not beliefs.sight(box)
    change = beliefs.learn(PushEvidence("a", "not_moved", 59.0, 1.0))
    assert change > 0.5
    assert beliefs.probability("a", "safe") > 0.8
    assert beliefs.force_n(box) == pytest.approx(59.0)


def test_breakaway_force_bounds_from_above() -> None:
    beliefs, box = BeliefMap(), sensed_box("a")
    beliefs.sight(box)
    beliefs.learn(PushEvidence("a", "moved", 7.0, 1.0))
    assert box.perceived_force_n > 7.0
    assert beliefs.force_n(box) == pytest.approx(7.0)


def test_frozen_belief_learns_nothing() -> None:
    beliefs, box = BeliefMap(BeliefSettings(update_belief=False)), sensed_box("a")
    beliefs.sight(box)
    before = beliefs.beliefs["a"]
    assert beliefs.learn(PushEvidence("a", "broken", 30.0, 1.0)) == 0.0
    assert beliefs.beliefs["a"] == before
