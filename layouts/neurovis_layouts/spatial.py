"""The spatial engine: neurons where the data says that they are, as in a body or a connectome.

In: a problem of which neurons have a ``position``. Out: a layout with x to the right and y downwards, both as given and
scaled by one factor that gives most discs room; those that are still too close move aside. What has no position stands
beside what it is connected to, and gives way to what has one. Pins win.
"""

from __future__ import annotations

import math

import numpy as np

from neurovis_layouts.apart import apart
from neurovis_layouts.crowds import extent, fanned, reduction, spread
from neurovis_layouts.finish import alone, drawn, nearest, pinned_places
from neurovis_layouts.frame import from_picture
from neurovis_layouts.routing.bows import unhindered
from neurovis_layouts.routing.obstacles import REACH
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.model import Capabilities, Layout, LayoutProblem, Point

#: In spacings: how far half of the discs are from their next, how far nine tenths of them (the picture may grow by this
#: factor for it), and how far any two are kept apart.
_HALF, _NINE_TENTHS, _GROWTH, _APART = 1.0, 0.7, 2.0, 0.7
#: How far beyond all neurons routes may lead, by how wide or high these are, whichever is less: what leads far out
#: would make the picture larger than what it shows.
_BEYOND = 0.35
#: What distances may differ by from what they are.
_ROUNDED = 1e-9
#: Closer than this share of what they had in a row is as good as in one place.
_CLOSEST = 0.05


class SpatialEngine:
    """Positions from data."""

    name = "spatial"
    capabilities = Capabilities(
        pins=True,
        places=True,
        boxes=True,
        direction=True,
        memory=True,
        sizes=True,
        neurons=200_000,
        edges=2_000_000,
        suits="positions",
    )

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Scale the positions, keep discs apart, route the edges."""
        if not problem.neurons:
            return Layout(problem.network, self.name, {}, {})
        places = _placed(problem)
        low, high = places.min(axis=0), places.max(axis=0)
        beyond = max(1.0, _BEYOND * float((high - low).min()))
        within = (*(low - beyond).tolist(), *(high + beyond).tolist())
        centres: list[Point] = [(x, y) for x, y in places.tolist()]
        clear = alone(problem, unhindered(problem.edges, centres, REACH - _ROUNDED))
        return drawn(problem, self.name, places, clear, within)

    def size(self, problem: LayoutProblem) -> Point:
        """How wide and high that is, but for routes."""
        return extent(problem, _placed(problem))


def _placed(problem: LayoutProblem) -> FloatArray:
    """(n, 2) where the neurons stand, pinned ones exactly where they are pinned."""
    data = _data(problem)
    exponent = np.frexp(np.abs(data[np.isfinite(data)]).max(initial=0.0))[1]
    data = np.ldexp(data, -exponent)  # their unit is free, and near 1 no distance is too small or too large
    fixed, there = pinned_places(problem)
    known, spacing = np.isfinite(data.sum(axis=1)), problem.neuron_spacing
    places: FloatArray = data * _factor(data[known]) * spacing
    smaller = None if len(fixed) else reduction(problem, places[known])
    if smaller is not None:
        return spread(problem, _beside(places * smaller, problem), _APART * spacing)
    pinned = known[fixed]
    if pinned.any():
        places += (there[pinned] - places[fixed[pinned]]).mean(axis=0)
    places[fixed] = there
    known[fixed] = True
    held = np.flatnonzero(known)
    places[held] = fanned(places[held], spacing)
    places[fixed] = there
    places[held] = apart(places[held], _APART * spacing, np.searchsorted(held, fixed))
    if not known.all():  # what has a place stays there
        free = np.flatnonzero(~known)
        places[free] = fanned(_beside(places, problem), spacing)[free]
        places = apart(places, _APART * spacing, held)
    return places


def _data(problem: LayoutProblem) -> FloatArray:
    """(n, 2) the positions as given, in the engine's frame: the direction does not turn a body. NaN where there is
    none."""
    nowhere = (math.nan, math.nan)
    given = problem.places or (nowhere,) * len(problem.neurons)
    return np.array([from_picture(point, problem.direction) for point in given], dtype=np.float64).reshape(-1, 2)


def _beside(places: FloatArray, problem: LayoutProblem) -> FloatArray:
    """Places, those that are not known in the middle of what they are connected to, and what leads to none below
    all."""
    places = places.copy()
    ends = np.array([(e.source, e.target) for e in problem.edges], dtype=np.int64).reshape(-1, 2)
    ends = np.concatenate([ends, ends[:, ::-1]])
    while not (known := np.isfinite(places.sum(axis=1))).all():
        lead = ends[~known[ends[:, 0]] & known[ends[:, 1]]]
        if not len(lead):
            lost = np.flatnonzero(~known)
            low, high = np.nanmin(places, axis=0), np.nanmax(places, axis=0)
            places[lost, 0] = low[0] + np.arange(len(lost)) * problem.neuron_spacing
            places[lost, 1] = high[1] + problem.rank_spacing
            break
        total, times = np.zeros_like(places), np.zeros(len(places))
        np.add.at(total, lead[:, 0], places[lead[:, 1]])
        np.add.at(times, lead[:, 0], 1.0)
        found = times > 0
        places[found] = total[found] / times[found, None]
    return places


def _factor(data: FloatArray) -> float:
    """What to multiply positions by, so that neighbours are about 1 apart."""
    spots = np.unique(data, axis=0)
    if len(spots) < 2:
        return 1.0
    low = spots.min(axis=0)
    extent = float((spots.max(axis=0) - low).max())
    spots = (spots - low) / extent
    reach = 0.01 / len(spots)
    while True:
        next_one = nearest(spots, reach)
        if (next_one < reach).mean() > 0.5 or reach > 2:
            break
        reach *= 2
    # one far away must not make all others a crowd, nor two in almost one place the picture endless
    half, tenth = np.maximum(np.quantile(next_one, [0.5, 0.1]), _CLOSEST / len(spots)).tolist()
    factor = _HALF / half
    return float(np.clip(_NINE_TENTHS / tenth, factor, _GROWTH * factor)) / extent
