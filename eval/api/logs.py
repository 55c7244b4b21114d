"""What can be done with one log: look at it, measure it, convert it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from beacon_mj import rendering
from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.errors import BeaconError, LogError, describe
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.extras import missing
from beacon_mj.recording import Log, log_of, rebuild_trace
from beacon_mj.recording import recover as copy_whole_steps
from beacon_mj.rendering import LogSource
from beacon_mj.rendering.tables import Tabular, add_line, plain_table


def replay(
    log: LogSource,
    *,
    video: str | Path | None = None,
    png: str | Path | None = None,
    html: str | Path | None = None,
    view: bool = False,
) -> list[Path]:
    """Show a logged episode: as a video, a strip of pictures, a page, in a window.

    The same as `beacon-mj replay`. Any number of them at once.

    Args:
        log: A log, or the path of one, finished or not.
        video: MP4 file to write; needs the extra `video`.
        png: PNG file to write with some moments.
        html: Page with a 3-D replay to write; needs the extra `web`.
        view: Whether to open MuJoCo's viewer; it returns when that is closed.

    Returns:
        The files that were written.

    Raises:
        LogError: If the log cannot be read.
        BeaconError: If something cannot be drawn here; nothing is half-written.
    """
    found = _file(log)
    written = []
    if png is not None:
        written.append(rendering.render_strip(found, png))
    if video is not None:
        written.append(rendering.render_video(found, video))
    if html is not None:
        written.append(rendering.render_page(found, html))
    if view:
        rendering.view_log(found)
    return written


class Measured(Tabular):
    """An episode's row, computed from its log alone.

    Attributes:
        row: The row.
    """

    def __init__(self, row: Row) -> None:
        """Hold a row; see `measure_log`, which computes it."""
        self.row = row

    def tables(self) -> Sequence[Table | str]:
        """Return a line a column, but for those of the wall clock."""
        table = plain_table()
        table.add_column("column")
        table.add_column("value", overflow="fold")
        for name, value in self.row.as_dict().items():
            if name not in WALL_CLOCK_COLUMNS:
                add_line(table, name, _text(value))
        return [table]


def measure_log(log: LogSource) -> Measured:
    """Return an episode's row from its log alone.

    The same as `beacon-mj replay LOG --metrics`.

    Args:
        log: A log, or the path of one, finished or not.

    Raises:
        LogError: If the log cannot be read, or its numbers are those of no episode.
    """
    found = _file(log)
    try:
        return Measured(measure(rebuild_trace(found)))
    except (ArithmeticError, LookupError, ValueError) as error:
        raise LogError(
            f"{found.path}: expected the numbers of an episode but they cannot be "
            f"measured: {describe(error)}."
        ) from error


def export_ros2(log: str | Path, out: str | Path) -> int:
    """Write an episode as a ROS 2 bag; return the number of messages.

    The same as `beacon-mj export LOG --ros2 DIR`.

    Args:
        log: The log, finished or not.
        out: Folder of the rosbag2; it must not exist.

    Raises:
        LogError: If the log cannot be read.
        BeaconError: If the extra `ros2` is not installed.
    """
    try:
        from beacon_mj.recording.ros2 import export_ros2 as export
    except ModuleNotFoundError as error:
        raise BeaconError(f"--ros2: {missing(error, 'ros2')}") from error
    return export(Path(log), Path(out))


@dataclass(frozen=True, kw_only=True, slots=True)
class Recovered:
    """A whole file that was made of an unfinished log, and its control steps."""

    path: Path
    steps: int


def recover_log(part: str | Path, out: str | Path | None = None) -> Recovered:
    """Write all whole steps of a log that broke off as a well-formed MCAP file.

    The same as `beacon-mj log recover`.

    Args:
        part: The unfinished log, such as x.mcap.part; it is left as it is.
        out: File to write; by default NAME.recovered.mcap beside it.

    Raises:
        LogError: If the log cannot be read, or the file exists.
    """
    part = Path(part)
    stem = part.name.removesuffix(".part").removesuffix(".mcap")
    target = part.with_name(f"{stem}.recovered.mcap") if out is None else Path(out)
    return Recovered(path=target, steps=copy_whole_steps(part, target))


class LogInfo(Tabular):
    """What a log holds, in a few lines.

    Attributes:
        facts: Text by name.
    """

    def __init__(self, facts: dict[str, str]) -> None:
        """Hold facts; see `log_info`, which reads them."""
        self.facts = facts

    def tables(self) -> Sequence[Table | str]:
        """Return a line a fact."""
        return ["\n".join(f"{name:12} {text}" for name, text in self.facts.items())]


def log_info(log: LogSource) -> LogInfo:
    """Say in a few lines what a log holds. The same as `beacon-mj log info`.

    Args:
        log: A log, or the path of one, finished or not.

    Raises:
        LogError: If the log cannot be read.
    """
    return LogInfo(dict(_facts(_file(log))))


def _file(log: LogSource) -> Log:
    if not isinstance(log, Log) and Path(log).is_dir():
        raise LogError(
            f"{log}: expected a log but it is a folder; only `verify` takes one."
        )
    return log_of(log)


def _text(value: object) -> str:
    """Return a cell; six digits of a float are enough to read."""
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _facts(log: Log) -> Iterator[tuple[str, str]]:
    """Yield name and text of each line."""
    scene, result = log.scene, log.result
    seconds = log.steps * scene.robot.control_period_s
    seed = log.config.get("planner_seed", "unknown")
    yield "planner", f"{log.planner}, seed {seed}"
    yield "scene", f"{scene.name}, {len(scene.obstacles)} obstacles, {scene.perception}"
    outcome = f"{result.get('outcome')} {result.get('detail', '')}".strip()
    yield "outcome", outcome if log.finished else "unfinished: it broke off"
    yield "steps", f"{log.steps}, {seconds:.1f} s of simulation"
    count = {name: len(found) for name, found in log.messages.items()}
    yield "events", f"{count['/push']} pushes ended, {count['/damage']} broken"
    yield "size", f"{log.path.stat().st_size / 1000:.0f} kB"
    yield "messages", ", ".join(f"{name} {n}" for name, n in count.items())
    yield "versions", ", ".join(f"{k} {v}" for k, v in sorted(log.versions.items()))
