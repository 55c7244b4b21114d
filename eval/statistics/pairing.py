"""Who is compared with whom: arms of one or several runs, matched by scene hash."""

from collections.abc import Sequence
from typing import NamedTuple

from beacon_mj.errors import RunError, unknown
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.statistics.results import Results

DEFAULT_BASELINE = "dstar-lite"  #: The strongest baseline of the paper's Table II.
NAMED = 5  #: Missing scenes that a message names.


class Arm(NamedTuple):
    """One planner in one run; `label` tells it from all others."""

    label: str
    rows: list[Row]


class Matched(NamedTuple):
    """Two arms on the same scenes; `pairs` are (first, baseline).

    Attributes:
        first: Label of the arm that is judged.
        baseline: Label of the arm that it is compared with.
        pairs: Rows of equal scene hash.
        left_out: Scenes that only one of them has.
    """

    first: str
    baseline: str
    pairs: list[tuple[Row, Row]]
    left_out: int


def comparisons(
    runs: Sequence[Results], baseline: str | None = None
) -> list[tuple[Arm, Arm]]:
    """Return the (judged, baseline) arms that a user means.

    One run: every planner against `baseline`. Several: every planner of the later runs
    against `baseline` in the first, or without one against itself there; runs of one
    planner each are compared whatever the planners' names.

    Raises:
        RunError: If there is no such planner, or nothing to compare.
    """
    labels = _labels(runs)
    first = runs[0]
    if len(runs) == 1:
        base = default_baseline(first) if baseline is None else baseline
        against = _arm(first, base, labels[0])
        pairs = [
            (_arm(first, n, labels[0]), against) for n in first.planners if n != base
        ]
    else:
        pairs = [
            (_arm(run, name, label), _arm(first, base, labels[0]))
            for run, label in zip(runs[1:], labels[1:], strict=True)
            for name, base in _counterparts(run, first, baseline)
        ]
    if not pairs:
        raise RunError(f"{first.folder}: expected a planner to compare with {base!r}.")
    return pairs


def default_baseline(run: Results) -> str:
    """Return dstar-lite, or the first planner of a run without it."""
    known = run.planners
    return DEFAULT_BASELINE if DEFAULT_BASELINE in known else next(iter(known))


def match(first: Arm, baseline: Arm, *, common: bool = False) -> Matched:
    """Return two arms' rows paired by scene hash, in the baseline's order.

    Args:
        first: The arm that is judged.
        baseline: What it is compared with.
        common: Leave out scenes that only one of them has, instead of refusing.

    Raises:
        RunError: If the scenes differ, and `common` is not set; or none is the same.
    """
    ours = {row.scene_sha256: row for row in first.rows}
    theirs = {row.scene_sha256: row for row in baseline.rows}
    if not (common or ours.keys() == theirs.keys()):
        raise RunError(_difference(first, baseline))
    pairs = [(ours[k], row) for k, row in theirs.items() if k in ours]
    if not pairs:
        raise RunError(
            f"{first.label}: expected scenes of {baseline.label} but they share none."
        )
    left_out = len(ours.keys() ^ theirs.keys())
    return Matched(first.label, baseline.label, pairs, left_out)


def _difference(first: Arm, baseline: Arm) -> str:
    """Say which scenes two arms do not share."""
    ours, theirs = (
        {(r.family, r.scene_index): r for r in a.rows} for a in (first, baseline)
    )
    changed = [
        k
        for k in theirs
        if k in ours and ours[k].scene_sha256 != theirs[k].scene_sha256
    ]
    parts = [
        f"{len(keys)} {what}: {_names(keys)}"
        for keys, what in (
            (changed, "are other scenes of the same name"),
            ([k for k in theirs if k not in ours], f"are missing in {first.label}"),
            ([k for k in ours if k not in theirs], f"are missing in {baseline.label}"),
        )
        if keys
    ]
    return (
        f"{first.label}: expected the scenes of {baseline.label} but "
        f"{'; '.join(parts)}. Use --common to compare on the scenes that both have."
    )


def _names(keys: Sequence[tuple[str, int]]) -> str:
    shown = ", ".join(f"{family}_{index:04d}" for family, index in keys[:NAMED])
    return shown + (", ..." if len(keys) > NAMED else "")


def _counterparts(
    run: Results, first: Results, baseline: str | None
) -> list[tuple[str, str]]:
    """Return each planner of a run with the one of the first run to compare it with."""
    if baseline is not None:
        return [(name, baseline) for name in run.planners]
    shared = [(name, name) for name in run.planners if name in first.planners]
    if not shared and len(run.planners) == len(first.planners) == 1:
        return [(next(iter(run.planners)), next(iter(first.planners)))]
    if not shared:
        raise RunError(
            f"{run.folder}: expected a planner of {first.folder} "
            f"({', '.join(first.planners)}) but it has {', '.join(run.planners)}. "
            "Use --baseline to compare with one of those."
        )
    return shared


def _arm(run: Results, name: str, label: str) -> Arm:
    if name not in run.planners:
        raise RunError(f"{run.folder}: {unknown('planner', name, run.planners)}")
    return Arm(f"{name}{label}", run.planners[name])


def _labels(runs: Sequence[Results]) -> list[str]:
    """Return what is added to planners' names to tell the runs apart."""
    if len(runs) == 1:
        return [""]
    names = [run.folder.resolve().name for run in runs]
    if len({*names}) < len(names):
        names = [str(run.folder) for run in runs]
    return [f" ({name})" for name in names]
