"""The cost of routes: what a route costs: how hard it is to follow by eye among all that is drawn.

In: all routes, the neurons, the frames. Out: one number for a route, higher for each disc or frame that it runs over,
for crossings, for running along other lines, for length and bends, and for ends close to others at a disc.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np

from neurovis_layouts.routing.ends import by_ends
from neurovis_layouts.routing.images import Images
from neurovis_layouts.routing.obstacles import REACH, TOUCH, Frame, Obstacles, Walls, meet
from neurovis_layouts.routing.polylines import END, STEP, Polylines, polylines
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.geometry import distance, distinct, padded, straight
from neurovis_spec.layout.model import LayoutEdge, Point, Route

# What a route costs, in units that only compare: a crossing is about one. Those without an underscore are what detours
# and self-loops cost as well. Each figure was set to zero in turn, on
# twelve networks of 15 to 80 neurons with 426 crossings; what became worse is said.

#: To enter a foreign frame or a disc: more than all else together, since it reads as a connection with what is there.
ENTERING = 1000.0
#: To be a unit closer to a disc than ``REACH``: so much that the middle of a gap is taken (without: 2 % more on
#: others).
_NEARING = 10.0
#: To come closer than ``OFF`` to a foreign frame: five crossings, as the frame may still grow by what is drawn in it,
#: and is entered then (nothing that was measured became worse).
_GRAZING = 6.0
#: To cross a line (without: 506 crossings).
_CROSSING = 1.2
#: To cross one that leads from or to the same neuron, besides: both can be untangled at that disc (without: 444).
_KIN = 2.4
#: To run on others for a unit: as bad as a crossing, since they are one line there (without: 1059 instead of 828 cells
#: that several lines share, and 456 crossings).
ALONG = 1.5
#: All that the straight line between its ends would cross costs no more than this times its length, and each crossing
#: less where that is many: one line of forty in a bundle is not followed by eye, and not worth a way round all of them
#: (without: fully connected layers in boxes send lines round the whole picture, which a test holds that none goes;
#: North graphs have 3 % fewer crossings).
_CROWDED = 0.75
#: To run on another between the same ends, times the share of the line that does: then one of the two is not seen at
#: all (without: a sheaf of six between two neurons, which a test draws, is not told apart).
_SAME = 12.0
#: To leave where another arrives at the disc, or the other way round: two lines look like one that passes (without:
#: 442).
_MEETING = 2.0
#: To do so where another does the same: half, as it is at least seen that something leaves (without: twice the ends
#: that are one).
_BESIDE = 1.0
#: To be a unit longer: small, for where all else is the same (without: longer lines, and 2 % more on each other).
_LONGER = 0.1
#: To be longer by the straight way: twice as long is a crossing (without: 428).
_RATIO = 1.0
#: To turn by a chord of one: a right angle is most of a crossing (without: 9 % more turning, and 433 crossings).
BENDING = 0.5
#: The same in a bend of radius 1, which is hard to follow where it is tight (without: 430, and 2 % more turning).
_TIGHT = 0.25
#: To turn back for a unit along the direction: more than two crossings, since the direction is what is read first
#: (nothing that was measured became worse; a test holds that no line turns back for a crossing).
_BACK = 3.0
#: To lead a unit beyond all that is drawn: two units are a crossing (without: 1 % more line, around everything).
_OUTSIDE = 0.5

#: To arrive where another leaves, or the other way round, so close that both are one line: more than a crossing, which
#: can be followed (without: connections arrive where others leave, which tests hold that none does).
_ARRIVING = 3.0
#: To bow to the side of what leads back, of routes between mirror images: there and back are told apart by their sides.
_ASTRAY = 5.0

#: A route whose way and shape cost more than this winds: a bend of 70°.
_WINDS = 0.6
#: One for which what else runs or ends there costs more than this is to be told apart: a fifth of a unit on another
#: (with 0.6 bows over a row lie on each other).
_UNCLEAR = 0.3
#: More connections between two neurons than this have no room to be told apart, nor have more ends at a disc.
_MATES, _ENDS = 12, 12
#: More of them than this are a fan, in which each has its place.
_FAN = 3
#: As far as this a line runs beside borders for nothing, as it passes some aslant.
_PASSING = 2.0
#: Closer than this an arrival and a departure are one line.
_CLOSE = 0.13
#: What is this close to a disc may be measured to run over it.
_SLACK = 0.02
#: How far off a foreign frame lines stay, at least: it may grow by what is drawn in it.
OFF = 0.06
#: How far beyond discs and frames a line may lead for nothing; how far back along the direction.
_MARGIN, _ONWARD = 0.8, 0.05
#: So close to a border a line is one with it.
_BESIDE_BORDER = 0.08
#: How far from a centre ends are checked, how far apart they are to be.
_AT, _APART = 0.45, 0.16


@dataclass(frozen=True, slots=True)
class Unclear:
    """How hard a route is to follow, and whether that is by its own way and shape, not only by what else is there."""

    cost: float
    winds: bool


class Drawn:
    """All that is drawn: ``routes`` by edge index, and others, which stay. Of mirror
    ``images`` only one has to be drawn."""

    def __init__(
        self,
        edges: Sequence[LayoutEdge],
        centres: Sequence[Point],
        routes: Mapping[int, Route],
        frames: Sequence[Frame] = (),
        drawn: Sequence[Route] = (),
        images: Images | None = None,
    ) -> None:
        self.edges, self.centres, self.images = edges, centres, images or Images()
        self.routes: dict[int, Route] = dict(routes)
        wide = [(own, padded(rect, OFF)) for own, rect in frames]
        self.rects: FloatArray = np.array([rect for _, rect in frames], dtype=np.float64).reshape(-1, 4)
        self.obstacles, self.walls = Obstacles(centres), Walls(wide, len(centres))
        self.discs: FloatArray = np.array(centres, dtype=np.float64).reshape(-1, 2)
        self.low: FloatArray = np.concatenate([self.discs, self.walls.rects[:, :2]]).min(axis=0) - _MARGIN
        self.high: FloatArray = np.concatenate([self.discs, self.walls.rects[:, 2:]]).max(axis=0) + _MARGIN
        self._borders = _border_cells(self.rects)
        self._between = by_ends((i, edges[i]) for i in sorted(routes))
        #: the number of the line of an edge among all, and of each line its edge and the neurons that it leads from and
        #: to; −1 where there is none
        self._line = {i: k for k, i in enumerate(sorted(routes))}
        lines = [*(routes[i] for i in self._line), *drawn]
        number = {centre: k for k, centre in enumerate(centres)}
        self._edge_of: IntArray = np.array([*self._line, *([-1] * len(drawn))], dtype=np.int64)
        ends = [(number.get(route[0], -1), number.get(route[-1], -1)) for route in lines]
        self._ends_of: IntArray = np.array(ends, dtype=np.int64).reshape(-1, 2)
        #: by neuron the lines that leave it (1) and that arrive there (0)
        self._at: dict[int, list[tuple[int, bool]]] = {}
        for leaves in (True, False):
            for line, neuron in enumerate(self._ends_of[:, 0 if leaves else 1].tolist()):
                if neuron >= 0:
                    self._at.setdefault(neuron, []).append((line, leaves))
        self._lines = polylines(lines)
        #: (2, n, 2) where each is seen to arrive at a disc (0), and to leave one (1)
        self._seen: FloatArray = np.stack([self._lines.arrive(_AT), self._lines.leave(_AT)])
        cells, owner = self._lines.cells()
        borders = np.full(len(self._borders), -2, dtype=np.int64)
        self._enter(np.concatenate([cells, self._borders]), np.concatenate([self._edge_of[owner], borders]))

    def unclear(self, free: AbstractSet[int]) -> dict[int, Unclear]:
        """Which of these edges' routes are hard to follow, by all that they cost but crossings, of which most have to
        be."""
        count, own = len(self._line), [(self.edges[i].source, self.edges[i].target) for i in self._line]
        routes = [self.routes[i] for i in self._line]
        far = np.array([max(distance(route[0], route[-1]), 1e-9) for route in routes])
        # a single curve winds only where it is much longer than the straight way
        several = np.array([len(route) > 4 for route in routes], dtype=np.bool_)
        shape = _RATIO * (self._lines.lengths()[:count] / far - 1) + BENDING * self._lines.bends()[0][:count] * several
        shape += ENTERING * np.array(self.walls.entered(routes, own), dtype=np.float64)
        shape += ENTERING * (np.array(self.obstacles.clearances(routes, own)) < TOUCH)
        first, last = self._ends_of[self._lines.owner].T
        loops = (first == last) & (first >= 0)
        shape += _CROSSING * self._lines.crossed(self._lines.a[loops], self._lines.b[loops])[:count]
        cells, owner = self._lines.cells()
        border: IntArray = np.bincount(owner[_among(cells, self._borders)], minlength=len(self._lines))[:count]
        shape += np.where(STEP * border > _PASSING, ALONG * STEP * border, 0.0)
        # in a fan each has its place
        shape *= [float(len(self._between[frozenset(ends)]) <= _FAN) for ends in own]
        around = ALONG * STEP * self._shared() + self._meeting()[:count]
        found = {i: (a, b) for i, a, b in zip(self._line, shape.tolist(), around.tolist(), strict=True)}
        for mates in self._between.values():
            for i in mates if 1 < len(mates) <= _MATES else ():
                others, line = self.mates(i, self.both(i)), self._lines.some(np.array([self._line[i]]))
                a, b = found[i]
                same = _SAME * float(line.on(polylines(others))[0]) if others else 0.0
                found[i] = a + float(self.astray(i, line)[0]), b + same
        return {
            i: Unclear(a + b, a > _WINDS) for i, (a, b) in found.items() if i in free and (a > _WINDS or b > _UNCLEAR)
        }

    def _shared(self) -> FloatArray:
        """(n,) through how many cells the route of each edge runs where others are; where its ends are too many to
        be told apart, none."""
        many = len(self.edges) + 1
        # each edge once in a cell
        lines = self.cell_edges > -2
        cell, edge = np.divmod(distinct(self.cells[lines] * many + self.cell_edges[lines] + 1), many)
        shared: BoolArray = np.zeros(len(cell), dtype=np.bool_)
        shared[1:] |= cell[1:] == cell[:-1]
        shared[:-1] |= cell[1:] == cell[:-1]
        full = {neuron for neuron, ends in self._at.items() if len(ends) > _ENDS}
        free = [full.isdisjoint((self.edges[i].source, self.edges[i].target)) for i in self._line]
        times: FloatArray = np.bincount(edge[shared], minlength=many)[1:].astype(np.float64)
        times = np.where(np.array(free, dtype=np.bool_), times[list(self._line)], 0.0)
        return times

    def _meeting(self) -> FloatArray:
        """(n,) what it costs each line to end close to others at its discs, where these are few."""
        cost = np.zeros(len(self._lines))
        for ends in self._at.values():
            if 1 < len(ends) <= _ENDS:
                lines, leaves = np.array(ends, dtype=np.int64).T
                places = self._seen[leaves, lines]
                far = np.sqrt(((places[:, None] - places) ** 2).sum(axis=2))
                one = _together(far, leaves[:, None] == leaves)
                np.fill_diagonal(one, 0.0)
                np.add.at(cost, lines, one.sum(axis=1))
        return cost

    def astray(self, i: int, lines: Polylines) -> FloatArray:
        """(n,) what it costs lines of an edge between mirror images to bow to the side of those that lead back."""
        if not self.even(i):
            return np.zeros(len(lines))
        (x0, y0), (x1, _) = self.routes[i][0], self.routes[i][-1]
        middle = lines.points[(lines.starts[:-1] + lines.starts[1:]) // 2, 1]
        cost: FloatArray = np.where(middle >= y0 if x0 < x1 else middle <= y0, _ASTRAY, 0.0)
        return cost

    def mates(self, i: int, but: Sequence[int]) -> list[Route]:
        """The routes between the same ends as that of an edge, ``but`` for some."""
        own = self._between[frozenset((self.edges[i].source, self.edges[i].target))]
        return [self.routes[k] for k in own if k not in but] if len(own) <= _MATES else []

    def even(self, i: int) -> bool:
        """Whether the route of an edge is to be its own reflection."""
        return self.images.of.get(i, -1) == i

    def both(self, i: int) -> tuple[int, ...]:
        """An edge and its mirror image, if it has one."""
        other = self.images.of.get(i, i)
        return (i,) if other == i else (i, other)

    def entered(self, i: int, route: Route) -> int:
        """How many frames a route enters that hold neither end of this edge."""
        line, foreign = polylines([route]), self.walls.foreign(self.edges[i].source, self.edges[i].target)
        return int(meet(line.a, line.b, self.rects[foreign]).any(axis=0).sum())

    def too_close(self, i: int, route: Route) -> float:
        """By how much a route of this edge is too close to a foreign disc, if it is more than 0."""
        return TOUCH + _SLACK - self.obstacles.clearance(route, (self.edges[i].source, self.edges[i].target))

    def draw(self, i: int, route: Route) -> None:
        """Give an edge another route, and its mirror image the reflection of it."""
        self._draw(i, route)
        for other in self.both(i)[1:]:
            self._draw(other, self.images.reflected(route, self.edges[other], self.centres))

    def _draw(self, i: int, route: Route) -> None:
        self.routes[i], line = route, polylines([route])
        self._lines = self._lines.replaced(self._line[i], line)
        self._seen[:, self._line[i]] = line.arrive(_AT)[0], line.leave(_AT)[0]
        (cells, _), others = line.cells(), self.cell_edges != i
        edges = np.full(len(cells), i, dtype=np.int64)
        self._enter(np.append(self.cells[others], cells), np.append(self.cell_edges[others], edges))

    def _enter(self, cells: IntArray, edges: IntArray) -> None:
        """Note which cells are taken, and by which edges, in order."""
        order = np.argsort(cells, kind="stable")
        self.cells, self.cell_edges = cells[order], edges[order]

    def others(self, edges: Sequence[int], own: tuple[int, int]) -> tuple[FloatArray, FloatArray, BoolArray]:
        """(k, 2) and (k, 2) the segments of all lines but those of some edges, and which of them (k,) belong to lines
        from or to either of two neurons."""
        lines, foreign = self._lines, ~np.isin(self._edge_of, edges)
        chosen = np.flatnonzero(foreign[lines.owner])
        kin: BoolArray = np.any(np.isin(self._ends_of, own), axis=1).repeat(np.diff(lines.starts) - 1)
        return lines.a[chosen], lines.b[chosen], kin[chosen]

    def free_cells(self, edges: Sequence[int]) -> IntArray:
        """The cells that are taken by others than these edges, in order."""
        others = np.ones(len(self.cells), dtype=np.bool_)
        for edge in edges:
            others &= self.cell_edges != edge
        return self.cells[others]

    def ends(self, neuron: int, but: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """(k, 2) and (k,) where the ends at a neuron are seen, and which of them leave (1) or arrive (0)."""
        found = [(line, leaves) for line, leaves in self._at.get(neuron, ()) if self._edge_of[line] not in but]
        lines, leaves = np.array(found, dtype=np.int64).reshape(-1, 2).T
        return self._seen[leaves, lines], leaves.astype(np.float64)


class RouteCost:
    """What routes cost that one edge may have."""

    def __init__(self, drawn: Drawn, edge: int) -> None:
        self._drawn, self.edge, self.route = drawn, edge, drawn.routes[edge]
        self._present = polylines([self.route])
        self._own = drawn.edges[edge].source, drawn.edges[edge].target
        self._far = max(distance(self.route[0], self.route[-1]), 1e-9)
        # what leads to its own level runs back whatever way it takes
        self._onward = abs(self.route[0][1] - self.route[-1][1]) >= _ONWARD
        self._reflect = len(drawn.both(edge)) > 1
        #: which ends are on the axis, where the route and its image meet
        self._on_axis = [self._reflect and 2 * drawn.centres[neuron][0] == drawn.images.twice for neuron in self._own]
        both = drawn.both(edge)
        self._a, self._b, kin = drawn.others(both, self._own)
        self._weight: FloatArray = np.where(kin, _CROSSING + _KIN, _CROSSING)
        self._cells = drawn.free_cells(both)
        mates = drawn.mates(edge, both)
        self._mates = polylines(mates) if mates else None
        self._ends = [(leaves, *drawn.ends(n, both)) for n, leaves in zip(self._own, (True, False), strict=True)]
        walls = drawn.walls
        foreign = walls.foreign(*self._own)
        self._margins: FloatArray = walls.rects[foreign]
        self._foreign: FloatArray = drawn.rects[foreign]
        self._discs: FloatArray = np.delete(drawn.discs, self._own, axis=0)
        crossed = float(polylines([straight(self.route[0], self.route[-1])]).crossed(self._a, self._b, self._weight)[0])
        #: what crossings cost in the crowd that there is
        self._price = min(1.0, _CROWDED * self._far / max(crossed, 1e-9))

    def trespasses(self, route: Route) -> bool:
        """Whether a route enters more foreign frames than the present one, is too close to a disc by more, both
        measured exactly and of its mirror image as well, or crosses more; an arc between images goes to its side,
        whatever it crosses."""
        drawn = self._drawn
        for edge in drawn.both(self.edge):
            now, then = drawn.routes[edge], route
            if edge != self.edge:
                then = drawn.images.reflected(route, drawn.edges[edge], drawn.centres)
            entered, close = drawn.entered(edge, then), drawn.too_close(edge, then)
            if (entered and entered > drawn.entered(edge, now)) or (close > 0 and close > drawn.too_close(edge, now)):
                return True
        return not drawn.even(self.edge) and self._crossed(polylines([route])) > self._crossed(self._present)

    def _crossed(self, line: Polylines) -> float:
        return float(line.crossed(self._a, self._b)[0])

    def cost(self) -> float:
        """The cost of the edge's present route."""
        found = self.cheapest(self._present, np.inf)
        return found[1] if found is not None else np.inf

    def whole(self, route: Route) -> Route:
        """A route as the edge may have it: its own reflection, where it is to be that."""
        return self._drawn.images.even(route) if self._drawn.even(self.edge) else route

    def line(self, line: tuple[Point, ...]) -> tuple[Point, ...]:
        """A line as the edge may have it: its own reflection, where it is to be that."""
        return self._drawn.images.even_line(line) if self._drawn.even(self.edge) else line

    def cheapest(self, lines: Polylines, limit: float, most: int | None = None) -> tuple[int, float] | None:
        """The cheapest of these lines and its cost, if that is below the limit; no more than so many are checked
        closely, those first that are cheap by themselves."""
        return next(iter(self.cheaper(lines, limit, most)), None)

    def cheaper(self, lines: Polylines, limit: float, most: int | None = None) -> list[tuple[int, float]]:
        """Those of these lines that cost less than the limit, and what they do, the cheapest first; no more than so
        many are checked closely, those that are cheap by themselves."""
        costs = self._by_itself(lines)
        chosen = np.flatnonzero(costs < limit)
        chosen = chosen[np.argsort(costs[chosen], kind="stable")][:most]
        costs, lines = costs[chosen], lines.some(chosen)
        for add in (self._in_the_way, self._beside, self._among_others):
            near = costs < limit
            if not near.any():
                return []
            if 2 * int(near.sum()) < len(near):  # less work than to weigh them all
                chosen, costs, lines = chosen[near], costs[near], lines.some(np.flatnonzero(near))
            costs += add(lines)
        order = [k for k in np.argsort(costs, kind="stable").tolist() if costs[k] < limit]
        return [(int(chosen[k]), float(costs[k])) for k in order]

    def _by_itself(self, lines: Polylines) -> FloatArray:
        """(n,) what they cost whatever there is around them."""
        (low, high), (bends, tight), lengths = lines.extents(), lines.bends(), lines.lengths()
        outside = np.maximum(self._drawn.low - low, 0.0) + np.maximum(high - self._drawn.high, 0.0)
        cost = _LONGER * lengths + _RATIO * (lengths / self._far - 1) + BENDING * bends + _TIGHT * tight
        cost += _OUTSIDE * (outside[:, 0] + outside[:, 1])
        if self._onward:
            cost += _BACK * lines.backward()
        return cost

    def _in_the_way(self, lines: Polylines) -> FloatArray:
        """(n,) what the discs and frames cost that they come close to or enter."""
        clear = lines.clearances(self._discs, REACH)
        grazing, entering = lines.enter(self._margins), lines.enter(self._foreign)
        cost: FloatArray = _NEARING * (REACH - clear) + _GRAZING * grazing.astype(np.float64)
        cost += ENTERING * (entering.astype(np.float64) + (clear < TOUCH + _SLACK))
        return cost

    def _beside(self, lines: Polylines) -> FloatArray:
        """(n,) what it costs to meet others at a disc, and to run on those between the same ends."""
        cost = np.zeros(len(lines))
        both = lines.leave(_AT), lines.arrive(_AT)
        for (leaves, places, kinds), here, on_axis in zip(self._ends, both, self._on_axis, strict=True):
            if on_axis:
                cost += _together(
                    np.abs(2 * here[:, 0] - self._drawn.images.twice), np.ones(len(lines), dtype=np.bool_)
                )
            away = here[:, None, :] - places[None, :, :]
            cost += _together(np.sqrt((away * away).sum(axis=2)), kinds == leaves).sum(axis=1)
        if self._mates is not None:
            cost += _SAME * lines.on(self._mates) + self._drawn.astray(self.edge, lines)
        return cost

    def _among_others(self, lines: Polylines) -> FloatArray:
        """(n,) what it costs to run on others and to cross them, their own images among them."""
        cells, owner = lines.cells()
        cost: FloatArray = lines.crossed(self._a, self._b, self._weight)
        cost += ALONG * STEP * np.bincount(owner[_among(cells, self._cells)], minlength=len(lines))
        cost *= self._price
        if self._reflect:
            (low, high), axis = lines.extents(), self._drawn.images.twice / 2
            # only what reaches over the axis meets its own image
            over = np.flatnonzero((low[:, 0] <= axis) & (high[:, 0] >= axis))
            if len(over):
                some = lines.some(over)
                images = some.reflected(self._drawn.images.twice)
                cost[over] += ALONG * STEP * some.shared(images)
                for k, line in enumerate(over.tolist()):
                    one, own = some.some(np.array([k], dtype=np.int64)), images.owner == k
                    cost[line] += _CROSSING * float(one.crossed(images.a[own], images.b[own])[0])
        return cost


