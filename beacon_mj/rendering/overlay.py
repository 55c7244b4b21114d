"""Text over a picture: what the planner decided and what happened."""

from typing import Any

import numpy as np
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from beacon_mj.rendering.gl import Image
from beacon_mj.rendering.playback import Playback
from beacon_mj.trace import StepRecord, Trace

INK, PAPER = (20, 24, 34, 255), (255, 255, 255, 215)
EVENT_S = 1.0  #: How long an event stays in the picture [s].


def annotate(picture: Image, lines: list[str], size_px: int = 17) -> Image:
    """Return a picture with lines of text on a panel at its top left."""
    if not lines:
        return picture
    base = Pillow.fromarray(picture).convert("RGBA")
    layer = Pillow.new("RGBA", base.size, (0, 0, 0, 0))
    draw = ImageDraw.Draw(layer)
    font = ImageFont.load_default(size_px)
    text = "\n".join(lines)
    margin = size_px // 2
    box = draw.multiline_textbbox((2 * margin, 2 * margin), text, font=font)
    panel = box[0] - margin, box[1] - margin, box[2] + margin, box[3] + margin
    draw.rounded_rectangle(panel, radius=margin, fill=PAPER)
    draw.multiline_text((2 * margin, 2 * margin), text, font=font, fill=INK)
    return np.asarray(Pillow.alpha_composite(base, layer).convert("RGB"))


def describe(playback: Playback, step: int) -> list[str]:
    """Return the lines about one step: title, decision, costs, forces, events."""
    trace, record = playback.trace, playback.record(step)
    time_s = 0.0 if record is None else record.outcome.time_s
    lines = [f"{trace.scene.name}   {trace.planner}   t = {time_s:.1f} s"]
    if record is not None:
        lines += _decision(record)
        lines += _forces(record)
        lines += recent_events(trace, step)
    if step == playback.steps and trace.outcome is not None:
        lines.append(f"END: {trace.outcome}")
    return lines


def _decision(record: StepRecord) -> list[str]:
    rationale = record.command.rationale
    target = "" if rationale.target is None else f" {rationale.target}"
    line = f"{rationale.action}{target}"
    if rationale.reason:
        line += f": {rationale.reason}"
    lines = [_shortened(line)]
    costs = [
        f"{name} = {value:.1f}"
        for name, value in (
            ("C_push", rationale.cost_push),
            ("C_detour", rationale.cost_detour),
        )
        if value is not None
    ]
    return lines + (["   ".join(costs)] if costs else [])


def _forces(record: StepRecord) -> list[str]:
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
    return lines[:4]


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


def _shortened(line: str, length: int = 90) -> str:
    return line if len(line) <= length else line[: length - 1] + "…"


def captioned(picture: Image, caption: str, size_px: int = 16) -> Any:
    """Return a Pillow image of a picture with a caption below it."""
    height, width = picture.shape[:2]
    out = Pillow.new("RGB", (width, height + 2 * size_px), "white")
    out.paste(Pillow.fromarray(picture), (0, 0))
    draw = ImageDraw.Draw(out)
    font = ImageFont.load_default(size_px)
    draw.text((8, height + size_px // 3), caption, font=font, fill=INK)
    return out
