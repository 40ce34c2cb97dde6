"""Mirror: the order of ranks that are to be symmetric about an axis.

In: Levels of a problem, and whose mirror image each neuron is. Out: the order of every rank, which turned round is that
of the mirror images, and for each node its image; what is in no pair stands on the axis or about it. It is found by
folding the levels along the axis and ordering the half. Passages without an image get one that nothing passes, so that
the room they take is the same on both sides.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

from neurovis_layouts.layered.levels import Levels, Node, Segment
from neurovis_layouts.layered.order import ordered
from neurovis_layouts.layered.parts import symmetric
from neurovis_layouts.routing.ends import keys_of
from neurovis_spec.layout.model import LayoutProblem


def mirrored(
    problem: LayoutProblem, levels: Levels, pair: Mapping[int, int], draft: bool
) -> tuple[list[list[int]], list[int]]:
    """The symmetric order, and the image of each node; of a ``draft`` only lengths matter. Adds passages to the
    levels."""
    left = _left_of(problem, pair)
    where = {m: n for n, node in enumerate(levels.nodes) for m, _, _ in node.members}
    image = {
        n: where[pair.get(node.members[0][0], node.members[0][0])]
        for n, node in enumerate(levels.nodes)
        if node.members
    }
    side = {n: 0 if image[n] == n else -1 if levels.nodes[n].members[0][0] in left else 1 for n in image}
    _match_passages(problem, levels, pair, where, image, side)
    half = _folded(levels, image, side)
    order = _unfolded(ordered(half[0], effort=problem.effort, draft=draft)[1], half[1], image, side)
    for rank in order:
        _about(levels, rank, side, pair)
    result: list[int] = [0] * len(levels.nodes)
    for rank in order:
        for node, other in zip(rank, rank[::-1], strict=True):
            result[node] = other
    return order, result


def _about(levels: Levels, rank: list[int], side: Mapping[int, int], pair: Mapping[int, int]) -> None:
    """What has to stand on the axis in the middle, what need not beside it, with room for as much on the other side."""
    centre = [n for n in rank if side[n] == 0]
    fixed = [n for n in centre if symmetric([m for m, _, _ in levels.nodes[n].members], pair)]
    if not fixed or len(centre) == 1:
        return
    loose = [n for n in centre if n not in fixed]
    start, half = rank.index(centre[0]), len(loose) // 2
    before, behind = loose[:half], loose[half:]
    if len(loose) % 2:
        levels.nodes.append(Node(levels.nodes[fixed[0]].rank, reach=levels.nodes[loose[-1]].reach))
        before.insert(0, len(levels.nodes) - 1)
    rank[start : start + len(centre)] = [*before, fixed[0], *behind]


def _left_of(problem: LayoutProblem, pair: Mapping[int, int]) -> set[int]:
    """The first of each pair as it was written."""
    return {a for mirror in problem.mirrors for a, _ in mirror.pairs if a in pair}


def _match_passages(
    problem: LayoutProblem,
    levels: Levels,
    pair: Mapping[int, int],
    where: Mapping[int, int],
    image: dict[int, int],
    side: dict[int, int],
) -> None:
    keys = keys_of(problem.edges)
    index = {key: i for i, key in enumerate(keys)}
    on_axis: set[int] = {levels.nodes[n].rank for n, s in side.items() if s == 0}
    for i, passages in sorted(levels.passages.items()):
        if passages[0] in image:
            continue
        source, target, number = keys[i]
        other = index.get((pair.get(source, source), pair.get(target, target), number), -1)
        upper, lower = where[source], where[target]
        if levels.nodes[upper].rank > levels.nodes[lower].rank:
            upper, lower = lower, upper
        sides = _sides(side[upper], side[lower], len(passages))
        if other != i and other in levels.passages:
            images = levels.passages[other]
        elif side[upper] == side[lower] == 0 and not on_axis.intersection(levels.nodes[p].rank for p in passages):
            images, sides = passages, [0] * len(passages)
            on_axis.update(levels.nodes[p].rank for p in passages)
        else:
            images = [_passage(levels, levels.nodes[p].rank) for p in passages]
            _run(levels, [image[upper], *images, image[lower]], (upper, *passages, lower))
        for one, two, at in zip(passages, images, sides, strict=True):
            image[one], image[two] = two, one
            side[one], side[two] = at, -at


def _sides(upper: int, lower: int, count: int) -> list[int]:
    """On which side a connection runs between its ends: where it changes sides, half-way."""
    first, last = upper or lower or -1, lower or upper or -1
    return [first if 2 * i + 1 < count else last for i in range(count)]


def _passage(levels: Levels, rank: int) -> int:
    levels.nodes.append(Node(rank))
    levels.ranks[rank].append(len(levels.nodes) - 1)
    return len(levels.nodes) - 1


def _run(levels: Levels, line: Sequence[int], model: Sequence[int]) -> None:
    """Segments along passages that nothing passes, like those of the connection whose image they are."""
    for (a, b), (c, d) in zip(pairwise(line), pairwise(model), strict=True):
        gap = levels.segments[levels.nodes[a].rank]
        twin = next(s for s in gap if (s.upper, s.lower) == (c, d))
        gap.append(Segment(a, -twin.a, b, -twin.b, twin.weight))


def _folded(levels: Levels, image: Mapping[int, int], side: Mapping[int, int]) -> tuple[Levels, list[int]]:
    """The left half and what stands on the axis, the right half folded on to it; its nodes as those of the whole."""
    chosen = [n for n in range(len(levels.nodes)) if side[n] <= 0]
    number = {n: i for i, n in enumerate(chosen)}
    half = Levels([levels.nodes[n] for n in chosen], [[number[n] for n in r if n in number] for r in levels.ranks])
    for gap in levels.segments:
        found: dict[tuple[int, float, int, float], Segment] = {}
        for s in gap:
            upper, a = (s.upper, s.a) if side[s.upper] <= 0 else (image[s.upper], -s.a)
            lower, b = (s.lower, s.b) if side[s.lower] <= 0 else (image[s.lower], -s.b)
            found.setdefault((upper, a, lower, b), Segment(number[upper], a, number[lower], b, s.weight))
        half.segments.append(list(found.values()))
    return half, chosen


def _unfolded(
    half: Sequence[Sequence[int]],
    chosen: Sequence[int],
    image: Mapping[int, int],
    side: Mapping[int, int],
) -> list[list[int]]:
    order: list[list[int]] = []
    for rank in half:
        nodes = [chosen[n] for n in rank]
        left = [n for n in nodes if side[n] < 0]
        order.append([*left, *(n for n in nodes if side[n] == 0), *(image[n] for n in reversed(left))])
    return order
