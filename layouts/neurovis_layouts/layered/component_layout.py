"""Component layout: the units of one frame in ranks; components that are not connected stand side by side.

In: a problem, its units, which of them share a rank. Out: a ComponentLayout: the places of neurons, the waypoints of
edges, and which frames inside are reflected. It calls the stages ranks, levels, order and places one after the other.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise

import networkx as nx
import numpy as np

from neurovis_layouts.formations import columns, grid
from neurovis_layouts.frame import from_picture
from neurovis_layouts.label_room import at_ends, covered, excess, sides_of
from neurovis_layouts.layered.bands import UNCUT, Bands, Wanted, banded
from neurovis_layouts.layered.box_columns import straightened, tied, with_spines
from neurovis_layouts.layered.components import components_of
from neurovis_layouts.layered.flips import Reading, reflected
from neurovis_layouts.layered.fold_ports import with_exits
from neurovis_layouts.layered.folds import Folds, folded, interleaved, stacked
from neurovis_layouts.layered.levels import Levels, levels_of
from neurovis_layouts.layered.mirror import mirrored
from neurovis_layouts.layered.order import Order, crossings, ordered
from neurovis_layouts.layered.parts import symmetric
from neurovis_layouts.layered.place import placed, reaches, staggered
from neurovis_layouts.layered.ranks import INSTANT, levelled, ranks_of
from neurovis_layouts.layered.units import Unit
from neurovis_layouts.packing import gap_in, packed
from neurovis_layouts.routing import Waypoint
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import Rect, angular, pieces_of, points_on, shifted, snap
from neurovis_spec.layout.model import LayoutProblem, Point, Route, Side

#: Between components that nothing connects.
_APART = 1.5
#: Among more components than this nobody looks for gaps.
_MOST_PARTS = 50
#: How far apart points on connections are that gaps keep off, about.
_STEP = 0.5
#: How much it counts where a loop is cut that a unit is driven from outside of it, or drives something there: whichever
#: leaves fewer crossings.
_ENTERED = (0.25, 0.0, -0.25)
#: How many segments are crossed in a rank on the way into a frame.
_PASSED = 0.125
#: That a row stands behind another outweighs any connection.
_ROW = 1000 * INSTANT


@dataclass(slots=True)
class ComponentLayout:
    """Places in the engine's frame: neurons by index, waypoints by edge; the first neurons of frames that are drawn as
    their mirror images."""

    places: dict[int, Point] = field(default_factory=dict)
    ways: dict[int, list[Waypoint]] = field(default_factory=dict)
    #: edges whose waypoints are all that they need
    firm: set[int] = field(default_factory=set)
    reflected: set[int] = field(default_factory=set)
    #: on which sides labels stand that do not stand on the usual one
    sides: dict[int, Side] = field(default_factory=dict)
    #: at how many places the ranks of the largest component may be cut
    cuts: int = 0
    #: the corners of edges from band to band, which have no waypoints
    cut: dict[int, Sequence[Point]] = field(default_factory=dict)
    #: the frames, and what labels cover
    rects: list[Rect] = field(default_factory=list)

    def extent(self) -> tuple[Point, Point]:
        """The low and the high corner of all."""
        points = [*self.places.values(), *(point for line in self.cut.values() for point in line)]
        points += [(x, y) for x0, y0, x1, y1 in self.rects for x, y in ((x0, y0), (x1, y1))]
        xs = [x for x, _ in points] + [way.x for ways in self.ways.values() for way in ways]
        ys = [y for _, y in points]
        return (min(xs), min(ys)), (max(xs), max(ys))

    def add(self, other: ComponentLayout, shift: Point) -> None:
        """Put another beside it."""
        dx, dy = shift
        self.places.update({i: (x + dx, y + dy) for i, (x, y) in other.places.items()})
        self.rects += [shifted(rect, shift) for rect in other.rects]
        self.reflected |= other.reflected
        self.sides.update(other.sides)
        self.firm |= other.firm
        self.cuts = max(self.cuts, other.cuts)
        self.cut.update({i: [(x + dx, y + dy) for x, y in line] for i, line in other.cut.items()})
        for i, ways in other.ways.items():
            self.ways[i] = [Waypoint(way.x + dx, way.y + dy, way.half) for way in ways]


def planned(
    problem: LayoutProblem,
    units: Sequence[Unit],
    bonds: Sequence[int],
    pair: Mapping[int, int],
    columns: AbstractSet[int],
    wanted: Wanted,
    behind: Sequence[tuple[int, int]],
    draft: bool,
) -> ComponentLayout:
    """All components laid out and packed; units without connections beside the last rank of the largest component.

    ``bonds`` are numbers that units of one rank share. With ``pair`` (mirror images, both ways) all is one component,
    its axis at 0. ``columns`` are boxes to be drawn as such where that can be. The largest component stands in bands as
    ``wanted`` where it can be cut, which no axis can. ``behind`` are pairs of
    neurons of which the second stands in a later rank. Of a ``draft`` only the size counts.
    """
    connected, alone = ([list(range(len(units)))], []) if pair else components_of(problem, units, bonds)
    largest = max(connected, key=lambda part: sum(len(units[u].members) for u in part), default=None)
    parts: list[ComponentLayout] = []
    hosts = _hosts(problem, units, connected, alone)
    few = sum(len(units[u].members) for u in alone) <= 6
    owner = {m: u for u, unit in enumerate(units) for m in unit.members}
    edges: dict[int, list[int]] = {}
    part_of = {u: k for k, part in enumerate(connected) for u in part}
    for i, edge in enumerate(problem.edges):
        if owner[edge.source] in part_of:
            edges.setdefault(part_of[owner[edge.source]], []).append(i)
    for k, part in enumerate(connected):
        guests = [units[u] for u in alone if few and hosts.get(u, largest) == part]
        own, tied = [units[u] for u in part], [bonds[u] for u in part]
        parts.append(
            _component(
                problem, own, tied, guests, edges.get(k, []), pair, columns, wanted if part == largest else UNCUT,
                behind, draft,
            )
        )  # fmt: skip
    if pair:
        return parts[0]
    if alone and not (few and connected):
        parts.append(_unconnected(problem, [units[u] for u in alone]))
    plan = ComponentLayout()
    wholes = _in_gaps(problem, parts)
    extents = [whole.extent() for whole in wholes]
    corners = packed([(high[0] - low[0], high[1] - low[1]) for low, high in extents], _APART)
    for whole, (x, y), (low, _) in zip(wholes, corners, extents, strict=True):
        plan.add(whole, (x - low[0], y - low[1]))
    return plan


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


def _component(
    problem: LayoutProblem,
    units: Sequence[Unit],
    bonds: Sequence[int],
    guests: Sequence[Unit],
    edges: Sequence[int],
    pair: Mapping[int, int],
    columns: AbstractSet[int],
    wanted: Wanted,
    behind: Sequence[tuple[int, int]],
    draft: bool,
) -> ComponentLayout:
    here = {m for unit in units for m in unit.members}
    columns = {box for box in columns if here.issuperset(problem.boxes[box][1])}
    found = [
        _one_on_axis(problem, units, bonds, rank, pair) if pair else rank
        for rank in _ranks(problem, units, bonds, edges, behind)
    ]
    tried = partial(_in_order, problem, units, guests, bonds, edges, pair, columns)
    rank = found[0] if len(found) == 1 else min(found, key=lambda rank: tried(rank, True).cost(problem))
    best = tried(rank, draft)
    levels, order, partner, columns, folds = best.levels, best.order, best.partner, best.columns, best.folds
    may = {min(unit.members) for unit in units if unit.turns and not draft}
    reading = None if pair or draft else _reading(problem, here, edges, {m for unit in guests for m in unit.members})
    levels, order, flipped = reflected(levels, order, may, reading)
    plan = ComponentLayout(reflected=flipped)
    plan.sides = at_ends(problem, _singles(levels, 0), _singles(levels, -1))
    for n, node in enumerate(levels.nodes):
        if node.members and node.members[0][0] in plan.sides:
            levels.nodes[n] = replace(node, reach=(node.reach[0], 0.0))
    spacing = problem.neuron_spacing, problem.rank_spacing
    places = placed(stacked(levels, folds), order, *spacing, partner, columns, folds.ranks)
    uneven = frozenset[int]()
    if partner is None and not columns and (lifted := staggered(problem, levels, order, places)):
        levels = lifted
        uneven = frozenset(r for r, rank in enumerate(order) if any(levels.nodes[n].lift for n in rank))
        places = placed(stacked(levels, folds), order, *spacing, partner, columns, folds.ranks)
    _draw_in(levels, order, places, {m for unit in guests for m in unit.members}, problem.neuron_spacing)
    for node, (x, y) in zip(levels.nodes, places, strict=True):
        for member, dx, dy in node.members:
            plan.places[member] = (x + dx, y + dy)
        if node.framed:
            plan.rects.append((x - node.reach[0], y - node.reach[1], x + node.reach[0], y + node.reach[1]))
    spans = list(zip(*reaches(levels, order), strict=True))
    for i, passages in levels.passages.items():
        plan.ways[i] = [_passage(places[n], *spans[levels.nodes[n].rank]) for n in passages]
    plan.ways, whole = with_exits(problem, edges, levels, places, spans, folds, uneven, plan.ways)
    if whole and not best.crossed:
        plan.firm |= whole
    if not pair:
        plan.cuts, bands = banded(problem, levels, places, folds.ranks, wanted)
        if wanted.bands > 1:
            _in_bands(problem, plan, levels, bands)
    sides = {**dict(enumerate(sides_of(problem))), **plan.sides}
    plan.rects += covered(problem, plan.places, sides, sorted(plan.places)).values()
    return plan


@dataclass(frozen=True, slots=True)
class _InOrder:
    """Levels with the order of each rank, how many segments cross, the mirror image of each node, the boxes that are
    columns, and what is folded."""

    levels: Levels
    order: Order
    crossed: int
    partner: Sequence[int] | None
    columns: AbstractSet[int]
    folds: Folds

    def cost(self, problem: LayoutProblem) -> float:
        """How many segments cross, and about how many will be crossed by connections that lead from outside of a frame
        into it, which come from above, and by those that lead out of it."""
        rank = {m: node.rank for node in self.levels.nodes for m, _, _ in node.members}
        last = len(self.order) - 1
        ways = [rank[m] for m in problem.inward if m in rank] + [last - rank[m] for m in problem.outward if m in rank]
        return self.crossed + _PASSED * sum(ways)


def _in_order(
    problem: LayoutProblem,
    units: Sequence[Unit],
    guests: Sequence[Unit],
    bonds: Sequence[int],
    edges: Sequence[int],
    pair: Mapping[int, int],
    columns: AbstractSet[int],
    rank: Sequence[int],
    draft: bool,
) -> _InOrder:
    """Units that have their ranks, in order."""
    folds = folded(problem, units, bonds, rank, edges, pair)
    levels = levels_of(problem, [*units, *guests], [*folds.rank, *([max(folds.rank)] * len(guests))], edges, columns)
    interleaved(levels, problem, folds)
    with_spines(problem, levels, columns)
    partner: Sequence[int] | None = None
    free = frozenset[int]() if columns or folds.ranks else _free(levels, units, bonds, pair)
    if pair:
        levels, order, partner = mirrored(problem, levels, pair, free, draft)
    else:
        levels, order = ordered(levels, free, problem.effort, draft)
    straight = straightened(levels, order, columns) if columns else None
    columns, order = (columns, straight) if straight else (frozenset(), order)
    crossed = crossings(levels, order)
    if columns:
        levels, order = tied(levels, order, columns)
    return _InOrder(levels, order, crossed, partner, columns, folds)


def _reading(
    problem: LayoutProblem, connected: AbstractSet[int], edges: Sequence[int], loose: AbstractSet[int]
) -> Reading:
    """What these neurons and edges are read by."""
    place, here = problem.reading(), sorted(connected | loose)
    before = problem.memory.positions if problem.memory else {}
    there = {
        m: from_picture(before[problem.neurons[m]], problem.direction) for m in here if problem.neurons[m] in before
    }
    there.update({m: problem.pins[m] for m in here if m in problem.pins})
    flow = [(problem.edges[i].source, problem.edges[i].target) for i in edges]
    return Reading({m: place[m] for m in here}, {m: across for m, (across, _) in there.items()}, flow, loose)


def _singles(levels: Levels, rank: int) -> list[int]:
    """The neurons in a rank that are in no block and in no frame."""
    nodes = [levels.nodes[n] for n in levels.ranks[rank]]
    return [node.members[0][0] for node in nodes if len(node.members) == 1 and not node.framed]


def _in_bands(problem: LayoutProblem, plan: ComponentLayout, levels: Levels, bands: Bands) -> None:
    """Move what stands in each band there."""
    shift = [bands.shifts[bands.band[node.rank]] for node in levels.nodes]
    own = {m: shift[n] for n, node in enumerate(levels.nodes) for m, _, _ in node.members}
    framed = [n for n, node in enumerate(levels.nodes) if node.framed]
    plan.places.update({m: (x + own[m][0], y + own[m][1]) for m, (x, y) in plan.places.items()})
    plan.rects = [shifted(rect, shift[n]) for n, rect in zip(framed, plan.rects, strict=True)]
    rank = {m: node.rank for node in levels.nodes for m, _, _ in node.members}
    for i, line in bands.ways.items():
        plan.cut[i] = line if rank[problem.edges[i].source] < rank[problem.edges[i].target] else line[::-1]
    plan.firm -= plan.cut.keys()
    plan.ways = {
        i: [Waypoint(way.x + dx, way.y + dy, way.half) for way in ways]
        for i, ways in plan.ways.items()
        for dx, dy in (own[problem.edges[i].source],)
        if i not in plan.cut
    }


def _passage(place: Point, before: float, behind: float) -> Waypoint:
    """Straight through all of a rank."""
    return Waypoint(place[0], place[1] + (behind - before) / 2, (before + behind) / 2)


def _ranks(
    problem: LayoutProblem,
    units: Sequence[Unit],
    bonds: Sequence[int],
    edges: Sequence[int],
    behind: Sequence[tuple[int, int]],
) -> list[list[int]]:
    """Ranks of these units, one for each way of cutting loops that makes a difference."""
    numbers = {bond: number for number, bond in enumerate(dict.fromkeys(bonds))}
    owner = {m: numbers[bond] for unit, bond in zip(units, bonds, strict=True) for m in unit.members}
    wired: nx.DiGraph[int] = nx.DiGraph((problem.edges[i].source, problem.edges[i].target) for i in edges)
    loop_of = {neuron: k for k, loop in enumerate(nx.strongly_connected_components(wired)) for neuron in loop}
    arcs: dict[tuple[int, int], float] = {}
    along: set[tuple[int, int]] = set()
    for i in edges:
        edge = problem.edges[i]
        ends = owner[edge.source], owner[edge.target]
        if loop_of[edge.source] != loop_of[edge.target]:
            along.add(ends)
        if ends[0] != ends[1]:
            arcs[ends] = arcs.get(ends, 0.0) + (INSTANT if edge.delay == 0 else 1.0)
    arcs.update({(owner[a], owner[b]): _ROW for a, b in behind if a in owner and b in owner and owner[a] != owner[b]})
    first = {owner[m] for m in problem.entries if m in owner}
    last = {owner[m] for m in problem.exits if m in owner}
    templates = {module.members: module.template for module in problem.modules}
    kinds = {
        numbers[bond]: templates[unit.members]
        for unit, bond in zip(units, bonds, strict=True)
        if unit.members in templates
    }
    found: dict[tuple[int, ...], None] = {}
    for entered in _ENTERED:
        ranks = levelled(ranks_of(len(numbers), arcs, first, last, along, entered), arcs, kinds)
        found[tuple(ranks[numbers[bond]] for bond in bonds)] = None
    return [list(rank) for rank in found]


def _free(levels: Levels, units: Sequence[Unit], bonds: Sequence[int], pair: Mapping[int, int]) -> frozenset[int]:
    """The nodes that may change their rank: single neurons that share none with others but their images, outside of
    boxes."""
    count = Counter(bonds)
    alone = {
        unit.members[0]
        for unit, bond in zip(units, bonds, strict=True)
        if count[bond] == 1 + (unit.members[0] in pair) and len(unit.members) == 1 and unit.places is None
    }
    return frozenset(
        n for n, node in enumerate(levels.nodes) if node.members and node.members[0][0] in alone and node.box < 0
    )


def _one_on_axis(
    problem: LayoutProblem, units: Sequence[Unit], bonds: Sequence[int], rank: Sequence[int], pair: Mapping[int, int]
) -> list[int]:
    """Ranks in which no two units have to stand on the axis, and none without an image stands beside one that has to:
    it has a rank of its own, on that side to which more of its connections lead."""
    owner = {m: u for u, unit in enumerate(units) for m in unit.members}
    down = [0] * len(units)
    for edge in problem.edges:
        if edge.source in owner and edge.target in owner:
            a, b = owner[edge.source], owner[edge.target]
            down[a] += (rank[b] > rank[a]) - (rank[b] < rank[a])
            down[b] += (rank[a] > rank[b]) - (rank[a] < rank[b])
    fixed = [u for u, unit in enumerate(units) if symmetric(unit.members, pair)]
    held = {bonds[u] for u in fixed}
    step: dict[int, int] = {}
    taken: dict[int, int] = {}
    for u in fixed:
        step[bonds[u]] = taken[rank[u]] = taken.get(rank[u], -1) + 1
    for u, unit in enumerate(units):
        if rank[u] in taken and bonds[u] not in held and pair.keys().isdisjoint(unit.members):
            step[bonds[u]] = taken[rank[u]] + 1 if down[u] > 0 else -1
    result = [2 * len(units) * r + step.get(bond, 0) for r, bond in zip(rank, bonds, strict=True)]
    levels = {value: place for place, value in enumerate(sorted(set(result)))}
    return [levels[value] for value in result]


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


def _unconnected(problem: LayoutProblem, units: Sequence[Unit]) -> ComponentLayout:
    """Neurons that nothing connects: in a row, or a grid where they are many."""
    members = sorted((m for unit in units for m in unit.members), key=problem.reading().__getitem__)
    width = len(members) if len(members) <= 12 else columns(len(members))
    wide, high = (max(more) for more in zip(*(excess(problem, m) for m in members), strict=True))
    points = grid(len(members), width, max(problem.neuron_spacing, 0.65))
    points = [(x * (1 + wide), y * (1 + 2 * high)) for x, y in points]
    return ComponentLayout({m: (snap(x), snap(y)) for m, (x, y) in zip(members, points, strict=True)})
