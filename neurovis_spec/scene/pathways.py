"""Pathways: what runs from one group to another, added up.

In: a network, of which connections, with what weights and ends. Out: a Pathway for each two groups that any of these
connect: how many there are, which sum they have, those that excite and those that inhibit each by themselves, as a sum
of both would hide either.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray, frozen
from neurovis_spec.compiler.network import Network
from neurovis_spec.scene.ends import EndArray, ends_of


@dataclass(frozen=True, slots=True, eq=False)
class Strand:
    """The connections of a pathway that do the same: they excite (``end`` 1), inhibit (−1), or neither (0), as their
    lines end (``scene/ends.py``). ``members`` are their indices, ascending; ``count`` is how many of the network they
    stand for, ``total`` the sum of their weights."""

    end: int
    members: IntArray
    count: int
    total: float


@dataclass(frozen=True, slots=True, eq=False)
class Pathway:
    """What runs from the group ``source`` to the group ``target`` (indices of ``Neurons.groups``): ``strands``, those
    that excite first, then those that inhibit, then the rest; the ``rules`` by which any of it learns, as the author
    wrote them; how long its signals take, in steps, at least and at most."""

    source: int
    target: int
    strands: tuple[Strand, ...]
    rules: tuple[str, ...]
    delays: tuple[int, int]

    @property
    def members(self) -> IntArray:
        """The indices of its connections, ascending."""
        return np.sort(np.concatenate([one.members for one in self.strands]))

    @property
    def count(self) -> int:
        """How many connections it has."""
        return sum(one.count for one in self.strands)

    @property
    def total(self) -> float:
        """The sum of its weights."""
        return sum(one.total for one in self.strands)

    @property
    def size(self) -> float:
        """How strong it is: what excites and what inhibits, added up without regard to signs."""
        return sum(abs(one.total) for one in self.strands)

    def name(self, network: Network) -> str:
        """``E -> I``, by the names of its groups."""
        groups = network.neurons.groups
        return f"{groups[self.source].name} -> {groups[self.target].name}"


def group_of(network: Network) -> IntArray:
    """Of each neuron the number of its group (n,)."""
    groups = network.neurons.groups
    return np.repeat(np.arange(len(groups)), [group.count for group in groups])


def numbered(network: Network, groups: IntArray | None = None) -> IntArray:
    """Of each connection the number of its pathway (m,): that of the group that it comes from times how many groups
    there are, and that of the group that it goes to. ``groups`` (n,) has the group of each neuron, by default its
    own."""
    ends, group = network.connections, group_of(network) if groups is None else groups
    return group[ends.sources.whole()] * _count(group) + group[ends.targets.whole()]


def _count(groups: IntArray) -> int:
    return int(groups.max(initial=0)) + 1


def pathways(
    network: Network,
    some: BoolArray | None = None,
    weights: FloatArray | None = None,
    ends: EndArray | None = None,
    counts: IntArray | None = None,
    groups: IntArray | None = None,
) -> tuple[Pathway, ...]:
    """The pathways of a network, or of ``some`` of its connections (m,), by source and then by target.

    ``weights`` (m,) are by default those at first, ``ends`` (m,) how lines end with these, and ``counts`` (m,) how many
    connections each stands for (of a network in which something is collapsed), else one; ``groups`` (n,) the group of
    each neuron, by default its own: ``source`` and ``target`` are numbers of these.
    """
    connections = network.connections
    weights = connections.weights.whole() if weights is None else weights
    ends = ends_of(network, weights) if ends is None else ends
    counts = np.ones(len(connections), np.int64) if counts is None else counts
    chosen = np.arange(len(connections)) if some is None else np.flatnonzero(some)
    groups = group_of(network) if groups is None else groups
    number = numbered(network, groups)[chosen]
    order = np.lexsort((1 - ends[chosen] + 3 * (ends[chosen] == 0), number))  # 1, −1, 0
    chosen, number = chosen[order], number[order]
    return tuple(
        _made(network, divmod(int(number[own.start]), _count(groups)), chosen[own], weights, ends, counts)
        for own in _runs(number)
    )


def _runs(values: IntArray) -> Iterator[slice]:
    """The stretches of equal values, in sorted ones."""
    bounds = np.flatnonzero(np.diff(values)) + 1
    starts, stops = [0, *bounds.tolist()], [*bounds.tolist(), len(values)]
    return (slice(start, stop) for start, stop in zip(starts, stops, strict=True) if start < stop)


def _made(
    network: Network,
    between: tuple[int, int],
    members: IntArray,
    weights: FloatArray,
    ends: EndArray,
    counts: IntArray,
) -> Pathway:
    """The pathway between two groups that has these members, which stand strand by strand."""
    connections, strands = network.connections, list[Strand]()
    for own in _runs(ends[members].astype(np.int64)):
        some = members[own]
        with np.errstate(over="ignore", invalid="ignore"):
            total = float(weights[some].sum())
        strands.append(Strand(int(ends[some[0]]), frozen(some), int(counts[some].sum()), total))
    told = {connections.learns[entry] for entry in np.unique(connections.entry[members]).tolist()}
    delays = connections.delays[members]
    rules = tuple(sorted(rule for rule in told if rule))
    return Pathway(*between, tuple(strands), rules, (int(delays.min()), int(delays.max())))
