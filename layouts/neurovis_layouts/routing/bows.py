"""Bows: from any neuron to any other, straight where the way is clear, else round what is in it.

In: two centres, the obstacles, how far the route should bow at least. Out: a route.
"""

from __future__ import annotations

from collections.abc import Iterator

from neurovis_layouts.routing.obstacles import REACH, Obstacles
from neurovis_spec.layout.geometry import distance, straight
from neurovis_spec.layout.model import Point, Route

#: Heights tried where every connection can be followed, and where they are many.
MANY_TRIES, FEW_TRIES = 12, 2


def bow(start: Point, end: Point, height: float, hold: float = 0.3) -> Route:
    """A curve whose control points stand ``height`` to the left of the way, ``hold`` of it from the ends."""
    if height == 0:
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


def clear_bow(
    start: Point,
    end: Point,
    own: tuple[int, int],
    obstacles: Obstacles,
    least: float,
    sided: bool,
    tries: int = MANY_TRIES,
) -> tuple[Route, float, float]:
    """The flattest bow of at least ``least`` clear of foreign discs, else the clearest; its clearance and height.

    ``sided`` keeps it on the side of ``least`` (one of a reciprocal pair must not change over). ``tries`` is how many
    heights are tried.
    """
    best: tuple[Route, float, float] | None = None
    length = distance(start, end)
    for height, hold in _candidates(least, length, sided, tries):
        route = bow(start, end, height, hold)
        clearance = obstacles.clearance(route, own)
        if clearance >= REACH - 0.03:
            return route, clearance, height
        if best is None or clearance > best[1]:
            best = route, clearance, height
    assert best is not None
    return best


def _candidates(least: float, length: float, sided: bool, tries: int) -> Iterator[tuple[float, float]]:
    yield least, 0.3
    side = -1.0 if least < 0 else 1.0
    for step in range(1, tries + 1):
        more = step * (0.25 + 0.05 * length)
        for hold in (0.3, 0.05):
            yield least + side * more, hold
            if not sided:
                yield least - side * more, hold
