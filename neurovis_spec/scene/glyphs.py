"""Glyphs: what tells a disc that stands for several neurons from one of a neuron, and says how many they are.

In: discs and labels in page units. Out: a second ring, the number of neurons under the name.
"""

from __future__ import annotations

from itertools import pairwise

from neurovis_spec.scene import texts
from neurovis_spec.scene.model import Point, Shape, Spline, Text
from neurovis_spec.scene.plan import Plan

#: The second ring: its radius in radii, its width in rings.
_INNER, _WIDTH = 0.87, 0.6
#: The number beside the label in its sizes: how large it is, and how far below.
_SMALLER, _BELOW = 0.85, 0.95
#: Of a glyph whose label does not stand on it, in radii.
_ALONE = 0.7
#: A quarter of a circle as a cubic spline.
_QUARTER = 0.5522847498


def marks_of(planned: Plan, index: int, ink: str) -> tuple[Shape, ...]:
    """The second ring of a glyph, and how many neurons it stands for."""
    (x, y), radius = planned.centres[index], planned.radii[index]
    ring = Spline(circle((x, y), _INNER * radius), planned.theme.ring, _WIDTH * planned.rings[index])
    label, words = planned.labels[index], f"×{planned.sizes[index]:,}"
    if label is not None and label.on_disc:
        size, y = _SMALLER * label.size, label.point[1] + _BELOW * label.size
    else:
        size = _ALONE * radius
        y += 0.36 * size
    if texts.width(words, size) > 1.9 * radius:
        return (ring,)
    return ring, Text((x, y), words, size, ink, "middle", on_disc=True)


def circle(centre: Point, radius: float) -> tuple[Point, ...]:
    """A circle as a cubic spline."""
    x, y = centre
    corners = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 0)]
    points: list[Point] = [(x + radius, y)]
    for (ax, ay), (bx, by) in pairwise(corners):
        for px, py in ((ax + _QUARTER * bx, ay + _QUARTER * by), (bx + _QUARTER * ax, by + _QUARTER * ay), (bx, by)):
            points.append((x + radius * px, y + radius * py))
    return tuple(points)
