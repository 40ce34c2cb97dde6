"""A drawing: a part of a network laid out on its own, to be put somewhere as a whole, as it is or reflected.

In: places, routes and frames. Out: the same moved, and the room that they take up.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from neurovis_layouts.alike import Move, shifted_by
from neurovis_layouts.frame import to_picture
from neurovis_layouts.layered.parts import Part
from neurovis_layouts.routing.ends import Key, keys_of
from neurovis_spec.layout.frames import TITLE, enclosing
from neurovis_spec.layout.geometry import Rect, bounds, sampled
from neurovis_spec.layout.labels import widened
from neurovis_spec.layout.model import GRID, Direction, Layout, LayoutProblem, Point, Route, Side


@dataclass(frozen=True, slots=True)
class Drawing:
    """Neurons by index, routes by key, frames with their members; ``axis`` is where its own mirror stands, if it has
    one."""

    places: tuple[Point, ...]
    routes: Mapping[Key, Route]
    frames: tuple[tuple[tuple[int, ...], Rect], ...] = ()
    #: boxes that are drawn, though nothing had to make room for them
    boxes: tuple[tuple[tuple[int, ...], Rect], ...] = ()
    axis: float | None = None
    #: its coordinates are given by pins, so that its origin means something
    fixed: bool = False
    #: a plan in it has a mirror, whose axis is along the direction: it can be turned upside down, not on its side
    upright: bool = False
    direction: Direction = "down"
    #: on which side the label of each neuron stands, None where its disc holds it, and what labels cover
    sides: tuple[Side | None, ...] = ()
    labels: tuple[Rect, ...] = ()
    #: how wide the title of its frame is
    title: float = 0.0

    def layout(self, problem: LayoutProblem, engine: str) -> Layout:
        """It as the layout of a problem, turned from the frame of an engine that draws in its direction."""
        names, keys = problem.neurons, keys_of(problem.edges)
        return Layout(
            problem.network,
            engine,
            {name: to_picture(place, self.direction) for name, place in zip(names, self.places, strict=True)},
            {
                edge.name: tuple(to_picture(point, self.direction) for point in self.routes[key])
                for edge, key in zip(problem.edges, keys, strict=True)
            },
            {name: side for name, side in zip(names, self.sides, strict=True) if side is not None},
        )

    def rect(self) -> Rect:
        """The frame around neurons, routes, frames and labels: on the grid, so that it moves exactly. There is room for
        the title where the picture has its top: across the direction on both sides, since the frame may be turned
        round."""
        line = [point for route in self.routes.values() for point in sampled(route, 0.3)]
        frames = [rect for _, rect in (*self.frames, *self.boxes)]
        rect = enclosing(bounds(self.places), bounds(line) if line else None, frames, self.labels)
        x0, y0, x1, y1 = entitled(rect, self.title, self.direction)
        match self.direction:
            case "down":
                y0 -= TITLE
            case "up":
                y1 += TITLE
            case "right" | "left":
                x0, x1 = x0 - TITLE, x1 + TITLE
        return _down(x0), _down(y0), _up(x1), _up(y1)


def entitled(rect: Rect, title: float, direction: Direction) -> Rect:
    """A frame wide enough for its title in the picture."""
    if direction in ("down", "up"):
        return widened(rect, title)
    y0, x0, y1, x1 = widened((rect[1], rect[0], rect[3], rect[2]), title)
    return x0, y0, x1, y1


def brought(point: Point, to: Point, flip: bool) -> Move:
    """The move by which a point comes to another, reflected across an upright axis if ``flip``."""
    x, y = shifted_by((0.0, 0.0), flip).point(point)
    return shifted_by((to[0] - x, to[1] - y), flip)


def _down(value: float) -> float:
    return value // (2 * GRID) * (2 * GRID)


def _up(value: float) -> float:
    return -_down(-value)


@dataclass(frozen=True, slots=True)
class Piece:
    """A part, its drawing, and the frame around that."""

    part: Part
    drawing: Drawing
    rect: Rect

    @property
    def middle(self) -> Point:
        """The point that is the middle of its unit."""
        x0, y0, x1, y1 = self.rect
        return (x0 + x1) / 2 if self.drawing.axis is None else self.drawing.axis, (y0 + y1) / 2

    @property
    def framed(self) -> bool:
        """Whether a line is drawn around it."""
        return self.part.framed

    def titled_above(self, flip: bool) -> Piece:
        """The same where it is known whether it is reflected: with room for its title on its upper side alone."""
        if not self.framed or self.drawing.direction in ("down", "up"):
            return self
        x0, y0, x1, y1 = self.rect
        return replace(self, rect=(x0 + TITLE, y0, x1, y1) if flip else (x0, y0, x1 - TITLE, y1))


def piece_of(part: Part, drawing: Drawing) -> Piece:
    """A part as drawn."""
    return Piece(part, drawing, drawing.rect())
