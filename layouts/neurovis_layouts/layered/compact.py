"""Compact: how often frames are folded, so that the whole comes near to the proportions of a page.

In: a problem, and how it is drawn in a shape. Out: the shape in which it takes least of a page: in how many bands (see
``bands``) the ranks of each kind of instance, and those of the whole, stand, and in how many rows the instances of a
kind that are declared together. What is near to these proportions is left as it is, so that signals run one way. Shapes
are tried as drafts, which show how large the whole becomes, and how often connections would cross each other and run
over discs if they were straight; only the one that is chosen is drawn in full.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from operator import itemgetter
from typing import TypeAlias

import numpy as np

from neurovis_layouts.layered.drawing import Drawing
from neurovis_layouts.routing.obstacles import REACH
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.geometry import crossing, lengths, squared_distances
from neurovis_spec.layout.model import Direction, LayoutProblem

#: The number of the whole, beside those of kinds of instances; and of what is never folded.
WHOLE, NONE = -1, -2
#: What is folded where ranks are.
RANKS = -1
#: What is longer than a page by this is folded, unless it is no longer than so many units, which can be read as it is:
#: instances on a page that is asked for, and all else.
_STRETCHED, _SHORT = (1.25, 2.0), (12.0, 24.0)
#: What that has to be worth of what it costs as it is: on a page that is asked for, in rows, and in bands, from which
#: lines run back.
_ASKED, _ROWS, _BANDS = 0.9, 0.6, 0.5
#: Each single fold has to be worth this.
_EACH = 0.9
#: What it costs if all connections run back: one in ten is worth twice the page.
_BACK = 10.0
#: What it costs if each connection is crossed once, as straight lines would be: half of the page (with 1: a ring of
#: instances stays in one row, as lines to a second one would cross).
_CROSSING = 0.5
#: So many numbers of bands one after the other are tried in vain.
_IN_VAIN = 2
#: In no more bands or rows than this, nor more neurons and connections.
_MOST_FOLDS, _MOST = 8, 3000


#: What can be folded: the ranks of a kind of instance, or of the whole (its number, RANKS), or the rows of instances of
#: one kind (the second number) in another.
Fold: TypeAlias = tuple[int, int]
#: What of a shape concerns a drawing, and whether that is a draft.
ShapeKey: TypeAlias = tuple[bool, tuple[tuple[Fold, int], ...]]
#: Of more lines than so many nothing is counted.
_MOST_LINES = 300


@dataclass(frozen=True, slots=True)
class Shape:
    """How many bands or rows there are of what is folded; of a ``draft`` only the size counts. What is not folded is
    as it comes."""

    counts: Mapping[Fold, int] = field(default_factory=dict)
    draft: bool = False

    def bands(self, where: int) -> int:
        """How many bands the ranks of a kind of instance stand in."""
        return self.counts.get((where, RANKS), 1)

    def rows(self, where: int, what: int) -> int | None:
        """How many rows instances of one kind that are declared together stand in, in another kind, if it says so."""
        return self.counts.get((where, what))

    def of(self, kind: int, problem: LayoutProblem) -> ShapeKey:
        """What of it concerns one kind of instance, whose problem this is."""
        inside = {kind, *(int(module.template) for module in problem.modules)}
        return self.draft, tuple((fold, count) for fold, count in sorted(self.counts.items()) if fold[0] in inside)

    def changed(self, fold: Fold, count: int) -> Shape:
        """Another number of bands or rows."""
        return replace(self, counts={**self.counts, fold: count})


#: How a problem is drawn in a shape.
Drawn: TypeAlias = Callable[[LayoutProblem, Shape], Drawing]


def may_be_folded(problem: LayoutProblem) -> bool:
    """Whether nothing says where on the page something stands, and it is not too large to try. Without instances only a
    page that is asked for is worth that signals run back."""
    fixed = problem.plan or problem.pins or any(module.pins for module in problem.modules)
    asked = problem.modules or problem.aspect is not None
    return bool(asked) and not fixed and len(problem.neurons) + len(problem.edges) <= _MOST


def compact(problem: LayoutProblem, drawn: Drawn, folds: Mapping[Fold, range]) -> Shape:
    """The shape that costs least. ``folds`` says, once it has been drawn, what can be folded, and into how many bands
    or rows. The one may leave no room for the other: bands are tried first, and rows."""
    shape = Shape(draft=True)
    drawing = drawn(problem, shape)
    size = _size(drawing, problem.direction)
    free = int(problem.aspect is None or not problem.modules)
    if stretched(problem, *size) < _STRETCHED[free] or max(size) < _SHORT[free]:
        return Shape()
    lines = [(edge.source, edge.target) for edge in problem.edges]
    cost = partial(_cost, problem, lines, unrelated(lines))
    first = cost(drawing)
    tried: list[tuple[float, Shape]] = []
    for rows_first in (False, True):
        found = first, shape
        for fold in sorted(folds, key=lambda fold: ((fold[1] == RANKS) == rows_first, fold)):
            found = _folded(lambda shape: cost(drawn(problem, shape)), fold, folds[fold], *found)
        tried.append(found)
    least, shape = min(tried, key=itemgetter(0))
    bands = any(what == RANKS and count > 1 for (_, what), count in shape.counts.items())
    worth = (_BANDS if bands else _ROWS) if free else _ASKED
    return replace(shape, draft=False) if least < worth * first else Shape()


def _folded(
    cost: Callable[[Shape], float], fold: Fold, counts: range, least: float, shape: Shape
) -> tuple[float, Shape]:
    """The least cost, and the shape that has it, with any of these numbers of bands or rows of one kind; once more have
    been no better for some times, even more are not tried."""
    best, found, vain = least, shape, 0
    for count in counts:
        if count > _MOST_FOLDS:
            break
        other = shape.changed(fold, count)
        now = cost(other)
        vain += 1
        if now < _EACH * best:
            best, found, vain = now, other, 0
        if vain == _IN_VAIN:
            break
    return best, found


def _size(drawing: Drawing, direction: Direction) -> tuple[float, float]:
    """Width and height in the picture."""
    x0, y0, x1, y1 = drawing.rect()
    return (x1 - x0, y1 - y0) if direction in ("down", "up") else (y1 - y0, x1 - x0)


def stretched(problem: LayoutProblem, wide: float, high: float) -> float:
    """How much wider or higher than a page something of this size is."""
    return max(wide / (problem.page * high), problem.page * high / wide)


def _cost(
    problem: LayoutProblem, lines: Sequence[tuple[int, int]], apart: tuple[IntArray, IntArray], drawing: Drawing
) -> float:
    """How large a page is that holds a drawing, times how long straight lines between the ends of its connections
    are, times what those cost that run back, times what it costs that these lines cross."""
    wide, high = _size(drawing, problem.direction)
    page = max(wide, problem.page * high) ** 2
    ends = np.array([(drawing.places[a], drawing.places[b]) for a, b in lines], dtype=np.float64).reshape(-1, 2, 2)
    length = math.fsum(lengths(ends[:, 1] - ends[:, 0]).tolist())
    back = int((ends[:, 0, 1] > ends[:, 1, 1]).sum())
    many = max(1, len(lines))
    return page * length * (1 + _BACK * back / many) * (1 + _CROSSING * crossings(ends, *apart) / many)


def unrelated(lines: Sequence[tuple[int, int]]) -> tuple[IntArray, IntArray]:
    """Every two of these pairs of neurons that have none in common; none where they are too many to be followed."""
    one, other = np.triu_indices(len(lines) if len(lines) <= _MOST_LINES else 0, 1)
    ends = np.array(lines, dtype=np.int64).reshape(-1, 2)
    shared = (ends[one][:, :, None] == ends[other][:, None, :]).any(axis=(1, 2))
    return one[~shared], other[~shared]


def crossings(lines: FloatArray, one: IntArray, other: IntArray) -> int:
    """How many of these pairs of straight lines (n, 2, 2) cross."""
    (a, b), (c, d) = lines[one].transpose(1, 2, 0), lines[other].transpose(1, 2, 0)
    return int(crossing(a, b - a, c, d - c)[1].sum())


def run_over(lines: FloatArray, places: FloatArray) -> int:
    """How many discs at these places (k, 2) straight lines (n, 2, 2) run over, but for those at their ends."""
    if len(lines) > _MOST_LINES:
        return 0
    x, y = (places[None] - lines[:, None, 0]).transpose(2, 0, 1)
    dx, dy = (lines[:, 1] - lines[:, 0]).T[:, :, None]
    over = squared_distances(x, y, dx, dy) < REACH * REACH
    return int(over.sum()) - 2 * len(lines)
