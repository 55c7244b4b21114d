"""The MuJoCo world of one scene, and what happens in it."""

from beacon_mj.world.outcome import Damage, Displacement, PairForce, StepOutcome
from beacon_mj.world.world import SimulationError, World

__all__ = [
    "Damage",
    "Displacement",
    "PairForce",
    "SimulationError",
    "StepOutcome",
    "World",
]
