"""The room that a page gives the network: the rectangle of a picture in which it lies, without title, notes and legend,
which the page has elsewhere.

In: a Scene. Out: a rectangle in its units, whole pixels of the picture in its own size.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.geometry import Rect
from neurovis_spec.scene import Disc, Image, Polygon, Polyline, Ramp, Rectangle, Scene, Shape, Spline, Text
from neurovis_spec.scene.encode import CAPTION
from neurovis_spec.scene.geometry import bounds, samples
from neurovis_spec.scene.texts import SUBSCRIPT_SIZE, width

#: What of a picture is no part of the network, by the ids of its groups.
AROUND: Final = frozenset({"title", CAPTION, "notes", "legend"})
#: Points on each piece of a line; how much of a text's size is above its baseline, and below.
_DOTS, _ABOVE, _BELOW = 8, 0.8, 0.25


def network_rect(scene: Scene) -> Rect:
    """The least x and y, the largest x and y of the network; those of the picture where there is none."""
    shapes = [shape for group in scene.groups if group.id not in AROUND for shape in group.shapes]
    lines = [shape for shape in shapes if isinstance(shape, Spline)]
    reach = max((line.width for line in lines if math.isfinite(line.width)), default=0.0)
    found = bounds([*samples([line.points for line in lines], _DOTS), *_corners(shapes)])
    if found is None:
        return 0.0, 0.0, scene.width, scene.height
    edge, pixels = min(reach, 8.0) / 2, scene.density
    x0, y0 = (math.floor((value - edge) * pixels) / pixels for value in found[:2])
    x1, y1 = (math.ceil((value + edge) * pixels) / pixels for value in found[2:])
    return max(0.0, x0), max(0.0, y0), min(scene.width, x1), min(scene.height, y1)


def _corners(shapes: Iterable[Shape]) -> Iterator[FloatArray]:
    """Points around all that is no line."""
    for shape in shapes:
        match shape:
            case Disc(centre=(x, y), radius=radius):
                reach = radius + shape.stroke_width / 2
                yield np.array([(x - reach, y - reach), (x + reach, y + reach)])
            case Polyline() | Polygon():
                yield np.array(shape.points, float)
            case Rectangle(corner=(x, y)) | Ramp(corner=(x, y)) | Image(corner=(x, y)):
                yield np.array([(x, y), (x + shape.width, y + shape.height)])
            case Text():
                yield _text(shape)


def _text(text: Text) -> FloatArray:
    """Two corners of a text."""
    (x, y), size = text.point, text.size
    wide = width(text.text, size, text.weight) + width(text.subscript, SUBSCRIPT_SIZE * size, text.weight)
    first = {"start": 0.0, "middle": -wide / 2, "end": -wide}[text.anchor]
    along, up = (first, first + wide), (_ABOVE * size, -_BELOW * size)
    if text.upward:
        return np.array([(x - up[0], y - along[1]), (x - up[1], y - along[0])])
    return np.array([(x + along[0], y - up[0]), (x + along[1], y - up[1])])
