"""A log in one 2-D drawing, after the paper's Fig. 1, as SVG.

Footprints before (dashed) and after (filled, colour by true class), the way travelled
over the band that the sensor swept, contacts as dots whose area grows with the force,
push attempts, what broke, and the last scan of a lidar. Coordinates are the arena's,
in [m]; the legend repeats the marks of the drawing.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from textwrap import wrap
from xml.sax.saxutils import escape

import mujoco
import numpy as np

from beacon_mj.constants import CLASSES, CONTACT_N, WALL_KIND
from beacon_mj.episode.trace import Trace
from beacon_mj.errors import LogError, printable
from beacon_mj.files import replacing
from beacon_mj.geometry import Array
from beacon_mj.recording.reader import Log, log_of
from beacon_mj.recording.rebuild import rebuild_trace
from beacon_mj.recording.scans import scan_points
from beacon_mj.rendering.annotations import (
    SCAN_RGBA,
    cross,
    cross_reach,
    scale_m,
    shown_kind,
)
from beacon_mj.rendering.captions import summary
from beacon_mj.rendering.legend import GOAL_RGB, START_RGB, hexadecimal
from beacon_mj.scene import Obstacle, shapes
from beacon_mj.world.outcome import ROBOT

SIDE_PIXELS = 600.0  #: Longer side of the arena.
#: Sizes in a room of 6 m, in [m]; they grow with the room.
MARGIN_M, FONT_M, LINE_M = 0.25, 0.13, 0.2
TITLE_CHARS = 84  #: Of one line of the title.
INK, CONTACT_RGB = "#14213d", "#d32f2f"
MARKS = {"moved": "#1a7f37", "not_moved": "#c62828", "broken": "#4a0d5c"}
SCAN_RGB = hexadecimal(SCAN_RGBA)
_PREFIX = "obstacle_"  #: Of the ids of generated scenes, left out in the drawing.


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
    return "\n".join(_Panel(log, rebuild_trace(log)).lines()) + "\n"


class _Panel:
    """The drawing of one log; every size but those of things grows with the room."""

    def __init__(self, log: Log, trace: Trace) -> None:
        self._log, self._trace = log, trace
        self._model = mujoco.MjModel.from_xml_string(log.regenerated())
        west, south, east, north = log.scene.workspace_m
        self._unit = max(east - west, north - south) / 6.0
        self._broken = {d.obstacle for s in trace.steps for d in s.outcome.damages}
        self._broken |= {*trace.left.broken} if trace.left else set()
        self._moved = {d.obstacle for s in trace.steps for d in s.outcome.displacements}

    def lines(self) -> Iterator[str]:
        """Yield the lines of the file."""
        west, south, east, north = self._log.scene.workspace_m
        title = wrap(summary(self._trace), TITLE_CHARS)
        legend, below = self._legend()
        margin, line = MARGIN_M * self._unit, LINE_M * self._unit
        top = margin + line * (len(title) - 1)
        width, height = east - west + 2 * margin, north - south + top + below
        scale = SIDE_PIXELS / (6.0 * self._unit)
        yield (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width * scale:.0f}" '
            f'height="{height * scale:.0f}" viewBox="{west - margin:.4f} '
            f'{-north - top:.4f} {width:.4f} {height:.4f}" font-family="sans-serif" '
            f'font-size="{FONT_M * self._unit:.4f}">'
        )
        yield (
            f'<rect x="{west - margin:.4f}" y="{-north - top:.4f}" '
            f'width="{width:.4f}" height="{height:.4f}" fill="white"/>'
        )
        yield '<g transform="scale(1,-1)">'  # SVG's y axis points down.
        yield from self._ground()
        yield from self._ways()
        for obstacle in self._log.scene.obstacles:
            yield from self._obstacle(obstacle)
        yield from self._events()
        for x, y in scan_points(self._log, self._log.steps).tolist():
            yield _disc(x, y, 0.02 * self._unit, SCAN_RGB, 1.0)
        yield "</g>"
        for k, text in enumerate(title[::-1]):
            y = -north - 0.09 * self._unit - k * line
            yield f'<text x="{west}" y="{y:.4f}">{_text(text)}</text>'
        yield from legend
        yield "</svg>"

    def _ground(self) -> Iterator[str]:
        scene = self._log.scene
        west, south, east, north = scene.workspace_m
        yield (
            f'<rect x="{west}" y="{south}" width="{east - west}" '
            f'height="{north - south}" fill="#fafafa" stroke="#444" '
            f'stroke-width="{0.04 * self._unit:.4f}"/>'
        )
        radius = scene.robot.radius_m
        for (x, y), colour in ((scene.start_m, START_RGB), (scene.goal_m, GOAL_RGB)):
            yield _disc(x, y, radius, colour)

    def _ways(self) -> Iterator[str]:
        """Yield the band that the sensor swept, the way travelled, and its end."""
        trace = self._trace
        west, south, east, north = trace.scene.workspace_m
        points = np.array([trace.start_m, *(s.outcome.position_m for s in trace.steps)])
        radius, sheet = trace.scene.robot.radius_m, trace.protocol.sensor(trace.scene)
        reach = radius + sheet.range_m if sheet.obstacles == "perceived" else 0.0
        way = f'points="{_points(points)}" fill="none" stroke-linejoin="round"'
        yield (
            f'<clipPath id="arena"><rect x="{west}" y="{south}" width="{east - west}" '
            f'height="{north - south}"/></clipPath>'
        )
        yield (
            f'<polyline {way} stroke="#1a73d9" stroke-width="{2 * reach:.4f}" '
            'stroke-linecap="round" opacity="0.08" clip-path="url(#arena)"/>'
        )
        yield f'<polyline {way} stroke="{INK}" stroke-width="{self._thin(2.5)}"/>'
        yield self._robot(points[-1][0], points[-1][1], radius)

    def _obstacle(self, obstacle: Obstacle) -> Iterator[str]:
        """Yield a footprint as it was, if it moved, and as it is, with its name."""
        colour = self._colour(obstacle.interaction)
        if obstacle.id in self._moved:
            before = self._outline(obstacle, 0)
            yield self._dashed(_points(before), colour)
        after = self._outline(obstacle, self._log.steps)
        yield (
            f'<polygon points="{_points(after)}" fill="{colour}" fill-opacity="0.85" '
            f'stroke="#222" stroke-width="{self._thin(1)}">'
            f"<title>{_text(obstacle.id)}: {obstacle.interaction}, "
            f"{obstacle.mass_kg:.2f} kg</title></polygon>"
        )
        centre = 0.5 * (after.min(axis=0) + after.max(axis=0))
        if obstacle.id in self._broken:
            reach = cross_reach(obstacle)
            yield self._cross(centre[0], centre[1], reach)
            centre[1] -= 1.6 * reach
        if obstacle.perceived.kind != WALL_KIND:
            name = obstacle.id.removeprefix(_PREFIX)
            yield self._label(centre[0], centre[1], name, "middle")
        if (kind := shown_kind(obstacle)) is not None:
            yield self._label(centre[0] + 0.2 * self._unit, centre[1], kind, "start")

    def _events(self) -> Iterator[str]:
        """Yield contacts of the robot, then push attempts."""
        for step in self._trace.steps:
            for c in step.outcome.contacts:
                # A contact that ended within the step has no point at its end.
                lasting = c.counterpart == ROBOT and bool(c.force_n.any())
                if lasting and c.filtered_peak_n > CONTACT_N:
                    radius = 0.006 * np.sqrt(c.filtered_peak_n) * self._unit
                    yield _disc(c.point_m[0], c.point_m[1], radius, CONTACT_RGB, 0.5)
        for step in self._trace.steps:
            x, y = step.outcome.position_m
            for attempt in step.outcome.attempts:
                yield self._ring(x, y, 0.09 * self._unit, MARKS[attempt.evidence])

    def _scale(self, x: float, y: float, length: float) -> Iterator[str]:
        """Yield a bar of a known length to the east of a point, and its length."""
        end, tick = x + length, 0.04 * self._unit
        yield (
            f'<path d="M{x:.4f} {y + tick:.4f}V{y - tick:.4f}M{x:.4f} {y:.4f}H{end:.4f}'
            f'M{end:.4f} {y + tick:.4f}V{y - tick:.4f}" stroke="{INK}" '
            f'stroke-width="{self._thin(2.5)}"/>'
        )
        left, text = x - 2 * tick, f"{length:g} m"
        yield self._label(left, y, text, "end", FONT_M, flip=False)

    def _legend(self) -> tuple[list[str], float]:
        """Return the legend below the arena, in SVG's direction, and its height [m]."""
        west, south, east, _ = self._log.scene.workspace_m
        unit, out = self._unit, list[str]()
        x, y = west, -south + (MARGIN_M + 0.05) * unit
        for mark, text in self._entries():
            needed = (0.34 + 0.066 * len(text)) * unit
            if x > west and x + needed > east:
                x, y = west, y + LINE_M * unit
            place = f"{x + 0.07 * unit:.4f},{y - 0.045 * unit:.4f}"
            out.append(f'<g transform="translate({place})">{mark}</g>')
            out.append(f'<text x="{x + 0.18 * unit:.4f}" y="{y:.4f}">{text}</text>')
            x += needed
        length = scale_m(self._log.scene.workspace_m)
        if x + length + 0.4 * unit > east:
            y += LINE_M * unit
        out += self._scale(east - length, y - 0.045 * unit, length)
        return out, y + south + 0.1 * unit

    def _entries(self) -> Iterator[tuple[str, str]]:
        """Yield each mark, drawn as in the picture around (0, 0), and its meaning."""
        half = 0.06 * self._unit
        square = f"{-half},{-half} {half},{-half} {half},{half} {-half},{half}"
        for name in CLASSES:
            colour = self._colour(name)
            yield f'<polygon points="{square}" fill="{colour}"/>', name
        colour = self._colour(CLASSES[1])
        yield self._dashed(square, colour), "before it moved"
        broken = f'<polygon points="{square}" fill="{self._colour(CLASSES[2])}"/>'
        yield broken + self._cross(0.0, 0.0, 0.7 * half), "broken"
        yield _disc(0.0, 0.0, half, CONTACT_RGB, 0.5), "contact"
        yield self._ring(0.0, 0.0, half, MARKS["moved"]), "push: moved"
        yield self._ring(0.0, 0.0, half, MARKS["not_moved"]), "push: not moved"
        yield self._ring(0.0, 0.0, half, MARKS["broken"]), "push: broken"
        way = f'M{-half:.4f} 0H{half:.4f}" stroke="{INK}"'
        yield f'<path d="{way} stroke-width="{self._thin(2.5)}"/>', "way travelled"
        band = f'<polygon points="{square}" fill="#1a73d9" opacity="0.15"/>'
        yield band, "sensed"
        yield _disc(0.0, 0.0, half, START_RGB), "start"
        yield _disc(0.0, 0.0, half, GOAL_RGB), "goal"
        yield self._robot(0.0, 0.0, half), "robot at the end"
        yield self._label(0.0, 0.0, "7", "middle", flip=False), f"{_PREFIX}7"
        if len(scan_points(self._log, self._log.steps)):
            dot = _disc(0.0, 0.0, 0.02 * self._unit, SCAN_RGB, 1.0)
            yield dot, "lidar at the end"

    def _colour(self, name: str) -> str:
        """Return the colour of a true class."""
        return hexadecimal(self._log.scene.surfaces[CLASSES.index(name)].rgba)

    def _thin(self, hundredths: float) -> str:
        """Return the width of a line, in hundredths of a metre in a room of 6 m."""
        return f"{0.01 * hundredths * self._unit:.4f}"

    def _dashed(self, points: str, colour: str) -> str:
        return (
            f'<polygon points="{points}" fill="none" stroke="{colour}" '
            f'stroke-width="{self._thin(1.5)}" '
            f'stroke-dasharray="{self._thin(5)} {self._thin(4)}"/>'
        )

    def _cross(self, x: float, y: float, reach: float) -> str:
        """Return the mark of what is broken: white on dark, seen on every colour."""
        path = "".join(
            f"M{a:.4f} {b:.4f}L{c:.4f} {d:.4f}"
            for (a, b), (c, d) in cross((x, y), reach)
        )
        return "".join(
            f'<path class="broken" d="{path}" stroke="{colour}" '
            f'stroke-width="{self._thin(width)}"/>'
            for colour, width in ((MARKS["broken"], 6), ("white", 2.5))
        )

    def _ring(self, x: float, y: float, radius: float, colour: str) -> str:
        return (
            f'<circle cx="{x:.4f}" cy="{y:.4f}" r="{radius:.4f}" fill="none" '
            f'stroke="{colour}" stroke-width="{self._thin(3)}"/>'
        )

    def _robot(self, x: float, y: float, radius: float) -> str:
        return (
            f'<circle cx="{x:.4f}" cy="{y:.4f}" r="{radius:.4f}" fill="#1a73d9" '
            f'fill-opacity="0.35" stroke="{INK}" stroke-width="{self._thin(2)}"/>'
        )

    def _label(
        self,
        x: float,
        y: float,
        text: str,
        anchor: str,
        size_m: float = 0.105,
        *,
        flip: bool = True,
    ) -> str:
        """Return a text beside or on a point, with a halo; `flip` within the group."""
        size = size_m * self._unit
        turn = ' transform="scale(1,-1)"' if flip else ""
        return (
            f'<text x="{x:.4f}" y="{(-y if flip else y) + 0.35 * size:.4f}"{turn} '
            f'text-anchor="{anchor}" font-size="{size:.4f}" fill="{INK}" '
            f'stroke="white" stroke-width="{self._thin(2)}" stroke-opacity="0.8" '
            f'paint-order="stroke">{_text(text)}</text>'
        )

    def _outline(self, obstacle: Obstacle, step: int) -> Array:
        """Return an obstacle's outline at one step, shape (k, 2) [m]."""
        return outline(self._log, self._model, obstacle, step)


def outline(log: Log, model: mujoco.MjModel, obstacle: Obstacle, step: int) -> Array:
    """Return an obstacle's outline at one step of a log, shape (k, 2) [m]."""
    if obstacle.fixed:
        return np.array(obstacle.footprint.polygon().exterior.coords)
    first = int(model.joint(obstacle.id).qposadr[0])
    pose = log.positions[step][first : first + 7]
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, pose[3:])
    turned = shapes.tilted_footprint(obstacle.shape, rotation.reshape(3, 3))
    return np.array(turned.moved(pose[0], pose[1], 0.0).polygon().exterior.coords)


def _disc(x: float, y: float, radius: float, colour: str, opacity: float = 0.7) -> str:
    return (
        f'<circle cx="{x:.4f}" cy="{y:.4f}" r="{radius:.4f}" fill="{colour}" '
        f'opacity="{opacity}"/>'
    )


def _text(text: str) -> str:
    """Return a text as XML can hold it."""
    return escape(printable(text))


def _points(points: Iterable[Array]) -> str:
    return " ".join(f"{x:.4f},{y:.4f}" for x, y in points)
