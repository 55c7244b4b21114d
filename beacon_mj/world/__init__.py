"""The MuJoCo world of one scene, and what happens in it."""

from beacon_mj.world.base import BaseWorld, SimulationError
from beacon_mj.world.outcome import Damage, Displacement, PairForce, StepOutcome
from beacon_mj.world.world import World

__all__ = [
    "BaseWorld",
    "Damage",
    "Displacement",
    "PairForce",
    "SimulationError",
    "StepOutcome",
    "World",
]
