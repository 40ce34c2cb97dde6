"""The order of ranks: exact counts of crossings, the best order of tiny graphs by trying all, and the contract, also
of ranks that are symmetric about an axis."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, permutations, product
from random import Random

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from laws import examples
from neurovis_layouts.layered.crossings import Ints, Segments, inversions
from neurovis_layouts.layered.levels import Halves, Levels, Node, Segment
from neurovis_layouts.layered.order import Exchange, Order, crossings, ordered, places


def levels_by_hand(nodes: list[list[Node]], segments: list[list[tuple[int, float, int, float]]]) -> Levels:
    """Segments are (place in the rank, offset, place in the next, offset)."""
    levels = Levels()
    for rank in nodes:
        levels.ranks.append(list(range(len(levels.nodes), len(levels.nodes) + len(rank))))
        levels.nodes += rank
    for r, gap in enumerate(segments):
        above, below = levels.ranks[r], levels.ranks[r + 1]
        levels.segments.append([Segment(above[i], a, below[j], b, 1.0) for i, a, j, b in gap])
    return levels


@st.composite
def some_levels(
    draw: st.DrawFn, most: int = 6, ranks: int = 4, boxes: bool = False, kin: bool = False, ports: bool = True
) -> Levels:
    """Some ranks with segments between; nodes of boxes and groups if asked."""
    offsets = st.sampled_from([-0.5, 0.0, 0.5]) if ports else st.just(0.0)
    sizes = draw(st.lists(st.integers(1, most), min_size=2, max_size=ranks))
    nodes = [
        [
            Node(
                r,
                ((0, 0.0, 0.0),),
                (0.5, 0.0),
                draw(st.integers(-1, 1)) if kin else -1,
                draw(st.integers(-1, 1)) if boxes else -1,
            )
            for _ in range(size)
        ]
        for r, size in enumerate(sizes)
    ]
    gaps = [
        draw(
            st.lists(st.tuples(st.integers(0, a - 1), offsets, st.integers(0, b - 1), offsets), min_size=1, max_size=14)
        )
        for a, b in pairwise(sizes)
    ]
    return levels_by_hand(nodes, gaps)


@st.composite
def symmetric_levels(draw: st.DrawFn, most: int = 3, ranks: int = 4) -> Levels:
    """Some ranks of which each is pairs of mirror images, the first of each before the axis, with up to two nodes in
    the middle; segments are images of each other, of which one may be idle."""
    offsets = st.sampled_from([-0.5, 0.0, 0.5])
    sizes = draw(st.lists(st.tuples(st.integers(1, most), st.integers(0, 2)), min_size=2, max_size=ranks))
    nodes = [[Node(r, ((0, 0.0, 0.0),)) for _ in range(2 * pairs + middle)] for r, (pairs, middle) in enumerate(sizes)]
    gaps: list[list[tuple[int, float, int, float]]] = []
    asked: list[int] = []
    for above, below in pairwise(sizes):
        ends = st.tuples(st.integers(0, 2 * above[0] + above[1] - 1), offsets)
        others = st.tuples(st.integers(0, 2 * below[0] + below[1] - 1), offsets)
        some = draw(st.lists(st.tuples(ends, others), min_size=1, max_size=6, unique=True))
        both = [(opposite(one, *above), opposite(other, *below)) for one, other in some]
        gaps.append([(*one, *other) for one, other in dict.fromkeys([*some, *both])])
        asked.append(len(some) if draw(st.booleans()) else len(gaps[-1]))
    levels = levels_by_hand(nodes, gaps)
    levels.segments = [
        [replace(s, idle=i >= many) for i, s in enumerate(gap)]
        for gap, many in zip(levels.segments, asked, strict=True)
    ]
    for rank, (pairs, _) in zip(levels.ranks, sizes, strict=True):
        levels.images.update((rank[i], rank[-1 - i]) for i in range(-pairs, pairs))
    return levels


def opposite(end: tuple[int, float], pairs: int, middle: int) -> tuple[int, float]:
    """The image of a port of the node at a place; those in the middle are nobody's image."""
    place, offset = end
    return end if pairs <= place < pairs + middle else (2 * pairs + middle - 1 - place, -offset + 0.0)


def by_pairs(levels: Levels, order: Order) -> int:
    """Crossings of what is not idle, pair by pair, from the definition."""
    total = 0
    for r, gap in enumerate(levels.segments):
        upper = {node: i for i, node in enumerate(order[r])}
        lower = {node: i for i, node in enumerate(order[r + 1])}
        ends = [((upper[s.upper], s.a), (lower[s.lower], s.b)) for s in gap if not s.idle]
        total += sum(a < c and d < b for (a, b), (c, d) in product(ends, ends))
    return total


@given(st.lists(st.integers(0, 9), max_size=40))
@settings(deadline=None)
def test_inversions_are_pairs_out_of_order(values: list[int]) -> None:
    expected = sum(a > b for i, a in enumerate(values) for b in values[i + 1 :])
    assert inversions(np.array(values, dtype=np.int64)) == expected


@given(some_levels(), st.randoms(use_true_random=False))
@settings(deadline=None)
def test_the_fast_count_is_the_plain_one(levels: Levels, random: Random) -> None:
    order = [random.sample(rank, len(rank)) for rank in levels.ranks]
    assert crossings(levels, order) == by_pairs(levels, order)


@given(some_levels(), st.randoms(use_true_random=False))
@settings(deadline=None)
def test_what_is_turned_has_its_ports_the_other_way_round(levels: Levels, random: Random) -> None:
    turned = np.array([random.random() < 0.5 for _ in levels.nodes])
    side = np.where(turned, -1.0, 1.0)
    gaps = [[replace(s, a=s.a * side[s.upper], b=s.b * side[s.lower]) for s in gap] for gap in levels.segments]
    place = places(len(levels.nodes), levels.ranks)
    assert Segments(levels).count(place, turned) == by_pairs(replace(levels, segments=gaps), levels.ranks)


