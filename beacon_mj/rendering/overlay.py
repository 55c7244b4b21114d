"""Text below a picture."""

from typing import Any

import numpy as np
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from beacon_mj.rendering.gl import Image

INK = (20, 24, 34)
LINES, LINE_PIXELS = 4, 24
BAND_PIXELS = (LINES + 1) * LINE_PIXELS  #: Height of the text below a picture.


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


def captioned(picture: Image, caption: str, size_px: int = 16) -> Any:
    """Return a Pillow image of a picture with a caption below it."""
    height, width = picture.shape[:2]
    out = Pillow.new("RGB", (width, height + 2 * size_px), "white")
    out.paste(Pillow.fromarray(picture), (0, 0))
    draw = ImageDraw.Draw(out)
    font = ImageFont.load_default(size_px)
    draw.text((8, height + size_px // 3), caption, font=font, fill=INK)
    return out
