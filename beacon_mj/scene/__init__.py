"""A scene: plain data that holds the whole truth about a world."""

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
    "Obstacle",
    "Perceived",
    "Profile",
    "Robot",
    "Scene",
    "Surface",
]
