"""Beads: a small open bead on every connection whose signal arrives later than those of others.

In: delays and lines. Out: a bead near the middle of each such line, and what the legend says of them. Where some
connections have no delay, so that what they send takes part in the very step that a picture shows, those with any
delay have beads; else those of several steps.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.model import Point
from neurovis_spec.scene.geometry import point_at
from neurovis_spec.scene.lines import Line
from neurovis_spec.scene.model import Rectangle, Theme

#: more beads than this would not be quiet
_MOST = 300
#: beads are not smaller, so that they can be seen, and none is on lines between discs that are hardly larger
_SMALLEST, _SMALLEST_DISC = 2.0, 5.0
#: where they may be on their lines, the best place first; and how far apart, in radii, so that each can be told
_PLACES, _APART = (1 / 2, 0.42, 0.58, 0.34, 0.66), 2.8


def delayed(network: Network) -> list[int]:
    """The connections with beads; none where there are too many to be marked."""
    delays = network.connections.delays.whole()
    found: list[int] = (delays > int(delays.min(initial=1))).nonzero()[0].tolist()
    return found if len(found) <= _MOST else []


def visible(disc: float) -> bool:
    """Whether discs of this radius leave room for beads."""
    return disc >= _SMALLEST_DISC


def bead(centre: Point, radius: float, theme: Theme) -> Rectangle:
    """A bead: a square with corners as round as they get."""
    corner = (centre[0] - radius, centre[1] - radius)
    return Rectangle(corner, 2 * radius, 2 * radius, radius, theme.background, theme.muted, 0.4 * radius)


def beads(network: Network, lines: Mapping[int, Line], disc: float, theme: Theme) -> dict[int, Rectangle]:
    """By connection, of those that have a line; ``disc`` is the radius of neurons."""
    if not visible(disc):
        return {}
    radius = min(3.2, max(_SMALLEST, 0.16 * disc))
    found: dict[int, Point] = {}
    for index in delayed(network):
        if index not in lines:
            continue
        line = lines[index].points
        places = [point_at(line, share * (len(line) - 1) / 3) for share in _PLACES]
        free = (
            place for place in places if all(math.dist(place, other) >= _APART * radius for other in found.values())
        )
        found[index] = next(free, places[0])
    return {index: bead(place, radius, theme) for index, place in found.items()}


def label_of(network: Network) -> str:
    """Which delays have beads, and which have none: ``delay 3 … 10, else 1``; '' where nothing is marked."""
    delays = network.connections.delays.whole()
    chosen = delayed(network)
    if not chosen:
        return ""
    low, high = int(delays[chosen].min()), int(delays[chosen].max())
    marked = f"delay {low} … {high}" if low < high else f"delay {low}"
    return marked if len(chosen) == len(delays) else f"{marked}, else {int(delays.min())}"
