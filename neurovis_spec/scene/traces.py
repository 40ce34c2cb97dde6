"""Traces: curves over the steps, with an axis of values, each named at its end in its own colour.

In: curves and their values, a Span. Out: a Part. More curves than there are colours that can be told apart stand in
several strips with the same scale. Long runs are drawn by the lowest and the highest value of each column of the
picture, so that nothing of them is lost; a gap is where there is no number. Above the curves of neurons that spike are
marks where they do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.limits import plural
from neurovis_spec.scene import strips, texts
from neurovis_spec.scene.model import Disc, Group, Point, Polyline, Shape, Text, Theme
from neurovis_spec.scene.parts import Changes, Part
from neurovis_spec.scene.strips import SMALL, TITLE, Span, ticks, words
from neurovis_spec.scene.texts import Cut
from neurovis_spec.scene.themes import MOST_DISTINCT, distinct

#: How high a plot is where nothing else is asked for.
PLOT = 96.0
#: The widest text at the end of a line, and how far it stands off.
_LABEL, _OFF = 120.0, 14.0
#: User units between ticks of the values, at least; texts at the ends of lines stand so far apart, if they can.
_APART, _LINE = 19.0, 13.0
_WIDTH = 1.6
_MOST_TICKS = 7
#: How high a row of marks for spikes is, with what stands off it, and the share of a plot that all take at most.
_MARK, _MARKED = 6.0, 0.35
_BOLD = 600


@dataclass(frozen=True)
class Trace:
    """A curve: its name and a subscript, its values (rows,) and (frames,), and what a pointer shows; the steps
    (spikes,) at which its neuron fires, None where that is not marked."""

    name: str
    subscript: str
    values: FloatArray
    moments: FloatArray
    full: str
    spikes: IntArray | None = None


@dataclass(frozen=True)
class Traces:
    """Curves that share a scale; ``view`` is what the picture calls them."""

    view: str
    title: str
    traces: tuple[Trace, ...]

    @property
    def strips(self) -> list[tuple[Trace, ...]]:
        """The curves of each strip."""
        count = max(1, math.ceil(len(self.traces) / MOST_DISTINCT))
        cuts = np.linspace(0, len(self.traces), count + 1).round().astype(int).tolist()
        return [self.traces[low:high] for low, high in pairwise(cuts)]

    @property
    def left(self) -> float:
        """How wide the texts of the ticks are."""
        return max((texts.width(word, SMALL) for word in words(self._ticks(PLOT))), default=0.0) + 8

    @property
    def right(self) -> float:
        """How wide the names at the ends of the lines are."""
        cut = self._cut
        parts = [_words(trace, cut) for trace in self.traces]
        return max((texts.width(text, SMALL, _BOLD, sub) for text, sub in parts), default=0.0) + _OFF + 2

    @property
    def _cut(self) -> Cut:
        return Cut(trace.name for trace in self.traces)

    @property
    def range(self) -> tuple[float, float]:
        """The lowest and the highest value of the axis, apart."""
        finite = [trace.values[np.isfinite(trace.values)] for trace in self.traces]
        lows = [float(part.min()) for part in finite if len(part)]
        highs = [float(part.max()) for part in finite if len(part)]
        low, high = (min(lows), max(highs)) if lows else (-1.0, 1.0)
        if 0 < low < high / 2:
            low = 0.0
        if low / 2 < high < 0:
            high = 0.0
        if high - low <= 1e-9 * max(abs(low), abs(high)) or high == low:
            room = 0.1 * abs(low) or 1.0
            return max(low - room, -_HUGE), min(high + room, _HUGE)
        room = 0.05 * high - 0.05 * low
        return max(low - room, -_HUGE), min(high + room, _HUGE)

    def _ticks(self, plot: float) -> list[float]:
        return ticks(*self.range, min(_MOST_TICKS, max(2, int(plot / _APART) + 1)))

    def height(self, plot: float) -> float:
        """How high all strips are with plots of this height, without the axis of the time."""
        return len(self.strips) * (TITLE + plot)

    def part(self, span: Span, plot: float, axis: bool, theme: Theme, prefix: str) -> Part:
        """All strips; with ``axis`` the time stands beneath the last."""
        groups: list[Group] = []
        shifts: list[str] = []
        values: list[FloatArray] = []
        top = 0.0
        for number, members in enumerate(self.strips):
            name = f"{prefix}s{number}:"
            last = axis and number == len(self.strips) - 1
            marks = sum(trace.spikes is not None for trace in members)
            frame = _Frame(span, top + TITLE, top + TITLE + plot, *self.range, min(marks * _MARK, _MARKED * plot))
            data = {"view": self.view} if number == 0 else {}
            groups.append(Group(tuple(self._ground(frame, number, last, theme)), f"{name}ground", data))
            groups += _curves(frame, members, self._cut, theme, name)
            line, moved = strips.cursor(span, frame.top, frame.bottom, theme, f"{name}cursor")
            groups.append(line)
            shifts.append(line.id)
            values.append(moved)
            for dot, moved in _dots(frame, members, theme, name):
                groups.append(dot)
                shifts.append(dot.id)
                values.append(moved)
            top = frame.bottom
        height = top + (strips.AXIS if axis else 0.0)
        return Part(tuple(groups), height, Changes(shifts=tuple(shifts), shift_values=np.concatenate(values, axis=1)))

    def _ground(self, frame: _Frame, number: int, last: bool, theme: Theme) -> list[Shape]:
        span = frame.span
        shapes: list[Shape] = [strips.frame(span, frame.top, frame.bottom, theme)]
        if number == 0:
            shapes.append(strips.title(self.title, span, theme))
        found = self._ticks(frame.bottom - frame.top)
        for value, said in zip(found, words(found), strict=True):
            y = frame.y(np.array(value)).item()
            shapes.append(Polyline(((span.left, y), (span.right, y)), theme.box_line, 1.4 if value == 0 else 0.7))
            shapes.append(Text((span.left - 6, y + 4), said, SMALL, theme.muted, "end"))
        if last:
            shapes += strips.time_axis(span, frame.bottom, theme)
        return shapes


_HUGE = 1.7e308


@dataclass(frozen=True)
class _Frame:
    """A plot: its top and bottom, and the values there, below the room for marks at its top."""

    span: Span
    top: float
    bottom: float
    low: float
    high: float
    marked: float = 0.0

    def y(self, values: FloatArray) -> FloatArray:
        """How far down values lie; of huge ones no difference overflows."""
        exponent = int(np.frexp(max(abs(self.low), abs(self.high)))[1])
        low, high = math.ldexp(self.low, -exponent), math.ldexp(self.high, -exponent)
        with np.errstate(invalid="ignore", over="ignore", under="ignore"):
            share = (np.ldexp(values, -exponent) - low) / (high - low)
            result: FloatArray = self.bottom - share * (self.bottom - self.top - self.marked)
        return result


def _curves(frame: _Frame, members: Sequence[Trace], cut: Cut, theme: Theme, name: str) -> list[Group]:
    places = _ends(frame, members)
    groups, row, rows = list[Group](), 0, sum(trace.spikes is not None for trace in members)
    for number, (trace, colour) in enumerate(zip(members, distinct(theme), strict=False)):
        shapes: list[Shape] = [Polyline(points, colour, _WIDTH) for points in _lines(frame, trace.values)]
        if places is not None:
            text, subscript = _words(trace, cut)
            x, end = frame.span.right, _last(frame, trace.values)
            lead = ((x + 1, end), (x + 5, end), (x + _OFF - 5, places[number]), (x + _OFF - 2, places[number]))
            shapes.append(Polyline(lead, colour, 0.8))
            at = (x + _OFF, places[number] + 0.36 * SMALL)
            shapes.append(Text(at, text, SMALL, colour, weight=_BOLD, subscript=subscript))
        finite = trace.values[np.isfinite(trace.values)]
        range_ = (
            f"{texts.number(float(finite.min()), 4)} … {texts.number(float(finite.max()), 4)}" if len(finite) else "—"
        )
        said = f"{trace.full}\n{range_}"
        if trace.spikes is not None:
            first, last = frame.span.ends
            shown = trace.spikes[(trace.spikes >= first) & (trace.spikes < last)]
            shapes += _marks(frame, shown, row, rows, colour)
            said, row = f"{said}\n{plural(len(shown), 'spike')}", row + 1
        groups.append(Group(tuple(shapes), f"{name}t{number}", {"trace": trace.full}, said))
    return groups


def _marks(frame: _Frame, spikes: IntArray, row: int, rows: int, colour: str) -> list[Shape]:
    """A mark for each spike, in one of some rows above the curves; those that cannot be told apart are one."""
    height = frame.marked / rows
    top = frame.top + (row + 0.25) * height
    xs = np.unique(np.round(2 * frame.span.at(spikes)) / 2).tolist()
    return [Polyline(((x, top), (x, top + 0.75 * height)), colour, 1.4) for x in xs]


def _words(trace: Trace, cut: Cut) -> tuple[str, str]:
    return cut.parts(trace.name, trace.subscript, SMALL, _LABEL, _BOLD)


def _last(frame: _Frame, values: FloatArray) -> float:
    """Where a curve ends, its last number."""
    finite = np.flatnonzero(np.isfinite(values))
    return float(frame.y(values[finite[-1:]])[0]) if len(finite) else (frame.top + frame.bottom) / 2


def _ends(frame: _Frame, members: Sequence[Trace]) -> list[float] | None:
    """Where the names of the curves stand; None where there is not the room for all."""
    apart = min(_LINE, (frame.bottom - frame.top + _LINE) / max(len(members), 1))
    if apart < 0.8 * SMALL:
        return None
    return strips.spread([_last(frame, trace.values) for trace in members], apart, frame.top, frame.bottom)


def _lines(frame: _Frame, values: FloatArray) -> list[tuple[Point, ...]]:
    """The curve, in pieces where there are numbers: by the first, the extreme and the last value of each column."""
    span = frame.span
    cuts = strips.columns(span, int(span.right - span.left))
    x, pieces, now = span.at(span.steps), list[tuple[Point, ...]](), list[Point]()
    if len(cuts) - 1 == len(values):
        chosen = np.arange(len(values))
    else:
        picked = [_extremes(values[low:high]) + low for low, high in pairwise(cuts)]
        chosen = np.concatenate(picked)
    ys = frame.y(values[chosen])
    for place, down, finite in zip(x[chosen].tolist(), ys.tolist(), np.isfinite(values[chosen]).tolist(), strict=True):
        if finite:
            now.append((place, down))
        elif now:
            pieces.append(_drawn(now))
            now = []
    return [*pieces, _drawn(now)] if now else pieces


def _extremes(values: FloatArray) -> FloatArray:
    """The numbers of the rows that stand for some: first, lowest, highest, last, and one without a number."""
    finite = np.flatnonzero(np.isfinite(values))
    if not len(finite):
        return np.zeros(1, np.int64)
    own = values[finite]
    found = {0, len(values) - 1, int(finite[own.argmin()]), int(finite[own.argmax()])}
    gaps = np.flatnonzero(~np.isfinite(values))
    return np.array(sorted(found | ({int(gaps[0])} if len(gaps) else set())), np.int64)


def _drawn(points: list[Point]) -> tuple[Point, ...]:
    """A single point is a short line."""
    if len(points) > 1:
        return tuple(points)
    ((x, y),) = points
    return ((x - 1.5, y), (x + 1.5, y))


def _dots(frame: _Frame, members: Sequence[Trace], theme: Theme, name: str) -> list[tuple[Group, FloatArray]]:
    """A dot on each curve at the step of the moment; none where it is no number at some time."""
    x = frame.span.at(frame.span.frames)
    result = []
    for number, (trace, colour) in enumerate(zip(members, distinct(theme), strict=False)):
        if not np.isfinite(trace.moments).all():
            continue
        y = frame.y(trace.moments)
        dot = Disc((float(x[0]), float(y[0])), 3.4, colour, theme.box_fill, 1.2)
        shifts = np.stack([x - x[0], y - y[0]], axis=1)[:, None, :]
        result.append((Group((dot,), f"{name}d{number}", {"moment": trace.full}), shifts))
    return result
