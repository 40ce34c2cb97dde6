"""The frame: how big a picture is, and how layout units become user units.

In: the extent of what a layout holds, room for header and legend, the size that the author asks for. Out: a Frame with
the scale, the offset and the whole size; without a stated size at most 1280 × 960.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from neurovis_spec.scene.geometry import FloatArray, Rect

#: User units for one layout unit in a picture that is small enough.
UNIT = 66.0
MOST = (1280.0, 960.0)
MARGIN = 26.0


@dataclass(frozen=True, slots=True)
class Frame:
    """``user = layout * scale + (left, top)``; the picture is ``width`` by ``height``."""

    width: float
    height: float
    scale: float
    left: float
    top: float

    def map(self, points: FloatArray) -> FloatArray:
        """Layout units (…, 2) to user units."""
        result: FloatArray = points * self.scale + np.array([self.left, self.top])
        return result


def fit(
    extent: Rect,
    header: tuple[float, float],
    footer: Callable[[float], float],
    narrowest: float,
    size: tuple[int, int] | None,
) -> Frame:
    """Fit ``extent`` (layout units) between a header (width and height) and a footer as high as ``footer(width)``."""
    x0, y0, x1, y1 = extent
    across, down = max(x1 - x0, 1e-9), max(y1 - y0, 1e-9)
    most_wide, most_high = MOST if size is None else (float(size[0]), float(size[1]))
    wide = most_wide
    scale = UNIT
    for _ in range(3):  # the footer's height depends on the width, the width on the scale, the scale on the height left
        room = most_high - header[1] - footer(wide) - 2 * MARGIN
        scale = min(UNIT if size is None else 3 * UNIT, (most_wide - 2 * MARGIN) / across, max(room, 8.0) / down)
        scale = max(scale, 1e-9)
        if size is None:
            natural = max(across * scale + 2 * MARGIN, header[0] + 2 * MARGIN, narrowest)
            wide = min(most_wide, float(np.ceil(natural)))
    content = down * scale
    high = most_high
    if size is None:
        high = min(most_high, float(np.ceil(header[1] + content + footer(wide) + 2 * MARGIN)))
    free = high - header[1] - footer(wide) - content
    return Frame(
        wide, high, scale, (wide - across * scale) / 2 - x0 * scale, header[1] + max(free, 0.0) / 2 - y0 * scale
    )
