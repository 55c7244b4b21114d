"""`beacon-mj report`."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.errors import RunError


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
    from beacon_mj.eval.statistics.pairing import load_run

    loaded = load_run(run)
    if tables is not None:
        from beacon_mj.eval.report.reproduction import fill

        fill(tables, loaded)
        print(tables, file=sys.stderr)
        return
    from beacon_mj.rendering.files import replacing

    page = _page()(
        loaded,
        baseline,
        with_replay=replay,
        tell=lambda what: print(f"{what} ...", file=sys.stderr, flush=True),
    )
    target = out or run / "report.html"
    with replacing(target) as part:
        part.write_text(page, encoding="utf-8")
    print(f"report: {target}", file=sys.stderr)


def _page() -> Callable[..., str]:
    """Return what renders the page; it needs the extra `report`."""
    try:
        from beacon_mj.eval.report.page import render_report
    except ModuleNotFoundError as error:
        raise RunError(
            f"report: expected package {error.name!r} but it is not installed: "
            "pip install 'beacon-mj[report]'."
        ) from error
    return render_report
