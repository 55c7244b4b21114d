"""What the lidar reports: exact ranges, then noise and dropouts.

Noise and dropouts have streams of their own, drawn for every beam in every step: what
one beam meets changes the error of no other, nor does one kind of error the other.
"""

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Scan, SensorSheet
from beacon_mj.streams import stream
from beacon_mj.world import BaseWorld
from beacon_mj.world.lidar import Lidar


class Scanner:
    """The lidar of one episode.

    A beam that meets a surface at r reports

        r + sigma w,   w standard normal, at least 0,

    if that is within range and the beam is no dropout, which happens with probability
    p on its own; else infinity. A dropout and free space look alike, as they do to a
    real lidar.
    """

    def __init__(self, world: BaseWorld, sheet: SensorSheet) -> None:
        """Mount the lidar of a data sheet that has beams."""
        scene = world.scene
        self._lidar = Lidar(world, sheet.lidar_beams, sheet.lidar_range_m)
        self._sheet = sheet
        keys = scene.seed, scene.family, scene.index
        self._noise = stream("sensor", *keys, "range")
        self._lost = stream("sensor", *keys, "dropout")

    def scan(self) -> Scan:
        """Return the sweep of this moment."""
        ranges, range_m = self._measured(self._lidar.ranges_m()), self._lidar.range_m
        return Scan(ranges_m=ranges, range_max_m=range_m)

    def _measured(self, ranges: Array) -> Array:
        sheet, n = self._sheet, len(ranges)
        if sheet.lidar_noise_m > 0.0:
            noisy = ranges + sheet.lidar_noise_m * self._noise.standard_normal(n)
            ranges = np.maximum(noisy, 0.0)
            ranges[ranges > sheet.lidar_range_m] = np.inf
        if sheet.lidar_dropout > 0.0:
            ranges[self._lost.random(n) < sheet.lidar_dropout] = np.inf
        return ranges
