"""Flips: frames are replaced by their mirror images where that saves crossings, and so is the whole where it then reads
better: a drawing in ranks and its mirror image cross as often, so that names may choose between the two.

In: Levels in order, and which frames may be reflected. Out: Levels in which some are reflected, in which order, and
which these are. What may not be reflected, such as a row that is asked for, changes only its place. If C leads to B,
and D to A, the frame of A and B is turned::

     C   D           C   D
       X       →     |   |
    [A   B]         [B   A]
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from itertools import groupby
from operator import itemgetter
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_layouts.layered.crossings import Segments, inversions
from neurovis_layouts.layered.levels import Levels
from neurovis_layouts.layered.order import Order, places

Bools: TypeAlias = npt.NDArray[np.bool_]

#: So often each frame is tried.
_ROUNDS = 2


@dataclass(frozen=True, slots=True)
class Reading:
    """What a drawing is read by: the place of each neuron among all; where across those stand that stand somewhere
    already; the connections, from neuron to neuron; and who has none, and stays at the end of its rank."""

    place: Mapping[int, int]
    known: Mapping[int, float]
    flow: Sequence[tuple[int, int]]
    loose: AbstractSet[int]


def reflected(
    levels: Levels, order: Order, may: AbstractSet[int], reading: Reading | None = None
) -> tuple[Levels, Order, set[int]]:
    """The levels with some frames reflected, in the order given or, with a ``reading``, in the one turned round where
    that reads better and crosses no more; and the first neurons of the frames that are reflected. ``may`` are first
    neurons of frames."""
    first = {n: min(m for m, _, _ in node.members) for n, node in enumerate(levels.nodes) if node.members}
    wide = {n for n, node in enumerate(levels.nodes) if len(node.members) > 1 and any(x for _, x, _ in node.members)}
    frames = [n for rank in order for n in rank if n in wide and first[n] in may]
    turned = np.zeros(len(levels.nodes), dtype=np.bool_)
    segments = Segments(levels) if frames or (reading and wide) else None
    least, turned = _fewest(segments, order, frames, turned)
    if reading:
        other, image = _turned_round(levels, order, reading.loose), turned.copy()
        image[frames] = ~turned[frames]
        if _misread(levels, other, image, reading) < _misread(levels, order, turned, reading):
            count, image = _fewest(segments, other, frames, image)
            if count <= least:
                order, turned = other, image
    return _with(levels, turned), order, {first[n] for n in np.flatnonzero(turned).tolist()}


def _fewest(segments: Segments | None, order: Order, frames: Sequence[int], turned: Bools) -> tuple[int, Bools]:
    """How many segments cross, and which nodes are turned, once each of the frames has been turned where that saves
    crossings, and back where it saves none."""
    if segments is None:
        return 0, turned
    place, turned = places(len(turned), order), turned.copy()
    least = segments.count(place, turned)
    for _ in range(_ROUNDS):
        before = turned.copy()
        for node in frames:
            turned[node] = not turned[node]
            count = segments.count(place, turned)
            if count < least or (count == least and not turned[node]):
                least = count
            else:
                turned[node] = not turned[node]
        if (turned == before).all():
            break
    return least, turned


def _with(levels: Levels, turned: Bools) -> Levels:
    """The levels with these nodes reflected."""
    if not turned.any():
        return levels
    side = np.where(turned, -1.0, 1.0).tolist()
    nodes = [
        replace(node, members=tuple((m, x * side[n] + 0.0, y) for m, x, y in node.members))
        for n, node in enumerate(levels.nodes)
    ]
    gaps = [
        [replace(s, a=s.a * side[s.upper] + 0.0, b=s.b * side[s.lower] + 0.0) for s in gap] for gap in levels.segments
    ]
    ends = {i: (up, a * side[up] + 0.0, low, b * side[low] + 0.0) for i, (up, a, low, b) in levels.ends.items()}
    return replace(levels, nodes=nodes, segments=gaps, ends=ends)


def _turned_round(levels: Levels, order: Order, loose: AbstractSet[int]) -> Order:
    """Every rank the other way round, but what is connected to nothing at its end, or at that of its box."""
    result: Order = []
    for rank in order:
        begin: dict[int, int] = {}
        keys: list[tuple[bool, int, bool, int, int]] = []
        for place, n in enumerate(rank):
            node = levels.nodes[n]
            alone = bool(node.members) and node.members[0][0] in loose
            start = begin.setdefault(node.box, place) if node.box >= 0 else place
            keys.append((alone and node.box < 0, -start, alone, place if alone else -place, n))
        result.append([n for *_, n in sorted(keys)])
    return result


def _misread(levels: Levels, order: Order, turned: Bools, reading: Reading) -> tuple[int, int, int, int]:
    """How many pairs of neurons in a rank stand the other way round: than they are known to stand, then than their
    group has them, then than signals run from the one to the other, then than they are read."""
    kin = 0
    for rank in order:
        families: dict[tuple[int, int], list[int]] = {}
        for node in (levels.nodes[n] for n in rank):
            if node.kin >= 0:
                families.setdefault((node.kin, node.box), []).append(min(reading.place[m] for m, _, _ in node.members))
        kin += sum(inversions(np.array(family)) for family in families.values() if len(family) > 1)
    known = _inverted(levels, order, turned, reading.known) if reading.known else 0
    return known, kin, _backwards(levels, order, turned, reading.flow), _inverted(levels, order, turned, reading.place)


def _backwards(levels: Levels, order: Order, turned: Bools, flow: Sequence[tuple[int, int]]) -> int:
    """How many more connections within a rank, or a row of a block, run back to what stands before than on."""
    at: dict[int, tuple[int, float]] = {}
    row: dict[int, tuple[int, int, float]] = {}
    for r, rank in enumerate(order):
        for place, n in enumerate(rank):
            for m, x, y in levels.nodes[n].members:
                at[m], row[m] = (place, -x if turned[n] else x), (r, n, y)
    level = [(a, b) for a, b in flow if row[a][0] == row[b][0] and (row[a][1] != row[b][1] or row[a] == row[b])]
    return sum((at[b] < at[a]) - (at[a] < at[b]) for a, b in level)


def _inverted(levels: Levels, order: Order, turned: Bools, value: Mapping[int, float]) -> int:
    """How many pairs of neurons in a rank, or in a row of a block, have the one with the greater value first."""
    total = 0
    for rank in order:
        line: list[float] = []
        for n in rank:
            own = [(y, -x if turned[n] else x, value[m]) for m, x, y in levels.nodes[n].members if m in value]
            if len(own) > 1:
                rows = groupby(sorted(own), key=itemgetter(0))
                total += sum(inversions(np.array([v for *_, v in row])) for _, row in rows)
            line += sorted(v for *_, v in own)
        total += inversions(np.array(line))
    return total
