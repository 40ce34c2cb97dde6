"""Pinning: from a layout without pins to final places, with the pins exact and everything else moved off them.

In: a ComponentLayout, the frames in it, pins. Out: a place for every neuron, a move for every frame. A frame with pins
is moved to them, as it is or reflected. Where they do not fit its drawing, or where that would lie on something else
that is pinned, its neurons are placed one by one around the pins, and it is drawn anew. Mirror images of pinned neurons
follow; all else is moved as a whole, and then off what is pinned (``occupancy``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from neurovis_layouts.alike import reflection
from neurovis_layouts.axes import axes, shift_of
from neurovis_layouts.frame import across_of, from_picture, to_picture
from neurovis_layouts.layered.component_layout import ComponentLayout
from neurovis_layouts.layered.drawing import FrameMove, Piece
from neurovis_layouts.layered.parts import images_of
from neurovis_layouts.occupancy import AxisSide, Body, Occupancy, Wish, instance_of, lone
from neurovis_spec.layout.frames import PAD, Frames, titled
from neurovis_spec.layout.geometry import Rect, bounds, meet, padded, shifted, snap
from neurovis_spec.layout.model import GRID, RADIUS, LayoutProblem, LayoutRefusalError, Point

_SLACK = 1e-9
#: Pinned centres of two frames are this far apart at least, but for rounding in the last bit.
_DISCS = 2 * RADIUS - 1e-9
#: How far frames should keep off each other, so that lines find a way between them.
_BETWEEN = 0.4
#: So often it is asked of each frame whether it lies less on the others when it is reflected.
_ROUNDS = 5
_HERE = (0.0, 0.0)

#: A part drawn anew, around pins of its neurons.
Redraw = Callable[[Piece, Mapping[int, Point]], Piece]


@dataclass(frozen=True, slots=True)
class Settled:
    """Places by neuron, pieces and where they are, how the plan has moved as a whole, which neurons did not simply
    follow, and the axis."""

    places: list[Point]
    pieces: list[tuple[Piece, FrameMove]]
    shift: Point = (0.0, 0.0)
    moved: frozenset[int] = frozenset()
    axis: float = 0.0


@dataclass(frozen=True, slots=True)
class _Trial:
    """What pins make of the pieces with the axis at one place: pins with their images, how the plan moves, where the
    pieces, then other neurons, would like to stand in the picture (a piece that its pins do not fit: these alone).

    Of what is pinned: whether a neuron stands among those of a frame that it is not in (``refusal``), how deep frames
    lie on other things, in all, and how much too near to others they are; the pieces that do not fit, and all that lie
    on each other.
    """

    axis: float
    pins: Mapping[int, Point]
    shift: Point
    pieces: list[Piece]
    moves: list[FrameMove]
    wishes: list[Wish]
    refusal: LayoutRefusalError | None
    depth: float
    near: float
    unfit: frozenset[int]
    crowded: frozenset[int]

    @property
    def order(self) -> tuple[bool, float, float]:
        """The less, the better."""
        return self.refusal is not None, self.depth, self.near


def settled(
    problem: LayoutProblem,
    plan: ComponentLayout,
    pieces: Sequence[tuple[Piece, FrameMove]],
    pair: Mapping[int, int],
    redraw: Redraw,
) -> Settled:
    """Where everything stands. Raises LayoutRefusalError for pins within the frame of others."""
    free = [plan.places[i] for i in range(len(problem.neurons))]
    if not problem.pins:
        return Settled(free, list(pieces))
    trial = _best(problem, free, pieces, pair, redraw)
    found = {i: from_picture(point, problem.direction) for i, point in _arranged(problem, trial, pair).items()}
    done: list[tuple[Piece, FrameMove]] = []
    for piece, move in zip(trial.pieces, trial.moves, strict=True):
        first = piece.part.members[0]
        (x, y), (dx, dy) = found[first], FrameMove(_HERE, move.flip).point(piece.drawing.places[0])
        pinned = not trial.pins.keys().isdisjoint(piece.part.members)
        done.append((piece, move if pinned else replace(move, shift=(x - dx, y - dy))))
    found.update(trial.pins)
    (dx, dy), pins = trial.shift, trial.pins
    kept = {i for i, (x, y) in enumerate(free) if found[i] == (x + dx, y + dy) and i not in pins}
    places = [found[i] for i in range(len(free))]
    return Settled(places, done, trial.shift, frozenset(range(len(free))) - kept, trial.axis)


def _best(
    problem: LayoutProblem,
    free: Sequence[Point],
    pieces: Sequence[tuple[Piece, FrameMove]],
    pair: Mapping[int, int],
    redraw: Redraw,
) -> _Trial:
    """The first place of the axis at which nothing that is pinned lies on anything else, or that at which least does;
    with frames drawn anew where pins do not fit them, and where that makes room."""
    best: _Trial | None = None
    refusal: LayoutRefusalError | None = None
    wide = 2 + max((piece.rect[2] - piece.rect[0] for piece, _ in pieces), default=0.0)
    for axis, pins in axes(problem, free, pair, wide):
        try:
            trial = _tried(problem, free, pieces, pair, axis, pins)
        except LayoutRefusalError as found:
            refusal = refusal or found
            continue
        refusal = refusal or trial.refusal
        if best is None or trial.order < best.order:
            best = trial
        if best.order == (False, 0.0, 0.0):
            break
    if best is not None and (best.unfit or best.refusal is not None or best.depth):
        try:
            bent = _bent(problem, free, best, pair, redraw)
            refusal = refusal or bent.refusal
            best = bent if best.unfit else min(best, bent, key=lambda trial: trial.order)
        except LayoutRefusalError as found:  # around these pins it cannot be drawn
            best, refusal = None if best.unfit else best, refusal or found
    if best is None or best.refusal is not None:
        assert refusal is not None  # the first speaks of the drawings as they are
        raise refusal
    return best


def _tried(
    problem: LayoutProblem,
    free: Sequence[Point],
    pieces: Sequence[tuple[Piece, FrameMove]],
    pair: Mapping[int, int],
    axis: float,
    pins: Mapping[int, Point],
) -> _Trial:
    """Every piece with its move: those with pins moved to them, images as their images; where a frame may be reflected,
    whichever lies less on others. Raises LayoutRefusalError where a pin is not on its line."""
    across, along = shift_of(free, pins)
    shift = axis if pair else across, along
    framed = {m for piece, _ in pieces for m in piece.part.members}
    taken: list[Rect] = [padded((*point, *point), RADIUS) for m, point in pins.items() if m not in framed]
    options: list[list[FrameMove]] = []
    unfit: set[int] = set()
    rects: dict[int, list[list[Rect]]] = {}
    for number, (piece, move) in enumerate(pieces):
        own = {place: pins[m] for place, m in enumerate(piece.part.members) if m in pins}
        wish = FrameMove((move.shift[0] + shift[0], move.shift[1] + shift[1]), move.flip)
        fitting: list[FrameMove] = []
        if own and piece.part.image_of < 0:
            fitted = [_fitted(piece, own, flip) for flip in (move.flip, not move.flip)]
            fitting = [at for at, off in fitted if off <= _SLACK]
            images = images_of(piece.part, pair)
            two = bool(images) and set(images) != set(piece.part.members)
            if fitting:
                rects[number] = [
                    [m.rect(piece.rect) for m in ((at, _image(at, axis)) if two else (at,))] for at in fitting
                ]
            else:
                mean = fitted[0][0].shift
                unfit.add(number)
                wish = replace(wish, shift=mean if two or not images else (wish.shift[0], mean[1]))
        options.append(fitting or [wish])
    chosen = dict.fromkeys(rects, 0)
    for number, own_rects in [*rects.items()] * _ROUNDS:
        rest = taken + [rect for n, k in chosen.items() if n != number for rect in rects[n][k]]
        chosen[number] = min(range(len(own_rects)), key=lambda k: _meeting([*rest, *own_rects[k]], len(rest)))
    moves = [own[chosen.get(number, 0)] for number, own in enumerate(options)]
    for number, (piece, _) in enumerate(pieces):
        if piece.part.image_of >= 0 and not pins.keys().isdisjoint(piece.part.members):
            moves[number] = _image(moves[piece.part.image_of], axis)
            unfit |= {number} if piece.part.image_of in unfit else set()
    return _trial(problem, free, [piece for piece, _ in pieces], moves, pins, shift, axis, pair, frozenset(unfit))


def _image(move: FrameMove, axis: float) -> FrameMove:
    """The move of a mirror image."""
    return FrameMove((2 * axis - move.shift[0], move.shift[1]), not move.flip)


def _meeting(rects: Sequence[Rect], first: int) -> float:
    """How deep those from the ``first`` on lie on others, and on each other."""
    pairs = ((one, other) for k, one in enumerate(rects) if k >= first for other in rects[:k])
    return math.fsum(max(0.0, _depth(one, other) + _BETWEEN) for one, other in pairs)


def _fitted(piece: Piece, pins: Mapping[int, Point], flip: bool) -> tuple[FrameMove, float]:
    """The move that takes a drawing to its pins, in the mean, and how far off it is from one of them at most."""
    reflection = FrameMove(_HERE, flip)
    apart: list[Point] = []
    for place, (x, y) in sorted(pins.items()):
        px, py = reflection.point(piece.drawing.places[place])
        apart.append((x - px, y - py))
    (x, y), count = apart[0], len(apart)
    off = max(max(abs(x - dx), abs(y - dy)) for dx, dy in apart)
    if off > _SLACK:
        x, y = math.fsum(dx for dx, _ in apart) / count, math.fsum(dy for _, dy in apart) / count
    return FrameMove((snap(x), snap(y)), flip), off


def _trial(
    problem: LayoutProblem,
    free: Sequence[Point],
    pieces: list[Piece],
    moves: list[FrameMove],
    pins: Mapping[int, Point],
    shift: Point,
    axis: float,
    pair: Mapping[int, int],
    unfit: frozenset[int] = frozenset(),
) -> _Trial:
    """How what is pinned lies on each other; single neurons that do are refused before."""
    wishes = list(_frames(problem, pieces, moves, pins, unfit))
    framed = {m for piece in pieces for m in piece.part.members}
    for i, (x, y) in enumerate(free):
        if i not in framed:
            place = pins.get(i, (x + shift[0], y + shift[1]))
            wishes.append(Wish((lone(i),), to_picture(place, problem.direction)))
    wishes = _on_lines(problem, wishes, pins)
    pinned = [b for b, wish in enumerate(wishes) if not pins.keys().isdisjoint(wish.bodies[0].members)]
    # what is pinned itself before images, so that a refusal speaks of what the spec says
    pinned.sort(key=lambda b: problem.pins.keys().isdisjoint(wishes[b].bodies[0].members))
    refusal: LayoutRefusalError | None = None
    depths, nears = [0.0], [0.0]
    crowded: set[int] = set()
    for pairing in combinations(pinned, 2):
        one, other = (wishes[b] for b in pairing)
        if not (_is_frame(one) or _is_frame(other)):
            continue
        depth = _depth(_rect(one), _rect(other))
        depths.append(max(0.0, depth))
        nears.append(max(0.0, depth + (_BETWEEN if _is_frame(one) and _is_frame(other) else RADIUS)))
        inside = meet(_neurons_of(one), _neurons_of(other), _DISCS)
        if inside and refusal is None:
            refusal = _refusal(problem, one, other)
        if depth > 0 or inside:
            crowded.update(pairing)
    depth, near = math.fsum(depths), math.fsum(nears)
    return _Trial(axis, pins, shift, pieces, moves, wishes, refusal, depth, near, unfit, frozenset(crowded))


def _frames(
    problem: LayoutProblem,
    pieces: Sequence[Piece],
    moves: Sequence[FrameMove],
    pins: Mapping[int, Point],
    unfit: frozenset[int],
) -> Iterator[Wish]:
    boxes = {box: len(problem.modules) + k for k, box in enumerate(_boxes(pieces))}
    for number, (piece, move) in enumerate(zip(pieces, moves, strict=True)):
        part, reflection, anchor = piece.part, FrameMove(_HERE, move.flip), to_picture(move.shift, problem.direction)
        places = (to_picture(reflection.point(place), problem.direction) for place in piece.drawing.places)
        offsets = tuple(zip(part.members, places, strict=True))
        rect = _in_picture(reflection.rect(piece.rect), problem)
        if number in unfit:
            anchor = _HERE
            offsets = tuple((m, to_picture(pins[m], problem.direction)) for m in part.members if m in pins)
            rect = titled(padded(bounds(point for _, point in offsets), PAD))
        yield Wish((Body(offsets, part.module if part.module >= 0 else boxes.get(part.box, -1), rect),), anchor)


def _boxes(pieces: Sequence[Piece]) -> list[int]:
    """The boxes that are frames."""
    return [piece.part.box for piece in pieces if piece.part.box >= 0 and piece.part.module < 0]


def _in_picture(rect: Rect, problem: LayoutProblem) -> Rect:
    return bounds([to_picture(rect[:2], problem.direction), to_picture(rect[2:], problem.direction)])


def _put(point: Point, axis: int, value: float) -> Point:
    """A point with one of its coordinates replaced."""
    return (value, point[1]) if axis == 0 else (point[0], value)


def _on_lines(problem: LayoutProblem, wishes: list[Wish], pins: Mapping[int, Point]) -> list[Wish]:
    """The wishes, those of what is on a line along it alone, and on the pin that is on it."""
    result, along = list(wishes), 1 - across_of(problem.direction)
    owner = {m: (b, offset[along]) for b, wish in enumerate(wishes) for m, offset in wish.bodies[0].offsets}
    for line in problem.align:
        heights = [to_picture(pins[m], problem.direction)[along] for m in line if m in pins]
        for member in line:
            if member not in owner:
                continue
            b, offset = owner[member]
            wish = result[b]
            if heights:
                off = heights[0] - offset - wish.anchor[along]
                if not (pins.keys().isdisjoint(wish.bodies[0].members) and wish.along[along]):
                    if abs(off) > _SLACK + GRID:
                        raise LayoutRefusalError(
                            "align-pins",
                            f"'{problem.neurons[member]}' is on one line with a pin that is not on it",
                            about=(problem.neurons[member],),
                        )
                elif off:
                    wish = replace(wish, anchor=_put(wish.anchor, along, heights[0] - offset), clear=False)
            result[b] = replace(wish, along=(along != 0, along != 1))
    return result


def _is_frame(wish: Wish) -> bool:
    return any(wish.bodies[0].rect)


def _rect(wish: Wish) -> Rect:
    """The frame, or, where there is none, the centre."""
    return wish.bodies[0].framed(wish.anchor) if _is_frame(wish) else _neurons_of(wish)


def _neurons_of(wish: Wish) -> Rect:
    """The rectangle around the centres."""
    return bounds(point for _, point in wish.bodies[0].spots(wish.anchor))


def _depth(one: Rect, other: Rect) -> float:
    """How far one would have to move off the other, negative where they are apart."""
    return min(one[2] - other[0], other[2] - one[0], one[3] - other[1], other[3] - one[1])


def _refusal(problem: LayoutProblem, one: Wish, other: Wish) -> LayoutRefusalError:
    """What is said of two of which a neuron of one stands among those of the other."""
    for inner, outer in ((other, one), (one, other)):
        around = padded(_neurons_of(outer), _DISCS)
        inside = [m for m, point in inner.bodies[0].spots(inner.anchor) if meet((*point, *point), around)]
        if inside and _is_frame(outer):
            break
    name = problem.neurons[(inside or inner.bodies[0].members)[0]]
    mate = problem.neurons[outer.bodies[0].members[0]]
    place = "cell" if problem.plan else "frame"
    return LayoutRefusalError(
        "pin-in-frame",
        f"pins put '{name}' into the {place} that '{mate}' is in; nothing foreign may stand there",
        "move one of the pins",
        (name, mate),
    )


def _arranged(problem: LayoutProblem, trial: _Trial, pair: Mapping[int, int]) -> Mapping[int, Point]:
    """Where each neuron that has a wish stands in the picture: what is pinned first, then what is free where it would
    like to be, then the rest, mirror images together. Raises LayoutRefusalError where a line has no room."""
    wishes, across = trial.wishes, across_of(problem.direction)
    owner = {m: b for b, wish in enumerate(wishes) for m in wish.bodies[0].members}
    sides: dict[int, AxisSide] = {}
    for wish in wishes:
        for m, point in wish.bodies[0].spots(wish.anchor):
            if m in pair and point[across] != trial.axis:
                sides[m] = AxisSide(across, trial.axis, 1 if point[across] > trial.axis else -1)
    boxes = tuple(problem.boxes[box] for box in _boxes(trial.pieces))
    occupancy = Occupancy(Frames(replace(problem, boxes=boxes)), sides=sides)
    free: list[Wish] = []
    for b, wish in enumerate(wishes):
        body = wish.bodies[0]
        other = owner.get(pair.get(body.members[0], -1), -1)
        if not trial.pins.keys().isdisjoint(body.members):
            occupancy.enter(wish.bodies, wish.anchor)
        elif other == b or (other < 0 and pair and wish.anchor[across] == trial.axis):
            # what is on the axis stays on it
            free.append(replace(wish, along=(wish.along[0] and across != 0, wish.along[1] and across != 1)))
        elif other < 0:
            free.append(wish)
        elif b < other:
            mate = wishes[other]
            if mate.along != wish.along:  # of the two, one is on a line
                along = 1 - across
                level = wish if not wish.along[along] else mate
                wish = replace(wish, anchor=_put(wish.anchor, along, level.anchor[along]), along=level.along)
            images = tuple((pair[m], offset) for m, offset in body.offsets)
            move = reflection(across, 2 * trial.axis)
            bodies = body, Body(images, mate.bodies[0].frame, body.rect, move)
            free.append(replace(wish, bodies=bodies, clear=wish.clear and mate.clear))
    lost = occupancy.settle(free)
    if lost:
        about = tuple(problem.neurons[m] for m in free[lost[0]].bodies[0].members)
        raise LayoutRefusalError("pin-in-frame", "pins leave no room on a line", "move one of the pins", about)
    return occupancy.placed


def _bent(
    problem: LayoutProblem, free: Sequence[Point], trial: _Trial, pair: Mapping[int, int], redraw: Redraw
) -> _Trial:
    """The trial with pieces drawn anew that their pins do not fit, or that lie on others: their neurons where they are,
    as far as there is room beside all that is pinned."""
    pieces, moves, pins = list(trial.pieces), list(trial.moves), dict(trial.pins)
    first = {n if (n := pieces[b].part.image_of) >= 0 else b for b in trial.unfit | trial.crowded if b < len(pieces)}
    loose = first | {b for b, piece in enumerate(pieces) if piece.part.image_of in first}
    wishes = [
        wish
        for b, wish in enumerate(trial.wishes)
        if b not in loose and not pins.keys().isdisjoint(wish.bodies[0].members)
    ]
    for b in sorted(loose):
        wishes += _within(problem, pieces[b], moves[b], pins)
    found = _arranged(problem, replace(trial, wishes=_on_lines(problem, wishes, pins)), pair)
    for b in sorted(loose):
        part = pieces[b].part
        pins.update({m: from_picture(found[m], problem.direction) for m in part.members})
        if b in first:
            own = {place: pins[m] for place, m in enumerate(part.members)}
            pieces[b], moves[b] = redraw(pieces[b], own), FrameMove(_HERE)
        else:
            pieces[b], moves[b] = replace(pieces[part.image_of], part=part), FrameMove((2 * trial.axis, 0.0), True)
    return _trial(problem, free, pieces, moves, dict(sorted(pins.items())), trial.shift, trial.axis, pair)


def _within(problem: LayoutProblem, piece: Piece, move: FrameMove, pins: Mapping[int, Point]) -> Iterator[Wish]:
    """What of a piece is placed by itself: what its module pins before all others, then instances in it of which
    nothing is pinned, then neurons."""
    members = piece.part.members
    where = {
        m: to_picture(pins.get(m, move.point(place)), problem.direction)
        for m, place in zip(members, piece.drawing.places, strict=True)
    }
    firm = [m for m in members if m in pins or any(m in module.pins for module in problem.modules)]
    yield from (Wish((lone(m),), where[m]) for m in firm)
    done = set(firm)
    for own, rect in piece.drawing.frames:
        inside = [members[place] for place in own]
        frame = instance_of(problem, inside)
        if frame >= 0 and done.isdisjoint(inside):
            x, y = where[inside[0]]
            offsets = tuple((m, (where[m][0] - x, where[m][1] - y)) for m in inside)
            yield Wish(
                (Body(offsets, frame, shifted(_in_picture(move.rect(rect), problem), (-x, -y))),), (x, y), clear=False
            )
            done.update(inside)
    yield from (Wish((lone(m),), where[m], clear=False) for m in members if m not in done)