def _among(cells: IntArray, some: IntArray) -> BoolArray:
    """(k,) which cells are among some others, which are in order."""
    if not len(some):
        return np.zeros(len(cells), dtype=np.bool_)
    found: BoolArray = some[np.minimum(np.searchsorted(some, cells), len(some) - 1)] == cells
    return found


def _together(far: FloatArray, alike: BoolArray | np.bool_) -> FloatArray:
    """What it costs two ends so far apart to be at one disc, whether both leave or arrive, or one does either."""
    beside: FloatArray = np.maximum(1 - far / _APART, 0.0) * np.where(alike, _BESIDE, _MEETING)
    cost: FloatArray = beside + _ARRIVING * ((far < _CLOSE) & ~alike)
    return cost


def _border_cells(rects: FloatArray) -> IntArray:
    """The cells along the borders of frames, which are lines like others, in order."""
    routes: list[Route] = []
    for rect in rects.tolist():
        for by in (-_BESIDE_BORDER, 0.0, _BESIDE_BORDER):
            x0, y0, x1, y1 = padded(rect, by)
            # cells leave the ends of lines out
            routes += [straight((x0 - END, y), (x1 + END, y)) for y in (y0, y1)]
            routes += [straight((x, y0 - END), (x, y1 + END)) for x in (x0, x1)]
    return distinct(polylines(routes).cells()[0]) if routes else np.zeros(0, dtype=np.int64)
