"""Levels: a network made smaller and smaller by joining what hangs together most, and spread out from the smallest on.

In: a Wiring. Out: a place for each of its points (``spread``): what hangs together is laid out on its own, small parts
all in one go; a level's points begin where the point was that they are part of. Points are joined in pairs,
the heaviest links first, all at once by sorting (Karypis and Kumar 1998: heavy-edge matching); whoever finds all
neighbours taken joins the nearest pair, so that stars shrink, too. The images of two are joined as these are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from neurovis_layouts.apart import jitter
from neurovis_layouts.organic.field import Cooling, GridField, pair_field, settle
from neurovis_layouts.organic.flow import in_flow
from neurovis_layouts.wiring import Wiring, linked, summed
from neurovis_spec.layout import FloatArray, IntArray

#: Parts of so few points are not made smaller.
COARSEST = 30
#: A level that saves less than this is not worth it.
_WORTH = 0.95
#: So often pairs are looked for among those that have none yet.
_TRIES = 6
#: With at most so many links for each point a network is sparse: one can follow its chains.
SPARSE = 1.6
#: Steps at the finest level, where points are few and where they are many.
_STEPS, _FEWER_STEPS, _MANY = 200, 160, 3000
#: How far crowded stretches are evened out, and how many stretches there are by the root of the points.
_EVEN, _BINS = 0.6, 0.2
#: Called with the share of the work that is done.
Report = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Level:
    """A wiring, and for each of its points the point of the next coarser level that it is part of."""

    wiring: Wiring
    part_of: IntArray


def levels_of(wiring: Wiring) -> tuple[list[Level], Wiring]:
    """The levels from the finest on, and the coarsest wiring."""
    levels: list[Level] = []
    while wiring.count > COARSEST:
        part_of = _joined(wiring)
        count = int(part_of.max()) + 1
        if count > _WORTH * wiring.count:
            break
        levels.append(Level(wiring, part_of))
        wiring = _coarser(wiring, part_of, count)
    return levels, wiring


def _coarser(wiring: Wiring, part_of: IntArray, count: int) -> Wiring:
    a, b, weight = linked(count, part_of[wiring.a], part_of[wiring.b], wiring.weight)
    above, below, pull = summed(count, part_of[wiring.above], part_of[wiring.below], wiring.pull)
    mass: FloatArray = np.bincount(part_of, wiring.mass, count).astype(np.float64)
    image = np.arange(count)
    image[part_of] = part_of[wiring.image]
    return Wiring(count, mass, a, b, weight, above, below, pull, image)


def _joined(wiring: Wiring) -> IntArray:
    """(count,) numbers of the pairs (and of those that joined one)."""
    count, image = wiring.count, wiring.image
    paired = image != np.arange(count)
    distinct = image[wiring.a] != wiring.b  # an image is never joined with its own
    a, b = wiring.a[distinct], wiring.b[distinct]
    score = wiring.weight[distinct] / np.sqrt(wiring.mass[a] * wiring.mass[b])
    # equal links must not all wait for their neighbour: a little noise, the same every time, and for images
    ends = ((a, b), (image[a], image[b]))
    keys = [7919 * np.minimum(one, other) + 104729 * np.maximum(one, other) for one, other in ends]
    score = score * (1 + np.minimum(*keys) % 10007 / 1e10)
    head = np.arange(count, dtype=np.int64)
    free = np.ones(count, dtype=np.bool_)
    for _ in range(_TRIES):
        open_ones = free[a] & free[b] & (paired[a] == paired[b])
        if not open_ones.any():
            break
        pick = _best(count, a[open_ones], b[open_ones], score[open_ones])
        has = np.flatnonzero(pick >= 0)
        lead = has[(pick[pick[has]] == has) & (has < pick[has]) & (pick[image[has]] == image[pick[has]])]
        head[pick[lead]] = lead
        free[lead] = free[pick[lead]] = False
    pick = _best(count, a, b, score)
    late = np.flatnonzero(free & (pick >= 0))
    late = late[~free[pick[late]] | (paired[late] & ~paired[pick[late]])]
    late = late[pick[image[late]] == image[pick[late]]]
    head[late] = head[pick[late]]
    return np.unique(head, return_inverse=True)[1].astype(np.int64)


def _best(count: int, a: IntArray, b: IntArray, score: FloatArray) -> IntArray:
    """(count,) each point's neighbour over the heaviest link, −1 without any."""
    ones, others = np.concatenate([a, b]), np.concatenate([b, a])
    order = np.lexsort((np.concatenate([score, score]), ones))
    ones, others = ones[order], others[order]
    last = np.flatnonzero(np.diff(ones, append=-1) != 0)
    best = np.full(count, -1, dtype=np.int64)
    best[ones[last]] = others[last]
    return best


