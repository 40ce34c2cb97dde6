"""Frame routing: where all that is in a frame stands, and the connections between that.

In: places that have settled, the frames inside, the plan's waypoints. Out: Standing, and from that a Drawing, with a
route for each connection that is in no frame inside; routes of mirror images are reflections of each other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from neurovis_layouts.frame import across_of
from neurovis_layouts.label_room import covered, flipped, sides_of
from neurovis_layouts.layered.component_layout import ComponentLayout
from neurovis_layouts.layered.drawing import Drawing, entitled
from neurovis_layouts.layered.pinning import Settled
from neurovis_layouts.layered.units import Unit
from neurovis_layouts.routing import RoutePlan, Surroundings, Waypoint, route_all
from neurovis_layouts.routing.bows import unhindered
from neurovis_layouts.routing.corners import smooth
from neurovis_layouts.routing.ends import Key, keys_of
from neurovis_layouts.routing.images import images_of
from neurovis_layouts.routing.obstacles import REACH, Obstacles
from neurovis_spec.layout.frames import BOX_DOWN, PAD_LABEL, SLACK, entered
from neurovis_spec.layout.geometry import Rect, bounds, distance, meet, padded, snap, snapped, united
from neurovis_spec.layout.labels import BOX_WEIGHT, title_room
from neurovis_spec.layout.model import (
    GRID,
    RADIUS,
    LayoutEdge,
    LayoutProblem,
    Point,
    Route,
    Side,
)

#: How much of the corners of a line from band to band is cut off.
_CUT = 3.0


@dataclass(frozen=True, slots=True)
class Standing:
    """Where neurons, frames and boxes stand, before a connection is drawn between frames: routes cost most, and what
    stands in a box can be told without them."""

    problem: LayoutProblem
    plan: ComponentLayout
    rests: Settled
    units: Sequence[Unit]
    #: the frames of parts, of what is in them, and of columns
    frames: tuple[tuple[tuple[int, ...], Rect], ...]
    #: boxes that are no frames
    boxes: tuple[tuple[tuple[int, ...], Rect], ...]
    #: the line round the neurons of each of the problem's boxes; where labels stand
    lined: Sequence[Rect]
    #: where labels stand, and what they cover with the air that a frame leaves them
    sides: Sequence[Side | None]
    labels: Mapping[int, Rect]

    @classmethod
    def of(
        cls,
        problem: LayoutProblem,
        plan: ComponentLayout,
        rests: Settled,
        units: Sequence[Unit],
        columns: AbstractSet[int],
    ) -> Standing:
        """What has settled, with its frames."""
        places = rests.places
        sides = [plan.sides.get(i, side) for i, side in enumerate(sides_of(problem))]
        for piece, move in rests.pieces:
            for member, side in zip(piece.part.members, piece.drawing.sides, strict=True):
                sides[member] = flipped(side, across_of(problem.direction)) if side and move.mirrored else side
        lined = [_box(problem, places, sides, name, own) for name, own in problem.boxes]
        frames: list[tuple[tuple[int, ...], Rect]] = []
        boxes: list[tuple[tuple[int, ...], Rect]] = []
        for piece, move in rests.pieces:
            part = piece.part
            for found, inner in ((frames, piece.drawing.frames), (boxes, piece.drawing.boxes)):
                found += [(tuple(part.members[m] for m in own), move.rect(rect)) for own, rect in inner]
            if piece.framed:
                frames.append((part.members, move.rect(piece.rect)))
        frames += [(problem.boxes[i][1], lined[i]) for i in sorted(columns)]
        done = {frozenset(own) for own, _ in (*frames, *boxes)}
        centres = np.array(places, dtype=np.float64).reshape(-1, 2)
        boxes += [
            (own, lined[i])
            for i, (_, own) in enumerate(problem.boxes)
            if frozenset(own) not in done and not entered(centres, lined[i], own)  # none is drawn round a stranger
        ]
        return cls(
            problem,
            plan,
            rests,
            units,
            tuple(frames),
            tuple(boxes),
            lined,
            sides,
            covered(problem, places, sides, range(len(places))),
        )

    def entered(self, box: int, members: Sequence[int]) -> bool:
        """Whether a disc or a label stands, or a frame reaches, where the line round the neurons of a box is drawn."""
        own, places, line = set(members), self.rests.places, self.lined[box]
        x0, y0, x1, y1 = padded(line, RADIUS - SLACK)
        if any(x0 < x < x1 and y0 < y < y1 for i, (x, y) in enumerate(places) if i not in own):
            return True
        if any(meet(line, rect) for i, rect in self.labels.items() if i not in own):
            return True
        return any(not own & set(inside) and meet(line, rect) for inside, rect in self.frames)

    def joined(self, pair: Mapping[int, int], routed: bool) -> Drawing:
        """Neurons, what is within frames, and, where they are to be ``routed``, the connections between them."""
        problem, places = self.problem, self.rests.places
        routes: dict[Key, Route] = {}
        keys = keys_of(problem.edges)
        known = set(keys)
        for piece, move in self.rests.pieces:
            members = piece.part.members
            for (a, b, number), route in piece.drawing.routes.items():
                key = members[a], members[b], number
                if key in known:
                    ends = places[key[0]], places[key[1]]
                    routes[key] = (ends[0], *move.route(route)[1:-1], ends[1])
        if problem.pins:  # which may have put somebody on them
            over = Obstacles(places).run_over(list(routes.values()), [key[:2] for key in routes])
            routes = {key: route for (key, route), on in zip(routes.items(), over, strict=True) if not on}
        if routed:
            routes.update(_linked(self, pair, keys, routes))
        axis = self.rests.axis if pair else None
        upright = bool(problem.plan and pair) or any(piece.drawing.upright for piece, _ in self.rests.pieces)
        return Drawing(
            tuple(places),
            routes,
            self.frames,
            self.boxes,
            axis,
            bool(problem.pins),
            upright,
            problem.direction,
            tuple(self.sides),
            tuple(self.labels.values()),
            problem.title,
        )


def _box(
    problem: LayoutProblem, places: Sequence[Point], sides: Sequence[Side | None], name: str, members: Sequence[int]
) -> Rect:
    rect = padded(bounds([places[m] for m in members]), BOX_DOWN)
    rect = united([rect, *covered(problem, places, sides, members).values()])
    x0, y0, x1, y1 = entitled(rect, title_room(name, BOX_WEIGHT), problem.direction)
    return snap(x0), snap(y0), snap(x1), snap(y1)


def _linked(
    standing: Standing, pair: Mapping[int, int], keys: Sequence[Key], known: Mapping[Key, Route]
) -> dict[Key, Route]:
    """Routes by key of the edges, which have these ``keys``, that are not ``known`` from within the frames. Boxes are
    drawn, though nothing had to make room for them; to routes a label is the frame of its neuron."""
    problem, plan, rests = standing.problem, standing.plan, standing.rests
    links = [i for i, key in enumerate(keys) if key not in known]
    edges, own = [problem.edges[i] for i in links], [keys[i] for i in links]
    labels = [padded(rect, -PAD_LABEL) for rect in standing.labels.values()]
    names = [(frozenset([i]), rect) for i, rect in zip(standing.labels, labels, strict=True)]
    framed = [*((frozenset(members), rect) for members, rect in (*standing.frames, *standing.boxes)), *names]
    # between cells of a page, all ways are as good
    bowed = unhindered(edges, rests.places, frames=framed) if problem.plan else _bowed(edges, standing.units)
    route_plan = RoutePlan(
        waypoints=_waypoints(standing, links),
        bowed=frozenset(bowed),
        begun=_begun(standing, links, labels),
        images=images_of(own, rests.places, pair, rests.axis),
        # what has all waypoints that it needs from the plan keeps them
        firm={k for k, i in enumerate(links) if i in plan.firm} if standing.frames and not rests.moved else frozenset(),
    )
    routes = route_all(edges, rests.places, route_plan, Surroundings(framed, list(known.values())))
    return {key: snapped(route) for key, route in zip(own, routes, strict=True)}


def _as_planned(standing: Standing, links: Sequence[int]) -> Iterator[tuple[int, int, LayoutEdge]]:
    """Of these edges those whose ends both stand where the plan has them: the place in ``links``, the number, the
    edge."""
    for k, i in enumerate(links):
        edge = standing.problem.edges[i]
        if standing.rests.moved.isdisjoint((edge.source, edge.target)):
            yield k, i, edge


def _waypoints(standing: Standing, links: Sequence[int]) -> dict[int, list[Waypoint]]:
    """The plan's waypoints, from source to target, by place in ``links``."""
    plan, (dx, dy) = standing.plan, standing.rests.shift
    found: dict[int, list[Waypoint]] = {}
    for k, i, edge in _as_planned(standing, links):
        if i in plan.ways:
            passing = [Waypoint(way.x + dx, way.y + dy, way.half) for way in plan.ways[i]]
            found[k] = passing if plan.places[edge.source][1] < plan.places[edge.target][1] else passing[::-1]
    return found


