"""Causes of displacements, through chains of obstacles."""

import numpy as np

from beacon_mj.fidelity.benches import bench, block
from beacon_mj.world import World
from beacon_mj.world.attribution import Attribution
from beacon_mj.world.outcome import PairForce
from tests.worlds import Build

ZERO = np.zeros(3)


def touch(a: str, b: str, force: float = 5.0) -> PairForce:
    return PairForce(a, b, ZERO, ZERO, force, force, force, 0.1 * force)


def test_a_row_of_three_is_attributed_link_by_link(build: Build) -> None:
    blocks = [block(f"b{k}", 0.05 + 0.41 * k, mass_kg=1.5) for k in range(3)]
    world = build(bench(*blocks))
    chains: dict[str, tuple[str, ...]] = {}
    for _ in range(30):
        for d in world.step(np.array([0.3, 0.0])).displacements:
            assert d.distance_m > 0.0
            chains[d.obstacle] = d.chain
    assert chains == {"b0": ("b0",), "b1": ("b0", "b1"), "b2": ("b0", "b1", "b2")}


def test_an_obstacle_that_coasts_keeps_its_cause() -> None:
    world = World(bench(block(gap_m=0.05, mass_kg=1.0, friction=0.05)))
    for _ in range(10):
        world.step(np.array([0.5, 0.0]))
    coasting = world.step(np.array([-0.5, 0.0]))
    coasting = world.step(np.array([-0.5, 0.0]))
    assert not coasting.contacts
    assert [d.chain for d in coasting.displacements] == [("block",)]


def test_the_shortest_chain_wins() -> None:
    attribution = Attribution()
    attribution.update([touch("a", "robot"), touch("a", "b"), touch("b", "robot")])
    assert attribution.chains == {"a": ("a",), "b": ("b",)}


def test_a_weak_touch_and_a_wall_pass_nothing_on() -> None:
    attribution = Attribution()
    attribution.update([touch("a", "robot"), touch("a", "b", 0.1)])
    attribution.update([touch("robot", "wall"), touch("c", "wall")])
    assert attribution.chains == {"a": ("a",)}


def test_a_cause_is_forgotten_at_rest() -> None:
    """What a coasting neighbour does later is not put down to the old push."""
    attribution = Attribution()
    attribution.update([touch("a", "robot"), touch("b", "robot")])
    attribution.update([])
    attribution.forget_resting({"b"})
    assert attribution.chains == {"b": ("b",)}
    attribution.update([touch("a", "b")])
    assert attribution.chains["a"] == ("b", "a")
