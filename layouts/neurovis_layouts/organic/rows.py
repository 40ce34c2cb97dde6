"""Rows: a drawing much longer than a page, as of a chain of clusters, cut across, its pieces side by side; and the
direction in which that fits a page that is asked for.

In: a problem and places in the engine's frame. Out: the problem in that direction (``directed``), and places
(``in_rows``): as many rows as make it about as long as a page, or columns of what is long along the direction. Rows go
to and fro, so that what follows each other stays near; columns begin at the top each, so that most of what runs along
the direction still does: where all does the whole stays. Boxes are cut nowhere.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from neurovis_layouts.boxed import framed
from neurovis_layouts.frame import to_picture
from neurovis_layouts.organic.levels import SPARSE
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.model import TURNED, LayoutProblem

#: What is longer than a page by this is cut, if it has more neurons than this.
_LONGEST, _MANY = 2.5, 200
#: What is free between two rows, in spacings.
_BETWEEN = 2.0


def directed(problem: LayoutProblem, places: FloatArray) -> LayoutProblem:
    """The problem in the direction in which places (n, 2) fit a smaller page, where the page may choose."""
    if not problem.turns or not len(places):
        return problem
    turned = replace(problem, direction="right")
    return turned if _side(turned, places) < TURNED * _side(problem, places) else problem


def _side(problem: LayoutProblem, places: FloatArray) -> float:
    """How high a page has to be, at least, for places to fit as they stand in rows, in the problem's direction."""
    across, along = (np.ptp(in_rows(problem, places), axis=0) + problem.neuron_spacing).tolist()
    wide, high = to_picture((across, along), problem.direction)
    return max(wide / problem.page, high)


def in_rows(problem: LayoutProblem, places: FloatArray) -> FloatArray:
    """Places (n, 2), in rows where they would be too long otherwise."""
    if problem.pins or problem.mirrors or len(places) <= _MANY:
        return places
    size = np.ptp(places, axis=0) + problem.neuron_spacing
    page = 1.0 if problem.aspect is None else problem.aspect
    shares = size / ((page, 1.0) if problem.direction in ("down", "up") else (1.0, page))
    long = int(shares[1] > shares[0])
    if shares[long] <= _LONGEST * shares[1 - long] or (long and len(problem.edges) <= SPARSE * len(places)):
        return places
    count = max(2, round(math.sqrt(shares[long] / shares[1 - long])))
    there = places[:, long].copy()
    for box in framed(problem):
        there[box.members] = there[box.members].mean()
    low = there.min()
    row = np.clip((there - low) * count / max(np.ptp(there), 1e-9), 0, count - 1).astype(np.int64)
    result, at = places.copy(), 0.0
    for number in range(count):
        own = np.flatnonzero(row == number)
        if not len(own):
            continue
        along, across = places[own, long], places[own, 1 - long]
        back = number % 2 == 1 and not long
        result[own, long] = along.max() - along if back else along - along.min()
        result[own, 1 - long] = at + across - across.min()
        at += float(np.ptp(across)) + _BETWEEN * problem.neuron_spacing
    return result
