"""Where glyphs stand: at the centres of what they hold, in the layout of the whole, else laid out anew.

In: a Gathered, the layout of the whole. Out: the layout of what is drawn. All keep their places to each other; where
everything is far apart it moves closer together. Where discs would touch, all is laid out anew, mirrored pairs
mirrored; so are pathways, but for those of a network that its author has placed: they have to be far enough from each
other that there is room for what stands beside their lines.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Instance, Network
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import RADIUS, TURNED, Layout, LayoutProblem, Point
from neurovis_spec.layout.problem import NamedProblem, aspect_of, in_direction
from neurovis_spec.scene.collapse import Gathered, gathered

#: How a glyph grows with the number of its neurons: so much for ten times as many, and at most.
_GROWTH, _LARGEST = 0.5, 3.0
#: More square units than this a disc are much, for so many discs at most; all is laid out anew where that takes so many
#: times less.
_AREA, _MOST_ANEW, _SPARSER = 8.0, 300, 1.5
#: Between the rims of any two discs at least, where all move closer together, and of pathways, in layout units.
_LEAST, _CLOSE, _TEXT = 0.15, 1.2, 1.2
#: Ranks of pathways below each other are so many times as far apart: what stands beside a line is wide, not high.
_RANKS = 0.6


def radius_of(size: int) -> float:
    """The radius of a glyph of so many neurons, in layout units.

    >>> radius_of(1), round(radius_of(10), 3)
    (0.3, 0.45)
    """
    return RADIUS * min(_LARGEST, 1 + _GROWTH * math.log10(max(size, 1)))


def laid_out_alone(network: Network, settings: RenderSettings) -> bool:
    """Whether what is drawn is laid out whatever the layout of the whole is: pathways, unless the author says where
    neurons are."""
    return settings.pathways and not _placed(network)


def standing(network: Network, layout: Layout | None, settings: RenderSettings) -> tuple[Gathered, Layout]:
    """What is drawn of a network that has this layout, None where that does not matter, and where it stands; in the
    direction that the page chose, if it did."""
    drawn = gathered(in_direction(network, layout), settings.collapse, settings.pathways)
    found = _laid_out(drawn, layout, settings.size)
    if found.direction not in (None, drawn.network.layout.direction):
        drawn = gathered(in_direction(network, found), settings.collapse, settings.pathways)
    return drawn, found


def _laid_out(drawn: Gathered, layout: Layout | None, size: tuple[int, int] | None) -> Layout:
    """The layout of what is drawn in place of the whole, on a page of this size, if one is asked for."""
    radii = np.array([radius_of(size) for size in drawn.sizes.tolist()])
    if drawn.strands is not None and not _placed(drawn.whole):
        return _anew(drawn, float(radii.max()) / RADIUS, aspect_of(size))
    assert layout is not None
    if not drawn.any:
        return layout
    places = np.array([layout.positions[name] for name in drawn.whole.neurons.names], float)
    centres = np.stack([drawn.mean(places[:, axis]) for axis in (0, 1)], axis=1)
    scale = _scale(centres, radii)
    if scale is None or _sparse(scale * centres):
        spacing = max(1.0, 2 * float(radii.max()) + _LEAST)
        anew = lay_out_problem(_problem(drawn, {}, spacing))
        if scale is None or _SPARSER * _across(anew) < _across(scale * centres):
            return anew
    names = drawn.network.neurons.names
    points = [(snap(x), snap(y)) for x, y in (scale * centres).tolist()]
    found = _routed(drawn, dict(zip(names, points, strict=True)), _larger(np.array(points), radii))
    if scale != 1:
        return found
    kept = {
        name: layout.routes[name]
        for name, joined in zip(drawn.network.connection_names, drawn.sheaf, strict=True)
        if not joined and name in layout.routes
    }
    ends = zip(drawn.network.connections.sources.tolist(), drawn.network.connections.targets.tolist(), strict=True)
    for name, (a, b) in zip(drawn.network.connection_names, ends, strict=True):
        if name in kept:  # from centre to centre, to the last digit
            kept[name] = (found.positions[names[a]], *kept[name][1:-1], found.positions[names[b]])
    labels = {name: side for name, side in layout.labels.items() if name in found.positions}
    return Layout(found.network, layout.engine, found.positions, {**found.routes, **kept}, labels)


def _anew(drawn: Gathered, larger: float, aspect: float | None) -> Layout:
    """Pathways laid out among discs that are all so many times as large as neurons: as if all else were smaller. A page
    of this ``aspect``, where one is asked for, chooses the direction if nobody says it."""
    spacing = max(1.0, 2 * RADIUS + _TEXT / larger)
    problem = replace(_problem(drawn, {}, spacing), aspect=aspect, turnable=not drawn.whole.layout.directed)
    found = _ranked(problem)
    if problem.turns:
        across = _ranked(replace(problem, direction="right"))
        if _side(across, problem.page) < TURNED * _side(found, problem.page):
            found = replace(across, direction="right")
    positions = {name: _times(point, larger) for name, point in found.positions.items()}
    routes = {name: tuple(_times(point, larger) for point in route) for name, route in found.routes.items()}
    return Layout(found.network, found.engine, positions, routes, direction=found.direction)


def _ranked(problem: LayoutProblem) -> Layout:
    """Pathways laid out in the direction of their problem."""
    if problem.direction in ("down", "up"):
        problem = replace(problem, rank_spacing=_RANKS * problem.rank_spacing)
    return lay_out_problem(replace(problem, turnable=False))


def _side(layout: Layout, page: float) -> float:
    """How high a page has to be, at least, for what is laid out to fit; ``page`` is its width by its height."""
    wide, high = layout.sides
    return max(wide / page, high)


def _times(point: Point, factor: float) -> Point:
    return snap(factor * point[0]), snap(factor * point[1])


def _placed(network: Network) -> bool:
    """Whether its author says where neurons are."""
    return (
        bool(network.layout.positions)
        or network.layout.file is not None
        or bool(np.isfinite(network.neurons.position).any())
    )


def _sparse(places: FloatArray) -> bool:
    """Whether discs stand so far from each other that laying them out anew may well show more."""
    wide, high = (places.max(axis=0) - places.min(axis=0) + 1).tolist()
    return len(places) <= _MOST_ANEW and wide * high > _AREA * len(places)


def _across(places: FloatArray | Layout) -> float:
    """How far it is from corner to corner."""
    points = np.array(list(places.positions.values())) if isinstance(places, Layout) else places
    return float(np.hypot(*(points.max(axis=0) - points.min(axis=0) + 1)))


def _larger(places: FloatArray, radii: FloatArray) -> float:
    """How many times as large as a neuron discs are taken to be where lines are to keep off them."""
    one, other = np.triu_indices(len(places), 1)
    apart = np.hypot(*(places[one] - places[other]).T)
    room = float(apart.min(initial=np.inf)) / (2 * RADIUS + 0.05)
    return max(1.0, min(float(radii.max(initial=RADIUS)) / RADIUS, room))


def _routed(drawn: Gathered, where: dict[str, Point], larger: float) -> Layout:
    """Routes between these places, round discs so many times as large as neurons: as if all else were smaller."""
    pins = {name: (x / larger, y / larger) for name, (x, y) in where.items()}
    found = lay_out_problem(_problem(drawn, pins, 1.0))
    ends = zip(drawn.network.connections.sources.tolist(), drawn.network.connections.targets.tolist(), strict=True)
    routes, names = {}, drawn.network.neurons.names
    for name, (a, b) in zip(drawn.network.connection_names, ends, strict=True):
        inner = tuple((larger * x, larger * y) for x, y in found.routes[name][1:-1])
        routes[name] = (where[names[a]], *inner, where[names[b]])
    return Layout(found.network, found.engine, where, routes)


def _scale(centres: FloatArray, radii: FloatArray) -> float | None:
    """What to multiply places by so that discs are apart, and not farther than need be; None where some would touch."""
    one, other = np.triu_indices(len(centres), 1)
    if not len(one):
        return 1.0
    apart = np.hypot(*(centres[one] - centres[other]).T)
    rims = radii[one] + radii[other]
    if (apart < rims + _LEAST).any():
        return None
    return min(1.0, float(((rims + _CLOSE) / apart).max()))


def _problem(drawn: Gathered, pins: dict[str, Point], spacing: float) -> LayoutProblem:
    network = drawn.network
    names, connections, settings = network.neurons.names, network.connections, network.layout
    ends = zip(connections.sources.tolist(), connections.targets.tolist(), connections.delays.tolist(), strict=True)
    edges = [
        (name, names[source], names[target], delay)
        for name, (source, target, delay) in zip(network.connection_names, ends, strict=True)
    ]
    boxes = [(name, [names[i] for i in members]) for name, members in settings.boxes]
    boxes += [(group.box, [names[i] for i in group.indices]) for group in network.neurons.groups if group.box]
    inside = {instance.path: _inside(network, instance) for instance in network.instances}
    alike = [
        (one, other)
        for mirror in drawn.whole.layout.mirrors
        for one, other in mirror.instances
        if not mirror.scope and inside.get(one, ()) == inside.get(other)
    ]
    held = {f"{path}.{name}" for path, own in inside.items() for name in own}
    framed = {f"{path}.{name}" for pair in alike for path in pair for name in inside[path]}
    pairs = [
        (names[a], names[b])
        for mirror in settings.mirrors
        for a, b in mirror.pairs
        if not mirror.scope and all(names[end] in framed or names[end] not in held for end in (a, b))
    ]
    return NamedProblem(
        network.name,
        names,
        [(group.name + f"/{group.start}", [names[i] for i in group.indices]) for group in network.neurons.groups],
        edges,
        pins,
        settings.direction,
        boxes=() if pins else boxes,
        spacing=(spacing * settings.neuron_spacing, spacing * settings.rank_spacing),
        modules=() if pins else [(instance.path, instance.module) for instance in network.instances],
        mirrors=() if pins or not pairs else [("", pairs, alike)],
        plan=() if pins else [(cell.scope, [names[i] for i in cell.members], cell.seat) for cell in settings.plan],
    ).canonical()


def _inside(network: Network, instance: Instance) -> tuple[str, ...]:
    """What an instance holds, by its names within."""
    return tuple(network.neurons.names[index].removeprefix(f"{instance.path}.") for index in instance.indices)
