"""Hierarchy: draws frames from the inside out, and puts their drawings together into that of the whole.

In: a problem. Out: a Drawing. Every kind of instance is drawn once, by itself, with the instances in it as blocks; the
drawing is then a block in what is around it, moved or reflected by steps of the grid, so that copies are exact. A box
becomes such a frame where neurons that are not its own would stand in it otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from functools import partial
from itertools import pairwise

from neurovis_layouts.alike import Move, mirror_images, shifted_by
from neurovis_layouts.frame import from_picture, to_picture
from neurovis_layouts.label_room import roomy, sides_of
from neurovis_layouts.layered.bands import FEW, Wanted
from neurovis_layouts.layered.compact import NONE, RANKS, WHOLE, Fold, Shape, ShapeKey, compact, may_be_folded
from neurovis_layouts.layered.component_layout import ComponentLayout, RankProblem
from neurovis_layouts.layered.components import planned
from neurovis_layouts.layered.drawing import Drawing, Piece, brought, piece_of
from neurovis_layouts.layered.frame_routing import Standing
from neurovis_layouts.layered.page_plan import facing, in_direction, parts_by_cell
from neurovis_layouts.layered.parts import Part, columns_of, holds_instance, images_in, may_be_frame, parts_of
from neurovis_layouts.layered.pinning import pinned
from neurovis_layouts.layered.same_rank import bonded, driven
from neurovis_layouts.layered.templates import Book, restricted
from neurovis_layouts.layered.units import Unit, arranged_on_axis, symmetric_units
from neurovis_layouts.pins import with_origins
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.labels import BOX_WEIGHT, title_room
from neurovis_spec.layout.model import Direction, LayoutMirror, LayoutProblem, Point


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

    def whole(self, routed: bool = True) -> Drawing:
        """The drawing of the problem; without ``routed`` that of its neurons and frames alone, which stand where they
        do with it. Raises LayoutRefusalError for what cannot be met."""
        problem = self._book.whole()
        problem = replace(problem, pins=self._with_origins(problem))
        self._folding = may_be_folded(problem)
        if self._folding:
            self._shape = compact(problem, self._in_shape, self._folds)
        return self.compose(problem, routed)

    def _in_shape(self, problem: LayoutProblem, shape: Shape) -> Drawing:
        """The drawing of the whole in a shape."""
        self._shape = shape
        return self.compose(problem)

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
        routed = routed and not self._shape.draft
        pair = mirror_images(problem)
        if problem.plan:
            return self._on_page(problem, pair, routed, kind)
        return self._standing(problem, pair, kind).joined(pair, routed)

    def _standing(self, problem: LayoutProblem, pair: Mapping[int, int], kind: int) -> Standing:
        """Where everything stands, with those boxes as frames or columns that foreign neurons would stand in."""
        loose = {i for i in range(len(problem.boxes)) if may_be_frame(problem, i, pair)}
        frames = {i for i in loose if holds_instance(problem, i)}
        known: dict[tuple[Part, Direction], Piece] = {}
        while True:
            parts = parts_of(problem, frames, pair)
            standing = self._attempt(problem, parts, pair, known, kind)
            entered = {i for i in loose - frames if standing.entered(i, problem.boxes[i][1])}
            if not entered:
                return standing
            columns = columns_of(problem, parts, loose - frames) if not pair else frozenset()
            if entered <= columns:
                standing = self._attempt(problem, parts, pair, known, kind, columns)
                if not any(standing.entered(i, problem.boxes[i][1]) for i in loose - frames):
                    return standing
            frames |= entered

    def _attempt(
        self,
        problem: LayoutProblem,
        parts: Sequence[Part],
        pair: Mapping[int, int],
        known: dict[tuple[Part, Direction], Piece],
        kind: int,
        columns: AbstractSet[int] = frozenset(),
    ) -> Standing:
        """Where everything stands with these parts; ``known`` are boxes that are drawn already."""
        pieces = [self._piece(problem, parts, known, True, part, problem.direction) for part in parts]
        kin: dict[str, int] = {}
        for number, piece in enumerate(pieces, len(problem.groups)):
            if piece.part.family:
                kin.setdefault(piece.part.family, number)
        bound = {m for module in problem.modules for m in module.pins}
        frames = [_unit(piece, kin.get(piece.part.family, -1), pair, bound) for piece in pieces]
        units = symmetric_units(problem, frames, pair)
        rows, behind = self._in_rows(problem, pieces, units, pair, kind)
        units, bonds = bonded(problem, _spread(problem, units), pair, rows)
        # a ring or a line of which a box holds some alone can be in no strip of its own
        columns = {box for box in columns if _whole(units, problem.boxes[box][1])}
        few = FEW if kind >= 0 or problem.modules else 1
        wanted = Wanted(self._shape.bands(kind), few)
        edges = range(len(problem.edges))
        plan = planned(RankProblem(problem, units, bonds, edges, pair, columns, behind, wanted, self._shape.draft))
        self._folds[kind, RANKS] = range(2, plan.cuts + 2)
        resting = [_resting(plan, piece) for piece in pieces]
        rests = pinned(problem, plan, resting, pair, partial(self._redrawn, problem))
        return Standing.of(problem, plan, rests, units, columns)

    def _in_rows(
        self,
        problem: LayoutProblem,
        pieces: Sequence[Piece],
        units: Sequence[Unit],
        pair: Mapping[int, int],
        kind: int,
    ) -> tuple[list[list[int]], list[tuple[int, int]]]:
        """The rows in which instances declared together (a family) stand, each known by a neuron of it; and pairs of
        neurons of which the second stands in a later row. Notes in how many rows they may stand."""
        families: dict[tuple[str, int], list[int]] = {}
        for piece in pieces:
            if piece.part.family:
                families.setdefault((piece.part.family, piece.part.kind), []).append(min(piece.part.members))
        rows: list[list[int]] = []
        behind: list[tuple[int, int]] = []
        lines = {m for line in problem.align for m in line}
        held = {piece.part.kind for piece in pieces if lines.intersection(piece.part.members)}
        # columns that nothing folds would be towers
        foldable = families if self._folding else {}
        images = {key: family for key, family in foldable.items() if not pair.keys().isdisjoint(family)}
        chains = dict(zip(images, driven(problem, units, pair, images.values()), strict=True))
        for key, family in families.items():
            make, apart = key[1], chains.get(key, False)
            if make not in held:
                tries = self._folds.get((kind, make), range(2, 2))
                self._folds[kind, make] = range(1 if apart else tries.start, max(len(family) + 1, tries.stop))
            count = self._shape.rows(kind, make)
            # mirrored chains are columns that face each other, unless rows are asked for: each finds a rank of its own
            if count is not None or not apart:
                own = in_rows(family, count or 1)
                behind += [(before[0], after[0]) for before, after in pairwise(own)]
                rows += own
        return rows, behind

    def _upright(self, kind: int) -> bool:
        """Whether no frame around a kind of instance is reflected so that it stands on its head."""
        whole = self._book.whole()
        inner = {int(module.template) for module in whole.modules if module.parent >= 0}
        return kind == WHOLE or (kind >= 0 and kind not in inner and whole.direction in ("down", "up"))

    def _on_page(self, problem: LayoutProblem, pair: Mapping[int, int], routed: bool, kind: int) -> Drawing:
        """The drawing of a problem whose cells say what stands in which row and column."""
        parts, where = parts_by_cell(problem, pair)
        # routes, which cost most, are drawn once it is known how each part is turned
        sketched, drawn = (partial(self._piece, problem, parts, {}, routed) for routed in (False, True))
        pieces = facing(problem, parts, where, pair, sketched, drawn, self._upright(kind))
        plan = ComponentLayout()
        for piece, move in pieces:
            plan.places.update(zip(piece.part.members, map(move.point, piece.drawing.places), strict=True))
        rests = pinned(problem, plan, pieces, pair, partial(self._redrawn, problem))
        return Standing.of(problem, plan, rests, (), frozenset()).joined(pair, routed)

    def _redrawn(self, problem: LayoutProblem, piece: Piece, pins: Mapping[int, Point]) -> Piece:
        """A piece drawn anew, around pins of its neurons."""
        part = piece.part
        inner = self._book.problem_of(part.kind) if part.kind >= 0 else _boxed(problem, part)
        return piece_of(part, self.compose(replace(inner, pins=pins), kind=NONE))

    def _piece(
        self,
        problem: LayoutProblem,
        parts: Sequence[Part],
        known: dict[tuple[Part, Direction], Piece],
        routed: bool,
        part: Part,
        direction: Direction,
    ) -> Piece:
        """One of the parts, drawn in a direction, ``routed`` or not, or as it is ``known``; a mirror image as what it
        is the image of."""
        lead = parts[part.image_of] if part.image_of >= 0 else part
        key = lead, direction
        if key not in known:
            if lead.kind >= 0:
                drawing = self.kind(lead.kind, direction, routed)
            else:
                drawing = self.compose(replace(_boxed(problem, lead), direction=direction), routed, NONE)
            known[key] = piece_of(lead, in_direction(drawing, direction, problem.direction))
        return replace(known[key], part=part)


def _unit(piece: Piece, kin: int, pair: Mapping[int, int], bound: AbstractSet[int]) -> Unit:
    """The unit that a piece is; it may turn if it is in no mirror, and none of its neurons is ``bound`` to a place."""
    part, (x, y), rect = piece.part, piece.middle, piece.rect
    flip = part.image_of >= 0
    places = tuple((-(px - x) + 0.0 if flip else px - x, py - y) for px, py in piece.drawing.places)
    reach = max(rect[2] - x, x - rect[0]), rect[3] - y
    alone = not images_in(part, pair) and piece.drawing.axis is None and bound.isdisjoint(part.members)
    return Unit(part.members, places, reach, kin, alone)


def _resting(plan: ComponentLayout, piece: Piece) -> tuple[Piece, Move]:
    """A piece, and the move from its own drawing to its place in the plan."""
    first = piece.part.members[0]
    flip = (piece.part.image_of >= 0) != (min(piece.part.members) in plan.reflected)
    return piece, brought(piece.drawing.places[0], plan.places[first], flip)


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


def in_rows(family: Sequence[int], rows: int) -> list[list[int]]:
    """Those declared together in so many rows, as they are numbered, the first ones longer where they are not equal.

    >>> in_rows([1, 2, 3, 4, 5], 2)
    [[1, 2, 3], [4, 5]]
    """
    ends = [-(-len(family) * (row + 1) // rows) for row in range(rows)]
    return [list(family[a:b]) for a, b in pairwise([0, *ends]) if b > a]


def _spread(problem: LayoutProblem, units: Sequence[Unit]) -> list[Unit]:
    """The units, blocks with room for the labels of their neurons."""
    sides = sides_of(problem)
    result: list[Unit] = []
    for unit in units:
        if unit.places is not None and unit.reach is None and any(sides[m] is not None for m in unit.members):
            there = {m: to_picture(p, problem.direction) for m, p in zip(unit.members, unit.places, strict=True)}
            grown = roomy(problem.labels, there, dict(enumerate(sides)), (True, False))
            places = (from_picture(grown[m], problem.direction) for m in unit.members)
            unit = replace(unit, places=tuple((snap(x), snap(y)) for x, y in places))
        result.append(unit)
    return result


def _whole(units: Sequence[Unit], members: Sequence[int]) -> bool:
    """Whether every unit is either all of these neurons' or none of it is."""
    own = set(members)
    return all(own.isdisjoint(unit.members) or own.issuperset(unit.members) for unit in units)
