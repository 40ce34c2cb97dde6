"""Frame layout: what a frame holds, drawn and put together: the phases of which ``engine`` has the list.

In: a Frame with its parts, to which each phase adds what it makes. Out: where everything in it stands.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Protocol, TypeAlias

from neurovis_layouts.alike import Move
from neurovis_layouts.frame import from_picture, to_picture
from neurovis_layouts.label_room import roomy, sides_of
from neurovis_layouts.layered.bands import FEW, MANY_LINES, Wanted
from neurovis_layouts.layered.compact import RANKS, Fold, Shape, grouped
from neurovis_layouts.layered.component_layout import ComponentLayout, RankProblem
from neurovis_layouts.layered.components import planned
from neurovis_layouts.layered.drawing import Piece, brought
from neurovis_layouts.layered.frame_routing import Standing
from neurovis_layouts.layered.page_plan import facing
from neurovis_layouts.layered.parts import Part, images_in
from neurovis_layouts.layered.pinning import Redraw, Settled, pinned
from neurovis_layouts.layered.same_rank import bonded, driven
from neurovis_layouts.layered.units import Unit, symmetric_units
from neurovis_spec.layout.geometry import snap
from neurovis_spec.layout.model import Direction, LayoutProblem

#: How a component is laid out in ranks.
LayOut: TypeAlias = Callable[[RankProblem], ComponentLayout]


class DrawPart(Protocol):
    """How a part is drawn."""

    def __call__(self, part: Part, direction: Direction, routed: bool = True) -> Piece:
        """It in a direction, with routes or without."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame as far as the phases have come with it; what a phase makes, the next ones read."""

    problem: LayoutProblem
    #: mirror images, both ways
    pair: Mapping[int, int]
    #: the kind of instance that it is, or the whole
    kind: int
    parts: Sequence[Part]
    draw: DrawPart
    redraw: Redraw
    shape: Shape
    #: whether anything can be folded; what, and into how many bands or rows, which phases note
    folding: bool
    folds: dict[Fold, range]
    #: boxes to be drawn as columns where that can be
    columns: AbstractSet[int] = frozenset()
    #: with a plan the cell in which each part stands, and whether nothing turns the whole upside down
    cells: Mapping[int, int] = field(default_factory=dict)
    upright: bool = False
    #: the parts as drawn, and how they are moved to their places
    pieces: Sequence[Piece] = ()
    resting: Sequence[tuple[Piece, Move]] = ()
    units: Sequence[Unit] = ()
    #: instances that stand in one row, each known by a neuron; pairs of which the second stands in a later row
    rows: Sequence[Sequence[int]] = ()
    behind: Sequence[tuple[int, int]] = ()
    #: by unit, a number that units of one rank share
    bonds: Sequence[int] = ()
    layout: ComponentLayout = field(default_factory=ComponentLayout)
    rests: Settled = field(default_factory=lambda: Settled([], []))

    def standing(self) -> Standing:
        """Where everything stands."""
        return Standing.of(self.problem, self.layout, self.rests, self.units, self.columns)


def with_page(frame: Frame) -> Frame:
    """Parts as they face each other on a page of rows and columns, and where they stand."""
    # routes, which cost most, are drawn once it is known how each part is turned
    sketched = partial(frame.draw, routed=False)
    resting = facing(frame.problem, frame.parts, frame.cells, frame.pair, sketched, frame.draw, frame.upright)
    layout = ComponentLayout()
    for piece, move in resting:
        layout.places.update(zip(piece.part.members, map(move.point, piece.drawing.places), strict=True))
    return replace(frame, layout=layout, resting=resting)


def with_pieces(frame: Frame) -> Frame:
    """Each part drawn by itself."""
    return replace(frame, pieces=[frame.draw(part, frame.problem.direction) for part in frame.parts])


def with_units(frame: Frame) -> Frame:
    """What is placed as one piece: neurons, blocks, frames."""
    problem, pieces = frame.problem, frame.pieces
    kin: dict[str, int] = {}
    for number, piece in enumerate(pieces, len(problem.groups)):
        if piece.part.family:
            kin.setdefault(piece.part.family, number)
    bound = {m for module in problem.modules for m in module.pins}
    frames = [_unit(piece, kin.get(piece.part.family, -1), frame.pair, bound) for piece in pieces]
    return replace(frame, units=symmetric_units(problem, frames, frame.pair))


