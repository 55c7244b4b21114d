"""A video of a logged episode, without a screen and without ffmpeg."""

from fractions import Fraction
from pathlib import Path

import av

from beacon_mj.files import replacing
from beacon_mj.recording.reader import Log, log_of
from beacon_mj.rendering.captions import describe
from beacon_mj.rendering.gl import Image
from beacon_mj.rendering.overlay import BAND_PIXELS, annotate
from beacon_mj.rendering.playback import Playback

HOLD_S = 1.5  #: How long the last picture stays [s].


def render_video(
    log: Log | str | Path,
    out: str | Path,
    *,
    speed: float = 2.0,
    width: int = 880,
    height: int = 780,
) -> Path:
    """Write an MP4 of a log: one picture per control step.

    Args:
        log: A log, or the path of one, finished or not.
        out: The video; written whole or not at all.
        speed: Simulated seconds per second of video, > 0.
        width: Width in pixels, even.
        height: Height in pixels, even; 120 of them are for text.

    Raises:
        LogError: If the log cannot be read.
        RenderError: If nothing can be drawn here.
    """
    log = log_of(log)
    period_s = log.scene.robot.control_period_s
    rate = Fraction(speed / period_s).limit_denominator(1000)
    with (
        Playback(log, width, height - BAND_PIXELS) as playback,
        replacing(Path(out)) as part,
    ):
        # As a file: FFmpeg takes no path that is not UTF-8.
        with part.open("wb") as file, av.open(file, "w", format="mp4") as container:
            stream = container.add_stream("libx264", rate=rate)
            stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
            stream.options = {"crf": "20", "preset": "veryfast"}
            for step in range(playback.steps + 1):
                lines = describe(playback.trace, step)
                picture = annotate(playback.picture(step), lines)
                container.mux(stream.encode(_frame(picture)))
            for _ in range(round(HOLD_S * rate)):
                container.mux(stream.encode(_frame(picture)))
            container.mux(stream.encode(None))
    return Path(out)


def _frame(picture: Image) -> av.VideoFrame:
    return av.VideoFrame.from_ndarray(picture, format="rgb24")
