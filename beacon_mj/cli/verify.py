"""`beacon-mj verify`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import FAILED, options


def verify(
    path: Path,
    /,
    *,
    rerun: Annotated[
        options.Flag,
        Parameter(help="Run the planners again too, and compare their commands."),
    ] = False,
    fresh_seed: Annotated[
        int | None,
        Parameter(
            converter=options.whole,
            validator=options.within("seed"),
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
    """Check what a log, a run folder or a bundle claims, by making it again.

    Status 1 if anything does not hold, with a line for each. Without other options no
    planner runs: scenes are generated again, logged commands simulated, tables made.

    Parameters
    ----------
    path
        A log, a folder of logs, a run folder, or a bundle of one.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import complain, say
    from beacon_mj.cli.views.log_progress import show_logs

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
        say(str(found))
    return 0 if found.ok else FAILED
