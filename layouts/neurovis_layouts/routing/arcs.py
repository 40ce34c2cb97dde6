"""Arcs: connections between mirror images of each other, there and back, each its own reflection.

In: their routes as averages of both sides, which may have got into the way of something; what is in the way; the axis.
Out: the same where nothing is wrong with them, else arcs clear of discs, of foreign frames and of each other, one to
each side where that can be: bows, or ways round what stands on either side of the axis (``detours``), folded on it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise, product

import numpy as np

from neurovis_layouts.routing.bows import bow
from neurovis_layouts.routing.detours import Detours
from neurovis_layouts.routing.line_overlap import crossings, line_of, together, tolerable
from neurovis_layouts.routing.obstacles import REACH, TOUCH, Obstacles
from neurovis_layouts.routing.polylines import polylines
from neurovis_layouts.routing.walls import Frame, Walls
from neurovis_spec.layout import FloatArray
from neurovis_spec.layout.geometry import distance, snap
from neurovis_spec.layout.model import Point, Route

#: How much of an arc may run on another between the same ends, and how close to a disc it may come.
_SHARE, _SLACK = 0.1, 0.02
#: Bows that are tried on either side, their handles, how many ways round, and how many arcs are tried with each other.
_BOWS, _HOLDS, _WAYS, _BEST = 10, (0.3, 0.15, 0.05), 4, 10
#: What it costs to enter a frame or a disc, to come a unit closer to a disc than ``REACH``, to run on one between the
#: same ends, to cross it, to bow to the other's side, to be longer by a whole straight way, to go a unit aside, to go a
#: unit there and back besides, to run on what else is drawn, to cross a line of that, and to go round corners.
_ENTERING, _NEARING, _SAME, _CROSSED, _SIDE, _LONGER = 40.0, 12.0, 30.0, 4.0, 5.0, 2.0
_ASIDE, _WAVERING, _OTHER, _CROSSING, _CORNERS = 0.8, 1.5, 6.0, 0.5, 0.3
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


class _Drawn:
    """What else is drawn: points on it, and how often routes cross it."""

    def __init__(self, routes: Sequence[Route]) -> None:
        self.points: FloatArray = np.concatenate([np.zeros((0, 2)), *(line_of(route) for route in routes)])
        self._lines = polylines(routes) if routes else None

    def crossed(self, routes: Sequence[Route]) -> list[int]:
        """How often each of these crosses it."""
        if self._lines is None:
            return [0] * len(routes)
        return [int(count) for count in polylines(routes).crossed(self._lines.a, self._lines.b)]


class Arcs:
    """Mends routes between mirror images among ``centres`` and ``frames``; ``pair`` says whose image a neuron is."""

    def __init__(
        self, centres: Sequence[Point], frames: Sequence[Frame], pair: Mapping[int, int], twice: float
    ) -> None:
        self._centres, self._twice = centres, twice
        self._obstacles, self._walls = Obstacles(centres), Walls(frames, len(centres))
        # what an arc is to be clear of on both sides: all of it, and the reflections of what has no image
        both, image = list(centres), dict(pair)
        for i, (x, y) in enumerate(centres):
            if i not in image:
                image[i] = i if 2 * x == twice else len(both)
                if image[i] != i:
                    both.append((twice - x, y))
        known = {rect: own for own, rect in frames}
        for own, (x0, y0, x1, y1) in frames:
            known.setdefault((twice - x1, y0, twice - x0, y1), frozenset(image[member] for member in own))
        self._both, self._frames = both, [(own, rect) for rect, own in known.items()]

    def mended(self, own: Sequence[tuple[int, int]], routes: Sequence[Route], others: Sequence[Route]) -> list[Route]:
        """The routes, all between the two same neurons, each with the ends that it has; ``others`` are drawn, too."""
        lines = [line_of(route) for route in routes]
        if not self._wrong(own, routes, lines):
            return list(routes)
        drawn = _Drawn(others)
        there = [route if ends == own[0] else route[::-1] for ends, route in zip(own, routes, strict=True)]
        tried = [*there, *self._candidates(*own[0])]
        lines = [line_of(route) for route in tried]
        costs = self._costs(tried, own[0], lines, drawn)
        order = sorted(range(len(tried)), key=lambda k: (costs[k], k))
        above = [self._above(own[0], line) for line in lines]
        left = [self._centres[source][0] < self._centres[target][0] for source, target in own]
        # the best of either side for the first two, and then each farther one where there is room beside those
        some = [*[k for k in order if above[k]][:_BEST], *[k for k in order if not above[k]][:_BEST]]

        def cost(number: int, k: int, chosen: Sequence[int]) -> float:
            shared = sum(_apart(lines[k], lines[other]) for other in chosen)
            return costs[k] + _SIDE * (above[k] != left[number]) + shared

        first, second = min(
            ((a, b) for a in some for b in some), key=lambda two: (cost(0, two[0], ()) + cost(1, two[1], two[:1]), two)
        )
        found = [first, second]
        for number in range(2, len(own)):
            found.append(min(order, key=lambda k: (cost(number, k, found), k)))
        return [tried[k] if ends == own[0] else tried[k][::-1] for k, ends in zip(found, own, strict=True)]

    def _wrong(self, own: Sequence[tuple[int, int]], routes: Sequence[Route], lines: Sequence[FloatArray]) -> bool:
        """Whether any runs into something, on another of them, or all bow to one side."""
        if min(self._obstacles.clearances(routes, own)) < TOUCH + _SLACK or any(self._walls.entered(routes, own)):
            return True
        if any(_apart(one, other) > 0 for k, one in enumerate(lines) for other in lines[:k]):
            return True
        return len({self._above(ends, line) for ends, line in zip(own, lines, strict=True)}) < 2

    def _above(self, own: tuple[int, int], line: FloatArray) -> bool:
        """Whether an arc bows to where the direction comes from."""
        return bool(len(line)) and bool(line[len(line) // 2, 1] < self._centres[own[0]][1])

    def _costs(
        self,
        routes: Sequence[Route],
        own: tuple[int, int],
        lines: Sequence[FloatArray],
        drawn: _Drawn,
    ) -> list[float]:
        """The cost of each route, apart from what it costs beside another arc between the same ends (``_apart``)."""
        ends = [own] * len(routes)
        clear, enters = self._obstacles.clearances(routes, ends), self._walls.entered(routes, ends)
        straight = distance(self._centres[own[0]], self._centres[own[1]])
        crossed = drawn.crossed(routes)
        result = []
        for route, line, clearance, entering, crossing in zip(routes, lines, clear, enters, crossed, strict=True):
            cost = _ENTERING * (entering + (clearance < TOUCH + _SLACK)) + _NEARING * (REACH - clearance)
            cost += _LONGER * (_length(line) / straight - 1) + _CORNERS * (len(route) > 4)
            height, wavering = _aside(route[0][1], line)
            cost += _ASIDE * height + _WAVERING * wavering
            if cost < _ENTERING:
                cost += _OTHER * together(line, [drawn.points]) + _CROSSING * crossing
            result.append(cost)
        return result

    def _candidates(self, source: int, target: int) -> Iterator[Route]:
        """Bows to either side, and ways round."""
        a, b = self._centres[source], self._centres[target]
        far = distance(a, b)
        for step, side, hold in product(range(_BOWS), (1.0, -1.0), _HOLDS):
            yield even(bow(a, b, side * (0.13 + 0.035 * far + step * (0.25 + 0.05 * far)), hold), self._twice)
        x, level = self._twice / 2, a[1]
        for y0, y1 in ((level - _OFF, level + _LONG), (level - _LONG, level + _OFF)):
            wall: Frame = (frozenset(), (x - _THIN, y0, x + _THIN, y1))
            detours = Detours(Walls([*self._frames, wall], len(self._both)), self._both, ways=_WAYS)
            for _ in range(_WAYS):
                found = detours.folded(source, target, self._twice)
                if found is None:
                    break
                smooth = even(found, self._twice)
                if all(distance(p, q) < _SAME_LINE for p, q in zip(found, smooth, strict=True)):
                    yield smooth


def _apart(one: FloatArray, other: FloatArray) -> float:
    """The cost of two arcs between the same ends that run on each other or cross."""
    share = together(one, [other])
    return _SAME * max(0.0, share - tolerable(one, _SHARE)) + _CROSSED * crossings(one, [other])


def _aside(level: float, line: FloatArray) -> tuple[float, float]:
    """How far a line goes off the straight way, and how much it goes there and back besides."""
    heights = [y - level for _, y in line.tolist()]
    most = max(map(abs, heights), default=0.0)
    both = math.fsum(abs(b - a) for a, b in pairwise([0.0, *heights, 0.0]))
    return most, both - 2 * most


def _length(line: FloatArray) -> float:
    return math.fsum(distance(p, q) for p, q in pairwise(line.tolist()))
