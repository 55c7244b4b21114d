"""A strip of pictures that tells an episode: start, pushes, damage, end."""

from pathlib import Path

import numpy as np
from PIL import Image as Pillow

from beacon_mj.episode.trace import Trace
from beacon_mj.files import replacing
from beacon_mj.recording.reader import Log, log_of
from beacon_mj.rendering.captions import events
from beacon_mj.rendering.overlay import captioned
from beacon_mj.rendering.playback import Playback

COLUMNS = 3
GAP_PIXELS = 8
_WEIGHTS = (("damages", 8.0), ("toppled", 4.0), ("attempts", 2.0))


def render_strip(
    log: Log | str | Path,
    out: str | Path,
    *,
    frames: int = 6,
    width: int = 600,
    height: int = 520,
) -> Path:
    """Write a PNG of a few moments of a log, those of pushes and damage first.

    Args:
        log: A log, or the path of one, finished or not.
        out: The picture; written whole or not at all.
        frames: Number of moments, >= 2; fewer if the episode is shorter.
        width: Width of one picture in pixels.
        height: Height of one picture in pixels.

    Raises:
        LogError: If the log cannot be read.
        RenderError: If nothing can be drawn here.
    """
    log = log_of(log)
    with Playback(log, width, height) as playback:
        cells = [
            captioned(playback.picture(step), _caption(playback, step))
            for step in moments(playback.trace, frames)
        ]
    rows = -(-len(cells) // COLUMNS)
    cell_width, cell_height = (side + GAP_PIXELS for side in cells[0].size)
    columns = min(COLUMNS, len(cells))
    sheet = Pillow.new("RGB", (columns * cell_width, rows * cell_height), "white")
    for k, cell in enumerate(cells):
        place = k % COLUMNS * cell_width, k // COLUMNS * cell_height
        sheet.paste(cell, place)
    with replacing(Path(out)) as part:
        sheet.save(part, format="PNG")
    return Path(out)


def moments(trace: Trace, frames: int) -> list[int]:
    """Return the steps to show, ascending; 0 is the start.

    Start and end are always shown. The others are chosen one by one: the step with
    the largest weight of events times its distance to those already chosen.
    """
    last = len(trace.steps)
    chosen = sorted({0, last})
    weight = np.array([1.0, *(_weight(trace, k) for k in range(last))])
    while len(chosen) < min(frames, last + 1):
        steps = np.arange(last + 1)
        gap = np.abs(steps[:, None] - np.array(chosen)).min(axis=1)
        score = weight * np.minimum(gap, 0.2 * last + 1.0)
        chosen = sorted([*chosen, int(score.argmax())])
    return chosen


def _weight(trace: Trace, k: int) -> float:
    """Return how much there is to see in a step."""
    outcome = trace.steps[k].outcome
    told = sum(w for name, w in _WEIGHTS if getattr(outcome, name))
    moved = sum(d.distance_m for d in outcome.displacements)
    return 1.0 + told + min(1.0, 20.0 * moved)


def _caption(playback: Playback, step: int) -> str:
    record = playback.record(step)
    if record is None:
        return f"{playback.trace.scene.name}, {playback.trace.planner}: start"
    parts = [f"t = {record.outcome.time_s:.1f} s", *events(record)]
    if step == playback.steps:
        parts.append(f"end: {playback.trace.outcome}")
    elif len(parts) == 1:
        parts.append(record.command.info.action)
    return "   ".join(parts)