def spread(wiring: Wiring, report: Report | None = None) -> FloatArray:
    """Places (count, 2) for a wiring that hangs together, links about 1 long; ``report`` is called after each step."""
    levels, coarsest = levels_of(wiring)
    whole = float(wiring.count)
    steps = [_STEPS if level.wiring.count <= _MANY else _FEWER_STEPS for level in levels]
    tick = _tick(sum(n * level.wiring.count for n, level in zip(steps, levels, strict=True)), report)
    drops = _drops(wiring, levels, coarsest)
    places = spread_small(coarsest, np.zeros(coarsest.count, dtype=np.int64), whole, drops.pop())
    for level, n in zip(reversed(levels), reversed(steps), strict=True):
        unit = np.sqrt(whole / level.wiring.count)
        places = places[level.part_of] + 0.3 * unit * jitter(level.wiring.count)
        cooling, field = Cooling(n, unit, 0.02 * unit), GridField(level.wiring.mass)
        places = settle(level.wiring, places, field, cooling, None, drops.pop(), tick)
    x, y = places.T
    if (wiring.image != np.arange(wiring.count)).any():
        x = np.concatenate([x, -x])
    return np.stack([_evened(x)[: wiring.count], _evened(y)], axis=1)


def _drops(wiring: Wiring, levels: list[Level], coarsest: Wiring) -> list[FloatArray]:
    """How far the target of each arc is to be below its source, level by level: as far as points of this level are from
    each other, and in sparse networks as far as the arcs that the points stand for take, or a chain would have to be
    folded that is longer than the network is wide."""
    high = np.zeros(wiring.count)
    if len(wiring.a) <= SPARSE * wiring.count:
        high = in_flow(high, wiring.above, wiring.below, 1.0)
    drops: list[FloatArray] = []
    for level in [*levels, Level(coarsest, np.arange(coarsest.count))]:
        at = level.wiring
        drops.append(np.maximum(np.sqrt(wiring.count / at.count), high[at.below] - high[at.above]))
        high = np.bincount(level.part_of, at.mass * high) / np.bincount(level.part_of, at.mass)
    return drops


def _tick(total: int, report: Report | None) -> Callable[[int], None]:
    """What counts the points that have been moved, and reports their share of ``total`` moves."""
    done = 0

    def tick(moved: int) -> None:
        nonlocal done
        done += moved
        if report is not None:
            report(done / total)

    return tick


def _evened(line: FloatArray) -> FloatArray:
    """Coordinates (count,) in the same order, crowded stretches widened and empty ones narrowed: the order decides
    about flow, and about crossings nearly so. Stretches end where so many points lie below, so that what is far out
    is drawn in, and whatever is drawn tight, be it all but a tail, is told apart."""
    bins = max(8, int(_BINS * np.sqrt(len(line))))
    edges = np.quantile(line, np.linspace(0, 1, bins + 1))
    wide = (1 - _EVEN) * (edges - edges[0]) + _EVEN * (edges[-1] - edges[0]) * np.linspace(0, 1, bins + 1)
    evened: FloatArray = edges[0] + np.interp(line, edges, wide)
    return evened


def spread_small(wiring: Wiring, part: IntArray, whole: float = 0.0, drop: FloatArray | float = 1.0) -> FloatArray:
    """Places (count, 2) for a wiring of small parts, each around its own origin: those of different parts do not
    feel each other. ``part`` (count,) says which one a point belongs to. They stand for ``whole`` points, if for more
    than themselves, whose arcs take ``drop``."""
    order = np.argsort(part, kind="stable")
    begin = np.searchsorted(part[order], part[order], side="right")
    at = np.arange(len(order), dtype=np.int64)
    counts = begin - at - 1
    one = np.repeat(at, counts)
    other = one + 1 + np.arange(len(one), dtype=np.int64) - np.repeat(np.cumsum(counts) - counts, counts)
    field = pair_field(wiring.mass, order[one], order[other])
    sizes = np.bincount(part)[part]
    size = np.sqrt(np.maximum(sizes, whole))
    unit = float(np.sqrt(whole / wiring.count)) if whole else 1.0
    rank = np.zeros(wiring.count, dtype=np.int64)
    rank[order] = at - np.searchsorted(part[order], part[order])
    places = jitter(int(rank.max(initial=0)) + 1)[rank] * size[:, None]
    return settle(wiring, places, field, Cooling(2 * _STEPS, size.max(initial=4.0) / 4, 0.02 * unit), None, drop)
