"""`beacon-mj leaderboard`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from beacon_mj.cli import FAILED, options


def leaderboard(
    *bundles: Annotated[Path, Parameter(help="Files of `beacon-mj bundle`.")],
    out: Annotated[Path, Parameter(help="Folder of the page, index.html.")],
    rerun: Annotated[
        options.Flag, Parameter(help="Run the planners again too; see `verify`.")
    ] = False,
    fresh_seed: Annotated[
        int | None,
        Parameter(
            converter=options.whole,
            validator=Number(gte=0, lte=2**53),
            help="Also run the planners on unseen scenes of this seed.",
        ),
    ] = None,
    scenes_per_family: Annotated[
        options.ScenesPerFamily | None,
        Parameter(help="Fresh scenes per family; as many as the run has if unsaid."),
    ] = None,
    trust_code: options.TrustCode = False,
    workers: options.Workers = None,
) -> int:
    """Verify bundles, and write a static page of those that hold.

    Those that do not are named on it. Status 1 if there is one.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import complain, remark

    found = beacon_mj.leaderboard(
        bundles,
        out,
        rerun=rerun,
        fresh_seed=fresh_seed,
        scenes_per_family=scenes_per_family,
        trust_code=trust_code,
        workers=workers,
        tell=lambda name: remark(f"{name} ..."),
    )
    complain(found.problems)
    remark(f"leaderboard: {found.path}")
    return 0 if found.ok else FAILED
