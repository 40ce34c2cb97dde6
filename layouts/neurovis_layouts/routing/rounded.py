"""Rounded: a line with corners as a smooth route.

In: a line, what tells whether a piece of curve is free. Out: a route along the line, every corner as round as may be.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from neurovis_spec.layout.geometry import distance, straight
from neurovis_spec.layout.model import Point, Route

#: How much of a corner is cut off, at most, the roundest first.
_CUTS = (3.0, 1.5, 0.8, 0.4, 0.2, 0.1)
#: Where on the way to the corner the control points of the round one stand.
_HOLD = 0.7


def rounded(line: Sequence[Point], free: Callable[[Route], bool]) -> Route:
    """The route along a line of at least two points; ``free`` says whether a round corner (four points) touches
    nothing. The sharpest is taken where none is."""
    points: list[Point] = [line[0]]
    for number in range(1, len(line) - 1):
        before, corner, after = line[number - 1 : number + 2]
        # half of the way to the next corner, all of it to an end, but for the arrowhead
        lead = distance(before, corner) * (0.8 if number == 1 else 0.5)
        tail = distance(corner, after) * (0.8 if number == len(line) - 2 else 0.5)
        for cut in _CUTS:
            piece = arc(corner, before, after, min(cut, lead), min(cut, tail))
            if free(piece):
                break
        if piece[0] != points[-1]:
            points += straight(points[-1], piece[0])[1:]
        points += piece[1:]
    if points[-1] != line[-1]:
        points += straight(points[-1], line[-1])[1:]
    return tuple(points)


def arc(corner: Point, before: Point, after: Point, lead: float, tail: float, hold: float = _HOLD) -> Route:
    """A corner as a round one, between what is cut off before it and behind it."""
    start, end = _towards(corner, before, lead), _towards(corner, after, tail)
    return (
        start,
        (start[0] + hold * (corner[0] - start[0]), start[1] + hold * (corner[1] - start[1])),
        (end[0] + hold * (corner[0] - end[0]), end[1] + hold * (corner[1] - end[1])),
        end,
    )


def _towards(origin: Point, other: Point, by: float) -> Point:
    share = by / distance(origin, other)
    return origin[0] + share * (other[0] - origin[0]), origin[1] + share * (other[1] - origin[1])
