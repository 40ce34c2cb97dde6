"""Pictures of measures: pairs as cells, a ranking as bars, curves over time, a gait diagram; in the project's themes.

In: tables, a Theme. Out: Scenes, which every renderer draws.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import StepLength
from neurovis_spec.runtime.named_array import NamedArray
from neurovis_spec.scene import strips, texts
from neurovis_spec.scene.caption import HEADER, caption_text, title_text
from neurovis_spec.scene.frame import MARGIN
from neurovis_spec.scene.heat import Band, bands_of
from neurovis_spec.scene.model import Group, Image, Polyline, Ramp, Rectangle, Scene, Shape, Text, Theme, shifted
from neurovis_spec.scene.strips import SMALL, Span
from neurovis_spec.scene.themes import blend, colours, distinct, readable
from neurovis_spec.scene.traces import Trace, Traces

#: How wide a picture over time is, and the cells of a table of pairs.
WIDTH, _SIDE, _CELL = 900.0, 620.0, 44.0
#: Cells of this side have a number in them, and rows this high a name; above so many neurons the cells are an image.
_NUMBERED, _NAMED, _MOST_SHAPES = 27.0, 9.0, 60
_LABEL = 150.0
_ROW, _BAR, _PLOT = 19.0, 13.0, 120.0


def cells(table: NamedArray, title: str, caption: str, theme: Theme) -> Scene:
    """A table of pairs: a row and a column for each neuron, coloured by the number."""
    names, values = table.rows.labels, table.values
    count = max(len(names), 1)
    cell = min(_CELL, _SIDE / count)
    size = min(SMALL, 0.9 * cell)
    named = cell >= _NAMED
    bands = () if named else bands_of([_kin(name) for name in names])
    size = size if named else SMALL
    words = names if named else tuple(band.name for band in bands)
    room = min(_LABEL, max((texts.width(word, size) for word in words), default=0.0)) + 10
    left, top, side = MARGIN + room, HEADER + 14 + room, cell * count
    width = max(left + side + MARGIN, 420.0)
    finite = values[np.isfinite(values)]
    full = float(np.abs(finite).max()) if len(finite) else 0.0
    negative = bool((finite < 0).any())
    ground = theme if negative else replace(theme, zero=theme.box_fill)
    shown = np.divide(values, full, out=np.zeros_like(values), where=np.isfinite(values) & (full > 0))
    shapes: list[Shape] = [title_text(title, width, theme), caption_text(caption, width, theme)]
    if named:
        for place, name in enumerate(names):
            middle = (place + 0.5) * cell + 0.36 * size
            short = texts.shorten(name, size, _LABEL)
            shapes.append(Text((left - 6, top + middle), short, size, theme.ink, "end"))
            shapes.append(Text((left + middle, top - 6), short, size, theme.ink, "start", upward=True))
    marks = _marks(bands, (left, top), cell, side, theme)
    groups = [Group(tuple(shapes), "head")]
    if count > _MOST_SHAPES:
        pixels = np.ascontiguousarray(blend(ground, shown)).tobytes()
        image = Image((left, top), side, side, len(names), len(names), pixels)
        groups.append(Group((image,), "cells", {}, f"{len(names)} × {len(names)} pairs"))
    else:
        for i, row in enumerate(names):
            fills = colours(ground, shown[i])
            for j, column in enumerate(names):
                groups.append(_cell(table, (i, j), (row, column), (left, top), cell, fills[j], theme))
    bottom = top + side
    unit = f" {table.unit}" if table.unit else ""
    scale = _scale((left, bottom + 16), -full if negative else 0.0, full, unit, ground)
    groups.append(Group((*marks, *scale), "marks"))
    return Scene(width, bottom + 46, theme, title, tuple(groups))


def _kin(name: str) -> str:
    """What a neuron belongs to, by its name: its instance, else its group.

    >>> _kin("left1.K"), _kin("K12"), _kin("swing")
    ('left1', 'K', 'swing')
    """
    return name.rpartition(".")[0] or texts.with_subscript(name)[0]


def _marks(
    bands: Sequence[Band], corner: tuple[float, float], cell: float, side: float, theme: Theme
) -> tuple[Shape, ...]:
    """The names of neighbours that belong together, where there is no room for each, and lines between them."""
    (left, top), shapes, free = corner, list[Shape](), 0.0
    for band in bands:
        begin, middle = band.start * cell, (band.start + band.count / 2) * cell
        if middle - SMALL / 2 < free or band.count * cell < SMALL:
            continue
        free = middle + SMALL / 2
        name = texts.shorten(band.name, SMALL, _LABEL)
        shapes.append(Text((left - 6, top + middle + 4), name, SMALL, theme.ink, "end"))
        shapes.append(Text((left + middle + 4, top - 6), name, SMALL, theme.ink, "start", upward=True))
        for along in (begin, begin + band.count * cell):
            shapes.append(Polyline(((left, top + along), (left + side, top + along)), theme.muted, 0.6))
            shapes.append(Polyline(((left + along, top), (left + along, top + side)), theme.muted, 0.6))
    return tuple(shapes)


def _cell(
    table: NamedArray,
    place: tuple[int, int],
    names: tuple[str, str],
    corner: tuple[float, float],
    cell: float,
    fill: str,
    theme: Theme,
) -> Group:
    value = float(table.values[place])
    x, y = corner[0] + place[1] * cell, corner[1] + place[0] * cell
    shapes: list[Shape] = [Rectangle((x + 0.5, y + 0.5), cell - 1, cell - 1, 0.0, fill, theme.box_line, 0.0)]
    if cell >= _NUMBERED:
        said = texts.number(round(value, 2)) if np.isfinite(value) else "–"
        shapes.append(Text((x + cell / 2, y + cell / 2 + 4), said, 10.5, readable(theme, fill), "middle"))
    data = {"row": names[0], "column": names[1]}
    return Group(tuple(shapes), f"c{place[0]}-{place[1]}", data, f"{names[0]}, {names[1]}: {texts.number(value, 4)}")


def _scale(corner: tuple[float, float], low: float, high: float, unit: str, theme: Theme) -> list[Shape]:
    """What the colours mean."""
    first, last = (f"{texts.number(value)}{unit}" for value in (low, high))
    start = corner[0] + texts.width(first, SMALL) + 6
    ramp = tuple(colours(theme, np.linspace(-1.0 if low < 0 else 0.0, 1.0, 42)))
    return [
        Text((corner[0], corner[1] + 9), first, SMALL, theme.muted),
        Ramp((start, corner[1]), 120.0, 10.0, ramp),
        Text((start + 126, corner[1] + 9), last, SMALL, theme.muted),
    ]


def bars(names: Sequence[str], values: FloatArray, title: str, caption: str, theme: Theme) -> Scene:
    """A bar for each name, the longest on top; what is no number has none."""
    order = sorted(range(len(names)), key=lambda place: -_height(float(values[place])))
    room = min(_LABEL + 60, max((texts.width(name, SMALL) for name in names), default=0.0)) + 10
    width, left = 640.0, MARGIN + room
    longest = max((_height(value) for value in values.tolist()), default=0.0)
    span = width - left - MARGIN - 60
    head = (title_text(title, width, theme), caption_text(caption, width, theme))
    groups = [Group(head, "head")]
    top = HEADER + 14
    for row, place in enumerate(order):
        y, value = top + row * _ROW, float(values[place])
        length = span * max(_height(value), 0.0) / longest if longest > 0 else 0.0
        said = texts.number(value) if np.isfinite(value) else "–"
        label = texts.shorten(names[place].replace("->", "→"), SMALL, room - 6)
        shapes: list[Shape] = [Text((left - 6, y + 11), label, SMALL, theme.ink, "end")]
        if length > 0:
            shapes.append(Rectangle((left, y + 1), length, _BAR, 0.0, theme.positive, theme.positive, 0.0))
        shapes.append(Text((left + length + 6, y + 11), said, SMALL, theme.muted))
        groups.append(Group(tuple(shapes), f"b{row}", {"bar": names[place]}, f"{names[place]}: {said}"))
    return Scene(width, top + len(order) * _ROW + MARGIN, theme, title, tuple(groups))


def _height(value: float) -> float:
    return value if np.isfinite(value) else -1.0


@dataclass(frozen=True, eq=False)
class Along:
    """What curves run along: steps (rows,) and how long one is shown to be; ``what`` these are, and the ``caption``."""

    steps: IntArray
    dt: StepLength | None
    what: str = "time"
    caption: str = ""

    @property
    def said(self) -> str:
        """The caption; without one of its own which steps there are."""
        return self.caption or _span_said(self.steps)


def curves(names: Sequence[str], values: FloatArray, along: Along, title: str, what: str, theme: Theme) -> Scene:
    """Curves over time, (steps, names), a few to a strip."""
    parts = [(name.replace("->", "→"), "") if "->" in name else texts.with_subscript(name) for name in names]
    lines = tuple(Trace(*parts[place], values[:, place], values[-1:, place], name) for place, name in enumerate(names))
    plots = Traces("traces", what, lines)
    steps = along.steps
    span = Span(steps, steps[-1:], MARGIN + plots.left, WIDTH - MARGIN - plots.right, along.dt, along.what)
    part = plots.part(span, _PLOT, True, theme, "p")
    drawn = [group for group in part.groups if "cursor" not in group.data and "moment" not in group.data]
    head = Group((title_text(title, WIDTH, theme), caption_text(along.said, WIDTH, theme)), "head")
    groups = [head, *(_lowered(group, HEADER) for group in drawn)]
    return Scene(WIDTH, HEADER + part.height + 8, theme, title, tuple(groups))


def _span_said(steps: IntArray) -> str:
    return f"steps {steps[0]} to {steps[-1]}"


def _lowered(group: Group, by: float) -> Group:
    return replace(group, shapes=tuple(shifted(shape, (0.0, by)) for shape in group.shapes))


def diagram(
    stretches: Mapping[str, Sequence[tuple[int, int]]],
    gait: NamedArray,
    steps: IntArray,
    dt: StepLength | None,
    title: str,
    theme: Theme,
) -> Scene:
    """A gait diagram: a row for each neuron, filled while it is active; beside it its phase and duty factor."""
    names = gait.rows.labels
    room = min(_LABEL, max((texts.width(name, SMALL) for name in names), default=0.0)) + 10
    span = Span(steps, steps[-1:], MARGIN + room, WIDTH - MARGIN - 120, dt)
    top = HEADER + 24
    bottom = top + _ROW * len(names)
    colour = distinct(theme)[0]
    shapes: list[Shape] = [
        title_text(title, WIDTH, theme),
        caption_text(_span_said(steps), WIDTH, theme),
        strips.frame(span, top, bottom, theme),
        Text((span.right + 10, top - 7), "phase", SMALL, theme.muted),
        Text((span.right + 68, top - 7), "duty", SMALL, theme.muted),
        *strips.time_axis(span, bottom, theme),
    ]
    groups = [Group(tuple(shapes), "head")]
    for row, name in enumerate(names):
        y = top + row * _ROW
        own: list[Shape] = [Text((span.left - 6, y + 13), texts.shorten(name, SMALL, _LABEL), SMALL, theme.ink, "end")]
        if row:
            own.append(Polyline(((span.left, y), (span.right, y)), theme.box_line, 0.7))
        for first, last in stretches[name]:
            left, right = np.clip(span.at(np.array([first, last]) - span.stride / 2), span.left, span.right).tolist()
            own.append(Rectangle((left, y + 3), max(right - left, 0.5), _ROW - 6, 0.0, colour, colour, 0.0))
        phase, duty = gait[name, "phase"], gait[name, "duty"]
        said = [texts.number(round(value, 2)) if np.isfinite(value) else "–" for value in (phase, duty)]
        own.append(Text((span.right + 10, y + 13), said[0], SMALL, theme.ink))
        own.append(Text((span.right + 68, y + 13), said[1], SMALL, theme.ink))
        groups.append(Group(tuple(own), f"g{row}", {"gait": name}, f"{name}: phase {said[0]}, duty {said[1]}"))
    return Scene(WIDTH, bottom + strips.AXIS + 8, theme, title, tuple(groups))
