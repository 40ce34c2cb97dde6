"""The legend: what colour, thickness, glow, dotted and faint lines and beads mean, with their scales.

In: gains, a theme and what the picture holds. Out: entries, which flow into rows at the foot of a picture. An entry is
a heading, a sample and two lines of text.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurovis_spec.scene import texts
from neurovis_spec.scene.delays import bead
from neurovis_spec.scene.encoding import THINNEST, glow_width
from neurovis_spec.scene.gains import Gains
from neurovis_spec.scene.lesions import FAINT
from neurovis_spec.scene.model import Group, Ramp, Shape, Spline, Text, Theme, shifted
from neurovis_spec.scene.teachers import dash
from neurovis_spec.scene.themes import colours

_HEADING, _SMALL = 11.5, 11.0
_ENTRY_HEIGHT, _ROW_GAP, _ENTRY_GAP = 58.0, 10.0, 24.0
_SAMPLE_Y, _FIRST_Y, _SECOND_Y = 20.0, 41.0, 55.0
_RAMP, _STRIPES = 150.0, 75
_STROKE, _STROKE_GAP, _WIDEST = 36.0, 10.0, 8.6


@dataclass(frozen=True, slots=True)
class Entry:
    """Shapes with their corner at the origin, and how wide they are."""

    shapes: tuple[Shape, ...]
    width: float


@dataclass(frozen=True, slots=True)
class Contents:
    """What a picture holds that needs to be explained."""

    lines: bool
    learns: bool
    #: the largest weight of a fixed connection, infinite without any
    heaviest: float
    #: what the dotted lines are, '' without any
    teaches: str
    #: how long delays are, '' without any of several steps
    delays: str = ""
    #: whether something is removed in the course of a run
    lesions: bool = False


def entries(contents: Contents, gains: Gains, theme: Theme) -> list[Entry]:
    """The entries that this picture needs."""
    result = [_colour(contents, gains, theme)]
    if contents.lines and gains.thickness and math.isfinite(_WIDEST / gains.thickness):  # else all are thin
        result.append(_thickness(contents, gains, theme))
    if contents.learns and gains.change:
        result.append(_glow(gains, theme))
    if contents.teaches:
        result.append(_dotted(contents.teaches, theme))
    if contents.delays:
        result.append(_bead(contents.delays, theme))
    if contents.lesions:
        result.append(_faint(theme))
    return result


def row_width(items: Sequence[Entry]) -> float:
    """How wide the entries are side by side."""
    return sum(item.width for item in items) + _ENTRY_GAP * max(len(items) - 1, 0)


def height(items: Sequence[Entry], width: float) -> float:
    """How high the entries are when they flow into rows of this width; 0 without entries."""
    rows = len(_rows(items, width))
    return rows * _ENTRY_HEIGHT + (rows - 1) * _ROW_GAP if rows else 0.0


def flow(items: Sequence[Entry], width: float, left: float, top: float) -> Group:
    """The entries in rows of at most ``width``, from the corner (left, top) on."""
    shapes: list[Shape] = []
    for row, members in enumerate(_rows(items, width)):
        x, y = left, top + row * (_ENTRY_HEIGHT + _ROW_GAP)
        for entry in members:
            shapes += [shifted(shape, (x, y)) for shape in entry.shapes]
            x += entry.width + _ENTRY_GAP
    return Group(tuple(shapes), id="legend")


def _rows(items: Sequence[Entry], width: float) -> list[list[Entry]]:
    rows: list[list[Entry]] = []
    used = 0.0
    for entry in items:
        if rows and used + _ENTRY_GAP + entry.width <= width:
            rows[-1].append(entry)
            used += _ENTRY_GAP + entry.width
        else:
            rows.append([entry])
            used = entry.width
    return rows


def _colour(contents: Contents, gains: Gains, theme: Theme) -> Entry:
    rows = [("neuron: activity", gains.activity, _FIRST_Y)]
    if contents.lines:
        rows.append(("line: signal w·a", gains.signal, _SECOND_Y))
    told = [(words, *_ends(gain), y) for words, gain, y in rows]
    # the words stand in the middle, so the longer end counts twice
    needed = [
        texts.width(words, _SMALL) + 2 * max(texts.width(low, _SMALL), texts.width(high, _SMALL)) + 14
        for words, low, high, _ in told
    ]
    across = max(_RAMP, *needed)
    stripes = colours(theme, np.linspace(-1, 1, _STRIPES))
    shapes: list[Shape] = [_heading("Colour", theme), Ramp((0, _SAMPLE_Y - 5), across, 10, tuple(stripes))]
    for words, low, high, y in told:
        shapes += [
            Text((0, y), low, _SMALL, theme.muted),
            Text((across / 2, y), words, _SMALL, theme.muted, "middle"),
            Text((across, y), high, _SMALL, theme.muted, "end"),
        ]
    return Entry(tuple(shapes), across)


def _ends(gain: float) -> tuple[str, str]:
    """The values at which the colour is full; they change places where the gain is negative."""
    full = texts.number(1 / abs(gain)) if gain else "∞"
    return ("−" + full, "+" + full) if gain >= 0 else ("+" + full, "−" + full)


def _thickness(contents: Contents, gains: Gains, theme: Theme) -> Entry:
    shapes: list[Shape] = [_heading("Thickness", theme)]
    values = nice_weights(gains.thickness, contents.heaviest)
    strokes, words = len(values) * (_STROKE + _STROKE_GAP) - _STROKE_GAP, "line: weight |w|"
    across = max(strokes, texts.width(words, _SMALL))
    for place, value in enumerate(values):
        x = (across - strokes) / 2 + place * (_STROKE + _STROKE_GAP)
        shapes.append(_stroke(x, _STROKE, theme.muted, abs(gains.thickness) * value))
        shapes.append(Text((x + _STROKE / 2, _FIRST_Y), texts.number(value), _SMALL, theme.muted, "middle"))
    shapes.append(Text((across / 2, _SECOND_Y), words, _SMALL, theme.muted, "middle"))
    return Entry(tuple(shapes), across)


def nice_weights(gain: float, heaviest: float = math.inf) -> list[float]:
    """Up to three weights that are 1, 2 or 5 times a power of ten, the largest at most ``heaviest`` and drawn no wider
    than a legend has room for, the smallest no thinner than a line can be.

    >>> nice_weights(4.0), nice_weights(4.0, 1.01), nice_weights(15.0, 0.1)
    ([0.5, 1.0, 2.0], [0.2, 0.5, 1.0], [0.05, 0.1])
    """
    widest = _WIDEST / abs(gain)
    value = _nice_below(min(widest, heaviest) if heaviest * abs(gain) >= THINNEST else widest)
    values = [value]
    while len(values) < 3:
        value = _nice_below(value * 0.6)
        if value * abs(gain) < THINNEST:
            break
        values.append(value)
    return values[::-1]


def _nice_below(value: float) -> float:
    exponent = math.floor(math.log10(value))
    factor = next((factor for factor in (5, 2) if factor * 10.0**exponent <= value * (1 + 1e-9)), 1)
    return float(f"{factor}e{exponent}")


def _glow(gains: Gains, theme: Theme) -> Entry:
    change = 1 / abs(gains.change)
    width = 3.0
    lit = float(glow_width(np.array(width), np.array(1.0)))
    first, second = "weight is changing", f"|Δw| {texts.number(change)} a step"
    across = max(texts.width(first, _SMALL), texts.width(second, _SMALL))
    shapes = (
        _heading("Glow", theme),
        _stroke(0, 64, theme.glow, lit),
        _stroke(0, 64, theme.muted, width),
        Text((0, _FIRST_Y), first, _SMALL, theme.muted),
        Text((0, _SECOND_Y), second, _SMALL, theme.muted),
    )
    return Entry(shapes, across)


def _dotted(words: str, theme: Theme) -> Entry:
    first, second = "guides learning", words
    across = max(texts.width(first, _SMALL), texts.width(second, _SMALL))
    line = Spline(((0, _SAMPLE_Y), (21, _SAMPLE_Y), (43, _SAMPLE_Y), (64, _SAMPLE_Y)), theme.muted, 1.6, dash(1.6))
    shapes = (
        _heading("Dotted", theme),
        line,
        Text((0, _FIRST_Y), first, _SMALL, theme.muted),
        Text((0, _SECOND_Y), second, _SMALL, theme.muted),
    )
    return Entry(shapes, across)


def _bead(words: str, theme: Theme) -> Entry:
    first = "signal is delayed"
    across = max(texts.width(first, _SMALL), texts.width(words, _SMALL))
    shapes = (
        _heading("Bead", theme),
        _stroke(0, 64, theme.muted, 2.0),
        bead((32, _SAMPLE_Y), 3.2, theme),
        Text((0, _FIRST_Y), first, _SMALL, theme.muted),
        Text((0, _SECOND_Y), words, _SMALL, theme.muted),
    )
    return Entry(shapes, across)


def _faint(theme: Theme) -> Entry:
    first, second = "removed", "by a lesion"
    across = max(64.0, texts.width(first, _SMALL), texts.width(second, _SMALL))
    shapes = (
        _heading("Faint", theme),
        replace(_stroke(0, 64, theme.muted, 4.0), opacity=FAINT),
        Text((0, _FIRST_Y), first, _SMALL, theme.muted),
        Text((0, _SECOND_Y), second, _SMALL, theme.muted),
    )
    return Entry(shapes, across)


def _heading(words: str, theme: Theme) -> Text:
    return Text((0, 9), words, _HEADING, theme.ink, weight=600)


def _stroke(x: float, length: float, colour: str, width: float) -> Spline:
    y = _SAMPLE_Y
    return Spline(((x, y), (x + length / 3, y), (x + length * 2 / 3, y), (x + length, y)), colour, width)
