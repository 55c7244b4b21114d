"""Verifying the published tables."""

from beacon_mj.errors import RunError
from beacon_mj.eval.api.verification import Verified
from beacon_mj.eval.runs.progress import Progress, quiet
from beacon_mj.eval.runs.worker_process import usable_cores
from beacon_mj.eval.verification.published import check_published
from beacon_mj.eval.verification.records import RECORDS


def verify_published(
    *,
    fraction: float | None = None,
    workers: int | None = None,
    progress: Progress = quiet,
) -> Verified:
    """Run episodes of the published tables again, and compare their rows.

    The same as `beacon-mj verify --published`. One check a table says what came of it.

    Args:
        fraction: Share of each table's scenes that every planner crosses again, above 0
            and at most 1, for everything; by default so few that each planner and
            each family had a turn.
        workers: Processes; by default one per usable core.
        progress: Shows what is done, such as `beacon_mj.show_progress`.

    Raises:
        BeaconError: If there is no published table, or the fraction is no good.
    """
    if fraction is not None and not 0.0 < fraction <= 1.0:
        raise RunError(
            f"--fraction: expected more than 0 and at most 1 but it was {fraction:g}."
        )
    checks = check_published(
        RECORDS,
        fraction=fraction,
        workers=workers or usable_cores(),
        progress=progress,
    )
    return Verified(path=RECORDS, logs=(), remarks=(), checks=tuple(checks))
