"""Halves: ranks that are symmetric about an axis, from the order of those that stand before it.

In: Levels, and which of their nodes are mirror images of each other. Out: ranks in which images stand as far from the
middle as each other, and what is nobody's image in the middle. Where nothing has an image, all is in the middle.
"""

from __future__ import annotations

import numpy as np

from neurovis_layouts.layered.crossings import Ints
from neurovis_layouts.layered.levels import Levels


class Halves:
    """``image`` (n,) of each node, itself where it has none; ``side`` (n,) where it stands: -1 before the axis, which
    is the one of a pair that comes first in its rank, 0 in the middle, 1 behind."""

    def __init__(self, levels: Levels) -> None:
        self.image: Ints = np.arange(len(levels.nodes), dtype=np.int64)
        if levels.images:
            self.image[list(levels.images)] = list(levels.images.values())
        place = np.zeros(len(levels.nodes), dtype=np.int64)
        for rank in levels.ranks:
            place[rank] = np.arange(len(rank), dtype=np.int64)
        self.side: Ints = np.sign(place - place[self.image])

    def whole(self, rank: Ints) -> Ints:
        """A rank with those before the axis and those in the middle in the order in which they are in this one."""
        side = self.side[rank]
        before = rank[side < 0]
        return np.concatenate((before, rank[side == 0], self.image[before[::-1]])) if len(before) else rank
