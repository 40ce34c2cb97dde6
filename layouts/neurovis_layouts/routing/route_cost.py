"""Judge: what a route costs: how hard it is to follow by eye among all that is drawn.

In: all routes, the neurons, the frames. Out: one number for a route, higher for each disc or frame that it runs over,
for crossings, for running along other lines, for length and bends, and for ends close to others at a disc.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from neurovis_layouts.routing.corners import reflected
from neurovis_layouts.routing.ends import by_ends
from neurovis_layouts.routing.obstacles import REACH, TOUCH, Obstacles
from neurovis_layouts.routing.polylines import END, STEP, Polylines, polylines
from neurovis_layouts.routing.walls import Frame, Walls, meet
from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.geometry import distance, padded, straight
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
#: To run back a unit along the direction, where the route did not: more than two crossings, since the direction is what
#: is read first (nothing that was measured became worse; a test holds that no line turns back for a crossing).
_BACK = 3.0
#: To lead a unit beyond all that is drawn: two units are a crossing (without: 1 % more line, around everything).
_OUTSIDE = 0.5

#: More connections between two neurons than this have no room to be told apart, nor have more ends at a disc.
_MATES, _ENDS = 12, 12
#: Where so much more of a route than may runs on another between the same ends, it is drawn anew.
_RUN_ON = 0.1
#: So does what runs on any others for this part of its way, and as far as this.
_PART, _STRETCH = 0.4, 0.5
#: Closer than this an arrival and a departure are one line, and two ends of a kind, where there are few at a disc.
_CLOSE, _ONE, _FEW_ENDS = 0.13, 0.07, 8
#: What is this close to a disc may be measured to run over it.
_SLACK = 0.02
#: How far off a foreign frame lines stay, at least: it may grow by what is drawn in it.
OFF = 0.06
#: How far beyond discs and frames a line may lead for nothing; how far back along the direction.
_MARGIN, _ONWARD = 0.8, 0.05
#: What runs so far along borders is drawn anew where it can be; to pass some aslant takes less.
_RUN = 2.0
#: So close to a border a line is one with it.
_BESIDE_BORDER = 0.08
#: How far from a centre ends are checked, how far apart they are to be.
_AT, _APART = 0.45, 0.16


class Judge:
    """All that is drawn: ``routes`` by edge index, and others, which stay. ``image`` are mirror images of edges, of
    which only one has to be drawn; the axis is at half of ``twice``."""

    def __init__(
        self,
        edges: Sequence[LayoutEdge],
        centres: Sequence[Point],
        routes: Mapping[int, Route],
        frames: Sequence[Frame] = (),
        drawn: Sequence[Route] = (),
        image: Mapping[int, int] | None = None,
        twice: float = 0.0,
    ) -> None:
        self.edges, self.centres, self.twice = edges, centres, twice
        self.routes: dict[int, Route] = dict(routes)
        self._image = dict(image or {})
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
        borders = np.full(len(self._borders), -1, dtype=np.int64)
        self._enter(np.concatenate([cells, self._borders]), np.concatenate([self._edge_of[owner], borders]))

    def winding(self) -> dict[int, tuple[float, float]]:
        """How much each route bends, and by which factor it is longer than the straight way."""
        lengths, (bends, _) = self._lines.lengths().tolist(), self._lines.bends()
        return {
            i: (bend, length / max(distance(self.routes[i][0], self.routes[i][-1]), 1e-9))
            for i, bend, length in zip(self._line, bends.tolist(), lengths, strict=False)
        }

    def through_loops(self) -> set[int]:
        """The edges whose routes run through a connection of a neuron to itself."""
        first, last = self._ends_of[self._lines.owner].T
        loops = (first == last) & (first >= 0)
        crossed = self._lines.crossed(self._lines.a[loops], self._lines.b[loops])
        return {i for i, times in zip(self._line, crossed.tolist(), strict=False) if times}

    def along_borders(self) -> set[int]:
        """The edges whose routes run along the border of a frame, so that both are one line."""
        if not len(self._borders):
            return set()
        cells, owner = self._lines.cells()
        along = self._borders[np.minimum(np.searchsorted(self._borders, cells), len(self._borders) - 1)] == cells
        far = STEP * np.bincount(owner[along], minlength=len(self._lines))
        return {i for i, by in zip(self._line, far.tolist(), strict=False) if by > _RUN}

    def in_fans(self, most: int) -> set[int]:
        """The edges of which more than so many share both ends, in either direction."""
        return {i for fan in self._between.values() if len(fan) > most for i in fan}

    def on_others(self) -> set[int]:
        """The edges whose routes run on one between the same ends, or for a good part of their way on any."""
        drawn = self.cell_edges >= 0
        cells, many = self.cells[drawn], max(self.routes, default=0) + 1
        number = np.cumsum(np.append(False, cells[1:] != cells[:-1]))[: len(cells)]
        # each edge once in a cell
        places = np.sort(number * many + self.cell_edges[drawn], kind="stable")
        cell, edge = np.divmod(places[np.append(True, places[1:] != places[:-1])[: len(places)]], many)
        shared = np.zeros(len(cell), dtype=np.bool_)
        shared[1:] |= cell[1:] == cell[:-1]
        shared[:-1] |= cell[1:] == cell[:-1]
        total, beside = np.bincount(edge), np.bincount(edge, shared)
        along = np.flatnonzero((beside > _PART * total) & (beside * STEP > _STRETCH)).tolist()
        full = {neuron for neuron, ends in self._at.items() if len(ends) > _ENDS}
        found = {i for i in along if full.isdisjoint((self.edges[i].source, self.edges[i].target))}
        for mates in self._between.values():
            for i in mates if len(mates) <= _MATES else ():
                others = [self._line[k] for k in mates if k not in self.both(i)]
                own = self._lines.some(np.array([self._line[i]]))
                if others and own.on(self._lines.some(np.array(others)))[0] > _RUN_ON:
                    found.add(i)
        return found

    def meeting(self) -> dict[int, set[bool]]:
        """The edges whose routes arrive at a disc where another leaves it, or end where one does, each with which of
        its ends does."""
        found: dict[int, set[bool]] = {}
        for ends in self._at.values():
            if len(ends) > _ENDS:
                continue
            lines, leaves = np.array(ends, dtype=np.int64).T
            places, edges = self._seen[leaves, lines], self._edge_of[lines].tolist()
            x, y = (places[:, None] - places).transpose(2, 0, 1)
            least = np.where(leaves[:, None] != leaves, _CLOSE, _ONE if len(ends) <= _FEW_ENDS else 0.0)
            for k, other in np.argwhere(x * x + y * y < least * least).tolist():
                if edges[k] != edges[other]:
                    found.setdefault(edges[k], set()).add(ends[k][1])
        return found

    def mates(self, i: int, but: Sequence[int]) -> list[Route]:
        """The routes between the same ends as that of an edge, ``but`` for some."""
        own = self._between[frozenset((self.edges[i].source, self.edges[i].target))]
        return [self.routes[k] for k in own if k not in but] if len(own) <= _MATES else []

    def both(self, i: int) -> tuple[int, ...]:
        """An edge and its mirror image, if it has one."""
        other = self._image.get(i, i)
        return (i,) if other == i else (i, other)

    def draw(self, i: int, route: Route) -> None:
        """Give an edge another route, and its mirror image the reflection of it."""
        self._draw(i, route)
        for other in self.both(i)[1:]:
            ends = self.centres[self.edges[other].source], self.centres[self.edges[other].target]
            self._draw(other, reflected(route, self.twice, *ends))

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


class Pen:
    """Judges routes for one edge."""

    def __init__(self, judge: Judge, edge: int, but: Sequence[int] = (), arriving: float = 0.0) -> None:
        """What is drawn of edges ``but`` for this one does not matter. ``arriving`` is what it costs to be one line
        with what arrives where it leaves, or leaves where it arrives."""
        self._arriving = arriving
        self._judge, self.route = judge, judge.routes[edge]
        self._own = judge.edges[edge].source, judge.edges[edge].target
        self._far = max(distance(self.route[0], self.route[-1]), 1e-9)
        # what leads to its own level runs back whatever way it takes
        level = abs(self.route[0][1] - self.route[-1][1]) < _ONWARD
        self._onward = not level and float(polylines([self.route]).backward()[0]) < _ONWARD
        self._reflect = len(judge.both(edge)) > 1
        both = [*judge.both(edge), *but]
        self._a, self._b, kin = judge.others(both, self._own)
        self._weight: FloatArray = np.where(kin, _CROSSING + _KIN, _CROSSING)
        self._cells = judge.free_cells(both)
        mates = judge.mates(edge, both)
        self._mates = polylines(mates) if mates else None
        self._ends = [(leaves, *judge.ends(n, both)) for n, leaves in zip(self._own, (True, False), strict=True)]
        walls = judge.walls
        foreign = walls.foreign(*self._own)
        self._margins: FloatArray = walls.rects[foreign]
        self._foreign: FloatArray = judge.rects[foreign]
        self._discs: FloatArray = np.delete(judge.discs, self._own, axis=0)

    def trespass(self, route: Route) -> tuple[int, float]:
        """How many foreign frames a route enters, and by how much it is too close to a disc, both measured exactly."""
        lines = polylines([route])
        entered = int(meet(lines.a, lines.b, self._foreign).any(axis=0).sum())
        return entered, max(0.0, TOUCH + _SLACK - self._judge.obstacles.clearance(route, self._own))

    def cost(self) -> float:
        """The cost of the edge's present route."""
        found = self.cheapest(polylines([self.route]), np.inf)
        return found[1] if found is not None else np.inf

    def costs(self, routes: Sequence[Route]) -> FloatArray:
        """(n,) the cost of each of these routes."""
        lines = polylines(routes)
        return self._by_itself(lines) + self._in_the_way(lines) + self._beside(lines) + self._across(lines)

    def cheapest(self, lines: Polylines, limit: float, most: int | None = None) -> tuple[int, float] | None:
        """The cheapest of these lines and its cost, if that is below the limit; no more than so many are checked
        closely, those first that are cheap by themselves."""
        costs = self._by_itself(lines)
        chosen = np.flatnonzero(costs < limit)
        chosen = chosen[np.argsort(costs[chosen], kind="stable")][:most]
        costs, lines = costs[chosen], lines.some(chosen)
        for add in (self._in_the_way, self._beside, self._across):
            if not len(chosen):
                return None
            costs += add(lines)
            near = np.flatnonzero(costs < limit)
            if len(near) < len(chosen):
                chosen, costs, lines = chosen[near], costs[near], lines.some(near)
        if not len(chosen):
            return None
        least = int(np.argmin(costs))
        return int(chosen[least]), float(costs[least])

    def _by_itself(self, lines: Polylines) -> FloatArray:
        """(n,) what they cost whatever there is around them."""
        (low, high), (bends, tight), lengths = lines.extents(), lines.bends(), lines.lengths()
        outside = np.maximum(self._judge.low - low, 0.0) + np.maximum(high - self._judge.high, 0.0)
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
        """(n,) what it costs to meet others at a disc and to run on them."""
        cost = np.zeros(len(lines))
        for (leaves, places, kinds), here in zip(self._ends, (lines.leave(_AT), lines.arrive(_AT)), strict=True):
            away = here[:, None, :] - places[None, :, :]
            far, alike = np.sqrt((away * away).sum(axis=2)), kinds == leaves
            cost += (np.maximum(1 - far / _APART, 0.0) * np.where(alike, _BESIDE, _MEETING)).sum(axis=1)
            cost += self._arriving * ((far < _CLOSE) & ~alike).sum(axis=1)
        if self._mates is not None:
            cost += _SAME * lines.on(self._mates)
        cells, owner = lines.cells()
        if len(self._cells):
            there = self._cells[np.minimum(np.searchsorted(self._cells, cells), len(self._cells) - 1)] == cells
            cost += ALONG * STEP * np.bincount(owner[there], minlength=len(lines))
        return cost

    def _across(self, lines: Polylines) -> FloatArray:
        """(n,) what it costs to cross others."""
        cost = lines.crossed(self._a, self._b, self._weight)
        if self._reflect:
            (low, high), axis = lines.extents(), self._judge.twice / 2
            flip, shift = np.array([-1.0, 1.0]), np.array([self._judge.twice, 0.0])
            # only what reaches over the axis meets its own image
            for k in np.flatnonzero((low[:, 0] <= axis) & (high[:, 0] >= axis)).tolist():
                one = lines.some(np.array([k], dtype=np.int64))
                cost[k] += _CROSSING * float(one.crossed(one.a * flip + shift, one.b * flip + shift)[0])
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
    return np.unique(polylines(routes).cells()[0]) if routes else np.zeros(0, dtype=np.int64)
