"""Wiring: a network as arrays, for engines that move many neurons at once.

In: a problem. Out: links without direction (parallel and reciprocal edges are one link of their number, self-loops are
none), arcs (what tells above from below: from loop to loop), hubs (a weightless point for every module and
box, linked with what belongs to it, which keeps that together) and the parts that hang together. Of mirror images one
is wired as the other is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.model import LayoutProblem

#: How heavy a hub is, and its links.
_HUB, _SPOKE = 0.2, 4.0
#: The most arcs from all of a loop to all of another.
_MOST_ARCS = 50_000


@dataclass(frozen=True, slots=True)
class Wiring:
    """``count`` points, of which the first ``neurons`` are neurons and the rest hubs; ``mass`` (count,), 1 in the mean;
    links from ``a`` to ``b`` of weight ``weight`` (k,), ``a < b``; arcs from ``above`` to ``below`` of weight ``pull``
    (m,); ``image`` (count,) says whose mirror image each point is, itself where it has none."""

    neurons: int
    mass: FloatArray
    a: IntArray
    b: IntArray
    weight: FloatArray
    above: IntArray
    below: IntArray
    pull: FloatArray
    image: IntArray

    @property
    def count(self) -> int:
        """How many points there are, hubs included."""
        return len(self.mass)


def wiring_of(problem: LayoutProblem, image: IntArray) -> Wiring:
    """The wiring of a problem whose neurons have these images (n,)."""
    neurons = len(problem.neurons)
    ends = np.array([(edge.source, edge.target) for edge in problem.edges], dtype=np.int64).reshape(-1, 2)
    arcs, pull = _arcs(_loops(problem), ends)
    links, spokes = ends, _spokes(problem)
    paired = np.flatnonzero(image != np.arange(neurons))
    if len(paired):
        links = np.concatenate([ends, image[ends]])
        arcs, pull = np.concatenate([arcs, image[arcs]]), np.concatenate([pull, pull]) / 2
        # images are about one axis: parts of them that nothing connects are one all the same
        part = parts_of(neurons, *links.T)[paired]
        one, *others = paired[np.unique(part, return_index=True)[1]].tolist()
        ties = np.array([(one, other) for other in others], dtype=np.int64).reshape(-1, 2)
        spokes = np.concatenate([spokes, ties, image[ties]])
    count = max(neurons, int(spokes.max(initial=-1)) + 1)
    weight = np.concatenate([np.full(len(links), len(ends) / max(len(links), 1)), np.full(len(spokes), _SPOKE)])
    one, other = np.concatenate([links, spokes]).T
    a, b, weight = linked(count, one, other, weight)
    # what has many links needs room around it, what has one is to stay near (Jacomy et al. 2014: ForceAtlas2)
    mass = np.ones(count) + np.bincount(a, weight, count) + np.bincount(b, weight, count)
    mass[:neurons] /= mass[:neurons].mean() if neurons else 1.0
    mass[neurons:] = _HUB
    above, below, pull = summed(count, arcs[:, 0], arcs[:, 1], pull)
    return Wiring(neurons, mass, a, b, weight, above, below, pull, np.concatenate([image, np.arange(neurons, count)]))


def _arcs(loops: IntArray, ends: IntArray) -> tuple[IntArray, FloatArray]:
    """Arcs (k, 2) from all of a loop to all of the next, as what drives a loop stands above the whole of it, and their
    weights. As they are where that would be too many."""
    between = ends[loops[ends[:, 0]] != loops[ends[:, 1]]]
    pairs, times = np.unique(loops[between], axis=0, return_counts=True)
    sizes = np.bincount(loops)
    many = sizes[pairs].prod(axis=1)
    if many.sum() > _MOST_ARCS:
        return between, np.ones(len(between))
    of = np.split(np.argsort(loops, kind="stable"), np.cumsum(sizes)[:-1])
    arcs = [np.stack([np.repeat(of[a], len(of[b])), np.tile(of[b], len(of[a]))], axis=1) for a, b in pairs.tolist()]
    return np.concatenate([between[:0], *arcs]), np.repeat(times / many, many)


def linked(count: int, a: IntArray, b: IntArray, weight: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Links without direction: equal ones summed up, the lower end first, none from a point to itself."""
    return summed(count, np.minimum(a, b), np.maximum(a, b), weight)


def summed(count: int, a: IntArray, b: IntArray, weight: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Arcs in order, equal ones summed up, none from a point to itself."""
    apart = a != b
    keys, place = np.unique(a[apart] * np.int64(count) + b[apart], return_inverse=True)
    total: FloatArray = np.bincount(place, weight[apart], len(keys)).astype(np.float64)
    one, other = np.divmod(keys, np.int64(max(count, 1)))
    return one, other, total


def parts_of(count: int, a: IntArray, b: IntArray) -> IntArray:
    """(count,) the number of the part that each point belongs to: points linked in any way are of one part. Parts
    are numbered by their first point."""
    lowest = np.arange(count, dtype=np.int64)
    while True:
        low = np.minimum(lowest[a], lowest[b])
        before = lowest.copy()
        np.minimum.at(lowest, lowest[a], low)
        np.minimum.at(lowest, lowest[b], low)
        lowest = lowest[lowest]
        if np.array_equal(before, lowest):
            return np.unique(lowest, return_inverse=True)[1].astype(np.int64)


def _spokes(problem: LayoutProblem) -> IntArray:
    """(k, 2): who is linked with which hub: an instance's with what is in no instance within it, and with theirs."""
    hub = len(problem.neurons)
    spokes: list[tuple[int, int]] = []
    inner: dict[int, int] = {}
    for number, module in enumerate(problem.modules):
        for member in module.members:
            inner[member] = hub + number
        if module.parent >= 0:
            spokes.append((hub + module.parent, hub + number))
    spokes += inner.items()
    hub += len(problem.modules)
    for _, members in problem.boxes:
        spokes += [(member, hub) for member in members]
        hub += 1
    return np.array(spokes, dtype=np.int64).reshape(-1, 2)


def _loops(problem: LayoutProblem) -> IntArray:
    """(neurons,) which loop (strongly connected component) each neuron is part of."""
    import networkx as nx  # only here

    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(range(len(problem.neurons)))
    graph.add_edges_from(way for edge in problem.edges for way in edge.ways)
    loops = np.zeros(len(problem.neurons), dtype=np.int64)
    for number, part in enumerate(nx.strongly_connected_components(graph)):
        loops[list(part)] = number
    return loops
