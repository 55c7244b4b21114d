"""What the marks in pictures mean: the entries of a legend, and each mark as SVG."""

from collections.abc import Sequence
from html import escape
from typing import Literal, NamedTuple

from beacon_mj.constants import CLASSES
from beacon_mj.recording.drawing import BROKEN_RGBA
from beacon_mj.rendering.annotations import (
    ARROW_RGBA,
    CROSS_RGBA,
    PATH_RGBA,
    SCAN_RGBA,
    TRAIL_RGBA,
)
from beacon_mj.scene import Scene

Shape = Literal["square", "dot", "line", "arrow", "broken", "disc"]
START_RGB, GOAL_RGB = "#3373cc", "#1aa64d"
#: In words, after the paper: safe means that it may be touched, and stays.
_MEANINGS = {"safe": "safe (stays)", "movable": "movable", "fragile": "fragile"}


class Entry(NamedTuple):
    """One mark: its shape, its colour as `#rrggbb`, and what it stands for."""

    shape: Shape
    colour: str
    text: str


def entries(scene: Scene, *, dots: bool = True, lidar: bool = False) -> list[Entry]:
    """Return the legend of the 3-D pictures of a scene.

    Args:
        scene: Whose classes have colours.
        dots: Whether a dot on each obstacle shows its true class.
        lidar: Whether what a lidar hits is drawn.
    """
    believed = Entry("square", "#707070", "colour: what the planner believes")
    if dots:
        text = "dot: true class; body: what the planner believes"
        believed = Entry("dot", "#707070", text)
    classes = [
        Entry("square", hexadecimal(surface.rgba), _MEANINGS[name])
        for name, surface in zip(CLASSES, scene.surfaces, strict=True)
    ]
    return [
        *classes,
        Entry("square", "#dedede", "pale: not sensed yet"),
        believed,
        Entry("broken", hexadecimal(BROKEN_RGBA), "broken"),
        Entry("line", hexadecimal(PATH_RGBA), "planned path"),
        Entry("line", hexadecimal(TRAIL_RGBA), "way travelled"),
        Entry("arrow", hexadecimal(ARROW_RGBA), "contact force"),
        Entry("disc", START_RGB, "start"),
        Entry("disc", GOAL_RGB, "goal"),
        *([Entry("disc", hexadecimal(SCAN_RGBA), "lidar")] if lidar else []),
    ]


def hexadecimal(rgba: Sequence[float]) -> str:
    """Return a colour, its parts in [0, 1], as `#rrggbb`."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in rgba[:3])


def svg_mark(entry: Entry) -> str:
    """Return a mark as SVG within the square from (0, 0) to (16, 16)."""
    colour = escape(entry.colour)
    cross = hexadecimal(CROSS_RGBA)
    return {
        "square": f'<rect x="2" y="2" width="12" height="12" fill="{colour}"/>',
        "dot": '<rect x="2" y="2" width="12" height="12" fill="#c9c9c9"/>'
        '<circle cx="8" cy="8" r="4.5" fill="#fff"/>'
        f'<circle cx="8" cy="8" r="3" fill="{colour}"/>',
        "line": f'<path d="M0 8H16" stroke="{colour}" stroke-width="3"/>',
        "arrow": f'<path d="M0 7H9V3L16 8L9 13V9H0Z" fill="{colour}"/>',
        "broken": f'<rect x="2" y="2" width="12" height="12" fill="{colour}"/>'
        f'<path d="M4 4L12 12M4 12L12 4" stroke="{cross}" stroke-width="2"/>',
        "disc": f'<circle cx="8" cy="8" r="6" fill="{colour}"/>',
    }[entry.shape]


def html_legend(found: Sequence[Entry]) -> str:
    """Return a legend as HTML that needs no style sheet and takes no clicks."""
    marks = "".join(
        '<span style="white-space:nowrap;margin-right:12px">'
        '<svg width="13" height="13" viewBox="0 0 16 16" '
        f'style="vertical-align:-2px;margin-right:4px">{svg_mark(entry)}</svg>'
        f"{escape(entry.text)}</span> "
        for entry in found
    )
    return (
        '<div id="legend" style="position:fixed;left:0;right:0;top:0;z-index:1;'
        "padding:4px 8px;background:rgba(255,255,255,.85);color:#14182a;"
        f'font:12px/1.5 sans-serif;pointer-events:none">{marks}</div>'
    )
