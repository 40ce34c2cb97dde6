"""Pins: what is pinned stays; the rest is moved to it as a whole, and off the pinned discs one by one.

In: a free layout and the pins. Out: positions in which every pin is exact and no two centres are closer than a disc.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from neurovis_layouts.axes import shift_of
from neurovis_layouts.occupancy import Occupancy, Wish, lone
from neurovis_spec.layout.geometry import distance, snap
from neurovis_spec.layout.model import RADIUS, LayoutProblem, Point

#: Rounding to the grid does not make discs overlap.
_SLACK = 1e-6


def fit(free: Sequence[Point], pins: Mapping[int, Point]) -> tuple[list[Point], Point, frozenset[int]]:
    """Positions with the pins kept, the translation of the rest, and who did not simply follow that translation.

    The translation is the least-squares fit of the free layout to the pins (the mean of the differences).
    """
    if not pins:
        return list(free), (0.0, 0.0), frozenset()
    shift = shift_of(free, pins)
    occupancy = Occupancy(placed=pins)
    places = [(snap(x) + shift[0], snap(y) + shift[1]) for x, y in free]
    occupancy.settle([Wish((lone(i),), place) for i, place in enumerate(places) if i not in pins])
    found = [occupancy.placed[i] for i in range(len(free))]
    moved = {i for i, (one, other) in enumerate(zip(found, places, strict=True)) if one != other}
    return found, shift, frozenset(moved | pins.keys())


def with_origins(problem: LayoutProblem, free: Mapping[int, Point], far: bool = False) -> dict[int, Point]:
    """The pins, and for instances whose origin is pinned the places of their neurons, as the free layout has these in
    relation to each other; but for those that stand on pins then, and for instances that it does not have as a whole.

    The origin of an instance whose module pins nothing is where its smallest x and y are; with ``far`` its largest y,
    which is the smallest in a picture that runs the other way.
    """
    found: dict[int, Point] = {}
    for module in problem.modules:
        if module.origin is None or not module.members or not free.keys() >= set(module.members):
            continue
        own = {member: free[member] for member in module.members}
        low = min(a for a, _ in own.values()), (max if far else min)(b for _, b in own.values())
        x, y = module.origin[0] - low[0], module.origin[1] - low[1]
        for member, (a, b) in list(module.pins.items())[:1]:
            x, y = module.origin[0] + a - own[member][0], module.origin[1] + b - own[member][1]
        found |= {i: (x + a, y + b) for i, (a, b) in own.items() if i not in problem.pins}
    close = 2 * RADIUS - _SLACK
    off = {
        i: place for i, place in found.items() if all(distance(place, pin) >= close for pin in problem.pins.values())
    }
    return dict(sorted({**off, **problem.pins}.items()))
