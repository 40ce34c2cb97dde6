"""The entries of a legend that show scales: which activities and signals have which colour, which weights which
thickness, how far what changes glows.

In: gains, a theme. Out: LegendEntry: shapes with their corner at the origin. Where all have one scale, an entry is a
sample and a line for it; else there is a line for each scale, with the names of what has it. A line says how far values
go that a scale does not show.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from neurovis_spec.scene import texts
from neurovis_spec.scene.encoding import FAINTEST, THINNEST, glow_width
from neurovis_spec.scene.gains import Gains, Scale
from neurovis_spec.scene.model import Ramp, Shape, Spline, Text, Theme
from neurovis_spec.scene.themes import colours

HEADING, SMALL = 11.5, 11.0
#: the middle of the sample under the heading, and the baselines of the lines of text under it
SAMPLE_Y, FIRST_Y, SECOND_Y = 20.0, 41.0, 55.0
LINE = SECOND_Y - FIRST_Y
_RAMP, _STRIPES = 150.0, 75
_STROKE, _STROKE_GAP, _WIDEST = 36.0, 10.0, 8.6
#: in a table of scales: the length of a stroke, and the gaps beside its number
_SHORT, _NEAR, _APART, _PITCH = 22.0, 4.0, 9.0, 15.0
#: the baseline of its first line
_TABLE_Y = 26.0
#: how wide the names of a scale may be, and more than fit into that
_NAMES, _FIT = 132.0, 30
#: what goes less than this beyond a scale is not worth a word
_BEYOND = 1.05
#: what is said of a scale that is compressed, and how much farther apart its weights in a legend are
_ROOT, _FARTHER = "square root", 0.3


@dataclass(frozen=True, slots=True)
class LegendEntry:
    """Shapes with their corner at the origin, and how wide and high they are."""

    shapes: tuple[Shape, ...]
    width: float
    height: float = SECOND_Y + 3.0


def high(lines: int) -> float:
    """How high an entry is with so many lines of text: two, at least."""
    return FIRST_Y + LINE * (max(lines, 2) - 1) + 3.0


def heading(words: str, theme: Theme) -> Text:
    """What an entry is called."""
    return Text((0, 9), words, HEADING, theme.ink, weight=600)


def stroke(x: float, length: float, colour: str, width: float, y: float = SAMPLE_Y) -> Spline:
    """A horizontal line."""
    return Spline(((x, y), (x + length / 3, y), (x + length * 2 / 3, y), (x + length, y)), colour, width)


def colour(gains: Gains, signals: str | None, theme: Theme) -> list[LegendEntry]:
    """The scales of activities and of signals, with what is said of these beside (None: there are no lines): in one
    entry, or two where one has several."""
    states = {scale.state for scale in gains.activity_scales}
    word = "activity" if states <= {""} else "" if "" in states or len(states) > 1 else next(iter(states))
    neurons = _rows(f"neuron: {word or 'activity'}", gains.activity_scales)
    said = f"signal {signals or ''}".rstrip()
    lines = _rows(f"line: {said}", gains.signal_scales) if signals is not None else []
    if len(neurons) <= 1 and len(lines) <= 1:
        return [_ramp("Colour", [*neurons, *lines], theme)]
    told = gains.activity_scales if word else [_with_state(scale) for scale in gains.activity_scales]
    result = [_ramp(f"Neurons: {word}" if word else "Neurons", _rows("", told), theme)]
    if lines:
        result.append(_ramp(f"Lines: {said}", _rows("", gains.signal_scales), theme))
    return result


def _with_state(scale: Scale) -> Scale:
    """A scale whose names say what is shown of them: ``v of K``."""
    what = scale.state or "activity"
    first, *others = scale.names or ("",)
    return replace(scale, names=(f"{what} of {first}" if first else what, *others))


def thickness(gains: Gains, theme: Theme) -> list[LegendEntry]:
    """What weights the widths of lines stand for; only widths that occur."""
    shown = [
        (scale, weights)
        for scale in gains.thickness_scales
        if scale.gain and scale.reaches and math.isfinite(_WIDEST / scale.gain)
        for weights in [_root_weights(scale) if scale.compressed else nice_weights(scale.gain, scale.reaches)]
    ]
    if not shown:
        return []
    if len(shown) == 1 and len(gains.thickness_scales) == 1:
        return [_strokes(*shown[0], theme)]
    shapes: list[Shape] = [heading("Thickness: weight |w|", theme)]
    across = texts.width("Thickness: weight |w|", 11.5, 600)
    columns = max(len(weights) for _, weights in shown)
    number = max(texts.width(texts.number(weight), SMALL) for _, weights in shown for weight in weights)
    step = _SHORT + _NEAR + number + _APART
    for row, (scale, weights) in enumerate(shown):
        y = _TABLE_Y + _PITCH * row
        for place, weight in enumerate(weights):
            x = place * step
            shapes.append(stroke(x, _SHORT, theme.muted, _wide(scale, weight), y - 4))
            shapes.append(Text((x + _SHORT + _NEAR, y), texts.number(weight), SMALL, theme.muted))
        words, x = with_root(named(scale), scale), columns * step
        shapes.append(Text((x, y), words, SMALL, theme.muted))
        across = max(across, x + texts.width(words, SMALL))
    return [LegendEntry(tuple(shapes), across, max(high(1), _TABLE_Y + _PITCH * (len(shown) - 1) + 3.0))]


def _wide(scale: Scale, weight: float) -> float:
    """How wide a line of this weight is."""
    return max(THINNEST, abs(scale.gain) * scale.shown(weight))


def with_root(words: str, scale: Scale) -> str:
    """Words of a scale, which say so where it is compressed."""
    return f"{words}, {_ROOT}" if scale.compressed else words


def glow(gains: Gains, theme: Theme) -> list[LegendEntry]:
    """How far what changes glows, if anything does: a sample at full intensity."""
    shown = [scale for scale in gains.change_scales if scale.gain * scale.reaches >= FAINTEST]
    if not shown:
        return []
    alone = len(gains.change_scales) == 1 and not shown[0].names
    told = [f"|Δw| {texts.number(1 / abs(scale.gain))} a step" for scale in shown]
    most = [f"only the largest, from {texts.number(scale.least)}" if scale.least else "" for scale in shown]
    if not alone:
        told = [f"{named(scale)}: {words}" for scale, words in zip(shown, told, strict=True)]
    lines = ["weight is changing", *(words for pair in zip(told, most, strict=True) for words in pair if words)]
    width = 3.0
    lit = float(glow_width(np.array(width), np.array(1.0)))
    across = max(texts.width(line, SMALL) for line in lines)
    shapes: list[Shape] = [heading("Glow", theme), stroke(0, 64, theme.glow, lit), stroke(0, 64, theme.muted, width)]
    shapes += [Text((0, FIRST_Y + LINE * place), line, SMALL, theme.muted) for place, line in enumerate(lines)]
    return [LegendEntry(tuple(shapes), across, high(len(lines)))]


def named(scale: Scale) -> str:
    """The names of what has a scale, as many as there is room for."""
    if not scale.names:
        return "others"
    names = [name.replace("->", "→") for name in scale.names]
    for count in range(min(len(names), _FIT), 0, -1):
        more = f" + {len(names) - count} more" if count < len(names) else ""
        words = ", ".join(names[:count]) + more
        if texts.width(words, SMALL) <= _NAMES:
            return words
    more = f" + {len(names) - 1} more" if len(names) > 1 else ""
    return texts.shorten(names[0], SMALL, _NAMES - texts.width(more, SMALL)) + more


def nice_weights(gain: float, heaviest: float = math.inf) -> list[float]:
    """Up to three weights that are 1, 2 or 5 times a power of ten, the largest at most ``heaviest`` and drawn no wider
    than a legend has room for, the others no thinner than a line can be.

    >>> nice_weights(4.0), nice_weights(4.0, 1.01), nice_weights(15.0, 0.1), nice_weights(1.0, 0.03)
    ([0.5, 1.0, 2.0], [0.2, 0.5, 1.0], [0.05, 0.1], [0.02])
    """
    value = _nice_below(min(_WIDEST / abs(gain), heaviest))
    values = [value]
    while len(values) < 3:
        value = _nice_below(value * 0.6)
        if value * abs(gain) < THINNEST:
            break
        values.append(value)
    return values[::-1]


def _root_weights(scale: Scale) -> list[float]:
    """The same of a scale that is compressed, farther apart.

    >>> _root_weights(Scale(2.0, reaches=30.0, compressed=True))
    [0.5, 2.0, 10.0]
    """
    values = [_nice_below(min(_WIDEST**2 * scale.full, scale.reaches))]
    while len(values) < 3:
        value = _nice_below(values[-1] * _FARTHER * (1 + 1e-9))
        if abs(scale.gain) * scale.shown(value) * _BEYOND < THINNEST:
            break
        values.append(value)
    return values[::-1]


def _nice_below(value: float) -> float:
    exponent = math.floor(math.log10(value))
    factor = next((factor for factor in (5, 2) if factor * 10.0**exponent <= value * (1 + 1e-9)), 1)
    return float(f"{factor}e{exponent}")


class _Row(NamedTuple):
    """A line under a ramp: what stands at its left end, in its middle, and at its right end; or, if it is ``within``,
    halfway from the middle to the ends."""

    low: str
    middle: str
    high: str
    within: bool = False


def _rows(words: str, scales: Sequence[Scale]) -> list[_Row]:
    """For each scale what is full on the left, what it is of, and what is full on the right; of one that is compressed
    also what has half of a colour."""
    rows = []
    for scale in scales:
        parts = (words, named(scale) if len(scales) > 1 or scale.names else "", _beyond(scale))
        low, high = _around(scale, 1.0)
        rows.append(_Row(low, " ".join(part for part in parts if part), high))
        if scale.compressed:
            low, high = _around(scale, 0.25)
            rows.append(_Row(low, _ROOT, high, within=True))
    return rows


def _around(scale: Scale, share: float) -> tuple[str, str]:
    """The values that are so far from the middle as a share of those at which the colour is full; they change places
    where the gain is negative."""
    if not scale.gain:
        return "−∞", "+∞"
    half = math.copysign(scale.full, scale.gain)
    digits = 3 if share == 1 else 2
    low, high = (texts.number(scale.centre + side * share * half, digits, sign=True) for side in (-1, 1))
    return low, high


def _beyond(scale: Scale) -> str:
    """How far values go that a scale does not show."""
    if scale.shown(scale.reaches) * abs(scale.gain) <= _BEYOND:
        return ""
    return "(and beyond)" if scale.centre else f"(up to {texts.number(scale.reaches, 2)})"


def _ramp(words: str, rows: Sequence[_Row], theme: Theme) -> LegendEntry:
    # the words stand in the middle, so the longer end counts twice, and one within stands on a mark of its own
    needed = [
        (texts.width(middle, SMALL) + (1 + (not within)) * max(texts.width(low, SMALL), texts.width(right, SMALL)) + 14)
        * (1 + within)
        for low, middle, right, within in rows
    ]
    across = max(_RAMP, *needed) if needed else _RAMP
    stripes = colours(theme, np.linspace(-1, 1, _STRIPES))
    shapes: list[Shape] = [heading(words, theme), Ramp((0, SAMPLE_Y - 5), across, 10, tuple(stripes))]
    for place, (low, middle, right, within) in enumerate(rows):
        y = FIRST_Y + LINE * place
        left, end = (0.25 * across, 0.75 * across) if within else (0.0, across)
        shapes += [
            Text((left, y), low, SMALL, theme.muted, "middle" if within else "start"),
            Text((across / 2, y), middle, SMALL, theme.muted, "middle"),
            Text((end, y), right, SMALL, theme.muted, "middle" if within else "end"),
        ]
    return LegendEntry(tuple(shapes), max(across, texts.width(words, HEADING, 600)), high(len(rows)))


def _strokes(scale: Scale, weights: Sequence[float], theme: Theme) -> LegendEntry:
    shapes: list[Shape] = [heading("Thickness", theme)]
    strokes = len(weights) * (_STROKE + _STROKE_GAP) - _STROKE_GAP
    words = with_root(f"|w| of {named(scale)}" if scale.names else "line: weight |w|", scale)
    across = max(strokes, texts.width(words, SMALL))
    for place, value in enumerate(weights):
        x = (across - strokes) / 2 + place * (_STROKE + _STROKE_GAP)
        shapes.append(stroke(x, _STROKE, theme.muted, _wide(scale, value)))
        shapes.append(Text((x + _STROKE / 2, FIRST_Y), texts.number(value), SMALL, theme.muted, "middle"))
    shapes.append(Text((across / 2, SECOND_Y), words, SMALL, theme.muted, "middle"))
    return LegendEntry(tuple(shapes), across)
