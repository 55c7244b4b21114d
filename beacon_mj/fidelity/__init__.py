"""Closed-form checks of the physics that the benchmark ships.

The worlds are those of the benchmark: the shipped arena and robot, with hand-made
or generated scenes, compiled by the same `scene_mjcf` and stepped by the same `World`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType

from beacon_mj.errors import RunError, unknown
from beacon_mj.fidelity import (
    corner,
    energy,
    friction,
    impact,
    mass,
    off_centre,
    pushing,
    repeat,
    wheels,
)
from beacon_mj.fidelity.law import Law
from beacon_mj.fidelity.table import Fidelity

#: The checks by name, in the order of the table.
CHECKS: Mapping[str, tuple[Callable[[], list[Law]], ...]] = MappingProxyType(
    {
        "creep": (friction.creep,),
        "breakaway": (friction.breakaway,),
        "rolling": (friction.rolling,),
        "deceleration": (friction.deceleration,),
        "steady": (pushing.steady,),
        "work": (pushing.work,),
        "row": (pushing.row_of_boxes,),
        "saturation": (pushing.saturation,),
        "off-centre": (off_centre.off_centre,),
        "impact": (impact.spring,),
        "momentum": (impact.momentum,),
        "damage": (impact.damage,),
        "corner": (corner.corners,),
        "mass": (mass.compiled, mass.robot),
        "energy": (energy.audit,),
        "wheels": (
            wheels.rolling,
            wheels.turning,
            wheels.standing,
            wheels.force,
            wheels.turned_bumper,
            wheels.repeat,
            wheels.energy,
        ),
        "repeat": (repeat.bitwise,),
        "quiet": (repeat.quiet,),
        "jacobian": (repeat.jacobian,),
        "log": (repeat.log_file,),
    }
)


def fidelity_rows(checks: Sequence[str] = ()) -> Iterator[Law]:
    """Yield the rows of the named checks as they are measured; all if none is named.

    Raises:
        RunError: If there is no check of that name.
    """
    for name in checks:
        if name not in CHECKS:
            raise RunError(unknown("fidelity check", name, CHECKS))
    for name in checks or CHECKS:
        for measure in CHECKS[name]:
            yield from measure()


def run_fidelity(
    checks: Sequence[str] = (), on_row: Callable[[Law], None] = lambda _: None
) -> Fidelity:
    """Return the rows of the named checks. The same as `beacon-mj fidelity`.

    Args:
        checks: Names out of `CHECKS`; all if none is named.
        on_row: Told of each row as it is measured.

    Raises:
        RunError: If there is no check of that name.
    """
    rows = []
    for row in fidelity_rows(checks):
        rows.append(row)
        on_row(row)
    return Fidelity(rows)


__all__ = ["CHECKS", "Fidelity", "Law", "fidelity_rows", "run_fidelity"]