# A heuristic, which need not find the best of whatever there may be: the examples are the same where others are looked
# for.
@given(some_levels(most=4, ranks=3))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_tiny_graphs_are_ordered_as_well_as_can_be(levels: Levels) -> None:
    every = product(*map(permutations, levels.ranks))
    best = min(by_pairs(levels, [list(rank) for rank in order]) for order in every)
    assert by_pairs(levels, ordered(levels)[1]) == best


@given(some_levels(boxes=True, kin=True))
@examples(20)
def test_every_rank_keeps_its_nodes_and_its_boxes_together(levels: Levels) -> None:
    order = ordered(levels)[1]
    assert [sorted(rank) for rank in order] == levels.ranks
    for rank in order:
        boxes = [levels.nodes[node].box for node in rank]
        runs = [box for i, box in enumerate(boxes) if i == 0 or boxes[i - 1] != box]
        assert len([box for box in runs if box >= 0]) == len({box for box in boxes if box >= 0})


def test_a_group_keeps_its_order_unless_crossings_gain_clearly() -> None:
    group = [Node(0, ((i, 0.0, 0.0),), kin=0) for i in range(3)]
    alone = [Node(1, ((i + 3, 0.0, 0.0),), kin=i + 1) for i in range(3)]
    turned = levels_by_hand([group, alone], [[(0, 0.0, 2, 0.0), (1, 0.0, 1, 0.0), (2, 0.0, 0, 0.0)]])
    assert ordered(turned)[1] == [[0, 1, 2], [5, 4, 3]]  # what is in no group makes way
    both = levels_by_hand([group, [Node(1, ((i + 3, 0.0, 0.0),), kin=1) for i in range(3)]], [
        [(0, 0.0, 2, 0.0), (1, 0.0, 1, 0.0), (2, 0.0, 0, 0.0)]
    ])  # fmt: skip
    assert by_pairs(both, ordered(both)[1]) == 0  # a clear gain


def test_complete_layers_stay_in_the_order_of_their_numbers() -> None:
    sizes = (4, 6, 3)
    ranks = [[Node(r, ((10 * r + i, 0.0, 0.0),), kin=r) for i in range(size)] for r, size in enumerate(sizes)]
    gaps = [[(i, 0.0, j, 0.0) for i in range(a) for j in range(b)] for a, b in pairwise(sizes)]
    levels = levels_by_hand(ranks, gaps)
    assert ordered(levels)[1] == levels.ranks


@given(some_levels(ports=False))
@examples(15)
def test_the_order_of_segments_does_not_show(levels: Levels) -> None:
    turned = Levels(levels.nodes, levels.ranks, [gap[::-1] for gap in levels.segments])
    assert [*map(set, ordered(turned)[1])] == [*map(set, levels.ranks)]
    assert by_pairs(turned, ordered(turned)[1]) == by_pairs(levels, ordered(levels)[1])


@given(some_levels(boxes=True, kin=True))
@settings(deadline=None)
def test_exchanges_save_what_they_say(levels: Levels) -> None:
    classes = np.array([n.box for n in levels.nodes]), np.array([n.kin for n in levels.nodes])
    ranks: list[Ints] = [np.array(rank, dtype=np.int64) for rank in levels.ranks]
    before = by_pairs(levels, levels.ranks)
    after, order = Exchange(Segments(levels), classes, Halves(levels)).improved(before, ranks)
    assert after == by_pairs(levels, [rank.tolist() for rank in order]) <= before
    kept = [[n for n in rank if levels.nodes[n].kin == 0 and levels.nodes[n].box == -1] for rank in order]
    assert all(nodes == sorted(nodes) for nodes in kept)


@given(symmetric_levels())
@settings(deadline=None)
def test_exchanges_of_mirror_images_save_what_they_say(levels: Levels) -> None:
    none = np.full(len(levels.nodes), -1, dtype=np.int64)
    ranks: list[Ints] = [np.array(rank, dtype=np.int64) for rank in levels.ranks]
    before = by_pairs(levels, levels.ranks)
    after, order = Exchange(Segments(levels), (none, none), Halves(levels)).improved(before, ranks)
    assert after == by_pairs(levels, [rank.tolist() for rank in order]) <= before
    assert_symmetric(levels, [rank.tolist() for rank in order])


@given(symmetric_levels())
@settings(deadline=None, max_examples=40, derandomize=True)
def test_symmetric_ranks_are_ordered_as_well_as_can_be(levels: Levels) -> None:
    order = ordered(levels)[1]
    assert_symmetric(levels, order)
    best = min(by_pairs(levels, list(every)) for every in product(*(halves_of(levels, r) for r in levels.ranks)))
    assert by_pairs(levels, order) == best


def halves_of(levels: Levels, rank: list[int]) -> list[list[int]]:
    """Every symmetric order of a rank."""
    pairs = len([n for n in rank if n in levels.images]) // 2
    middle = rank[pairs : len(rank) - pairs]
    return [
        [*before, *between, *(levels.images[n] for n in reversed(before))]
        for before in permutations(rank[:pairs])
        for between in permutations(middle)
    ]


def assert_symmetric(levels: Levels, order: Order) -> None:
    """The first of each pair stands before the axis, its image opposite."""
    for rank, named in zip(order, levels.ranks, strict=True):
        assert sorted(rank) == named
        for n, other in zip(rank, reversed(rank), strict=True):
            assert levels.images.get(n, other) == other
        assert all(rank.index(n) < rank.index(m) for n, m in levels.images.items() if n < m and n in rank)
