"""`beacon-mj replay`."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import options
from beacon_mj.errors import RunError


def replay(
    log: Path,
    /,
    *,
    video: Annotated[Path | None, Parameter(help="Write a video, such as out.mp4.")] = (
        None
    ),
    png: Annotated[Path | None, Parameter(help="Write a strip of pictures.")] = None,
    html: Annotated[
        Path | None, Parameter(help="Write a 3-D replay as one page, such as out.html.")
    ] = None,
    view: Annotated[
        options.Flag,
        Parameter(
            help="Open MuJoCo's viewer on it: space pauses, arrows go step by step.",
        ),
    ] = False,
    verify: Annotated[
        options.Flag,
        Parameter(
            help="Simulate the episode again; status 1 unless every state, the result "
            "and the row of its run are the same.",
        ),
    ] = False,
    metrics: Annotated[
        options.Flag,
        Parameter(
            help="Print the episode's row, from the log alone.",
        ),
    ] = False,
    json: Annotated[
        options.Flag,
        Parameter(help="With --metrics, the row as JSON."),
    ] = False,
    workers: Annotated[
        options.Workers,
        Parameter(help="Processes that verify a folder; one per core by default."),
    ] = None,
) -> int:
    """Look at an episode's log, verify it, or measure it.

    Parameters
    ----------
    log
        An MCAP file that an evaluation wrote. With --verify also a folder: all logs
        below it.
    """
    if not (video or png or html or view or verify or metrics):
        raise RunError(
            f"{log}: expected what to do with it: --video FILE, --png FILE, --html "
            "FILE, --view, --verify or --metrics."
        )
    if log.is_dir() and (video or png or html or view or metrics):
        raise RunError(f"{log}: expected a log but it is a folder; only --verify can.")
    if metrics:
        _print_row(log, json=json)
    _draw(log, video, png, html)
    if view:
        from beacon_mj.rendering import view_log

        view_log(log)
    if not verify:
        return 0
    from beacon_mj.cli.verification import verify_path

    return verify_path(log, workers)


def _print_row(log: Path, *, json: bool) -> None:
    import msgspec

    from beacon_mj.eval.metrics.measure import measure
    from beacon_mj.recording import read_trace

    row = measure(read_trace(log))
    if json:
        print(msgspec.json.format(msgspec.json.encode(row)).decode())
        return
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from beacon_mj.cli.tables import console
    from beacon_mj.constants import WALL_CLOCK_COLUMNS

    table = Table("column", box=SIMPLE_HEAD, show_edge=False, padding=0)
    table.add_column("value", overflow="fold")
    for name, value in row.as_dict().items():
        if name not in WALL_CLOCK_COLUMNS:
            table.add_row(name, _text(value))
    console().print(table)


def _text(value: object) -> str:
    """Return a cell; six digits of a float are enough to read."""
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _draw(log: Path, video: Path | None, png: Path | None, html: Path | None) -> None:
    """Draw the episode; the backends need OpenGL and, for video, PyAV."""
    from beacon_mj import rendering

    for out, draw in (
        (png, rendering.render_strip),
        (video, rendering.render_video),
        (html, rendering.render_page),
    ):
        if out is not None:
            draw(log, out)
            print(out, file=sys.stderr)
