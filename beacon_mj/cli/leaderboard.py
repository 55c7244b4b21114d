"""`beacon-mj leaderboard`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import FAILED, options


def leaderboard(
    *bundles: Annotated[Path, Parameter(help="Files of `beacon-mj bundle`.")],
    out: Annotated[Path, Parameter(help="Folder of the page, index.html.")],
    rerun: options.Rerun = False,
    fresh_seed: options.FreshSeed = None,
    scenes_per_family: options.FreshScenes = None,
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
