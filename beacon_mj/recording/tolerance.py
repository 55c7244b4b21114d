"""Verifying a log of another kind of machine, where the last bits may differ.

States are simulated again and compared within a tolerance. How the episode ended is
compared exactly, and so is the row: it is computed from the states in the log, whose
bits are there.
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
    return None if row is None else _row_problem(log, row(logged))


def _row_problem(log: Log, row: Mapping[str, Any]) -> str | None:
    stored = log.row or {}
    ours = msgspec.json.decode(provenance.to_json(provenance.stable_row(row)))
    for name in dict.fromkeys([*stored, *ours]):
        if stored.get(name) != ours.get(name):
            return (
                f"{log.path}: row.{name} is {stored.get(name)!r} but its own states "
                f"give {ours.get(name)!r}."
            )
    return None
