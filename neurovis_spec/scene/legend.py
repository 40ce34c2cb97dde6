"""The legend: what colour, thickness, ends, glow, dotted and faint lines and beads mean, with their scales.

In: gains, a theme and what the picture holds. Out: entries, which flow into rows at the foot of a picture. An entry is
a heading, a sample and lines of text; those of scales are in ``legend_scales``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from neurovis_spec.scene import bundles, legend_scales, texts
from neurovis_spec.scene.bundles import Told
from neurovis_spec.scene.delays import bead
from neurovis_spec.scene.gains import Gains
from neurovis_spec.scene.legend_scales import FIRST_Y, SAMPLE_Y, SECOND_Y, SMALL, LegendEntry, heading, stroke
from neurovis_spec.scene.lesions import FAINT
from neurovis_spec.scene.line_styles import DASHES, Styles
from neurovis_spec.scene.model import Arrowhead, Disc, FlatSpline, Group, Shape, Spline, Text, Theme, ended, shifted
from neurovis_spec.scene.teachers import dash
from neurovis_spec.scene.themes import colours

_ROW_GAP, _ENTRY_GAP = 10.0, 24.0
_HEAD, _STROKE, _STROKE_GAP = 9.0, 36.0, 10.0
#: how wide the word of a sample is at most
_WIDEST_WORD = 90.0


class Ends(NamedTuple):
    """How lines end (``scene/ends.py``): the ``kinds`` that there are, in the order of a legend; whether synapses say
    so, by their ``sign``."""

    kinds: tuple[int, ...] = (1,)
    said: bool = False


@dataclass(frozen=True, slots=True)
class Contents:
    """What a picture holds that needs to be explained."""

    #: what is said of signals (``Signals.called``); None without lines
    signals: str | None
    learns: bool
    #: what the dotted lines are, '' without any
    teaches: str
    #: how long delays are, '' without any of several steps
    delays: str = ""
    #: whether something is removed in the course of a run
    lesions: bool = False
    #: None without lines
    ends: Ends | None = None
    #: None where all lines are solid
    styles: Styles | None = None
    #: in which time activity fades, the shortest and the longest, of those that have a trace
    traces: tuple[float, ...] = ()
    #: the same of signals that are spikes, where activities are none
    sent_traces: tuple[float, ...] = ()
    #: the unit of these times
    unit: str = "s"
    #: from where neurons in space are seen, '' where all are in a plane
    seen: str = ""
    #: whether texts beside lines say what pathways hold
    pathways: bool = False
    #: what is said of the bundles of what is left out, None without any
    bundles: Told | None = None


def entries(contents: Contents, gains: Gains, theme: Theme, *, brief: bool = False) -> list[LegendEntry]:
    """The entries that this picture needs; a ``brief`` legend has the first scale of each sort alone."""
    if brief:
        gains = gains.brief
    result = legend_scales.colour(gains, contents.signals, theme)
    if contents.signals is not None:
        result += legend_scales.thickness(gains, theme)
    if contents.ends is not None and contents.ends.kinds not in ((), (1,)) and theme.ends == "signs":
        result.append(_ends_in(contents.ends, theme))
    if contents.bundles is not None:
        result.append(_bundle(contents.bundles, theme))
    if contents.styles is not None:
        result.append(_styles(contents.styles, theme))
    if contents.learns:
        result += legend_scales.glow(gains, theme)
    if contents.teaches:
        result.append(_dotted(contents.teaches, theme))
    if contents.delays:
        result.append(_bead(contents.delays, theme))
    if contents.traces:
        result.append(_trace("activity fades", contents.traces, contents.unit, theme))
    elif contents.sent_traces:
        result.append(_trace("spikes fade", contents.sent_traces, contents.unit, theme))
    if contents.seen:
        result.append(_size(contents.seen, theme))
    if contents.lesions:
        result.append(_faint(theme))
    if contents.pathways:
        result.append(_beside(theme))
    return result


def row_width(items: Sequence[LegendEntry]) -> float:
    """How wide the entries are side by side."""
    return sum(item.width for item in items) + _ENTRY_GAP * max(len(items) - 1, 0)


def widest_row(items: Sequence[LegendEntry], width: float) -> float:
    """How wide the longest row is when they flow into rows of this width."""
    return max((row_width(row) for row in _rows(items, width)), default=0.0)


def height(items: Sequence[LegendEntry], width: float) -> float:
    """How high the entries are when they flow into rows of this width; 0 without entries."""
    rows = _rows(items, width)
    return _in_all(rows) + (len(rows) - 1) * _ROW_GAP if rows else 0.0


def _in_all(rows: Sequence[Sequence[LegendEntry]]) -> float:
    return sum(map(_high, rows))


def _high(row: Sequence[LegendEntry]) -> float:
    return max(item.height for item in row)


def flow(items: Sequence[LegendEntry], width: float, left: float, top: float) -> Group:
    """The entries in rows of at most ``width``, from the corner (left, top) on."""
    shapes: list[Shape] = []
    y = top
    for members in _rows(items, width):
        x = left
        for entry in members:
            shapes += [shifted(shape, (x, y)) for shape in entry.shapes]
            x += entry.width + _ENTRY_GAP
        y += _high(members) + _ROW_GAP
    return Group(tuple(shapes), id="legend")


def _rows(items: Sequence[LegendEntry], width: float) -> list[list[LegendEntry]]:
    """As few rows as fit into a width, and as even as they can be without getting higher: none has a lone entry at the
    end while the others are full."""
    full = _filled(items, width)
    if len(full) < 2:
        return full
    spans = (row_width(items[first:end]) for first in range(len(items)) for end in range(first + 1, len(items) + 1))
    for narrower in sorted({span for span in spans if span < width}):
        rows = _filled(items, narrower)
        if len(rows) == len(full) and _in_all(rows) <= _in_all(full):
            return rows
    return full


def _filled(items: Sequence[LegendEntry], width: float) -> list[list[LegendEntry]]:
    """Rows of which each has as many entries as fit into it."""
    rows: list[list[LegendEntry]] = []
    used = 0.0
    for entry in items:
        if rows and used + _ENTRY_GAP + entry.width <= width:
            rows[-1].append(entry)
            used += _ENTRY_GAP + entry.width
        else:
            rows.append([entry])
            used = entry.width
    return rows


def _ends_in(ends: Ends, theme: Theme) -> LegendEntry:
    """Lines that end in an arrowhead, in a bar, and in neither."""
    words, samples = "line: sign of w", [("w ≥ 0", 1), ("w < 0", -1)]
    if ends.said:
        called = {1: "excites", 0: "neither excites nor inhibits", -1: "inhibits"}
        words, samples = "line: what it does", [(called[kind], kind) for kind in ends.kinds]

    def sample(place: int, x: float) -> Iterator[Shape]:
        end = Arrowhead((x + _STROKE, SAMPLE_Y), (1.0, 0.0), _HEAD, 0.0, "")
        end = ended(end, 2.0, theme.muted, samples[place][1])
        yield stroke(x, end.notch[0] - x, theme.muted, 2.0)
        yield end

    return _side_by_side("End", [sign for sign, _ in samples], words, sample, theme)


def _styles(styles: Styles, theme: Theme) -> LegendEntry:
    """Lines that are solid, dashed, …, with the values that they stand for and the column of these."""

    def sample(place: int, x: float) -> Iterator[Shape]:
        dash = DASHES[styles.called[place][1]]
        line = stroke(x, _STROKE, theme.muted, 2.0)
        yield FlatSpline(line.points, line.stroke, line.width, dash) if dash else line

    called = [texts.shorten(value, SMALL, _WIDEST_WORD) for value, _ in styles.called]
    words = f"line: {texts.shorten(styles.column, SMALL, 2 * _WIDEST_WORD)}"
    return _side_by_side("Style", called, words, sample, theme)


def _side_by_side(
    title: str, called: Sequence[str], words: str, sample: Callable[[int, float], Iterator[Shape]], theme: Theme
) -> LegendEntry:
    """Samples of lines, each with what it is called beneath, and what they are of; ``sample`` draws the one at a place
    from an x on."""
    wide = [_room(texts.width(one, SMALL)) for one in called]
    every = sum(wide) + (len(wide) - 1) * _STROKE_GAP
    across = max(every, texts.width(words, SMALL))
    shapes: list[Shape] = [heading(title, theme)]
    for place, one in enumerate(called):
        x = (across - every + wide[place] - _STROKE) / 2 + sum(wide[:place]) + place * _STROKE_GAP
        shapes += sample(place, x)
        shapes.append(Text((x + _STROKE / 2, FIRST_Y), one, SMALL, theme.muted, "middle"))
    shapes.append(Text((across / 2, SECOND_Y), words, SMALL, theme.muted, "middle"))
    return LegendEntry(tuple(shapes), across)


def _room(word: float) -> float:
    """How much room there is across for a sample with a word beneath it: words of about its width stand in the gaps."""
    return _STROKE if word <= _STROKE + _STROKE_GAP else word + _STROKE_GAP


def _bundle(told: Told, theme: Theme) -> LegendEntry:
    """Bands as they excite and inhibit, and what the widest stands for."""
    lone, width = told.largest is None, 1.0 if told.largest is None else 5.0
    words = "left out" if told.largest is None else f"left out, added up: |Σ w| up to {texts.number(told.largest)}"
    wide = [_room(texts.width(bundles.SAID[end], SMALL)) for end in told.ends]
    across = max(sum(wide) + (len(wide) - 1) * _STROKE_GAP, texts.width(words, SMALL))
    shapes: list[Shape] = [heading("Bundle", theme)]
    x = 0.0
    for end, room in zip(told.ends, wide, strict=True):
        colour = bundles.ink(theme, end, lone)
        tip = Arrowhead((x + _STROKE, SAMPLE_Y), (1.0, 0.0), _HEAD, 0.0, "")
        tip = ended(tip, width, colour, end if theme.ends == "signs" else 1)
        shapes += [stroke(x, tip.notch[0] - x, colour, width), tip]
        shapes.append(Text((x, FIRST_Y), bundles.SAID[end], SMALL, theme.muted))
        x += room + _STROKE_GAP
    shapes.append(Text((0, SECOND_Y), words, SMALL, theme.muted))
    return LegendEntry(tuple(shapes), across)


def _dotted(words: str, theme: Theme) -> LegendEntry:
    first, second = "guides learning", words
    across = max(texts.width(first, SMALL), texts.width(second, SMALL))
    line = Spline(((0, SAMPLE_Y), (21, SAMPLE_Y), (43, SAMPLE_Y), (64, SAMPLE_Y)), theme.muted, 1.6, dash(1.6))
    shapes = (
        heading("Dotted", theme),
        line,
        Text((0, FIRST_Y), first, SMALL, theme.muted),
        Text((0, SECOND_Y), second, SMALL, theme.muted),
    )
    return LegendEntry(shapes, across)


def _bead(words: str, theme: Theme) -> LegendEntry:
    first = "signal is delayed"
    across = max(texts.width(first, SMALL), texts.width(words, SMALL))
    shapes = (
        heading("Bead", theme),
        stroke(0, 64, theme.muted, 2.0),
        bead((32, SAMPLE_Y), 3.2, theme),
        Text((0, FIRST_Y), first, SMALL, theme.muted),
        Text((0, SECOND_Y), words, SMALL, theme.muted),
    )
    return LegendEntry(shapes, across)


def _trace(first: str, times: tuple[float, ...], unit: str, theme: Theme) -> LegendEntry:
    """A disc, and how it fades."""
    second = f"to 1/e in {' … '.join(texts.number(one) for one in times)} {unit}"
    across = max(64.0, texts.width(first, SMALL), texts.width(second, SMALL))
    fills = colours(theme, [1.0, 0.6, 0.3, 0.1])
    discs = [Disc((6 + 17.0 * place, SAMPLE_Y), 6, fill, theme.ring, 0.8) for place, fill in enumerate(fills)]
    words = [Text((0, FIRST_Y), first, SMALL, theme.muted), Text((0, SECOND_Y), second, SMALL, theme.muted)]
    return LegendEntry((heading("Trace", theme), *discs, *words), across)


def _size(seen: str, theme: Theme) -> LegendEntry:
    """Discs that grow, as those of neurons do that are nearer."""
    first, second = "nearer is larger", f"seen {seen}"
    across = max(64.0, texts.width(first, SMALL), texts.width(second, SMALL))
    sizes = (3.5, 4.5, 5.5, 6.5)
    fill = colours(theme, [0.0])[0]
    discs = [Disc((7 + 17.0 * place, SAMPLE_Y), size, fill, theme.ring, 0.8) for place, size in enumerate(sizes)]
    words = [Text((0, FIRST_Y), first, SMALL, theme.muted), Text((0, SECOND_Y), second, SMALL, theme.muted)]
    return LegendEntry((heading("Size", theme), *discs, *words), across)


def _beside(theme: Theme) -> LegendEntry:
    """What stands beside the lines of pathways."""
    sample, first, second = "8 · Σ 2.5", "connections · sum of", "weights (· delay · rule)"
    across = max(texts.width(each, SMALL) for each in (sample, first, second))
    words = (
        (SAMPLE_Y + 0.35 * SMALL, sample, theme.ink),
        (FIRST_Y, first, theme.muted),
        (SECOND_Y, second, theme.muted),
    )
    return LegendEntry((heading("Pathway", theme), *(Text((0, y), said, SMALL, ink) for y, said, ink in words)), across)


def _faint(theme: Theme) -> LegendEntry:
    first, second = "removed", "by a lesion"
    across = max(64.0, texts.width(first, SMALL), texts.width(second, SMALL))
    shapes = (
        heading("Faint", theme),
        replace(stroke(0, 64, theme.muted, 4.0), opacity=FAINT),
        Text((0, FIRST_Y), first, SMALL, theme.muted),
        Text((0, SECOND_Y), second, SMALL, theme.muted),
    )
    return LegendEntry(shapes, across)
