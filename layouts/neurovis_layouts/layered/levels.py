"""Levels: the units of one component, rank by rank, with a passage through every rank that a connection crosses.

In: a problem, units, ranks. Out: Levels: nodes (a neuron, a block, or a passage), which rank they are in, and the
segments between neighbouring ranks. A drives B and C, B drives C, each is in a rank of its own. The line from A to C
passes the rank of B, so that there is a node for it (·)::

    rank 0    A         nodes      0: A   1: B   2: C   3: the passage
            ┌─┴─┐       ranks      [0], [1, 3], [2]
    rank 1  B   ·       segments   [0–1, 0–3], [1–2, 3–2]
            └─┬─┘       passages   {the number of A -> C: [3]}
    rank 2    C

Of levels that are to be symmetric, Halves say who stands before the axis and who behind it: a rank is made from the
order of those that stand before it, what is nobody's image stands in the middle.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from itertools import accumulate, pairwise
from operator import itemgetter

import numpy as np

from neurovis_layouts.label_room import excess, sides_of
from neurovis_layouts.layered.units import Unit
from neurovis_spec.layout import IntArray as Ints
from neurovis_spec.layout.model import LayoutProblem, Point, Side

#: Passages in all; beyond it the longest connections get none.
_MOST_PASSAGES = 60_000


Ends = tuple[int, float, int, float]


@dataclass(frozen=True, slots=True)
class Node:
    """Something in a rank. ``members`` with their offsets; none for a passage. ``reach`` is how far centres lie from
    its middle, across and along, and how much farther a label beside its disc; ``kin`` is shared by neurons of a group
    that keep their order; ``lift`` is how far the middle stands behind the line of the rank; ``framed`` says that
    nothing may come within its reach."""

    rank: int
    members: tuple[tuple[int, float, float], ...] = ()
    reach: tuple[float, float] = (0.0, 0.0)
    kin: int = -1
    box: int = -1
    lift: float = 0.0
    framed: bool = False


@dataclass(frozen=True, slots=True)
class Segment:
    """A piece of a connection from a node to one in the next rank; ``a`` and ``b`` are offsets at its ends. What is
    ``idle`` only keeps the room of its mirror image free, or makes that known to what is ordered: nothing passes."""

    upper: int
    a: float
    lower: int
    b: float
    weight: float
    idle: bool = False


@dataclass(slots=True)
class Levels:
    """Nodes by index, node indices by rank, segments below each rank, and the passages of each edge, from above to
    below."""

    nodes: list[Node] = field(default_factory=list)
    ranks: list[list[int]] = field(default_factory=list)
    segments: list[list[Segment]] = field(default_factory=list)
    passages: dict[int, list[int]] = field(default_factory=dict)
    #: nodes that only mark where a box passes through a rank
    spines: set[int] = field(default_factory=set)
    #: by edge: the upper node and the offset there, the lower node and the offset there
    ends: dict[int, Ends] = field(default_factory=dict)
    #: edges that nothing passes
    idle: set[int] = field(default_factory=set)
    #: whose mirror image each node is, itself what is symmetric in itself: nodes of one rank, whose segments are images
    #: of each other, too
    images: dict[int, int] = field(default_factory=dict)


def levels_of(
    problem: LayoutProblem,
    units: Sequence[Unit],
    rank: Sequence[int],
    edges: Sequence[int],
    columns: AbstractSet[int] = frozenset(),
) -> Levels:
    """Levels of these units; ``rank`` is by position in ``units``; ``edges`` are the indices of theirs; ``columns`` are
    the boxes to which their neurons belong before all others."""
    height = max(rank, default=-1) + 1
    levels = Levels(ranks=[[] for _ in range(height)], segments=[[] for _ in range(max(0, height - 1))])
    where: dict[int, tuple[int, float]] = {}
    boxes = {m: number for number, (_, members) in enumerate(problem.boxes) for m in reversed(members)}
    boxes.update({m: number for number in sorted(columns) for m in problem.boxes[number][1]})
    groups = {m: number for number, group in enumerate(problem.groups) for m in group.members}
    sides, reading = _aside_on(problem), problem.reading()
    for unit, level in sorted(zip(units, rank, strict=True), key=lambda pair: min(reading[m] for m in pair[0].members)):
        for node in _nodes(problem, unit, level, boxes, groups):
            if len(node.members) == 1 and node.reach[0] and not node.framed and node.members[0][0] in sides:
                node = _aside(node, sides[node.members[0][0]])
            index = add(levels, node)
            where.update({member: (index, dx) for member, dx, _ in node.members})
    for i, ends in _near(problem, edges, levels, where):
        connect(levels, i, ends)
    return levels


def _aside_on(problem: LayoutProblem) -> dict[int, Side | None]:
    """On which side of its disc the label of each neuron stands that need not be in the middle, as on an axis."""
    paired = {m for mirror in problem.mirrors for pair in mirror.pairs for m in pair}
    free = paired if problem.labels and problem.mirrors else range(len(problem.neurons))
    return {m: side for m, side in enumerate(sides_of(problem)) if m in free}


def _near(
    problem: LayoutProblem, edges: Sequence[int], levels: Levels, where: Mapping[int, tuple[int, float]]
) -> list[tuple[int, Ends]]:
    """The edges between ranks, and where they end, but for the longest, where they would have too many passages."""
    spans: list[tuple[int, int, Ends]] = []
    for i in edges:
        one, other = where[problem.edges[i].source], where[problem.edges[i].target]
        upper, lower = sorted((one, other), key=lambda end: levels.nodes[end[0]].rank)
        if span := levels.nodes[lower[0]].rank - levels.nodes[upper[0]].rank:
            spans.append((span, i, (*upper, *lower)))
    passages = accumulate(span - 1 for span, *_ in sorted(spans))
    near = [(i, ends) for (_, i, ends), many in zip(sorted(spans), passages, strict=True) if many <= _MOST_PASSAGES]
    return sorted(near, key=itemgetter(0))


def _nodes(problem: LayoutProblem, unit: Unit, rank: int, boxes: dict[int, int], groups: dict[int, int]) -> list[Node]:
    if unit.places is None:
        # a group keeps its order where it shares a rank; of others only the names have something in common
        size = Counter(groups.get(m, -1) for m in unit.members)
        kin = {m: groups[m] if size[groups.get(m, -1)] > 1 and m in groups else -1 for m in unit.members}
        return [
            Node(rank, ((m, 0.0, 0.0),), excess(problem, m), kin[m], boxes.get(m, -1), unit.lift) for m in unit.members
        ]
    members = tuple((m, dx, dy) for m, (dx, dy) in zip(unit.members, unit.places, strict=True))
    reach = unit.reach or _reach(problem, members)
    shared = {boxes.get(m, -1) for m in unit.members}
    return [
        Node(
            rank, members, reach, unit.kin, shared.pop() if len(shared) == 1 else -1, unit.lift, unit.reach is not None
        )
    ]


def _aside(node: Node, side: Side | None) -> Node:
    """A node of one neuron with room for its label on one side alone: the neuron is off the middle."""
    (neuron, _, dy), half = node.members[0], node.reach[0] / 2
    return replace(node, members=((neuron, half if side == "left" else -half, dy),), reach=(half, node.reach[1]))


def _reach(problem: LayoutProblem, members: Sequence[tuple[int, float, float]]) -> Point:
    """How far a block reaches from its middle."""
    more = [excess(problem, m) for m, _, _ in members]
    across = (abs(dx) + wide for (_, dx, _), (wide, _) in zip(members, more, strict=True))
    along = (abs(dy) + high for (_, _, dy), (_, high) in zip(members, more, strict=True))
    return max(across), max(along)


def add(levels: Levels, node: Node) -> int:
    """A node more in its rank; its index."""
    levels.nodes.append(node)
    levels.ranks[node.rank].append(len(levels.nodes) - 1)
    return len(levels.nodes) - 1


def moved(levels: Levels, rank: Sequence[int], height: int) -> Levels:
    """The levels with each node in another of ``height`` ranks, by index, and connected anew; passages are others."""
    result = Levels(idle=levels.idle)
    result.ranks = [[] for _ in range(height)]
    result.segments = [[] for _ in range(height - 1)]
    for node, level in zip(levels.nodes, rank, strict=True):
        if node.members:
            add(result, replace(node, rank=level))
    for i, ends in levels.ends.items():
        connect(result, i, ends)
    return result


def connect(levels: Levels, i: int, ends: Ends) -> None:
    """Segments for one edge, through passages where it crosses ranks; a line of passages is pulled straight."""
    upper, a, lower, b = levels.ends[i] = ends
    top, bottom = levels.nodes[upper].rank, levels.nodes[lower].rank
    passages = [add(levels, Node(rank)) for rank in range(top + 1, bottom)]
    if passages:
        levels.passages[i] = passages
    line = [(upper, a), *((node, 0.0) for node in passages), (lower, b)]
    for step, (one, other) in enumerate(pairwise(line)):
        ends_here = (step == 0) + (step == len(line) - 2)
        levels.segments[top + step].append(Segment(*one, *other, (8.0, 2.0, 1.0)[ends_here], i in levels.idle))


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
