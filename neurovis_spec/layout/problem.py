"""The layout problem of a network, in canonical order.

In: a Network. Out: a LayoutProblem: neurons in the natural order of their names, edges in the natural order of
theirs. Whatever order the spec was written in, an engine sees the same problem, and so gives the same layout.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import cast

from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.model import (
    Arrangement,
    Direction,
    LayoutEdge,
    LayoutGroup,
    LayoutProblem,
    Point,
)

_DIGITS = re.compile(r"(\d+)")
NaturalKey = tuple[tuple[tuple[int, int, str], ...], str]


def natural_key(name: str) -> NaturalKey:
    """A sort key in which numbers count as numbers; the name itself decides between equals.

    >>> sorted(["K10", "K2", "K"], key=natural_key)
    ['K', 'K2', 'K10']
    """
    parts = (
        (0, int(part), "") if part.isascii() and part.isdigit() else (1, 0, part)
        for part in _DIGITS.split(name)
        if part
    )
    return tuple(parts), name


def edge_key(name: str) -> tuple[NaturalKey, ...]:
    """A sort key for the names of edges: source, target, then the number among equals.

    >>> sorted(["K2 -> O", "K -> O (2)", "K -> O"], key=edge_key)
    ['K -> O', 'K -> O (2)', 'K2 -> O']
    """
    return tuple(natural_key(part) for part in name.split(" "))


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
) -> LayoutProblem:
    """The problem made of these parts, in canonical order.

    ``edges`` are (name, source, target, delay); ``spacing`` is that of neurons, then that of ranks. Equal parts in
    any order give an equal problem. The members of a group keep the order in which they are given (that of their
    numbers).
    """
    names = tuple(sorted(neurons, key=natural_key))
    index = {name: i for i, name in enumerate(names)}

    def members(of: Iterable[str]) -> tuple[int, ...]:
        return tuple(sorted({index[name] for name in of}))

    pinned = {index[name]: (float(x), float(y)) for name, (x, y) in (pins or {}).items()}
    return LayoutProblem(
        network=network,
        neurons=names,
        groups=tuple(
            LayoutGroup(name, tuple(index[member] for member in of))
            for name, of in sorted(groups, key=lambda group: natural_key(group[0]))
        ),
        edges=tuple(
            LayoutEdge(name, index[source], index[target], delay)
            for name, source, target, delay in sorted(edges, key=lambda edge: edge_key(edge[0]))
        ),
        pins=dict(sorted(pinned.items())),
        direction=direction,
        arrange=tuple(sorted((members(of), how) for of, how in arrange)),
        boxes=tuple(sorted(_merged((name, members(of)) for name, of in boxes), key=lambda box: natural_key(box[0]))),
        neuron_spacing=spacing[0],
        rank_spacing=spacing[1],
        entries=members(entries),
        exits=members(exits),
    )


def _merged(boxes: Iterable[tuple[str, tuple[int, ...]]]) -> list[tuple[str, tuple[int, ...]]]:
    """Boxes of one name are one box."""
    joined: dict[str, set[int]] = {}
    for name, members in boxes:
        joined.setdefault(name, set()).update(members)
    return [(name, tuple(sorted(members))) for name, members in joined.items()]


def problem_of(network: Network) -> LayoutProblem:
    """The layout problem of a compiled network: structure and layout settings, no activity, no weight."""
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
    )


def _entries(network: Network) -> list[int]:
    fed = [i for i, entry in enumerate(network.neurons.input.tolist()) if entry >= 0]
    return fed + [i for group in network.neurons.groups if group.role == "input" for i in group.indices]


def _exits(network: Network) -> list[int]:
    named = [int(i) for output in network.outputs for i in output.neurons.tolist()]
    return named + [i for group in network.neurons.groups if group.role == "output" for i in group.indices]
