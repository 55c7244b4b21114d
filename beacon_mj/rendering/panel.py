"""A log in one 2-D drawing, after the paper's Fig. 1, as SVG.

Footprints before (dashed) and after (filled, colour by true class), the way travelled
over the band that the sensor swept, contacts as dots whose area grows with the force,
push attempts, and what broke. Coordinates are the arena's, in [m].
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.sax.saxutils import escape

import mujoco
import numpy as np

from beacon_mj.constants import CLASSES, CONTACT_N
from beacon_mj.episode.trace import Trace
from beacon_mj.errors import LogError, printable
from beacon_mj.files import replacing
from beacon_mj.geometry import Array
from beacon_mj.recording.reader import Log, log_of
from beacon_mj.recording.rebuild import rebuild_trace
from beacon_mj.rendering.annotations import shown_kind
from beacon_mj.scene import Obstacle, shapes
from beacon_mj.scene_gen.mjcf import scene_mjcf
from beacon_mj.world.outcome import ROBOT

PIXELS_PER_M = 100.0
MARGIN_M = 0.25
LEGEND_M = 0.45  #: Height of the legend below the arena.
MARKS = {"moved": "#1a7f37", "not_moved": "#c62828", "broken": "#4a0d5c"}


def plot_panel(log: Log | str | Path, out: str | Path) -> Path:
    """Write the drawing of a log as an SVG file, whole or not at all.

    Raises:
        LogError: If the log cannot be read, or `out` has another ending than `.svg`.
    """
    out = Path(out)
    if out.suffix.lower() != ".svg":
        raise LogError(f"{out}: expected a name that ends in .svg: it is a drawing.")
    text = panel_svg(log_of(log))
    with replacing(out) as part:
        part.write_text(text, encoding="utf-8")
    return out


def panel_svg(log: Log) -> str:
    """Return the drawing of a log as SVG text; equal logs give equal text."""
    trace = rebuild_trace(log)
    west, south, east, north = log.scene.workspace_m
    width = east - west + 2 * MARGIN_M
    height = north - south + 2 * MARGIN_M + LEGEND_M
    # SVG's y axis points down; the group turns it over.
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width * PIXELS_PER_M:.0f}" '
        f'height="{height * PIXELS_PER_M:.0f}" '
        f'viewBox="{west - MARGIN_M} {-north - MARGIN_M} {width} {height}" '
        'font-family="sans-serif" font-size="0.13">',
        '<rect x="-100" y="-100" width="300" height="300" fill="white"/>',
        '<g transform="scale(1,-1)">',
        *_ground(log),
        *_ways(trace),
        *_obstacles(log, trace),
        *_events(trace),
        "</g>",
        *_legend(log, trace),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _ground(log: Log) -> Iterator[str]:
    west, south, east, north = log.scene.workspace_m
    yield (
        f'<rect x="{west}" y="{south}" width="{east - west}" '
        f'height="{north - south}" fill="#fafafa" stroke="#444" '
        'stroke-width="0.04"/>'
    )
    for (x, y), colour in (
        (log.scene.start_m, "#3373cc"),
        (log.scene.goal_m, "#1aa64d"),
    ):
        radius = log.scene.robot.radius_m
        yield f'<circle cx="{x}" cy="{y}" r="{radius}" fill="{colour}" opacity="0.7"/>'


def _ways(trace: Trace) -> Iterator[str]:
    """Yield the band that the sensor swept and the way travelled."""
    west, south, east, north = trace.scene.workspace_m
    points = np.array([trace.start_m, *(s.outcome.position_m for s in trace.steps)])
    reach = trace.scene.robot.radius_m + trace.protocol.sensor(trace.scene).range_m
    way = f'points="{_points(points)}" fill="none" stroke-linejoin="round"'
    yield (
        f'<clipPath id="arena"><rect x="{west}" y="{south}" width="{east - west}" '
        f'height="{north - south}"/></clipPath>'
    )
    yield (
        f'<polyline {way} stroke="#1a73d9" stroke-width="{2 * reach:.4f}" '
        'stroke-linecap="round" opacity="0.08" clip-path="url(#arena)"/>'
    )
    yield f'<polyline {way} stroke="#14213d" stroke-width="0.025"/>'


def _obstacles(log: Log, trace: Trace) -> Iterator[str]:
    """Yield every footprint as it was, if it moved, and as it is."""
    broken = {d.obstacle for s in trace.steps for d in s.outcome.damages}
    broken |= {*trace.left.broken} if trace.left else set()
    moved = {d.obstacle for s in trace.steps for d in s.outcome.displacements}
    model = mujoco.MjModel.from_xml_string(scene_mjcf(log.scene))
    for obstacle in log.scene.obstacles:
        surface = log.scene.surfaces[CLASSES.index(obstacle.interaction)]
        colour = "#" + "".join(f"{round(255 * v):02x}" for v in surface.rgba[:3])
        if obstacle.id in moved:
            before = _points(_outline(log, model, obstacle, 0))
            yield (
                f'<polygon points="{before}" fill="none" stroke="{colour}" '
                'stroke-width="0.015" stroke-dasharray="0.05 0.04"/>'
            )
        after = _points(_outline(log, model, obstacle, log.steps))
        edge = MARKS["broken"] if obstacle.id in broken else "#222"
        thickness = 0.05 if obstacle.id in broken else 0.01
        yield (
            f'<polygon points="{after}" fill="{colour}" fill-opacity="0.85" '
            f'stroke="{edge}" stroke-width="{thickness}">'
            f"<title>{_text(obstacle.id)}: {obstacle.interaction}, "
            f"{obstacle.mass_kg:.2f} kg</title></polygon>"
        )
        if (kind := shown_kind(obstacle)) is not None:
            x, y = obstacle.x_m + 0.2, obstacle.y_m
            yield (
                f'<text x="{x:.2f}" y="{-y:.2f}" transform="scale(1,-1)" '
                f'fill="#14213d">{_text(kind)}</text>'
            )


def _outline(log: Log, model: mujoco.MjModel, obstacle: Obstacle, step: int) -> Array:
    """Return an obstacle's outline at one step, shape (k, 2) [m]."""
    if obstacle.fixed:
        return np.array(obstacle.footprint.polygon().exterior.coords)
    first = int(model.joint(obstacle.id).qposadr[0])
    pose = log.positions[step][first : first + 7]
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, pose[3:])
    turned = shapes.tilted_footprint(obstacle.shape, rotation.reshape(3, 3))
    return np.array(turned.moved(pose[0], pose[1], 0.0).polygon().exterior.coords)


