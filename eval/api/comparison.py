"""Comparing planners or runs, scene by scene."""

from collections.abc import Sequence

from beacon_mj.eval.statistics.compare import Comparison, compare_pairs
from beacon_mj.eval.statistics.comparison_table import Comparisons
from beacon_mj.eval.statistics.pairing import comparisons, match
from beacon_mj.eval.statistics.regression_gates import parse_gate, violations
from beacon_mj.eval.statistics.results import Results, Source, results_of


def compare(
    *runs: Source,
    baseline: str | None = None,
    common: bool = False,
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
        fail_if: Gates such as `success < -0.02`, `path_length_m.low > 0` or
            `sparse/energy_j:all > 5`; `violations` of the result lists those crossed.

    Raises:
        RunError: If a run, a gate or the baseline is no good, or scenes differ.
    """
    gates = [parse_gate(text) for text in fail_if]
    found = [results_of(run) for run in runs]
    arms = comparisons(found, baseline)
    made = compare_pairs([match(a, b, common=common) for a, b in arms])
    return Comparisons(made, _remarks(found, made), violations(gates, made))


def _remarks(runs: Sequence[Results], found: Sequence[Comparison]) -> list[str]:
    """Return what else differs between the runs, and what was left out."""
    lines = []
    for run in runs[1:]:
        for name in ("protocol", "versions"):
            if getattr(run.config, name) != getattr(runs[0].config, name):
                lines.append(
                    f"{run.folder} was run with other {name}: see config.json."
                )
    for c in found:
        if c.left_out:
            lines.append(
                f"{c.first} and {c.baseline}: {c.left_out} scenes that only one of "
                "them has were left out."
            )
    return lines
