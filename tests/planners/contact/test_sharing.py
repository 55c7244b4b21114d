"""Shared beliefs against brute force: sums over all joint assignments, and samples."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.interface import Probabilities
from beacon_mj.planners.contact.belief import posterior
from beacon_mj.planners.contact.belief_settings import Likelihoods
from beacon_mj.planners.contact.sharing import OVERSHOOT, KindBelief, ScaleBelief

LIKELIHOODS = Likelihoods()
probabilities = st.tuples(*[st.floats(0.01, 1.0)] * 3).map(
    lambda p: (p[0] / sum(p), p[1] / sum(p), p[2] / sum(p))
)
evidence = st.sampled_from(["moved", "not_moved", "broken"])


def brute_force(
    pi: Probabilities, rho: float, tables: list[np.ndarray]
) -> list[np.ndarray]:
    """Sum over the kind's class and every obstacle's own: b_i(c), shape (3,)."""
    out = [np.zeros(3) for _ in tables]
    for kind in range(3):
        for classes in itertools.product(range(3), repeat=len(tables)):
            p = pi[kind]
            for c, table in zip(classes, tables, strict=True):
                p *= (rho * (c == kind) + (1.0 - rho) * pi[c]) * table[c]
            for i, c in enumerate(classes):
                out[i][c] += p
    return [row / row.sum() for row in out]


@given(
    probabilities,
    st.floats(0.0, 1.0),
    st.lists(st.lists(evidence, max_size=3), min_size=1, max_size=4),
)
def test_the_belief_of_a_kind_is_the_sum_over_all_assignments(
    pi: Probabilities, rho: float, pushes: list[list[str]]
) -> None:
    belief = KindBelief(rho)
    tables = []
    for i, events in enumerate(pushes):
        belief.sight(f"o{i}", pi)
        table = np.ones(3)
        for event in events:
            likelihood = LIKELIHOODS.of(event)  # type: ignore[arg-type]
            belief.learn(f"o{i}", likelihood.tolist())
            table *= likelihood
        tables.append(table)
    expected = brute_force(pi, rho, tables)
    for i, row in enumerate(expected):
        assert belief.beliefs()[f"o{i}"] == pytest.approx(tuple(row), abs=1e-9)


@given(probabilities, evidence)
def test_alone_a_kind_has_the_papers_belief(pi: Probabilities, event: str) -> None:
    belief = KindBelief(0.95)
    belief.sight("one", pi)
    likelihood = LIKELIHOODS.of(event)  # type: ignore[arg-type]
    belief.learn("one", likelihood.tolist())
    assert belief.beliefs()["one"] == pytest.approx(
        tuple(posterior(np.array(pi), likelihood)), abs=1e-12
    )


@given(probabilities, probabilities, st.floats(0.0, 1.0))
def test_what_was_not_pushed_keeps_what_it_looks_like_on_average(
    first: Probabilities, second: Probabilities, rho: float
) -> None:
    """Scores differ within a kind: without evidence the mean is the mean score."""
    belief = KindBelief(0.0)
    belief.sight("a", first)
    belief.sight("b", second)
    assert belief.beliefs()["a"] == pytest.approx(first, abs=1e-9)
    shared = KindBelief(rho)
    shared.sight("a", first)
    shared.sight("b", first)
    assert shared.beliefs()["b"] == pytest.approx(first, abs=1e-9)


def test_a_door_that_does_not_give_way_warns_of_its_like() -> None:
    belief = KindBelief(0.95)
    for name in ("pushed", "like"):
        belief.sight(name, (0.5, 0.5, 0.0))
    belief.learn("pushed", LIKELIHOODS.not_moved)
    safe = belief.beliefs()["like"][0]
    assert 0.85 < safe < belief.beliefs()["pushed"][0] < 1.0


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
