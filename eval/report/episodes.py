"""Episodes worth looking at, and their drawings from the logs."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
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


def logged(run: Path, rows: Sequence[Row]) -> list[Row]:
    """Return the rows whose episodes left a log, in order."""
    return [row for row in rows if log_of(run, row).is_file()]


def failures(run: Path, planners: Mapping[str, Sequence[Row]]) -> list[Pick]:
    """Return the first logged failure of each planner that has one.

    Args:
        run: The run folder.
        planners: The rows of each planner.
    """
    firsts = (
        next((row for row in logged(run, rows) if not row.success), None)
        for rows in planners.values()
    )
    return [Pick("a failure", r, log_of(run, r)) for r in firsts if r is not None]


def picks(run: Path, rows: Sequence[Row], *, by_family: bool) -> list[Pick]:
    """Return a planner's successes worth looking at, no episode twice.

    A median is drawn only where every episode left a log: of a part of them it would be
    the median of what was kept, such as the failures.

    Args:
        run: The run folder.
        rows: Rows of the planner.
        by_family: Whether each family has a median path, or all have one together.
    """
    found = logged(run, rows)
    why: dict[tuple[str, str, int], list[str]] = {}
    by_key = {row.key: row for row in found}
    if len(found) == len(rows):
        for row in _medians(found, by_family=by_family):
            why.setdefault(row.key, []).append("median path")
    if (pushing := push_of(found)) is not None:
        why.setdefault(pushing.key, []).append("most obstacles moved")
    return [
        Pick(" and ".join(reasons), by_key[key], log_of(run, by_key[key]))
        for key, reasons in why.items()
    ]


def _medians(rows: Sequence[Row], *, by_family: bool) -> Iterator[Row]:
    """Yield the success of the median path length, of each family or of all."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        if row.success:
            groups.setdefault(row.family if by_family else "", []).append(row)
    for own in groups.values():
        own.sort(key=lambda r: (r.path_length_m, r.scene_index))
        yield own[(len(own) - 1) // 2]


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


def reasons(
    planners: Mapping[str, Sequence[Row]], most: int = 3
) -> list[tuple[str, str, int]]:
    """Return (planner, why an episode was no success, how often) of every planner.

    Args:
        planners: The rows of each planner.
        most: How many reasons of one planner, the commonest first.
    """
    return [
        (name, why, n)
        for name, rows in planners.items()
        for why, n in sorted(_why(rows).items(), key=lambda i: (-i[1], i[0]))[:most]
    ]


def _why(rows: Sequence[Row]) -> Counter[str]:
    return Counter(
        f"{row.outcome.replace('_', ' ')}: {row.detail}".rstrip(": ")
        for row in rows
        if not row.success
    )


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
