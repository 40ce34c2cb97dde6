"""Same rank: units that have to share a rank, and how far each is shifted along the direction within it (its lift).

In: units, the lists of neurons that are to be on one line, mirror images, instances declared together. Out: the units
with their lifts, and for each a number (its bond) that is the same for all units of one rank.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import permutations

import networkx as nx

from neurovis_layouts.layered.units import Unit
from neurovis_spec.layout.model import LayoutProblem, LayoutRefusalError

#: Stairs rise by this share of the height of a frame from one to the next at most.
_STEEPEST = 0.6
#: Nobody looks along stairs of more steps.
_MOST_IN_STAIRS = 64


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
    for a, b in sorted(pair.items()):
        lines.join(owner[a], owner[b], 0.0)
    for first, member in ((line[0], member) for line in problem.align for member in line[1:]):
        if not lines.join(owner[first], owner[member], depth[first] - depth[member]):
            one, other = problem.neurons[first], problem.neurons[member]
            words = f"'{one}' and '{other}' cannot stand on one line: what they belong to holds them apart"
            raise LayoutRefusalError("align-conflict", words, about=(one, other))
    flow = _flow(problem, units, owner) if families else nx.DiGraph()
    for family in families:
        mates = [owner[m] for m in family]
        stairs = _stairs(problem, units, owner, depth, pair, mates, flow)
        for mate, step in zip(mates, stairs, strict=False):
            lines.join(mates[0], mate, step - stairs[0])
    found = [lines.find(u) for u in range(len(units))]
    lifted = [replace(unit, lift=shift) if shift else unit for unit, (_, shift) in zip(units, found, strict=True)]
    return lifted, [root for root, _ in found]


def _flow(problem: LayoutProblem, units: Sequence[Unit], owner: Mapping[int, int]) -> nx.DiGraph[int]:
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(range(len(units)))
    graph.add_edges_from((owner[a], owner[b]) for e in problem.edges for a, b in e.ways if owner[a] != owner[b])
    return graph


def _stairs(
    problem: LayoutProblem,
    units: Sequence[Unit],
    owner: Mapping[int, int],
    depth: Mapping[int, float],
    pair: Mapping[int, int],
    mates: Sequence[int],
    flow: nx.DiGraph[int],
) -> list[float]:
    """How far behind the first of its rank each of a family stands: side by side where none drives another, in stairs
    where one drives the next, so that what runs between them runs along; none where that would make them too steep."""
    if len(mates) > _MOST_IN_STAIRS:
        return [] if any(flow.has_edge(a, b) for a in mates for b in mates) else [0.0] * len(mates)
    after = {mate: nx.descendants(flow, mate) for mate in mates}
    ahead = {(a, b) for a, b in permutations(mates, 2) if b in after[a] and a not in after[b]}
    if not ahead:
        return [0.0] * len(mates)
    steps: dict[tuple[int, int], float] = {}
    for a, b in _ends(problem, owner, pair, mates):
        step = owner.get(a, -1), owner.get(b, -1)
        if step in ahead:
            steps[step] = max(steps.get(step, 0.0), depth[a] - depth[b] + problem.rank_spacing / 2)
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(mates)
    graph.add_edges_from(steps)
    found = dict.fromkeys(mates, 0.0)
    for mate in nx.lexicographical_topological_sort(graph):
        found[mate] = max([0.0, *(found[before] + steps[before, mate] for before in graph.predecessors(mate))])
    high = max((units[mate].reach or (0.0, 0.0))[1] for mate in mates)
    through_others = any(not nx.has_path(graph, a, b) for a, b in ahead)
    if through_others or max(found.values()) > _STEEPEST * 2 * high * (len(mates) - 1):
        return []
    return [found[mate] for mate in mates]


def _ends(
    problem: LayoutProblem, owner: Mapping[int, int], pair: Mapping[int, int], mates: Sequence[int]
) -> Iterator[tuple[int, int]]:
    """The ends of each connection, or, where these are not both of a family, of its mirror image."""
    for edge in problem.edges:
        if pair and not {owner[edge.source], owner[edge.target]} <= set(mates):
            yield pair.get(edge.source, -1), pair.get(edge.target, -1)
        else:
            yield edge.source, edge.target


def driven(
    problem: LayoutProblem, units: Sequence[Unit], pair: Mapping[int, int], families: Collection[Sequence[int]]
) -> list[bool]:
    """For families of units, each known by a neuron, whether one of them drives another that is not its mirror image,
    and, where that is through others, is not driven by it."""
    if not families:
        return []
    owner = {m: u for u, unit in enumerate(units) for m in unit.members}
    image = {u: owner[pair[m]] for m, u in owner.items() if m in pair}
    flow = _flow(problem, units, owner)
    loops = nx.condensation(flow)
    loop_of = loops.graph["mapping"]
    order = list(nx.topological_sort(loops))
    found: list[bool] = []
    for family in families:
        mates = {owner[m] for m in family}
        own = {loop_of[mate] for mate in mates}
        behind: set[int] = set()
        for loop in order:
            if loop in own or loop in behind:
                behind.update(loops.successors(loop))
        direct = any(b in mates and b != image.get(a) for a in mates for b in flow.successors(a))
        found.append(direct or not own.isdisjoint(behind))
    return found
