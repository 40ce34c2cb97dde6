"""A stack: fragments over the pixels of a picture, composed from the front to the back.

In: fragments, later ones always further back. Out: for each pixel the sum of what is seen, and how much is seen of what
is still further back. What lies behind pixels that are covered is never looked at.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from neurovis_renderers.coverage import BoolArray, Fragments, Numbers
from neurovis_renderers.sheet import LANE, WHOLE
from neurovis_spec.scene import IntArray

#: A pixel of whose weight no more than this is left shows nothing further back.
COVERED = WHOLE // 512
#: Bits of a key: what a whole number of 64 bits holds beside its sign.
_BITS = 63


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


class Stack:
    """What has been composed of the pixels of a picture: sums of packed colours times weights, and the weight left."""

    def __init__(self, pixels: int) -> None:
        self.sums: IntArray = np.zeros(pixels, np.int64)
        self.left: Numbers = np.full(pixels, WHOLE, np.float32)
        self.covered: BoolArray = np.zeros(pixels, bool)

    def add(self, fragments: Fragments, colours: IntArray, front: int) -> None:
        """Put fragments of these colours behind all that is there."""
        by_pixel = slots(fragments, front)
        left, sums = self.left[by_pixel.pixels], self.sums[by_pixel.pixels]
        for end, which in by_pixel.each():
            weight = np.rint(left[:end] * fragments.shares[which])
            left[:end] -= weight
            sums[:end] += weight.astype(np.int64) * colours[which]
        self.left[by_pixel.pixels], self.sums[by_pixel.pixels] = left, sums
        self.covered[by_pixel.pixels] = left <= COVERED

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
