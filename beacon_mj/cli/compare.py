"""`beacon-mj compare`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import FAILED, options


def compare(
    runs: Annotated[tuple[Path, ...], Parameter(negative=())],
    /,
    *,
    baseline: Annotated[
        str | None,
        Parameter(
            help="Planner of the first run that all others are compared with. By "
            "default dstar-lite in one run; in several, each planner's own namesake."
        ),
    ] = None,
    common: Annotated[
        options.Flag,
        Parameter(help="Compare on the scenes that both have, instead of refusing."),
    ] = False,
    allow_differences: Annotated[
        options.Flag,
        Parameter(
            help="Compare runs of another protocol, or of other files of a planner or "
            "family of one name, instead of refusing."
        ),
    ] = False,
    fail_if: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            show_default=False,
            help="Status 1 if a difference is so, such as 'success < -0.02', "
            "'path_length_m.low > 0' or 'sparse/energy_j:all > 5'; repeatable.",
        ),
    ] = (),
    json: options.Json = False,
) -> int:
    """Compare planners or runs scene by scene: paired differences with intervals.

    Parameters
    ----------
    runs
        One run folder, whose planners are compared with each other; or several, the
        later ones compared with the first.
    """
    # Only now: help must not wait for numpy and scipy.
    import beacon_mj
    from beacon_mj.cli.views.console import remark, show, show_json

    found = beacon_mj.compare(
        *runs,
        baseline=baseline,
        common=common,
        allow_differences=allow_differences,
        fail_if=fail_if,
    )
    remark(*(f"note: {line}" for line in found.remarks))
    if json:
        show_json({"comparisons": [*found], "failed": found.violations})
    else:
        show(found)
    remark(*(f"failed: {line}" for line in found.violations))
    return FAILED if found.violations else 0
