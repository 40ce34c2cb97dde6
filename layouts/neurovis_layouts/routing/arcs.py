"""Arcs: connections between mirror images of each other, there and back, each its own reflection.

In: their routes as averages of both sides, which may have got into the way of something; what is in the way; the axis.
Out: the same where nothing is wrong with them, else arcs clear of discs, of foreign frames and of each other, one to
each side where that can be: bows, or ways round what stands on either side of the axis (``detours``), folded on it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from neurovis_layouts.routing.bows import bow
from neurovis_layouts.routing.detours import Detours
from neurovis_layouts.routing.polylines import Polylines, polylines
from neurovis_layouts.routing.route_cost import Judge, Pen
from neurovis_layouts.routing.walls import Frame, Walls
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import distance, snap
from neurovis_spec.layout.model import Route

#: Bows that are tried on either side, their handles, how many ways round, and how many arcs are tried with each other.
_BOWS, _HOLDS, _WAYS, _BEST = 10, (0.3, 0.15, 0.05), 4, 10
#: What it costs to run on one between the same ends and to cross it, which makes two arcs one, and to bow to the
#: other's side, by which there and back are told apart.
_SAME, _CROSSED, _SIDE = 30.0, 4.0, 5.0
#: A wall on the axis keeps a way to its side: how thick it is, how far off the straight way, how long.
_THIN, _OFF, _LONG = 0.02, 0.1, 1e4
#: What an arc may differ by from the way that it was folded from.
_SAME_LINE = 0.05


def even(route: Route, twice: float) -> Route:
    """A route from a neuron to its mirror image, as it would be on both sides of the axis (at half of ``twice``)."""
    half = len(route) // 2
    before = [
        (snap((x + twice - other) / 2), snap((y + height) / 2))
        for (x, y), (other, height) in zip(route[1:half], route[-2 : -half - 1 : -1], strict=True)
    ]
    middle = [(twice / 2, before[-1][1])] if len(route) % 2 else []
    return route[0], *before, *middle, *((twice - x, y) for x, y in before[::-1]), route[-1]


class Arcs:
    """Mends routes between mirror images among ``centres`` and ``frames``; ``pair`` says whose image a neuron is, the
    judge knows all that is drawn."""

    def __init__(self, judge: Judge, frames: Sequence[Frame], pair: Mapping[int, int]) -> None:
        self._judge, self._centres, self._twice = judge, judge.centres, judge.twice
        # what an arc is to be clear of on both sides: all of it, and the reflections of what has no image
        both, image = list(self._centres), dict(pair)
        for i, (x, y) in enumerate(self._centres):
            if i not in image:
                image[i] = i if 2 * x == self._twice else len(both)
                if image[i] != i:
                    both.append((self._twice - x, y))
        known = {rect: own for own, rect in frames}
        for own, (x0, y0, x1, y1) in frames:
            known.setdefault((self._twice - x1, y0, self._twice - x0, y1), frozenset(image[member] for member in own))
        self._both, self._frames = both, [(own, rect) for rect, own in known.items()]

    def mend(self, group: Sequence[int]) -> bool:
        """Draw the routes of these edges, all between the two same neurons, anew where something is wrong with them."""
        judge = self._judge
        own = [(judge.edges[i].source, judge.edges[i].target) for i in group]
        there = [judge.routes[i][:: 1 if ends == own[0] else -1] for i, ends in zip(group, own, strict=True)]
        if not self._wrong(group, there):
            return False
        tried = [*there, *self._candidates(*own[0])]
        costs = Pen(judge, group[0], group).costs(tried)
        above = [self._above(route) for route in tried]
        order = sorted(range(len(tried)), key=lambda k: (costs[k], k))
        # the best of either side for the first two, and then each farther one where there is room beside those
        some = [k for side in (True, False) for k in [k for k in order if above[k] == side][:_BEST]]
        lines = polylines([tried[k] for k in some])
        shared = {k: _apart(lines, tried[k]) for k in some}
        left = [self._centres[source][0] < self._centres[target][0] for source, target in own]
        first, second = min(
            ((a, b) for a in range(len(some)) for b in range(len(some))),
            key=lambda two: (
                costs[some[two[0]]] + _SIDE * (above[some[two[0]]] != left[0])
                + costs[some[two[1]]] + _SIDE * (above[some[two[1]]] != left[1]) + shared[some[two[0]]][two[1]],
                two,
            ),
        )  # fmt: skip
        chosen = [some[first], some[second]]
        taken = sum(_apart(polylines(tried), tried[k]) for k in chosen) if len(own) > 2 else costs
        for number in range(2, len(own)):
            cost = costs + taken + [_SIDE * (side != left[number]) for side in above]
            chosen.append(int(np.argmin(cost)))
            taken = taken + _apart(polylines(tried), tried[chosen[-1]])
        for i, k, ends in zip(group, chosen, own, strict=True):
            judge.draw(i, tried[k][:: 1 if ends == own[0] else -1])
        return True

    def _wrong(self, group: Sequence[int], there: Sequence[Route]) -> bool:
        """Whether any runs into something, on another of them, or all bow to one side."""
        if any(Pen(self._judge, i, group).trespass(self._judge.routes[i]) != (0, 0.0) for i in group):
            return True
        if any(_apart(polylines(there[k + 1 :]), route).any() for k, route in enumerate(there[:-1])):
            return True
        return len({self._above(route) for route in there}) < 2

    def _above(self, route: Route) -> bool:
        """Whether an arc bows, on the axis, to where the direction comes from."""
        half = len(route) // 2
        return route[half][1] + route[-half - 1][1] < 2 * route[0][1]

    def _candidates(self, source: int, target: int) -> Iterator[Route]:
        """Bows to either side, and ways round."""
        a, b = self._centres[source], self._centres[target]
        far = distance(a, b)
        for step, side, hold in product(range(_BOWS), (1.0, -1.0), _HOLDS):
            yield even(bow(a, b, side * (0.13 + 0.035 * far + step * (0.25 + 0.05 * far)), hold), self._twice)
        x, level = self._twice / 2, a[1]
        for y0, y1 in ((level - _OFF, level + _LONG), (level - _LONG, level + _OFF)):
            wall: Frame = (frozenset(), (x - _THIN, y0, x + _THIN, y1))
            detours = Detours(Walls([*self._frames, wall], len(self._both)), self._both)
            for _ in range(_WAYS):
                found = detours.folded(source, target, self._twice)
                if found is None:
                    break
                smooth = even(found, self._twice)
                if all(distance(p, q) < _SAME_LINE for p, q in zip(found, smooth, strict=True)):
                    yield smooth


def _apart(lines: Polylines, other: Route) -> FloatArray:
    """(n,) the cost of arcs between the same ends that run on another or cross it."""
    line = polylines([other])
    cost: FloatArray = _SAME * lines.on(line) + _CROSSED * lines.crossed(line.a, line.b)
    return cost
