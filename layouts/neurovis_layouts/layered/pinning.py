"""Pinning: from a layout without pins to final places, with the pins exact and everything else moved off them.

In: a ComponentLayout, the frames in it, pins. Out: a place for every neuron, a move for every frame. A frame with pins
is moved to them, or drawn anew around them where they do not fit its drawing; mirror images of pinned neurons follow;
all else is moved as a whole, and then off what is pinned (``overlap_removal``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from itertools import combinations

from neurovis_layouts.axes import axes, imaged, shift_of
from neurovis_layouts.layered.component_layout import ComponentLayout
from neurovis_layouts.layered.drawing import Drawing, FrameMove, Piece
from neurovis_layouts.layered.occupancy import Body, Ground
from neurovis_layouts.layered.overlap_removal import arranged
from neurovis_layouts.layered.parts import images_of
from neurovis_layouts.pins import fit
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import LayoutProblem, LayoutRefusalError, Point

_SLACK = 1e-9
#: Nothing that is pinned lies on anything, or too near.
_NONE = (0.0, 0.0)
#: Trials with frames turned round, and frames of which every two are turned together, at most.
_MOST_TURNED, _FEW = 500, 6

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
    """What pins make of the pieces with the axis at one place: pins with their images, how the plan moves, bodies (the
    pieces, then other neurons), those off their wishes for a line, and how deep what is pinned lies in each other, and
    how much it is too near."""

    axis: float
    pins: Mapping[int, Point]
    shift: Point
    held: list[Piece]
    moves: list[FrameMove]
    bodies: list[Body]
    shifted: AbstractSet[int]
    crowd: tuple[float, float]


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
    if not (pieces or pair or problem.align):
        places, shift, moved = fit(free, problem.pins)
        return Settled(places, [], shift, moved)
    trial, placed = _best(problem, free, pieces, pair, _remembering(redraw))
    places = list(free)
    for body, (x, y) in zip(trial.bodies, placed, strict=True):
        for member, (dx, dy) in zip(body.members, body.offsets, strict=True):
            places[member] = (x + dx, y + dy)
    for i, point in trial.pins.items():
        places[i] = point
    done = [(piece, replace(move, shift=at)) for piece, move, at in zip(trial.held, trial.moves, placed, strict=False)]
    (dx, dy), pins = trial.shift, trial.pins
    kept = {i for i, (x, y) in enumerate(free) if places[i] == (x + dx, y + dy) and i not in pins}
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
) -> tuple[_Trial, list[Point]]:
    """The first trial in which nothing that is pinned lies on anything else, and where its bodies stand; if there is
    none the one in which least does: first with the axis elsewhere, then with frames turned round."""
    best: tuple[_Trial, list[Point]] | None = None
    refusal: LayoutRefusalError | None = None
    wide = 2 + max((piece.rect[2] - piece.rect[0] for piece, _ in pieces), default=0.0)
    turned: AbstractSet[int] = frozenset()
    places = list(axes(problem, free, pair, wide))
    turning = [frozenset([number]) for number in _turning(problem, pieces, pair)]
    turning += [one | other for one, other in combinations(turning[:_FEW], 2)]
    for change in (frozenset[int](), *turning):
        changed = turned ^ change
        for axis in places[: max(1, _MOST_TURNED // len(turning))] if change else places:
            try:
                trial = _tried(problem, free, pieces, pair, redraw, axis, changed)
                if best is None or trial.crowd < best[0].crowd:
                    best, turned = (trial, arranged(problem.neurons, trial.bodies, pair, axis, trial.shifted)), changed
            except LayoutRefusalError as found:
                refusal = refusal if change else found
            if best is not None and best[0].crowd == _NONE:
                return best
    if best is None:
        assert refusal is not None
        raise refusal
    return best


def _turning(
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
    turned: AbstractSet[int],
) -> _Trial:
    """Raises LayoutRefusalError where a pin is in the frame of others, or not on its line."""
    pins = imaged(problem, pair, axis)
    across, along = shift_of(free, pins)
    shift = (axis if pair else across, along)
    held, moves = _held(problem, pieces, pins, shift, axis, redraw, turned)
    wished = [*_frames(held, moves), *_neurons(problem, held, free, pins, shift)]
    bodies = _on_lines(problem, wished, pins)
    ground = Ground()
    crowds: list[tuple[float, float]] = []
    pinned = [body for body in bodies if body.pinned]
    # what is pinned itself before images, so that a refusal speaks of what the spec says
    for body in sorted(pinned, key=lambda body: problem.pins.keys().isdisjoint(body.members)):
        ground.refuse(problem.neurons, body)
        crowds.append(ground.crowding(body, body.wish))
        ground.put(body, body.wish)
    crowd = math.fsum(met for met, _ in crowds), math.fsum(near for _, near in crowds)
    shifted = {b for b, body in enumerate(bodies) if body.wish != wished[b].wish}
    return _Trial(axis, pins, shift, held, moves, bodies, shifted, crowd)


def _held(
    problem: LayoutProblem,
    pieces: Sequence[tuple[Piece, FrameMove]],
    pins: Mapping[int, Point],
    shift: Point,
    axis: float,
    redraw: Redraw,
    turned: AbstractSet[int],
) -> tuple[list[Piece], list[FrameMove]]:
    """Every piece with its move; those with pins moved to them, or drawn anew. The pieces ``turned``, and their images,
    are drawn as their mirror images if the pins allow that."""
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
                wish = fitting[-1 if original in turned else 0]
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
    turned = FrameMove((0.0, 0.0), flip)
    apart = []
    for place, (x, y) in sorted(pins.items()):
        px, py = turned.point(drawing.places[place])
        apart.append((x - px, y - py))
    x, y = apart[0]
    if any(abs(x - dx) > _SLACK or abs(y - dy) > _SLACK for dx, dy in apart):
        return None
    return FrameMove((snap(x), snap(y)), flip)


def _frames(pieces: Sequence[Piece], moves: Sequence[FrameMove]) -> Iterator[Body]:
    for piece, move in zip(pieces, moves, strict=True):
        turned = FrameMove((0.0, 0.0), move.flip)
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
