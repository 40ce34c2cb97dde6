"""Mirror images of routes: the one as the reflection of the other, or as its own.

In: which edge is whose image, and the axis. Out: routes, exactly symmetric.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from neurovis_layouts.routing.ends import Key
from neurovis_spec.layout.geometry import snap, snapped
from neurovis_spec.layout.model import LayoutEdge, Point, Route


@dataclass(frozen=True, slots=True)
class Images:
    """Of the edges that are drawn, those that are their mirror images: each itself where it leads to the image of the
    neuron that it comes from. The axis is at half of ``twice``."""

    of: Mapping[int, int] = field(default_factory=dict)
    twice: float = 0.0

    def kept(
        self, routes: Mapping[int, Route], edges: Sequence[LayoutEdge], centres: Sequence[Point]
    ) -> dict[int, Route]:
        """The routes of these edges and their images, symmetric."""
        found: dict[int, Route] = {}
        for i, other in self.of.items():
            if i in routes:
                found[i] = snapped(routes[i])
                found[other] = self.even(found[i]) if i == other else self.reflected(found[i], edges[other], centres)
        return found

    def reflected(self, route: Route, edge: LayoutEdge, centres: Sequence[Point]) -> Route:
        """The reflection of a route, as that of an edge: from centre to centre exactly."""
        return centres[edge.source], *((self.twice - x, y) for x, y in route[1:-1]), centres[edge.target]

    def even(self, route: Route) -> Route:
        """A route from a neuron to its mirror image, as it would be on both sides of the axis."""
        half = len(route) // 2
        before = [
            (snap((x + self.twice - other) / 2), snap((y + height) / 2))
            for (x, y), (other, height) in zip(route[1:half], route[-2 : -half - 1 : -1], strict=True)
        ]
        middle = [(self.twice / 2, before[-1][1])] if len(route) % 2 else []
        return route[0], *before, *middle, *((self.twice - x, y) for x, y in before[::-1]), route[-1]

    def even_line(self, line: tuple[Point, ...]) -> tuple[Point, ...]:
        """A line of corners from a neuron to its mirror image, as its first half is."""
        half = line[: len(line) // 2]
        middle = [(self.twice / 2, line[len(half)][1])] if len(line) % 2 else []
        return *half, *middle, *((self.twice - x, y) for x, y in half[::-1])


def images_of(keys: Sequence[Key], centres: Sequence[Point], pair: Mapping[int, int], axis: float) -> Images:
    """Which connections are mirror images of others, by who is whose ``pair``; who stands on the axis is their own.
    There and back are taken from the same side: the sides that they bow to are exchanged on the other."""

    def image(neuron: int) -> int:
        return pair.get(neuron, neuron if centres[neuron][0] == axis else -1)

    number = {key: i for i, key in enumerate(keys)}
    of: dict[int, int] = {}
    for key in sorted(keys, key=lambda key: (sorted(key[:2]), key)):
        source, target, times = key
        other = number.get((image(source), image(target), times))
        if source != target and pair.get(source) == target:
            of[number[key]] = number[key]
        elif other is not None and other != number[key] and other not in of:
            of[number[key]] = other
    return Images(of, 2 * axis)
