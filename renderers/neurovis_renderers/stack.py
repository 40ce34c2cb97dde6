"""A stack: fragments over the pixels of a picture, composed from the front to the back.

In: fragments, later ones always further back. Out: for each pixel the sum of what is seen, and how much is seen of what
is still further back. What lies behind pixels that are covered is never looked at.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from neurovis_renderers.coverage import BoolArray, Fragments, IntArray, Numbers
from neurovis_renderers.sheet import LANE, WHOLE

#: A pixel of whose weight no more than this is left shows nothing further back.
_COVERED = WHOLE // 512
#: Bits of a key: pixels of a stack, shapes and fragments that are composed at once.
PIXEL_BITS, ORDER_BITS, INDEX_BITS = 21, 20, 22


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


def slots(fragments: Fragments, front: int) -> Slots:
    """Sort fragments by their pixels, in each from the front to the back: ``front`` is above every owner. Of several
    that one shape has in a pixel, the one that covers most is taken."""
    number = np.arange(len(fragments))
    key = ((fragments.pixels << ORDER_BITS) + (front - fragments.owners) << INDEX_BITS) + number
    key.sort()
    order = key & ((1 << INDEX_BITS) - 1)
    key >>= INDEX_BITS
    again = key[1:] == key[:-1]
    if again.any():
        kept = _most(order, key, again, fragments.shares)
        order, key = order[kept], key[kept]
    key >>= ORDER_BITS
    begins = np.flatnonzero(np.concatenate([np.ones(min(1, len(key)), bool), key[1:] != key[:-1]]))
    counts = np.diff(begins, append=len(key))
    deepest = np.argsort(np.minimum(65535, counts).astype(np.uint16) ^ np.uint16(65535), kind="stable")
    return Slots(key[begins][deepest], counts[deepest], begins[deepest], order)


def _most(order: IntArray, key: IntArray, again: BoolArray, shares: Numbers) -> BoolArray:
    """Which to keep where of several with the same key the one with the greatest share stays; ``again`` says of all
    but the first whether its key is that of the one before."""
    several = np.zeros(len(key), bool)
    several[1:] |= again
    several[:-1] |= again
    kept, some = ~several, np.flatnonzero(several)
    ranked = some[np.lexsort((-shares[order[some]], key[some]))]
    kept[ranked[np.concatenate([[True], key[ranked[1:]] != key[ranked[:-1]]])]] = True
    return kept


class Stack:
    """What has been composed of the pixels of a picture: sums of packed colours times weights, and the weight left."""

    def __init__(self, pixels: int) -> None:
        self.sums: IntArray = np.zeros(pixels, np.int64)
        self.left: Numbers = np.full(pixels, WHOLE, np.float32)
        self.covered: BoolArray = np.zeros(pixels, bool)

    def add(self, fragments: Fragments, colours: IntArray, front: int) -> None:
        """Put fragments behind all that is there; ``colours`` are those of their owners."""
        by_pixel = slots(fragments, front)
        left, sums = self.left[by_pixel.pixels], self.sums[by_pixel.pixels]
        for end, which in by_pixel.each():
            weight = np.rint(left[:end] * fragments.shares[which])
            left[:end] -= weight
            sums[:end] += weight.astype(np.int64) * colours[fragments.owners[which]]
        self.left[by_pixel.pixels], self.sums[by_pixel.pixels] = left, sums
        self.covered[by_pixel.pixels] = left <= _COVERED

    def veil(self, opacity: float) -> tuple[Fragments, IntArray, int]:
        """What has been composed as one, seen in part: a fragment for each pixel, their colours, and the place above
        them."""
        pixels = np.flatnonzero(self.left < WHOLE)
        weight = WHOLE - self.left[pixels]
        whole, sums = weight.astype(np.int64), self.sums[pixels]
        colours = np.zeros(len(pixels), np.int64)
        for lane in range(0, 3 * LANE, LANE):
            colours |= ((sums >> lane & (1 << LANE) - 1) + whole // 2) // whole << lane
        shares = (weight * np.float32(opacity / WHOLE)).astype(np.float32)
        return Fragments(np.arange(len(pixels)), pixels, shares), colours, len(pixels)

    def over(self, background: int) -> IntArray:
        """The sums with a background behind all."""
        return self.sums + self.left.astype(np.int64) * background
