"""The layout problem of a network, in canonical order.

In: a Network. Out: a LayoutProblem: neurons in the natural order of their names, edges in the natural order of
theirs. Whatever order the keys of the spec were written in, an engine sees the same problem, and so gives the same
layout; what the author lists, such as the names of a group, is in the order of the list.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import cast

import numpy as np

from neurovis_spec.compiler.drawing.drawing_settings import Seat
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.labels import label_room
from neurovis_spec.layout.makes import modules_of
from neurovis_spec.layout.model import (
    Arrangement,
    Direction,
    Layout,
    LayoutCell,
    LayoutEdge,
    LayoutGroup,
    LayoutMirror,
    LayoutProblem,
    Point,
)
from neurovis_spec.layout.naming import natural_key

_NOWHERE = (math.nan, math.nan)
_ON_DISC = (0.0, 0.0)


def canonical(
    network: str,
    neurons: Iterable[str],
    groups: Iterable[tuple[str, Iterable[str]]] = (),
    edges: Iterable[tuple[str, str, str, int]] = (),
    pins: Mapping[str, Point] | None = None,
    direction: Direction = "down",
    arrange: Iterable[tuple[Iterable[str], Arrangement]] = (),
    boxes: Iterable[tuple[str, Iterable[str]]] = (),
    spacing: tuple[float, float] = (1.0, 2.0),
    entries: Iterable[str] = (),
    exits: Iterable[str] = (),
    modules: Iterable[tuple[str, str]] = (),
    relative: Mapping[str, Mapping[str, Point]] | None = None,
    origins: Mapping[str, Point] | None = None,
    mirrors: Iterable[tuple[str, Iterable[tuple[str, str]], Iterable[tuple[str, str]]]] = (),
    align: Iterable[Iterable[str]] = (),
    plan: Iterable[tuple[str, Iterable[str], Seat]] = (),
    places: Mapping[str, Point] | None = None,
    labels: Mapping[str, Point] | None = None,
    memory: Layout | None = None,
    aspect: float | None = None,
) -> LayoutProblem:
    """The problem made of these parts, in canonical order.

    ``edges`` are (name, source, target, delay); ``spacing`` is that of neurons, then that of ranks. Equal parts in
    any order give an equal problem. The members of a group and of an arrangement keep the order in which they are given
    (that of their numbers, or as the author lists them). ``modules`` are the paths of instances and the names of their
    modules (their neurons are those whose names begin with the path), ``relative`` the pins within instances,
    ``origins`` the places of these, ``mirrors`` the scope's path, the pairs of neurons and the pairs of instances;
    ``plan`` the path of the instance that is divided, what stands in which row and column of it, and how many of them
    that spans; ``places`` where neurons are as data; ``labels`` how wide and high are those that discs cannot hold;
    ``aspect`` the width of the page by its height, where one is asked for.
    """
    names = tuple(sorted(neurons, key=natural_key))
    index = {name: i for i, name in enumerate(names)}

    def members(of: Iterable[str]) -> tuple[int, ...]:
        return tuple(sorted({index[name] for name in of}))

    pinned = {index[name]: (float(x), float(y)) for name, (x, y) in (pins or {}).items()}
    known = (LayoutEdge(name, index[source], index[target], delay) for name, source, target, delay in edges)
    # as `edge_key` orders their names, without a key for each of 50,000: neurons are in their order already
    ordered_edges = tuple(sorted(known, key=lambda edge: (edge.source, edge.target, len(edge.name), edge.name)))
    ordered_groups = tuple(
        LayoutGroup(name, tuple(index[member] for member in of))
        for name, of in sorted(groups, key=lambda group: natural_key(group[0]))
    )
    arranged = tuple(sorted((tuple(index[member] for member in of), how) for of, how in arrange))
    framed = tuple(sorted(_merged((name, members(of)) for name, of in boxes), key=lambda box: natural_key(box[0])))
    instances = modules_of(
        names, tuple(modules), ordered_edges, ordered_groups, arranged, framed, relative or {}, origins or {}
    )
    where = {instance.path: place for place, instance in enumerate(instances)}
    return LayoutProblem(
        network=network,
        neurons=names,
        groups=ordered_groups,
        edges=ordered_edges,
        pins=dict(sorted(pinned.items())),
        direction=direction,
        arrange=arranged,
        boxes=framed,
        neuron_spacing=spacing[0],
        rank_spacing=spacing[1],
        aspect=aspect,
        entries=members(entries),
        exits=members(exits),
        modules=instances,
        mirrors=tuple(
            sorted(
                (
                    LayoutMirror(
                        where.get(scope, -1),
                        tuple(sorted((index[one], index[other]) for one, other in pairs)),
                        tuple(sorted((where[one], where[other]) for one, other in paths)),
                    )
                    for scope, pairs, paths in mirrors
                ),
                key=lambda mirror: mirror.pairs,
            )
        ),
        align=tuple(sorted(members(line) for line in align)),
        plan=tuple(
            sorted(
                (LayoutCell(members(of), seat, where.get(scope, -1)) for scope, of, seat in plan),
                key=lambda cell: (cell.scope, cell.members),
            )
        ),
        places=tuple((places or {}).get(name, _NOWHERE) for name in names) if places else (),
        labels=tuple((labels or {}).get(name, _ON_DISC) for name in names) if labels else (),
        memory=memory,
    )


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

    boxes = [(name, named(members)) for name, members in settings.boxes]
    boxes += [(group.box, named(group.indices)) for group in network.neurons.groups if group.box is not None]
    edges = zip(
        network.connection_names,
        named(connections.sources.tolist()),
        named(connections.targets.tolist()),
        connections.delays.tolist(),
        strict=True,
    )
    return canonical(
        network.name,
        names,
        [(group.name, named(group.indices)) for group in network.neurons.groups],
        edges,
        {names[i]: position for i, position in settings.positions.items()},
        settings.direction,
        [(named(members), cast(Arrangement, how)) for members, how in settings.arrange],
        boxes,
        (settings.neuron_spacing, settings.rank_spacing),
        named(_entries(network)),
        named(_exits(network)),
        [(instance.path, instance.module) for instance in network.instances],
        {path: {names[i]: point for i, point in pins.items()} for path, pins in settings.relative},
        settings.origins,
        [
            (mirror.scope, [(names[a], names[b]) for a, b in mirror.pairs], mirror.instances)
            for mirror in settings.mirrors
        ],
        [named(line) for line in settings.align],
        [(cell.scope, named(cell.members), cell.seat) for cell in settings.plan],
        _places(network),
        dict(zip(names, label_room(network), strict=False)),
        memory,
        aspect=None if network.render.size is None else network.render.size[0] / network.render.size[1],
    )


def _places(network: Network) -> dict[str, Point]:
    """The ``position`` of the neurons that have one."""
    known = np.isfinite(network.neurons.position).all(axis=1)
    points = network.neurons.position.tolist()
    return {network.neurons.names[i]: (points[i][0], points[i][1]) for i in np.flatnonzero(known).tolist()}


def _entries(network: Network) -> list[int]:
    fed = [i for i, entry in enumerate(network.neurons.input.tolist()) if entry >= 0]
    return fed + [i for group in network.neurons.groups if group.role == "input" for i in group.indices]


def _exits(network: Network) -> list[int]:
    named = [int(i) for output in network.outputs for i in output.neurons.tolist()]
    return named + [i for group in network.neurons.groups if group.role == "output" for i in group.indices]
