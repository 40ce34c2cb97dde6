"""Hierarchy: draws frames from the inside out, and puts their drawings together into that of the whole.

In: a problem. Out: a Drawing. Every kind of instance is drawn once, by itself, with the instances in it as blocks; the
drawing is then a block in what is around it, moved or reflected by steps of the grid, so that copies are exact. A box
becomes such a frame where neurons that are not its own would stand in it otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeAlias

from neurovis_layouts.alike import mirror_images, shifted_by
from neurovis_layouts.frame import from_picture
from neurovis_layouts.layered.compact import (
    NONE,
    RANKS,
    WHOLE,
    Fold,
    Shape,
    ShapeKey,
    compact,
    may_be_folded,
    too_large,
)
from neurovis_layouts.layered.drawing import Drawing, Piece, piece_of
from neurovis_layouts.layered.engine import stands
from neurovis_layouts.layered.frame_layout import Frame
from neurovis_layouts.layered.frame_routing import Standing
from neurovis_layouts.layered.page_cost import PageCost
from neurovis_layouts.layered.page_plan import in_direction, parts_by_cell
from neurovis_layouts.layered.parts import Part, columns_of, holds_instance, may_be_frame, parts_of
from neurovis_layouts.layered.templates import Book, restricted
from neurovis_layouts.layered.units import arranged_on_axis
from neurovis_layouts.pins import with_origins
from neurovis_spec.layout.labels import BOX_WEIGHT, title_room
from neurovis_spec.layout.model import TURNED, Direction, Layout, LayoutMirror, LayoutProblem, Point

#: A part, the direction in which it is drawn, and whether with routes.
_Known: TypeAlias = tuple[Part, Direction, bool]


def drawn(problem: LayoutProblem, engine: str) -> Layout:
    """The layout of a problem as if there were no earlier one. Raises LayoutRefusalError for what cannot be met."""
    if not problem.neurons:
        return Layout(problem.network, engine, {}, {})
    return Composer(_framed(problem)).whole().layout(problem, engine)


def directed(problem: LayoutProblem) -> LayoutProblem:
    """The problem in the direction in which it costs less of the page, where the page may choose."""
    if not problem.turns or not problem.neurons or too_large(problem):
        return problem
    turned = replace(problem, direction="right")
    down, right = (Composer(_framed(one)).cost() for one in (problem, turned))
    return turned if right < TURNED * down else problem


def checked(problem: LayoutProblem) -> None:
    """Raises the LayoutRefusalError that ``drawn`` would. Only pins and lines need places for it, and for these no
    connection between frames has to be routed."""
    if not problem.neurons:
        return
    composer = Composer(_framed(problem))
    composer.check_mirrors()
    if problem.pins or problem.align or any(module.pins or module.origin is not None for module in problem.modules):
        composer.whole(routed=False)


def _framed(problem: LayoutProblem) -> LayoutProblem:
    """Pins in the engine's frame: x across, y along."""

    def in_frame(pins: Mapping[int, Point]) -> dict[int, Point]:
        return {i: from_picture(point, problem.direction) for i, point in pins.items()}

    return replace(
        problem,
        pins=in_frame(problem.pins),
        modules=tuple(
            replace(
                m,
                pins=in_frame(m.pins),
                origin=None if m.origin is None else from_picture(m.origin, problem.direction),
            )
            for m in problem.modules
        ),
    )