def _events(trace: Trace) -> Iterator[str]:
    """Yield contacts of the robot, push attempts, and damage."""
    for step in trace.steps:
        for c in step.outcome.contacts:
            # A contact that ended within the step has no point at its end.
            lasting = c.counterpart == ROBOT and bool(c.force_n.any())
            if lasting and c.filtered_peak_n > CONTACT_N:
                radius = 0.006 * np.sqrt(c.filtered_peak_n)
                yield (
                    f'<circle cx="{c.point_m[0]:.4f}" cy="{c.point_m[1]:.4f}" '
                    f'r="{radius:.4f}" fill="#d32f2f" opacity="0.5"/>'
                )
    for step in trace.steps:
        x, y = step.outcome.position_m
        for attempt in step.outcome.attempts:
            yield (
                f'<circle cx="{x:.4f}" cy="{y:.4f}" r="0.09" fill="none" '
                f'stroke="{MARKS[attempt.evidence]}" stroke-width="0.03"/>'
            )


def _legend(log: Log, trace: Trace) -> Iterator[str]:
    """Yield title and legend, in SVG's own direction."""
    west, south, _, north = log.scene.workspace_m
    outcome = trace.outcome or "unfinished"
    title = f"{log.scene.name}, {log.planner}: {outcome}, {len(trace.steps)} steps"
    yield f'<text x="{west}" y="{-north - 0.09}">{_text(title)}</text>'
    y = -south + MARGIN_M + 0.05
    x = west
    for colour, text in _legend_entries(log):
        if text.startswith("push"):  # A ring, as in the drawing.
            yield (
                f'<circle cx="{x + 0.06:.2f}" cy="{y - 0.04:.2f}" r="0.05" '
                f'fill="none" stroke="{colour}" stroke-width="0.03"/>'
            )
        else:
            yield (
                f'<rect x="{x:.2f}" y="{y - 0.1:.2f}" width="0.12" height="0.12" '
                f'fill="{colour}"/>'
            )
        yield f'<text x="{x + 0.17:.2f}" y="{y:.2f}">{text}</text>'
        x += 0.3 + 0.072 * len(text)


def _legend_entries(log: Log) -> Iterator[tuple[str, str]]:
    for name, surface in zip(CLASSES, log.scene.surfaces, strict=True):
        yield "#" + "".join(f"{round(255 * v):02x}" for v in surface.rgba[:3]), name
    yield MARKS["moved"], "push: moved"
    yield MARKS["not_moved"], "push: not moved"
    yield MARKS["broken"], "broken"
    yield "#d32f2f", "contact"


def _text(text: str) -> str:
    """Return a text as XML can hold it."""
    return escape(printable(text))


def _points(points: Iterable[Array]) -> str:
    return " ".join(f"{x:.4f},{y:.4f}" for x, y in points)
