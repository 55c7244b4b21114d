"""A strip of pictures that tells an episode: start, what changed, end."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image as Pillow

from beacon_mj.episode.trace import StepRecord, Trace
from beacon_mj.files import replacing
from beacon_mj.geometry import Array
from beacon_mj.recording.reader import Log, log_of
from beacon_mj.rendering.camera import ASPECT
from beacon_mj.rendering.captions import decision, events, summary
from beacon_mj.rendering.overlay import captions, legend
from beacon_mj.rendering.playback import Playback, legend_of

COLUMNS = 3
GAP_PIXELS = 8
#: How much a step counts in which something happens, of what its outcome holds.
_EVENTS = (("damages", 8.0), ("toppled", 4.0), ("attempts", 4.0))
_REFUTED = 6.0  #: How much more a push counts that moved nothing.
_DECIDED = 2.0  #: How much another action or target counts.
_BELIEVED = 4.0  #: How much it counts at most that beliefs change.
_NOTHING = 0.1  #: How much a step counts in which nothing changes.
_APART = 0.04  #: Least distance of two moments, as a share of the episode.


def render_strip(
    log: Log | str | Path,
    out: str | Path,
    *,
    frames: int = 6,
    width: int = 480,
    height: int | None = None,
) -> Path:
    """Write a PNG of the moments of a log at which most changes, with a legend.

    Args:
        log: A log, or the path of one, finished or not.
        out: The picture; written whole or not at all.
        frames: Number of moments, >= 2; fewer if the episode is shorter.
        width: Width of one picture in pixels.
        height: Height of one picture in pixels; by default what the room needs.

    Raises:
        LogError: If the log cannot be read.
        RenderError: If nothing can be drawn here.
    """
    log = log_of(log)
    height = _height(log, width) if height is None else height
    with Playback(log, width, height) as playback:
        trace = playback.trace
        steps = moments(trace, frames)
        pictures = [Pillow.fromarray(playback.picture(step)) for step in steps]
    texts = captions([caption(trace, step) for step in steps], width)
    sheet = _sheet(pictures, texts, summary(trace), log)
    with replacing(Path(out)) as part:
        sheet.save(part, format="PNG")
    return Path(out)


def _height(log: Log, width: int) -> int:
    """Return how high a picture must be to show the whole room, in pixels."""
    west, south, east, north = log.scene.workspace_m
    ratio = 1.15 * (north - south) / (east - west)
    return round(width / ASPECT * min(1.0, max(0.4, ratio)))


def _sheet(pictures: list[Any], texts: list[Any], title: str, log: Log) -> Any:
    """Return title, pictures with their captions, and legend on one sheet."""
    columns = min(COLUMNS, len(pictures))
    width, height = (side + GAP_PIXELS for side in pictures[0].size)
    height += texts[0].height
    (head,) = captions([title], columns * width)
    foot = legend(legend_of(log), columns * width)
    rows = -(-len(pictures) // columns)
    whole = head.height + rows * height + GAP_PIXELS + foot.height
    sheet = Pillow.new("RGB", (columns * width, whole), "white")
    sheet.paste(head, (0, 0))
    for k, (picture, text) in enumerate(zip(pictures, texts, strict=True)):
        x, y = k % columns * width, head.height + k // columns * height
        sheet.paste(picture, (x, y))
        sheet.paste(text, (x, y + picture.height))
    sheet.paste(foot, (0, whole - foot.height))
    return sheet


def moments(trace: Trace, frames: int) -> list[int]:
    """Return the steps to show, ascending; 0 is the start.

    Start and end are always shown. The others are chosen one by one: the step with
    the largest change times its distance to those already chosen.
    """
    last = len(trace.steps)
    chosen = sorted({0, last})
    steps, change = np.arange(last + 1), changes(trace)
    while len(chosen) < min(frames, last + 1):
        gap = np.abs(steps[:, None] - np.array(chosen)).min(axis=1)
        score = change * np.minimum(gap, 0.2 * last + 1.0)
        # Pictures of one moment only where there are more pictures than moments.
        score[gap < min(_APART * last, 0.5 * last / frames)] *= 1e-6
        chosen = sorted([*chosen, int(score.argmax())])
    return chosen


def changes(trace: Trace) -> Array:
    """Return how much is new after each step, and at the start, shape (steps + 1,).

    A moment shows the world after a step and the decision that it led to.
    """
    out = np.full(len(trace.steps) + 1, _NOTHING)
    for k, record in enumerate(trace.steps):
        out[k + 1] += _happened(record)
    for k, (before, now) in enumerate(pairwise(trace.steps), start=1):
        out[k] += _decided(before, now)
    return out


def _happened(record: StepRecord) -> float:
    """Return how much there is to see of what the world did."""
    outcome = record.outcome
    told = sum(weight for name, weight in _EVENTS if getattr(outcome, name))
    told += _REFUTED * any(a.evidence == "not_moved" for a in outcome.attempts)
    moved = sum(d.distance_m for d in outcome.displacements)
    return told + min(0.5, 10.0 * moved)


def _decided(before: StepRecord, now: StepRecord) -> float:
    """Return how much another decision is from the one before."""
    old, new = before.command.info, now.command.info
    other = (old.action, old.target) != (new.action, new.target)
    if new.beliefs is old.beliefs:
        return _DECIDED * other
    shifts = (
        0.5 * sum(abs(p - q) for p, q in zip(belief, old.beliefs[name], strict=True))
        for name, belief in new.beliefs.items()
        if name in old.beliefs
    )
    return _DECIDED * other + min(_BELIEVED, 2.0 * sum(shifts))


def caption(trace: Trace, step: int) -> str:
    """Return what is written below the picture of a moment."""
    record = trace.steps[step - 1] if step else None
    if record is None:
        return "t = 0.0 s, start"
    time = f"t = {record.outcome.time_s:.1f} s"
    if step == len(trace.steps):
        end = f"end: {trace.outcome or 'unfinished'}"
        return "; ".join([time, *events(record), end.replace("_", " ")])
    told = events(record) or [decision(trace.steps[step])]
    return "; ".join([time, *told])
