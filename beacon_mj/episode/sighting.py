"""Copies of what is known of an obstacle.

Every obstacle in sight is copied twice in every control step, for the map and for the
planner. `dataclasses.replace` takes seven times as long as this.
"""

from beacon_mj.geometry import Array, Footprint
from beacon_mj.interface import SensedObstacle

_PUT = {name: vars(SensedObstacle)[name].__set__ for name in SensedObstacle.__slots__}
_put_id = _PUT["id"]
_put_footprint = _PUT["footprint"]
_put_centroid_m = _PUT["centroid_m"]
_put_height_m = _PUT["height_m"]
_put_volume_m3 = _PUT["volume_m3"]
_put_density_kgm3 = _PUT["density_kgm3"]
_put_friction = _PUT["friction"]
_put_scores = _PUT["scores"]
_put_seen_s = _PUT["seen_s"]
_put_visible = _PUT["visible"]
_put_broken = _PUT["broken"]
_put_kind = _PUT["kind"]


def sighting(
    known: SensedObstacle,
    footprint: Footprint,
    centroid_m: Array,
    seen_s: float,
    visible: bool,
    broken: bool,
) -> SensedObstacle:
    """Return what is known of an obstacle, with what may change replaced."""
    copy = SensedObstacle.__new__(SensedObstacle)
    _put_id(copy, known.id)
    _put_footprint(copy, footprint)
    _put_centroid_m(copy, centroid_m)
    _put_height_m(copy, known.height_m)
    _put_volume_m3(copy, known.volume_m3)
    _put_density_kgm3(copy, known.density_kgm3)
    _put_friction(copy, known.friction)
    _put_scores(copy, known.scores)
    _put_seen_s(copy, seen_s)
    _put_visible(copy, visible)
    _put_broken(copy, broken)
    _put_kind(copy, known.kind)
    return copy
