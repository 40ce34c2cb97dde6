"""Flips: frames are replaced by their mirror images where that saves crossings.

In: Levels in order, and which frames may be reflected. Out: Levels in which some are reflected, and which.
"""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

import numpy as np

from neurovis_layouts.layered.crossings import Segments
from neurovis_layouts.layered.levels import Levels
from neurovis_layouts.layered.order import places

#: So often each frame is tried.
_ROUNDS = 2


def reflected(levels: Levels, order: Sequence[Sequence[int]], may: AbstractSet[int]) -> tuple[Levels, set[int]]:
    """The levels with some frames reflected, and the first neurons of these; ``may`` are first neurons of frames."""
    first = {n: min(m for m, _, _ in node.members) for n, node in enumerate(levels.nodes) if node.members}
    wide = {n for n, node in enumerate(levels.nodes) if any(x for _, x, _ in node.members)}
    frames = [n for rank in order for n in rank if n in wide and first[n] in may]
    if not frames:
        return levels, set()
    segments, place = Segments(levels), places(len(levels.nodes), order)
    turned = np.zeros(len(levels.nodes), dtype=np.bool_)
    least = segments.count(place, turned)
    for _ in range(_ROUNDS):
        before = least
        for node in frames:
            turned[node] = not turned[node]
            count = segments.count(place, turned)
            if count < least:
                least = count
            else:
                turned[node] = not turned[node]
        if least == before:
            break
    side = np.where(turned, -1.0, 1.0).tolist()
    nodes = [
        replace(node, members=tuple((m, x * side[n] + 0.0, y) for m, x, y in node.members))
        for n, node in enumerate(levels.nodes)
    ]
    gaps = [
        [replace(s, a=s.a * side[s.upper] + 0.0, b=s.b * side[s.lower] + 0.0) for s in gap] for gap in levels.segments
    ]
    ends = {i: (up, a * side[up] + 0.0, low, b * side[low] + 0.0) for i, (up, a, low, b) in levels.ends.items()}
    flipped = {first[n] for n in np.flatnonzero(turned).tolist()}
    return replace(levels, nodes=nodes, segments=gaps, ends=ends), flipped
