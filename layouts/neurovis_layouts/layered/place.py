"""Places: coordinates across and along for nodes that have their ranks and order.

In: Levels and the order. Out: x and y of every node. Across, each rank is moved to the weighted mean of what its
nodes are connected to, in sweeps; within a rank that is an isotonic regression, so that what is symmetric stays
symmetric. Along, ranks are as far apart as asked, farther where blocks are high or the ranks so wide that lines would
run flat over discs. Ranks that make a drawing much wider than a page are staggered: every other neuron stands a step
behind its neighbours, and connections run in the gaps between those before (``folds``); of very many neurons in more
rows than two, and the ranks of layers so wide are farther apart.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_layouts.isotonic import spread
from neurovis_layouts.layered.box_columns import Strips
from neurovis_layouts.layered.levels import Levels, Node, Segment
from neurovis_layouts.layered.page_cost import page_across
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import LayoutProblem, Point

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
_Gap: TypeAlias = tuple[Ints, Ints, Floats, Floats]

_BESIDE_DISC = 0.6
_BESIDE_PASSAGE = 0.25
_BETWEEN_BOXES = 0.6
#: How far apart across neurons of a staggered rank stand, in spacings: those in one row then leave a gap for lines.
_STAGGERED = 0.6
_MOST_STRETCH = 2.0
_NARROW = 0.4
_FLAT, _FANNED = 14.0, 5.0
_HARDLY = 1e-7
#: What is wider than a page by this is staggered: its ranks of so many neurons and more, that make it so wide.
_WIDE, _FEWEST, _PART = 2.0, 20, 0.5
#: A layer of so many neurons that two rows would be longer than this, in spacings, stands in more.
_LONGEST_ROW = 75.0
#: What is wider than so many times its height after that has its ranks farther apart.
_WIDEST = 2.3


def placed(
    levels: Levels,
    order: Sequence[Sequence[int]],
    neuron_spacing: float,
    rank_spacing: float,
    partner: Sequence[int] | None,
    columns: AbstractSet[int],
    fanned: AbstractSet[int],
) -> list[Point]:
    """x across (the middle of the whole is 0) and y along (the first rank is at 0) of every node.

    With ``partner``, for each node the one that is its mirror image (each rank's order turned round is that of the
    partners), the axis is at 0, and places are mirror images to the last bit. ``columns`` are boxes that get a strip
    for themselves; from ``fanned`` ranks, where frames stand in rows, connections fan out to others.
    """
    neuron_spacing = max(neuron_spacing, 0.65)
    gaps = _gaps(levels, order, neuron_spacing)
    if partner is not None:
        gaps = [[max(pair) for pair in zip(row, row[::-1], strict=True)] for row in gaps]
    across = _across(levels, order, gaps)
    if columns:
        strips = Strips(levels, order, gaps, columns)
        across = strips.kept(across, _pulls(levels)) if strips.fit() else across
    if partner is not None:
        across = [(x - across[partner[node]]) / 2 for node, x in enumerate(across)]
    along = _along(levels, order, across, rank_spacing, fanned)
    xs = [across[i] for i, node in enumerate(levels.nodes) if node.members]
    middle = 0.0 if partner is not None else (min(xs) + max(xs)) / 2
    return [(snap(x - middle), along[node.rank] + node.lift) for x, node in zip(across, levels.nodes, strict=True)]


def _gaps(levels: Levels, order: Sequence[Sequence[int]], spacing: float) -> list[list[float]]:
    """Least distances between neighbours; a rank much narrower than its neighbours is stretched."""
    rows = [len({levels.nodes[n].lift for n in rank if _alone(levels.nodes[n])}) for rank in order]
    plain = [
        [_gap(levels, a, b, spacing, own) for a, b in pairwise(rank)] for rank, own in zip(order, rows, strict=True)
    ]
    widths = [math.fsum(gaps) + _ends(levels, rank) for gaps, rank in zip(plain, order, strict=True)]
    result: list[list[float]] = []
    for r, gaps in enumerate(plain):
        beside = max((widths[i] for i in (r - 1, r + 1) if 0 <= i < len(widths)), default=0.0)
        stretch = min(_MOST_STRETCH, _NARROW * beside / widths[r]) if widths[r] > 0 else 1.0
        result.append([gap * max(1.0, stretch) for gap in gaps])
    return result


def _ends(levels: Levels, rank: Sequence[int]) -> float:
    return levels.nodes[rank[0]].reach[0] + levels.nodes[rank[-1]].reach[0] if rank else 0.0


def _gap(levels: Levels, a: int, b: int, spacing: float, rows: int) -> float:
    """The least distance of two neighbours of a rank whose single neurons stand in so many ``rows``."""
    first, second = levels.nodes[a], levels.nodes[b]
    between = first.reach[0] + second.reach[0]
    if not first.members and not second.members:
        return _BESIDE_PASSAGE
    if not first.members or not second.members:
        return between + _BESIDE_DISC
    if _apart(first, second, rows) and between == 0:
        return 2 * _STAGGERED / max(rows, 2) * spacing
    if (_rigid(first) or _rigid(second)) and not (first.framed and second.framed):
        between += 0.5 * spacing
    return between + spacing + (_BETWEEN_BOXES if first.box != second.box else 0.0)


def _apart(first: Node, second: Node, rows: int) -> bool:
    """Whether two single neurons of a rank stand on different sides of its line, or in different ones of many rows."""
    if rows > 2 and _alone(first) and _alone(second):
        return first.lift != second.lift
    return len(first.members) == len(second.members) == 1 and first.lift * second.lift < 0


def _rigid(node: Node) -> bool:
    """Whether a node is a block or a frame, as wide as it is."""
    return node.reach[0] > 0 and (node.framed or len(node.members) > 1)


def _across(levels: Levels, order: Sequence[Sequence[int]], gaps: Sequence[Sequence[float]]) -> list[float]:
    count, height = len(levels.nodes), len(order)
    x: Floats = np.zeros(count)
    for rank, distances in zip(order, gaps, strict=True):
        x[rank] = spread([0.0] * len(rank), [1.0] * len(rank), distances)
    segments = [_arrays(gap) for gap in levels.segments]
    ways = ((True, False), (False, True), (True, True))
    above, below, both = (_Pulls(count, order, segments, sides) for sides in ways)
    rounds = 10 if count < 5000 else 4
    for turn in range(rounds):
        late = turn >= rounds // 2
        for r in range(height):
            (both if late else above).pull(x, r, gaps[r])
        for r in range(height - 1, -1, -1):
            (both if late else below).pull(x, r, gaps[r])
    return [float(place) for place in x]


def _pulls(levels: Levels) -> dict[int, list[tuple[int, float, float]]]:
    """By node: what pulls it, how far off that wants it, how strongly."""
    found: dict[int, list[tuple[int, float, float]]] = {}
    for segment in (segment for gap in levels.segments for segment in gap):
        apart = segment.a - segment.b
        found.setdefault(segment.lower, []).append((segment.upper, apart, segment.weight))
        found.setdefault(segment.upper, []).append((segment.lower, -apart, segment.weight))
    return found


class _Pulls:
    """Where its connections above, below or on both sides want each rank: sums in one order, so that they come out the
    same on every machine. By rank and connection: the place of its node in the rank, the other node, offset, weight."""

    def __init__(
        self, nodes: int, order: Sequence[Sequence[int]], segments: Sequence[_Gap], sides: tuple[bool, bool]
    ) -> None:
        self.order = [np.array(rank, dtype=np.int64) for rank in order]
        place = np.zeros(nodes, dtype=np.int64)
        for rank in self.order:
            place[rank] = np.arange(len(rank), dtype=np.int64)
        none = _arrays(())
        self.own: list[Ints] = []
        self.other: list[Ints] = []
        self.shift: list[Floats] = []
        self.weight: list[Floats] = []
        for r in range(len(order)):
            above, up, a, heavy = segments[r - 1] if sides[0] and r > 0 else none
            own, below, b, weight = segments[r] if sides[1] and r < len(segments) else none
            self.own.append(place[np.concatenate((up, own))])
            self.other.append(np.concatenate((above, below)))
            self.shift.append(np.concatenate((a, -b)))
            self.weight.append(np.concatenate((heavy, weight)))
        self.mass = [
            np.bincount(own, weight, len(rank)) for own, weight, rank in zip(self.own, self.weight, order, strict=True)
        ]

    def pull(self, x: Floats, r: int, gaps: Sequence[float]) -> None:
        """Move one rank there."""
        rank, mass = self.order[r], self.mass[r]
        total = np.bincount(self.own[r], self.weight[r] * (x[self.other[r]] + self.shift[r]), len(rank))
        wishes = np.where(mass > 0, total / np.maximum(mass, _HARDLY), x[rank])
        x[rank] = spread(wishes.tolist(), np.where(mass > 0, mass, _HARDLY).tolist(), gaps)


def _arrays(gap: Sequence[Segment]) -> _Gap:
    """Upper and lower nodes, how much farther across the upper ends are attached, weights."""
    return (
        np.array([s.upper for s in gap], dtype=np.int64),
        np.array([s.lower for s in gap], dtype=np.int64),
        np.array([s.a - s.b for s in gap], dtype=np.float64),
        np.array([s.weight for s in gap], dtype=np.float64),
    )


def reaches(levels: Levels, order: Sequence[Sequence[int]]) -> tuple[list[float], list[float]]:
    """How far what stands in each rank reaches before its line, and behind it."""
    both = [[(levels.nodes[node].reach[1], levels.nodes[node].lift) for node in rank] for rank in order]
    before = [max((reach - lift for reach, lift in rank), default=0.0) for rank in both]
    behind = [max((reach + lift for reach, lift in rank), default=0.0) for rank in both]
    return before, behind


def _along(
    levels: Levels, order: Sequence[Sequence[int]], x: Sequence[float], spacing: float, fanned: AbstractSet[int]
) -> list[float]:
    before, behind = reaches(levels, order)
    result: list[float] = []
    for r in range(len(order)):
        if r == 0:
            result.append(0.0)
            continue
        longest = max((abs(x[s.upper] + s.a - x[s.lower] - s.b) for s in levels.segments[r - 1]), default=0.0)
        wide = max(1.0, min(2.5, longest / (_FANNED if (r in fanned) != (r - 1 in fanned) else _FLAT)))
        result.append(snap(result[-1] + behind[r - 1] + before[r] + max(spacing, 0.75) * wide))
    return result


def staggered(
    problem: LayoutProblem, levels: Levels, order: Sequence[Sequence[int]], places: Sequence[Point]
) -> Levels | None:
    """The levels with the widest ranks staggered; None where they are not much wider than a page."""
    xs, ys = zip(*places, strict=True)
    wide, high = max(xs) - min(xs) + 1, max(ys) - min(ys) + 1
    if wide < _WIDE * page_across(problem) * high:
        return None
    lined = {m for line in problem.align for m in line}
    nodes = list(levels.nodes)
    for rank in order:
        own = [n for n in rank if nodes[n].members]
        across = [places[n][0] for n in own]
        alone = all(_alone(nodes[n]) and not nodes[n].lift and nodes[n].members[0][0] not in lined for n in own)
        if alone and len(own) >= _FEWEST and max(across) - min(across) > _PART * wide:
            rows = _rows_of(problem, [nodes[n].members[0][0] for n in own])
            for place, n in enumerate(own):
                nodes[n] = replace(nodes[n], lift=snap(((rows - 1) / 2 - (place + 1) % rows) * problem.neuron_spacing))
    return None if nodes == levels.nodes else replace(levels, nodes=nodes)


def _rows_of(problem: LayoutProblem, rank: Sequence[int]) -> int:
    """In how many rows the neurons of a wide rank stand: two, those of a long layer in more."""
    group = {m: number for number, own in enumerate(problem.groups) for m in own.members}
    layer = len({group.get(m) for m in rank}) == 1
    return max(2, math.ceil(2 * _STAGGERED * len(rank) / _LONGEST_ROW)) if layer else 2


def flattened(problem: LayoutProblem, levels: Levels, places: Sequence[Point]) -> float:
    """How many times farther apart staggered ranks have to be, if one of them is a whole layer of neurons, so that the
    drawing is not too wide; 1 at least. Lines between layers are easier to follow so."""
    xs, ys = zip(*places, strict=True)
    wide, high = max(xs) - min(xs) + 1, max(ys) - min(ys) + 1
    page = 1.0 if problem.aspect is None else problem.aspect
    group = {m: number for number, own in enumerate(problem.groups) for m in own.members}
    layers = Counter((node.rank, group.get(m, -1)) for node in levels.nodes if node.lift for m, _, _ in node.members)
    layer = any(own >= 0 and count >= _FEWEST for (_, own), count in layers.items())
    return (
        max(1.0, wide / (_WIDEST * (page if problem.direction in ("down", "up") else 1 / page) * high))
        if layer
        else 1.0
    )


def _alone(node: Node) -> bool:
    """Whether a node is a single neuron, as high as its disc."""
    return len(node.members) == 1 and node.reach == (0.0, 0.0)
