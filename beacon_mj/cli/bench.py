"""`beacon-mj bench`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def bench(
    *parts: str,
    json: Annotated[Path | None, Parameter(help="Also write the result here.")] = None,
    against: Annotated[
        Path | None, Parameter(help="Compare with such a file, written before.")
    ] = None,
) -> None:
    """Measure what episodes cost on this machine, and of what.

    Parameters
    ----------
    parts
        What to measure: episodes, generation, scale, start-up, search; all by
        default.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import redraw, show

    found = beacon_mj.bench(parts, save=json, against=against, tell=redraw)
    redraw("\n")
    show(found)
