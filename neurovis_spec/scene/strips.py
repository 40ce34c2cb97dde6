"""Strips: what all views over time share: where a step lies across the page, the frame, the ticks, the cursor.

In: the steps that are shown and those of the frames. Out: a Span; shapes. A strip is a title, a plot, and beneath the
last of several the axis of the time. Ticks are round values, 1, 2 or 5 times a power of ten apart, with as many
decimals as tell them apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import StepLength
from neurovis_spec.scene import texts
from neurovis_spec.scene.model import Group, Polyline, Rectangle, Shape, Text, Theme

SMALL = 11.0
#: A strip's title is as high as this, and so is the axis of the time.
TITLE, AXIS = 19.0, 34.0
#: User units between ticks of the time, at least.
_APART = 80.0
_TICK = 4.0


@dataclass(frozen=True)
class Span:
    """The steps (rows,) that strips show, from ``left`` to ``right`` (user units), and the steps of the frames (f,).
    ``dt`` is how long a step is shown to be, None where the spec of the network does not say it; ``what`` is what they
    count: time, or lags."""

    steps: IntArray
    frames: IntArray
    left: float
    right: float
    dt: StepLength | None
    what: str = "time"

    @property
    def stride(self) -> float:
        """From one step to the next."""
        steps = self.steps
        return max(1.0, float(steps[-1] - steps[0]) / (len(steps) - 1)) if len(steps) > 1 else 1.0

    @property
    def ends(self) -> tuple[float, float]:
        """The first and the last step, with half a step around each."""
        return float(self.steps[0]) - self.stride / 2, float(self.steps[-1]) + self.stride / 2

    def at(self, steps: IntArray | FloatArray) -> FloatArray:
        """Where steps lie across the page."""
        first, last = self.ends
        result: FloatArray = self.left + (np.asarray(steps, float) - first) / (last - first) * (self.right - self.left)
        return result


def frame(span: Span, top: float, bottom: float, theme: Theme) -> Rectangle:
    """The plot's ground."""
    extent = span.right - span.left, bottom - top
    return Rectangle((span.left, top), *extent, 0.0, theme.box_fill, theme.box_line, 1.0)


def title(words_: str, span: Span, theme: Theme) -> Text:
    """What a strip shows, above its plot."""
    text = texts.shorten(words_, SMALL, span.right - span.left)
    return Text((span.left, TITLE - 6.0), text, SMALL, theme.muted)


def time_axis(span: Span, bottom: float, theme: Theme) -> list[Shape]:
    """Ticks beneath a plot with their steps or times, and in which unit these are."""
    unit = 1.0 if span.dt is None else span.dt.length
    low, high = float(span.steps[0]) * unit, float(span.steps[-1]) * unit
    most = max(2, int((span.right - span.left) / _APART))
    found = [value for value in ticks(low, high, most) if span.dt is not None or value == round(value)] or [low]
    shapes: list[Shape] = []
    for value, said in zip(found, words(found), strict=True):
        (x,) = span.at(np.array([value / unit])).tolist()
        shapes.append(Polyline(((x, bottom), (x, bottom + _TICK)), theme.muted, 1.0))
        shapes.append(Text((x, bottom + 16.0), said, SMALL, theme.muted, "middle"))
    name = f"{span.what} ({'steps' if span.dt is None else span.dt.unit})"
    name = "step" if name == "time (steps)" else name
    shapes.append(Text(((span.left + span.right) / 2, bottom + 30.0), name, SMALL, theme.muted, "middle"))
    return shapes


def cursor(span: Span, top: float, bottom: float, theme: Theme, name: str) -> tuple[Group, FloatArray]:
    """The line at the step of the moment, and how far it is from where it begins, (f, 1, 2)."""
    places = span.at(span.frames)
    x = float(places[0])
    line = Polyline(((x, top - 3.0), (x, bottom + 3.0)), theme.ink, 1.2)
    shifts = np.zeros((len(places), 1, 2))
    shifts[:, 0, 0] = places - x
    return Group((line,), name, {"cursor": ""}), shifts


def columns(span: Span, most: int) -> IntArray:
    """Where the rows of a strip are cut into at most so many columns, (columns + 1,) row numbers."""
    rows = len(span.steps)
    cuts: IntArray = np.unique(np.linspace(0, rows, min(rows, max(most, 1)) + 1).astype(np.int64))
    return cuts


def spread(wanted: Sequence[float], apart: float, top: float, bottom: float) -> list[float]:
    """Places that are at least so far apart, each as near to the wanted one as a sweep up and one down bring it.

    >>> spread([5.0, 6.0, 50.0], 10.0, 0.0, 100.0)
    [5.0, 15.0, 50.0]
    >>> spread([99.0, 98.0], 10.0, 0.0, 100.0)
    [100.0, 90.0]
    """
    order = sorted(range(len(wanted)), key=lambda place: wanted[place])
    found = [0.0] * len(wanted)
    low = top
    for place in order:
        found[place] = low = max(low, wanted[place])
        low += apart
    high = bottom
    for place in reversed(order):
        found[place] = high = min(high, found[place])
        high -= apart
    return found


def ticks(low: float, high: float, most: int) -> list[float]:
    """Up to ``most`` (at least two) round values from ``low`` to ``high``, as many as there can be.

    >>> ticks(-1.02, 0.98, 5), ticks(0, 128, 6), ticks(3.0, 3.0, 5)
    ([-1.0, -0.5, 0.0, 0.5], [0.0, 50.0, 100.0], [3.0])
    """
    if not (math.isfinite(low) and math.isfinite(high)) or high <= low:
        return [low]
    exponent = math.floor(math.log10(high / most - low / most))
    for power in range(exponent, exponent + 3):
        for factor in (1, 2, 5):
            step = float(f"{factor}e{power}")
            if step <= 0 or not math.isfinite(step):
                continue
            first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
            if last - first + 1 <= most:
                return [float(f"{number * step:.12g}") for number in range(first, last + 1)] or [low]
    return [low]


def words(values: list[float]) -> list[str]:
    """How ticks are written: all with as many decimals as the one that needs most, where these are few.

    >>> words([-0.5, 0.0, 0.5]), words([0.0, 50.0]), words([0.0, 1e-7]), words([2e9, 4e9])
    (['−0.5', '0', '0.5'], ['0', '50'], ['0', '1e−7'], ['2e9', '4e9'])
    """
    if any(abs(value) >= 1e6 or 0 < abs(value) < 1e-4 for value in values):
        return [texts.number(value) for value in values]
    decimals = max((len(f"{value:.6f}".rstrip("0").partition(".")[2]) for value in values), default=0)
    return ["0" if value == 0 else f"{value:.{decimals}f}".replace("-", "−") for value in values]
