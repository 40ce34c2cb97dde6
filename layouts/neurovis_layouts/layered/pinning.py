"""Pinning: from a layout without pins to final places, with the pins exact and everything else moved off them.

In: a ComponentLayout, the frames in it, pins. Out: a place for every neuron, a move for every frame. A frame with pins
is moved to them, or drawn anew around them where they do not fit its drawing, or where that would lie on something else
that is pinned; mirror images of pinned neurons follow; all else is moved as a whole, and then off what is pinned
(``occupancy``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations

from neurovis_layouts.alike import Move
from neurovis_layouts.axes import axes, imaged, shift_of
from neurovis_layouts.frame import from_picture, to_picture
from neurovis_layouts.layered.component_layout import ComponentLayout
from neurovis_layouts.layered.drawing import Drawing, FrameMove, Piece
from neurovis_layouts.layered.parts import images_of
from neurovis_layouts.occupancy import AxisSide, Body, Occupancy, Wish, instance_of, lone
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import Rect, bounds, meet, padded, shifted, snap
from neurovis_spec.layout.model import GRID, RADIUS, LayoutProblem, LayoutRefusalError, Point

_SLACK = 1e-9
#: Pinned centres of two frames are this far apart at least, but for rounding in the last bit.
_DISCS = 2 * RADIUS - 1e-9
#: How far frames should keep off each other, so that lines find a way between them.
_BETWEEN = 0.4
#: Trials with frames reflected, and frames of which every two are reflected together, at most.
_MOST_REFLECTED, _FEW = 500, 6

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
class _Crowd:
    """What is wrong with the places of what is pinned: a neuron stands among those of a frame that it is not in
    (``refusal``); how deep frames lie on other things, in all, and how much too near to others they are. ``bodies`` are
    those that lie on each other."""

    refusal: LayoutRefusalError | None
    depth: float
    near: float
    bodies: frozenset[int]

    @property
    def order(self) -> tuple[bool, float, float]:
        """The less, the better."""
        return self.refusal is not None, self.depth, self.near


@dataclass(frozen=True, slots=True)
class _Trial:
    """What pins make of the pieces with the axis at one place: pins with their images, how the plan moves, where the
    pieces, then other neurons, would like to stand in the picture, and how what is pinned does there."""

    axis: float
    pins: Mapping[int, Point]
    shift: Point
    held: list[Piece]
    moves: list[FrameMove]
    wishes: list[Wish]
    crowd: _Crowd


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
    trial = _best(problem, free, pieces, pair, _remembering(redraw))
    found = {i: from_picture(point, problem.direction) for i, point in _arranged(problem, trial, pair).items()}
    done: list[tuple[Piece, FrameMove]] = []
    for piece, move in zip(trial.held, trial.moves, strict=True):
        first = piece.part.members[0]
        (x, y), (dx, dy) = found[first], FrameMove((0.0, 0.0), move.flip).point(piece.drawing.places[0])
        pinned = not trial.pins.keys().isdisjoint(piece.part.members)
        done.append((piece, move if pinned else replace(move, shift=(x - dx, y - dy))))
    found.update(trial.pins)
    (dx, dy), pins = trial.shift, trial.pins
    kept = {i for i, (x, y) in enumerate(free) if found[i] == (x + dx, y + dy) and i not in pins}
    places = [found[i] for i in range(len(free))]
    return Settled(places, done, trial.shift, frozenset(range(len(free))) - kept, trial.axis)


def _remembering(redraw: Redraw) -> Redraw:
    """A redraw that draws nothing twice."""
    known: dict[tuple[tuple[int, ...], tuple[tuple[int, Point], ...]], Piece | LayoutRefusalError] = {}

    def remembering(piece: Piece, pins: Mapping[int, Point]) -> Piece:
        key = piece.part.members, tuple(sorted(pins.items()))
        if key not in known:
            try:
                known[key] = redraw(piece, pins)
            except LayoutRefusalError as refusal:
                known[key] = refusal
        found = known[key]
        if isinstance(found, LayoutRefusalError):
            raise found
        return found

    return remembering


def _best(
    problem: LayoutProblem,
    free: Sequence[Point],
    pieces: Sequence[tuple[Piece, FrameMove]],
    pair: Mapping[int, int],
    redraw: Redraw,
) -> _Trial:
    """The first trial in which nothing that is pinned lies on anything else; if there is none the one in which least
    does: first with the axis elsewhere, then with frames reflected, then with frames drawn so that they make room."""
    best: _Trial | None = None
    refusal: LayoutRefusalError | None = None
    wide = 2 + max((piece.rect[2] - piece.rect[0] for piece, _ in pieces), default=0.0)
    reflected: AbstractSet[int] = frozenset()
    places = list(axes(problem, free, pair, wide))
    reflecting = [frozenset([number]) for number in _reflecting(problem, pieces, pair)]
    reflecting += [one | other for one, other in combinations(reflecting[:_FEW], 2)]
    for change in (frozenset[int](), *reflecting):
        changed = reflected ^ change
        for axis in places[: max(1, _MOST_REFLECTED // len(reflecting))] if change else places:
            try:
                pins = imaged(problem, pair, axis)
                trial = _tried(problem, free, pieces, pair, redraw, axis, changed, pins)
                refusal = refusal or trial.crowd.refusal
                if best is None or trial.crowd.order < best.crowd.order:
                    best, reflected = trial, changed
            except LayoutRefusalError as found:
                refusal = refusal or found
            if best is not None and best.crowd.order == (False, 0.0, 0.0):
                return best
    if best is not None and (best.crowd.refusal is not None or best.crowd.depth):
        bent = {**best.pins, **_bent(problem, best, pair)}
        with suppress(LayoutRefusalError):  # around these pins it cannot be drawn
            other = _tried(problem, free, pieces, pair, redraw, best.axis, reflected, bent)
            best = min(best, other, key=lambda trial: trial.crowd.order)
    if best is None or best.crowd.refusal is not None:
        assert refusal is not None  # the first speaks of the drawings as they are
        raise refusal
    return best


def _reflecting(
    problem: LayoutProblem, pieces: Sequence[tuple[Piece, FrameMove]], pair: Mapping[int, int]
) -> Iterator[int]:
    """The pieces of which one neuron is pinned, itself or by its image, and that may be drawn as their mirror images
    instead."""
    pinned = problem.pins.keys() | {pair[i] for i in problem.pins if i in pair}
    for number, (piece, _) in enumerate(pieces):
        part = piece.part
        if part.image_of < 0 and len(pinned.intersection(part.members)) == 1:
            images = images_of(part, pair)
            if not images or set(images) != set(part.members):
                yield number


def _tried(
    problem: LayoutProblem,
    free: Sequence[Point],
    pieces: Sequence[tuple[Piece, FrameMove]],
    pair: Mapping[int, int],
    redraw: Redraw,
    axis: float,
    reflected: AbstractSet[int],
    pins: Mapping[int, Point],
) -> _Trial:
    """Raises LayoutRefusalError where a pin is not on its line."""
    across, along = shift_of(free, pins)
    shift = (axis if pair else across, along)
    held, moves = _held(pieces, pins, shift, axis, redraw, reflected)
    wishes = [*_frames(problem, held, moves), *_neurons(problem, held, free, pins, shift)]
    wishes = _on_lines(problem, wishes, pins)
    return _Trial(axis, pins, shift, held, moves, wishes, _crowd(problem, wishes, pins))


def _held(
    pieces: Sequence[tuple[Piece, FrameMove]],
    pins: Mapping[int, Point],
    shift: Point,
    axis: float,
    redraw: Redraw,
    reflected: AbstractSet[int],
) -> tuple[list[Piece], list[FrameMove]]:
    """Every piece with its move; those with pins moved to them, or drawn anew. The pieces ``reflected``, and their
    images, are drawn as their mirror images if the pins allow that."""
    found: list[Piece] = []
    moves: list[FrameMove] = []
    for number, (piece, move) in enumerate(pieces):
        own = {place: pins[m] for place, m in enumerate(piece.part.members) if m in pins}
        wish = FrameMove((move.shift[0] + shift[0], move.shift[1] + shift[1]), move.flip)
        if own:
            fitting = [
                at for flip in (move.flip, not move.flip) if (at := _fitted(piece.drawing, own, flip)) is not None
            ]
            if fitting:
                original = number if piece.part.image_of < 0 else piece.part.image_of
                wish = fitting[-1 if original in reflected else 0]
            elif piece.part.image_of >= 0:
                piece = replace(found[piece.part.image_of], part=piece.part)
                wish = FrameMove(
                    (2 * axis - moves[piece.part.image_of].shift[0], 0.0), not moves[piece.part.image_of].flip
                )
            else:
                piece, wish = redraw(piece, own), FrameMove((0.0, 0.0))
        found.append(piece)
        moves.append(wish)
    return found, moves


def _fitted(drawing: Drawing, pins: Mapping[int, Point], flip: bool) -> FrameMove | None:
    """The move that takes a drawing to its pins, if one does."""
    reflection = FrameMove((0.0, 0.0), flip)
    apart = []
    for place, (x, y) in sorted(pins.items()):
        px, py = reflection.point(drawing.places[place])
        apart.append((x - px, y - py))
    x, y = apart[0]
    if any(abs(x - dx) > _SLACK or abs(y - dy) > _SLACK for dx, dy in apart):
        return None
    return FrameMove((snap(x), snap(y)), flip)


def _frames(problem: LayoutProblem, pieces: Sequence[Piece], moves: Sequence[FrameMove]) -> Iterator[Wish]:
    number = {box: len(problem.modules) + k for k, box in enumerate(_boxes(pieces))}
    for piece, move in zip(pieces, moves, strict=True):
        part, reflection = piece.part, FrameMove((0.0, 0.0), move.flip)
        places = (to_picture(reflection.point(place), problem.direction) for place in piece.drawing.places)
        offsets = tuple(zip(part.members, places, strict=True))
        frame = part.module if part.module >= 0 else number.get(part.box, -1)
        rect = _in_picture(reflection.rect(piece.rect), problem)
        yield Wish((Body(offsets, frame, rect),), to_picture(move.shift, problem.direction))


def _boxes(pieces: Sequence[Piece]) -> list[int]:
    """The boxes that are frames."""
    return [piece.part.box for piece in pieces if piece.part.box >= 0 and piece.part.module < 0]


def _in_picture(rect: Rect, problem: LayoutProblem) -> Rect:
    return bounds([to_picture(rect[:2], problem.direction), to_picture(rect[2:], problem.direction)])


def _neurons(
    problem: LayoutProblem, pieces: Sequence[Piece], free: Sequence[Point], pins: Mapping[int, Point], shift: Point
) -> Iterator[Wish]:
    framed = {m for piece in pieces for m in piece.part.members}
    for i, (x, y) in enumerate(free):
        if i not in framed:
            place = pins[i] if i in pins else (x + shift[0], y + shift[1])
            yield Wish((lone(i),), to_picture(place, problem.direction))


def _across(problem: LayoutProblem) -> int:
    """The coordinate of the picture that is across the direction."""
    return 0 if problem.direction in ("down", "up") else 1


def _put(point: Point, axis: int, value: float) -> Point:
    """A point with one of its coordinates replaced."""
    return (value, point[1]) if axis == 0 else (point[0], value)


def _on_lines(problem: LayoutProblem, wishes: list[Wish], pins: Mapping[int, Point]) -> list[Wish]:
    """The wishes, those of what is on a line along it alone, and on the pin that is on it."""
    result, along = list(wishes), 1 - _across(problem)
    owner = {m: (b, offset[along]) for b, wish in enumerate(wishes) for m, offset in wish.bodies[0].offsets}
    for line in problem.align:
        heights = [to_picture(pins[m], problem.direction)[along] for m in line if m in pins]
        for member in line:
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


def _crowd(problem: LayoutProblem, wishes: Sequence[Wish], pins: Mapping[int, Point]) -> _Crowd:
    """How what is pinned lies on each other where it would like to stand; single neurons that do are refused before."""
    pinned = [b for b, wish in enumerate(wishes) if not pins.keys().isdisjoint(wish.bodies[0].members)]
    # what is pinned itself before images, so that a refusal speaks of what the spec says
    pinned.sort(key=lambda b: problem.pins.keys().isdisjoint(wishes[b].bodies[0].members))
    frames = [b for b in pinned if _is_frame(wishes[b])]
    single = [b for b in pinned if not _is_frame(wishes[b])]
    refusal: LayoutRefusalError | None = None
    depths: list[float] = []
    nears: list[float] = []
    found: set[int] = set()
    for k, one in enumerate(frames):
        own, tight = wishes[one].bodies[0].framed(wishes[one].anchor), _neurons_of(wishes[one])
        for other in (*frames[k + 1 :], *single):
            body = wishes[other].bodies[0]
            theirs = body.framed(wishes[other].anchor) if _is_frame(wishes[other]) else _neurons_of(wishes[other])
            depth = _depth(own, theirs)
            depths.append(max(0.0, depth))
            nears.append(max(0.0, depth + (_BETWEEN if _is_frame(wishes[other]) else RADIUS)))
            inside = meet(tight, _neurons_of(wishes[other]), _DISCS)
            if inside and refusal is None:
                refusal = _refusal(problem, wishes[one], wishes[other])
            if depth > 0 or inside:
                found |= {one, other}
    return _Crowd(refusal, math.fsum(depths), math.fsum(nears), frozenset(found))


def _is_frame(wish: Wish) -> bool:
    return any(wish.bodies[0].rect)


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
    return LayoutRefusalError(
        "pin-in-frame",
        f"pins put '{name}' into the frame that '{mate}' is in; nothing foreign may stand there",
        "move one of the pins",
        (name, mate),
    )


def _occupancy(problem: LayoutProblem, trial: _Trial, pair: Mapping[int, int]) -> Occupancy:
    """Nothing yet, with the frames of this trial and the sides of the axis that mirror images are on."""
    boxes = tuple(problem.boxes[box] for box in _boxes(trial.held))
    across = _across(problem)
    sides: dict[int, AxisSide] = {}
    for wish in trial.wishes:
        for m, point in wish.bodies[0].spots(wish.anchor):
            if m in pair and point[across] != trial.axis:
                sides[m] = AxisSide(across, trial.axis, 1 if point[across] > trial.axis else -1)
    return Occupancy(Frames(replace(problem, boxes=boxes)), sides=sides)


def _reflected(problem: LayoutProblem, axis: float, body: Body, members: Sequence[int], frame: int) -> Body:
    """A body of these neurons that is the mirror image of another."""
    offsets = tuple((m, offset) for m, (_, offset) in zip(members, body.offsets, strict=True))
    across = _across(problem)
    move = Move(_put((1.0, 1.0), across, -1.0), _put((0.0, 0.0), across, 2 * axis))
    return Body(offsets, frame, body.rect, move)


def _arranged(problem: LayoutProblem, trial: _Trial, pair: Mapping[int, int]) -> Mapping[int, Point]:
    """Where each neuron stands in the picture: what is pinned first, then what is free where it would like to be, then
    the rest, mirror images together. Raises LayoutRefusalError where a line has no room."""
    wishes, across = trial.wishes, _across(problem)
    owner = {m: b for b, wish in enumerate(wishes) for m in wish.bodies[0].members}
    image = [owner[pair[m]] if (m := wish.bodies[0].members[0]) in pair else -1 for wish in wishes]
    occupancy = _occupancy(problem, trial, pair)
    free: list[Wish] = []
    for b, wish in enumerate(wishes):
        body, other = wish.bodies[0], image[b]
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
            bodies = body, _reflected(problem, trial.axis, body, [pair[m] for m in body.members], mate.bodies[0].frame)
            free.append(replace(wish, bodies=bodies, clear=wish.clear and mate.clear))
    lost = occupancy.settle(free)
    if lost:
        about = tuple(problem.neurons[m] for m in free[lost[0]].bodies[0].members)
        raise LayoutRefusalError("pin-in-frame", "pins leave no room on a line", "move one of the pins", about)
    return occupancy.placed


def _bent(problem: LayoutProblem, trial: _Trial, pair: Mapping[int, int]) -> dict[int, Point]:
    """Places for the neurons of frames that are pinned on each other, one by one around the pins, so that the frames
    have room; those that a module pins stay where its drawing has them. In the engine's frame, as pins."""
    first = {
        n if (n := piece.part.image_of) >= 0 else b for b, piece in enumerate(trial.held) if b in trial.crowd.bodies
    }
    bending = first | {b for b, piece in enumerate(trial.held) if piece.part.image_of in first}
    firm = trial.pins.keys() | {m for module in problem.modules for m in module.pins}
    lined = {m for line in problem.align for m in line}
    across, occupancy = _across(problem), _occupancy(problem, trial, pair)
    for b, wish in enumerate(trial.wishes):
        if b in bending:
            for m, point in wish.bodies[0].spots(wish.anchor):
                if m in firm:
                    occupancy.enter((lone(m),), point)
        elif not trial.pins.keys().isdisjoint(wish.bodies[0].members):
            occupancy.enter(wish.bodies, wish.anchor)
    for b in sorted(first):
        where = dict(trial.wishes[b].bodies[0].spots(trial.wishes[b].anchor))
        for body in _within(problem, trial.held[b], trial.moves[b], where, firm):
            member, point = body.members[0], where[body.members[0]]
            if member in occupancy.placed:
                continue
            images = [pair[m] for m in body.members if m in pair]
            bodies = [body]
            if len(images) == len(body.members):
                bodies.append(_reflected(problem, trial.axis, body, images, instance_of(problem, images)))
            on_axis = bool(pair) and not images and point[across] == trial.axis
            free = not on_axis, lined.isdisjoint(body.members)
            occupancy.put(Wish(bodies, point, free if across == 0 else free[::-1]))
    bent = {m for b in bending for m in trial.held[b].part.members}
    return {m: from_picture(point, problem.direction) for m, point in occupancy.placed.items() if m in bent}


def _within(
    problem: LayoutProblem, piece: Piece, move: FrameMove, where: Mapping[int, Point], firm: AbstractSet[int]
) -> Iterator[Body]:
    """What of a piece is placed by itself: instances in it of which nothing is firm, then neurons."""
    members = piece.part.members
    done = set(firm)
    for own, rect in piece.drawing.frames:
        inside = [members[place] for place in own]
        frame = instance_of(problem, inside)
        if frame >= 0 and done.isdisjoint(inside):
            x, y = where[inside[0]]
            offsets = tuple((m, (where[m][0] - x, where[m][1] - y)) for m in inside)
            yield Body(offsets, frame, shifted(_in_picture(move.rect(rect), problem), (-x, -y)))
            done.update(inside)
    yield from (lone(m) for m in members if m not in done)
