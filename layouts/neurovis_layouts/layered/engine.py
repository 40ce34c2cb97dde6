"""The layered engine: from a problem to a layout, stage by stage.

In: a LayoutProblem. Out: a Layout. After Sugiyama, Tagawa and Toda (1981): units and blocks, components, ranks,
order, places, pins, routes; every stage is deterministic and computes in plain IEEE arithmetic, so the result is the
same everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from neurovis_layouts.formations import columns, grid
from neurovis_layouts.frame import from_picture, to_picture
from neurovis_layouts.layered.components import components_of, packed
from neurovis_layouts.layered.levels import Levels, levels_of
from neurovis_layouts.layered.order import ordered
from neurovis_layouts.layered.place import placed
from neurovis_layouts.layered.ranks import INSTANT, ranks_of
from neurovis_layouts.layered.units import Unit, units_of
from neurovis_layouts.pins import fit
from neurovis_layouts.routing import Waypoint, route_all
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import Capabilities, Layout, LayoutProblem, Point


@dataclass(slots=True)
class _Plan:
    """Places in the engine's frame: neurons by index, waypoints by edge."""

    places: dict[int, Point] = field(default_factory=dict)
    ways: dict[int, list[Waypoint]] = field(default_factory=dict)

    def extent(self) -> tuple[Point, Point]:
        xs = [x for x, _ in self.places.values()] + [way.x for ways in self.ways.values() for way in ways]
        ys = [y for _, y in self.places.values()]
        return (min(xs), min(ys)), (max(xs), max(ys))

    def add(self, other: _Plan, shift: Point) -> None:
        dx, dy = shift
        self.places.update({i: (x + dx, y + dy) for i, (x, y) in other.places.items()})
        for i, ways in other.ways.items():
            self.ways[i] = [Waypoint(way.x + dx, way.y + dy, way.half) for way in ways]


