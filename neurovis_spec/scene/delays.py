"""Beads: a small open bead on every connection whose signal is under way for more than one step.

In: delays and lines. Out: a bead in the middle of each such line, and what the legend says of them. Delays of 0 and 1
look alike: which of the two it is decides nothing that a picture of one step could show.
"""

from __future__ import annotations

from collections.abc import Sequence

from neurovis_spec.compiler.network import Network
from neurovis_spec.scene.geometry import Point, point_at
from neurovis_spec.scene.lines import Line
from neurovis_spec.scene.model import Rectangle, Theme

#: more beads than this would not be quiet
_MOST = 300
#: smaller beads cannot be seen
_SMALLEST = 1.5


def delayed(network: Network) -> list[int]:
    """The connections with a delay of several steps; none where there are too many to be marked."""
    found: list[int] = (network.connections.delays > 1).nonzero()[0].tolist()
    return found if len(found) <= _MOST else []


def bead(centre: Point, radius: float, theme: Theme) -> Rectangle:
    """A bead: a square with corners as round as they get."""
    corner = (centre[0] - radius, centre[1] - radius)
    return Rectangle(corner, 2 * radius, 2 * radius, radius, theme.background, theme.muted, 0.4 * radius)


def beads(network: Network, lines: Sequence[Line], disc: float, theme: Theme) -> dict[int, Rectangle]:
    """By connection; ``disc`` is the radius of neurons."""
    radius = min(3.2, 0.16 * disc)
    if radius < _SMALLEST:
        return {}
    middles = {index: point_at(lines[index].points, (len(lines[index].points) - 1) / 6) for index in delayed(network)}
    return {index: bead(middle, radius, theme) for index, middle in middles.items()}


def label_of(network: Network) -> str:
    """How long the delays are: ``delay: 3 … 10 steps``; '' where nothing is marked."""
    found = network.connections.delays[delayed(network)]
    if not len(found):
        return ""
    low, high = int(found.min()), int(found.max())
    return f"delay: {low} steps" if low == high else f"delay: {low} … {high} steps"
