"""BEACON-KINDS: a door that withstood puts the robot off its like further on."""

import pytest

from beacon_mj.interface import PushEvidence
from beacon_mj.planners.beacon import BeaconPolicy
from beacon_mj.planners.beacon_kinds import BeaconKindsPolicy
from tests.kinematics import make_task
from tests.sensed import observe, sensed_box

DOUBTFUL = (0.5, 0.45, 0.05)


@pytest.mark.parametrize(
    ("cls", "preferred"), [(BeaconPolicy, "crate_2"), (BeaconKindsPolicy, "bin_2")]
)
def test_the_choice_at_the_second_barrier(
    cls: type[BeaconPolicy], preferred: str
) -> None:
    """A crate withstood at the first barrier; at the second the bin is the heavier."""
    policy = cls()
    policy.reset(make_task((1.0, 3.0), (5.0, 3.0)))
    tried = sensed_box("crate_1", 2.0, 3.0, scores=DOUBTFUL, kind="crate")
    crate = sensed_box("crate_2", 4.0, 2.0, scores=DOUBTFUL, kind="crate")
    heavy = sensed_box("bin_2", 4.0, 4.0, scores=DOUBTFUL, density=110.0, kind="bin")
    policy.observe(observe((1.0, 3.0), tried, crate, heavy))

    def costs() -> dict[str, float]:
        found = {
            o.id: policy.crossing_cost(o, last_resort=False) for o in (crate, heavy)
        }
        return {name: cost for name, cost in found.items() if cost is not None}

    before = costs()
    assert min(before, key=lambda name: before[name]) == "crate_2"
    policy.learn(PushEvidence("crate_1", "not_moved", 59.0, 3.0))
    after = costs()
    assert min(after, key=lambda name: after[name]) == preferred
