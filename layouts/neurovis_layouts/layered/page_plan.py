"""Page plan: a network on the plan of a body or a cortical sheet, in rows and columns of the page (``layout.plan``).

In: a problem whose cells say what stands in which row and column, and how a part of it is drawn in a direction. Out:
parts, each drawn in the direction in which it faces what it is connected to, and where each of them stands. What no
cell names is placed behind the cell that it has most connections with. Mirror images stand in mirrored columns.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TypeAlias

import numpy as np

from neurovis_layouts.alike import Move, shifted_by
from neurovis_layouts.frame import from_picture, to_picture
from neurovis_layouts.layered.drawing import Drawing, Piece
from neurovis_layouts.layered.page_cost import PageCost
from neurovis_layouts.layered.parts import Part, imaged, part_of_module, symmetric
from neurovis_layouts.layered.plan_places import Footprint, PlanPlaces, Slot, footprint
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import Rect, united
from neurovis_spec.layout.model import Direction, LayoutProblem, LayoutRefusalError, Point, Seat

#: A part drawn in a direction, with the frame around it.
Drawn = Callable[[Part, Direction], Piece]

_Members: TypeAlias = tuple[int, ...]
#: Rounds in which each part may turn to face the others; after the second hardly any does.
_ROUNDS = 3
_DIRECTIONS: tuple[Direction, ...] = ("down", "up", "right", "left")
#: A difference that is rounding.
_NOTHING = 1e-9
_OPPOSITE: Mapping[Direction, Direction] = {"down": "up", "up": "down", "right": "left", "left": "right"}


def parts_by_cell(problem: LayoutProblem, pair: Mapping[int, int]) -> tuple[list[Part], dict[int, int]]:
    """What the cells hold, and what no cell names (instances, boxes, neurons of one group), with the cell in which each
    part stands, the number behind the last being a row below all. Mirror images are marked as such, and come last."""
    seats = _seats(problem, pair)
    outer = {m.members: i for i, m in enumerate(problem.modules) if m.parent < 0}
    boxes = {members: i for i, (_, members) in enumerate(problem.boxes)}
    found = [
        part_of_module(problem, outer[own]) if own in outer else Part(own, box=boxes.get(own, -1)) for own in seats
    ]
    parts = imaged(sorted(found, key=lambda part: min(part.members)), pair)
    number = {frozenset(members): seat for members, seat in seats.items()}
    return parts, {k: number[frozenset(part.members)] for k, part in enumerate(parts)}


def _seats(problem: LayoutProblem, pair: Mapping[int, int]) -> dict[_Members, int]:
    """The number of the cell in which neurons stand together. What no cell names stands with what it has most
    connections with, images in the mirrored cell; what nothing leads to, below all."""
    seat = {cell.members: i for i, cell in enumerate(problem.plan)}
    loose = _loose(problem, seat)
    owner = {m: members for members in [*seat, *loose] for m in members}
    near: dict[_Members, Counter[_Members]] = {members: Counter() for members in owner.values()}
    for edge in problem.edges:
        near[owner[edge.source]][owner[edge.target]] += 1
        near[owner[edge.target]][owner[edge.source]] += 1
    below = len(seat)
    mirrored = [_mirrored(problem, cell) for cell in range(below)]
    cells = {members: _cells(mirrored, members, pair) for members in loose}
    pulls = {members: _pull(near[members], seat, cells[members]) for members in loose}
    while pulls:
        members = max(pulls, key=lambda one: (pulls[one][0], [-m for m in one]))
        many, to = pulls.pop(members)
        seat[members] = to if many else below
        seated = [members]
        image = owner.get(pair.get(members[0], -1), members)
        if pulls.pop(image, None):
            seat[image] = mirrored[to] if many else below
            seated.append(image)
        for other in {other for one in seated for other in near[one] if other in pulls}:
            pulls[other] = _pull(near[other], seat, cells[other])
    return _together(problem, seat)


def _loose(problem: LayoutProblem, seat: Mapping[_Members, int]) -> list[_Members]:
    """What no cell names: instances, boxes, neurons, the outermost of them."""
    taken = {m for members in seat for m in members}
    found: list[_Members] = []
    for members in [
        *(m.members for m in problem.modules if m.parent < 0),
        *sorted((own for _, own in problem.boxes), key=lambda own: (-len(own), own)),
        *((m,) for m in range(len(problem.neurons))),
    ]:
        if members and taken.isdisjoint(members):
            found.append(members)
            taken.update(members)
    return found


def _cells(mirrored: Sequence[int], members: _Members, pair: Mapping[int, int]) -> frozenset[int]:
    """The cells in which something may stand that none names: what has a mirror image in those that have one, and where
    others have one what has none, or is its own, on the axis. ``mirrored`` are the images of cells."""
    if not pair:
        return frozenset(range(len(mirrored)))
    if members[0] in pair and not symmetric(members, pair):
        return frozenset(cell for cell, image in enumerate(mirrored) if image >= 0)
    return frozenset(cell for cell, image in enumerate(mirrored) if image == cell)


def _pull(near: Counter[_Members], seat: Mapping[_Members, int], cells: AbstractSet[int]) -> tuple[int, int]:
    """How many connections something has with that of the ``cells`` with which it has most, and that cell."""
    pulls: Counter[int] = Counter()
    for members, times in near.items():
        if members in seat and seat[members] in cells:
            pulls[seat[members]] += times
    best = max(pulls.values(), default=0)
    return best, min((i for i, times in pulls.items() if times == best), default=-1)


def _together(problem: LayoutProblem, seat: Mapping[_Members, int]) -> dict[_Members, int]:
    """Neurons of one group that no cell names, and that stand in one cell, stand together there."""
    group = {m: number for number, one in enumerate(problem.groups) for m in one.members}
    named = {cell.members for cell in problem.plan}
    found: dict[_Members, int] = {}
    loose: dict[tuple[int, int], list[int]] = {}
    for members, place in seat.items():
        if len(members) == 1 and members not in named and members[0] in group:
            loose.setdefault((place, group[members[0]]), []).append(members[0])
        else:
            found[members] = place
    return {**found, **{tuple(sorted(members)): place for (place, _), members in loose.items()}}


def facing(
    problem: LayoutProblem,
    parts: Sequence[Part],
    where: Mapping[int, int],
    pair: Mapping[int, int],
    sketched: Drawn,
    drawn: Drawn,
    upright: bool,
) -> list[tuple[Piece, Move]]:
    """Each part ``drawn`` in the direction, and as the mirror image, in which, as ``sketched`` without routes, the
    connections between parts are short and the page has its proportions, and where it stands. Copies of one instance
    are drawn in one direction, so that they are alike. ``upright``: nothing turns the whole upside down, and frames
    keep room for titles on their upper sides alone. Raises LayoutRefusalError where mirror images do not stand in
    mirrored cells."""
    _check_mirrors(problem, parts, where, pair)
    page = _Page(problem, parts, _slots(problem, parts, where), pair, sketched, upright)
    return page.stood(page.best(), drawn)


@dataclass(frozen=True, slots=True)
class _Shape:
    """In which direction each part is drawn, and whether as its mirror image."""

    turns: tuple[Direction, ...]
    flips: tuple[bool, ...]

    def turned(self, own: AbstractSet[int], direction: Direction) -> _Shape:
        return replace(self, turns=tuple(direction if k in own else turn for k, turn in enumerate(self.turns)))

    def flipped(self, own: AbstractSet[int]) -> _Shape:
        return replace(self, flips=tuple(flip != (k in own) for k, flip in enumerate(self.flips)))


@dataclass(frozen=True, slots=True)
class _Stance:
    """A part as it is drawn, what it takes up so, and where its neurons are (n, 2)."""

    piece: Piece
    footprint: Footprint
    places: FloatArray


class _Page:
    """Parts in their slots, to be drawn in one direction or another."""

    def __init__(
        self,
        problem: LayoutProblem,
        parts: Sequence[Part],
        slots: Sequence[Slot],
        pair: Mapping[int, int],
        sketched: Drawn,
        upright: bool,
    ) -> None:
        self._problem, self._parts, self._pair = problem, parts, pair
        self._sketched, self._upright = sketched, upright
        self._places = PlanPlaces(problem, slots, parts, _page(problem), bool(pair))
        self._sketch = cache(partial(self._stance, sketched))
        owner = {m: k for k, part in enumerate(parts) for m in part.members}
        between = [(e.source, e.target) for e in problem.edges if owner[e.source] != owner[e.target]]
        # from part to part all ways are as good
        self._page_cost = PageCost(problem, between, directed=False)
        #: parts that are copies of each other
        makes: dict[tuple[int, int], list[int]] = {}
        for k, part in enumerate(part for part in parts if part.image_of < 0):  # which come first
            makes.setdefault((part.kind, -1 if part.kind >= 0 else k), []).append(k)
        self._makes = list(makes.values())
        self._directions = {own[0]: _directions(problem, parts[own[0]], pair, sketched) for own in self._makes}
        self._column = {k: slot.across for slot in slots for line in slot.lines for k in line}
        self._cost = cache(self._cost_of)

    def best(self) -> _Shape:
        """The shape that costs least of those found from where all is drawn as it comes, or turned one way."""
        parts = self._parts
        as_drawn = _Shape((self._problem.direction,) * len(parts), tuple(part.image_of >= 0 for part in parts))
        starts = {as_drawn: None}
        for direction in _DIRECTIONS:
            may = [self._both(own) for own in self._makes if direction in self._directions[own[0]]]
            starts[as_drawn.turned(set[int]().union(*may), direction)] = None
        return min(map(self._settled, starts), key=self._cost)

    def stood(self, shape: _Shape, drawn: Drawn) -> list[tuple[Piece, Move]]:
        """The parts drawn in a shape, and where they stand."""
        stances = list(map(partial(self._stance, drawn), self._parts, shape.turns, shape.flips))
        moves = self._moves(stances)
        return [(stance.piece, moves[k]) for k, stance in enumerate(stances)]

    def _stance(self, drawn: Drawn, part: Part, turn: Direction, flip: bool) -> _Stance:
        """A part as drawn in a direction, and as the mirror image if ``flip``."""
        piece = drawn(part, turn)
        if self._upright:
            piece = piece.titled_above(flip)
        return _Stance(piece, footprint(piece, flip), np.array(piece.drawing.places))

    def _moves(self, stances: Sequence[_Stance]) -> dict[int, Move]:
        """How each part is moved, mirror images as reflections of each other."""
        moves = self._places.moves([stance.footprint for stance in stances])
        for k, part in enumerate(self._parts):
            if part.image_of >= 0:
                (dx, dy), flipped = moves[part.image_of].shift, moves[part.image_of].mirrored
                moves[k] = shifted_by((-dx + 0.0, dy), not flipped)
        return moves

    def _settled(self, shape: _Shape) -> _Shape:
        """The best that is found by turning one make of parts after the other."""
        for _ in range(_ROUNDS):
            for own in self._makes:
                for direction in self._directions[own[0]]:
                    shape = self._better(shape, self._flipped(shape.turned(self._both(own), direction), own))
        return shape

    def _flipped(self, shape: _Shape, own: Sequence[int]) -> _Shape:
        """These parts drawn as their mirror images, all of one column, where that costs less."""
        lead = self._parts[own[0]]
        if self._sketched(lead, shape.turns[own[0]]).drawing.fixed or symmetric(lead.members, self._pair):
            return shape
        for across in dict.fromkeys(self._column[k] for k in own):
            shape = self._better(shape, shape.flipped(self._both([k for k in own if self._column[k] == across])))
        return shape

    def _both(self, own: Sequence[int]) -> set[int]:
        """These parts and their mirror images."""
        return {k for k, part in enumerate(self._parts) if k in own or part.image_of in own}

    def _better(self, shape: _Shape, other: _Shape) -> _Shape:
        return other if self._cost(other) < self._cost(shape) - _NOTHING else shape

    def _cost_of(self, shape: _Shape) -> float:
        stances = list(map(self._sketch, self._parts, shape.turns, shape.flips))
        moves = self._moves(stances)
        places = np.empty((sum(len(part.members) for part in self._parts), 2))
        for k, (part, stance) in enumerate(zip(self._parts, stances, strict=True)):
            places[list(part.members)] = moves[k].shift + moves[k].flip * stance.places
        return self._page_cost(places, united(moves[k].rect(one.piece.rect) for k, one in enumerate(stances)))


def _directions(problem: LayoutProblem, part: Part, pair: Mapping[int, int], drawn: Drawn) -> tuple[Direction, ...]:
    """The directions in which a part may be drawn: one that holds mirror images of its own along the axis of the
    whole, or that of its plan, one whose module pins its neurons as they are pinned."""
    drawing = drawn(part, problem.direction).drawing
    if drawing.fixed:
        return (problem.direction,)
    if drawing.upright or symmetric(part.members, pair):
        return (problem.direction, _OPPOSITE[problem.direction])
    return _DIRECTIONS


def in_direction(drawing: Drawing, of: Direction, frame: Direction) -> Drawing:
    """A drawing made in one direction, in the frame of an engine that draws in another."""
    if of == frame:
        return drawing

    def point(p: Point) -> Point:
        return from_picture(to_picture(p, of), frame)

    def rect(r: Rect) -> Rect:
        (ax, ay), (bx, by) = point((r[0], r[1])), point((r[2], r[3]))
        return min(ax, bx), min(ay, by), max(ax, bx), max(ay, by)

    return replace(
        drawing,
        places=tuple(map(point, drawing.places)),
        routes={key: tuple(map(point, route)) for key, route in drawing.routes.items()},
        frames=tuple((own, rect(r)) for own, r in drawing.frames),
        boxes=tuple((own, rect(r)) for own, r in drawing.boxes),
        labels=tuple(map(rect, drawing.labels)),
        axis=drawing.axis if of == _OPPOSITE[frame] else None,
        direction=frame,
    )


def _slots(problem: LayoutProblem, parts: Sequence[Part], where: Mapping[int, int]) -> list[Slot]:
    """The cells with their parts, and where something stands below all, a row for that."""
    spans = [_span(problem.direction, cell.seat) for cell in problem.plan]
    held: dict[int, list[int]] = {}
    for k, place in where.items():
        held.setdefault(place, []).append(k)
    across, along = _page(problem)
    spans.append((range(across), range(along, along + 1)))
    named = {cell.members for cell in problem.plan}
    slots: list[Slot] = []
    for i, own in sorted(held.items()):
        # what no cell names is behind what one does, and mirrored cells hold theirs in one order
        own.sort(key=lambda k: (parts[k].members not in named, k if parts[k].image_of < 0 else parts[k].image_of))
        image = {parts[k].image_of: k for k in own}  # which stands beside it
        lines = tuple((k, image[k]) if k in image else (k,) for k in own if parts[k].image_of not in own)
        slots.append(Slot(*spans[i], lines))
    return slots


def _page(problem: LayoutProblem) -> tuple[int, int]:
    """How many columns across and rows along there are, empty ones among them."""
    seat = problem.plan[0].seat
    return (seat.width, seat.height) if problem.direction in ("down", "up") else (seat.height, seat.width)


def _span(direction: Direction, seat: Seat) -> tuple[range, range]:
    """The columns across and the rows along that a cell spans, in the engine's frame."""
    down, right = range(seat.row, seat.row + seat.rows), range(seat.column, seat.column + seat.columns)
    match direction:
        case "down":
            return right, down
        case "up":
            return right, range(seat.height - down.stop, seat.height - down.start)
        case "right":
            return down, right
        case "left":
            return down, range(seat.width - right.stop, seat.width - right.start)


def _mirrored(problem: LayoutProblem, cell: int) -> int:
    """The cell that is the mirror image of one; −1 without one."""
    image = problem.plan[cell].seat.image(problem.direction)
    return next((i for i, other in enumerate(problem.plan) if other.seat == image), -1)


def _check_mirrors(
    problem: LayoutProblem, parts: Sequence[Part], where: Mapping[int, int], pair: Mapping[int, int]
) -> None:
    for k, part in enumerate(parts):
        if part.image_of < 0 and not symmetric(part.members, pair):
            continue
        place = where[part.image_of if part.image_of >= 0 else k]
        if where[k] != (place if place == len(problem.plan) else _mirrored(problem, place)):
            one = problem.neurons[min(part.members)]
            raise LayoutRefusalError(
                "plan-mirror",
                f"'{one}' and its mirror image do not stand in cells of the plan that are mirror images",
                "put mirror images into one row, as far to the left as to the right of the middle",
                (one,),
            )
