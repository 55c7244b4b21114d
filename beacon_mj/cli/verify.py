"""`beacon-mj verify`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import FAILED, options


def verify(
    path: Path | None = None,
    /,
    *,
    rerun: options.Rerun = False,
    fresh_seed: options.FreshSeed = None,
    scenes_per_family: options.FreshScenes = None,
    trust_code: options.TrustCode = False,
    published: Annotated[
        options.Flag,
        Parameter(
            help="Run episodes of the published tables again, and compare them; takes "
            "no path."
        ),
    ] = False,
    fraction: Annotated[
        float | None,
        Parameter(
            help="With --published: share of each table's scenes, up to 1 for all. By "
            "default each planner and each family has a turn."
        ),
    ] = None,
    workers: options.Workers = None,
) -> int:
    """Check what a log, a run, a bundle or the docs claim, by making it again.

    Status 1 if anything does not hold, with a line for each. Without other options no
    planner runs: scenes are generated again, logged commands simulated, tables made.

    Parameters
    ----------
    path
        A log, a folder of logs, a run folder, or a bundle of one.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import complain, say_prose
    from beacon_mj.cli.views.log_progress import show_logs
    from beacon_mj.errors import RunError

    if published:
        if path or rerun or trust_code or fresh_seed is not None or scenes_per_family:
            raise RunError(
                "--published: expected no path and no option but --fraction and "
                "--workers beside it."
            )
        return _published(fraction, workers)
    if path is None:
        raise RunError("verify: expected a path, or --published.")
    if fraction is not None:
        raise RunError("--fraction: expected it with --published only.")
    with show_logs() as on_log:
        found = beacon_mj.verify(
            path,
            workers=workers,
            rerun=rerun,
            fresh_seed=fresh_seed,
            scenes_per_family=scenes_per_family,
            trust_code=trust_code,
            on_log=on_log,
        )
    complain(found.level_problems)
    if found.ok or found.checks or path.is_dir():
        say_prose(str(found))
    return 0 if found.ok else FAILED


def _published(fraction: float | None, workers: int | None) -> int:
    """Run episodes of the published tables again; return the exit status."""
    import beacon_mj
    from beacon_mj.cli.views.console import complain, say_prose

    found = beacon_mj.verify_published(
        fraction=fraction, workers=workers, progress=beacon_mj.show_progress
    )
    complain(found.problems)
    say_prose(str(found))
    return 0 if found.ok else FAILED
