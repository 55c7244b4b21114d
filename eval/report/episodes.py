"""Episodes worth looking at, and their drawings from the logs."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from beacon_mj import rendering
from beacon_mj.errors import BeaconError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.log_files import log_file


class Panel(NamedTuple):
    """A 2-D drawing of an episode: what it shows, SVG text, or why there is none."""

    caption: str
    svg: str
    problem: str = ""


class Pick(NamedTuple):
    """An episode that was chosen, and why."""

    why: str
    row: Row
    log: Path


def log_of(run: Path, row: Row) -> Path:
    """Return where the log of an episode is, if there is one."""
    return log_file(run, row.planner, row.scene_name)


def picks(run: Path, rows: Sequence[Row]) -> list[Pick]:
    """Return a median path of each family, a failure, and a push, where logs are.

    Args:
        run: The run folder.
        rows: Rows of the planner that is shown.
    """
    logged = [(row, log) for row in rows if (log := log_of(run, row)).is_file()]
    return [
        Pick(why, row, log)
        for why, row in _chosen([row for row, _ in logged])
        for log in [log_of(run, row)]
    ]


def _chosen(rows: Sequence[Row]) -> Iterator[tuple[str, Row]]:
    for family in dict.fromkeys(row.family for row in rows):
        solved = [row for row in rows if row.family == family and row.success]
        if solved:
            ordered = sorted(solved, key=lambda r: (r.path_length_m, r.scene_index))
            yield "median path", ordered[(len(ordered) - 1) // 2]
    if (pushing := push_of(rows)) is not None:
        yield "most obstacles moved", pushing
    if failed := [row for row in rows if not row.success]:
        yield "a failure", failed[0]


def push_of(rows: Sequence[Row]) -> Row | None:
    """Return the clean success that moved most, or any success that moved something."""
    moving = [row for row in rows if row.success and row.obstacles_moved]
    if not moving:
        return None
    return max(
        moving,
        key=lambda r: (r.clean_success, r.obstacles_moved, r.pushes, -r.scene_index),
    )


def panel(pick: Pick) -> Panel:
    """Return the drawing of an episode."""
    row = pick.row
    caption = (
        f"{pick.why}: {row.planner} in {row.scene_name}, "
        f"{row.outcome.replace('_', ' ')}, {row.path_length_m:.2f} m, "
        f"{_times(row.pushes, 'push', 'pushes')}, {row.obstacles_broken} broken"
    )
    return _drawn(pick.log, rendering.plot_panel, "panel.svg", caption)


def replay(pick: Pick) -> Panel:
    """Return the 3-D replay of an episode as an HTML page, in place of an SVG."""
    caption = f"{pick.row.planner} in {pick.row.scene_name}"
    return _drawn(pick.log, rendering.render_page, "page.html", caption)


def reasons(rows: Sequence[Row], most: int = 8) -> list[tuple[str, str, int]]:
    """Return (planner, why an episode was no success, how often), the commonest."""
    why = Counter(
        (row.planner, f"{row.outcome.replace('_', ' ')}: {row.detail}".rstrip(": "))
        for row in rows
        if not row.success
    )
    return [(*key, n) for key, n in sorted(why.items(), key=lambda i: (-i[1], i[0]))][
        :most
    ]


def _drawn(
    log: Path, draw: Callable[[Path, Path], Path], name: str, caption: str
) -> Panel:
    with TemporaryDirectory() as folder:
        try:
            text = draw(log, Path(folder) / name).read_text(encoding="utf-8")
        except BeaconError as error:
            return Panel(caption, "", " ".join(str(error).split()))
    return Panel(caption, text)


def _times(n: int, one: str, many: str) -> str:
    return f"{n} {one if n == 1 else many}"
