"""Spread: the points of a network find their places, from the coarsest level to the finest.

In: a Wiring. Out: a place for each of its points. What hangs together is laid out on its own, small parts all in one
go; a level's points begin where the point was that they are part of.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from neurovis_layouts.apart import jitter
from neurovis_layouts.organic.field import GridField, pair_field
from neurovis_layouts.organic.flow import in_flow
from neurovis_layouts.organic.levels import Level, levels_of
from neurovis_layouts.organic.settle import Cooling, settle
from neurovis_layouts.wiring import Wiring
from neurovis_spec.layout import FloatArray, IntArray

#: With at most so many links for each point a network is sparse: one can follow its chains.
SPARSE = 1.6
#: Steps at the finest level, where points are few and where they are many.
_STEPS, _FEWER_STEPS, _MANY = 200, 160, 3000
#: How far crowded stretches are evened out, and how many stretches there are by the root of the points.
_EVEN, _BINS = 0.6, 0.2

#: Called with the share of the work that is done.
Report = Callable[[float], None]


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
        places = settle(level.wiring, places, field, cooling, None, tick, drops.pop())
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
    return settle(wiring, places, field, Cooling(2 * _STEPS, size.max(initial=4.0) / 4, 0.02 * unit), None, None, drop)
