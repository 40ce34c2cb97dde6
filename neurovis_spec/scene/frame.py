"""The frame: how big a picture is, how layout units become user units, and these pixels.

A picture is arranged in page units, in which texts have the same size everywhere, and drawn in user units, in which
lines are as wide as Eq. 4 says. These are the same, but where discs are so small that lines would be as thick as they:
there a page unit is several user units (``unit_for``), so that all lines get thinner together.

In: the extent of what a layout holds, room for header and legend, the size that the author asks for. Out: a Frame.
A picture that has room to spare has more pixels for each unit, so that its texts grow with its discs. Without a stated
size a picture has at most 1280 × 960 pixels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.geometry import Rect
from neurovis_spec.layout.labels import UNIT

MOST = (1280.0, 960.0)
MARGIN = 26.0
#: Pixels for a page unit: without a stated size the first with which the picture is small enough. Multiples of
#: ``_WHOLE`` units are whole pixels with each.
DENSITIES, _WHOLE = (1.5, 1.25, 1.0), 4
#: How many times as wide as the thickest line a disc is, and the most user units in a page unit.
_DISCS_TO_LINES, _FINEST = 2.0, 256.0
#: With a stated size at most this, and layout units at most so much larger than ``UNIT``.
DENSEST, _LARGEST = 4.0, 1.4


@dataclass(frozen=True, slots=True)
class Frame:
    """``unit = layout * scale + (left, top)``; the picture is ``width`` by ``height``, ``density`` pixels a unit: page
    units, or, after ``times``, user units."""

    width: float
    height: float
    scale: float
    left: float
    top: float
    density: float

    @property
    def widest(self) -> float:
        """The width of a line that covers the picture wherever it runs: a wider one cannot be told from it."""
        return 2 * float(np.hypot(self.width, self.height))

    def map(self, points: FloatArray) -> FloatArray:
        """Layout units (…, 2) to units of the frame."""
        result: FloatArray = points * self.scale + np.array([self.left, self.top])
        return result

    def times(self, units: float) -> Frame:
        """The same picture in so many units for each of this frame's."""
        wide, high, left, top = (units * length for length in (self.width, self.height, self.left, self.top))
        return Frame(wide, high, units * self.scale, left, top, self.density / units)


@dataclass(frozen=True, slots=True)
class Margins:
    """What stands around the layout: a header, so ``wide``, and a footer, as high as ``header(width)`` and
    ``footer(width)``, and how wide the picture should be for their sake; and the margin on either side."""

    wide: float
    header: Callable[[float], float]
    footer: Callable[[float], float]
    narrowest: float
    margin: float = MARGIN

    def around(self, width: float) -> float:
        """How high header and footer are in a picture of this width."""
        return self.header(width) + self.footer(width)


def unit_for(radius: float, widths: FloatArray) -> float:
    """User units in a page unit: as many as make the thickest line no wider than half a disc of this ``radius`` (page
    units). ``widths`` are those of all lines, in user units; those that nothing would make narrow enough do not count.

    >>> unit_for(19.8, np.array([0.6, 9.0])), unit_for(3.0, np.array([0.6, 9.0])), unit_for(3.0, np.array([9.0, 1e9]))
    (1.0, 3.0, 3.0)
    """
    needed = _DISCS_TO_LINES * np.minimum(widths, 1e12) / (2 * radius)
    return float(np.max(needed[needed <= _FINEST], initial=1.0))


def fit(extent: Rect, margins: Margins, size: tuple[int, int] | None) -> Frame:
    """Fit ``extent`` (layout units) between header and footer, into ``size`` pixels or what it needs."""
    x0, y0, x1, y1 = extent
    across, down = max(x1 - x0, 1e-9), max(y1 - y0, 1e-9)
    if size is None:
        wide, high, scale, density = _natural(across, down, margins)
    else:
        wide, high, scale, density = _within(across, down, margins, (float(size[0]), float(size[1])))
    free = high - margins.header(wide) - margins.footer(wide) - down * scale
    left, top = (wide - across * scale) / 2, margins.header(wide) + max(free, 0.0) / 2
    return Frame(wide, high, scale, left - x0 * scale, top - y0 * scale, density)


def _natural(across: float, down: float, margins: Margins) -> tuple[float, float, float, float]:
    """Width, height, scale and density from the layout."""
    wide = MOST[0]
    scale = UNIT
    for _ in range(3):  # the footer's height depends on the width, the width on the scale, the scale on the height left
        scale = min(UNIT, _scale(across, down, margins, (MOST[0], MOST[1]), margins.around(wide)))
        natural = max(across * scale + 2 * margins.margin, margins.wide + 2 * MARGIN, margins.narrowest)
        wide = min(MOST[0], whole(natural))
    high = min(MOST[1], whole(margins.header(wide) + down * scale + margins.footer(wide) + 2 * MARGIN))
    density = next(d for d in DENSITIES if d == 1 or (wide * d <= MOST[0] and high * d <= MOST[1]))
    return wide, high, scale, density


def whole(value: float) -> float:
    """A length that is whole pixels with each of ``DENSITIES``."""
    return float(np.ceil(value / _WHOLE)) * _WHOLE


def _within(
    across: float, down: float, margins: Margins, size: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Width, height, scale and density for this many pixels: as dense as leaves the layout its usual size."""

    def at(density: float) -> float:
        wide, high = size[0] / density, size[1] / density
        return _scale(across, down, margins, (wide, high), margins.around(wide))

    low, high = 1.0, max(1.0, min(DENSEST, size[0] / margins.narrowest))
    if at(high) >= UNIT:
        low = high
    for _ in range(24):
        middle = (low + high) / 2
        low, high = (middle, high) if at(middle) >= UNIT else (low, middle)
    return size[0] / low, size[1] / low, min(_LARGEST * UNIT, at(low)), low


def _scale(across: float, down: float, margins: Margins, room: tuple[float, float], around: float) -> float:
    """The most page units for a layout unit, with so much above and below."""
    left = room[1] - around - 2 * MARGIN
    return max(1e-9, min(max(room[0] - 2 * margins.margin, 8.0) / across, max(left, 8.0) / down))
