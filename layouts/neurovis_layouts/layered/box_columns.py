"""Box columns: boxes side by side in the same ranks, each a strip across them that no other neuron or line enters.

In: Levels and the boxes that are to be columns. Out: levels with a spine through every rank of a box, and passages
within boxes marked as theirs; an order in which whatever hangs together outside a box is on one side of it; places
across that leave each box its strip. So a box may stand beside what it drives and is driven by, which a block cannot.
After Sander (1996), Layout of compound directed graphs.

The stages, in the order in which they are called: ``spined`` gives a box a node in each of its ranks, joined to a
line, which holds the box together while ranks are ordered; ``straightened`` moves what hangs together outside to one
side of that; ``tied`` takes away the spines where the box has nodes of its own, which are tied to each other instead;
``Strips`` keeps, when nodes find their places across, the left and the right line of each strip as two more nodes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from itertools import pairwise

import networkx as nx
import numpy as np

from neurovis_layouts.layered.crossings import Segments
from neurovis_layouts.layered.levels import Halves, Levels, Node, Segment
from neurovis_layouts.layered.order import Exchange, places
from neurovis_spec.layout.model import LayoutProblem

#: From the line of a strip to centres and to lines, within and outside; between two strips.
_INSIDE_DISC, _INSIDE_LINE, _OUTSIDE_DISC, _OUTSIDE_LINE, _BETWEEN = 0.65, 0.2, 0.55, 0.25, 0.4
#: How strongly the spine of a box holds together, and its neurons in neighbouring ranks.
_SPINE, _TIED = 8.0, 3.0
#: Sweeps in which strips and what is around them find their places.
_ROUNDS = 24


def spined(problem: LayoutProblem, levels: Levels, columns: AbstractSet[int]) -> None:
    """Give every column a node in each of its ranks, joined to a line, and the passages of its own connections."""
    box_of = {m: b for b in sorted(columns) for m in problem.boxes[b][1]}
    for i, passages in levels.passages.items():
        edge = problem.edges[i]
        box = box_of.get(edge.source, -1)
        if box >= 0 and box == box_of.get(edge.target, -1):
            for n in passages:
                levels.nodes[n] = replace(levels.nodes[n], box=box)
    for box in sorted(columns):
        ranks = [node.rank for node in levels.nodes if node.box == box]
        before = -1
        for rank in range(min(ranks), max(ranks) + 1):
            levels.nodes.append(Node(rank, box=box))
            spine = len(levels.nodes) - 1
            levels.ranks[rank].append(spine)
            levels.spines.add(spine)
            if before >= 0:
                levels.segments[rank - 1].append(Segment(before, 0.0, spine, 0.0, _SPINE))
            before = spine


def straightened(levels: Levels, order: Sequence[Sequence[int]], columns: AbstractSet[int]) -> list[list[int]] | None:
    """The order with each connected part of the rest on one side of a column; None where that is not possible."""
    found = [list(rank) for rank in order]
    sides: dict[tuple[int, int], int] = {}
    for _ in range(len(columns) + 2):
        moved = False
        for box in sorted(columns):
            before = [list(rank) for rank in found]
            if not _part(levels, found, box, sides):
                return None
            moved |= found != before
        if not moved:
            segments = Segments(levels)
            boxes = np.array([node.box for node in levels.nodes], dtype=np.int64)
            kin = np.array([node.kin for node in levels.nodes], dtype=np.int64)
            arrays = [np.array(rank, dtype=np.int64) for rank in found]
            crossings = segments.count(places(len(levels.nodes), arrays))
            better = Exchange(segments, (boxes, kin), Halves(levels)).improved(crossings, arrays)[1]
            return [rank.tolist() for rank in better]
    return None


def _part(levels: Levels, order: list[list[int]], box: int, sides: dict[tuple[int, int], int]) -> bool:
    """Move each connected part of what is not in this column, within its ranks, to the side where most of it is.

    ``sides`` says for two columns on which side of the first the second stands; what is decided here is added. False
    where these contradict each other.
    """
    spans = [r for r, rank in enumerate(order) if any(levels.nodes[n].box == box for n in rank)]
    part, first = _connected(levels, order, spans, box)
    lean = _leaning(levels, [order[r] for r in spans], box, part)
    of = {other: part[n] for other, n in first.items()}
    for other in sorted(of):
        settled = sides.get((box, other), 0)
        if settled and lean[of[other]] * settled <= 0:
            if any(sides.get((box, mate), settled) != settled for mate in of if of[mate] == of[other]):
                return False
            lean[of[other]] = settled
    side = {number: -1 if lean[number] < 0 else 1 for number in lean}
    for other, number in of.items():
        sides[box, other], sides[other, box] = side[number], -side[number]
    for r in spans:
        order[r].sort(key=lambda n: side[part[n]] if n in part else 0)
    return True


def _leaning(levels: Levels, ranks: Sequence[Sequence[int]], box: int, part: Mapping[int, int]) -> dict[int, int]:
    """For each connected part how many more of its nodes stand behind a column than before it."""
    lean = dict.fromkeys(part.values(), 0)
    for rank in ranks:
        start = next(i for i, n in enumerate(rank) if levels.nodes[n].box == box)
        for i, n in enumerate(rank):
            if n in part:
                lean[part[n]] += 1 if i > start else -1
    return lean


def _connected(
    levels: Levels, order: Sequence[Sequence[int]], spans: Sequence[int], box: int
) -> tuple[dict[int, int], dict[int, int]]:
    """Of what stands in the ranks of a column and is not in it: the connected part that each node is of, another column
    being one; and the first node of each other column."""
    foreign = [n for r in spans for n in order[r] if levels.nodes[n].box != box]
    hanging: nx.Graph[int] = nx.Graph()
    hanging.add_nodes_from(foreign)
    for segment in (segment for r in spans[:-1] for segment in levels.segments[r]):
        if segment.upper in hanging and segment.lower in hanging:
            hanging.add_edge(segment.upper, segment.lower)
    first: dict[int, int] = {}
    for n in foreign:
        other = levels.nodes[n].box
        if other >= 0:
            hanging.add_edge(first.setdefault(other, n), n)
    return {n: number for number, mates in enumerate(nx.connected_components(hanging)) for n in mates}, first


def tied(levels: Levels, order: Sequence[Sequence[int]], columns: AbstractSet[int]) -> tuple[Levels, list[list[int]]]:
    """Levels and order without the spines where a column has other nodes; what stands in a column is tied to what
    stands in it in the next rank, so that the column is narrow."""
    nodes = levels.nodes
    spines = {n for n in levels.spines if any(nodes[m].box == nodes[n].box for m in order[nodes[n].rank] if m != n)}
    left = [[n for n in rank if n not in spines] for rank in order]
    segments = [[s for s in gap if s.upper not in levels.spines] for gap in levels.segments]
    for box in sorted(columns):
        own = [[n for n in rank if nodes[n].box == box] for rank in left]
        for r, (above, below) in enumerate(pairwise(own)):
            for a in above:
                segments[r] += [Segment(a, 0.0, b, 0.0, _TIED / max(len(above), len(below))) for b in below]
    return Levels(nodes, left, segments, levels.passages, levels.spines, levels.ends), left


class Strips:
    """What keeps columns apart from each other and from everything else: least distances between nodes and the lines
    of columns. The line on the left of the k-th column is the node ``count + 2k``, that on the right the next."""

    def __init__(
        self,
        levels: Levels,
        order: Sequence[Sequence[int]],
        gaps: Sequence[Sequence[float]],
        columns: AbstractSet[int],
    ) -> None:
        self._count = len(levels.nodes)
        self._line = {box: self._count + 2 * k for k, box in enumerate(sorted(columns))}
        self._after: list[dict[int, float]] = [{} for _ in range(self._count + 2 * len(columns))]
        self._before: list[dict[int, float]] = [{} for _ in self._after]
        nodes = levels.nodes
        for rank, distances in zip(order, gaps, strict=True):
            for (a, b), gap in zip(pairwise(rank), distances, strict=True):
                self._apart(a, b, gap)
            for a, b in pairwise([-1, *rank, -1]):
                own = self._line.get(nodes[a].box, -1) if a >= 0 else -1
                other = self._line.get(nodes[b].box, -1) if b >= 0 else -1
                if own != other:
                    self._off_lines(nodes, (a, own), (b, other))
        for line_of in self._line.values():
            self._apart(line_of, line_of + 1, 0.0)
        self._sorted = self._topological()

    def _off_lines(self, nodes: Sequence[Node], one: tuple[int, int], other: tuple[int, int]) -> None:
        """Two neighbours in a rank, −1 for none, of which not both are in one column, off the lines between them; with
        each comes the line on the left of its column, −1 where it is in none."""
        (a, own), (b, foreign) = one, other
        if own >= 0:
            self._apart(a, own + 1, _inside(nodes[a]))
        if foreign >= 0:
            self._apart(foreign, b, _inside(nodes[b]))
        if own >= 0 and foreign >= 0:
            self._apart(own + 1, foreign, _BETWEEN)
        elif own >= 0 and b >= 0:
            self._apart(own + 1, b, _outside(nodes[b]))
        elif foreign >= 0 and a >= 0:
            self._apart(a, foreign, _outside(nodes[a]))

    def _apart(self, a: int, b: int, gap: float) -> None:
        self._after[a][b] = max(self._after[a].get(b, 0.0), gap)
        self._before[b][a] = max(self._before[b].get(a, 0.0), gap)

    def _topological(self) -> list[int]:
        """The nodes and lines from left to right, none where the distances go round in a circle."""
        graph: nx.DiGraph[int] = nx.DiGraph()
        graph.add_nodes_from(range(len(self._after)))
        graph.add_edges_from((a, b) for a, after in enumerate(self._after) for b in after)
        try:
            return list(nx.lexicographical_topological_sort(graph))
        except nx.NetworkXUnfeasible:
            return []

    def fit(self) -> bool:
        """Whether all distances can be kept at once."""
        return len(self._sorted) == len(self._after)

    def kept(self, wishes: Sequence[float], pulls: Mapping[int, Sequence[tuple[int, float, float]]]) -> list[float]:
        """Places of the nodes that keep all distances, near to where they wish to be; ``pulls`` are by node: the other
        node, how far from it, weight."""
        wish = self._with_lines(wishes)
        # the mean of two solutions is one: pushed to the right, and pushed to the left
        right, left = list(wish), list(wish)
        for n in self._sorted:
            right[n] = max([right[n], *(right[a] + gap for a, gap in self._before[n].items())])
        for n in reversed(self._sorted):
            left[n] = min([left[n], *(left[b] - gap for b, gap in self._after[n].items())])
        x = [(a + b) / 2 for a, b in zip(right, left, strict=True)]
        for turn in range(_ROUNDS):
            for n in self._sorted if turn % 2 == 0 else self._sorted[::-1]:
                x[n] = self._pulled(n, x, pulls.get(n, ()))
        return x[: self._count]

    def _with_lines(self, wishes: Sequence[float]) -> list[float]:
        """The wishes of nodes, and those of the lines of columns: as near to their nodes as can be."""
        wish = list(wishes) + [0.0] * (len(self._after) - self._count)
        for b in self._line.values():
            own = sorted(self._after[b].keys() - {b + 1})
            wish[b] = min((wish[n] - self._after[b][n] for n in own), default=0.0)
            wish[b + 1] = max((wish[n] + gap for n, gap in sorted(self._before[b + 1].items()) if n != b), default=0.0)
        return wish

    def _pulled(self, n: int, x: Sequence[float], pulls: Sequence[tuple[int, float, float]]) -> float:
        """Where a node goes that is pulled, and a line, to the middle of what it has, the others being where they
        are."""
        low = max((x[a] + gap for a, gap in self._before[n].items()), default=-np.inf)
        high = min((x[b] - gap for b, gap in self._after[n].items()), default=np.inf)
        if n >= self._count:
            return (low + high) / 2 if np.isfinite(low) and np.isfinite(high) else x[n]
        mass = math.fsum(weight for _, _, weight in pulls)
        if mass <= 0:
            return x[n]
        aim = math.fsum(weight * (x[other] + far) for other, far, weight in pulls) / mass
        return min(max(aim, low), max(low, high))


def _inside(node: Node) -> float:
    return node.reach[0] + (_INSIDE_DISC if node.members else _INSIDE_LINE)


def _outside(node: Node) -> float:
    return node.reach[0] + (_OUTSIDE_DISC if node.members else _OUTSIDE_LINE)
