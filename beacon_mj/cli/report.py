"""`beacon-mj report`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def report(
    run: Path,
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(help="The page; by default report.html in the run's folder."),
    ] = None,
    baseline: Annotated[
        str | None,
        Parameter(
            help="Planner that the others are compared with; by default dstar-lite, "
            "or the run's first."
        ),
    ] = None,
    replay: Annotated[
        bool, Parameter(help="Embed a 3-D replay (1 MB or more).")
    ] = True,
    tables: Annotated[
        Path | None,
        Parameter(
            help="Write the paper's tables with this run's numbers into the generated "
            "block of a Markdown file, such as docs/reproduction.md; no page then."
        ),
    ] = None,
) -> None:
    """Write a run as one self-contained page, which opens from disk.

    Parameters
    ----------
    run
        A run folder, finished or not.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark

    if tables is not None:
        remark(str(beacon_mj.fill_tables(run, tables)))
        return
    page = beacon_mj.write_report(
        run,
        out,
        baseline=baseline,
        replay=replay,
        tell=lambda what: remark(f"{what} ..."),
    )
    remark(f"report: {page}")
