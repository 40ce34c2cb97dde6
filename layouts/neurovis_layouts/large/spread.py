"""Spread: the points of a network find their places, from the coarsest level to the finest.

In: a Wiring. Out: a place for each of its points. What hangs together is laid out on its own, small parts all in one
go; a level's points begin where the point was that they are part of.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from neurovis_layouts.apart import jitter
from neurovis_layouts.large.field import Field, GridField, PairField
from neurovis_layouts.large.flow import heights
from neurovis_layouts.large.levels import Level, levels_of
from neurovis_layouts.large.settle import Cooling, settle
from neurovis_layouts.wiring import Wiring
from neurovis_spec.layout import FloatArray, IntArray

#: Parts of at most so many points are laid out together, pair by pair.
SMALL = 64
#: With at most so many links for each point a network is sparse: one can follow its chains.
SPARSE = 1.6
#: Up to so many points, forces are taken pair by pair.
_BY_PAIRS = 250
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
    unit = np.sqrt(whole / coarsest.count)
    places = jitter(coarsest.count) * np.sqrt(whole)
    cooling = Cooling(2 * _STEPS, np.sqrt(whole) / 4, 0.02 * unit)
    places = settle(coarsest, places, _field(coarsest), cooling, drop=drops.pop())
    for level, n in zip(reversed(levels), reversed(steps), strict=True):
        unit = np.sqrt(whole / level.wiring.count)
        places = places[level.part_of] + 0.3 * unit * jitter(level.wiring.count)
        cooling = Cooling(n, unit, 0.02 * unit)
        places = settle(level.wiring, places, _field(level.wiring), cooling, None, tick, drops.pop())
    return np.stack([_evened(places[:, 0]), _evened(places[:, 1])], axis=1)


def _drops(wiring: Wiring, levels: list[Level], coarsest: Wiring) -> list[FloatArray]:
    """How far the target of each arc is to be below its source, level by level: as far as points of this level are from
    each other, and in sparse networks as far as the arcs that the points stand for take, or a chain would have to be
    folded that is longer than the network is wide."""
    high = heights(wiring) if len(wiring.a) <= SPARSE * wiring.count else np.zeros(wiring.count)
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


def spread_small(wiring: Wiring, part: IntArray) -> FloatArray:
    """Places (count, 2) for a wiring of many small parts, each around its own origin: those of different parts do not
    feel each other. ``part`` (count,) says which one a point belongs to."""
    order = np.argsort(part, kind="stable")
    begin = np.searchsorted(part[order], part[order], side="right")
    at = np.arange(len(order), dtype=np.int64)
    counts = begin - at - 1
    one = np.repeat(at, counts)
    other = one + 1 + np.arange(len(one), dtype=np.int64) - np.repeat(np.cumsum(counts) - counts, counts)
    field = PairField(wiring.mass, order[one], order[other])
    size = np.sqrt(np.bincount(part)[part])[:, None]
    rank = np.zeros(wiring.count, dtype=np.int64)
    rank[order] = at - np.searchsorted(part[order], part[order])
    places = jitter(int(rank.max(initial=0)) + 1)[rank] * size
    return settle(wiring, places, field, Cooling(2 * _STEPS, 1.0, 0.01))


def _field(wiring: Wiring) -> Field:
    if wiring.count > _BY_PAIRS:
        return GridField(wiring.mass)
    one, other = np.triu_indices(wiring.count, 1)
    return PairField(wiring.mass, one.astype(np.int64), other.astype(np.int64))
