"""Bypasses: detours for the routes that would run through foreign frames, or over discs.

In: routes that are drawn, what is in the way. Out: detours by edge index, where there are some.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from neurovis_layouts.routing.detours import Detours
from neurovis_layouts.routing.ends import shared_ends
from neurovis_layouts.routing.obstacles import TOUCH, Obstacles
from neurovis_layouts.routing.walls import Walls
from neurovis_spec.layout.model import LayoutEdge, Point, Route

#: What comes this close to a disc may be measured to run over it.
_BARELY = 0.01
#: Where more run over discs than this, detours would only move the crowd.
_MOST = 60


def round_frames(
    edges: Sequence[LayoutEdge], centres: Sequence[Point], routes: Mapping[int, Route], walls: Walls
) -> dict[int, Route]:
    """Detours for the routes that enter foreign frames: first those that are longest by their straight way, which so
    take the inner lanes round what they share with others."""
    chosen = sorted(routes)
    entered = walls.entered([routes[i] for i in chosen], [(edges[i].source, edges[i].target) for i in chosen])
    through = [i for i, enters in zip(chosen, entered, strict=True) if enters]
    if not through:
        return {}
    shared = shared_ends(edges)
    first = Detours(walls, centres, 1, ways=len(through))
    detours = Detours(walls, centres, ways=len(through))
    longer = {i: first.longer(edges[i].source, edges[i].target) for i in through}
    found: dict[int, Route] = {}
    for i in sorted(through, key=lambda i: (-longer[i], i)):
        own = edges[i].source, edges[i].target
        route = detours.route(*own, own not in shared)
        if route is not None:
            found[i] = route
    return found


def round_discs(
    edges: Sequence[LayoutEdge],
    centres: Sequence[Point],
    routes: Mapping[int, Route],
    obstacles: Obstacles,
    walls: Walls | None,
) -> dict[int, Route]:
    """Detours for the routes that run over discs all the same, where there are some."""
    chosen = sorted(routes)
    own = {i: (edges[i].source, edges[i].target) for i in chosen}
    clear = obstacles.clearances([routes[i] for i in chosen], [own[i] for i in chosen])
    over = {i: clearance for i, clearance in zip(chosen, clear, strict=True) if clearance < TOUCH + _BARELY}
    if not 0 < len(over) <= _MOST:
        return {}
    shared = shared_ends(edges)
    detours = Detours(walls or Walls((), len(centres)), centres, ways=len(over))
    found: dict[int, Route] = {}
    for i, clearance in over.items():
        route = detours.route(*own[i], own[i] not in shared)
        if route is not None and obstacles.clearance(route, own[i]) > clearance:
            found[i] = route
    return found
