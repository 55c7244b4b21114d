"""`beacon-mj log recover`, `log layout` and `log info`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def recover(
    part: Path,
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(help="File to write; by default NAME.recovered.mcap beside it."),
    ] = None,
) -> None:
    """Write all whole steps of a log that broke off as a well-formed MCAP file.

    Parameters
    ----------
    part
        The unfinished log, such as x.mcap.part; it is left as it is.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark

    found = beacon_mj.recover_log(part, out)
    remark(f"{found.path}: {found.steps} whole steps")


def layout(
    *,
    out: Annotated[Path, Parameter(help="Folder to write to.")] = Path("."),
) -> None:
    """Write the layouts that show a log in Foxglove and in Lichtblick.

    In either viewer: open the log, then import the layout from its file.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark

    for path in beacon_mj.write_layouts(out):
        remark(str(path))


def info(log: Path, /) -> None:
    """Say in a few lines what a log holds.

    Parameters
    ----------
    log
        An MCAP file, finished or not.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import show

    show(beacon_mj.log_info(log))
