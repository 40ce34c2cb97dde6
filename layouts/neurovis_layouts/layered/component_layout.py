"""Component layout: units that hang together, in ranks: the phases of which ``engine`` has the list.

In: a RankProblem, made a Component, to which each phase adds what it makes. Out: a ComponentLayout: the places of
neurons, the waypoints of edges, and which frames inside are reflected.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise

import networkx as nx

from neurovis_layouts.frame import from_picture
from neurovis_layouts.label_room import at_ends, covered, sides_of
from neurovis_layouts.layered.bands import Bands, Wanted, banded
from neurovis_layouts.layered.box_columns import spined, straightened, tied
from neurovis_layouts.layered.flips import Reading, reflected
from neurovis_layouts.layered.folds import Folding, Folds, PlacedRanks, folding, interleaved, stacked, with_exits
from neurovis_layouts.layered.levels import Levels, levels_of
from neurovis_layouts.layered.mirror import mirrored
from neurovis_layouts.layered.order import Order, crossings, ordered
from neurovis_layouts.layered.page_cost import PageCost, page_across
from neurovis_layouts.layered.parts import symmetric
from neurovis_layouts.layered.place import flattened, placed, reaches, staggered
from neurovis_layouts.layered.ranks import INSTANT, levelled, ranks_of
from neurovis_layouts.layered.tries import cheapest
from neurovis_layouts.layered.units import Unit
from neurovis_layouts.routing import Waypoint
from neurovis_spec.layout.geometry import Rect, shifted, snap
from neurovis_spec.layout.model import LayoutProblem, Point, Side

#: How much it counts where a loop is cut that a unit is driven from outside of it, or drives something there: whichever
#: leaves fewer crossings.
_ENTERED = (0.25, 0.0, -0.25)
#: How many segments are crossed in a rank on the way into a frame.
_PASSED = 0.125
#: So often the ranks of layers are put farther apart at most.
_ROUNDS = 3
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
class Component:
    """A component as far as the phases have come with it; what a phase makes, the next ones read."""

    part: RankProblem
    #: by unit
    rank: Sequence[int]
    folding: Folding = field(default_factory=lambda: Folding([], [], half=False))
    folds: Folds = field(default_factory=lambda: Folds([]))
    #: the boxes that are columns
    columns: AbstractSet[int] = frozenset()
    levels: Levels = field(default_factory=Levels)
    order: Order = field(default_factory=list)
    #: the mirror image of each node
    partner: Sequence[int] | None = None
    #: how many segments cross
    crossed: int = 0
    #: by node; which ranks are staggered
    places: list[Point] = field(default_factory=list)
    uneven: AbstractSet[int] = frozenset()
    layout: ComponentLayout = field(default_factory=ComponentLayout)

    def draft(self) -> Component:
        """The same, of which only the cost matters."""
        return replace(self, part=replace(self.part, draft=True))

    def cost(self) -> float:
        """How many segments cross, and about how many will be crossed by connections that lead from outside of a frame
        into it, which come from above, and by those that lead out of it."""
        problem = self.part.problem
        rank = {m: node.rank for node in self.levels.nodes for m, _, _ in node.members}
        last = len(self.order) - 1
        ways = [rank[m] for m in problem.inward if m in rank] + [last - rank[m] for m in problem.outward if m in rank]
        return self.crossed + _PASSED * sum(ways)


def ranked(part: RankProblem) -> list[Component]:
    """The component in ranks, once for each way of cutting loops that makes a difference."""
    problem, units, bonds = part.problem, part.units, part.bonds
    numbers = {bond: number for number, bond in enumerate(dict.fromkeys(bonds))}
    owner = {m: numbers[bond] for unit, bond in zip(units, bonds, strict=True) for m in unit.members}
    arcs, along = _arcs(part, owner)
    first, last = ({owner[m] for m in ends if m in owner} for ends in (problem.entries, problem.exits))
    templates = {module.members: module.template for module in problem.modules}
    known = [(numbers[bond], templates.get(unit.members)) for unit, bond in zip(units, bonds, strict=True)]
    kinds = {number: template for number, template in known if template is not None}
    found: dict[tuple[int, ...], None] = {}
    for entered in _ENTERED:
        ranks = levelled(ranks_of(len(numbers), arcs, first, last, along, entered), arcs, kinds)
        found[tuple(ranks[numbers[bond]] for bond in bonds)] = None
    return [Component(part, rank) for rank in found]


def _arcs(part: RankProblem, owner: Mapping[int, int]) -> tuple[dict[tuple[int, int], float], set[tuple[int, int]]]:
    """What runs from bond to bond, with its weight, and what of it is in no loop of neurons; ``owner`` is the bond of a
    neuron."""
    edges = [part.problem.edges[i] for i in part.edges]
    wired: nx.DiGraph[int] = nx.DiGraph(way for edge in edges for way in edge.ways)
    loop_of = {neuron: k for k, loop in enumerate(nx.strongly_connected_components(wired)) for neuron in loop}
    along = {(owner[e.source], owner[e.target]) for e in edges if loop_of[e.source] != loop_of[e.target]}
    arcs: dict[tuple[int, int], float] = {}
    for edge in edges:
        ends = owner[edge.source], owner[edge.target]
        if ends[0] != ends[1]:
            arcs[ends] = arcs.get(ends, 0.0) + (INSTANT if edge.delay == 0 else 1.0)
    behind = [(owner[a], owner[b]) for a, b in part.behind if a in owner and b in owner]
    arcs.update({(a, b): _ROW for a, b in behind if a != b})
    return arcs, along


def with_axis(found: Component) -> Component:
    """The ranks of what is symmetric, in which nobody is in the way on the axis."""
    return replace(found, rank=_one_on_axis(found.part, found.rank))


def with_frames_in_ranks(found: Component) -> Component:
    """All units as they come, and which frames can be folded."""
    part = found.part
    may = folding(part.problem, part.units, part.bonds, found.rank, part.edges, part.pair)
    return replace(found, folding=may, folds=may.folded([0] * len(may.blocks)))


@dataclass(frozen=True, slots=True)
class _Tried:
    """In how many rows each block of frames stands, and what that costs."""

    cost: float
    wide: bool
    rows: Sequence[int]


def with_rows(found: Component, drafted: Callable[[Component], Component]) -> Component:
    """Frames that are wider than a page side by side in so many rows that the page costs least, as ``drafted``."""
    part, may = found.part, found.folding
    if not may.blocks:
        return found
    problem = part.problem
    cost = PageCost(problem, [(problem.edges[i].source, problem.edges[i].target) for i in part.edges], directed=True)

    def tried(rows: Sequence[int]) -> _Tried:
        layout = drafted(replace(found, folds=may.folded(rows))).layout
        low, high = layout.extent()
        places = [layout.places.get(m, low) for m in range(len(problem.neurons))]
        wide = high[0] - low[0] > page_across(problem) * (high[1] - low[1])
        return _Tried(cost(places, (*low, *high)), wide, rows)

    best = tried([1] * len(may.blocks))
    if not best.wide:
        return found
    for number, block in enumerate(may.blocks):
        best = cheapest(partial(_in_rows, tried, best.rows, number), block.rows()[1:], best)
    return replace(found, folds=may.folded(best.rows))


def _in_rows(tried: Callable[[Sequence[int]], _Tried], rows: Sequence[int], block: int, count: int) -> _Tried:
    """One block in so many rows, the others as they are."""
    return tried([*rows[:block], count, *rows[block + 1 :]])


def with_levels(found: Component) -> Component:
    """Nodes in their ranks, and the passages of what crosses these."""
    part, rank = found.part, found.folds.rank
    here = {m for unit in part.units for m in unit.members}
    columns = {box for box in part.columns if here.issuperset(part.problem.boxes[box][1])}
    level = [*rank, *([max(rank)] * len(part.guests))]
    levels = levels_of(part.problem, [*part.units, *part.guests], level, part.edges, columns)
    return replace(found, columns=columns, levels=levels)


def with_rows_interleaved(found: Component) -> Component:
    """The rows of folds, and what runs through them, from side to side."""
    interleaved(found.levels, found.part.problem, found.folds)
    return found


def with_spines(found: Component) -> Component:
    """Boxes that are columns held together while ranks are ordered."""
    spined(found.part.problem, found.levels, found.columns)
    return found


def in_order(found: Component) -> Component:
    """Ranks in an order in which few connections cross."""
    levels, order = ordered(found.levels, _free(found), found.part.problem.effort, found.part.draft)
    return replace(found, levels=levels, order=order)


def in_symmetric_order(found: Component) -> Component:
    """The same with mirror images opposite each other."""
    part = found.part
    levels, order, partner = mirrored(part.problem, found.levels, part.pair, _free(found), part.draft)
    return replace(found, levels=levels, order=order, partner=partner)


def with_straight_columns(found: Component) -> Component:
    """What hangs together on one side of a column; no columns where that cannot be."""
    straight = straightened(found.levels, found.order, found.columns)
    return replace(found, order=straight) if straight else replace(found, columns=frozenset())


def with_crossings(found: Component) -> Component:
    """What the order costs."""
    return replace(found, crossed=crossings(found.levels, found.order))


def with_columns_tied(found: Component) -> Component:
    """Columns held together by their own nodes."""
    levels, order = tied(found.levels, found.order, found.columns)
    return replace(found, levels=levels, order=order)


def with_reflections(found: Component) -> Component:
    """Frames as their mirror images, and the whole so, as it crosses least and is read best."""
    part = found.part
    may = {min(unit.members) for unit in part.units if unit.turns and not part.draft}
    reading = None if part.pair or part.draft else _reading(part)
    levels, order, flipped = reflected(found.levels, found.order, may, reading)
    return replace(found, levels=levels, order=order, layout=ComponentLayout(reflected=flipped))


def with_labels_at_ends(found: Component) -> Component:
    """Labels of the first and the last rank before and behind it, where nothing runs."""
    levels = found.levels
    sides = at_ends(found.part.problem, _singles(levels, 0), _singles(levels, -1))
    nodes = [
        replace(node, reach=(node.reach[0], 0.0)) if node.members and node.members[0][0] in sides else node
        for node in levels.nodes
    ]
    return replace(found, levels=replace(levels, nodes=nodes), layout=replace(found.layout, sides=sides))


def with_places(found: Component, rank_spacing: float | None = None) -> Component:
    """Places across and along, ranks as far apart as the problem says, or otherwise."""
    problem, ranks = found.part.problem, stacked(found.levels, found.folds)
    spacing = problem.neuron_spacing, problem.rank_spacing if rank_spacing is None else rank_spacing
    return replace(found, places=placed(ranks, found.order, *spacing, found.partner, found.columns, found.folds.ranks))


def with_staggered_ranks(found: Component) -> Component:
    """Much that is wide in ranks of two rows."""
    levels = staggered(found.part.problem, found.levels, found.order, found.places)
    if levels is None:
        return found
    uneven = frozenset(r for r, rank in enumerate(found.order) if any(levels.nodes[n].lift for n in rank))
    return with_places(replace(found, levels=levels, uneven=uneven))


def with_layers_apart(found: Component) -> Component:
    """Layers that are so wide that they would be flat farther apart; their rows are as high as they are."""
    problem, spacing = found.part.problem, found.part.problem.rank_spacing
    for _ in range(_ROUNDS):
        spacing *= flattened(problem, found.levels, found.places)
        if spacing > problem.rank_spacing:
            found = with_places(found, spacing)
    return found


def with_guests_drawn_in(found: Component) -> Component:
    """Unconnected neurons at the end of a rank close to their neighbour, two units off, not where the rank left
    them."""
    places, nodes, guests = list(found.places), found.levels.nodes, found.part.loose
    for rank in found.order:
        for before, node in pairwise(rank):
            own, other = nodes[node], nodes[before]
            if own.members and own.members[0][0] in guests and node == rank[-1] and other.members:
                beside = 2.0 if other.members[0][0] not in guests else 1.0
                across = places[before][0] + other.reach[0] + own.reach[0]
                places[node] = (snap(across + beside * found.part.problem.neuron_spacing), places[node][1])
    return replace(found, places=places)


def with_neurons(found: Component) -> Component:
    """Where neurons and frames stand, by the places of their nodes."""
    places: dict[int, Point] = {}
    rects: list[Rect] = []
    for node, (x, y) in zip(found.levels.nodes, found.places, strict=True):
        places.update({member: (x + dx, y + dy) for member, dx, dy in node.members})
        if node.framed:
            rects.append((x - node.reach[0], y - node.reach[1], x + node.reach[0], y + node.reach[1]))
    return replace(found, layout=replace(found.layout, places=places, rects=rects))


def with_waypoints(found: Component) -> Component:
    """The waypoints of connections: their passages, and where they leave folds and staggered ranks."""
    spans = list(zip(*reaches(found.levels, found.order), strict=True))
    ranks = PlacedRanks(found.levels, found.places, spans, found.folds, found.uneven)
    ways, whole = with_exits(found.part.problem, found.part.edges, ranks, _passages(ranks))
    return replace(found, layout=replace(found.layout, ways=ways, firm=set() if found.crossed else whole))


def in_bands(found: Component) -> Component:
    """The ranks cut, and their parts side by side; in how many they might be."""
    part, levels = found.part, found.levels
    cuts, bands = banded(part.problem, levels, found.places, found.folds.ranks, part.wanted)
    layout = replace(found.layout, cuts=cuts)
    return replace(
        found, layout=_moved_to_bands(part.problem, layout, levels, bands) if part.wanted.bands > 1 else layout
    )


def with_labels(found: Component) -> Component:
    """What labels cover."""
    problem, layout = found.part.problem, found.layout
    sides = {**dict(enumerate(sides_of(problem))), **layout.sides}
    labels = covered(problem, layout.places, sides, sorted(layout.places)).values()
    return replace(found, layout=replace(layout, rects=[*layout.rects, *labels]))


def _passages(ranks: PlacedRanks) -> dict[int, list[Waypoint]]:
    """The waypoints of each edge in the ranks that it crosses: straight through all of a rank."""
    found: dict[int, list[Waypoint]] = {}
    for i, passages in ranks.levels.passages.items():
        found[i] = []
        for n in passages:
            (x, y), (before, behind) = ranks.places[n], ranks.spans[ranks.levels.nodes[n].rank]
            found[i].append(Waypoint(x, y + (behind - before) / 2, (before + behind) / 2))
    return found


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


def _free(found: Component) -> frozenset[int]:
    """The nodes that may change their rank: single neurons that share none with others but their images, outside of
    boxes."""
    part, levels = found.part, found.levels
    if found.columns or found.folds.ranks:
        return frozenset()
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


def _moved_to_bands(problem: LayoutProblem, layout: ComponentLayout, levels: Levels, bands: Bands) -> ComponentLayout:
    """What stands in each band moved there."""
    shift = [bands.shifts[bands.band[node.rank]] for node in levels.nodes]
    own = {m: shift[n] for n, node in enumerate(levels.nodes) for m, _, _ in node.members}
    framed = [n for n, node in enumerate(levels.nodes) if node.framed]
    rank = {m: node.rank for node in levels.nodes for m, _, _ in node.members}
    down = {i: rank[problem.edges[i].source] < rank[problem.edges[i].target] for i in bands.ways}
    moved = {i: own[problem.edges[i].source] for i in layout.ways if i not in bands.ways}
    return replace(
        layout,
        places={m: (x + own[m][0], y + own[m][1]) for m, (x, y) in layout.places.items()},
        rects=[shifted(rect, shift[n]) for n, rect in zip(framed, layout.rects, strict=True)],
        cut={i: line if down[i] else line[::-1] for i, line in bands.ways.items()},
        firm=layout.firm - bands.ways.keys(),
        ways={i: [Waypoint(w.x + dx, w.y + dy, w.half) for w in layout.ways[i]] for i, (dx, dy) in moved.items()},
    )
