"""The layout problem of a network, in canonical order.

In: a Network, or parts by name (NamedProblem). Out: a LayoutProblem: neurons in the natural order of their names, edges
in the natural order of theirs. Whatever order the keys of the spec were written in, an engine sees the same problem,
and so gives the same layout; what the author lists, such as the names of a group, is in the order of the list.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import compress
from typing import cast

import numpy as np

from neurovis_spec.compiler.drawing.drawing_settings import Seat
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.labels import label_room
from neurovis_spec.layout.model import (
    Arrangement,
    Direction,
    Layout,
    LayoutCell,
    LayoutEdge,
    LayoutGroup,
    LayoutMirror,
    LayoutModule,
    LayoutProblem,
    Point,
)
from neurovis_spec.layout.naming import natural_key
from neurovis_spec.projection import joined, projected

_NOWHERE = (math.nan, math.nan)
_ON_DISC = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class NamedProblem:
    """A layout problem whose parts are known by name, in any order.

    >>> NamedProblem("pair", ["B", "A"], edges=[("B -> A", "B", "A", 1)]).canonical().neurons
    ('A', 'B')
    """

    network: str
    neurons: Iterable[str]
    #: their names and members, in the order of these
    groups: Iterable[tuple[str, Iterable[str]]] = ()
    #: name, source, target, delay
    edges: Iterable[tuple[str, str, str, int]] = ()
    pins: Mapping[str, Point] = field(default_factory=dict)
    direction: Direction = "down"
    #: members, in the order in which they are arranged, and how
    arrange: Iterable[tuple[Iterable[str], Arrangement]] = ()
    #: boxes of one name are one box
    boxes: Iterable[tuple[str, Iterable[str]]] = ()
    #: of neurons, and of ranks
    spacing: tuple[float, float] = (1.0, 2.0)
    entries: Iterable[str] = ()
    exits: Iterable[str] = ()
    #: the paths of instances and the names of their modules: their neurons are those whose names begin with the path
    modules: Iterable[tuple[str, str]] = ()
    #: by path, the pins within instances, and the places of instances
    relative: Mapping[str, Mapping[str, Point]] = field(default_factory=dict)
    origins: Mapping[str, Point] = field(default_factory=dict)
    #: the scope's path, the pairs of neurons and the pairs of instances
    mirrors: Iterable[tuple[str, Iterable[tuple[str, str]], Iterable[tuple[str, str]]]] = ()
    align: Iterable[Iterable[str]] = ()
    #: the path of the instance that is divided, what stands in a cell of it, and where that is
    plan: Iterable[tuple[str, Iterable[str], Seat]] = ()
    #: where neurons are as data
    places: Mapping[str, Point] = field(default_factory=dict)
    #: how wide and high the labels are that discs cannot hold
    labels: Mapping[str, Point] = field(default_factory=dict)
    memory: Layout | None = None
    #: the names of edges that lead back as well
    symmetric: Iterable[str] = ()
    #: the width of the page by its height, where one is asked for
    aspect: float | None = None
    #: whether nobody says the direction, so that the page may choose it
    turnable: bool = False

    def canonical(self) -> LayoutProblem:
        """The problem in canonical order: equal parts in any order give an equal problem. The members of a group and of
        an arrangement keep the order in which they are given (that of their numbers, or as the author lists them)."""
        names = tuple(sorted(self.neurons, key=natural_key))
        index = {name: i for i, name in enumerate(names)}

        def members(of: Iterable[str]) -> tuple[int, ...]:
            return tuple(sorted({index[name] for name in of}))

        boxes = _merged((name, members(of)) for name, of in self.boxes)
        free = LayoutProblem(
            network=self.network,
            neurons=names,
            groups=tuple(
                LayoutGroup(name, tuple(index[member] for member in of))
                for name, of in sorted(self.groups, key=lambda group: natural_key(group[0]))
            ),
            edges=self._edges(index),
            pins=dict(sorted((index[name], (float(x), float(y))) for name, (x, y) in self.pins.items())),
            direction=self.direction,
            arrange=tuple(sorted((tuple(index[member] for member in of), how) for of, how in self.arrange)),
            boxes=tuple(sorted(boxes, key=lambda box: natural_key(box[0]))),
            neuron_spacing=self.spacing[0],
            rank_spacing=self.spacing[1],
            aspect=self.aspect,
            turnable=self.turnable,
            entries=members(self.entries),
            exits=members(self.exits),
            align=tuple(sorted(members(line) for line in self.align)),
            places=tuple(self.places.get(name, _NOWHERE) for name in names) if self.places else (),
            labels=tuple(self.labels.get(name, _ON_DISC) for name in names) if self.labels else (),
            memory=self.memory,
        )
        modules = modules_of(free, tuple(self.modules), self.relative, self.origins)
        where = {module.path: number for number, module in enumerate(modules)}
        cells = (LayoutCell(members(of), seat, where.get(scope, -1)) for scope, of, seat in self.plan)
        mirrors = (
            LayoutMirror(
                where.get(scope, -1),
                tuple(sorted((index[one], index[other]) for one, other in pairs)),
                tuple(sorted((where[one], where[other]) for one, other in paths)),
            )
            for scope, pairs, paths in self.mirrors
        )
        return replace(
            free,
            modules=modules,
            mirrors=tuple(sorted(mirrors, key=lambda mirror: mirror.pairs)),
            plan=tuple(sorted(cells, key=lambda cell: (cell.scope, cell.members))),
        )

    def _edges(self, index: Mapping[str, int]) -> tuple[LayoutEdge, ...]:
        """As ``edge_key`` orders their names, without a key for each of 50,000: neurons are in their order already."""
        back = frozenset(self.symmetric)
        edges = (LayoutEdge(name, index[a], index[b], delay, name in back) for name, a, b, delay in self.edges)
        return tuple(sorted(edges, key=lambda edge: (edge.source, edge.target, len(edge.name), edge.name)))


def modules_of(
    problem: LayoutProblem,
    modules: Sequence[tuple[str, str]],
    relative: Mapping[str, Mapping[str, Point]],
    origins: Mapping[str, Point],
) -> tuple[LayoutModule, ...]:
    """The instances in the natural order of their paths, each with its neurons and its make: two are of one make if
    they are of one module and everything within them that a picture shows is equal: the names of the neurons in them,
    the connections among these with their delays, what is arranged or pinned."""
    names, ordered = problem.neurons, sorted(modules, key=lambda item: natural_key(item[0]))
    place = {path: number for number, (path, _) in enumerate(ordered)}
    ways = [_around(name, place) for name in names]
    members: list[list[int]] = [[] for _ in ordered]
    for neuron, way in enumerate(ways):
        for around in way:
            members[around].append(neuron)
    inside = _inside(problem, [path for path, _ in ordered], ways)
    known: dict[object, str] = {}
    numbers: dict[str, int] = {}
    result: list[LayoutModule] = []
    for number, (path, module) in enumerate(ordered):
        start, pins = len(path) + 1, relative.get(path, {})
        own = {index: pins[names[index]] for index in members[number] if names[index] in pins}
        make = (
            module,
            tuple(names[index][start:] for index in members[number]),
            tuple(inside[number]),
            tuple((names[index][start:], point) for index, point in own.items()),
        )
        if make not in known:
            numbers[module] = numbers.get(module, 0) + 1
            known[make] = module if numbers[module] == 1 else f"{module} ({numbers[module]})"
        parent = place.get(path.rpartition(".")[0], -1)
        result.append(LayoutModule(path, module, parent, tuple(members[number]), known[make], own, origins.get(path)))
    return tuple(result)


def _inside(problem: LayoutProblem, paths: Sequence[str], ways: Sequence[Sequence[int]]) -> list[list[object]]:
    """For each instance the connections, groups, arrangements and boxes that are all in it, by the names within.
    ``ways`` are the instances that each neuron is in."""
    inside: list[list[object]] = [[] for _ in paths]
    parts: list[tuple[Sequence[int], object]] = [
        ((e.source, e.target), ("edge", e.delay, e.symmetric)) for e in problem.edges
    ]
    parts += [(group.members, "group") for group in problem.groups]
    parts += [*problem.arrange, *((members, "box") for _, members in problem.boxes)]
    for ends, what in parts:
        for around in set(ways[ends[0]]).intersection(*(ways[end] for end in ends[1:])) if ends else ():
            start = len(paths[around]) + 1
            inside[around].append((what, tuple(problem.neurons[end][start:] for end in ends)))
    return inside


def _around(name: str, place: Mapping[str, int]) -> tuple[int, ...]:
    """The instances that a neuron is in, the outermost first."""
    found: list[int] = []
    end = name.find(".")
    while end >= 0:
        if name[:end] in place:
            found.append(place[name[:end]])
        end = name.find(".", end + 1)
    return tuple(found)


def _merged(boxes: Iterable[tuple[str, tuple[int, ...]]]) -> list[tuple[str, tuple[int, ...]]]:
    """Boxes of one name are one box."""
    joined: dict[str, set[int]] = {}
    for name, members in boxes:
        joined.setdefault(name, set()).update(members)
    return [(name, tuple(sorted(members))) for name, members in joined.items()]


def problem_of(network: Network, memory: Layout | None = None) -> LayoutProblem:
    """The layout problem of a compiled network: structure and layout settings, no activity, no weight. ``memory`` is an
    earlier layout of it."""
    names, settings, connections = network.neurons.names, network.layout, network.connections

    def named(indices: Iterable[int]) -> list[str]:
        return [names[i] for i in indices]

    drawn = np.ones(len(connections), dtype=np.bool_)
    drawn[connections.second] = False  # a symmetric pair is one line
    boxes = [(name, named(members)) for name, members in settings.boxes]
    boxes += [(group.box, named(group.indices)) for group in network.neurons.groups if group.box is not None]
    edges = compress(
        zip(
            network.connection_names,
            named(connections.sources.tolist()),
            named(connections.targets.tolist()),
            connections.delays.tolist(),
            strict=True,
        ),
        drawn.tolist(),
    )
    return NamedProblem(
        network=network.name,
        neurons=names,
        groups=[(group.name, named(group.indices)) for group in network.neurons.groups],
        edges=edges,
        pins={names[i]: position for i, position in settings.positions.items()},
        direction=settings.direction,
        arrange=[(named(members), cast(Arrangement, how)) for members, how in settings.arrange],
        boxes=boxes,
        spacing=(settings.neuron_spacing, settings.rank_spacing),
        entries=named(_entries(network)),
        exits=named(_exits(network)),
        modules=[(instance.path, instance.module) for instance in network.instances],
        relative={path: {names[i]: point for i, point in pins.items()} for path, pins in settings.relative},
        origins=settings.origins,
        mirrors=[
            (mirror.scope, [(names[a], names[b]) for a, b in mirror.pairs], mirror.instances)
            for mirror in settings.mirrors
        ],
        align=[named(line) for line in settings.align],
        plan=[(cell.scope, named(cell.members), cell.seat) for cell in settings.plan],
        places=_places(network),
        labels=dict(zip(names, label_room(network), strict=False)),
        memory=memory,
        symmetric=_symmetric(network),
        aspect=aspect_of(network.render.size),
        turnable=not settings.directed,
    ).canonical()


def aspect_of(size: tuple[int, int] | None) -> float | None:
    """The width of a page by its height; None where none is asked for."""
    return None if size is None else size[0] / size[1]


def in_direction(network: Network, layout: Layout | None) -> Network:
    """The network with the direction in which a layout draws it, where the page chose it."""
    if layout is None or layout.direction is None:
        return network
    return replace(network, layout=replace(network.layout, direction=layout.direction))


def _symmetric(network: Network) -> list[str]:
    """The names of the lines of symmetric pairs."""
    second, twins = network.connections.second, network.connections.twins
    return [] if twins is None else [network.connection_names[i] for i in twins[second].tolist()]


def _places(network: Network) -> dict[str, Point]:
    """The ``position`` of the neurons that have one."""
    known = np.isfinite(network.neurons.position).all(axis=1)
    position = network.neurons.position
    points = (position if position.shape[1] == 2 else joined(projected(position, network.layout.view)[0])).tolist()
    return {network.neurons.names[i]: (points[i][0], points[i][1]) for i in np.flatnonzero(known).tolist()}


def _entries(network: Network) -> list[int]:
    fed = [i for i, entry in enumerate(network.neurons.input.tolist()) if entry >= 0]
    return fed + [i for group in network.neurons.groups if group.role == "input" for i in group.indices]


def _exits(network: Network) -> list[int]:
    named = [int(i) for output in network.outputs for i in output.neurons.tolist()]
    return named + [i for group in network.neurons.groups if group.role == "output" for i in group.indices]
