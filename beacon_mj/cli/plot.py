"""`beacon-mj plot`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def plot(
    log: Path,
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(help="SVG file to write; by default the log's name with .svg, here."),
    ] = None,
) -> None:
    """Draw an episode in one 2-D picture: footprints, way, contacts, pushes.

    Parameters
    ----------
    log
        An MCAP file, finished or not.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark

    stem = log.name.removesuffix(".part").removesuffix(".mcap")
    remark(str(beacon_mj.plot_panel(log, out or Path(f"{stem}.svg"))))
