"""Same rank: units that have to share a rank, and how far each is shifted along the direction within it (its lift).

In: units, the lists of neurons that are to be on one line, mirror images, instances that are to stand side by side.
Out: the units with their lifts, and for each a number (its bond) that is the same for all units of one rank.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
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
    problem: LayoutProblem, units: Sequence[Unit], pair: Mapping[int, int], rows: Sequence[Sequence[int]]
) -> tuple[list[Unit], list[int]]:
    """The units with their lifts, and the number of the rank's bond of each.

    ``rows`` are neurons by which units are known that are to share a rank. Raises LayoutRefusalError for lines that
    cannot be kept.
    """
    owner = {m: u for u, unit in enumerate(units) for m in unit.members}
    depth = {m: 0.0 for unit in units for m in unit.members}
    for unit in units:
        for member, (_, along) in zip(unit.members, unit.places or (), strict=False):
            depth[member] = along
    lines = _Lines(len(units))
    for a, b in sorted(pair.items()):
        lines.join(owner[a], owner[b], 0.0)
    for line in problem.align:
        for member in line[1:]:
            if not lines.join(owner[line[0]], owner[member], depth[line[0]] - depth[member]):
                names = problem.neurons
                raise LayoutRefusalError(
                    "align-conflict",
                    f"'{names[line[0]]}' and '{names[member]}' cannot stand on one line: what they belong to holds "
                    "them apart",
                    about=(names[line[0]], names[member]),
                )
    for row in rows:
        for member in row[1:]:
            lines.join(owner[row[0]], owner[member], 0.0)
    found = [lines.find(u) for u in range(len(units))]
    lifted = [replace(unit, lift=shift) if shift else unit for unit, (_, shift) in zip(units, found, strict=True)]
    return lifted, [root for root, _ in found]


def driven(problem: LayoutProblem, units: Sequence[Unit], families: Collection[Sequence[int]]) -> list[bool]:
    """For families of units, each known by a neuron, whether one of them drives another, by whatever way, that does not
    drive it back."""
    if not families:
        return []
    owner = {m: u for u, unit in enumerate(units) for m in unit.members}
    flow: nx.DiGraph[int] = nx.DiGraph()
    flow.add_nodes_from(range(len(units)))
    flow.add_edges_from((owner[edge.source], owner[edge.target]) for edge in problem.edges)
    loops = nx.condensation(flow)
    loop_of = loops.graph["mapping"]
    order = list(nx.topological_sort(loops))
    found: list[bool] = []
    for family in families:
        own = {loop_of[owner[m]] for m in family}
        behind: set[int] = set()
        for loop in order:
            if loop in own or loop in behind:
                behind.update(loops.successors(loop))
        found.append(not own.isdisjoint(behind))
    return found
