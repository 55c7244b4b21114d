"""Text and legends around pictures, drawn with Pillow."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from beacon_mj.recording.drawing import BROKEN_RGBA
from beacon_mj.rendering.annotations import CROSS_RGBA
from beacon_mj.rendering.gl import Image
from beacon_mj.rendering.legend import Entry, hexadecimal

INK = (20, 24, 34)
LINES, LINE_PIXELS = 4, 24
BAND_PIXELS = (LINES + 1) * LINE_PIXELS  #: Height of the text below a picture.
TEXT_PIXELS = 16  #: Size of captions and legends.
_PITCH = 1.35  #: Distance of lines, in sizes of the text.
_EDGE = 8  #: Space left and right of text [pixels].


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


def wrapped(text: str, width: float, size: float = TEXT_PIXELS) -> list[str]:
    """Return a text as lines that are at most `width` pixels wide.

    It is broken between words, and within a word that is wider than a line.
    """
    font = ImageFont.load_default(size)
    lines, line = [], ""
    for piece in _pieces(text, width, font):
        joined = f"{line} {piece}" if line else piece
        if line and font.getlength(joined) > width:
            lines.append(line)
            joined = piece
        line = joined
    return [*lines, line]


def _pieces(text: str, width: float, font: Any) -> Iterator[str]:
    """Yield the words of a text, those wider than a line in parts."""
    for word in text.split():
        while font.getlength(word) > width and len(word) > 1:
            fits = range(2, len(word) + 1)
            n = next((k for k in fits if font.getlength(word[:k]) > width), 2) - 1
            yield word[:n]
            word = word[n:]
        yield word


def captions(texts: Sequence[str], width: int) -> list[Any]:
    """Return captions as Pillow images of one size, as high as the longest needs."""
    wraps = [wrapped(text, width - 2 * _EDGE) for text in texts]
    pitch = round(_PITCH * TEXT_PIXELS)
    height = pitch * max(map(len, wraps)) + TEXT_PIXELS // 2
    font = ImageFont.load_default(TEXT_PIXELS)
    out = []
    for lines in wraps:
        band = Pillow.new("RGB", (width, height), "white")
        draw = ImageDraw.Draw(band)
        for k, line in enumerate(lines):
            draw.text((_EDGE, 4 + k * pitch), line, font=font, fill=INK)
        out.append(band)
    return out


def legend(entries: Sequence[Entry], width: int) -> Any:
    """Return a legend as a Pillow image, as high as it needs."""
    font = ImageFont.load_default(TEXT_PIXELS)
    pitch = round(1.6 * TEXT_PIXELS)
    places, x, y = [], _EDGE, 0
    for entry in entries:
        needed = round(1.5 * TEXT_PIXELS + font.getlength(entry.text))
        if x > _EDGE and x + needed > width - _EDGE:
            x, y = _EDGE, y + pitch
        places.append((x, y))
        x += needed + TEXT_PIXELS
    band = Pillow.new("RGB", (width, y + pitch), "white")
    draw = ImageDraw.Draw(band)
    for (x, y), entry in zip(places, entries, strict=True):
        _mark(draw, entry, x, y + 4)
        draw.text((x + 1.5 * TEXT_PIXELS, y + 2), entry.text, font=font, fill=INK)
    return band


def _mark(draw: Any, entry: Entry, x: int, y: int) -> None:
    """Draw the mark of an entry into the square of 16 pixels at (x, y)."""
    square = (x + 2, y + 2, x + 14, y + 14)
    match entry.shape:
        case "square":
            draw.rectangle(square, fill=entry.colour)
        case "dot":
            draw.rectangle(square, fill="#c9c9c9")
            draw.circle((x + 8, y + 8), 4.5, fill="white")
            draw.circle((x + 8, y + 8), 3, fill=entry.colour)
        case "line":
            draw.line((x, y + 8, x + 16, y + 8), fill=entry.colour, width=3)
        case "arrow":
            draw.line((x, y + 8, x + 10, y + 8), fill=entry.colour, width=3)
            tip = ((x + 9, y + 3), (x + 16, y + 8), (x + 9, y + 13))
            draw.polygon(tip, fill=entry.colour)
        case "broken":
            draw.rectangle(square, fill=hexadecimal(BROKEN_RGBA))
            for ends in ((4, 4, 12, 12), (4, 12, 12, 4)):
                line = [side + at for side, at in zip((x, y, x, y), ends, strict=True)]
                draw.line(line, fill=hexadecimal(CROSS_RGBA), width=2)
        case "disc":
            draw.circle((x + 8, y + 8), 6, fill=entry.colour)
