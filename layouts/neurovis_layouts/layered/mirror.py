"""Mirror: the order of ranks that are to be symmetric about an axis.

In: Levels of a problem, and whose mirror image each neuron is. Out: the order of every rank, which turned round is that
of the mirror images, and for each node its image; what is in no pair stands on the axis or about it. Each connection
has an image, though it may be one that nothing passes, so that the room that they take is the same on both sides. What
runs within a rank is ordered, too: it leads through a node of the next.
"""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import TypeAlias

from neurovis_layouts.layered.levels import Levels, Node, Segment, add, connect
from neurovis_layouts.layered.order import Order, ordered
from neurovis_layouts.layered.parts import symmetric
from neurovis_layouts.routing.ends import keys_of
from neurovis_spec.layout.model import LayoutProblem

#: Where something is attached: the node, and how far from its middle.
_End: TypeAlias = tuple[int, float]
#: A connection: where it leaves, and where it arrives.
_Line: TypeAlias = tuple[_End, _End]


def mirrored(
    problem: LayoutProblem, levels: Levels, pair: Mapping[int, int], free: AbstractSet[int], draft: bool
) -> tuple[Levels, Order, list[int]]:
    """The levels, the symmetric order, and the image of each node; ``free`` nodes may have moved to other ranks, with
    their images. Of a ``draft`` only lengths matter. Adds passages to the levels."""
    where = {m: (n, dx) for n, node in enumerate(levels.nodes) for m, dx, _ in node.members}
    side = _half(problem, levels, pair, where)
    fixed = {n for n, image in levels.images.items() if n == image}
    _match(problem, levels, pair, side)
    within = _within(problem, levels, where)
    even = _even(levels, side, within)
    held = {n for n, at in side.items() if at == 0} | {n for line in within for n, _ in line}
    found, order = ordered(even, free - held, problem.effort, draft)
    if found is not even:
        levels = found
    else:
        order = [[n for n in rank if n < len(levels.nodes)] for rank in order]
    _forget_idle(levels)
    for rank in order:
        _about(levels, rank, side, fixed)
    image = {n: other for rank in order for n, other in zip(rank, rank[::-1], strict=True)}
    return levels, order, [image.get(n, 0) for n in range(len(levels.nodes))]


def _half(problem: LayoutProblem, levels: Levels, pair: Mapping[int, int], where: Mapping[int, _End]) -> dict[int, int]:
    """On which side each node stands, of two as they were written, 0 where it is its own image; notes the images."""
    first = {a for mirror in problem.mirrors for a, _ in mirror.pairs}
    side: dict[int, int] = {}
    for n, own in enumerate([m for m, _, _ in node.members] for node in levels.nodes):
        if own:
            image = where[pair.get(own[0], own[0])][0]
            side[n] = 0 if image == n else -1 if own[0] in first else 1
            if side[n] or symmetric(own, pair):
                levels.images[n] = image
    return side


def _forget_idle(levels: Levels) -> None:
    """Without the connections that nothing passes, but for their passages, which keep room free."""
    for i in levels.idle:
        del levels.ends[i]
        levels.passages.pop(i, None)
    passing = [not node.members for node in levels.nodes]
    levels.segments = [
        [s for s in gap if not s.idle or passing[s.upper] or passing[s.lower]] for gap in levels.segments
    ]


def _about(levels: Levels, rank: list[int], side: Mapping[int, int], fixed: AbstractSet[int]) -> None:
    """What has to stand on the axis in the middle, what need not beside it, with room for as much on the other side."""
    centre = [n for n in rank if levels.nodes[n].members and side[n] == 0]
    middle = [n for n in centre if n in fixed]
    if not middle or len(centre) == 1:
        return
    loose = [n for n in centre if n not in fixed]
    start, half = rank.index(centre[0]), len(loose) // 2
    before, behind = loose[:half], loose[half:]
    if len(loose) % 2:
        levels.nodes.append(Node(levels.nodes[middle[0]].rank, reach=levels.nodes[loose[-1]].reach))
        before.insert(0, len(levels.nodes) - 1)
    rank[start : start + len(centre)] = [*before, middle[0], *behind]


