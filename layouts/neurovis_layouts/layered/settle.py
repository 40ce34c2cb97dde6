"""Settle: from a free plan to places, with what is pinned where it belongs and everything else off it.

In: a plan, the frames in it, pins. Out: a place for every neuron, a move for every frame. A frame with pins is moved to
them, or, where they do not fit its drawing, drawn anew around them; the image of what is pinned follows; what is free
stays where the plan has it, moved as a whole, or gives way, images together, what is aligned along its line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace

from neurovis_layouts.layered.drawing import Drawing, Move, Piece, Rect
from neurovis_layouts.layered.ground import Body, Ground
from neurovis_layouts.layered.sheet import Plan
from neurovis_layouts.pins import fit
from neurovis_spec.layout.geometry import distance, snap
from neurovis_spec.layout.model import RADIUS, LayoutProblem, LayoutRefusalError, Point

_SLACK = 1e-9
_STEP = 0.25
_TRIES = 161

#: A part drawn anew, around pins of its neurons.
Redraw = Callable[[Piece, Mapping[int, Point]], Piece]


@dataclass(frozen=True, slots=True)
class Settled:
    """Places by neuron, pieces and where they are, how the plan has moved as a whole, which neurons did not simply
    follow, and the axis."""

    places: list[Point]
    pieces: list[tuple[Piece, Move]]
    shift: Point = (0.0, 0.0)
    moved: frozenset[int] = frozenset()
    axis: float = 0.0


def settled(
    problem: LayoutProblem,
    plan: Plan,
    pieces: Sequence[tuple[Piece, Move]],
    pair: Mapping[int, int],
    redraw: Redraw,
) -> Settled:
    """Where everything stands. Raises LayoutRefusalError for pins within the frame of others."""
    free = [plan.places[i] for i in range(len(problem.neurons))]
    if not problem.pins:
        return Settled(free, list(pieces))
    if not (pieces or pair or problem.align):
        places, shift, moved = fit(free, problem.pins)
        return Settled(places, [], shift, moved)
    for last, axis in _axes(problem, free, pair):
        try:
            pins = _imaged(problem, pair, axis)
            shift = (axis if pair else _shift(free, pins)[0], _shift(free, pins)[1])
            held, moves = _held(problem, pieces, pins, shift, axis, redraw)
            bodies = [*_frames(held, moves), *_neurons(problem, held, free, pins, shift)]
            wishes = [body.wish for body in bodies]
            bodies = _on_lines(problem, bodies, pins)
            shifted = {b for b, body in enumerate(bodies) if body.wish != wishes[b]}
            placed = _arranged(problem, bodies, pair, axis, shifted)
            break
        except LayoutRefusalError:
            if last:
                raise
    places = list(free)
    for body, (x, y) in zip(bodies, placed, strict=True):
        for member, (dx, dy) in zip(body.members, body.offsets, strict=True):
            places[member] = (x + dx, y + dy)
    for i, point in pins.items():
        places[i] = point
    done = [(piece, replace(move, shift=at)) for piece, move, at in zip(held, moves, placed, strict=False)]
    kept = {i for i, (x, y) in enumerate(free) if places[i] == (x + shift[0], y + shift[1]) and i not in pins}
    return Settled(places, done, shift, frozenset(range(len(free))) - kept, axis)


def _shift(free: Sequence[Point], pins: Mapping[int, Point]) -> Point:
    """The least-squares fit of the free plan to the pins, on the grid."""
    return (
        snap(math.fsum(x - free[i][0] for i, (x, _) in sorted(pins.items())) / len(pins)),
        snap(math.fsum(y - free[i][1] for i, (_, y) in sorted(pins.items())) / len(pins)),
    )


def _axes(problem: LayoutProblem, free: Sequence[Point], pair: Mapping[int, int]) -> Iterator[tuple[bool, float]]:
    """Where the axis may be, the best place first, and whether it is the last: one place where both of a pair are
    pinned. Raises LayoutRefusalError where such pairs disagree."""
    pins = problem.pins
    both = sorted((a, b) for a, b in pair.items() if a < b and a in pins and b in pins)
    for a, b in both:
        first = both[0]
        apart = pins[a][0] + pins[b][0] - pins[first[0]][0] - pins[first[1]][0]
        if abs(apart) > _SLACK or abs(pins[a][1] - pins[b][1]) > _SLACK:
            names = problem.neurons[a], problem.neurons[b]
            message = f"the pins of '{names[0]}' and '{names[1]}' are not mirror images"
            raise LayoutRefusalError("mirror-pins", message, about=names)
    if both or not pair:
        yield True, (pins[both[0][0]][0] + pins[both[0][1]][0]) / 2 if both else 0.0
        return
    start = _shift(free, pins)[0]
    for number in range(_TRIES):
        yield number == _TRIES - 1, start + (number + 1) // 2 * (_STEP if number % 2 else -_STEP)


def _imaged(problem: LayoutProblem, pair: Mapping[int, int], axis: float) -> dict[int, Point]:
    images = {pair[i]: (2 * axis - x, y) for i, (x, y) in problem.pins.items() if i in pair}
    found = dict(sorted({**images, **problem.pins}.items()))
    for i in images:
        if i not in problem.pins:
            _refuse_close(problem, found, i, pair[i])
    return found


def _refuse_close(problem: LayoutProblem, pins: Mapping[int, Point], image: int, pinned: int) -> None:
    for j, other in pins.items():
        if j != image and distance(pins[image], other) < 2 * RADIUS - _SLACK:
            names = problem.neurons[pinned], problem.neurons[j]
            raise LayoutRefusalError(
                "mirror-pins",
                f"no axis keeps the mirror images of pins off other pins: that of '{names[0]}' stands on '{names[1]}'",
                "move one of the pins, or leave one out",
                names,
            )


def _held(
    problem: LayoutProblem,
    pieces: Sequence[tuple[Piece, Move]],
    pins: Mapping[int, Point],
    shift: Point,
    axis: float,
    redraw: Redraw,
) -> tuple[list[Piece], list[Move]]:
    """Every piece with its move; those with pins moved to them, or drawn anew."""
    found: list[Piece] = []
    moves: list[Move] = []
    for piece, move in pieces:
        own = {place: pins[m] for place, m in enumerate(piece.part.members) if m in pins}
        wish = Move((move.shift[0] + shift[0], move.shift[1] + shift[1]), move.flip)
        if own:
            fitting = [
                at for flip in (move.flip, not move.flip) if (at := _fitted(piece.drawing, own, flip)) is not None
            ]
            if fitting:
                wish = fitting[0]
            elif piece.part.image_of >= 0:
                piece = replace(found[piece.part.image_of], part=piece.part)
                wish = Move((2 * axis - moves[piece.part.image_of].shift[0], 0.0), not moves[piece.part.image_of].flip)
            else:
                piece, wish = redraw(piece, own), Move((0.0, 0.0))
        found.append(piece)
        moves.append(wish)
    return found, moves


def _fitted(drawing: Drawing, pins: Mapping[int, Point], flip: bool) -> Move | None:
    """The move that takes a drawing to its pins, if one does."""
    turned = Move((0.0, 0.0), flip)
    apart = []
    for place, (x, y) in sorted(pins.items()):
        px, py = turned.point(drawing.places[place])
        apart.append((x - px, y - py))
    x, y = apart[0]
    if any(abs(x - dx) > _SLACK or abs(y - dy) > _SLACK for dx, dy in apart):
        return None
    return Move((snap(x), snap(y)), flip)


def _frames(pieces: Sequence[Piece], moves: Sequence[Move]) -> Iterator[Body]:
    for piece, move in zip(pieces, moves, strict=True):
        turned = Move((0.0, 0.0), move.flip)
        offsets = tuple(turned.point(place) for place in piece.drawing.places)
        yield Body(piece.part.members, offsets, turned.rect(piece.rect), move.shift)


def _neurons(
    problem: LayoutProblem, pieces: Sequence[Piece], free: Sequence[Point], pins: Mapping[int, Point], shift: Point
) -> Iterator[Body]:
    framed = {m for piece in pieces for m in piece.part.members}
    for i, (x, y) in enumerate(free):
        if i not in framed:
            wish = pins[i] if i in pins else (x + shift[0], y + shift[1])
            yield Body((i,), ((0.0, 0.0),), None, wish)


def _on_lines(problem: LayoutProblem, bodies: list[Body], pins: Mapping[int, Point]) -> list[Body]:
    """Bodies marked as pinned, and as bound to a line; what is on a line with a pin moved on to it."""
    result = [replace(body, pinned=any(m in pins for m in body.members)) for body in bodies]
    owner = {m: (b, place) for b, body in enumerate(bodies) for place, m in enumerate(body.members)}
    for line in problem.align:
        heights = [pins[m][1] for m in line if m in pins]
        for member in line:
            b, place = owner[member]
            body = result[b]
            x, y = body.wish
            if heights:
                target = heights[0] - body.offsets[place][1]
                if body.pinned or body.level:
                    if abs(target - y) > _SLACK + 1 / 1024:
                        raise LayoutRefusalError(
                            "align-pins",
                            f"'{problem.neurons[member]}' is on one line with a pin that is not on it",
                            about=(problem.neurons[member],),
                        )
                else:
                    y = target
            result[b] = replace(body, wish=(x, y), level=True)
    return result


def _arranged(
    problem: LayoutProblem, bodies: Sequence[Body], pair: Mapping[int, int], axis: float, shifted: AbstractSet[int]
) -> list[Point]:
    """Where each body stands: pinned ones first, then those whose wish is free, then the others. The wishes of free
    bodies are clear of each other, except for those ``shifted`` to the lines that pins give."""
    owner = {m: b for b, body in enumerate(bodies) for m in body.members}
    image = [owner[pair[body.members[0]]] if body.members[0] in pair else -1 for body in bodies]
    ground = Ground()
    at: dict[int, Point] = {}
    for b, body in enumerate(bodies):
        if body.pinned:
            ground.refuse(problem.neurons, body)
            ground.put(body, body.wish)
            at[b] = body.wish
    waiting: list[int] = []
    for b, body in enumerate(bodies):
        if b not in at and not (0 <= image[b] < b):
            places = _both(body, body.wish, image[b], b, bodies, axis)
            moved = any(k in shifted for k, _ in places)
            if not moved and all(ground.takes(bodies[k], place, 2 * RADIUS) for k, place in places):
                at.update(places)
            else:
                waiting.append(b)
    for b, place in sorted(at.items()):
        if not bodies[b].pinned:
            ground.put(bodies[b], place)
    for b in waiting:
        found = _search(ground, bodies, b, image[b], axis)
        if not found:
            about = tuple(problem.neurons[m] for m in bodies[b].members)
            raise LayoutRefusalError("pin-in-frame", "pins leave no room on a line", "move one of the pins", about)
        for k, place in found:
            ground.put(bodies[k], place)
            at[k] = place
    return [at[b] for b in range(len(bodies))]


def _both(
    body: Body, place: Point, image: int, own: int, bodies: Sequence[Body], axis: float
) -> list[tuple[int, Point]]:
    """A body and its image, where they stand together."""
    if image < 0 or image == own:
        return [(own, place)]
    return [(own, place), (image, (2 * axis - place[0], place[1]))]


def _search(ground: Ground, bodies: Sequence[Body], own: int, image: int, axis: float) -> list[tuple[int, Point]]:
    """The free place nearest to the wish, sideways first; none where a line has no room. What is on the axis stays
    on it if that can be."""
    body = bodies[own]
    x, y = body.wish
    on_axis = image == own or (image < 0 and x == axis)
    reach = 4
    while True:
        steps = range(-reach, reach + 1)
        across, along = [0] if on_axis else steps, [0] if body.level else steps
        around = sorted((i * i + j * j, abs(j), -i, -j) for i in across for j in along)
        for squared, _, i, j in around:
            if squared > reach * reach:
                break
            place = (x - i * _STEP, y - j * _STEP)
            places = _both(body, place, image, own, bodies, axis)
            if _clear_of_each_other(bodies, places) and all(ground.takes(bodies[k], p) for k, p in places):
                return places
        if reach > 64 and on_axis and image != own:
            on_axis = False
        elif reach > 4096:
            return []
        reach *= 2


def _clear_of_each_other(bodies: Sequence[Body], places: Sequence[tuple[int, Point]]) -> bool:
    if len(places) < 2:
        return True
    ground = Ground()
    ground.put(bodies[places[0][0]], places[0][1])
    return ground.takes(bodies[places[1][0]], places[1][1])


__all__ = ["Rect", "Settled", "settled"]
