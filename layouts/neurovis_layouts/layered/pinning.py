"""Pinning: from a layout without pins to final places, with the pins exact and everything else moved off them.

In: a ComponentLayout, the frames in it, pins. Out: a place for every neuron (``settling``), a move for every frame. A
frame whose neurons do not stand as they are drawn is drawn anew around them, those that stand alike once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from neurovis_layouts.alike import Move, same, shifted_by
from neurovis_layouts.frame import across_of, from_picture, in_picture, to_picture
from neurovis_layouts.layered.component_layout import ComponentLayout
from neurovis_layouts.layered.drawing import Piece, brought
from neurovis_layouts.settling import Whole, settled
from neurovis_spec.layout.frames import Frames
from neurovis_spec.layout.geometry import Rect, bounds, meet, padded
from neurovis_spec.layout.model import GRID, RADIUS, LayoutProblem, LayoutRefusalError, Point

#: Pinned centres of two frames are this far apart at least, but for rounding in the last bit.
_DISCS = 2 * RADIUS - 1e-9

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


def pinned(
    problem: LayoutProblem,
    plan: ComponentLayout,
    pieces: Sequence[tuple[Piece, Move]],
    pair: Mapping[int, int],
    redraw: Redraw,
) -> Settled:
    """Where everything stands. Raises LayoutRefusalError for pins within the frame of others."""
    free = [plan.places[i] for i in range(len(problem.neurons))]
    if not problem.pins:
        return Settled(free, list(pieces))
    # as it is in the picture, and without memory: what that says is seen to later
    pins = {i: to_picture(point, problem.direction) for i, point in problem.pins.items()}
    turned = replace(problem, pins=pins, memory=None)
    frames, wholes = _framed(turned, pieces)
    found = settled(turned, frames, [to_picture(point, problem.direction) for point in free], wholes)
    places = [from_picture(point, problem.direction) for point in found.at]
    dx, dy = from_picture(found.shift, problem.direction)
    held = {*pins, *(pair[i] for i in pins if i in pair)}
    _refuse(problem, [piece for piece, _ in pieces], found.at, held)
    moved = frozenset(i for i, (x, y) in enumerate(free) if places[i] != (x + dx, y + dy) or i in held)
    return Settled(places, _redrawn(pieces, places, found.axis, redraw), (dx, dy), moved, found.axis)


def _framed(problem: LayoutProblem, pieces: Sequence[tuple[Piece, Move]]) -> tuple[Frames, list[Whole]]:
    """The frames of a problem as it is in the picture, and those of pieces, with what is in these."""
    boxes = [piece.part.box for piece, _ in pieces if piece.part.box >= 0 and piece.part.module < 0]
    frames = Frames(replace(problem, boxes=tuple(problem.boxes[box] for box in boxes)))
    numbers = {own: number for number, own in reversed(list(enumerate(frames.members)))}
    around = [frame for piece, move in pieces for frame in _frames_of(piece, move)]
    return frames, [
        Whole(members, numbers.get(frozenset(members), -1), in_picture(rect, problem.direction))
        for members, rect in around
    ]


def _redrawn(
    pieces: Sequence[tuple[Piece, Move]], places: Sequence[Point], axis: float, redraw: Redraw
) -> list[tuple[Piece, Move]]:
    """The pieces and the moves that take them to their places, those drawn anew whose neurons do not stand as they are
    drawn, and their mirror images as reflections of them."""
    done: list[tuple[Piece, Move]] = []
    drawn: dict[tuple[int, int, tuple[Point, ...]], Piece] = {}
    for number, (piece, move) in enumerate(pieces):
        part, at = piece.part, [places[m] for m in piece.part.members]
        fitting = _fitting(piece, move, at)
        if fitting is None and part.image_of >= 0:
            lead, ahead = done[part.image_of]
            piece = replace(lead, part=part)
            fitting = shifted_by((2 * axis - ahead.shift[0], ahead.shift[1]), not ahead.mirrored)
        elif fitting is None:
            x, y = at[0]
            own = tuple((px - x, py - y) for px, py in at)
            key = part.kind, number if part.kind < 0 else -1, own
            if key not in drawn:
                drawn[key] = redraw(piece, dict(enumerate(own)))
            piece, fitting = replace(drawn[key], part=part), shifted_by((x, y))
        done.append((piece, fitting))
    return done


def _frames_of(piece: Piece, move: Move) -> Iterator[tuple[tuple[int, ...], Rect]]:
    """The frame of a piece, and those in it."""
    yield piece.part.members, move.rect(piece.rect)
    for own, rect in piece.drawing.frames:
        yield tuple(piece.part.members[place] for place in own), move.rect(rect)


def _fitting(piece: Piece, move: Move, at: Sequence[Point]) -> Move | None:
    """The move that takes a drawing to where its neurons stand."""
    for flip in (move.mirrored, not move.mirrored):
        there = brought(piece.drawing.places[0], at[0], flip)
        if all(same(there.point(place), point) for place, point in zip(piece.drawing.places, at, strict=True)):
            return there
    return None


def _refuse(problem: LayoutProblem, pieces: Sequence[Piece], at: Sequence[Point], held: set[int]) -> None:
    """Raise LayoutRefusalError where pins put a neuron among those of a frame or a cell, or off its line."""
    rank = 1 - across_of(problem.direction)
    for line in problem.align:
        heights = [at[m][rank] for m in line if m in problem.pins]
        for member in line if heights else ():
            if abs(at[member][rank] - heights[0]) > GRID:
                name = problem.neurons[member]
                message = f"'{name}' is on one line with a pin that is not on it"
                raise LayoutRefusalError("align-pins", message, about=(name,))
    framed = {m for piece in pieces for m in piece.part.members}
    own = [piece.part.members for piece in pieces if not held.isdisjoint(piece.part.members)]
    count = len(own)
    own += [(i,) for i in sorted(held - framed)]
    # what is pinned itself before images, so that a refusal speaks of what the spec says
    order = sorted(range(len(own)), key=lambda k: problem.pins.keys().isdisjoint(own[k]))
    hulls = [bounds(at[m] for m in members) for members in own]
    for a, b in combinations(order, 2):
        if min(a, b) < count and meet(hulls[a], hulls[b], _DISCS):
            raise _refusal(problem, at, own[a], own[b])


def _refusal(
    problem: LayoutProblem, at: Sequence[Point], one: Sequence[int], other: Sequence[int]
) -> LayoutRefusalError:
    """What is said of two of which a neuron of one stands among those of the other."""
    for inner, outer in ((other, one), (one, other)):
        around = padded(bounds(at[m] for m in outer), _DISCS)
        inside = [m for m in inner if meet((*at[m], *at[m]), around)]
        if inside and len(outer) > 1:
            break
    name, mate = problem.neurons[(inside or inner)[0]], problem.neurons[outer[0]]
    place = "cell" if problem.plan else "frame"
    return LayoutRefusalError(
        "pin-in-frame",
        f"pins put '{name}' into the {place} that '{mate}' is in; nothing foreign may stand there",
        "move one of the pins",
        (name, mate),
    )
