"""Finish: the last stage of engines that place neurons anywhere: from places to a complete layout.

In: a problem and places in the engine's frame (x across, y along). Out: a Layout: pins exact, edges routed, turned to
the direction, what is remembered kept.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

import numpy as np

from neurovis_layouts.boxed import boxes_apart
from neurovis_layouts.frame import from_picture, to_picture
from neurovis_layouts.incremental import kept
from neurovis_layouts.label_room import outward, rect_of
from neurovis_layouts.pins import with_origins
from neurovis_layouts.routing import RoutePlan, Surroundings, route_all
from neurovis_layouts.routing.images import Images
from neurovis_layouts.symmetry import Symmetry, exact, routed_alike
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.geometry import Rect, near_pairs, snap, straight
from neurovis_spec.layout.metrics import label_overlaps
from neurovis_spec.layout.model import Layout, LayoutProblem, Point, Side

#: With more connections than this, routes do not go round discs: they would only run over others.
_CAREFUL = 1000
#: So often labels are given room at most, and how much more with each time.
_TRIES, _GROWTH = 4, 1.1


def drawn(
    problem: LayoutProblem,
    engine: str,
    places: FloatArray,
    clear: Iterable[int] = (),
    within: Rect | None = None,
    symmetry: Symmetry | None = None,
    sides: Mapping[str, Side] | None = None,
) -> Layout:
    """The layout with the neurons at ``places`` (n, 2; there may be more rows than neurons), where no pin says
    otherwise. Instances without a pin are kept off the frames of those that have one. The edges ``clear``, by index,
    run straight, as the caller knows that nothing is in their way. Places that are data lie ``within`` a rectangle:
    then nothing is kept off a frame, and what is in the way of the other edges is gone round in there. With a
    ``symmetry`` images, and routes between them, are exact reflections. Labels have room on these ``sides``,
    else away from the middle."""
    flat: list[Point] = [(snap(x), snap(y)) for x, y in places[: len(problem.neurons)].tolist()]
    for i, point in problem.pins.items():
        flat[i] = from_picture(point, problem.direction)
    pins = with_origins(problem, {i: to_picture(point, problem.direction) for i, point in enumerate(flat)})
    centres, images, ghosts = flat, Images(), list[Point]()
    if symmetry is not None and symmetry.paired.any():
        centres = exact(problem, symmetry, centres)
        images, ghosts = routed_alike(problem, symmetry, centres)
    there = {i: straight(centres[problem.edges[i].source], centres[problem.edges[i].target]) for i in clear}
    plan, around = RoutePlan(there=there, images=images), Surroundings(within=within)
    routes = route_all(problem.edges, [*centres, *ghosts], plan, around, _CAREFUL)
    turned = problem.direction
    shown = [to_picture(point, turned) for point in centres]
    fresh = Layout(
        problem.network,
        engine,
        dict(zip(problem.neurons, shown, strict=True)),
        {
            edge.name: route if turned == "down" else tuple(to_picture(point, turned) for point in route)
            for edge, route in zip(problem.edges, routes, strict=True)
        },
        outward(problem, shown) if sides is None else sides,
    )
    return kept(problem, fresh, pins, around=within is None)


def drawn_apart(problem: LayoutProblem, engine: str, places: FloatArray, spacing: float, symmetry: Symmetry) -> Layout:
    """The layout at places near these (n, 2): discs ``spacing`` apart, nothing foreign in a frame, and labels on
    nothing, as far as pins allow."""
    if not any(wide for wide, _ in problem.labels):
        return drawn(problem, engine, boxes_apart(problem, places, spacing, symmetry), symmetry=symmetry)
    labels = np.full((len(places), 4), np.nan)
    sides = outward(problem, [to_picture((x, y), problem.direction) for x, y in places.tolist()])
    for i, name in enumerate(problem.neurons):
        if name in sides:
            labels[i] = rect_of(problem.labels[i], sides[name], problem.direction)
    for _ in range(_TRIES):
        moved = boxes_apart(problem, places, spacing, symmetry, labels)
        layout = drawn(problem, engine, moved, symmetry=symmetry, sides=sides)
        if problem.pins or not label_overlaps(layout, problem):
            break
        places = _GROWTH * places  # such as where routes bow farther out of their frame than expected
    return layout


def alone(problem: LayoutProblem, chosen: Iterable[int]) -> list[int]:
    """Of these edges those that are alone between their ends."""
    ends = [frozenset((edge.source, edge.target)) for edge in problem.edges]
    times = Counter(ends)
    return [i for i in chosen if times[ends[i]] == 1]


def pinned_places(problem: LayoutProblem) -> tuple[IntArray, FloatArray]:
    """The pinned neurons (p,), in order, and their places in the engine's frame (p, 2)."""
    fixed = np.array(sorted(problem.pins), dtype=np.int64)
    there = [from_picture(problem.pins[i], problem.direction) for i in fixed.tolist()]
    return fixed, np.array(there, dtype=np.float64).reshape(-1, 2)


def nearest(places: FloatArray, reach: float) -> FloatArray:
    """(n,) how far each place is from the next one, at most ``reach``."""
    one, other, _, far = near_pairs(places, reach)
    least = np.full(len(places), reach)
    np.minimum.at(least, one, far)
    np.minimum.at(least, other, far)
    return least
