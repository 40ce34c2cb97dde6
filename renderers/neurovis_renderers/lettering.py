"""Lettering: texts as fragments, by Pillow.

In: a Text of a Scene. Out: Fragments. The font is DejaVu Sans, which is part of this package, so that pictures have the
same pixels everywhere; it is also the first that an SVG asks for.
"""

from __future__ import annotations

import math
import unicodedata
import warnings
from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from neurovis_renderers.coverage import Fragments, Numbers, Size
from neurovis_renderers.truetype import read
from neurovis_spec.scene import HALO, SUBSCRIPT_DROP, SUBSCRIPT_SIZE, IntArray, Scene, Text

#: Regular and bold.
FONTS = tuple(Path(__file__).parent / "fonts" / name for name in ("DejaVuSans.ttf", "DejaVuSans-Bold.ttf"))
#: the weight from which on a text is bold
BOLD = 600
#: texts are drawn so much larger, then reduced: glyphs stand where they should, to a fraction of a pixel
_FINER = 8
#: where a glyph of that size goes on to the next pixel, as FreeType rounds
_HALF = 32.5 / 64


@lru_cache(maxsize=64)
def font(size: float, bold: bool) -> ImageFont.FreeTypeFont:
    """The font of this size in pixels."""
    return ImageFont.truetype(str(FONTS[bold]), size, layout_engine=ImageFont.Layout.BASIC)


def warn_of_letters(scene: Scene) -> None:
    """Say which characters of a scene the font lacks, and which it sets from left to right that run the other way."""
    shown = {c for shape in scene.shapes() if isinstance(shape, Text) for c in shape.text + shape.subscript}
    lacking = sorted(c for c in shown if not c.isspace() and not read(FONTS[0]).glyph(c))
    backward = sorted(c for c in shown.difference(lacking) if unicodedata.bidirectional(c) in ("R", "AL"))
    parts = (("no glyphs for", lacking), ("reversed are", backward))
    told = "; ".join(f"{what} {_some(some)}" for what, some in parts if some)
    if told:
        warnings.warn(f"the picture's font cannot set all letters: {told}. An .svg shows them", stacklevel=2)


def _some(characters: list[str]) -> str:
    """The first few of them."""
    more = f" and {len(characters) - 3} more" if len(characters) > 3 else ""
    return ", ".join(f"'{c}'" if c.isprintable() else f"U+{ord(c):04X}" for c in characters[:3]) + more


def lettering(
    text: Text, size: Size, halo: bool = False, density: float = 1.0, corner: tuple[int, int] = (0, 0)
) -> Fragments:
    """The fragments of a text with its subscript, or of its ``halo``, in a picture of this size, which begins at a
    ``corner`` in pixels, of which there are ``density`` in a unit."""
    bold, points = text.weight >= BOLD, text.size * density
    runs = [(text.text, points, 0.0)]
    if text.subscript:
        runs.append((text.subscript, SUBSCRIPT_SIZE * points, SUBSCRIPT_DROP * points))
    long = sum(_length(words, size_of, bold) for words, size_of, _ in runs)
    x, baseline = text.point[0] * density - corner[0], text.point[1] * density - corner[1]
    if text.upward:  # drawn where it stands before it is turned by a quarter about the picture's corner
        x, baseline = -baseline, x
    x -= {"start": 0.0, "middle": long / 2, "end": long}[text.anchor]
    reach = math.ceil(HALO * points) if halo else 0
    left, top = math.floor(x) - 2 - reach, math.floor(baseline - 1.2 * points) - 1 - reach
    begin = (x - left) * _FINER
    if all(_stand_alone(words, size_of, bold) for words, size_of, _ in runs):
        begin = math.floor(begin + _HALF)
    # on a whole pixel, as browsers have it
    lines = tuple((words, size_of, math.floor(baseline + drop + 0.5) - top) for words, size_of, drop in runs)
    stroke = round(HALO * points * _FINER) if halo else 0
    rows, columns, share, (high, wide) = _glyphs(lines, bold, begin, (reach, stroke), text.upward)
    if text.upward:
        left, top = top, -left - high
    pixels = rows * size[0] + columns + (top * size[0] + left)
    owners = np.zeros(len(pixels), np.int64)
    if left >= 0 and top >= 0 and left + wide <= size[0] and top + high <= size[1]:
        return Fragments(owners, pixels, share)
    rows, columns = rows + top, columns + left
    kept = np.flatnonzero((rows >= 0) & (rows < size[1]) & (columns >= 0) & (columns < size[0]))
    return Fragments(owners, pixels, share).only(kept)


@lru_cache(maxsize=4096)
def _length(words: str, points: float, bold: bool) -> float:
    """How long a text is, in pixels."""
    return font(_FINER * points, bold).getlength(words) / _FINER


@lru_cache(maxsize=4096)
def _stand_alone(words: str, points: float, bold: bool) -> bool:
    """Whether every letter begins on a whole part of a pixel, if the first does: none is moved closer to another. Then
    a text that moves over a picture looks only so many ways as a pixel has parts, and each is drawn once."""
    each = [_length(letter, points, bold) * _FINER for letter in words]
    return all(length.is_integer() for length in each) and sum(each) == _length(words, points, bold) * _FINER


@lru_cache(maxsize=512)
def _glyphs(
    lines: tuple[tuple[str, float, int], ...], bold: bool, begin: float, around: tuple[int, int], upward: bool
) -> tuple[IntArray, IntArray, Numbers, tuple[int, int]]:
    """Texts one after the other, each with its size and the row of its baseline, from ``begin`` on, which counts parts
    of a pixel; ``around`` is how many pixels are left for their halo, and how thick that is in parts. The rows and the
    columns of pixels, how much of each is covered, and of how many rows and columns they are."""
    reach, stroke = around
    long, most = sum(_length(words, points, bold) for words, points, _ in lines), lines[0][1]
    wide, high = int(long) + 6 + 2 * reach, int(2 * most) + 4 + 2 * reach
    tile, at = Image.new("L", (wide * _FINER, high * _FINER)), begin
    pen = ImageDraw.Draw(tile)
    for words, points, row in lines:
        made = font(_FINER * points, bold)
        pen.text((at, row * _FINER), words, fill=255, font=made, anchor="ls", stroke_width=stroke)
        at += made.getlength(words)
    covered = np.asarray(tile.reduce(_FINER))
    covered = np.rot90(covered) if upward else covered
    rows, columns = np.nonzero(covered)
    high, wide = covered.shape
    return rows, columns, covered[rows, columns].astype(np.float32) / np.float32(255), (high, wide)
