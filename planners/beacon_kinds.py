"""BEACON-KINDS, our own: BEACON that learns from one obstacle about all of its kind."""

from dataclasses import dataclass

from beacon_mj.planners.beacon import BeaconConfig, BeaconPolicy
from beacon_mj.planners.contact.belief_settings import BeliefSettings
from beacon_mj.planners.contact.loop import ContactPlanner


@dataclass(frozen=True, kw_only=True, slots=True)
class BeaconKindsConfig(BeaconConfig):
    """Parameters of BEACON, with beliefs that obstacles of a kind share."""

    #: What it learns from pushes.
    belief: BeliefSettings = BeliefSettings(sharing=frozenset({"kind"}))


class BeaconKindsPolicy(BeaconPolicy):
    """BEACON's decisions under beliefs that obstacles of a kind share."""

    Config = BeaconKindsConfig


class BeaconKinds(ContactPlanner[BeaconKindsConfig]):
    """BEACON with one change: what a push tells, it tells of the obstacle's whole kind.

    The paper's belief is per obstacle, so that it cannot learn across obstacles. Here
    an obstacle has the class of its kind with one of the probabilities of
    `belief.reliability`, and beliefs are exact posteriors of that model
    (`beacon_mj.planners.contact.kinds`). Where obstacles have no kinds, it is BEACON.
    """

    Policy = BeaconKindsPolicy
