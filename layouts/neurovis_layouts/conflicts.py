"""Conflicts: where the places of an earlier layout break a symmetry of the spec, the symmetry wins.

In: a problem, a fresh layout of it, and the places of an earlier layout, which may have been edited by hand. Out: new
places for the neurons that have to move: those of an instance follow the first instance of the same make; of a mirrored
pair the one that was not moved by hand follows the other (else the second follows the first). Where the fresh layout
is not symmetric either, nothing moves.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from neurovis_layouts.occupancy import overlapping
from neurovis_spec.layout.model import LayoutModule, LayoutProblem, Point

#: Differences up to this are rounding.
_SLACK = 1e-6


def resolved(
    problem: LayoutProblem, fresh: Sequence[Point], known: Mapping[int, Point], hand: Mapping[int, Point]
) -> tuple[dict[int, Point], dict[int, Point]]:
    """Two mappings: the wanted places of neurons that cannot stay where they were, and of all that is placed together
    with them; and the places given by hand (``hand`` says where these neurons were before) or derived from such places.
    Both are empty where the earlier layout breaks no symmetry."""
    where = dict(known)
    moved: set[int] = set()
    _follow_makes(problem, fresh, where, moved)
    put = set(hand) - moved
    _follow_mirrors(problem, fresh, where, moved, hand, put)
    both = whole(problem, overlapping({i: where[i] for i in put}, problem.pins)) & put
    put -= both
    moved |= both
    moved -= problem.pins.keys() | put
    return {i: where[i] for i in sorted(moved)}, {i: where[i] for i in sorted(put)}


def _follow_makes(problem: LayoutProblem, fresh: Sequence[Point], where: dict[int, Point], moved: set[int]) -> None:
    across = 0 if problem.direction in ("down", "up") else 1
    mirrored = (-1.0, 1.0) if across == 0 else (1.0, -1.0)
    makes: dict[str, list[LayoutModule]] = {}
    for module in problem.modules:
        makes.setdefault(module.template, []).append(module)
    for make in makes.values():
        # what is pinned may be bent by its pins
        make = sorted(make, key=lambda module: not problem.pins.keys().isdisjoint(module.members))
        first = next((m for m in make if any(i in where for i in m.members)), None)
        for other in make:
            if first is None or other is first:
                continue
            pairs = [(a, b) for a, b in zip(first.members, other.members, strict=True) if a in where and b in where]
            if not pairs or not any(_alike(pairs, fresh, fresh, flip) for flip in ((1.0, 1.0), mirrored)):
                continue
            if any(_alike(pairs, where, where, flip) for flip in ((1.0, 1.0), mirrored, (mirrored[1], mirrored[0]))):
                continue
            flip, shift = _best_fit(pairs, where, ((1.0, 1.0), mirrored), problem.pins)
            for a, b in pairs:
                where[b] = shift[0] + flip[0] * where[a][0], shift[1] + flip[1] * where[a][1]
            moved.update(whole(problem, [b for _, b in pairs]) & where.keys())


def _alike(
    pairs: Sequence[tuple[int, int]],
    one: Mapping[int, Point] | Sequence[Point],
    other: Mapping[int, Point] | Sequence[Point],
    flip: Point,
) -> bool:
    """Whether the second of the pairs stand as the first do, but for a flip and a shift."""
    shifts = [(other[b][0] - flip[0] * one[a][0], other[b][1] - flip[1] * one[a][1]) for a, b in pairs]
    x, y = shifts[0]
    return all(abs(a - x) <= _SLACK and abs(b - y) <= _SLACK for a, b in shifts)


def _best_fit(
    pairs: Sequence[tuple[int, int]], where: Mapping[int, Point], flips: Sequence[Point], pins: Mapping[int, Point]
) -> tuple[Point, Point]:
    """The flip and the shift by which most stay where they are; those that are pinned count above all."""
    best: tuple[int, Point, Point] | None = None
    for flip in flips:
        votes: Counter[Point] = Counter()
        for a, b in pairs:
            shift = where[b][0] - flip[0] * where[a][0], where[b][1] - flip[1] * where[a][1]
            votes[shift] += len(pairs) + 1 if b in pins else 1
        shift, count = max(votes.items(), key=lambda vote: (vote[1], -abs(vote[0][0]), -abs(vote[0][1]), vote[0]))
        if best is None or count > best[0]:
            best = count, flip, shift
    assert best is not None
    return best[1], best[2]


def _follow_mirrors(
    problem: LayoutProblem,
    fresh: Sequence[Point],
    where: dict[int, Point],
    moved: set[int],
    hand: Mapping[int, Point],
    put: set[int],
) -> None:
    across = 0 if problem.direction in ("down", "up") else 1
    for mirrored in pairs_by_axis(problem):
        pairs = [(a, b) for a, b in mirrored if a in where and b in where]
        twice = twice_axis(pairs, fresh, across)
        pairs = [(a, b) for a, b in pairs if _mirrored(fresh[a], fresh[b], twice, across)]
        if not pairs:
            continue
        # what was moved by hand does not take the axis along, unless all was
        firm = [(a, b) for a, b in pairs if a not in hand or b not in hand]
        twice = twice_axis(firm or pairs, {**where, **hand} if firm else where, across)
        followed: list[int] = []
        for a, b in pairs:
            if _mirrored(where[a], where[b], twice, across):
                continue
            leads = [(i in problem.pins, i in hand) for i in (a, b)]
            first, second = (b, a) if leads[1] > leads[0] else (a, b)
            x, y = where[first]
            where[second] = (twice - x, y) if across == 0 else (x, twice - y)
            if first in put and second not in problem.pins:
                put.add(second)
            else:
                followed += (a, b)
        moved.update(whole(problem, followed) & where.keys())


def pairs_by_axis(problem: LayoutProblem) -> list[list[tuple[int, int]]]:
    """The pairs of mirror images, those about one axis together."""
    found: dict[int, list[tuple[int, int]]] = {}
    for mirror in problem.mirrors:
        found.setdefault(mirror.scope, []).extend(mirror.pairs)
    return list(found.values())


def twice_axis(pairs: Sequence[tuple[int, int]], where: Mapping[int, Point] | Sequence[Point], across: int) -> float:
    """Twice where the axis of these pairs stands: their median."""
    totals = sorted(where[a][across] + where[b][across] for a, b in pairs)
    return totals[len(totals) // 2] if totals else 0.0


def _mirrored(one: Point, other: Point, twice: float, across: int) -> bool:
    return abs(one[across] + other[across] - twice) <= _SLACK and abs(one[1 - across] - other[1 - across]) <= _SLACK


def whole(problem: LayoutProblem, neurons: Iterable[int]) -> set[int]:
    """These neurons with all others in the outermost instances around them, and the mirror images of all of them."""
    found = set(neurons)
    images = {n: mate for mirror in problem.mirrors for a, b in mirror.pairs for n, mate in ((a, b), (b, a))}
    found |= {images[n] for n in found if n in images}
    for module in problem.modules:
        if module.parent < 0 and not found.isdisjoint(module.members):
            found.update(module.members)
    found |= {images[n] for n in found if n in images}
    return found
