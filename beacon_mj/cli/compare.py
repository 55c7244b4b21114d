"""`beacon-mj compare`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import options


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
    from beacon_mj.cli.comparison import run_comparison

    return run_comparison(runs, baseline, fail_if, common=common, json=json)
