"""A stored certificate is not believed: what can be computed again, is.

A scene file may have been edited since its certificate was made, or its certificate may
say what suits somebody. Lengths and doors are proved anew from the geometry. What was
measured in the simulator (`simulated`) falls away with a certificate that was wrong,
and what the generator knew of a family's latents (`learning`) cannot be recomputed from
the scene alone; `beacon-mj verify` generates the scene again for that.
"""

import msgspec

from beacon_mj.errors import SceneError
from beacon_mj.scene import Certificate, Scene
from beacon_mj.scene.certificates import certify

TOLERANCE_M = 2e-6  #: Lengths are rounded to 1e-6 m.
_LENGTHS = ("collision_free_length_m", "reference_length_m", "straight_line_m")


def recertified(scene: Scene) -> Scene:
    """Return a scene whose certificate is proved; the same scene if its own is right.

    Raises:
        SceneError: If nothing can be proved: there is no way from start to goal even
            without all that can be pushed, or whether there is one is too close to
            tell.
    """
    proved = proved_certificate(scene)
    if first_lie(scene.certificate, proved) is None:
        return scene
    return msgspec.structs.replace(scene, certificate=proved)


def proved_certificate(scene: Scene) -> Certificate:
    """Return what can be proved about a scene; see `recertified`."""
    stored = scene.certificate
    # A way may exist without the margin that an edited scene once had.
    for margin_m in dict.fromkeys((stored.margin_m, 0.0)):
        found = certify(scene, margin_m)
        if found is not None:
            return msgspec.structs.replace(found, learning=stored.learning)
    raise SceneError(
        f"{scene.name}: expected a way from start to goal once all that can be pushed "
        "is removed, and with it none at all or one of some clearance, but that cannot "
        "be proved."
    )


def first_lie(stored: Certificate, proved: Certificate) -> str | None:
    """Say which entry of a certificate is not what can be proved, or return None."""
    for name in _LENGTHS:
        said, true = getattr(stored, name), getattr(proved, name)
        if said is None or true is None:
            same = said is true
        else:
            same = abs(said - true) <= TOLERANCE_M
        if not same:
            return f"certificate.{name} is {said} but {true} is proved"
    if stored.door_ids != proved.door_ids:
        return (
            f"certificate.door_ids are {[*stored.door_ids]} but {[*proved.door_ids]} "
            "are proved"
        )
    if stored.margin_m > proved.margin_m:
        return (
            f"certificate.margin_m is {stored.margin_m} but {proved.margin_m} is proved"
        )
    return None
