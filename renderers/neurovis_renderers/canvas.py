"""A canvas: a Scene as pixels, drawn from the front to the back, so that what others hide costs next to nothing.

In: a Scene. Out: its pixels. A big picture is drawn in bands, one after the other, and the shapes of a band in
portions: what it takes of memory grows with the picture only by its bytes. The fragments of a band go on a Stack, later
ones always further back: for each pixel it has the sum of what is seen, and how much is seen of what is still further
back; what lies behind pixels that are covered is never looked at.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from neurovis_renderers import coverage
from neurovis_renderers.coverage import LEAST, BoolArray, Filled, Fragments, Heads, Numbers, Pieces, Size, Strokes
from neurovis_renderers.sheet import LANE, WHOLE, Sheet, lanes, packed, unpacked
from neurovis_spec.scene import FloatArray, IntArray, Scene

Pixels = npt.NDArray[np.uint8]

#: Pixels that are drawn at a time: a picture that has more is drawn in bands, one after the other.
MOST_AT_ONCE = 1 << 21
#: Shapes, pieces of lines, and pixels that may be touched, that are drawn at a time.
_MOST_SHAPES, _MOST_PIECES, _MOST_TOUCHED = 1 << 18, 1 << 16, 1 << 20
#: Pixels along the side of a block: a piece of which all blocks are covered is not looked at.
_BLOCK = 8
#: So few pieces are drawn without looking whether they are covered.
_FEW = 256
#: A pixel of whose weight no more than this is left shows nothing further back.
COVERED = WHOLE // 512
#: Bits of a key: what a whole number of 64 bits holds beside its sign.
_BITS = 63


def paint(scene: Scene) -> Pixels:
    """The picture, (height, width, 3)."""
    wide, high = scene.pixels
    sheet, background = Sheet(scene.groups, scene.density), packed(scene.theme.background)
    picture = np.empty((high, wide, 3), np.uint8)
    for top, size in bands((wide, high)):
        stack = Stack(size[0] * size[1])
        for low, above, opacity in reversed(sheet.parts()):
            if opacity == 1:
                for portion in portions(sheet, low, above, (0, top), size, stack.covered):
                    _put(stack, sheet, portion)
            else:
                stack.add(*veiled(sheet, low, above, (0, top), size, opacity))
        picture[top : top + size[1]] = unpacked(stack.over(background)).reshape(size[1], wide, 3)
    return picture


def _put(stack: Stack, sheet: Sheet, portion: Portion) -> None:
    fragments = portion.fragments(sheet)
    stack.add(fragments, sheet.paints[fragments.owners], portion.front)


def veiled(
    sheet: Sheet, low: int, above: int, corner: Size, size: Size, opacity: float
) -> tuple[Fragments, IntArray, int]:
    """Shapes ``low`` to ``above`` drawn by themselves and then in part: a fragment a pixel, each of its own colour, and
    the place above them. The picture's first pixel is the sheet's ``corner``."""
    inner = Stack(size[0] * size[1])
    for portion in portions(sheet, low, above, corner, size, inner.covered):
        _put(inner, sheet, portion)
    return inner.veil(opacity)


@dataclass(frozen=True, slots=True)
class Composed:
    """Pixels in which anything is seen, the colour of each, and its weight; and apart from these, in order, those in
    which one shape alone is seen, which covers them, and which it is."""

    pixels: IntArray
    colours: IntArray
    weights: Numbers
    covered: IntArray
    by: IntArray


def composed(fragments: Fragments, filled: Filled, paints: IntArray, front: int, pixels: int) -> Composed:
    """Fragments of few shapes, and polygons, in a picture of so many pixels, composed at once."""
    if not len(filled.front):
        return _mostly_alone(fragments, paints, front, pixels)
    return _over_filled(coverage.joined([filled.edges, fragments], coverage.NOTHING), filled.front, paints, front)


def _over_filled(fragments: Fragments, behind: npt.NDArray[np.int32], paints: IntArray, front: int) -> Composed:
    """The same over polygons, of which ``behind`` says which is the foremost that covers all of a pixel; it is used
    up."""
    whole = fragments.only(np.flatnonzero(fragments.shares >= 1))
    np.maximum.at(behind, whole.pixels, whole.owners.astype(np.int32))
    seen = (fragments.shares < 1) & (fragments.owners > behind[fragments.pixels])
    some = fragments.only(np.flatnonzero(seen))
    one, several = _told_apart(some, len(behind))
    by_pixel, weights = slots(several, front), np.rint(WHOLE * one.shares)
    left, sums = by_pixel.composed(several.shares, paints[several.owners])
    pixels = np.concatenate([by_pixel.pixels, one.pixels])
    left = np.concatenate([left, WHOLE - weights])
    sums = np.concatenate([sums, weights.astype(np.int64) * paints[one.owners]])
    under = behind[pixels]
    sums += np.where(under < 0, 0, left.astype(np.int64) * paints[under])
    left[under >= 0] = 0
    behind[pixels] = -1
    covered = np.flatnonzero(behind >= 0)
    return Composed(pixels, *_shades(sums, left), covered, behind[covered].astype(np.int64))


def _mostly_alone(fragments: Fragments, paints: IntArray, front: int, pixels: int) -> Composed:
    """The same where most pixels have one fragment alone, which needs no sorting."""
    some, several = _told_apart(fragments, pixels)
    by_pixel = slots(several, front)
    left, sums = by_pixel.composed(several.shares, paints[several.owners])
    colours, weights = _shades(sums, left)
    none = np.empty(0, np.int64)
    return Composed(
        np.concatenate([by_pixel.pixels, some.pixels]),
        np.concatenate([colours, paints[some.owners]]),
        np.concatenate([weights, np.rint(WHOLE * some.shares)]),
        none,
        none,
    )


def _told_apart(fragments: Fragments, pixels: int) -> tuple[Fragments, Fragments]:
    """Those that are alone in their pixel, and the others."""
    every = np.arange(len(fragments), dtype=np.int32)
    last = np.empty(pixels, np.int32)
    last[fragments.pixels] = every
    last[fragments.pixels[last[fragments.pixels] != every]] = -1
    alone = last[fragments.pixels] >= 0
    return fragments.only(np.flatnonzero(alone)), fragments.only(np.flatnonzero(~alone))


def bands(size: Size) -> Iterator[tuple[int, Size]]:
    """The bands of a picture: the row that each begins with, and its size."""
    rows = max(1, MOST_AT_ONCE // size[0])
    for top in range(0, size[1], rows):
        yield top, (size[0], min(rows, size[1] - top))


@dataclass(frozen=True, slots=True)
class Portion:
    """Some shapes of a band, those before ``front`` in the order: what they touch of pixels that are not covered."""

    front: int
    solid: Fragments
    strokes: Strokes
    heads: Heads

    def fragments(self, sheet: Sheet) -> Fragments:
        """All of it, with lines and heads as wide as the sheet says."""
        parts, (strokes, heads) = [self.solid], (self.strokes, self.heads)
        if len(strokes):
            parts.append(Fragments(strokes.owners, strokes.pixels, sheet.stroke_shares(strokes)))
        if len(heads):
            parts.append(Fragments(heads.owners, heads.pixels, sheet.head_shares(heads)))
        found = coverage.joined(parts, coverage.NOTHING)
        there = found.shares > LEAST
        return found if there.all() else found.only(there)


def portions(sheet: Sheet, low: int, high: int, corner: Size, size: Size, covered: BoolArray) -> Iterator[Portion]:
    """Shapes ``low`` to ``high`` in a band, from the front to the back in portions. Whoever reads them marks the pixels
    that are ``covered`` by then: these get no more."""
    while high > low:
        least, pieces = _portion(sheet, low, high, corner, size, covered)
        filled = sheet.filled(least, high, corner, size).fragments()
        solid = coverage.joined([sheet.solid(least, high, corner, size), filled], coverage.NOTHING)
        solid = solid.only(~covered[solid.pixels])
        heads = sheet.heads(least, high, corner, size)
        heads = heads.only(~covered[heads.pixels])
        first, *others = _in_parts(pieces, _touched(sheet, pieces, size))
        yield Portion(high, solid, sheet.strokes(first, corner, size, covered), heads)
        for some in others:  # of one shape that is larger than what is drawn at once
            strokes = sheet.strokes(some, corner, size, covered)
            yield Portion(high, coverage.NOTHING, strokes, heads.only(np.zeros(len(heads), bool)))
        high = least


def _portion(sheet: Sheet, low: int, high: int, corner: Size, size: Size, covered: BoolArray) -> tuple[int, Pieces]:
    """The next shapes from ``high`` down that are drawn at once: the first of them, and their pieces that are seen."""
    area = np.minimum(np.cumsum(sheet.areas[low:high][::-1]), np.inf)
    least = max(low, high - _MOST_SHAPES, high - max(1, int(np.searchsorted(area, _MOST_TOUCHED, side="right"))))
    owners = sheet.pieces.owners
    begin, end = np.searchsorted(owners, (least, high))
    if end - begin > _MOST_PIECES:
        begin = end - _MOST_PIECES
        least = min(int(owners[begin - 1]) + 1, high - 1)
        begin = int(np.searchsorted(owners, least))
    pieces = _seen(sheet, sheet.pieces.only(slice(begin, end)), corner, size, covered)
    total = np.cumsum(_touched(sheet, pieces, size)[::-1])[::-1]
    if len(total) and total[0] > _MOST_TOUCHED:
        beyond = int(np.searchsorted(-total, -_MOST_TOUCHED))
        least = max(least, min(int(pieces.owners[beyond - 1]) + 1, high - 1))
        pieces = pieces.only(pieces.owners >= least)
    return least, pieces


def _touched(sheet: Sheet, pieces: Pieces, size: Size) -> FloatArray:
    """How many pixels pieces touch, about."""
    halves = sheet.halves[pieces.owners]
    length = np.abs(pieces.ends - pieces.starts).max(axis=1) + 1 + halves * (pieces.before + pieces.after)
    result: FloatArray = np.minimum(length, max(size)) * np.minimum(2.9 * halves + 2, max(size))
    return result


def _in_parts(pieces: Pieces, touched: FloatArray) -> list[Pieces]:
    """Pieces, from the last to the first, as many at a time as touch no more pixels than are drawn at once."""
    part = (np.cumsum(touched[::-1])[::-1] / _MOST_TOUCHED).astype(np.int64)
    return [pieces.only(part == number) for number in np.unique(part).tolist()] or [pieces]


def _seen(sheet: Sheet, pieces: Pieces, corner: Size, size: Size, covered: BoolArray) -> Pieces:
    """Pieces without those that lie outside the band, or behind what is covered."""
    low, high = coverage.extent(pieces, sheet.halves[pieces.owners].astype(float))
    shift = np.array(corner)
    low, high = low - shift, high - shift
    inside = ((low < size) & (high > 0)).all(axis=1)
    if len(pieces) < _FEW:
        return pieces.only(inside)
    across, down = -(-size[0] // _BLOCK), -(-size[1] // _BLOCK)
    padded = np.ones((down * _BLOCK, across * _BLOCK), bool)
    padded[: size[1], : size[0]] = covered.reshape(size[1], size[0])
    open_blocks = ~padded.reshape(down, _BLOCK, across, _BLOCK).all(axis=(1, 3))
    sums = np.zeros((down + 1, across + 1), np.int32)
    sums[1:, 1:] = open_blocks.cumsum(axis=0).cumsum(axis=1)
    x0, y0 = np.clip(low // _BLOCK, 0, (across, down)).astype(np.int64).T
    x1, y1 = np.clip(high // _BLOCK + 1, 0, (across, down)).astype(np.int64).T
    return pieces.only(inside & (sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0] > 0))


@dataclass(frozen=True, slots=True)
class Slots:
    """Fragments by pixel: the fragments of the pixels that have most come first. Of pixel ``pixels[k]`` fragment ``r``
    from the front is ``order[begins[k] + r]``, and ``counts`` says how many there are."""

    pixels: IntArray
    counts: IntArray
    begins: IntArray
    order: IntArray

    def each(self) -> Iterator[tuple[int, IntArray]]:
        """From the front to the back: how many pixels have one more fragment, the first so many, and which it is."""
        deepest = int(self.counts[0]) if len(self.counts) else 0
        # counts fall, so those that have more than r are the first
        ends = np.searchsorted(-self.counts, -np.arange(deepest), side="left")
        for depth, end in enumerate(ends.tolist()):
            yield end, self.order[self.begins[:end] + depth]

    def compose(self, shares: Numbers, colours: IntArray, left: Numbers, sums: IntArray) -> None:
        """Put the fragments behind what is there of each of the pixels: its ``sums``, and the weight ``left``."""
        for end, which in self.each():
            weight = np.rint(left[:end] * shares[which])
            left[:end] -= weight
            sums[:end] += weight.astype(np.int64) * colours[which]

    def composed(self, shares: Numbers, colours: IntArray) -> tuple[Numbers, IntArray]:
        """The same of pixels that are empty: the weight that is left of each, and its sums."""
        left, sums = np.full(len(self.pixels), WHOLE, np.float32), np.zeros(len(self.pixels), np.int64)
        self.compose(shares, colours, left, sums)
        return left, sums


def slots(fragments: Fragments, front: int, rank: Numbers | None = None) -> Slots:
    """Sort fragments by their pixels, in each from the front to the back: ``front`` is above every owner. Of several
    that one shape has in a pixel, the one of the highest rank is taken, which is what covers most."""
    depth = front - fragments.owners
    deep, many = int(depth.max(initial=0)).bit_length(), len(fragments).bit_length()
    key = (fragments.pixels << deep) + depth
    if int(fragments.pixels.max(initial=0)).bit_length() + deep + many > _BITS:
        order = np.argsort(key)
        key = key[order]
    else:  # sorting numbers that say where they were is quicker than sorting where they were
        key <<= many
        key += np.arange(len(key))
        key.sort()
        order = key & ((1 << many) - 1)
        key >>= many
    again = key[1:] == key[:-1]
    if again.any():
        kept = _highest(order, key, again, fragments.shares if rank is None else rank)
        order, key = order[kept], key[kept]
    key >>= deep
    begins = np.flatnonzero(np.concatenate([np.ones(min(1, len(key)), bool), key[1:] != key[:-1]]))
    counts = np.diff(begins, append=len(key))
    deepest = np.argsort(np.minimum(65535, counts).astype(np.uint16) ^ np.uint16(65535), kind="stable")
    return Slots(key[begins][deepest], counts[deepest], begins[deepest], order)


def _highest(order: IntArray, key: IntArray, again: BoolArray, rank: Numbers) -> BoolArray:
    """Which to keep where of several with the same key the one of the highest rank stays; ``again`` says of all
    but the first whether its key is that of the one before."""
    several = np.zeros(len(key), bool)
    several[1:] |= again
    several[:-1] |= again
    kept, some = ~several, np.flatnonzero(several)
    ranked = some[np.lexsort((-rank[order[some]], key[some]))]
    kept[ranked[np.concatenate([[True], key[ranked[1:]] != key[ranked[:-1]]])]] = True
    return kept


def _foremost(fragments: Fragments, pixels: int) -> IntArray:
    """Of each pixel the foremost shape that covers all of it, −1 where none does."""
    whole = fragments.shares >= 1
    front = np.full(pixels, -1, np.int64)
    np.maximum.at(front, fragments.pixels[whole], fragments.owners[whole])
    return front


def _in_front(fragments: Fragments, pixels: int) -> IntArray:
    """Which fragments do not lie behind one that covers all of its pixel: of many that lie behind each other few do."""
    return np.flatnonzero(fragments.owners >= _foremost(fragments, pixels)[fragments.pixels])


def _shades(sums: IntArray, left: Numbers) -> tuple[IntArray, Numbers]:
    """What has been composed of some pixels as one: their colours, and how much each weighs."""
    weight = WHOLE - left
    colours, some = lanes(sums), np.flatnonzero(left)
    whole, sums = weight[some].astype(np.int64), sums[some]
    parts = np.zeros(len(some), np.int64)
    for lane in range(0, 3 * LANE, LANE):
        parts |= ((sums >> lane & (1 << LANE) - 1) + whole // 2) // whole << lane
    colours[some] = parts
    return colours, weight


class Stack:
    """What has been composed of the pixels of a picture: sums of packed colours times weights, and the weight left."""

    def __init__(self, pixels: int) -> None:
        self.sums: IntArray = np.zeros(pixels, np.int64)
        self.left: Numbers = np.full(pixels, WHOLE, np.float32)
        self.covered: BoolArray = np.zeros(pixels, bool)

    def add(self, fragments: Fragments, colours: IntArray, front: int) -> None:
        """Put fragments of these colours behind all that is there."""
        seen = _in_front(fragments, len(self.left))
        fragments, colours = fragments.only(seen), colours[seen]
        by_pixel = slots(fragments, front)
        left, sums = self.left[by_pixel.pixels], self.sums[by_pixel.pixels]
        by_pixel.compose(fragments.shares, colours, left, sums)
        self.left[by_pixel.pixels], self.sums[by_pixel.pixels] = left, sums
        self.covered[by_pixel.pixels] = left <= COVERED

    def veil(self, opacity: float) -> tuple[Fragments, IntArray, int]:
        """What has been composed as one, seen in part: a fragment for each pixel, their colours, and the place above
        them."""
        pixels = np.flatnonzero(self.left < WHOLE)
        colours, weight = _shades(self.sums[pixels], self.left[pixels])
        shares = weight * np.float32(opacity / WHOLE)
        return Fragments(np.arange(len(pixels)), pixels, shares), colours, len(pixels)

    def over(self, background: int) -> IntArray:
        """The sums with a background behind all."""
        return self.sums + self.left.astype(np.int64) * background
