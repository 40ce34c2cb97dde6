"""Compact: how often frames are folded, so that the whole comes near to the proportions of a page.

In: a problem, and how it is drawn in a shape. Out: the shape in which it takes least of a page: in how many bands (see
``bands``) the ranks of each kind of instance, and those of the whole, stand, and in how many rows the instances of a
kind that are declared together. What is near to these proportions is left as it is, so that signals run one way. Shapes
are tried as drafts, judged by what the page costs (``page_cost``); only the one that is chosen is drawn in full.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from operator import attrgetter
from typing import TypeAlias

from neurovis_layouts.layered.drawing import Drawing
from neurovis_layouts.layered.page_cost import PageCost, sides, stretched
from neurovis_layouts.layered.tries import cheapest, steps
from neurovis_spec.layout.model import LayoutProblem

#: The number of the whole, beside those of kinds of instances; and of what is never folded.
WHOLE, NONE = -1, -2
#: What is folded where ranks are.
RANKS = -1
#: What is longer than a page by this is folded, unless it is no longer than so many units, which can be read as it is:
#: instances on a page that is asked for, and all else.
_STRETCHED, _SHORT = (1.25, 2.0), (12.0, 24.0)
#: What that has to be worth of what it costs as it is.
_WORTH = (0.95, 0.75)
#: What has more neurons and connections than this is not folded.
_MOST = 3000
#: Nothing is longer than the page by this if it can be folded, whatever that costs; without instances only what has
#: more neurons than this, as lines that run back are worth more in a smaller picture.
_LONGEST, _MANY = 2.5, 200


#: What can be folded: the ranks of a kind of instance, or of the whole (its number, RANKS), or the rows of instances of
#: one kind (the second number) in another.
Fold: TypeAlias = tuple[int, int]
#: What of a shape concerns a drawing, and whether that is a draft.
ShapeKey: TypeAlias = tuple[bool, tuple[tuple[Fold, int], ...]]


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
    """Whether nothing says where on the page something stands, and it is not too large to try. Without instances and
    groups only a page that is asked for is worth that signals run back."""
    fixed = problem.plan or problem.pins or any(module.pins for module in problem.modules)
    asked = problem.modules or problem.aspect is not None or grouped(problem)
    return bool(asked) and not fixed and not too_large(problem)


def too_large(problem: LayoutProblem) -> bool:
    """Whether to draw it several times would take too long."""
    return len(problem.neurons) + len(problem.edges) > _MOST


def grouped(problem: LayoutProblem) -> bool:
    """Whether neurons come in groups, so that a network that is cut can be followed by these."""
    return 2 * len(problem.groups) <= len(problem.neurons)


@dataclass(frozen=True, slots=True)
class _Tried:
    """A shape, what it costs, and how many times as long as the page it is."""

    cost: float
    long: float
    shape: Shape


def compact(problem: LayoutProblem, drawn: Drawn, folds: Mapping[Fold, range]) -> Shape:
    """The shape that costs least, or, of what would be too long so, least of those that are not. ``folds`` says, once
    it has been drawn, what can be folded, and into how many bands or rows. The one may leave no room for the other:
    bands are tried first, and rows."""
    drawing = drawn(problem, Shape(draft=True))
    size = sides(drawing.rect(), problem.direction)
    free = int(problem.aspect is None or not problem.modules)
    worth = problem.modules or problem.aspect is not None
    short = stretched(problem, *size) < _STRETCHED[free] or not worth
    if (short and not (free and _long(problem, drawing) > _LONGEST)) or max(size) < _SHORT[free]:
        return Shape()
    cost = PageCost(problem, [(edge.source, edge.target) for edge in problem.edges], directed=True)
    every: list[_Tried] = []

    def tried(shape: Shape, drawing: Drawing) -> _Tried:
        every.append(_Tried(cost(drawing.places, drawing.rect()), _long(problem, drawing), shape))
        return every[-1]

    def changed(shape: Shape, fold: Fold, count: int) -> _Tried:
        other = shape.changed(fold, count)
        return tried(other, drawn(problem, other))

    first = tried(Shape(draft=True), drawing)
    best: list[_Tried] = []
    for rows_first in (False, True):
        found = first
        for fold in sorted(folds, key=lambda fold: ((fold[1] == RANKS) == rows_first, fold)):
            found = cheapest(partial(changed, found.shape, fold), steps(folds[fold]), found)
        best.append(found)
    least = min(best, key=attrgetter("cost"))
    cheap = least.cost < _WORTH[free] * first.cost
    chosen = least if worth and cheap else first
    if free and chosen.long > _LONGEST and (worth or cheap or len(problem.neurons) > _MANY):
        chosen = min(every, key=lambda one: (max(one.long, _LONGEST), one.cost))
    return replace(chosen.shape, draft=False) if chosen is not first else Shape()


def _long(problem: LayoutProblem, drawing: Drawing) -> float:
    """How many times as wide as high a drawing is, or as high as wide; where a page is asked for, for its sides."""
    wide, high = sides(drawing.rect(), problem.direction)
    page = 1.0 if problem.aspect is None else problem.aspect
    return max(wide / (page * high), page * high / wide)
