"""`beacon-mj log recover`, `log layout` and `log info`."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

if TYPE_CHECKING:
    from beacon_mj.recording import Log


def recover(
    part: Path,
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(help="File to write; by default NAME.recovered.mcap beside it."),
    ] = None,
) -> None:
    """Write all whole steps of a log that broke off as a well-formed MCAP file.

    Parameters
    ----------
    part
        The unfinished log, such as x.mcap.part; it is left as it is.
    """
    from beacon_mj.recording import recover as copy

    stem = part.name.removesuffix(".part").removesuffix(".mcap")
    target = out or part.with_name(f"{stem}.recovered.mcap")
    steps = copy(part, target)
    print(f"{target}: {steps} whole steps", file=sys.stderr)


def layout(
    *,
    out: Annotated[Path, Parameter(help="Folder to write to.")] = Path("."),
) -> None:
    """Write the layouts that show a log in Foxglove and in Lichtblick.

    In either viewer: open the log, then import the layout from its file.
    """
    from beacon_mj.recording.layouts import write_layouts

    for path in write_layouts(out):
        print(path, file=sys.stderr)


def info(log: Path, /) -> None:
    """Say in a few lines what a log holds.

    Parameters
    ----------
    log
        An MCAP file, finished or not.
    """
    from beacon_mj.recording import read_log

    for name, text in _facts(read_log(log)):
        print(f"{name:12} {text}")


def _facts(log: "Log") -> Iterator[tuple[str, str]]:
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
    yield "machine", ", ".join(f"{k} {v}" for k, v in log.machine.items()) or "unknown"
