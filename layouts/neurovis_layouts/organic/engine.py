"""The organic engine: from a problem to a layout.

In: a problem of any size. Out: a layout in which modules and whatever else hangs together show as clusters, and most
connections run along the direction. The parts of the network are laid out (``spread``), scaled so that neighbours are a
spacing apart, their discs pushed off each other, packed; then pins are put where they belong and pull the rest along.
Mirror images are such from the start.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from neurovis_layouts.apart import apart
from neurovis_layouts.finish import alone, drawn, drawn_apart, nearest
from neurovis_layouts.organic.field import Cooling, GridField, Held, settle
from neurovis_layouts.organic.flow import in_flow
from neurovis_layouts.organic.levels import COARSEST, SPARSE, spread, spread_small
from neurovis_layouts.organic.rows import directed, in_rows
from neurovis_layouts.organic.trees import trees_of
from neurovis_layouts.packing import packed
from neurovis_layouts.symmetry import Symmetry, about_pins, first_of_pairs, symmetry_of
from neurovis_layouts.wiring import Wiring, parts_of, wiring_of
from neurovis_spec.layout import BoolArray, Capabilities, FloatArray, IntArray, Layout, LayoutProblem, Progress
from neurovis_spec.layout.geometry import lengths

#: In spacings: how far three quarters are from their next at most, how long links are in the mean at least, how far
#: discs are kept apart, and parts.
_NEXT, _LINK, _APART, _GAP = 1.0, 0.9, 0.75, 1.5
_MOST = 0.75
#: How far an arc leads down at least, and how much too high its target may be to be put there: others would move many
#: neurons far, and make crossings.
_STEP, _NEARLY = 0.1, 3.0
#: A neuron's share of a picture, in square spacings, at most: discs have to stay in sight.
_ROOM = 7.0
#: Steps in which pins pull the rest along.
_PINNED_STEPS = 60
#: Steps of trees, and gaps between parts, are not shorter than this, for links to pass between discs.
_LEAST = 0.85


class OrganicEngine:
    """Forces over levels of detail."""

    name = "organic"
    capabilities = Capabilities(
        pins=True,
        boxes=True,
        direction=True,
        mirrors=True,
        memory=True,
        checks=True,
        progress=True,
        neurons=200_000,
        edges=2_000_000,
        suits="clusters",
    )

    def lay_out(self, problem: LayoutProblem, progress: Progress | None = None) -> Layout:
        """Place the neurons by forces, route the edges straight or round what is in the way."""
        symmetry = symmetry_of(problem)
        wiring = wiring_of(problem, symmetry.image)
        places, planar = _free(problem, wiring, progress)
        if problem.pins:
            symmetry, places = _around_pins(problem, wiring, symmetry, places)
        real = places[: len(problem.neurons)]
        chosen = directed(problem, real)
        found = _drawn(chosen, self.name, places, planar, symmetry)
        return found if chosen is problem else replace(found, direction=chosen.direction)

    def check(self, problem: LayoutProblem) -> None:
        """Raises LayoutRefusalError for mirror images that it cannot draw."""
        symmetry = symmetry_of(problem)
        if problem.pins:
            about_pins(problem, symmetry, np.zeros((len(problem.neurons), 2)))


class LargeEngine(OrganicEngine):
    """The same by the name that it had where networks were large."""

    name = "large"
    capabilities = replace(OrganicEngine.capabilities, suits=None)


def _drawn(problem: LayoutProblem, engine: str, places: FloatArray, planar: BoolArray, symmetry: Symmetry) -> Layout:
    """The layout at places near these (count, 2), of which some are ``planar``."""
    real = places[: len(problem.neurons)]
    rows = in_rows(problem, real)
    framed = problem.pins or problem.boxes or symmetry.paired.any() or any(wide for wide, _ in problem.labels)
    if framed or rows is not real:
        return drawn_apart(problem, engine, rows, _APART * problem.neuron_spacing, symmetry)
    clear = [i for i, edge in enumerate(problem.edges) if planar[edge.source] and edge.source != edge.target]
    return drawn(problem, engine, places, alone(problem, clear))


def _free(problem: LayoutProblem, wiring: Wiring, progress: Progress | None) -> tuple[FloatArray, BoolArray]:
    """Places (count, 2) without pins: every part laid out, then all packed; and who is in a tree drawn as such. The
    axis of mirror images is at x = 0, with those on its left that were written first."""
    part, spacing = parts_of(wiring.count, wiring.a, wiring.b), problem.neuron_spacing
    sizes = np.bincount(part)
    places = np.zeros((wiring.count, 2))
    planar = np.zeros(wiring.count, dtype=np.bool_)
    for chosen, drawing in trees_of(wiring, part):
        places[chosen] = drawing * max(spacing, _LEAST)
        planar[chosen] = True
    small = np.flatnonzero((sizes[part] <= COARSEST) & ~planar)
    if len(small):
        within = np.unique(part[small], return_inverse=True)[1]
        places[small] = spread_small(_only(wiring, small), within)
    done = len(small) + int(planar.sum())
    for number in np.unique(part[(sizes[part] > COARSEST) & ~planar]).tolist():
        chosen = np.flatnonzero(part == number)
        reported = partial(_report, progress, done, len(chosen), wiring.count)
        places[chosen] = spread(_only(wiring, chosen), reported)
        done += len(chosen)
    first = first_of_pairs(problem)
    if places[first, 0].sum() > 0:
        places *= (-1.0, 1.0)
    return _packed(wiring, places, part, planar, spacing), planar


def _report(progress: Progress | None, before: int, size: int, count: int, share: float) -> None:
    """Say how many of ``count`` points are done: those ``before`` and a ``share`` of the ``size`` at work."""
    if progress is not None:
        progress(before + int(share * size), count)


def _only(wiring: Wiring, chosen: IntArray) -> Wiring:
    """The wiring of these points alone, which nothing connects to others."""
    number = np.full(wiring.count, -1, dtype=np.int64)
    number[chosen] = np.arange(len(chosen))
    links, arcs = number[wiring.a] >= 0, number[wiring.above] >= 0
    return Wiring(
        int(np.searchsorted(chosen, wiring.neurons)),
        wiring.mass[chosen],
        number[wiring.a[links]],
        number[wiring.b[links]],
        wiring.weight[links],
        number[wiring.above[arcs]],
        number[wiring.below[arcs]],
        wiring.pull[arcs],
        number[wiring.image[chosen]],
    )


def _packed(wiring: Wiring, places: FloatArray, part: IntArray, ready: BoolArray, spacing: float) -> FloatArray:
    """Every part scaled, its discs kept apart, but for those that are ready, and all packed; what holds no neuron goes
    nowhere."""
    count = int(part.max(initial=-1)) + 1
    real, image = slice(0, wiring.neurons), wiring.image[: wiring.neurons]
    if not wiring.neurons:
        return places
    # far from each other, so that all parts can be worked on at once
    places = places * np.where(ready, 1.0, _scales(wiring, _aside(places, part), part, spacing))[:, None]
    aside = _aside(places, part)
    paired = np.flatnonzero(image != np.arange(wiring.neurons))
    axis = float((aside - places)[paired[:1], 0].sum())  # the part that mirror images are in begins about 0
    aside[:, 1] = _in_flow(wiring, aside[:, 1], part, spacing)
    kept, arcs = Symmetry(image, axis).kept, (wiring.above, wiring.below)
    moved = apart(aside[real], _APART * spacing, np.flatnonzero(ready[real]), arcs, part[real], kept)
    low, high = _bounds(moved, part[real], count)
    filled = np.flatnonzero(np.isfinite(low[:, 0]))
    sizes = [(float(w), float(h)) for w, h in (high - low)[filled].tolist()]
    shift = np.zeros((count, 2))
    shift[filled] = packed(sizes, max(_GAP * spacing, _LEAST)) - low[filled]
    shift[:, 0] -= axis + shift[part[paired[:1]], 0].sum()
    places[real] = moved + shift[part[real]]
    return places


def _aside(places: FloatArray, part: IntArray) -> FloatArray:
    """The parts far from each other, side by side."""
    reach = float(np.abs(places).max()) + 10.0
    return places + np.stack([8 * reach * part, np.zeros(len(part))], axis=1)


def _in_flow(wiring: Wiring, high: FloatArray, part: IntArray, spacing: float) -> FloatArray:
    """Heights (count,) at which arcs run down: all of a sparse part, of others those that do so nearly."""
    count = int(part.max()) + 1
    sparse = np.bincount(part[wiring.a], minlength=count) <= SPARSE * np.bincount(part)
    chosen = sparse[part[wiring.above]] | (high[wiring.above] - high[wiring.below] <= _NEARLY * spacing)
    return in_flow(high, wiring.above[chosen], wiring.below[chosen], _STEP * spacing)


def _scales(wiring: Wiring, places: FloatArray, part: IntArray, spacing: float) -> FloatArray:
    """(count,) what to multiply each part by, so that those next to each other have room."""
    count = int(part.max()) + 1
    next_one = nearest(places[: wiring.neurons], 1.0)
    links = (wiring.a < wiring.neurons) & (wiring.b < wiring.neurons)
    length = lengths(places[wiring.b[links]] - places[wiring.a[links]])
    by_room = _NEXT * spacing / np.maximum(_quantile(part[: wiring.neurons], next_one, count), 1e-3)
    by_link = _LINK * spacing / np.maximum(_mean(part[wiring.a[links]], length, count, 1.0), 1e-3)
    low, high = _bounds(places, part, count)
    width, height = (high - low + 0.1).T
    by_area = spacing * np.sqrt(_ROOM * np.bincount(part) / (width * height))
    scales: FloatArray = np.maximum(np.minimum(by_room, by_area), by_link)[part]
    return scales


def _bounds(places: FloatArray, part: IntArray, count: int) -> tuple[FloatArray, FloatArray]:
    """(count, 2) the low and the high corner of each part; infinite where there is nothing in it."""
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, part, places)
    np.maximum.at(high, part, places)
    return low, high


def _quantile(part: IntArray, values: FloatArray, count: int) -> FloatArray:
    """(count,) what most of the values of each part do not exceed; 1 for none."""
    times = np.bincount(part, minlength=count)
    order = np.lexsort((values, part))
    place = np.cumsum(times) - times + (_MOST * np.maximum(times - 1, 0)).astype(np.int64)
    return np.where(times > 0, values[order][np.minimum(place, max(len(values) - 1, 0))], 1.0)


def _mean(part: IntArray, values: FloatArray, count: int, otherwise: float) -> FloatArray:
    """(count,) the mean of the values of each part."""
    times = np.bincount(part, minlength=count)
    total = np.bincount(part, values, count)
    return np.where(times > 0, total / np.maximum(times, 1), otherwise)


def _around_pins(
    problem: LayoutProblem, wiring: Wiring, symmetry: Symmetry, places: FloatArray
) -> tuple[Symmetry, FloatArray]:
    """The whole moved to the pins, these put where they belong, their images, too, and the rest pulled along; and the
    symmetry with its axis where it stands then."""
    symmetry, fixed, there = about_pins(problem, symmetry, places)
    places = places + ((symmetry.axis, 0.0) if symmetry.paired.any() else (0.0, 0.0))
    shift = (there - places[fixed]).mean(axis=0)
    places += (0.0, shift[1]) if symmetry.paired.any() else shift
    places[fixed] = there
    scale = 2.0 * problem.neuron_spacing
    cooling, field = Cooling(_PINNED_STEPS, 0.5, 0.02), GridField(wiring.mass)
    pulled = settle(wiring, places / scale, field, cooling, Held(fixed, symmetry.axis / scale)) * scale
    pulled[fixed] = there
    real, arcs = slice(0, wiring.neurons), (wiring.above, wiring.below)
    pulled[real] = apart(pulled[real], _APART * problem.neuron_spacing, fixed, arcs, None, symmetry.kept)
    return symmetry, pulled
