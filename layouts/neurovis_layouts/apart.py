"""Apart: discs that overlap are pushed off each other, and off the labels beside them, in small steps, all at once.

In: centres, and what labels cover around them. Out: centres no two of which are closer than a disc, where each has
moved as little as it takes; arcs that ran along the direction still do. Where there is no room the whole grows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from neurovis_spec.layout import BoolArray, FloatArray, IntArray
from neurovis_spec.layout.geometry import Cells, near_pairs
from neurovis_spec.layout.model import GRID, RADIUS

#: Centres are kept this far apart at least: rounding to the grid of coordinates takes some of it.
LEAST = 2 * RADIUS + 0.005
#: How far beyond half of what is missing a step goes, and after how many steps the whole grows by how much.
_EAGER, _PATIENCE, _GROWTH = 1.5, 10, 1.03
_ROUNDS = 1000
#: So many steps are made for arcs alone; where discs still overlap after so many, arcs give way.
_LATE, _LATEST = 200, 500
#: How far below its source the target of an arc stays, at least.
_BELOW = 0.05
#: Less than this is lost in rounding to the grid of coordinates.
_LEVEL = 2 * GRID
#: From a label to what it is kept off, and how much of it may be missing in the end.
_AIR, _MISSING = 0.1, 0.05


def jitter(count: int) -> FloatArray:
    """(count, 2) numbers from −0.5 to 0.5, spread evenly and the same every time (Roberts' sequence)."""
    steps = np.arange(1, count + 1, dtype=np.float64)[:, None] * np.array([0.7548776662466927, 0.5698402909980532])
    spread: FloatArray = steps % 1.0 - 0.5
    return spread


def apart(
    places: FloatArray,
    want: float,
    fixed: IntArray,
    arcs: tuple[IntArray, IntArray] | None = None,
    part: IntArray | None = None,
    kept: Callable[[FloatArray], FloatArray] | None = None,
    labels: FloatArray | None = None,
) -> FloatArray:
    """Places (n, 2), ``want`` apart where that is to be had, at least a disc. ``fixed`` ones stay. Of ``arcs``
    (sources, targets) those that run to higher y keep doing so. ``part`` (n,) says what grows together, by itself.
    ``kept`` puts places so that they keep what they have to, such as a symmetry. ``labels`` (n, 4) are the rectangles
    that labels cover around their centres, NaN where there is none."""
    count = len(places)
    part = np.zeros(count, dtype=np.int64) if part is None else part
    want = max(want, LEAST + 0.02)
    hold = np.ones((count, 1))
    hold[fixed] = 0.0
    places = places + hold * jitter(count) / 1024
    places = kept(places) if kept else places
    if arcs is not None:
        running = places[arcs[1], 1] > places[arcs[0], 1]
        arcs = arcs[0][running], arcs[1][running]
    for step in range(1, _ROUNDS):
        one, other, way, far = near_pairs(places, want)
        met = _on_labels(places, labels, hold[:, 0] > 0) if labels is not None else None
        clear = (not len(far) or far.min() >= LEAST) and (met is None or not met[3].any())
        if clear and (step > _LATE or arcs is None or (places[arcs[1], 1] > places[arcs[0], 1] + _LEVEL).all()):
            break
        push = way * ((want - far) / (2 * np.maximum(far, 1e-6)))[:, None]
        close = one[far < LEAST]
        if met is not None:
            one, other, push = (np.concatenate(both) for both in zip((one, other, push), met[:3], strict=True))
            close = np.concatenate([close, met[0][met[3]]])
        moves = _collected(count, one, other, push)
        if arcs is not None and step < _LATEST:
            moves[:, 1] += _below(places[:, 1], *arcs)
        places = places + hold * moves
        if step % _PATIENCE == 0:
            growing = np.bincount(part[close], minlength=int(part.max()) + 1)[part] > 0
            centre = _centres(places, part)
            places = np.where((hold > 0) & growing[:, None], centre + (places - centre) * _GROWTH, places)
        places = kept(places) if kept else places
    return places


def _on_labels(
    places: FloatArray, labels: FloatArray, free: BoolArray
) -> tuple[IntArray, IntArray, FloatArray, BoolArray]:
    """What comes too near to a label, a disc or another label, if either of both is ``free``: whose it is and the
    other, half of the way off (k, 2) from the first to the second, and whether that is too little to be left."""
    own = np.flatnonzero(np.isfinite(labels[:, 0]))
    low, high = places[own] + labels[own, :2] - _AIR, places[own] + labels[own, 2:] + _AIR
    middle, half = (low + high) / 2, (high - low) / 2
    label, disc, _ = Cells(places, float(np.hypot(*half.T).max(initial=0.0)) + 2 * RADIUS).near(middle)
    first, second = np.triu_indices(len(own), 1)
    one, other = np.concatenate([own[label], own[first]]), np.concatenate([disc, own[second]])
    way = np.concatenate([places[disc] - middle[label], middle[second] - middle[first]])
    missing = np.concatenate([half[label] + RADIUS, half[first] + half[second] - _AIR]) - np.abs(way)
    met = np.flatnonzero((missing > 0).all(axis=1) & (one != other) & (free[one] | free[other]))
    axis = np.argmin(missing[met], axis=1)
    least = missing[met, axis]
    push = np.zeros((len(met), 2))
    push[np.arange(len(met)), axis] = np.where(way[met, axis] < 0, -0.5, 0.5) * least
    return one[met], other[met], push, least > _MISSING


def _centres(places: FloatArray, part: IntArray) -> FloatArray:
    """(n, 2) the middle of the part that each place belongs to."""
    sums = np.stack([np.bincount(part, places[:, k]) for k in (0, 1)], axis=1)
    centres: FloatArray = (sums / np.maximum(np.bincount(part), 1)[:, None])[part]
    return centres


def _collected(count: int, one: IntArray, other: IntArray, push: FloatArray) -> FloatArray:
    """The mean of the pushes on each place, away from each other."""
    times = np.bincount(one, minlength=count) + np.bincount(other, minlength=count)
    moves: FloatArray = pushed(count, one, other, push) * (_EAGER / np.maximum(times, 1))[:, None]
    return moves


def pushed(count: int, one: IntArray, other: IntArray, push: FloatArray) -> FloatArray:
    """(count, 2) what pairs that push each other off add up to at each place, the pushes (k, 2) being on the other."""
    sums = [np.bincount(other, push[:, k], count) - np.bincount(one, push[:, k], count) for k in (0, 1)]
    return np.stack(sums, axis=1)


def _below(y: FloatArray, above: IntArray, below: IntArray) -> FloatArray:
    missing = _BELOW - (y[below] - y[above])
    wrong = missing > 0
    half, high, low = missing[wrong] / 2, above[wrong], below[wrong]
    times = np.bincount(high, minlength=len(y)) + np.bincount(low, minlength=len(y))
    total = np.bincount(low, half, len(y)) - np.bincount(high, half, len(y))
    moves: FloatArray = total / np.maximum(times, 1)
    return moves
