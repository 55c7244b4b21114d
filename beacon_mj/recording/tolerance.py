"""Verifying a log of another kind of machine, where the last bits may differ.

States are simulated again and compared within a tolerance. How the episode ended is
compared exactly. The row must be that of the log's own states, whose bits are there;
and that of the simulation within a tolerance, or else a log could say of its forces
what it likes by naming another machine.
"""

from collections.abc import Callable, Mapping
from typing import Any

import msgspec
import numpy as np

from beacon_mj.episode.trace import Trace
from beacon_mj.recording import provenance
from beacon_mj.recording.reader import Log

#: How far the robot may be from where the log has it, at every step [m].
TOLERANCE_M = 1e-4
#: How far numbers of a row may be from those of the simulation: relative, and least
#: [the column's unit].
ROW_RELATIVE, ROW_LEAST = 1e-3, 1e-4


def state_problem(
    log: Log,
    logged: Trace,
    again: Trace,
    row: Callable[[Trace], Mapping[str, Any]] | None,
) -> str | None:
    """Say where a log differs by more than the tolerance, or return None.

    Args:
        log: The log.
        logged: Its trace.
        again: What the logged commands do here.
        row: Computes an episode's row from its trace; None for no comparison of it.
    """
    if (logged.outcome, len(logged.steps)) != (again.outcome, len(again.steps)):
        return (
            f"{log.path}: ends with {logged.outcome} after {len(logged.steps)} steps "
            f"in the log but with {again.outcome} after {len(again.steps)} in the "
            "simulation."
        )
    for number, (ours, theirs) in enumerate(
        zip(logged.steps, again.steps, strict=True), start=1
    ):
        there, here = ours.outcome, theirs.outcome
        distance_m = float(np.abs(there.position_m - here.position_m).max())
        if not distance_m <= TOLERANCE_M:
            return (
                f"{log.path}: step {number}: the robot is {distance_m:.2g} m from "
                f"where the simulation has it, more than {TOLERANCE_M:g} m."
            )
        broken = [[d.obstacle for d in o.damages] for o in (there, here)]
        if broken[0] != broken[1]:
            return (
                f"{log.path}: step {number}: {broken[0]} break in the log but "
                f"{broken[1]} in the simulation."
            )
    if row is None:
        return None
    return _row_problem(
        log, row(logged), "its own states give", _equal
    ) or _row_problem(log, row(again), "the simulation gives", _near)


def _row_problem(
    log: Log,
    row: Mapping[str, Any],
    whose: str,
    same: Callable[[object, object], bool],
) -> str | None:
    """Say in which column a log's row is not the same as another, or return None."""
    stored = log.row or {}
    ours = msgspec.json.decode(provenance.to_json(provenance.stable_row(row)))
    for name in dict.fromkeys([*stored, *ours]):
        there, here = stored.get(name), ours.get(name)
        if not same(there, here):
            return f"{log.path}: row.{name} is {there!r} but {whose} {here!r}."
    return None


def _equal(there: object, here: object) -> bool:
    return there == here


def _near(there: object, here: object) -> bool:
    """Whether two values of a column may be of one episode on two machines."""
    if isinstance(there, float) and isinstance(here, float | int):
        return abs(there - here) <= ROW_LEAST + ROW_RELATIVE * abs(here)
    return there == here
