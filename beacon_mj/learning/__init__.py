"""What learning by touch is worth, exactly: decisions at doors that hide a latent."""

from beacon_mj.learning.policy import memoryless_s, updating_s
from beacon_mj.learning.problem import DoorPart, DoorProblem, DoorStage

__all__ = ["DoorPart", "DoorProblem", "DoorStage", "memoryless_s", "updating_s"]
