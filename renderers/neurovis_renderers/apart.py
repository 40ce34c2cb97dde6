"""What stands apart in a film: a group as it is at several frames, drawn at once.

In: the same group at some frames. Out: for each of these the pixels of a band that the group covers. Groups are small,
so that drawing one takes about as long as drawing several: each lies on a page of its own, large enough for any.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from neurovis_renderers import coverage
from neurovis_renderers.canvas import Portion, composed, veiled
from neurovis_renderers.coverage import Fragments, Size
from neurovis_renderers.sheet import WHOLE, Sheet
from neurovis_spec.scene import Group, IntArray

#: Frames that are drawn at once.
FRAMES = 4
#: Fragments that a group may have, and pixels of pages, that are drawn at once, whatever hides them.
_MOST, _MOST_PIXELS = 1 << 22, 1 << 21
#: Pixels that are left around what may be seen of a group, before it and behind it.
_BEFORE, _BEHIND = 2, 3


@dataclass(frozen=True, slots=True)
class Laid:
    """A group as it lies over a band: fragments, one a pixel, each of its own colour; and other pixels, which it
    covers, and their colours."""

    fragments: Fragments
    colours: IntArray
    covered: IntArray
    covering: IntArray

    def as_fragments(self, place: int) -> tuple[Fragments, IntArray]:
        """All of it as fragments of a shape at a place in an order, and their colours."""
        some, pixels = self.fragments, np.concatenate([self.fragments.pixels, self.covered])
        shares = np.concatenate([some.shares, np.ones(len(self.covered), np.float32)])
        return Fragments(np.full(len(pixels), place), pixels, shares), np.concatenate([self.colours, self.covering])

    def faint(self, opacity: float) -> Laid:
        """The same seen in part."""
        fragments, colours = self.as_fragments(0)
        weights = fragments.shares * WHOLE
        return Laid(replace(fragments, shares=weights * np.float32(opacity / WHOLE)), colours, _NONE, _NONE)


_NONE: IntArray = np.empty(0, np.int64)
NOTHING = Laid(coverage.NOTHING, _NONE, _NONE, _NONE)


def laid(groups: Sequence[Group], density: float, top: int, size: Size) -> list[Laid]:
    """A group at some frames over the band of a size that begins with row ``top``."""
    sheet = Sheet([replace(group, opacity=1.0) for group in groups], density)
    page_of = np.repeat(np.arange(len(groups)), np.diff(sheet.firsts, append=len(sheet)))
    low, above = sheet.extents(page_of, len(groups))
    shift = np.array([0, top])
    begins = np.clip(low - shift - _BEFORE, 0, size).astype(np.int64)
    extents = np.clip(above - shift + _BEHIND, 0, size).astype(np.int64) - begins
    seen = (extents > 0).all(axis=1)
    if not seen.all():
        chosen = [group for group, there in zip(groups, seen.tolist(), strict=True) if there]
        found = iter(laid(chosen, density, top, size) if chosen else ())
        return [next(found) if there else NOTHING for there in seen.tolist()]
    wide, high = extents.max(axis=0).tolist()
    much = sheet.most((wide, high)) > _MOST
    if len(groups) > 1 and (much or len(groups) * wide * high > _MOST_PIXELS):
        half = len(groups) // 2
        return [*laid(groups[:half], density, top, size), *laid(groups[half:], density, top, size)]
    pages = _Pages(begins, extents, (wide, high))
    opacities = [group.opacity for group in groups]
    if much:
        corner = (int(begins[0, 0]), int(begins[0, 1]) + top)
        fragments, colours, _ = veiled(sheet, 0, len(sheet), corner, (wide, high), opacities[0])
        return [Laid(*each, _NONE, _NONE) for each in pages.apart(size, fragments, colours)]
    return _at_once(sheet.on_pages(page_of, begins + shift, (wide, high)), pages, size, opacities)


@dataclass(frozen=True, slots=True)
class _Pages:
    """Pages of one size, one after the other: which pixel of a band is the first of each, and how large that is of it
    which may be drawn on, (pages, 2)."""

    begins: IntArray
    extents: IntArray
    size: Size

    def over(self, size: Size, pixels: IntArray) -> tuple[IntArray, IntArray]:
        """Where pixels of pages lie over a band of a size, and the page of each: the number of pages where they lie
        outside of theirs."""
        (wide, high), (x, y) = self.size, self.begins.T
        line = pixels // wide
        page = line // high
        over = pixels + line * (size[0] - wide) + ((y - high * np.arange(len(y))) * size[0] + x)[page]
        if (self.begins + self.extents == size).any():  # where the band ends, so does what is seen
            within = self.extents[page]
            outside = (pixels - line * wide >= within[:, 0]) | (line - page * high >= within[:, 1])
            page[outside] = len(self.begins)
        return over, page

    def apart(self, size: Size, fragments: Fragments, colours: IntArray) -> list[tuple[Fragments, IntArray]]:
        """Fragments of each page by themselves, as they lie over a band, and their colours."""
        over, page = self.over(size, fragments.pixels)
        order = np.argsort(page.astype(np.uint8), kind="stable")
        ends = np.searchsorted(page[order], np.arange(len(self.begins) + 1)).tolist()
        found, colours = Fragments(fragments.owners, over, fragments.shares).only(order), colours[order]
        return [(found.only(slice(*some)), colours[slice(*some)]) for some in pairwise(ends)]

    def covered(self, size: Size, pixels: IntArray, colours: IntArray) -> list[tuple[IntArray, IntArray]]:
        """The same of pixels in order that are covered."""
        over, page = self.over(size, pixels)
        inside = page < len(self.begins)
        if not inside.all():
            over, page, colours = over[inside], page[inside], colours[inside]
        ends = np.searchsorted(page, np.arange(len(self.begins) + 1)).tolist()
        return [(over[slice(*some)], colours[slice(*some)]) for some in pairwise(ends)]


def _at_once(sheet: Sheet, pages: _Pages, size: Size, opacities: Sequence[float]) -> list[Laid]:
    """What is seen of shapes on pages, as it lies over a band of a size."""
    front, corner = len(sheet), (0, 0)
    strokes = sheet.strokes(sheet.pieces, corner, pages.size, None)
    solid, heads = sheet.solid(0, front, corner, pages.size), sheet.heads(0, front, corner, pages.size)
    fragments, area = Portion(front, solid, strokes, heads).fragments(sheet), pages.size[0] * pages.size[1]
    made = composed(fragments, sheet.paints, front, len(pages.begins) * area)
    shares = made.weights * np.float32(1 / WHOLE)
    parts = pages.apart(size, Fragments(made.pixels, made.pixels, shares), made.colours)
    covered = pages.covered(size, made.covered, sheet.paints[made.by])
    found = [Laid(*part, *over) for part, over in zip(parts, covered, strict=True)]
    return [one if opacity == 1 else one.faint(opacity) for one, opacity in zip(found, opacities, strict=True)]
