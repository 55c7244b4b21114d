"""Comparing planners or runs, scene by scene."""

from collections.abc import Sequence

from beacon_mj.errors import RunError
from beacon_mj.eval.statistics.compare import Comparison, compare_pairs
from beacon_mj.eval.statistics.comparison_table import Comparisons
from beacon_mj.eval.statistics.conditions import differences
from beacon_mj.eval.statistics.pairing import comparisons, match
from beacon_mj.eval.statistics.regression_gates import parse_gate, violations
from beacon_mj.eval.statistics.results import Results, Source, results_of


def compare(
    *runs: Source,
    baseline: str | None = None,
    common: bool = False,
    allow_differences: bool = False,
    fail_if: Sequence[str] = (),
) -> Comparisons:
    """Compare planners or runs scene by scene: paired differences with intervals.

    The same as `beacon-mj compare`.

    Args:
        runs: Results or run folders. One, whose planners are compared with each other;
            or several, the later ones compared with the first.
        baseline: Planner of the first run that all others are compared with. By
            default dstar-lite in one run; in several, each planner's own namesake.
        common: Compare on the scenes that both have, instead of refusing.
        allow_differences: Compare runs that differ in their protocol, in the files of a
            family, or in the file of a planner of one name, instead of refusing; the
            remarks then say what differs.
        fail_if: Gates such as `success < -0.02`, `path_length_m.low > 0` or
            `sparse/energy_j:all > 5`; `violations` of the result lists those crossed.

    Raises:
        RunError: If a run, a gate or the baseline is no good, or scenes or what
            decides results differ.
    """
    gates = [parse_gate(text) for text in fail_if]
    found = [results_of(run) for run in runs]
    arms = comparisons(found, baseline)
    told = [line for run in found[1:] for line in differences(found[0], run)]
    if told and not allow_differences:
        raise RunError(f"{told[0]} Use --allow-differences to compare them anyway.")
    made = compare_pairs([match(a, b, common=common) for a, b in arms])
    remarks = [*told, *_remarks(found, made)]
    return Comparisons(made, remarks, violations(gates, made))


def _remarks(runs: Sequence[Results], found: Sequence[Comparison]) -> list[str]:
    """Return whether versions differ between the runs, and what was left out."""
    lines = []
    for run in runs[1:]:
        if run.config.versions != runs[0].config.versions:
            lines.append(f"{run.folder} was run with other versions: see config.json.")
    for c in found:
        if c.left_out:
            lines.append(
                f"{c.first} and {c.baseline}: {c.left_out} scenes that only one of "
                "them has were left out."
            )
    return lines
