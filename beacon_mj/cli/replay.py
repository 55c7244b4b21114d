"""`beacon-mj replay`."""

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
) -> None:
    """Look at an episode's log, or measure it; several at once.

    Parameters
    ----------
    log
        An MCAP file that an evaluation wrote, finished or not.
    """
    if not (video or png or html or view or metrics):
        raise RunError(
            f"{log}: expected what to do with it: --video FILE, --png FILE, --html "
            "FILE, --view or --metrics."
        )
    import beacon_mj
    from beacon_mj.cli.views.console import remark, show, show_json

    if metrics:
        found = beacon_mj.measure_log(log)
        if json:
            show_json(found.row)
        else:
            show(found)
    for path in beacon_mj.replay(log, video=video, png=png, html=html, view=view):
        remark(str(path))
