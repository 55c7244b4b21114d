"""`beacon-mj robots`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def robots(
    *,
    check: Annotated[
        Path | None,
        Parameter(
            help="A robot of your own: a line for each fault, and exit status 2 then."
        ),
    ] = None,
) -> int:
    """List the robots that `eval --robot` takes, or check a file of your own."""
    import beacon_mj
    from beacon_mj.cli import BAD_INPUT
    from beacon_mj.cli.views.console import remark, show

    if check is None:
        show(beacon_mj.list_robots())
        return 0
    found = beacon_mj.check_robot(check)
    if found.faults:
        remark(*(f"{check}: {fault}" for fault in found.faults))
        return BAD_INPUT
    show(found)
    return 0
