"""Scales: what the colours of cells mean, as a small ramp with its ends.

In: the scales of what is shown, and what they are of. Out: shapes that end at a right edge.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.scene import texts
from neurovis_spec.scene.gains import Scale as Own
from neurovis_spec.scene.legend_scales import named, with_root
from neurovis_spec.scene.model import Ramp, Shape, Text, Theme
from neurovis_spec.scene.themes import colours

_SIZE, _RAMP, _STRIPES, _GAP = 10.5, 84.0, 42, 5.0


@dataclass(frozen=True, slots=True)
class ScaleLabel:
    """``low`` and ``high`` are written at the ends of the ramp, ``name`` before it; none where ``high`` is empty."""

    name: str
    low: str = ""
    high: str = ""

    @property
    def width(self) -> float:
        """How wide it is."""
        if not self.high:
            return 0.0
        said = (texts.width(word, _SIZE) for word in (self.name, self.low, self.high))
        return sum(said) + _RAMP + 4 * _GAP

    def shapes(self, right: float, baseline: float, theme: Theme, room: float) -> list[Shape]:
        """The ramp up to a right edge, its words on a baseline, in so much room."""
        if not self.high:
            return []
        end = right - texts.width(self.high, _SIZE)
        ramp = end - _GAP - _RAMP
        start = ramp - _GAP - texts.width(self.low, _SIZE)
        name = texts.shorten(self.name, _SIZE, room - (right - start) - 2 * _GAP)
        return [
            Text((start - 2 * _GAP, baseline), name, _SIZE, theme.muted, "end"),
            Text((ramp - _GAP, baseline), self.low, _SIZE, theme.muted, "end"),
            Ramp((ramp, baseline - 8), _RAMP, 8, tuple(colours(theme, np.linspace(-1, 1, _STRIPES)))),
            Text((end, baseline), self.high, _SIZE, theme.muted),
        ]


def scale_of(name: str, used: Sequence[tuple[Own, float]]) -> ScaleLabel:
    """What full colours mean: of one scale its ends, of several how far each goes. ``used``: the scales, each with the
    distance from its centre at which its colour is full; of one that is compressed this is said."""
    if not used:
        return ScaleLabel(name)
    if len(used) == 1:
        ((own, full),) = used
        name = with_root(name, own)
        if not math.isfinite(full):
            return ScaleLabel(name, "−∞", "+∞")
        low, high = (texts.number(own.centre + side * full, 3, sign=True) for side in (-1, 1))
        return ScaleLabel(name, low, high)
    parts = [
        f"{with_root(named(own), own)} ±{texts.number(full)}"
        + (f" around {texts.number(own.centre)}" if own.centre else "")
        for own, full in used
    ]
    return ScaleLabel(f"{name} of {' · '.join(parts)}" if name else " · ".join(parts), "−", "+")