class Composer:
    """Draws a problem; each kind of instance in it once."""

    def __init__(self, problem: LayoutProblem) -> None:
        """Raises LayoutRefusalError where a mirror pairs what cannot be mirror images."""
        self._book = Book(problem)
        self._kinds: dict[tuple[int, Direction, ShapeKey, bool], Drawing] = {}
        self._shape = Shape()
        #: whether anything can be folded; what, and into how many bands or rows
        self._folding = False
        self._folds: dict[Fold, range] = {}
        #: how the whole looks in a shape, and into how many bands it can be folded then
        self._drafts: dict[frozenset[tuple[Fold, int]], tuple[Drawing, range]] = {}

    def whole(self, routed: bool = True) -> Drawing:
        """The drawing of the problem; without ``routed`` that of its neurons and frames alone, which stand where they
        do with it. Raises LayoutRefusalError for what cannot be met."""
        return self.compose(self._shaped(), routed)

    def cost(self) -> float:
        """What the problem costs of the page in the shape in which it costs least."""
        problem = self._shaped()
        drawing = self._in_shape(problem, replace(self._shape, draft=True))
        cost = PageCost(problem, [(edge.source, edge.target) for edge in problem.edges], directed=True)
        return cost(drawing.places, drawing.rect())

    def _shaped(self) -> LayoutProblem:
        """The whole, of which it is known then in which shape it is drawn."""
        problem = self._book.whole()
        problem = replace(problem, pins=self._with_origins(problem))
        self._folding = may_be_folded(problem)
        if self._folding:
            self._shape = compact(problem, self._in_shape, self._folds)
        return problem

    def _in_shape(self, problem: LayoutProblem, shape: Shape) -> Drawing:
        """The drawing of the whole in a shape; the same shape is tried in several orders of folds."""
        key = frozenset(shape.counts.items())
        if key not in self._drafts:
            self._shape = shape
            self._drafts[key] = self.compose(problem), self._folds[WHOLE, RANKS]
        drawing, self._folds[WHOLE, RANKS] = self._drafts[key]
        return drawing

    def check_mirrors(self) -> None:
        """Raises LayoutRefusalError where an arrangement cannot be symmetric, in the problem or in a kind of instance,
        before anything is drawn."""
        whole = self._book.whole()
        kinds = sorted({int(module.template) for module in whole.modules})
        for problem in (whole, *map(self._book.problem_of, kinds)):
            pair = mirror_images(problem)
            arranged_on_axis(problem, pair, {m for module in problem.modules for m in module.members})

    def _with_origins(self, problem: LayoutProblem) -> dict[int, Point]:
        """The pins, and for instances whose origin is pinned the places of all of their neurons that keep off these."""
        second = {b for mirror in problem.mirrors for _, b in mirror.pairs}
        free: dict[int, Point] = {}
        for module in problem.modules:
            if module.origin is not None:
                drawing = self.kind(int(module.template), problem.direction)
                way = shifted_by((0.0, 0.0), not drawing.fixed and module.members[0] in second)
                free.update(zip(module.members, map(way.point, drawing.places), strict=True))
        return with_origins(problem, free, problem.direction in ("up", "left"))

    def kind(self, number: int, direction: Direction, routed: bool = True) -> Drawing:
        """The drawing of a kind of instance in a direction, in the frame of an engine that draws in it."""
        problem = self._book.problem_of(number)
        key = number, direction, self._shape.of(number, problem), routed
        if key not in self._kinds:
            self._kinds[key] = self.compose(replace(problem, direction=direction), routed, number)
        return self._kinds[key]

    def compose(self, problem: LayoutProblem, routed: bool = True, kind: int = WHOLE) -> Drawing:
        """The drawing of one problem, that of a ``kind`` of instance or of the whole, its modules named by their kinds;
        without ``routed``, and in a draft, no connection between its frames has a route."""
        pair = mirror_images(problem)
        standing = self._on_page(problem, pair, kind) if problem.plan else self._standing(problem, pair, kind)
        return standing.joined(pair, routed and not self._shape.draft)

    def _on_page(self, problem: LayoutProblem, pair: Mapping[int, int], kind: int) -> Standing:
        """Where everything stands whose cells say in which row and column."""
        parts, cells = parts_by_cell(problem, pair)
        return stands(replace(self._frame(problem, parts, pair, kind), cells=cells, upright=self._upright(kind)))

    def _standing(self, problem: LayoutProblem, pair: Mapping[int, int], kind: int) -> Standing:
        """Where everything stands, with those boxes as frames or columns that foreign neurons would stand in."""
        loose = {i for i in range(len(problem.boxes)) if may_be_frame(problem, i, pair)}
        frames = {i for i in loose if holds_instance(problem, i)}
        known: dict[_Known, Piece] = {}
        while True:
            parts = parts_of(problem, frames, pair)
            frame = self._frame(problem, parts, pair, kind, known)
            standing = stands(frame)
            entered = {i for i in loose - frames if standing.entered(i, problem.boxes[i][1])}
            if not entered:
                return standing
            columns = columns_of(problem, parts, loose - frames) if not pair else frozenset()
            if entered <= columns:
                standing = stands(replace(frame, columns=columns))
                if not any(standing.entered(i, problem.boxes[i][1]) for i in loose - frames):
                    return standing
            frames |= entered

    def _frame(
        self,
        problem: LayoutProblem,
        parts: Sequence[Part],
        pair: Mapping[int, int],
        kind: int,
        known: dict[_Known, Piece] | None = None,
    ) -> Frame:
        """A frame before any phase; ``known`` are boxes that are drawn already."""
        piece = partial(self._piece, problem, parts, {} if known is None else known)
        redrawn = partial(self._redrawn, problem)
        return Frame(problem, pair, kind, parts, piece, redrawn, self._shape, self._folding, self._folds)

    def _upright(self, kind: int) -> bool:
        """Whether no frame around a kind of instance is reflected so that it stands on its head."""
        whole = self._book.whole()
        inner = {int(module.template) for module in whole.modules if module.parent >= 0}
        return kind == WHOLE or (kind >= 0 and kind not in inner and whole.direction in ("down", "up"))

    def _redrawn(self, problem: LayoutProblem, piece: Piece, pins: Mapping[int, Point]) -> Piece:
        """A piece drawn anew, around pins of its neurons."""
        part = piece.part
        inner = self._book.problem_of(part.kind) if part.kind >= 0 else _boxed(problem, part)
        return piece_of(part, self.compose(replace(inner, pins=pins), kind=NONE))

    def _piece(
        self,
        problem: LayoutProblem,
        parts: Sequence[Part],
        known: dict[_Known, Piece],
        part: Part,
        direction: Direction,
        routed: bool = True,
    ) -> Piece:
        """One of the parts, drawn in a direction, ``routed`` or not, or as it is ``known``; a mirror image as what it
        is the image of."""
        lead = parts[part.image_of] if part.image_of >= 0 else part
        key = lead, direction, routed
        if key not in known:
            if lead.kind >= 0:
                drawing = self.kind(lead.kind, direction, routed)
            else:
                drawing = self.compose(replace(_boxed(problem, lead), direction=direction), routed, NONE)
            known[key] = piece_of(lead, in_direction(drawing, direction, problem.direction))
        return replace(known[key], part=part)


def _boxed(problem: LayoutProblem, part: Part) -> LayoutProblem:
    """A box as a problem of its own."""
    place = {neuron: i for i, neuron in enumerate(part.members)}
    pairs = tuple(
        (place[a], place[b]) for mirror in problem.mirrors for a, b in mirror.pairs if a in place and b in place
    )
    lines = (tuple(place[m] for m in line if m in place) for line in problem.align)
    return replace(
        restricted(problem, [part.members]),
        title=title_room(problem.boxes[part.box][0], BOX_WEIGHT) if part.box >= 0 else 0.0,
        mirrors=(LayoutMirror(-1, pairs),) if pairs else (),
        align=tuple(line for line in lines if len(line) > 1),
    )
