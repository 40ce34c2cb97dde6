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

from neurovis_renderers.coverage import Fragments, Size
from neurovis_renderers.truetype import read
from neurovis_spec.scene import HALO, SUBSCRIPT_DROP, SUBSCRIPT_SIZE, Scene, Text

#: Regular and bold.
FONTS = tuple(Path(__file__).parent / "fonts" / name for name in ("DejaVuSans.ttf", "DejaVuSans-Bold.ttf"))
#: the weight from which on a text is bold
BOLD = 600
#: texts are drawn so much larger, then reduced: glyphs stand where they should, to a fraction of a pixel
_FINER = 8


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


def lettering(text: Text, size: Size, halo: bool = False) -> Fragments:
    """The fragments of a text with its subscript, or of its ``halo``, in a picture of this size."""
    bold = text.weight >= BOLD
    runs = [(text.text, text.size, 0.0)]
    if text.subscript:
        runs.append((text.subscript, SUBSCRIPT_SIZE * text.size, SUBSCRIPT_DROP * text.size))
    fonts = [font(_FINER * points, bold) for _, points, _ in runs]
    lengths = [made.getlength(words) / _FINER for made, (words, _, _) in zip(fonts, runs, strict=True)]
    # what reads upward is drawn where it stands before it is turned by a quarter about the picture's corner
    x, baseline = (-text.point[1], text.point[0]) if text.upward else text.point
    x -= {"start": 0.0, "middle": sum(lengths) / 2, "end": sum(lengths)}[text.anchor]
    reach = math.ceil(HALO * text.size) if halo else 0
    left, top = int(np.floor(x)) - 2 - reach, int(np.floor(baseline - 1.2 * text.size)) - 1 - reach
    wide, high = int(sum(lengths)) + 6 + 2 * reach, int(2 * text.size) + 4 + 2 * reach
    tile = Image.new("L", (wide * _FINER, high * _FINER))
    pen = ImageDraw.Draw(tile)
    stroke = round(HALO * text.size * _FINER) if halo else 0
    for made, (words, _, drop), length in zip(fonts, runs, lengths, strict=True):
        row = math.floor(baseline + drop + 0.5)  # on a whole pixel, as browsers have it
        at = ((x - left) * _FINER, (row - top) * _FINER)
        pen.text(at, words, fill=255, font=made, anchor="ls", stroke_width=stroke)
        x += length
    share = np.asarray(tile.reduce(_FINER), np.float32) / np.float32(255)
    if text.upward:
        share, left, top = np.rot90(share), top, -left - share.shape[1]
    rows, columns = np.nonzero(share)
    rows, columns, share = rows + top, columns + left, share[rows, columns]
    kept = (rows >= 0) & (rows < size[1]) & (columns >= 0) & (columns < size[0])
    pixels = (rows * size[0] + columns)[kept].astype(np.int64)
    return Fragments(np.zeros(len(pixels), np.int64), pixels, share[kept])
