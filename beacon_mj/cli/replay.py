"""`beacon-mj replay`."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import FAILED
from beacon_mj.errors import RunError


def replay(
    log: Path,
    /,
    *,
    video: Annotated[Path | None, Parameter(help="Write a video, such as out.mp4.")] = (
        None
    ),
    png: Annotated[Path | None, Parameter(help="Write a strip of pictures.")] = None,
    verify: Annotated[
        bool,
        Parameter(
            negative=(),
            show_default=False,
            help="Simulate the episode again; status 1 unless every state and the "
            "result are the same.",
        ),
    ] = False,
    metrics: Annotated[
        bool,
        Parameter(
            negative=(),
            show_default=False,
            help="Print the episode's row as JSON, from the log alone.",
        ),
    ] = False,
) -> int:
    """Look at an episode's log, verify it, or measure it.

    Parameters
    ----------
    log
        An MCAP file that an evaluation wrote.
    """
    if not (video or png or verify or metrics):
        raise RunError(
            f"{log}: expected what to do with it: --video FILE, --png FILE, --verify "
            "or --metrics."
        )
    if metrics:
        _print_row(log)
    if png is not None or video is not None:
        _draw(log, video, png)
    return _verify(log) if verify else 0


def _print_row(log: Path) -> None:
    import msgspec

    from beacon_mj.eval.metrics import measure
    from beacon_mj.recording import read_trace

    row = msgspec.json.encode(measure(read_trace(log)))
    print(msgspec.json.format(row).decode())


def _draw(log: Path, video: Path | None, png: Path | None) -> None:
    """Draw the episode; the backends need OpenGL and, for video, PyAV."""
    from beacon_mj.rendering import render_strip, render_video

    if png is not None:
        render_strip(log, png)
        print(png, file=sys.stderr)
    if video is not None:
        render_video(log, video)
        print(video, file=sys.stderr)


def _verify(log: Path) -> int:
    from beacon_mj.eval.metrics import measure
    from beacon_mj.recording.verify import verify

    found = verify(log, lambda trace: measure(trace).as_dict())
    if found.problem is not None:
        print(f"error: {' '.join(found.problem.split())}", file=sys.stderr)
        return FAILED
    print(f"{log}: verified, {found.steps} steps and the row are the same bit for bit")
    return 0
