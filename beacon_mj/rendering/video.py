"""A video of a logged episode, without a screen and without ffmpeg."""

from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from beacon_mj.files import replacing
from beacon_mj.recording.reader import Log, log_of
from beacon_mj.recording.rebuild import rebuild_trace
from beacon_mj.rendering.captions import describe
from beacon_mj.rendering.gl import Image, RenderError
from beacon_mj.rendering.overlay import EDGE, legend, text_band, wrapped
from beacon_mj.rendering.playback import Playback, legend_of

HOLD_S = 1.5  #: How long the last picture stays [s].
LEAST_PIXELS = 64  #: Least height of the pictures of the scene.


def render_video(
    log: Log | str | Path,
    out: str | Path,
    *,
    speed: float = 2.0,
    width: int = 880,
    height: int = 840,
) -> Path:
    """Write an MP4 of a log: one picture per control step, with text and a legend.

    Args:
        log: A log, or the path of one, finished or not.
        out: The video; written whole or not at all.
        speed: Simulated seconds per second of video, > 0.
        width: Width in pixels, even.
        height: Height in pixels, even; the scene has what text and legend leave.

    Raises:
        LogError: If the log cannot be read.
        RenderError: If nothing can be drawn here, or there is no room for the scene.
    """
    log = log_of(log)
    bands = _Bands(log, width)
    room = height - bands.height
    if room < LEAST_PIXELS:
        raise RenderError(
            f"Expected a height of {bands.height + LEAST_PIXELS} pixels or more, for "
            f"text and legend {width} pixels wide, but it was {height}."
        )
    period_s = log.scene.robot.control_period_s
    rate = Fraction(speed / period_s).limit_denominator(1000)
    with Playback(log, width, room) as playback, replacing(Path(out)) as part:
        # As a file: FFmpeg takes no path that is not UTF-8.
        with part.open("wb") as file, av.open(file, "w", format="mp4") as container:
            stream = container.add_stream("libx264", rate=rate)
            stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
            stream.options = {"crf": "20", "preset": "veryfast"}
            for step in range(playback.steps + 1):
                picture = bands.below(playback.picture(step), step)
                container.mux(stream.encode(_frame(picture)))
            for _ in range(round(HOLD_S * rate)):
                container.mux(stream.encode(_frame(picture)))
            container.mux(stream.encode(None))
    return Path(out)


class _Bands:
    """What stands below the pictures of one video: text, and the legend."""

    def __init__(self, log: Log, width: int) -> None:
        trace = rebuild_trace(log)
        self._width = width
        self._texts = [
            [part for line in lines for part in wrapped(line, width - 2 * EDGE)]
            for lines in (describe(trace, k) for k in range(log.steps + 1))
        ]
        self._rows = max(map(len, self._texts))
        self._legend = np.asarray(legend(legend_of(log), width))

    @property
    def height(self) -> int:
        """Height of both [pixels], the same at every step."""
        return len(self._text(0)) + len(self._legend)

    def below(self, picture: Image, step: int) -> Image:
        """Return a picture with the text of a step and the legend below it."""
        return np.vstack([picture, self._text(step), self._legend])

    def _text(self, step: int) -> Image:
        return np.asarray(text_band(self._texts[step], self._width, self._rows))


def _frame(picture: Image) -> av.VideoFrame:
    return av.VideoFrame.from_ndarray(picture, format="rgb24")
