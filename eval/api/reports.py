"""Writing a run as a page, or its numbers into a Markdown file."""

from collections.abc import Callable
from pathlib import Path

from beacon_mj.errors import BeaconError
from beacon_mj.eval.runs.run_folder import REPORT
from beacon_mj.eval.statistics.results import Results, Source, results_of
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
        replay: Whether to embed a 3-D replay (1 MB or more), where the extra `web` is
            installed.
        tell: Called with what is done next.

    Raises:
        RunError: If the run is no good, or has no planner of the baseline's name.
    """
    results = results_of(run)
    # Only now: matplotlib takes half a second to import.
    from beacon_mj.eval.report.page import render_report

    page = render_report(results, baseline, with_replay=replay, tell=tell)
    target = results.folder / REPORT if out is None else Path(out)
    with replacing(target) as part:
        part.write_text(page, encoding="utf-8")
    return target


def closing_report(
    run: Results, tell: Callable[[str], None] = lambda _: None
) -> Path | None:
    """Write the page that ends an evaluation; return its path, or None without one.

    A shard has none: the page of the whole run comes with `merge`. The run is finished
    and on disk by now, so whatever keeps the page from being written is told only.

    Args:
        run: The finished run.
        tell: Called with a line if the page could not be written.

    Raises:
        KeyboardInterrupt: With a note that says how to write the page.
    """
    if run.config.shard is not None:
        return None
    try:
        return write_report(run)
    except (BeaconError, OSError) as error:
        tell(f"no {REPORT}: {error}")
        return None
    except KeyboardInterrupt as stop:
        stop.add_note(
            f"interrupted: the run in {run.folder} is finished but its page is not "
            f"written; write it with: beacon-mj report {run.folder}"
        )
        raise


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
