"""Bows: from any neuron to any other, straight where the way is clear, else round what is in it.

In: two centres, the obstacles, how far the route should bow at least. Out: a route.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

from neurovis_layouts.routing.obstacles import REACH, Frame, Obstacles, Walls
from neurovis_spec.layout.geometry import Rect, bounds, distance, straight, united
from neurovis_spec.layout.model import LayoutEdge, Point, Route

#: Heights tried where every connection can be followed, and where they are many.
MANY_TRIES, FEW_TRIES = 12, 2
#: Clear enough.
_ENOUGH = REACH - 0.03


def unhindered(
    edges: Sequence[LayoutEdge], centres: Sequence[Point], clear: float = _ENOUGH, frames: Sequence[Frame] = ()
) -> list[int]:
    """Which edges may run straight: as far from all foreign discs as is ``clear``, and through no foreign frame."""
    ends = [(edge.source, edge.target) for edge in edges]
    lines = [straight(centres[a], centres[b]) for a, b in ends]
    far, entered = Obstacles(centres).clearances(lines, ends), Walls(frames, len(centres)).entered(lines, ends)
    return [i for i, (a, b) in enumerate(ends) if a != b and far[i] >= clear and not entered[i]]


def bow(start: Point, end: Point, height: float, hold: float) -> Route:
    """A curve whose control points stand ``height`` to the left of the way, ``hold`` of it from the ends."""
    if height == 0 or start == end:
        return straight(start, end)
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = distance(start, end)
    nx, ny = dy / length * height, -dx / length * height
    return (
        start,
        (start[0] + hold * dx + nx, start[1] + hold * dy + ny),
        (end[0] - hold * dx + nx, end[1] - hold * dy + ny),
        end,
    )


@dataclass(frozen=True, slots=True)
class BowSought:
    """A bow that is asked for: between which places and neurons, how high at least; ``sided`` keeps it on the side of
    ``least`` (one of a reciprocal pair must not change over)."""

    start: Point
    end: Point
    own: tuple[int, int]
    least: float
    sided: bool


def clear_bows(
    wishes: Sequence[BowSought], obstacles: Obstacles, tries: int, within: Rect | None
) -> list[tuple[Route, float, float]]:
    """For each wish the flattest bow clear of foreign discs, else the clearest; its clearance and height. ``tries`` is
    how many heights are tried on a side; bows that lead out of ``within`` are not."""
    found: list[tuple[Route, float, float] | None] = [None] * len(wishes)
    ways = [_candidates(w, tries, within) for w in wishes]
    waiting = list(range(len(wishes)))
    many = 1
    while waiting:
        # all of them at once, a few heights at a time, as most find their way soon
        chosen = [(i, height, hold) for i in waiting for height, hold in islice(ways[i], many)]
        bows = [bow(wishes[i].start, wishes[i].end, height, hold) for i, height, hold in chosen]
        clearances = obstacles.clearances(bows, [wishes[i].own for i, _, _ in chosen])
        tried: set[int] = set()
        clear: set[int] = set()
        for (i, height, _), route, clearance in zip(chosen, bows, clearances, strict=True):
            tried.add(i)
            best = found[i]
            if i not in clear and (best is None or clearance > best[1] or clearance >= _ENOUGH):
                found[i] = route, clearance, height
                if clearance >= _ENOUGH:
                    clear.add(i)
        waiting = [i for i in waiting if i in tried and i not in clear]
        many = 4
    return [best for best in found if best is not None]


def _candidates(wish: BowSought, tries: int, within: Rect | None) -> Iterator[tuple[float, float]]:
    """Heights, the flattest first, and how far from the ends control points stand."""
    least, length = wish.least, distance(wish.start, wish.end)
    yield least, 0.3
    side = -1.0 if least < 0 else 1.0
    for step in range(1, tries + 1):
        more = step * (0.25 + 0.05 * length)
        for hold in (0.3, 0.05):
            for height in (least + side * more, *(() if wish.sided else (least - side * more,))):
                if within is None or united([bounds(bow(wish.start, wish.end, height, hold)), within]) == within:
                    yield height, hold
