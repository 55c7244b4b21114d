"""Writing a run as a page, or its numbers into a Markdown file."""

from collections.abc import Callable
from pathlib import Path

from beacon_mj.errors import RunError
from beacon_mj.eval.statistics.results import Source, results_of
from beacon_mj.files import replacing


def write_report(
    run: Source,
    out: str | Path | None = None,
    *,
    baseline: str | None = None,
    replay: bool = True,
    tell: Callable[[str], None] = lambda _: None,
) -> Path:
    """Write a run as one self-contained HTML page; return its path.

    The same as `beacon-mj report`.

    Args:
        run: Results or a run folder, finished or not.
        out: The page; by default report.html in the run's folder.
        baseline: Planner that the others are compared with; by default dstar-lite, or
            the run's first.
        replay: Whether to embed a 3-D replay (1 MB or more).
        tell: Called with what is done next.

    Raises:
        RunError: If the run is no good, has no planner of the baseline's name, or the
            extra `report` is not installed.
    """
    results = results_of(run)
    try:
        from beacon_mj.eval.report.page import render_report
    except ModuleNotFoundError as error:
        raise RunError(
            f"report: expected package {error.name!r} but it is not installed: "
            "pip install 'beacon-mj[report]'."
        ) from error
    page = render_report(results, baseline, with_replay=replay, tell=tell)
    target = results.folder / "report.html" if out is None else Path(out)
    with replacing(target) as part:
        part.write_text(page, encoding="utf-8")
    return target


def fill_tables(run: Source, page: str | Path) -> Path:
    """Write the paper's tables with a run's numbers into a Markdown file.

    The same as `beacon-mj report RUN --tables FILE`.

    Args:
        run: Results or a run folder.
        page: A file with a generated block, such as docs/reproduction.md.

    Raises:
        RunError: If the file has no such block, or cannot be read.
    """
    from beacon_mj.eval.report.reproduction import fill

    fill(Path(page), results_of(run))
    return Path(page)
