"""Bonds: units that share a rank, and how far each stands behind its line.

In: units, the lists of neurons that are to be on one line, mirror images, instances declared together. Out: units with
their lifts, and for each the number of those that it shares a rank with.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import networkx as nx

from neurovis_layouts.layered.units import Unit
from neurovis_spec.layout.model import LayoutProblem, LayoutRefusalError


class _Lines:
    """Units joined with a fixed difference along the direction between them."""

    def __init__(self, count: int) -> None:
        self._parent = list(range(count))
        self._shift = [0.0] * count  # of a unit's middle against that of its parent

    def find(self, unit: int) -> tuple[int, float]:
        shift = 0.0
        while self._parent[unit] != unit:
            shift += self._shift[unit]
            unit = self._parent[unit]
        return unit, shift

    def join(self, one: int, other: int, apart: float) -> bool:
        """``other`` stands ``apart`` behind ``one``; False where they are joined otherwise already."""
        (a, shift_a), (b, shift_b) = self.find(one), self.find(other)
        if a == b:
            return shift_b - shift_a == apart
        if a < b:
            self._parent[b], self._shift[b] = a, apart + shift_a - shift_b
        else:
            self._parent[a], self._shift[a] = b, shift_b - shift_a - apart
        return True


def bonded(
    problem: LayoutProblem, units: Sequence[Unit], pair: Mapping[int, int], families: Sequence[Sequence[int]]
) -> tuple[list[Unit], list[int]]:
    """The units with their lifts, and the number of the rank's bond of each.

    ``families`` are neurons by which the units of a family are known. Raises LayoutRefusalError for lines that cannot
    be kept.
    """
    owner = {m: u for u, unit in enumerate(units) for m in unit.members}
    depth = {m: 0.0 for unit in units for m in unit.members}
    for unit in units:
        for member, (_, along) in zip(unit.members, unit.places or (), strict=False):
            depth[member] = along
    lines = _Lines(len(units))
    for line in problem.align:
        for member in line[1:]:
            if not lines.join(owner[line[0]], owner[member], depth[line[0]] - depth[member]):
                names = problem.neurons
                raise LayoutRefusalError(
                    "align-conflict",
                    f"'{names[line[0]]}' and '{names[member]}' cannot stand on one line: what they belong to holds "
                    "them apart",
                )
    for a, b in sorted(pair.items()):
        lines.join(owner[a], owner[b], 0.0)
    flow = _flow(problem, units, owner)
    for family in families:
        mates = [owner[m] for m in family]
        if not _has_flow(flow, mates):
            for mate in mates[1:]:
                lines.join(mates[0], mate, 0.0)
    found = [lines.find(u) for u in range(len(units))]
    lifted = [replace(unit, lift=shift) if shift else unit for unit, (_, shift) in zip(units, found, strict=True)]
    return lifted, [root for root, _ in found]


def _flow(problem: LayoutProblem, units: Sequence[Unit], owner: Mapping[int, int]) -> nx.DiGraph[int]:
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(range(len(units)))
    graph.add_edges_from(
        (owner[e.source], owner[e.target]) for e in problem.edges if owner[e.source] != owner[e.target]
    )
    return graph


def _has_flow(graph: nx.DiGraph[int], mates: Sequence[int]) -> bool:
    """Whether one drives another and is not driven by it, be it through others."""
    after = {mate: nx.descendants(graph, mate) for mate in mates}
    return any(b in after[a] and a not in after[b] for a in mates for b in mates if a != b)
