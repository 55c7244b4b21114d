"""A scene: plain data that holds the whole truth about a world."""

from beacon_mj.scene.learning import (
    LearningCertificate,
    LearningPart,
    LearningStage,
    Sensing,
    door_problem,
)
from beacon_mj.scene.scene import (
    PROFILES,
    Certificate,
    Obstacle,
    Perceived,
    Profile,
    Robot,
    Scene,
    Surface,
)

__all__ = [
    "PROFILES",
    "Certificate",
    "LearningCertificate",
    "LearningPart",
    "LearningStage",
    "Obstacle",
    "Perceived",
    "Profile",
    "Robot",
    "Scene",
    "Sensing",
    "Surface",
    "door_problem",
]
