"""The cost of motion divides energies: no protocol has none."""

import pytest

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.errors import RunError
from beacon_mj.planners.beacon_voi import BeaconVoi
from tests.worlds import cached_scene


@pytest.mark.parametrize("cost", [0.0, 1e-300, -1.0])
def test_a_cost_of_nothing_is_refused(cost: float) -> None:
    with pytest.raises(RunError, match=r"protocol.motion_cost_jpm to be float >= 0.00"):
        Protocol(motion_cost_jpm=cost)


def test_the_least_cost_runs() -> None:
    protocol = Protocol(motion_cost_jpm=1e-3, max_steps=60, decision_limit_s=3600.0)
    scene = cached_scene("collision-required", 0)
    trace = run_episode(scene, BeaconVoi(BeaconVoi.Config()), protocol=protocol)
    assert trace.outcome == "timeout", trace.detail
