"""Sensed obstacles and observations made by hand."""

import numpy as np

from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.interface import Observation, Probabilities, SensedObstacle


def box_footprint(x: float, y: float, length: float, width: float) -> Footprint:
    a, b = 0.5 * length, 0.5 * width
    corners = np.array([(-a, -b), (a, -b), (a, b), (-a, b)])
    return Footprint(corners + np.array([x, y]))


def sensed_box(
    name: str,
    x: float = 2.0,
    y: float = 3.0,
    *,
    length: float = 0.3,
    width: float = 0.4,
    density: float = 100.0,
    friction: float = 0.5,
    scores: Probabilities = (0.1, 0.8, 0.1),
    kind: str | None = None,
) -> SensedObstacle:
    height = 0.3
    return SensedObstacle(
        id=name,
        footprint=box_footprint(x, y, length, width),
        centroid_m=np.array([x, y]),
        height_m=height,
        volume_m3=length * width * height,
        density_kgm3=density,
        friction=friction,
        scores=scores,
        seen_s=0.0,
        visible=True,
        broken=False,
        kind=kind,
    )


def observe(
    position: tuple[float, float], *obstacles: SensedObstacle, battery: float = 1.0
) -> Observation:
    velocity: Array = np.zeros(2)
    return Observation(
        step=0,
        time_s=0.0,
        position_m=np.array(position, dtype=float),
        velocity_mps=velocity,
        battery=battery,
        bumper_force_n=np.zeros(2),
        drive_effort=0.0,
        obstacles=obstacles,
        footprints=Footprints.stack([o.footprint for o in obstacles]),
        map_version=1,
        contacts=(),
        evidence=(),
    )
