"""Belief: Bayes' rule against hand computation, calibration laws, and bounds."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.errors import PlannerError
from beacon_mj.interface import Evidence, PushEvidence
from beacon_mj.planners.contact.belief import (
    BeliefMap,
    posterior,
    prior,
)
from beacon_mj.planners.contact.belief_settings import (
    BeliefSettings,
    Likelihoods,
    Memory,
    Sharing,
)
from tests.sensed import sensed_box

EVIDENCE: tuple[Evidence, ...] = ("moved", "not_moved", "broken")
ALL: frozenset[Sharing] = frozenset({"kind", "scale"})
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


@pytest.mark.parametrize("memory", ["none", "failures"])
def test_frozen_belief_learns_nothing(memory: Memory) -> None:
    settings = BeliefSettings(memory=memory, sharing=ALL, scale_error=0.5)
    beliefs, box = BeliefMap(settings), sensed_box("a", kind="crate")
    beliefs.sight(box)
    before = beliefs.beliefs["a"]
    assert beliefs.learn(PushEvidence("a", "not_moved", 30.0, 1.0)) == 0.0
    assert beliefs.beliefs["a"] == before
    assert beliefs.force_n(box) == box.perceived_force_n


def test_memory_and_sharing_are_words_of_their_own() -> None:
    with pytest.raises(PlannerError, match="Expected memory to be of none, failures"):
        BeliefSettings(memory="all")  # type: ignore[arg-type]
    with pytest.raises(PlannerError, match="Expected sharing to be of kind, scale"):
        BeliefSettings(sharing=frozenset({"kinds"}))  # type: ignore[arg-type]


def crates(settings: BeliefSettings) -> BeliefMap:
    """Two crates and a bin, seen at once."""
    beliefs = BeliefMap(settings)
    for name, kind in (("a", "crate"), ("b", "crate"), ("c", "bin")):
        beliefs.sight(sensed_box(name, scores=(0.5, 0.4, 0.1), kind=kind))
    return beliefs


def test_a_push_tells_of_its_kind_and_of_no_other() -> None:
    shared = crates(BeliefSettings(sharing=frozenset({"kind"}), reliability=(0.9,)))
    first = dict(shared.beliefs)
    change = shared.learn(PushEvidence("a", "not_moved", 55.0, 1.0))
    safe = {i: shared.probability(i, "safe") for i in "abc"}
    assert safe["a"] > safe["b"] > 0.8
    assert shared.beliefs["c"] == pytest.approx(first["c"])
    changes = [
        sum(abs(p - q) for p, q in zip(first[i], shared.beliefs[i], strict=True))
        for i in "abc"
    ]
    assert change == pytest.approx(max(changes))


def test_without_sharing_kinds_tell_nothing() -> None:
    alone, first = crates(BeliefSettings()), (0.5, 0.4, 0.1)
    alone.learn(PushEvidence("a", "not_moved", 55.0, 1.0))
    assert alone.beliefs["b"] == pytest.approx(first)
    unreliable = BeliefSettings(sharing=frozenset({"kind"}), reliability=(0.0,))
    assert crates(unreliable).beliefs["b"] == pytest.approx(first)


def test_one_push_rescales_all_perceived_forces() -> None:
    settings = BeliefSettings(sharing=frozenset({"scale"}), scale_error=0.7)
    beliefs, boxes = BeliefMap(settings), [sensed_box(i) for i in "ab"]
    for box in boxes:
        beliefs.sight(box)
    perceived = boxes[0].perceived_force_n
    assert beliefs.force_n(boxes[1]) == pytest.approx(perceived)
    before = beliefs.probability_below(boxes[1], perceived)
    assert beliefs.learn(PushEvidence("a", "moved", 3.0 * perceived, 1.0)) > 0.5
    assert beliefs.force_n(boxes[1]) > 1.5 * perceived
    assert beliefs.probability_below(boxes[1], perceived) < 0.5 * before
    # The same obstacle says nothing new of the scale.
    weights = beliefs.scale.weights
    beliefs.learn(PushEvidence("a", "moved", 3.0 * perceived, 2.0))
    assert beliefs.scale.weights == weights


@given(
    st.lists(st.tuples(st.sampled_from("ab"), st.sampled_from(EVIDENCE)), max_size=4)
)
def test_a_scale_that_is_known_changes_no_bit(
    pushes: list[tuple[str, Evidence]],
) -> None:
    plain = BeliefMap()
    shared = BeliefMap(BeliefSettings(sharing=ALL))  # The obstacles have no kind.
    boxes = [sensed_box("a"), sensed_box("b", density=333.0)]
    for each in (plain, shared):
        for box in boxes:
            each.sight(box)
        for name, evidence in pushes:
            each.learn(PushEvidence(name, evidence, 12.5, 1.0))
    assert shared.beliefs == plain.beliefs
    for box in boxes:
        spare = math.log(60.0 / box.perceived_force_n)
        tail = 0.5 * math.erfc(-spare / (plain.force_error * math.sqrt(2.0)))
        assert shared.force_n(box) == plain.force_n(box)
        assert shared.probability_below(box, 60.0) == tail
