"""`beacon-mj verify`."""

from pathlib import Path

from beacon_mj.cli import FAILED, options


def verify(path: Path, /, *, workers: options.Workers = None) -> int:
    """Simulate episodes again: every state, result and row must be the same.

    Status 1 if a log does not prove its own numbers, or its row is not that of its run.

    Parameters
    ----------
    path
        A log, or a folder: all logs below it, such as those of a run.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import say
    from beacon_mj.cli.views.log_progress import show_logs

    with show_logs() as on_log:
        found = beacon_mj.verify(path, workers=workers, on_log=on_log)
    if found.ok or path.is_dir():
        say(str(found))
    return 0 if found.ok else FAILED
