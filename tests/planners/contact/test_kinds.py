"""Beliefs about kinds against brute force: sums over all joint assignments."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.interface import Probabilities
from beacon_mj.planners.contact.belief import posterior
from beacon_mj.planners.contact.belief_settings import Likelihoods
from beacon_mj.planners.contact.kinds import KindBeliefs

LIKELIHOODS = Likelihoods()
probabilities = st.tuples(*[st.floats(0.01, 1.0)] * 3).map(
    lambda p: (p[0] / sum(p), p[1] / sum(p), p[2] / sum(p))
)
evidence = st.sampled_from(["moved", "not_moved", "broken"])
pushes = st.lists(st.lists(evidence, max_size=2), min_size=1, max_size=3)


def joint(pi: Probabilities, rho: float, tables: list[np.ndarray]) -> list[np.ndarray]:
    """Sum over the kind's class and every obstacle's own: P(c_i = c, evidence)."""
    out = [np.zeros(3) for _ in tables]
    for kind in range(3):
        for classes in itertools.product(range(3), repeat=len(tables)):
            p = pi[kind]
            for c, table in zip(classes, tables, strict=True):
                p *= (rho * (c == kind) + (1.0 - rho) * pi[c]) * table[c]
            for i, c in enumerate(classes):
                out[i][c] += p
    return out


def learned(belief: KindBeliefs, name: str, events: list[str]) -> np.ndarray:
    """Push one obstacle; return the product of the likelihoods, shape (3,)."""
    table = np.ones(3)
    for event in events:
        likelihood = LIKELIHOODS.of(event)  # type: ignore[arg-type]
        belief.learn(name, likelihood.tolist())
        table *= likelihood
    return table


@given(
    probabilities,
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=3),
    st.lists(pushes, min_size=1, max_size=2),
)
def test_beliefs_are_the_sum_over_reliabilities_and_all_assignments(
    pi: Probabilities, rhos: list[float], kinds: list[list[list[str]]]
) -> None:
    belief = KindBeliefs(tuple(rhos))
    tables = {}
    for k, members in enumerate(kinds):
        for i, events in enumerate(members):
            belief.sight(f"{k}.{i}", f"kind {k}", pi)
            tables[k, i] = learned(belief, f"{k}.{i}", events)
    own = [[tables[k, i] for i in range(len(m))] for k, m in enumerate(kinds)]
    given_rho = [[joint(pi, rho, each) for each in own] for rho in rhos]
    chance = [np.prod([each[0].sum() for each in rows]) for rows in given_rho]
    weights = np.array(chance) / sum(chance)
    assert belief.reliability() == pytest.approx(tuple(weights), abs=1e-9)
    for k, i in tables:
        rows = [rows[k][i] / rows[k][i].sum() for rows in given_rho]
        expected = tuple(weights @ np.array(rows))
        assert belief.beliefs()[f"{k}.{i}"] == pytest.approx(expected, abs=1e-9)


@given(probabilities, evidence)
def test_alone_a_kind_has_the_papers_belief(pi: Probabilities, event: str) -> None:
    belief = KindBeliefs((0.0, 0.95))
    belief.sight("one", "crate", pi)
    learned(belief, "one", [event])
    likelihood = LIKELIHOODS.of(event)  # type: ignore[arg-type]
    assert belief.beliefs()["one"] == pytest.approx(
        tuple(posterior(np.array(pi), likelihood)), abs=1e-12
    )


@given(probabilities, probabilities, st.floats(0.0, 1.0))
def test_what_was_not_pushed_keeps_what_it_looks_like_on_average(
    first: Probabilities, second: Probabilities, rho: float
) -> None:
    """Scores differ within a kind: without evidence the mean is the mean score."""
    belief = KindBeliefs((0.0,))
    belief.sight("a", "crate", first)
    belief.sight("b", "crate", second)
    assert belief.beliefs()["a"] == pytest.approx(first, abs=1e-9)
    shared = KindBeliefs((rho,))
    shared.sight("a", "crate", first)
    shared.sight("b", "crate", first)
    assert shared.beliefs()["b"] == pytest.approx(first, abs=1e-9)


def test_a_door_that_does_not_give_way_warns_of_its_like() -> None:
    belief = KindBeliefs((0.95,))
    for name in ("pushed", "like"):
        belief.sight(name, "crate", (0.5, 0.5, 0.0))
    learned(belief, "pushed", ["not_moved"])
    safe = belief.beliefs()["like"][0]
    assert 0.85 < safe < belief.beliefs()["pushed"][0] < 1.0


def test_crates_that_differ_show_that_kinds_cannot_be_relied_on() -> None:
    belief = KindBeliefs((0.0, 1.0))
    for name in ("first", "second", "third"):
        belief.sight(name, "crate", (0.5, 0.5, 0.0))
    belief.sight("other", "bin", (0.5, 0.5, 0.0))
    learned(belief, "first", ["moved"])
    assert belief.reliability()[1] == pytest.approx(0.5)
    learned(belief, "second", ["not_moved"])
    assert belief.reliability()[1] < 0.2
    assert belief.beliefs()["third"] == pytest.approx((0.5, 0.5, 0.0), abs=0.05)
