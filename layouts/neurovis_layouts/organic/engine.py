"""The organic engine: from a problem to a layout.

In: a problem of a few hundred neurons whose ranks say little. Out: a layout whose distances are those in the network,
as far as a plane allows: what is wired closely stands close. What runs from one loop to another runs down; modules and
boxes are drawn together; mirror images are such from the start, and pins part of the whole.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from neurovis_layouts.apart import LEAST, apart, jitter
from neurovis_layouts.finish import drawn_apart, nearest
from neurovis_layouts.organic.paths import distances
from neurovis_layouts.organic.stress import Arcs, least_stress
from neurovis_layouts.packing import packed
from neurovis_layouts.symmetry import Symmetry, about_pins, first_of_pairs, symmetry_of
from neurovis_layouts.wiring import Wiring, loops_of, parts_of, wiring_of
from neurovis_spec.layout import FloatArray, IntArray
from neurovis_spec.layout.model import Capabilities, Layout, LayoutProblem

#: In spacings: how far linked neurons are apart, discs of any two, three quarters of the discs from their next at
#: least, and parts.
_LINK, _APART, _NEXT, _GAP = 1.6, 0.8, 1.05, 1.5
_MOST = 0.75
#: What is in one module, or box, is as close as if it were so many links, or so much of what it is.
_MATES, _CLOSER = 0.6, 0.3
#: How strongly an arc presses its target below its source, and how far, in links.
_PRESS, _BELOW = 4.0, 0.8
#: The most arcs between loops.
_MOST_ARCS = 50_000


class OrganicEngine:
    """Stress majorisation with a direction."""

    name = "organic"
    capabilities = Capabilities(
        pins=True,
        boxes=True,
        direction=True,
        mirrors=True,
        memory=True,
        checks=True,
        neurons=1000,
        edges=20_000,
        suits="nearness",
    )

    def lay_out(self, problem: LayoutProblem) -> Layout:
        """Place the neurons by their distances in the network, route the edges round what is in the way."""
        wiring = _stacked(wiring_of(problem, hubs=False), loops_of(problem))
        symmetry = symmetry_of(problem)
        part = _parts(problem, wiring)
        places = np.zeros((wiring.count, 2))
        # what has pins is one part: it has its place, and the others stand beside it; so is what has mirror images
        whole = np.union1d(np.array(sorted(problem.pins), dtype=np.int64), np.flatnonzero(symmetry.paired))
        part[np.isin(part, part[whole])] = -1
        numbers = np.unique(part).tolist()
        sizes: list[tuple[float, float]] = []
        for number in numbers:
            chosen = np.flatnonzero(part == number)
            places[chosen] = _placed(problem, wiring, chosen, symmetry)
            if number < 0:
                symmetry, places = _at_pins(problem, wiring, chosen, symmetry, places)
            sizes.append(tuple((places[chosen].max(axis=0) - places[chosen].min(axis=0)).tolist()))
        _pack(places, part, numbers, sizes, max(_GAP * problem.neuron_spacing, LEAST))
        return drawn_apart(problem, self.name, places, _APART * problem.neuron_spacing, symmetry)

    def check(self, problem: LayoutProblem) -> None:
        """Raises LayoutRefusalError for mirror images that it cannot draw."""
        symmetry = symmetry_of(problem)
        if problem.pins:
            about_pins(problem, symmetry, np.zeros((len(problem.neurons), 2)))


def _stacked(wiring: Wiring, loops: IntArray) -> Wiring:
    """The wiring with an arc from all of a loop to all of the next: what drives a loop stands above the whole of it.
    Arcs stay as they are where that would be too many."""
    order = np.argsort(loops, kind="stable")
    sizes = np.bincount(loops)
    begin = np.cumsum(sizes) - sizes
    pairs = np.unique(np.stack([loops[wiring.above], loops[wiring.below]], axis=1), axis=0).tolist()
    if sum(int(sizes[a] * sizes[b]) for a, b in pairs) > _MOST_ARCS:
        return wiring
    of = [order[start : start + size] for start, size in zip(begin.tolist(), sizes.tolist(), strict=True)]
    above = [np.repeat(of[a], len(of[b])) for a, b in pairs]
    below = [np.tile(of[b], len(of[a])) for a, b in pairs]
    none = np.zeros(0, dtype=np.int64)
    return replace(
        wiring,
        above=np.concatenate([none, *above]),
        below=np.concatenate([none, *below]),
        pull=np.ones(sum(map(len, above))),
    )


def _parts(problem: LayoutProblem, wiring: Wiring) -> IntArray:
    """(count,) parts that hang together, be it by a module or a box."""
    together = [(members[0], mate) for members in _together(problem) for mate in members[1:]]
    pairs = np.array(together, dtype=np.int64).reshape(-1, 2)
    return parts_of(wiring.count, np.concatenate([wiring.a, pairs[:, 0]]), np.concatenate([wiring.b, pairs[:, 1]]))


def _together(problem: LayoutProblem) -> list[tuple[int, ...]]:
    """Modules and boxes, those within others after these."""
    return [module.members for module in problem.modules] + [members for _, members in problem.boxes]


def _placed(problem: LayoutProblem, wiring: Wiring, chosen: IntArray, symmetry: Symmetry) -> FloatArray:
    """Places (k, 2) of the ``chosen`` neurons: of least stress, then scaled and kept apart."""
    ways, press = _wishes(problem, wiring, chosen)
    link, own = _LINK * problem.neuron_spacing, symmetry.within(chosen)
    above, below = press.above, press.below
    first = jitter(len(chosen)) * link * np.sqrt(len(chosen))
    nobody = np.zeros(0, dtype=np.int64)
    # the direction comes in once the rest has found its shape: springs would lock what begins the wrong way round
    loose = least_stress(ways, first, Arcs(nobody, nobody, 0.0, 0.0), nobody, 60)
    pairs = np.searchsorted(chosen, np.intersect1d(first_of_pairs(problem), chosen))
    if len(pairs):
        loose = own.turned(loose, pairs)
        if len(above) and (loose[below, 1] - loose[above, 1]).sum() < 0:
            loose = loose * (1.0, -1.0)
    else:
        loose = _upright(loose, above, below)
    places = least_stress(ways, loose, press, nobody, symmetry=own)
    places *= max(1.0, _NEXT * problem.neuron_spacing / max(_most(nearest(places, link)), 1e-3))
    return apart(places, _APART * problem.neuron_spacing, None, (above, below), kept=own.kept)


def _at_pins(
    problem: LayoutProblem, wiring: Wiring, chosen: IntArray, symmetry: Symmetry, places: FloatArray
) -> tuple[Symmetry, FloatArray]:
    """The places with the ``chosen`` neurons moved to their pins and the rest of them pulled along; and the symmetry
    with its axis where it stands then."""
    symmetry, fixed, there = about_pins(problem, symmetry, places)
    if not len(fixed):
        return symmetry, places
    ways, press = _wishes(problem, wiring, chosen)
    held, own = np.searchsorted(chosen, fixed), symmetry.within(chosen)
    moved = places[chosen] + (symmetry.axis, 0.0)
    shift = (there - moved[held]).mean(axis=0)
    moved += (0.0, shift[1]) if symmetry.paired.any() else shift
    moved[held] = there
    moved = least_stress(ways, moved, press, held, symmetry=own)
    places = places.copy()
    places[chosen] = apart(moved, _APART * problem.neuron_spacing, held, (press.above, press.below), kept=own.kept)
    return symmetry, places


def _wishes(problem: LayoutProblem, wiring: Wiring, chosen: IntArray) -> tuple[FloatArray, Arcs]:
    """How far any two of the ``chosen`` are to be from each other (k, k), and which of them is to be below another."""
    number = np.full(wiring.count, -1, dtype=np.int64)
    number[chosen] = np.arange(len(chosen))
    links, arcs = number[wiring.a] >= 0, number[wiring.above] >= 0
    link = _LINK * problem.neuron_spacing
    ways = distances(len(chosen), number[wiring.a[links]], number[wiring.b[links]])
    for members in _together(problem):
        mates = number[list(members)]
        mates = mates[mates >= 0]
        block = np.ix_(mates, mates)
        ways[block] = np.minimum(ways[block], np.maximum(_MATES, _CLOSER * ways[block]))
    np.fill_diagonal(ways, 0.0)
    return link * ways, Arcs(number[wiring.above[arcs]], number[wiring.below[arcs]], _BELOW * link, _PRESS / link**2)


def _most(values: FloatArray) -> float:
    return float(np.quantile(values, _MOST)) if len(values) else 1.0


def _upright(places: FloatArray, above: IntArray, below: IntArray) -> FloatArray:
    """Places turned about their middle so that arcs run down on the whole."""
    if not len(above):
        return places
    x, y = (places[below] - places[above]).mean(axis=0).tolist()
    length = float(np.sqrt(x * x + y * y))
    if length == 0:
        return places
    sine, cosine = x / length, y / length
    return np.stack([cosine * places[:, 0] - sine * places[:, 1], sine * places[:, 0] + cosine * places[:, 1]], axis=1)


def _pack(places: FloatArray, part: IntArray, numbers: list[int], sizes: list[tuple[float, float]], gap: float) -> None:
    """Move the parts side by side; the one with pins (−1) stays, and the others go below it."""
    free = [i for i, number in enumerate(numbers) if number >= 0]
    corners = packed([sizes[i] for i in free], gap)
    pinned = places[part < 0]
    left, top = (0.0, 0.0) if not len(pinned) else (float(pinned[:, 0].min()), float(pinned[:, 1].max()) + gap)
    for i, corner in zip(free, corners, strict=True):
        chosen = part == numbers[i]
        places[chosen] += np.array((corner[0] + left, corner[1] + top)) - places[chosen].min(axis=0)