class LayeredEngine:
    """Neurons in ranks along the direction."""

    name = "layered"
    capabilities = Capabilities(pins=True, arrange=True, boxes=True, direction=True, neurons=100_000, edges=1_000_000)

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place every neuron and route every connection. Raises LayoutRefusalError where a neuron is arranged twice."""
        units = units_of(problem)
        plan = _plan(problem, units)
        pins = {i: from_picture(point, problem.direction) for i, point in problem.pins.items()}
        centres, shift, moved = fit([plan.places[i] for i in range(len(problem.neurons))], pins)
        ways: dict[int, list[Waypoint]] = {}
        for i, line in sorted(plan.ways.items()):
            edge = problem.edges[i]
            if edge.source not in moved and edge.target not in moved:
                passing = [Waypoint(way.x + shift[0], way.y + shift[1], way.half) for way in line]
                ways[i] = passing if plan.places[edge.source][1] < plan.places[edge.target][1] else passing[::-1]
        block = {m: k for k, unit in enumerate(units) if unit.places is not None for m in unit.members}
        within = frozenset(
            i
            for i, edge in enumerate(problem.edges)
            if edge.source in block and block[edge.source] == block.get(edge.target)
        )
        routes = route_all(problem.edges, centres, ways, within)
        return Layout(
            problem.network,
            self.name,
            {
                name: to_picture(centre, problem.direction)
                for name, centre in zip(problem.neurons, centres, strict=True)
            },
            {
                edge.name: tuple(to_picture(point, problem.direction) for point in route)
                for edge, route in zip(problem.edges, routes, strict=True)
            },
        )


def _plan(problem: LayoutProblem, units: Sequence[Unit]) -> _Plan:
    """All components laid out and packed; units without connections beside the last rank of the largest component."""
    connected, alone = components_of(problem, units)
    largest = max(connected, key=lambda part: sum(len(units[u].members) for u in part), default=None)
    parts: list[_Plan] = []
    hosts = _hosts(problem, units, connected, alone)
    few = sum(len(units[u].members) for u in alone) <= 6
    owner = {m: u for u, unit in enumerate(units) for m in unit.members}
    edges: dict[int, list[int]] = {}
    part_of = {u: k for k, part in enumerate(connected) for u in part}
    for i, edge in enumerate(problem.edges):
        if owner[edge.source] in part_of:
            edges.setdefault(part_of[owner[edge.source]], []).append(i)
    for k, part in enumerate(connected):
        guests = [u for u in alone if few and hosts.get(u, largest) == part]
        parts.append(_component(problem, [units[u] for u in part], [units[u] for u in guests], edges.get(k, [])))
    if alone and not (few and connected):
        parts.append(_unconnected(problem, [units[u] for u in alone]))
    plan = _Plan()
    for part_plan, shift in zip(parts, packed([part.extent() for part in parts]), strict=True):
        plan.add(part_plan, shift)
    return plan


def _hosts(
    problem: LayoutProblem, units: Sequence[Unit], connected: Sequence[list[int]], alone: Sequence[int]
) -> dict[int, list[int]]:
    """For units without connections that share a box with connected ones: the component to stand beside."""
    part_of = {m: part for part in connected for u in part for m in units[u].members}
    box_of = {m: box for _, box in problem.boxes for m in box}
    hosts: dict[int, list[int]] = {}
    for u in alone:
        mates = [m for m in box_of.get(units[u].members[0], ()) if m in part_of]
        if mates:
            hosts[u] = part_of[mates[0]]
    return hosts


def _component(problem: LayoutProblem, units: Sequence[Unit], guests: Sequence[Unit], edges: Sequence[int]) -> _Plan:
    everyone = [*units, *guests]
    rank = _ranks(problem, units, edges)
    rank += [max(rank)] * len(guests)
    levels = levels_of(problem, everyone, rank, edges)
    order = ordered(levels)
    places = placed(levels, order, problem.neuron_spacing, problem.rank_spacing)
    _draw_in(levels, order, places, {m for unit in guests for m in unit.members}, problem.neuron_spacing)
    plan = _Plan()
    for node, (x, y) in zip(levels.nodes, places, strict=True):
        for member, dx, dy in node.members:
            plan.places[member] = (x + dx, y + dy)
    half = [max((levels.nodes[n].reach[1] for n in members), default=0.0) for members in order]
    for i, passages in levels.passages.items():
        plan.ways[i] = [Waypoint(*places[n], half[levels.nodes[n].rank]) for n in passages]
    return plan


def _ranks(problem: LayoutProblem, units: Sequence[Unit], edges: Sequence[int]) -> list[int]:
    owner = {m: u for u, unit in enumerate(units) for m in unit.members}
    arcs: dict[tuple[int, int], float] = {}
    for i in edges:
        edge = problem.edges[i]
        ends = owner[edge.source], owner[edge.target]
        if ends[0] != ends[1]:
            arcs[ends] = arcs.get(ends, 0.0) + (INSTANT if edge.delay == 0 else 1.0)
    first = {owner[m] for m in problem.entries if m in owner}
    last = {owner[m] for m in problem.exits if m in owner}
    return ranks_of(len(units), arcs, first, last)


def _draw_in(
    levels: Levels, order: Sequence[Sequence[int]], places: list[Point], guests: set[int], spacing: float
) -> None:
    """Unconnected neurons at the end of a rank stand close to their neighbour, two units off, not where the rank left
    them."""
    for rank in order:
        for before, node in pairwise(rank):
            own, other = levels.nodes[node], levels.nodes[before]
            if own.members and own.members[0][0] in guests and node == rank[-1] and other.members:
                beside = 2.0 if other.members[0][0] not in guests else 1.0
                places[node] = (
                    snap(places[before][0] + other.reach[0] + own.reach[0] + beside * spacing),
                    places[node][1],
                )


def _unconnected(problem: LayoutProblem, units: Sequence[Unit]) -> _Plan:
    """Neurons that nothing connects: in a row, or a grid where they are many."""
    members = sorted(m for unit in units for m in unit.members)
    width = len(members) if len(members) <= 12 else columns(len(members))
    points = grid(len(members), width, max(problem.neuron_spacing, 0.65))
    return _Plan({m: (snap(x), snap(y)) for m, (x, y) in zip(members, points, strict=True)})