def _begun(standing: Standing, links: Sequence[int], labels: Sequence[Rect]) -> dict[int, Route]:
    """The routes from band to band, by place in ``links``."""
    plan, places, (dx, dy) = standing.plan, standing.rests.places, standing.rests.shift
    found: dict[int, Route] = {}
    for k, i, edge in _as_planned(standing, links):
        if i in plan.cut:
            between = [(x + dx, y + dy) for x, y in plan.cut[i]]
            found[k] = _cut([places[edge.source], *between, places[edge.target]], places, labels)
    return found


def _cut(line: list[Point], places: Sequence[Point], labels: Sequence[Rect]) -> Route:
    """The route along a line from band to band; an end that has nothing between it and the street, and no label in the
    way, is left straight for that."""
    for _ in range(2):  # from either end
        aslant = _aslant(line)
        beside = any(_beside(place, line[0], line[2][0]) for place in places)
        if not beside and not any(meet(rect, bounds([line[0], aslant])) for rect in labels):
            line = [line[0], aslant, *line[3:]]
        line = line[::-1]
    apart = [a for a, b in pairwise(line) if distance(a, b) > GRID]
    return smooth([*apart, line[-1]], _CUT)


def _beside(place: Point, start: Point, street: float) -> bool:
    """Whether something stands between a neuron and the street."""
    low, high = sorted((start[0], street))
    return low < place[0] < high and abs(place[1] - start[1]) < 2 * REACH


def _aslant(line: Sequence[Point]) -> Point:
    """Where a line meets that through its third and fourth points by half a right angle, no farther on than halfway."""
    (x, y), turn, end = line[0], line[2], line[3]
    far = min(abs(turn[0] - x), abs(end[1] - y) / 2)
    return turn[0], y + (far if end[1] > y else -far)


def _bowed(edges: Sequence[LayoutEdge], units: Sequence[Unit]) -> frozenset[int]:
    """Edges within a block that is no frame."""
    block = {
        m: k for k, unit in enumerate(units) if unit.places is not None and unit.reach is None for m in unit.members
    }
    return frozenset(i for i, e in enumerate(edges) if e.source in block and block[e.source] == block.get(e.target))
