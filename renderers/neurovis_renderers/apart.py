"""What stands apart in a film: groups as they are at several frames, drawn at once.

In: groups at some frames. Out: of each the pixels of a band that it covers. Groups are small, so that drawing one takes
about as long as drawing several: each lies on a page of its own, as wide as the widest and one beneath the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from neurovis_renderers import coverage
from neurovis_renderers.canvas import Portion, composed, veiled
from neurovis_renderers.coverage import Fragments, Size
from neurovis_renderers.sheet import WHOLE, Sheet, Words, bytes_of, lanes_of
from neurovis_spec.scene import Group, IntArray, Polygon, Polyline

#: Frames that are drawn at once.
FRAMES = 8
#: Fragments that a group may have, and pixels of pages, that are drawn at once, whatever hides them.
_MOST, _MOST_PIXELS = 1 << 22, 1 << 23
#: Pixels that are left around what may be seen of a group, before it and behind it.
_BEFORE, _BEHIND = 2, 3


@dataclass(frozen=True, slots=True)
class Laid:
    """A group as it lies over a band: fragments, one a pixel, each of its own colour; and other pixels, which it
    covers, and how they look."""

    fragments: Fragments
    colours: IntArray
    covered: IntArray
    covering: Words

    def as_fragments(self, place: int) -> tuple[Fragments, IntArray]:
        """All of it as fragments of a shape at a place in an order, and their colours."""
        some, pixels = self.fragments, np.concatenate([self.fragments.pixels, self.covered])
        shares = np.concatenate([some.shares, np.ones(len(self.covered), np.float32)])
        colours = np.concatenate([self.colours, lanes_of(self.covering)])
        return Fragments(np.full(len(pixels), place), pixels, shares), colours

    def faint(self, opacity: float) -> Laid:
        """The same seen in part."""
        fragments, colours = self.as_fragments(0)
        weights = fragments.shares * WHOLE
        return Laid(replace(fragments, shares=weights * np.float32(opacity / WHOLE)), colours, _NONE, _NO_WORDS)


_NONE: IntArray = np.empty(0, np.int64)
_NO_WORDS: Words = np.empty(0, np.uint32)
NOTHING = Laid(coverage.NOTHING, _NONE, _NONE, _NO_WORDS)


def laid(groups: Sequence[Group], density: float, top: int, size: Size) -> list[Laid]:
    """Groups over the band of a size that begins with row ``top``."""
    found: dict[int, Laid] = {}
    for filled in (True, False):
        some = [number for number, group in enumerate(groups) if _is_filled(group) == filled]
        if some:
            found.update(zip(some, _laid([groups[number] for number in some], density, top, size), strict=True))
    return [found[number] for number in range(len(groups))]


def _is_filled(group: Group) -> bool:
    """Whether there are polygons in a group: what they cover is looked up for all pixels of their pages."""
    return any(isinstance(shape, Polygon) or (isinstance(shape, Polyline) and shape.round) for shape in group.shapes)


def _laid(groups: Sequence[Group], density: float, top: int, size: Size) -> list[Laid]:
    """The same of groups of which all have polygons, or none has."""
    sheet = Sheet([replace(group, opacity=1.0) for group in groups], density, bars=True)
    page_of = np.repeat(np.arange(len(groups)), np.diff(sheet.firsts, append=len(sheet)))
    low, above = sheet.extents(page_of, len(groups))
    shift = np.array([0, top])
    begins = np.clip(low - shift - _BEFORE, 0, size).astype(np.int64)
    extents = np.clip(above - shift + _BEHIND, 0, size).astype(np.int64) - begins
    seen = (extents > 0).all(axis=1)
    if not seen.all():
        chosen = [group for group, there in zip(groups, seen.tolist(), strict=True) if there]
        found = iter(_laid(chosen, density, top, size) if chosen else ())
        return [next(found) if there else NOTHING for there in seen.tolist()]
    pages = _Pages(begins, extents)
    much = sheet.most(page_of, extents) > _MOST
    if len(groups) > 1 and (much or pages.pixels > _MOST_PIXELS):
        half = len(groups) // 2
        return [*_laid(groups[:half], density, top, size), *_laid(groups[half:], density, top, size)]
    opacities = [group.opacity for group in groups]
    if much:
        corner, (wide, high) = (int(begins[0, 0]), int(begins[0, 1]) + top), extents[0].tolist()
        fragments, colours, _ = veiled(sheet, 0, len(sheet), corner, (wide, high), opacities[0])
        return [Laid(*each, _NONE, _NO_WORDS) for each in pages.apart(size, fragments, colours)]
    return _at_once(sheet.on_pages(page_of, begins + shift, pages.wide, extents[:, 1]), pages, size, opacities)


@dataclass(frozen=True)
class _Pages:
    """Pages of one width, one beneath the other: which pixel of a band is the first of each, and how much of it may be
    drawn on, (pages, 2)."""

    begins: IntArray
    extents: IntArray

    @cached_property
    def wide(self) -> int:
        """How wide they are."""
        return int(self.extents[:, 0].max())

    @cached_property
    def pixels(self) -> int:
        """How many pixels they have together."""
        return self.wide * int(self.extents[:, 1].sum())

    def over(self, size: Size, pixels: IntArray) -> tuple[IntArray, IntArray]:
        """Where pixels of pages lie over a band of a size, and the page of each: the number of pages where they lie
        outside of theirs."""
        wide, rows, (x, y) = self.wide, self.extents[:, 1], self.begins.T
        line = pixels // wide
        page = np.repeat(np.arange(len(y)), rows)[line]
        over = line * (size[0] - wide)
        over += pixels
        over += ((y + rows - np.cumsum(rows)) * size[0] + x)[page]
        if (self.begins + self.extents == size)[:, 0].any():  # where the band ends, so does what is seen
            page[pixels - line * wide >= self.extents[page, 0]] = len(y)
        return over, page

    def apart(self, size: Size, fragments: Fragments, colours: IntArray) -> list[tuple[Fragments, IntArray]]:
        """Fragments of each page by themselves, as they lie over a band, and their colours."""
        over, page = self.over(size, fragments.pixels)
        order = np.argsort(page.astype(np.uint16), kind="stable")
        ends = np.searchsorted(page[order], np.arange(len(self.begins) + 1)).tolist()
        found, colours = Fragments(fragments.owners, over, fragments.shares).only(order), colours[order]
        return [(found.only(slice(*some)), colours[slice(*some)]) for some in pairwise(ends)]

    def covered(self, size: Size, pixels: IntArray, words: Words) -> list[tuple[IntArray, Words]]:
        """The same of pixels in order that are covered."""
        over, page = self.over(size, pixels)
        inside = page < len(self.begins)
        if not inside.all():
            over, page, words = over[inside], page[inside], words[inside]
        ends = np.searchsorted(page, np.arange(len(self.begins) + 1)).tolist()
        return [(over[slice(*some)], words[slice(*some)]) for some in pairwise(ends)]


def _at_once(sheet: Sheet, pages: _Pages, size: Size, opacities: Sequence[float]) -> list[Laid]:
    """What is seen of shapes on pages, as it lies over a band of a size."""
    front, corner, extent = len(sheet), (0, 0), (pages.wide, 0)
    strokes, heads = sheet.strokes(sheet.pieces, corner, extent, None), sheet.heads(0, front, corner, extent)
    fragments = Portion(front, sheet.solid(0, front, corner, extent), strokes, heads).fragments(sheet)
    made = composed(fragments, sheet.filled(0, front, corner, extent), sheet.paints, front, pages.pixels)
    shares = made.weights * np.float32(1 / WHOLE)
    parts = pages.apart(size, Fragments(made.pixels, made.pixels, shares), made.colours)
    covered = pages.covered(size, made.covered, bytes_of(sheet.paints)[made.by])
    found = [Laid(*part, *over) for part, over in zip(parts, covered, strict=True)]
    return [one if opacity == 1 else one.faint(opacity) for one, opacity in zip(found, opacities, strict=True)]
