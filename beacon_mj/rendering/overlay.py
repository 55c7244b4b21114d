"""Text and legends around pictures, drawn with Pillow."""

import functools
from collections.abc import Iterator, Sequence
from typing import Any

from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from beacon_mj.recording.drawing import BROKEN_RGBA
from beacon_mj.rendering.annotations import CROSS_RGBA
from beacon_mj.rendering.legend import Entry, hexadecimal

INK = (20, 24, 34)
TEXT_PIXELS = 16  #: Size of captions and legends.
EDGE = 8  #: Space left and right of text [pixels].
_PITCH = 1.35  #: Distance of lines, in sizes of the text.


@functools.cache
def _font(size: float) -> Any:
    """Return the font of all text; reading it takes a millisecond."""
    return ImageFont.load_default(size)


def wrapped(text: str, width: float, size: float = TEXT_PIXELS) -> list[str]:
    """Return a text as lines that are at most `width` pixels wide.

    It is broken between words, and within a word that is wider than a line.
    """
    font = _font(size)
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
    wraps = [wrapped(text, width - 2 * EDGE) for text in texts]
    rows = max(map(len, wraps))
    return [text_band(lines, width, rows) for lines in wraps]


def text_band(lines: Sequence[str], width: int, rows: int) -> Any:
    """Return lines of text as a Pillow image with room for `rows` of them."""
    pitch = round(_PITCH * TEXT_PIXELS)
    font = _font(TEXT_PIXELS)
    band = Pillow.new("RGB", (width, pitch * rows + TEXT_PIXELS // 2), "white")
    draw = ImageDraw.Draw(band)
    for k, line in enumerate(lines):
        draw.text((EDGE, 4 + k * pitch), line, font=font, fill=INK)
    return band


def legend(entries: Sequence[Entry], width: int) -> Any:
    """Return a legend as a Pillow image, as high as it needs."""
    font = _font(TEXT_PIXELS)
    pitch = round(1.6 * TEXT_PIXELS)
    places, x, y = [], EDGE, 0
    for entry in entries:
        needed = round(1.5 * TEXT_PIXELS + font.getlength(entry.text))
        if x > EDGE and x + needed > width - EDGE:
            x, y = EDGE, y + pitch
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
