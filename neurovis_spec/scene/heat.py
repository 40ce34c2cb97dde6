"""Raster: neurons × time as coloured cells, in the colours that they have in the picture of the network (Eq. 2).

In: activities, colour values, a Span. Out: a Part. Where there are more steps or neurons than cells can be seen, a cell
has the strongest colour of those it stands for, so that nothing is lost. Of neurons that spike the spikes are marks,
all of them, also those of steps that are not among the rows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.scene import strips, texts
from neurovis_spec.scene.model import Group, Image, Polyline, Shape, Text, Theme
from neurovis_spec.scene.parts import Changes, Part
from neurovis_spec.scene.scales import ScaleLabel
from neurovis_spec.scene.strips import SMALL, TITLE, Span
from neurovis_spec.scene.texts import Cut
from neurovis_spec.scene.themes import blend, channels

#: How high a raster is at most; a group that is as high as this second one has a name.
HIGHEST, _GROUPED = 300.0, 11.0
_LABEL = 120.0
#: Rows whose numbers are held at a time.
_TOGETHER = 256


@dataclass(frozen=True)
class Band:
    """Neighbouring rows that are called the same: ``count`` of them from row ``start`` on."""

    name: str
    start: int
    count: int


def bands_of(names: Sequence[str]) -> tuple[Band, ...]:
    """Neighbours of the same name.

    >>> [(band.name, band.count) for band in bands_of(["C", "C", "K"])]
    [('C', 2), ('K', 1)]
    """
    bands: list[Band] = []
    for place, name in enumerate(names):
        if bands and bands[-1].name == name:
            bands[-1] = Band(name, bands[-1].start, bands[-1].count + 1)
        else:
            bands.append(Band(name, place, 1))
    return tuple(bands)


@dataclass(frozen=True)
class Rows:
    """How high a row is at most (``high``); where it is lower than ``named`` it has no name of its own, which takes at
    most this ``share`` of it."""

    high: float
    named: float
    share: float


#: Rows with plain names, and with names whose subscripts stand lower: these must not touch the row beneath.
PLAIN, SUBSCRIPTED = Rows(13.0, 8.5, 0.9), Rows(15.0, 10.0, 0.75)


@dataclass(frozen=True)
class Heat:
    """``count`` rows: their colour values in −1…1, for any of them by number (steps, rows); which are ``spiking``, and
    the spikes of these, steps and numbers of rows; their names, with subscripts, and their groups."""

    title: str
    colour: Callable[[IntArray], FloatArray]
    spiking: npt.NDArray[np.bool_]
    spikes: tuple[IntArray, IntArray]
    names: tuple[tuple[str, str], ...]
    #: the groups, and what they are in: the instance, if they are in one
    groups: tuple[Band, ...]
    outer: tuple[Band, ...]
    scale: ScaleLabel

    @property
    def natural(self) -> float:
        """How high the cells are where nothing else is asked for."""
        return min(HIGHEST, self._rows.high * max(len(self.names), 2))

    @property
    def _rows(self) -> Rows:
        return SUBSCRIPTED if any(subscript for _, subscript in self.names) else PLAIN

    @property
    def left(self) -> float:
        """How wide the names beside the rows are."""
        named = list(self.names)
        if not self._named(self.natural):
            named = [(band.name, "") for band in self._bands(self.natural)]
        return min(_LABEL, max((texts.width(base, SMALL, 400, sub) for base, sub in named), default=0.0)) + 8

    def _bands(self, plot: float) -> tuple[Band, ...]:
        """The groups where there is room for them, else the instances."""
        return self.groups if plot >= _GROUPED * len(self.groups) else self.outer

    def _named(self, plot: float) -> bool:
        return plot >= self._rows.named * len(self.names)

    def height(self, plot: float) -> float:
        """How high it is with cells of this height, without the axis of the time."""
        return TITLE + plot

    def part(self, span: Span, plot: float, axis: bool, theme: Theme, prefix: str) -> Part:
        """The cells, the names beside them, the cursor; with ``axis`` the time beneath."""
        top, bottom = TITLE, TITLE + plot
        image = Image((span.left, top), span.right - span.left, plot, *self._cells(span, plot, theme))
        around = strips.frame(span, top, bottom, theme)
        shapes: list[Shape] = [strips.title(self.title, span, theme), around, image]
        room = span.right - span.left - texts.width(self.title, SMALL) - 16
        shapes += self.scale.shapes(span.right, TITLE - 6.0, theme, room)
        shapes += self._sides(span, top, plot, theme)
        if axis:
            shapes += strips.time_axis(span, bottom, theme)
        line, moved = strips.cursor(span, top, bottom, theme, f"{prefix}cursor")
        said = f"{len(self.names)} neurons, steps {span.steps[0]} … {span.steps[-1]}"
        if self.spiking.any():
            seen = np.count_nonzero((self.spikes[0] >= span.steps[0]) & (self.spikes[0] < span.ends[1]))
            said += f", {seen:,} spikes"
        ground = Group(tuple(shapes), f"{prefix}ground", {"view": "raster"}, said)
        height = bottom + (strips.AXIS if axis else 0.0)
        return Part((ground, line), height, Changes(shifts=(line.id,), shift_values=moved))

    def _cells(self, span: Span, plot: float, theme: Theme) -> tuple[int, int, bytes]:
        """Columns, rows, and the colours of the cells."""
        steps = strips.columns(span, int(span.right - span.left))
        count = len(self.names)
        rows = np.unique(np.linspace(0, count, min(count, max(1, int(2 * plot))) + 1).astype(np.int64))
        shown = np.zeros((len(steps) - 1, count))
        for first in range(0, count, _TOGETHER):
            some = np.arange(first, min(first + _TOGETHER, count))
            some = some[~self.spiking[some]]
            if len(some):
                shown[:, some] = strongest(self.colour(some), steps, 0)
        edges = self._edges(span, steps)
        if len(edges) != len(steps):
            row_edges = span.steps[steps[:-1]] - span.stride / 2
            shown = shown[np.searchsorted(row_edges, (edges[1:] + edges[:-1]) / 2, "right") - 1]
        colours = blend(theme, strongest(shown, rows, 1))
        own = strongest(self.spiking[None].astype(np.float64), rows, 1)[0] > 0
        colours[:, own] = np.array(channels(theme.box_fill), np.uint8)
        colours[self._marks(edges, rows)] = np.array(channels(theme.ink), np.uint8)
        cells = colours.transpose(1, 0, 2)
        return cells.shape[1], cells.shape[0], np.ascontiguousarray(cells).tobytes()

    def _edges(self, span: Span, columns: IntArray) -> FloatArray:
        """The steps between columns of cells, from the first edge to the last. Where rows are apart there are columns
        between them for spikes."""
        first, last = span.ends
        if span.stride > 1 and self.spiking.any():
            return np.linspace(first, last, max(1, min(int(span.right - span.left), int(last - first))) + 1)
        return np.append(span.steps[columns[:-1]] - span.stride / 2, last)

    def _marks(self, edges: FloatArray, rows: IntArray) -> npt.NDArray[np.bool_]:
        """In which cells there is a spike."""
        marked = np.zeros((len(edges) - 1, len(rows) - 1), np.bool_)
        steps, neurons = self.spikes
        inside = (steps >= edges[0]) & (steps < edges[-1])
        across = np.searchsorted(edges, steps[inside], "right") - 1
        marked[across, np.searchsorted(rows, neurons[inside], "right") - 1] = True
        return marked

    def _sides(self, span: Span, top: float, plot: float, theme: Theme) -> list[Shape]:
        """Names beside the rows, or of the groups; lines between groups."""
        each = plot / max(len(self.names), 1)
        shapes: list[Shape] = []
        bands = self._bands(plot)
        for band in bands[1:] if plot >= _GROUPED * len(bands) else ():
            y = top + band.start * each
            shapes.append(Polyline(((span.left - 4, y), (span.right, y)), theme.background, 1.2))
        if self._named(plot):
            size = min(SMALL, self._rows.share * each)
            cut = Cut(base for base, _ in self.names)
            for row, words in enumerate(self.names):
                parts = cut.parts(*words, size, _LABEL, 400)
                shapes.append(_beside(*parts, span.left - 6, top + (row + 0.5) * each, size, theme))
            return shapes
        free, cut = top, Cut(band.name for band in bands)
        for band in bands:
            middle = top + (band.start + band.count / 2) * each
            if band.count * each >= _GROUPED and middle - SMALL / 2 >= free - 1:
                name = cut.shorten(band.name, SMALL, _LABEL, 400)
                shapes.append(_beside(name, "", span.left - 6, middle, SMALL, theme))
                free = middle + SMALL / 2
        return shapes


def strongest(values: FloatArray, cuts: IntArray, axis: int) -> FloatArray:
    """Of each stretch between cuts along an axis the value of largest magnitude; no number counts as 0.

    >>> strongest(np.array([[0.1, -0.5, 0.2, 0.3]]), np.array([0, 2, 4]), 1)
    array([[-0.5,  0.3]])
    """
    known = np.nan_to_num(values, nan=0.0, posinf=1.0, neginf=-1.0)
    if known.shape[axis] == len(cuts) - 1:
        return known
    high = np.maximum.reduceat(known, cuts[:-1], axis=axis)
    low = np.minimum.reduceat(known, cuts[:-1], axis=axis)
    result: FloatArray = np.where(high >= -low, high, low)
    return result


def _beside(base: str, subscript: str, right: float, middle: float, size: float, theme: Theme) -> Text:
    return Text((right, middle + 0.36 * size), base, size, theme.ink, "end", subscript=subscript)
