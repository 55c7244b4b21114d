"""What learning by touch is worth, exactly: decisions at doors that hide a latent."""

from beacon_mj.learning.belief import world_posterior
from beacon_mj.learning.policy import (
    ENTRY,
    PartPolicy,
    memoryless_s,
    realized_s,
    updating_s,
)
from beacon_mj.learning.problem import DoorPart, DoorProblem, DoorStage
from beacon_mj.learning.routes import hindsight_s, optimistic_s
from beacon_mj.learning.saving import ActualSaving, actual_saving

__all__ = [
    "ENTRY",
    "ActualSaving",
    "DoorPart",
    "DoorProblem",
    "DoorStage",
    "PartPolicy",
    "actual_saving",
    "hindsight_s",
    "memoryless_s",
    "optimistic_s",
    "realized_s",
    "updating_s",
    "world_posterior",
]
