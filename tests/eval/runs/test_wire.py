"""What an isolated planner is told, field by field: what one in this process is."""

from dataclasses import fields, replace

import numpy as np

from beacon_mj.eval.runs.isolation.wire import Changes, Picture
from beacon_mj.interface import SensedObstacle
from tests.sensed import observe, sensed_box

#: Other than the defaults, so that a field that is forgotten shows.
TELLING = {"kind": "crate", "broken": True, "visible": False, "seen_s": 1.5}


def test_every_field_of_an_obstacle_crosses() -> None:
    seen = replace(sensed_box("a"), **TELLING)  # type: ignore[arg-type]
    changes, picture = Changes(), Picture()
    for version, obstacle in enumerate((seen, replace(seen, seen_s=2.0)), start=1):
        now = replace(observe((1.0, 1.0), obstacle), map_version=version)
        told = picture.observation(changes.request(version, now)).obstacles[0]
        for field in fields(SensedObstacle):
            sent, got = getattr(obstacle, field.name), getattr(told, field.name)
            if field.name == "footprint":
                sent, got = sent.vertices, got.vertices
            assert np.array_equal(sent, got), field.name
