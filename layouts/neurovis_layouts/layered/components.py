"""Components: what is not connected is laid out on its own, and stands side by side.

In: a frame's units. Out: the ComponentLayout of all of them: each component laid out (``component_layout``), those that
have room in a gap of a larger one put there, the others packed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import networkx as nx
import numpy as np

from neurovis_layouts.formations import columns, grid
from neurovis_layouts.label_room import excess
from neurovis_layouts.layered.bands import UNCUT
from neurovis_layouts.layered.component_layout import ComponentLayout, RankProblem
from neurovis_layouts.layered.units import Unit
from neurovis_layouts.packing import gap_in, packed
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import angular, pieces_of, points_on, snap
from neurovis_spec.layout.model import LayoutProblem, Route

#: Between components that nothing connects.
_APART = 1.5
#: Among more components than this nobody looks for gaps.
_MOST_PARTS = 50
#: How far apart points on connections are that gaps keep off, about.
_STEP = 0.5


def planned(frame: RankProblem, laid_out: Callable[[RankProblem], ComponentLayout]) -> ComponentLayout:
    """All components of a frame ``laid_out`` and packed; units without connections beside the last rank of the largest
    one, which alone stands in bands where these are wanted."""
    problem, units = frame.problem, frame.units
    if frame.pair:
        return laid_out(_component(frame, range(len(units))))
    connected, alone = components_of(problem, units, frame.bonds)
    largest = max(connected, key=lambda part: sum(len(units[u].members) for u in part), default=None)
    hosts = _hosts(problem, units, connected, alone)
    few = sum(len(units[u].members) for u in alone) <= 6
    parts: list[ComponentLayout] = []
    for part in connected:
        guests = [units[u] for u in alone if few and hosts.get(u, largest) == part]
        wanted = frame.wanted if part == largest else UNCUT
        parts.append(laid_out(replace(_component(frame, part), wanted=wanted, guests=guests)))
    if alone and not (few and connected):
        parts.append(_unconnected(problem, [units[u] for u in alone]))
    plan = ComponentLayout()
    wholes = _in_gaps(problem, parts)
    extents = [whole.extent() for whole in wholes]
    corners = packed([(high[0] - low[0], high[1] - low[1]) for low, high in extents], _APART)
    for whole, (x, y), (low, _) in zip(wholes, corners, extents, strict=True):
        plan.add(whole, (x - low[0], y - low[1]))
    return plan


def _component(frame: RankProblem, part: Sequence[int]) -> RankProblem:
    """The problem of some of the units of a frame."""
    own = {m for u in part for m in frame.units[u].members}
    edges = [i for i in frame.edges if frame.problem.edges[i].source in own]
    return replace(frame, units=[frame.units[u] for u in part], bonds=[frame.bonds[u] for u in part], edges=edges)


def components_of(
    problem: LayoutProblem, units: Sequence[Unit], bonds: Sequence[int]
) -> tuple[list[list[int]], list[int]]:
    """Components of several connected units or of one block, as unit indices; and units without connections.

    Components that a box joins are one, and those that share a rank: ``bonds`` are each unit's first mate in it.
    """
    owner = {member: i for i, unit in enumerate(units) for member in unit.members}
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(len(units)))
    graph.add_edges_from((owner[edge.source], owner[edge.target]) for edge in problem.edges)
    for _, members in problem.boxes:
        mates = [owner[m] for m in members if graph.degree(owner[m]) or units[owner[m]].places is not None]
        graph.add_edges_from(pairwise(mates))
    graph.add_edges_from(enumerate(bonds))
    connected: list[list[int]] = []
    alone: list[int] = []
    for component in sorted(sorted(part) for part in nx.connected_components(graph)):
        if len(component) == 1 and units[component[0]].places is None:
            alone += component
        else:
            connected.append(component)
    return connected, alone


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


def _unconnected(problem: LayoutProblem, units: Sequence[Unit]) -> ComponentLayout:
    """Neurons that nothing connects: in a row, or a grid where they are many."""
    members = sorted((m for unit in units for m in unit.members), key=problem.reading().__getitem__)
    width = len(members) if len(members) <= 12 else columns(len(members))
    wide, high = (max(more) for more in zip(*(excess(problem, m) for m in members), strict=True))
    points = grid(len(members), width, max(problem.neuron_spacing, 0.65))
    points = [(x * (1 + wide), y * (1 + 2 * high)) for x, y in points]
    return ComponentLayout({m: (snap(x), snap(y)) for m, (x, y) in zip(members, points, strict=True)})


def _in_gaps(problem: LayoutProblem, parts: Sequence[ComponentLayout]) -> list[ComponentLayout]:
    """The parts, each that has room in a gap of a larger one as part of that."""
    if not 1 < len(parts) <= _MOST_PARTS:
        return list(parts)
    drawn: dict[int, FloatArray] = {}
    for part in sorted(range(len(parts)), key=lambda part: (-len(parts[part].places), part)):
        low, high = parts[part].extent()
        for host, pieces in drawn.items():
            corner = gap_in(pieces, (high[0] - low[0], high[1] - low[1]), _APART)
            if corner is not None:
                shift = corner[0] - low[0], corner[1] - low[1]
                parts[host].add(parts[part], shift)
                drawn[host] = np.concatenate([pieces, _pieces(problem, parts[part]) + np.tile(shift, 2)])
                break
        else:
            drawn[part] = _pieces(problem, parts[part])
    return [parts[part] for part in sorted(drawn)]


def _pieces(problem: LayoutProblem, plan: ComponentLayout) -> FloatArray:
    """(n, 4) what is drawn: neurons, frames and labels, and about where connections will run; of what stands in bands
    all at once."""
    if plan.cut:
        (x0, y0), (x1, y1) = plan.extent()
        return np.array([(x0, y0, x1, y1)])
    lines: list[Route] = []
    for i, edge in enumerate(problem.edges):
        if edge.source in plan.places and edge.target in plan.places:
            ends = sorted((plan.places[edge.source], plan.places[edge.target]), key=lambda place: place[1])
            lines.append(angular([ends[0], *((way.x, way.y) for way in plan.ways.get(i, ())), ends[1]]))
    places = np.array(list(plan.places.values()))
    points = np.concatenate([places, points_on(*pieces_of(lines), _STEP)[0]])
    return np.concatenate([np.tile(points, 2), np.array(plan.rects).reshape(-1, 4)])
