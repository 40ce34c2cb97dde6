"""Nested bows: where bows span each other, as from one disc to the second and third in a row, longer ones run higher.

In: all bows. Out: for those that run on a shorter one which starts or ends at the same disc, a higher bow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from neurovis_layouts.routing.bows import bow
from neurovis_layouts.routing.line_overlap import line_of, together, tolerable
from neurovis_layouts.routing.obstacles import REACH, TOUCH, Obstacles
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import distance
from neurovis_spec.layout.model import LayoutEdge, Point, Route

#: How much of a bow may run on another, how close to the way of one an end of the other is, and by how much bows are
#: raised.
_SHARE, _NEAR, _RAISED = 0.2, 0.5, (0.15, 0.25, 0.35, 0.5, 0.7)
#: With more bows than this at a disc they are too many to be told apart.
_MOST = 12


def nested(
    edges: Sequence[LayoutEdge], centres: Sequence[Point], routes: Mapping[int, Route], obstacles: Obstacles
) -> dict[int, Route]:
    """Routes by edge index for those bows that have to be raised."""
    at: dict[int, list[int]] = {}
    for i in sorted(routes):
        for end in (edges[i].source, edges[i].target):
            at.setdefault(end, []).append(i)
    found: dict[int, Route] = {}
    lengths = {i: distance(route[0], route[-1]) for i, route in routes.items()}
    for i in sorted(routes, key=lambda i: (lengths[i], i)):
        ends = _ends(edges[i])
        near = {k for end in ends for k in at[end] if len(at[end]) <= _MOST}
        spanned = [k for k in sorted(near) if lengths[k] < lengths[i] and _spans(routes[i], centres, ends, edges[k])]
        mates = [line_of(found.get(k, routes[k])) for k in spanned]
        if mates and _shared(routes[i], mates) > 0:
            # not on to what it shares both ends with
            mates += [line_of(found.get(k, routes[k])) for k in sorted(near - {i}) if ends == _ends(edges[k])]
            raised = [_raised(routes[i], more) for more in _RAISED]
            clear = obstacles.clearances(raised, [(edges[i].source, edges[i].target)] * len(raised))
            enough = min(REACH - 0.03, obstacles.clearance(routes[i], (edges[i].source, edges[i].target)))
            for route, clearance in zip(raised, clear, strict=True):
                if clearance >= max(enough, TOUCH) and _shared(route, mates) <= 0:
                    found[i] = route
                    break
    return found


def _spans(route: Route, centres: Sequence[Point], ends: set[int], other: LayoutEdge) -> bool:
    """Whether another edge leads from an end of this route to what is on its straight way."""
    far = [end for end in (other.source, other.target) if end not in ends]
    if len(far) != 1:
        return False
    (ax, ay), (bx, by), (x, y) = route[0], route[-1], centres[far[0]]
    across = (x - ax) * (by - ay) - (y - ay) * (bx - ax)
    return abs(across) < _NEAR * distance(route[0], route[-1])


def _ends(edge: LayoutEdge) -> set[int]:
    return {edge.source, edge.target}


def _shared(route: Route, mates: Sequence[FloatArray]) -> float:
    """How much more of a route runs on others than may."""
    line = line_of(route)
    return together(line, mates) - tolerable(line, _SHARE)


def _raised(route: Route, more: float) -> Route:
    """A bow that is higher by so much, to the side that it bows to."""
    (ax, ay), (px, py), _, (bx, by) = route
    length = distance(route[0], route[-1])
    height = ((px - ax) * (by - ay) - (py - ay) * (bx - ax)) / length
    hold = ((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / (length * length)
    return bow(route[0], route[-1], height + (more if height >= 0 else -more), hold)
