"""Pins: what is pinned stays; the rest is moved to it as a whole, and off the pinned discs one by one.

In: a free layout and the pins. Out: positions in which every pin is exact and no two centres are closer than a disc.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from neurovis_spec.layout.geometry import distance, snap
from neurovis_spec.layout.model import RADIUS, LayoutProblem, Point

#: How far a neuron that has to give way keeps off, at least.
_CLEAR = 0.75
_STEP = 0.25


def fit(free: Sequence[Point], pins: Mapping[int, Point]) -> tuple[list[Point], Point, frozenset[int]]:
    """Positions with the pins kept, the translation of the rest, and who did not simply follow that translation.

    The translation is the least-squares fit of the free layout to the pins (the mean of the differences).
    """
    if not pins:
        return list(free), (0.0, 0.0), frozenset()
    count = len(pins)
    shift = (
        snap(math.fsum(x - free[i][0] for i, (x, _) in sorted(pins.items())) / count),
        snap(math.fsum(y - free[i][1] for i, (_, y) in sorted(pins.items())) / count),
    )
    cells = CentreCells()
    placed: dict[int, Point] = dict(pins)
    for point in pins.values():
        cells.add(point)
    moved = set(pins)
    waiting: list[int] = []
    for i, (x, y) in enumerate(free):
        if i in pins:
            continue
        wish = (snap(x) + shift[0], snap(y) + shift[1])
        if cells.free(wish, 2 * RADIUS):
            placed[i] = wish
        else:
            waiting.append(i)
    for i in range(len(free)):
        if i in placed and i not in pins:
            cells.add(placed[i])
    for i in waiting:
        placed[i] = cells.nearest_free((snap(free[i][0]) + shift[0], snap(free[i][1]) + shift[1]))
        cells.add(placed[i])
        moved.add(i)
    return [placed[i] for i in range(len(free))], shift, frozenset(moved)


def with_origins(problem: LayoutProblem, free: Sequence[Point]) -> dict[int, Point]:
    """The pins, and for instances whose origin is pinned the places of their neurons, as the free layout (in the
    picture's coordinates) has these in relation to each other; but for those that stand on pins then.

    The origin of an instance whose module pins nothing is where its smallest x and y are.
    """
    taken = CentreCells()
    for point in problem.pins.values():
        taken.add(point)
    found: dict[int, Point] = {}
    for module in problem.modules:
        if module.origin is None or not module.members:
            continue
        own = [free[member] for member in module.members]
        x, y = module.origin[0] - min(a for a, _ in own), module.origin[1] - min(b for _, b in own)
        for member, (a, b) in list(module.pins.items())[:1]:
            x, y = module.origin[0] + a - free[member][0], module.origin[1] + b - free[member][1]
        places = {i: (x + a, y + b) for i, (a, b) in zip(module.members, own, strict=True) if i not in problem.pins}
        places = {i: place for i, place in places.items() if taken.free(place, 2 * RADIUS)}
        for place in places.values():
            taken.add(place)
        found.update(places)
    return dict(sorted({**found, **problem.pins}.items()))


class CentreCells:
    """Centres in square cells, to ask whether a place is free."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], list[Point]] = {}

    def add(self, point: Point) -> None:
        """Add a centre."""
        self._cells.setdefault((math.floor(point[0]), math.floor(point[1])), []).append(point)

    def free(self, point: Point, clear: float) -> bool:
        """Whether no centre is closer than ``clear``, at most 1."""
        column, row = math.floor(point[0]), math.floor(point[1])
        return all(
            distance(point, other) >= clear
            for i in (-1, 0, 1)
            for j in (-1, 0, 1)
            for other in self._cells.get((column + i, row + j), ())
        )

    def nearest_free(self, wish: Point) -> Point:
        """The nearest free place on a lattice around the wish; sideways first."""
        reach = 4
        while True:
            steps = range(-reach, reach + 1)
            around = sorted((i * i + j * j, abs(j), -i, -j) for i in steps for j in steps)
            for squared, _, i, j in around:
                if squared > reach * reach:
                    break
                place = (wish[0] - i * _STEP, wish[1] - j * _STEP)
                if self.free(place, _CLEAR):
                    return place
            reach *= 2
