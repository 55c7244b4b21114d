"""Pictures of scenes and logs, and tables of results; drawn without a screen.

The functions import what they draw with when they are called. Videos need the extra
`video` and pages the extra `web`; without them they say which package is missing.
"""

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from beacon_mj.errors import BeaconError
from beacon_mj.extras import missing
from beacon_mj.scene import Scene

if TYPE_CHECKING:
    from beacon_mj.recording.reader import Log

#: A log that was read, or the path of one.
LogSource: TypeAlias = "Log | str | Path"


def render_video(log: LogSource, out: str | Path, **options: Any) -> Path:
    """Write an MP4 of a log; see `beacon_mj.rendering.video.render_video`."""
    return Path(_load("video", "video").render_video(log, out, **options))


def render_strip(log: LogSource, out: str | Path, **options: Any) -> Path:
    """Write a PNG of some moments; see `beacon_mj.rendering.filmstrip.render_strip`."""
    return Path(_load("filmstrip").render_strip(log, out, **options))


def render_scene(scene: Scene, out: str | Path, **options: Any) -> Path:
    """Write a PNG of a scene; see `beacon_mj.rendering.snapshot.render_scene`."""
    return Path(_load("snapshot").render_scene(scene, out, **options))


def plot_panel(log: LogSource, out: str | Path) -> Path:
    """Write a log in one 2-D SVG; see `beacon_mj.rendering.panel.plot_panel`."""
    return Path(_load("panel").plot_panel(log, out))


def render_page(log: LogSource, out: str | Path, **options: Any) -> Path:
    """Write a log as one HTML file; see `beacon_mj.rendering.html.render_page`."""
    return Path(_load("html", "web").render_page(log, out, **options))


def view_log(log: LogSource) -> None:
    """Open the viewer on a log; see `beacon_mj.rendering.viewer.view_log`."""
    _load("viewer").view_log(log)


def view_scene(scene: Scene) -> None:
    """Open the viewer on a scene; see `beacon_mj.rendering.snapshot.view_scene`."""
    _load("snapshot").view_scene(scene)


def _load(module: str, extra: str | None = None) -> Any:
    try:
        return importlib.import_module(f"beacon_mj.rendering.{module}")
    except ModuleNotFoundError as error:
        if extra is None:
            raise
        raise BeaconError(f"{module}: {missing(error, extra)}") from error
