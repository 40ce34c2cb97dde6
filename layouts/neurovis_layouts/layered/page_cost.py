"""The cost of a page: how large it is, how far from its proportions, and how hard to follow what runs on it.

In: where neurons stand, and the frame around all. Out: one number, lower is better, by which all ways of putting blocks
on a page are compared: as they come, in bands and rows (``compact``), in rows of frames (``folds``), facing each other
in the cells of a plan (``page_plan``). Routes cost most to draw, so that straight lines stand for them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from neurovis_layouts.routing.obstacles import REACH
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.geometry import Rect, crossing, lengths, squared_distances
from neurovis_spec.layout.model import Direction, LayoutProblem, Point

# What a page costs, in units of the layout: a line is as long as it is.

#: That the side of the page is a unit longer (with 2: the hexapod takes twice the area where ranks are farther apart).
_SIDE = 10.0
#: To cross a line, or to run over a disc, which only what has no passages through ranks does.
_CROSSING = 4.0
#: What all crossings cost at most, by the length of all lines: layers that are fully connected face each other, though
#: they cross less where one is turned away.
_CROSSED = 2.0
#: To run back against the direction of ranks (with 8: a chain of thirty neurons stands in eight bands).
_BACK = 15.0
#: What is no longer than this, in units of the layout, may have any proportions, unless a page is asked for.
_SMALL = 8.0
#: Of more lines than so many no crossings are counted.
_MOST_LINES = 300


class PageCost:
    """What pages with these ``lines`` cost, from neuron to neuron; ``directed`` are those that run through ranks, along
    the direction but where they cannot."""

    def __init__(self, problem: LayoutProblem, lines: Sequence[tuple[int, int]], directed: bool) -> None:
        self._problem, self._directed = problem, directed
        self._shaped = problem.aspect is not None
        self._lines: IntArray = np.array(lines, dtype=np.int64).reshape(-1, 2)
        self._apart = _unrelated(self._lines)

    def __call__(self, places: Sequence[Point] | FloatArray, rect: Rect) -> float:
        """What it costs that neurons stand at these places, and all within this frame."""
        wide, high = sides(rect, self._problem.direction)
        centres = np.array(places, dtype=np.float64).reshape(-1, 2)
        lines = centres[self._lines]
        length = math.fsum(lengths(lines[:, 1] - lines[:, 0]).tolist())
        met = min(_CROSSING * _crossings(lines, *self._apart), _CROSSED * length)
        back = int((lines[:, 0, 1] > lines[:, 1, 1]).sum())
        met += _BACK * back if self._directed else _CROSSING * _run_over(lines, centres)
        page = math.sqrt(stretched(self._problem, wide, high)) if self._shaped or max(wide, high) > _SMALL else 1.0
        return (_SIDE * math.sqrt(wide * high) + length + met) * page


def sides(rect: Rect, direction: Direction) -> tuple[float, float]:
    """Width and height in the picture."""
    across, along = rect[2] - rect[0], rect[3] - rect[1]
    return (across, along) if direction in ("down", "up") else (along, across)


def page_across(problem: LayoutProblem) -> float:
    """How far the page reaches across the direction, of how far it reaches along it."""
    return problem.page if problem.direction in ("down", "up") else 1 / problem.page


def stretched(problem: LayoutProblem, wide: float, high: float) -> float:
    """How much wider or higher than a page something of this size is."""
    return max(wide / (problem.page * high), problem.page * high / wide)


def _unrelated(lines: IntArray) -> tuple[IntArray, IntArray]:
    """Every two of these pairs of neurons that have none in common; none where they are too many to be followed."""
    one, other = np.triu_indices(len(lines) if len(lines) <= _MOST_LINES else 0, 1)
    shared = (lines[one][:, :, None] == lines[other][:, None, :]).any(axis=(1, 2))
    return one[~shared], other[~shared]


def _crossings(lines: FloatArray, one: IntArray, other: IntArray) -> int:
    """How many of these pairs of straight lines (n, 2, 2) cross."""
    (a, b), (c, d) = lines[one].transpose(1, 2, 0), lines[other].transpose(1, 2, 0)
    return int(crossing(a, b - a, c, d - c)[1].sum())


def _run_over(lines: FloatArray, places: FloatArray) -> int:
    """How many discs at these places (k, 2) straight lines (n, 2, 2) run over, but for those at their ends."""
    if len(lines) > _MOST_LINES:
        return 0
    x, y = (places[None] - lines[:, None, 0]).transpose(2, 0, 1)
    dx, dy = (lines[:, 1] - lines[:, 0]).T[:, :, None]
    over = squared_distances(x, y, dx, dy) < REACH * REACH
    return int(over.sum()) - 2 * len(lines)
