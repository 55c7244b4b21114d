"""Text over a picture: what the planner decided and what happened."""

from typing import Any

import numpy as np
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from beacon_mj.rendering.gl import Image
from beacon_mj.rendering.playback import Playback
from beacon_mj.trace import StepRecord, Trace

INK = (20, 24, 34)
LINES, LINE_PIXELS = 4, 24
BAND_PIXELS = (LINES + 1) * LINE_PIXELS  #: Height of the text below a picture.
EVENT_S = 1.0  #: How long an event stays in the picture [s].


def annotate(picture: Image, lines: list[str]) -> Image:
    """Return a picture with a band of text below it, `BAND_PIXELS` high."""
    height, width = picture.shape[:2]
    out = Pillow.new("RGB", (width, height + BAND_PIXELS), "white")
    out.paste(Pillow.fromarray(picture), (0, 0))
    draw = ImageDraw.Draw(out)
    font = ImageFont.load_default(0.72 * LINE_PIXELS)
    for k, line in enumerate(lines[:LINES]):
        place = LINE_PIXELS // 2, height + (k + 0.4) * LINE_PIXELS
        draw.text(place, line, font=font, fill=INK)
    return np.asarray(out)


def describe(playback: Playback, step: int) -> list[str]:
    """Return the lines about one step: title, decision, costs and force, events."""
    trace, record = playback.trace, playback.record(step)
    time_s = 0.0 if record is None else record.outcome.time_s
    title = f"{trace.scene.name}   {trace.planner}   t = {time_s:.1f} s"
    if step == playback.steps and trace.outcome is not None:
        title += f"   END: {trace.outcome}"
    if record is None:
        return [title]
    return [
        title,
        _decision(record),
        "   ".join([*_costs(record), *_force(record)]),
        "   ".join(recent_events(trace, step)),
    ]


def _decision(record: StepRecord) -> str:
    rationale = record.command.rationale
    target = "" if rationale.target is None else f" {rationale.target}"
    line = f"{rationale.action}{target}"
    if rationale.reason:
        line += f": {rationale.reason}"
    return line if len(line) <= 100 else line[:99] + "…"


def _costs(record: StepRecord) -> list[str]:
    rationale = record.command.rationale
    return [
        f"{name} = {value:.1f}"
        for name, value in (
            ("C_push", rationale.cost_push),
            ("C_detour", rationale.cost_detour),
        )
        if value is not None
    ]


def _force(record: StepRecord) -> list[str]:
    """Return the strongest contact of a step, in words."""
    strongest = max(
        record.outcome.contacts, key=lambda c: c.filtered_peak_n, default=None
    )
    if strongest is None or strongest.filtered_peak_n < 1.0:
        return []
    return [
        f"{strongest.counterpart} on {strongest.obstacle}: "
        f"{strongest.filtered_peak_n:.1f} N"
    ]


def recent_events(trace: Trace, step: int) -> list[str]:
    """Return what happened within the last second, in words."""
    lines: list[str] = []
    now = trace.steps[step - 1].outcome.time_s
    for record in trace.steps[:step][::-1]:
        if record.outcome.time_s < now - EVENT_S:
            break
        lines += events(record, trace)
    return lines[:3]


def events(record: StepRecord, trace: Trace) -> list[str]:
    """Return the pushes, breaks and topples of one step, in words."""
    outcome = record.outcome
    names = [o.id for o in trace.scene.obstacles]
    return [
        *(f"BROKE {d.obstacle} at {d.force_n:.1f} N" for d in outcome.damages),
        *(f"TOPPLED {name}" for name in outcome.toppled),
        *(
            f"push: {names[a.obstacle]} {a.evidence} at {a.force_n:.1f} N"
            for a in outcome.attempts
        ),
    ]


def captioned(picture: Image, caption: str, size_px: int = 16) -> Any:
    """Return a Pillow image of a picture with a caption below it."""
    height, width = picture.shape[:2]
    out = Pillow.new("RGB", (width, height + 2 * size_px), "white")
    out.paste(Pillow.fromarray(picture), (0, 0))
    draw = ImageDraw.Draw(out)
    font = ImageFont.load_default(size_px)
    draw.text((8, height + size_px // 3), caption, font=font, fill=INK)
    return out
