"""Component layout: units that hang together, in ranks.

In: a RankProblem. Out: a ComponentLayout: the places of neurons, the waypoints of edges, and which frames inside are
reflected. It calls the stages ranks, levels, order and places one after the other.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from itertools import pairwise

import networkx as nx

from neurovis_layouts.frame import from_picture
from neurovis_layouts.label_room import at_ends, covered, sides_of
from neurovis_layouts.layered.bands import Bands, Wanted, banded
from neurovis_layouts.layered.box_columns import straightened, tied, with_spines
from neurovis_layouts.layered.flips import Reading, reflected
from neurovis_layouts.layered.folds import Folds, PlacedRanks, folded, interleaved, stacked, with_exits
from neurovis_layouts.layered.levels import Levels, levels_of
from neurovis_layouts.layered.mirror import mirrored
from neurovis_layouts.layered.order import Order, crossings, ordered
from neurovis_layouts.layered.parts import symmetric
from neurovis_layouts.layered.place import placed, reaches, staggered
from neurovis_layouts.layered.ranks import INSTANT, levelled, ranks_of
from neurovis_layouts.layered.units import Unit
from neurovis_layouts.routing import Waypoint
from neurovis_spec.layout.geometry import Rect, shifted, snap
from neurovis_spec.layout.model import LayoutProblem, Point, Side

#: How much it counts where a loop is cut that a unit is driven from outside of it, or drives something there: whichever
#: leaves fewer crossings.
_ENTERED = (0.25, 0.0, -0.25)
#: How many segments are crossed in a rank on the way into a frame.
_PASSED = 0.125
#: That a row stands behind another outweighs any connection.
_ROW = 1000 * INSTANT


@dataclass(frozen=True, slots=True)
class RankProblem:
    """What is to be drawn in ranks: a frame, or a component of it."""

    problem: LayoutProblem
    units: Sequence[Unit]
    #: by unit, a number that units of one rank share
    bonds: Sequence[int]
    #: the connections between them, by number
    edges: Sequence[int]
    #: mirror images, both ways: with any all is one component, its axis at 0
    pair: Mapping[int, int]
    #: boxes to be drawn as columns where that can be
    columns: AbstractSet[int]
    #: pairs of neurons of which the second stands in a later rank
    behind: Sequence[tuple[int, int]]
    #: the bands in which the ranks stand where they can be cut, which no axis can
    wanted: Wanted
    #: only the size counts
    draft: bool
    #: units without connections that stand at the end of the last rank
    guests: Sequence[Unit] = ()

    @property
    def loose(self) -> set[int]:
        """The neurons that nothing connects."""
        return {m for unit in self.guests for m in unit.members}


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


def component_layout(part: RankProblem) -> ComponentLayout:
    """The layout of one component: its units in ranks, these in order and at their places."""
    best = _best_order(part)
    flipped, best = _turned(part, best)
    problem, levels = part.problem, best.levels
    plan = ComponentLayout(reflected=flipped)
    plan.sides = at_ends(problem, _singles(levels, 0), _singles(levels, -1))
    for n, node in enumerate(levels.nodes):
        if node.members and node.members[0][0] in plan.sides:
            levels.nodes[n] = replace(node, reach=(node.reach[0], 0.0))
    ranks = _placed(part, best)
    for node, (x, y) in zip(ranks.levels.nodes, ranks.places, strict=True):
        for member, dx, dy in node.members:
            plan.places[member] = (x + dx, y + dy)
        if node.framed:
            plan.rects.append((x - node.reach[0], y - node.reach[1], x + node.reach[0], y + node.reach[1]))
    plan.ways, whole = with_exits(problem, part.edges, ranks, _passages(ranks))
    if whole and not best.crossed:
        plan.firm |= whole
    if not part.pair:
        plan.cuts, bands = banded(problem, ranks.levels, ranks.places, best.folds.ranks, part.wanted)
        if part.wanted.bands > 1:
            _in_bands(problem, plan, ranks.levels, bands)
    sides = {**dict(enumerate(sides_of(problem))), **plan.sides}
    plan.rects += covered(problem, plan.places, sides, sorted(plan.places)).values()
    return plan


def _best_order(part: RankProblem) -> _InOrder:
    """Ranks and order, of all ways of cutting loops with the one that costs least."""
    found = [_one_on_axis(part, rank) if part.pair else rank for rank in _ranks(part)]
    drafted = replace(part, draft=True)
    rank = found[0] if len(found) == 1 else min(found, key=lambda rank: _in_order(drafted, rank).cost(part.problem))
    return _in_order(part, rank)


def _turned(part: RankProblem, found: _InOrder) -> tuple[set[int], _InOrder]:
    """The same with those frames as their mirror images, and as a whole so, as it crosses least and is read best; and
    the first neurons of these frames."""
    may = {min(unit.members) for unit in part.units if unit.turns and not part.draft}
    reading = None if part.pair or part.draft else _reading(part)
    levels, order, flipped = reflected(found.levels, found.order, may, reading)
    return flipped, replace(found, levels=levels, order=order)


def _placed(part: RankProblem, found: _InOrder) -> PlacedRanks:
    """The places of what is in order; of much that is wide in staggered ranks."""
    problem, levels, order, folds = part.problem, found.levels, found.order, found.folds
    spacing = problem.neuron_spacing, problem.rank_spacing
    places = placed(stacked(levels, folds), order, *spacing, found.partner, found.columns, folds.ranks)
    uneven = frozenset[int]()
    if found.partner is None and not found.columns and (lifted := staggered(problem, levels, order, places)):
        levels = lifted
        uneven = frozenset(r for r, rank in enumerate(order) if any(levels.nodes[n].lift for n in rank))
        places = placed(stacked(levels, folds), order, *spacing, found.partner, found.columns, folds.ranks)
    _draw_in(levels, order, places, part.loose, problem.neuron_spacing)
    return PlacedRanks(levels, places, list(zip(*reaches(levels, order), strict=True)), folds, uneven)


def _passages(ranks: PlacedRanks) -> dict[int, list[Waypoint]]:
    """The waypoints of each edge in the ranks that it crosses: straight through all of a rank."""
    found: dict[int, list[Waypoint]] = {}
    for i, passages in ranks.levels.passages.items():
        found[i] = []
        for n in passages:
            (x, y), (before, behind) = ranks.places[n], ranks.spans[ranks.levels.nodes[n].rank]
            found[i].append(Waypoint(x, y + (behind - before) / 2, (before + behind) / 2))
    return found


def _ranks(part: RankProblem) -> list[list[int]]:
    """Ranks of these units, one for each way of cutting loops that makes a difference."""
    problem, units, bonds = part.problem, part.units, part.bonds
    numbers = {bond: number for number, bond in enumerate(dict.fromkeys(bonds))}
    owner = {m: numbers[bond] for unit, bond in zip(units, bonds, strict=True) for m in unit.members}
    wired: nx.DiGraph[int] = nx.DiGraph(way for i in part.edges for way in problem.edges[i].ways)
    loop_of = {neuron: k for k, loop in enumerate(nx.strongly_connected_components(wired)) for neuron in loop}
    arcs: dict[tuple[int, int], float] = {}
    along: set[tuple[int, int]] = set()
    for i in part.edges:
        edge = problem.edges[i]
        ends = owner[edge.source], owner[edge.target]
        if loop_of[edge.source] != loop_of[edge.target]:
            along.add(ends)
        if ends[0] != ends[1]:
            arcs[ends] = arcs.get(ends, 0.0) + (INSTANT if edge.delay == 0 else 1.0)
    arcs.update(
        {(owner[a], owner[b]): _ROW for a, b in part.behind if a in owner and b in owner and owner[a] != owner[b]}
    )
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


def _one_on_axis(part: RankProblem, rank: Sequence[int]) -> list[int]:
    """Ranks in which no two units have to stand on the axis, and none without an image stands beside one that has to:
    it has a rank of its own, on that side to which more of its connections lead."""
    units, bonds, pair = part.units, part.bonds, part.pair
    owner = {m: u for u, unit in enumerate(units) for m in unit.members}
    down = [0] * len(units)
    for edge in part.problem.edges:
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


def _in_order(part: RankProblem, rank: Sequence[int]) -> _InOrder:
    """Units that have their ranks, in order."""
    problem, guests, pair = part.problem, part.guests, part.pair
    here = {m for unit in part.units for m in unit.members}
    columns: AbstractSet[int] = {box for box in part.columns if here.issuperset(problem.boxes[box][1])}
    folds = folded(problem, part.units, part.bonds, rank, part.edges, pair)
    level = [*folds.rank, *([max(folds.rank)] * len(guests))]
    levels = levels_of(problem, [*part.units, *guests], level, part.edges, columns)
    interleaved(levels, problem, folds)
    with_spines(problem, levels, columns)
    partner: Sequence[int] | None = None
    free = frozenset[int]() if columns or folds.ranks else _free(levels, part)
    if pair:
        levels, order, partner = mirrored(problem, levels, pair, free, part.draft)
    else:
        levels, order = ordered(levels, free, problem.effort, part.draft)
    straight = straightened(levels, order, columns) if columns else None
    columns, order = (columns, straight) if straight else (frozenset(), order)
    crossed = crossings(levels, order)
    if columns:
        levels, order = tied(levels, order, columns)
    return _InOrder(levels, order, crossed, partner, columns, folds)


def _free(levels: Levels, part: RankProblem) -> frozenset[int]:
    """The nodes that may change their rank: single neurons that share none with others but their images, outside of
    boxes."""
    count = Counter(part.bonds)
    alone = {
        unit.members[0]
        for unit, bond in zip(part.units, part.bonds, strict=True)
        if count[bond] == 1 + (unit.members[0] in part.pair) and len(unit.members) == 1 and unit.places is None
    }
    return frozenset(
        n for n, node in enumerate(levels.nodes) if node.members and node.members[0][0] in alone and node.box < 0
    )


def _reading(part: RankProblem) -> Reading:
    """What the neurons and edges of a component are read by."""
    problem, place = part.problem, part.problem.reading()
    here = sorted({m for unit in part.units for m in unit.members} | part.loose)
    before = problem.memory.positions if problem.memory else {}
    there = {
        m: from_picture(before[problem.neurons[m]], problem.direction) for m in here if problem.neurons[m] in before
    }
    there.update({m: problem.pins[m] for m in here if m in problem.pins})
    flow = [(problem.edges[i].source, problem.edges[i].target) for i in part.edges]
    return Reading({m: place[m] for m in here}, {m: across for m, (across, _) in there.items()}, flow, part.loose)


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