def _reflected(levels: Levels, end: _End) -> _End:
    """Where the mirror image of what is attached here is attached, whether or not a neuron stands there."""
    n, offset = end
    return (levels.images[n], 0.0 - offset) if n in levels.images else end


def _match(problem: LayoutProblem, levels: Levels, pair: Mapping[int, int], side: dict[int, int]) -> None:
    """Find the image of each connection; where there is none, or one in the middle would not be alone there, add one
    that nothing passes. What runs from side to side changes sides half-way."""
    keys = keys_of(problem.edges)
    index = {key: i for i, key in enumerate(keys)}
    taken = {levels.nodes[n].rank for n, at in side.items() if at == 0}
    for i, (upper, a, lower, b) in list(levels.ends.items()):
        source, target, number = keys[i]
        other = index.get((pair.get(source, source), pair.get(target, target), number), -1)
        ends = *_reflected(levels, (upper, a)), *_reflected(levels, (lower, b))
        passages = levels.passages.get(i, [])
        ranks = {levels.nodes[p].rank for p in passages}
        sides = _sides(side[upper], side[lower], len(passages))
        alike = levels.ends.get(other) == ends
        if alike and other == i and taken.isdisjoint(ranks):
            taken |= ranks
            sides = [0] * len(passages)
        elif other == i or not alike:
            other = len(keys) + i
            levels.idle.add(other)
            connect(levels, other, ends)
        for one, two, at in zip(passages, levels.passages.get(other, ()), sides, strict=True):
            levels.images[one], levels.images[two] = two, one
            side[one], side[two] = at, -at


def _sides(upper: int, lower: int, count: int) -> list[int]:
    """On which side a connection runs between its ends: where it changes sides, half-way."""
    first, last = upper or lower or -1, lower or upper or -1
    return [first if 2 * i + 1 < count else last for i in range(count)]


def _within(problem: LayoutProblem, levels: Levels, where: Mapping[int, _End]) -> dict[_Line, _Line]:
    """The connections between two nodes of a rank, by where they leave and arrive, and their images."""
    found: dict[_Line, _Line] = {}
    for edge in problem.edges:
        source, target = where.get(edge.source), where.get(edge.target)
        if source is None or target is None or source[0] == target[0]:
            continue
        if levels.nodes[source[0]].rank == levels.nodes[target[0]].rank:
            found[source, target] = _reflected(levels, source), _reflected(levels, target)
    return found


def _even(levels: Levels, side: Mapping[int, int], within: Mapping[_Line, _Line]) -> Levels:
    """The levels as they are ordered: those before the axis first in their ranks, and what runs ``within`` a rank led
    through a node of the rank before or behind, where fewer connections are; there and back through both. What is
    behind the axis follows, and is held by no group."""
    nodes = [replace(node, kin=-1) if side[n] > 0 else node for n, node in enumerate(levels.nodes)]
    ranks = [sorted(rank, key=lambda n: side[n]) for rank in levels.ranks]
    gaps = [list(gap) for gap in levels.segments]
    even = replace(levels, nodes=nodes, ranks=ranks, segments=gaps, images=dict(levels.images))
    many = [0, *(len(gap) for gap in gaps), 0]
    known: dict[tuple[int, frozenset[_End]], int] = {}
    for ends, image in within.items():
        rank = nodes[ends[0][0]].rank
        before = many[rank] < many[rank + 1]
        for at in (rank - 1, rank + 1) if ends[::-1] in within else (rank - 1 if before else rank + 1,):
            if not 0 <= at < len(ranks):
                continue  # nothing is there to be crossed
            for line in sorted((ends, image), key=lambda line: side[line[0][0]] + side[line[1][0]]):
                if (at, frozenset(line)) not in known:
                    turn = known[at, frozenset(line)] = add(even, Node(at))
                    idle = line not in within and line[::-1] not in within
                    gaps[min(at, rank)] += [
                        Segment(turn, 0.0, *end, 1.0, idle) if at < rank else Segment(*end, turn, 0.0, 1.0, idle)
                        for end in line
                    ]
            one, two = known[at, frozenset(ends)], known[at, frozenset(image)]
            even.images[one], even.images[two] = two, one
    return even