def with_rows(frame: Frame) -> Frame:
    """The rows in which instances declared together (a family) stand; notes in how many they may."""
    families: dict[tuple[str, int], list[int]] = {}
    for part in (piece.part for piece in frame.pieces if piece.part.family):
        families.setdefault((part.family, part.kind), []).append(min(part.members))
    chains = _chains(frame, families)
    lines = {m for line in frame.problem.align for m in line}
    held = {piece.part.kind for piece in frame.pieces if lines.intersection(piece.part.members)}
    rows: list[list[int]] = []
    behind: list[tuple[int, int]] = []
    alike = {} if frame.pair else _alike(families)
    for key, family in (*families.items(), *alike.items()):
        make, apart = key[1], key in alike or chains.get(key, False)
        if make not in held:
            tries = frame.folds.get((frame.kind, make), range(2, 2))
            first = 1 if apart and key not in alike else tries.start
            frame.folds[frame.kind, make] = range(first, max(len(family) + 1, tries.stop))
        count = frame.shape.rows(frame.kind, make)
        # mirrored chains are columns that face each other, unless rows are asked for: each finds a rank of its own; and
        # so does what is not declared together
        if count is not None or not apart:
            own = in_rows(family, count or 1)
            behind += [(before[0], after[0]) for before, after in pairwise(own)]
            rows += own
    return replace(frame, rows=rows, behind=behind)


def _alike(families: Mapping[tuple[str, int], Sequence[int]]) -> dict[tuple[str, int], list[int]]:
    """Those that are declared each by itself, of one kind together, where there are several."""
    found: dict[tuple[str, int], list[int]] = {}
    for (_, make), family in families.items():
        if len(family) == 1:
            found.setdefault(("", make), []).extend(family)
    return {key: family for key, family in found.items() if len(family) > 1}


def _chains(frame: Frame, families: Mapping[tuple[str, int], Sequence[int]]) -> Mapping[tuple[str, int], bool]:
    """Whether mirrored instances that are declared together drive each other; columns that nothing folds would be
    towers."""
    foldable = families if frame.folding else {}
    images = {key: family for key, family in foldable.items() if not frame.pair.keys().isdisjoint(family)}
    return dict(zip(images, driven(frame.problem, frame.units, frame.pair, images.values()), strict=True))


def with_bonds(frame: Frame) -> Frame:
    """Who shares a rank, and how far behind its line each stands."""
    units, bonds = bonded(frame.problem, _spread(frame.problem, frame.units), frame.pair, frame.rows)
    return replace(frame, units=units, bonds=bonds)


def with_components(frame: Frame, laid_out: LayOut) -> Frame:
    """What hangs together ``laid_out`` in ranks, and packed; notes in how many bands it may stand."""
    problem, units, shape = frame.problem, frame.units, frame.shape
    # a ring or a line of which a box holds some alone can be in no strip of its own
    columns = {box for box in frame.columns if _whole(units, problem.boxes[box][1])}
    few = FEW if frame.kind >= 0 or problem.modules else MANY_LINES if grouped(problem) else 1
    wanted = Wanted(shape.bands(frame.kind), few)
    ranks = RankProblem(
        problem,
        units,
        frame.bonds,
        range(len(problem.edges)),
        frame.pair,
        columns,
        frame.behind,
        wanted,
        shape.draft,
    )
    layout = planned(ranks, laid_out)
    frame.folds[frame.kind, RANKS] = range(2, layout.cuts + 2)
    resting = [_resting(layout, piece) for piece in frame.pieces]
    return replace(frame, columns=columns, layout=layout, resting=resting)


def with_pins(frame: Frame) -> Frame:
    """Final places, pins exact."""
    rests = pinned(frame.problem, frame.layout, frame.resting, frame.pair, frame.redraw)
    return replace(frame, rests=rests)


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
