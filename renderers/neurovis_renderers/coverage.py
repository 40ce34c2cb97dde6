"""Coverage: which pixels shapes touch, and how much of each they cover, for many shapes at a time.

In: strokes, heads, discs and rectangles in pixels, as arrays. Out: Fragments: a shape, a pixel, and the share of the
pixel that the shape covers. Shares are computed from where edges run, never by supersampling. NumPy alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import count
from typing import Self, TypeVar

import numpy as np
import numpy.typing as npt

from neurovis_spec.scene import Arrowhead, FloatArray, IntArray

Numbers = npt.NDArray[np.float32]
BoolArray = npt.NDArray[np.bool_]
Point = tuple[float, float]
Size = tuple[int, int]  # width, height
#: a width, and a height or one for each of some shapes
Extent = tuple[int, int | npt.NDArray[np.int64]]

#: A share below this is no fragment.
LEAST = 1 / 512
#: Within a pixel a stroke is sampled at these places across it (Gauss's two, by which a straight edge comes out right).
_SAMPLE = np.float32(0.5 / 3**0.5)
#: A curve is drawn as straight pieces that deviate from it by at most this many pixels, none longer than ``_PIECE``.
_DEVIATION, _PIECE, _MOST_PIECES = 0.05, 32.0, 4096
#: Into so many rows a pixel is cut for what covers it of a polygon.
_SLICES = 4
#: Points along each round corner of polygons of two corners, and of more.
_ROUND = (13, 9)
#: Two pieces that meet at an angle with a cosine below this form a corner.
_CORNER = 0.9


@dataclass(frozen=True, slots=True)
class Rows:
    """Columns of one length, of which the k-th elements belong together: arrays (n,) or (n, 2)."""

    owners: IntArray

    def __len__(self) -> int:
        return len(self.owners)

    def only(self, chosen: BoolArray | IntArray | slice) -> Self:
        """Some of them."""
        return type(self)(*(getattr(self, column.name)[chosen] for column in fields(self)))


@dataclass(frozen=True, slots=True)
class Fragments(Rows):
    """``owners[k]`` covers ``shares[k]`` of pixel ``pixels[k]`` (numbered row by row)."""

    pixels: IntArray
    shares: Numbers


_NOWHERE: IntArray = np.empty(0, np.int64)
_NO_NUMBERS: Numbers = np.empty(0, np.float32)
NOTHING = Fragments(_NOWHERE, _NOWHERE, _NO_NUMBERS)
SomeRows = TypeVar("SomeRows", bound=Rows)


def joined(parts: Sequence[SomeRows], none: SomeRows) -> SomeRows:
    """All of several; ``none`` where there is nothing."""
    if len(parts) < 2:
        return parts[0] if parts else none
    return type(none)(*(np.concatenate([getattr(part, column.name) for part in parts]) for column in fields(none)))


@dataclass(frozen=True, slots=True)
class Pieces(Rows):
    """Straight pieces of curves: the number of its curve, where each starts and ends (n, 2), whether it is the first or
    the last of it, and how it meets the pieces before and after it."""

    starts: FloatArray
    ends: FloatArray
    first: BoolArray
    last: BoolArray
    #: 0 where the next piece goes on, 1 where it is drawn by rows rather than columns or the other way, 2 at a corner
    before: npt.NDArray[np.int8]
    after: npt.NDArray[np.int8]


def flatten(points: FloatArray, begins: IntArray) -> Pieces:
    """Cubic splines as straight pieces: ``points`` are those of all splines, of which number k has ``points[begins[k] :
    begins[k + 1]]``, 1 + 3·pieces of them."""
    counts = (np.diff(begins) - 1) // 3
    owners = np.repeat(np.arange(len(counts)), counts)
    within = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
    at = begins[:-1][owners] + 3 * within
    control = points[at[:, None] + np.arange(4)]
    bend = np.maximum(
        np.hypot(*(control[:, 0] - 2 * control[:, 1] + control[:, 2]).T),
        np.hypot(*(control[:, 1] - 2 * control[:, 2] + control[:, 3]).T),
    )
    length = np.hypot(*np.diff(control, axis=1).reshape(-1, 2).T).reshape(-1, 3).sum(axis=1)
    steps = np.maximum(np.sqrt(0.75 * bend / _DEVIATION), length / _PIECE)
    number = np.clip(np.ceil(steps), 1, _MOST_PIECES).astype(np.int64)
    curve = np.repeat(np.arange(len(number)), number)
    begin = np.cumsum(number) - number
    t0 = (np.arange(len(curve)) - begin[curve]) / number[curve]
    control = control[curve]
    starts = _bezier(control, t0)
    ends = np.empty_like(starts)
    ends[:-1] = starts[1:]
    closing = begin + number - 1
    ends[closing] = control[closing, 3]
    owner = owners[curve]
    there = np.abs(ends - starts).sum(axis=1) > 1e-6
    return _met(starts[there], ends[there], owner[there])


def _bezier(control: FloatArray, t: FloatArray) -> FloatArray:
    t = t[:, None]
    s = 1 - t
    result: FloatArray = s**3 * control[:, 0] + 3 * s * t * (s * control[:, 1] + t * control[:, 2])
    result += t**3 * control[:, 3]
    return result


def _met(starts: FloatArray, ends: FloatArray, owners: IntArray) -> Pieces:
    """Pieces that know how they meet their neighbours."""
    way = ends - starts
    way /= np.hypot(way[:, 0], way[:, 1])[:, None]
    steep = np.abs(way[:, 1]) > np.abs(way[:, 0])
    forward = np.where(steep, way[:, 1], way[:, 0]) > 0
    same = owners[1:] == owners[:-1]
    turns = (steep[1:] != steep[:-1]) | (forward[1:] != forward[:-1])
    corner = (way[1:] * way[:-1]).sum(axis=1) < _CORNER
    how = np.where(corner, 2, np.where(turns, 1, 0)).astype(np.int8) * same
    first, last = np.ones(len(owners), bool), np.ones(len(owners), bool)
    first[1:], last[:-1] = ~same, ~same
    before, after = np.zeros(len(owners), np.int8), np.zeros(len(owners), np.int8)
    before[1:], after[:-1] = how, how
    return Pieces(owners, starts, ends, first, last, before, after)


def cut(pieces: Pieces, dashes: Mapping[int, Sequence[float]], scale: float) -> Pieces:
    """Pieces, of which those of some curves are cut into dashes with flat ends: the lengths of ``dashes`` and gaps, by
    the number of the curve, are in units of so many pixels."""
    parts: list[tuple[FloatArray, FloatArray, int]] = []
    for owner in np.unique(pieces.owners).tolist():
        low, high = np.searchsorted(pieces.owners, (owner, owner + 1))
        starts, ends = pieces.starts[low:high], pieces.ends[low:high]
        if owner not in dashes:
            parts.append((starts, ends, owner))
            continue
        corners = np.concatenate([starts, ends[-1:]])
        lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
        for begin, end in _dashes(dashes[owner], scale, float(lengths[-1])):
            at = np.concatenate([[begin], lengths[(lengths > begin + _SHORT) & (lengths < end - _SHORT)], [end]])
            points = np.stack([np.interp(at, lengths, corners[:, axis]) for axis in (0, 1)], axis=1)
            parts.append((points[:-1], points[1:], owner))
    if not parts:
        return pieces
    each = np.repeat(np.arange(len(parts)), [len(starts) for starts, _, _ in parts])
    starts, ends = (np.concatenate([part[side] for part in parts]) for side in (0, 1))
    return replace(_met(starts, ends, each), owners=np.array([owner for _, _, owner in parts], np.int64)[each])


#: no part of a dash is shorter, in pixels
_SHORT = 1e-3


def _dashes(lengths: Sequence[float], scale: float, most: float) -> Iterator[tuple[float, float]]:
    """Where dashes begin and end along so many pixels."""
    at = 0.0
    for place in count():
        if at >= most - _SHORT:
            return
        after = at + scale * lengths[place % len(lengths)]
        if not place % 2:
            yield at, min(after, most)
        at = after


@dataclass(frozen=True, slots=True)
class Strokes(Rows):
    """Where strokes run over pixels: the curve, the pixel, how far its centre lies beside the middle of the stroke,
    counted along its column (or row, where the stroke is steep); by the piece: how fast that changes from column to
    column, and how much longer a way across is along the column; what share of the pixel lies before the ends; and how
    far it is from the end of its piece, where it lies beyond and another piece follows."""

    pixels: IntArray
    beside: Numbers
    slopes: Numbers
    secants: Numbers
    within: Numbers
    beyond: Numbers

    def shares(self, halves: Numbers) -> Numbers:
        """What strokes cover of their pixels if they are so wide, (n,) half widths."""
        reach = halves * self.secants
        aside = self.slopes * _SAMPLE
        both = _band(self.beside + aside, reach)
        both += _band(self.beside - aside, reach)
        both *= 0.5 * self.within
        # where pieces meet, each has a round end
        np.minimum(both, np.clip(halves + np.float32(0.5) - self.beyond, 0, 1), out=both)
        return both


def _band(away: Numbers, reach: Numbers) -> Numbers:
    """What a band of half width ``reach`` covers of a pixel whose centre is ``away`` from its middle."""
    share: Numbers = np.minimum(reach, away + np.float32(0.5))
    share -= np.maximum(-reach, away - np.float32(0.5))
    return np.clip(share, 0, 1, out=share)


def extent(pieces: Pieces, halves: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A box around each piece as drawn with half widths (n,): its least and its greatest corner, in pixels."""
    reach = (1.5 * halves + 1.5)[:, None]
    return np.minimum(pieces.starts, pieces.ends) - reach, np.maximum(pieces.starts, pieces.ends) + reach


def strokes(pieces: Pieces, halves: FloatArray, size: Extent, hidden: BoolArray | None = None) -> Strokes:
    """The pixels that strokes touch, of pieces with half widths (n,); not those that are ``hidden``.

    Each piece is drawn column by column (row by row where it is steep), so that no pixel is counted twice but where
    the direction of columns changes and at corners: there pieces overlap.
    """
    runs = _runs(pieces)
    slope, secant = runs.slope, runs.secant
    piece, u = _columns(runs, halves, size)
    # of each column the rows that it touches
    middle = runs.v0[piece] + slope[piece] * (u + 0.5 - runs.u0[piece])
    around = (halves * secant + np.abs(slope) / 2)[piece]
    most = np.where(runs.steep, size[0], size[1])[piece]
    top = np.clip(np.floor(middle - around), 0, most).astype(np.int64)
    rows = np.clip(np.floor(middle + around) + 1, 0, most).astype(np.int64) - top
    column, place = _ranges(np.maximum(rows, 0))
    stride = np.where(runs.steep, 1, size[0])
    start = u * np.where(runs.steep, size[0], 1)[piece] + top * stride[piece]
    pixels = start[column] + place * stride[piece][column]
    if hidden is not None:
        seen = np.flatnonzero(~hidden[pixels])
        column, place, pixels = column[seen], place[seen], pixels[seen]
    beside = ((top - middle).astype(np.float32) + np.float32(0.5))[column] + place
    within, beyond = _at_ends(runs, piece, u, column, beside)
    origin = piece[column]
    return Strokes(
        pieces.owners[origin],
        pixels,
        beside.astype(np.float32),
        slope.astype(np.float32)[origin],
        secant.astype(np.float32)[origin],
        within,
        beyond,
    )


def bars(lines: FloatArray, halves: Numbers, opacities: Numbers, size: Extent) -> Fragments:
    """Lines along an axis, from an end to the other (n, 2, 2), with half widths (n,): what ``strokes`` makes of them,
    for the share of a pixel is that across the line times that along it."""
    steep = lines[:, 0, 0] == lines[:, 1, 0]
    along, across = np.where(steep, lines[:, :, 1].T, lines[:, :, 0].T), np.where(steep, lines[:, 0, 0], lines[:, 0, 1])
    long, wide = np.where(steep, size[1], size[0]), np.where(steep, size[0], size[1])
    begin, end = along.min(axis=0), along.max(axis=0)
    first, count = _clipped(np.ceil(begin - 1.5), np.ceil(end + 0.5), long)
    line, place = _ranges(count)
    middles = place + first[line] + 0.5
    within = np.clip(0.5 + (middles - begin[line]), 0, 1).astype(np.float32)
    within *= np.clip(0.5 - (middles - end[line]), 0, 1)
    within *= np.float32(0.5)
    top, rows = _clipped(np.floor(across - halves), np.floor(across + halves) + 1, wide)
    owner, row = _ranges(rows)
    away = (((top - across).astype(np.float32) + np.float32(0.5))[owner] + row).astype(np.float32)
    covers = _band(away, halves[owner])
    start = top[owner] + row
    at, stride = start * np.where(steep, 1, size[0])[owner], np.where(steep, size[0], 1)
    counts = count[owner]
    each = np.repeat(np.arange(len(owner)), counts)
    which = _spans((np.cumsum(count) - count)[owner], counts)
    pixels = np.repeat(at + (first * stride)[owner], counts) + place[which] * stride[owner][each]
    shares = 2 * covers[each]
    shares *= within[which]
    np.minimum(shares, np.clip(halves + np.float32(0.5), 0, 1)[owner][each], out=shares)
    shares *= opacities[owner][each]
    return _fragments(owner[each], pixels, shares)


def _clipped(begin: FloatArray, end: FloatArray, most: IntArray | int) -> tuple[IntArray, IntArray]:
    """Where something begins, and how many there are up to its end, of no more than from 0 to ``most``."""
    first = np.clip(begin, 0, most).astype(np.int64)
    return first, np.maximum(np.clip(end, 0, most).astype(np.int64) - first, 0)


@dataclass(frozen=True, slots=True)
class _Runs:
    """Pieces (n,) as they are drawn: from (u0, v0) to u1, where u counts columns, and grows, and v rows; the other way
    round where a piece is ``steep``. ``slope`` is v by u, ``secant`` how much longer a way across the piece is along
    the column. How it meets its neighbours ``before`` and ``after`` (as in Pieces), and whether the stroke begins with
    it (``opens``) or ends (``closes``)."""

    steep: BoolArray
    u0: FloatArray
    u1: FloatArray
    v0: FloatArray
    slope: FloatArray
    secant: FloatArray
    before: npt.NDArray[np.int8]
    after: npt.NDArray[np.int8]
    opens: BoolArray
    closes: BoolArray


def _runs(pieces: Pieces) -> _Runs:
    steep = np.abs(pieces.ends - pieces.starts)
    steep = steep[:, 1] > steep[:, 0]
    u0, v0 = _turned(pieces.starts, steep)
    u1, v1 = _turned(pieces.ends, steep)
    back = u1 < u0
    before, after = np.where(back, pieces.after, pieces.before), np.where(back, pieces.before, pieces.after)
    opens, closes = np.where(back, pieces.last, pieces.first), np.where(back, pieces.first, pieces.last)
    u0, u1, v0, v1 = np.where(back, u1, u0), np.where(back, u0, u1), np.where(back, v1, v0), np.where(back, v0, v1)
    slope = (v1 - v0) / (u1 - u0)
    return _Runs(steep, u0, u1, v0, slope, np.hypot(1.0, slope), before, after, opens, closes)


def _columns(runs: _Runs, halves: FloatArray, size: Extent) -> tuple[IntArray, IntArray]:
    """The columns that pieces with half widths (n,) touch: of each the piece, and its number."""
    sideways = halves * np.abs(runs.slope) / runs.secant  # how far the corners of a butt end reach along the columns
    share = sideways / np.maximum(halves, 1e-9)
    ahead = np.where(runs.before == 2, 1.0, share * runs.before)
    behind = np.where(runs.after == 2, 1.0, share * runs.after)
    low = runs.u0 - np.where(runs.opens, sideways + 1, halves * ahead)
    high = runs.u1 + np.where(runs.closes, sideways + 1, halves * behind)
    wide = np.where(runs.steep, size[1], size[0])
    first = np.clip(np.ceil(low - 0.5), 0, wide).astype(np.int64)
    columns = np.clip(np.ceil(high - 0.5), 0, wide).astype(np.int64) - first
    piece, place = _ranges(np.maximum(columns, 0))
    return piece, place + first[piece]


def _at_ends(runs: _Runs, piece: IntArray, u: IntArray, column: IntArray, beside: Numbers) -> tuple[Numbers, Numbers]:
    """For pixels in these columns what share of each lies before the ends of its stroke, and how far each lies beyond
    the end of its piece where another follows. ``piece`` and ``u`` are by column, ``beside`` as in Strokes."""
    origin = piece[column]
    within, beyond = np.ones(len(column), np.float32), np.zeros(len(column), np.float32)
    for end, is_end, sign in ((runs.u0, runs.opens, -1.0), (runs.u1, runs.closes, 1.0)):
        over = is_end[piece] | (sign * (u + 0.5 - end[piece]) > 0)
        near = np.flatnonzero(over[column])
        at = origin[near]
        slope, secant = runs.slope[at], runs.secant[at]
        # how far along the piece, from its end outwards
        past = (sign * (u[column[near]] + 0.5 - end[at])) * secant + sign * slope / secant * beside[near]
        last = is_end[at]
        within[near] *= np.where(last, np.clip(0.5 - past, 0, 1), 1)
        far = np.where(last | (past <= 0), 0, np.hypot(past, beside[near] / secant))
        beyond[near] = np.maximum(beyond[near], far)
    return within, beyond


def _turned(points: FloatArray, steep: BoolArray) -> tuple[FloatArray, FloatArray]:
    return np.where(steep, points[:, 1], points[:, 0]), np.where(steep, points[:, 0], points[:, 1])


def _ranges(counts: IntArray) -> tuple[IntArray, IntArray]:
    """0…count-1 for each count, one after the other: which count, and the number."""
    which = np.repeat(np.arange(len(counts)), counts)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)


def _spans(begins: IntArray, counts: IntArray) -> IntArray:
    """As many numbers as each count says, from its beginning on, one after the other."""
    result = np.repeat(begins - np.cumsum(counts) + counts, counts)
    result += np.arange(len(result))
    return result


def _boxes(low: FloatArray, high: FloatArray, size: Extent) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """The pixels of boxes (n, 2) to (n, 2): which box, the pixel, and where its centre is."""
    most = np.empty((len(low), 2), np.int64)
    most[:, 0], most[:, 1] = size
    first = np.clip(np.floor(low), 0, most).astype(np.int64)
    count = np.maximum(np.clip(np.ceil(high), 0, most).astype(np.int64) - first, 0)
    line, place = _ranges(count[:, 1] * (count[:, 0] > 0))
    y = place + first[line, 1]
    row, place = _ranges(count[line, 0])
    x = place + first[line, 0][row]
    y = y[row]
    return line[row], y * size[0] + x, x + 0.5, y + 0.5


def _fragments(owners: IntArray, pixels: IntArray, shares: FloatArray | Numbers) -> Fragments:
    there = shares > LEAST
    return Fragments(owners[there], pixels[there], shares[there].astype(np.float32))


def discs(centres: FloatArray, radii: FloatArray, size: Size) -> Fragments:
    """Filled circles."""
    which, pixels, x, y = _boxes(centres - radii[:, None] - 1, centres + radii[:, None] + 1, size)
    away = np.hypot(x - centres[which, 0], y - centres[which, 1])
    return _fragments(which, pixels, np.clip(radii[which] + 0.5 - away, 0, 1))


def ringed(centres: FloatArray, radii: FloatArray, widths: FloatArray, size: Extent) -> tuple[Fragments, Fragments]:
    """Filled circles, and their outlines."""
    reach = (radii + widths / 2)[:, None] + 1
    which, pixels, x, y = _boxes(centres - reach, centres + reach, size)
    away, rims = np.hypot(x - centres[which, 0], y - centres[which, 1]), radii[which]
    edges = _line(np.abs(away - rims), widths[which] / 2)
    return _fragments(which, pixels, np.clip(rims + 0.5 - away, 0, 1)), _fragments(which, pixels, edges)


def _line(away: FloatArray, half: FloatArray | float) -> FloatArray:
    result: FloatArray = np.clip(np.minimum(half, away + 0.5) - np.maximum(-half, away - 0.5), 0, 1)
    return result


@dataclass(frozen=True, slots=True)
class Heads(Rows):
    """Where heads of lines lie over pixels: the head, the pixel, and how far its centre lies behind the tip and beside
    the middle."""

    pixels: IntArray
    behind: Numbers
    beside: Numbers

    def shares(self, lengths: Numbers, halves: Numbers, stems: Numbers) -> Numbers:
        """What heads cover of their pixels if they are so long and so wide, (n,) half widths: arrows, and where
        ``stems`` are not below 0 bars with stems of these half widths."""
        shares = _arrows(self.behind, self.beside, lengths, halves)
        bars = np.flatnonzero(stems >= 0)
        if len(bars):
            behind, beside, lengths = self.behind[bars], self.beside[bars], lengths[bars]
            back, end = np.float32(Arrowhead.BAR) * lengths, np.float32(Arrowhead.NOTCH + Arrowhead.LAP) * lengths
            across = _between(behind, np.zeros_like(back), back) * _band(beside, halves[bars])
            shares[bars] = across + _between(behind, back, end) * _band(beside, stems[bars])
        return shares


def _arrows(behind: Numbers, beside: Numbers, lengths: Numbers, halves: Numbers) -> Numbers:
    """What arrows cover: what lies between the sides and before the notched back."""
    cosine = np.divide(lengths, np.hypot(lengths, halves), dtype=np.float32)  # of half the angle at the tip
    reach = np.divide(halves * behind, np.maximum(lengths, np.float32(1e-6)), dtype=np.float32)
    share = _band(beside * cosine, reach * cosine)
    back = np.float32(1 - Arrowhead.NOTCH) * lengths
    inside = np.float32(Arrowhead.NOTCH) * lengths * halves + back * beside - halves * behind
    inside /= np.maximum(np.hypot(halves, back), np.float32(1e-6))
    share *= np.clip(inside + np.float32(0.5), 0, 1)
    return share


def _between(place: Numbers, begin: Numbers, end: Numbers) -> Numbers:
    """What of a pixel's length lies between two places."""
    share: Numbers = np.minimum(end, place + np.float32(0.5))
    share -= np.maximum(begin, place - np.float32(0.5))
    return np.clip(share, 0, 1, out=share)


def heads(tips: FloatArray, ways: FloatArray, lengths: FloatArray, halves: FloatArray, size: Extent) -> Heads:
    """The pixels of heads: at ``tips``, along the unit vectors ``ways``, (n,) long and half as wide."""
    backs = tips - lengths[:, None] * ways
    across = halves[:, None] * np.stack([-ways[:, 1], ways[:, 0]], axis=1)
    corners = np.stack([tips + across, tips - across, backs + across, backs - across])
    which, pixels, x, y = _boxes(corners.min(axis=0) - 1, corners.max(axis=0) + 1, size)
    x, y = x - tips[which, 0], y - tips[which, 1]
    dx, dy = ways[which, 0], ways[which, 1]
    return Heads(which, pixels, -(x * dx + y * dy).astype(np.float32), np.abs(x * dy - y * dx).astype(np.float32))


_NO_POINTS: FloatArray = np.empty((0, 2))
_NO_ENDS, _NO_WAYS = np.empty(0, np.bool_), np.empty(0, np.int8)
NO_PIECES = Pieces(_NOWHERE, _NO_POINTS, _NO_POINTS, _NO_ENDS, _NO_ENDS, _NO_WAYS, _NO_WAYS)
NO_STROKES = Strokes(_NOWHERE, _NOWHERE, *[_NO_NUMBERS] * 5)
NO_HEADS = Heads(_NOWHERE, _NOWHERE, _NO_NUMBERS, _NO_NUMBERS)


def rounded(corners: FloatArray, margins: FloatArray) -> FloatArray:
    """Convex polygons of k corners each (n, k, 2) with all that lies within margins (n,) of them, as polygons."""
    if not margins.any():
        return corners
    if corners.shape[1] == 1:
        corners = np.repeat(corners, 2, axis=1)
    count = corners.shape[1]
    edges = np.roll(corners, -1, axis=1) - corners
    twice = edges[:, :, 0] * np.roll(edges[:, :, 1], -1, axis=1) - edges[:, :, 1] * np.roll(edges[:, :, 0], -1, axis=1)
    around = np.where(twice.sum(axis=1) < 0, -1.0, 1.0)[:, None]
    angles = np.arctan2(edges[:, :, 1], edges[:, :, 0])
    if count == 2:
        angles[:, 1] = angles[:, 0] + math.pi  # also of a point, which has no edges
    turns = around * (angles - np.roll(angles, 1, axis=1)) % (2 * math.pi)
    steps = _ROUND[count > 2]
    ways = (angles - around * turns)[:, :, None] + (around * turns)[:, :, None] * np.linspace(0, 1, steps)
    out = np.stack([np.sin(ways), -np.cos(ways)], axis=-1) * around[:, :, None, None]
    result: FloatArray = corners[:, :, None] + margins[:, None, None, None] * out
    return result.reshape(len(corners), -1, 2)


@dataclass(frozen=True, slots=True)
class Filled:
    """What polygons cover: of the first pixels of a picture the foremost polygon that covers all of each, −1 where none
    does; and what others cover in part."""

    front: npt.NDArray[np.int32]
    edges: Fragments

    def fragments(self) -> Fragments:
        """All of it as fragments."""
        whole = np.flatnonzero(self.front >= 0)
        covered = Fragments(self.front[whole].astype(np.int64), whole, np.ones(len(whole), np.float32))
        return joined([covered, self.edges], NOTHING)


NOT_FILLED = Filled(np.empty(0, np.int32), NOTHING)


def polygons(corners: FloatArray, owners: IntArray, size: Extent, begins: IntArray | None = None) -> Filled:
    """Filled convex polygons of k corners each (n, k, 2), in the order of their ``owners`` (n,), later ones in front of
    others: a pixel is cut into ``_SLICES`` rows, of which it is known exactly how much of each lies inside. What is
    hidden by another of them is left out. Where they lie on several pictures, ``begins`` (n,) is the first pixel of
    that of each."""
    if not len(corners):
        return NOT_FILLED
    first, rows = _clipped(np.floor(corners[:, :, 1].min(axis=1)), np.ceil(corners[:, :, 1].max(axis=1)), size[1])
    left, right = np.clip(_sides(corners, first, rows), 0, size[0])
    owner = np.repeat(owners.astype(np.int32), rows)
    corner = np.zeros(len(corners), np.int64) if begins is None else begins
    begin = np.arange(len(owner)) * size[0] + np.repeat((first - np.cumsum(rows) + rows) * size[0] + corner, rows)
    low, high = np.floor(left.min(axis=0)).astype(np.int64), np.ceil(right.max(axis=0)).astype(np.int64)
    inner, outer = np.ceil(left.max(axis=0)).astype(np.int64), np.floor(right.min(axis=0)).astype(np.int64)
    inner = np.minimum(inner, high)
    outer = np.clip(outer, inner, high)
    front = np.full(int((corner + size[0] * size[1]).max()), -1, np.int32)
    # owners ascend, and the last one stays
    front[_spans(begin + inner, outer - inner)] = np.repeat(owner, outer - inner)
    parts = []
    for start, end in ((low, inner), (outer, high)):
        counts = np.maximum(end - start, 0)
        pixels, row = _spans(begin + start, counts), np.repeat(np.arange(len(owner)), counts)
        seen = np.flatnonzero(owner[row] > front[pixels])
        pixels, row = pixels[seen], row[seen]
        x = (pixels - begin[row]).astype(np.float32)
        within = np.minimum(np.take(right, row, axis=1), x + 1)
        within -= np.maximum(np.take(left, row, axis=1), x)
        np.clip(within, 0, 1, out=within)
        parts.append(_fragments(owner[row].astype(np.int64), pixels, within.sum(axis=0) / _SLICES))
    return Filled(front, joined(parts, NOTHING))


def _sides(corners: FloatArray, first: IntArray, rows: IntArray) -> Numbers:
    """Where convex polygons (n, k, 2) begin and end in each slice of their rows: so many each, from the ``first`` on;
    (2, slices of a row, rows of all). Nothing of one is in slices where both are 0."""
    owners = np.repeat(np.arange(len(corners)), corners.shape[1])
    starts, ends = corners.reshape(-1, 2), np.roll(corners, -1, axis=1).reshape(-1, 2)
    slices = np.concatenate([[0], np.cumsum(_SLICES * rows)])
    sides = np.zeros((2, slices[-1]), np.float32)
    for side, (begin, end) in enumerate(((starts, ends), (ends, starts))):  # edges that lead down, then those up
        down = np.flatnonzero(end[:, 1] > begin[:, 1])
        begin, end, owner = begin[down], end[down], owners[down]
        at = [_SLICES * (edge[:, 1] - first[owner]) - 0.5 for edge in (begin, end)]  # in slices of its polygon
        low, high = (np.clip(np.ceil(one), 0, _SLICES * rows[owner]).astype(np.int64) for one in at)
        counts = np.maximum(high - low, 0)
        place = _spans(low, counts)
        share = (place - np.repeat(at[0], counts)) / np.repeat(at[1] - at[0], counts)
        x = np.repeat(begin[:, 0], counts) + share * np.repeat(end[:, 0] - begin[:, 0], counts)
        sides[side, _spans(slices[owner] + low, counts)] = x
    each = np.ascontiguousarray(sides.reshape(2, -1, _SLICES).transpose(0, 2, 1))
    return np.stack([np.minimum(*each), np.maximum(*each)])


def rectangle(corner: Point, extent: Point, radius: float, size: Size) -> Fragments:
    """A filled rectangle with round corners."""
    which, pixels, away = _beyond_rounded(corner, extent, radius, 1, size)
    return _fragments(which, pixels, np.clip(0.5 - away, 0, 1))


def outline(corner: Point, extent: Point, radius: float, width: float, size: Size) -> Fragments:
    """The outline of a rectangle with round corners."""
    which, pixels, away = _beyond_rounded(corner, extent, radius, 1 + width, size)
    return _fragments(which, pixels, _line(np.abs(away), width / 2))


def _beyond_rounded(
    corner: Point, extent: Point, radius: float, reach: float, size: Size
) -> tuple[IntArray, IntArray, FloatArray]:
    """Signed distances to a rectangle with round corners, negative inside."""
    low, (wide, high) = np.array([corner]), extent
    which, pixels, x, y = _boxes(low - reach, low + extent + reach, size)
    radius = min(radius, wide / 2, high / 2)
    over_x = np.abs(x - corner[0] - wide / 2) - wide / 2 + radius
    over_y = np.abs(y - corner[1] - high / 2) - high / 2 + radius
    outside = np.hypot(np.maximum(over_x, 0), np.maximum(over_y, 0))
    return which, pixels, outside + np.minimum(np.maximum(over_x, over_y), 0) - radius


def cells(corner: Point, extent: Point, columns: int, rows: int, size: Size) -> tuple[IntArray, IntArray]:
    """The pixels of an image of cells, and the cell in which the centre of each lies."""
    across, x = _cells(corner[0], corner[0] + extent[0], columns, size[0])
    down, y = _cells(corner[1], corner[1] + extent[1], rows, size[1])
    return (y[:, None] * size[0] + x).ravel(), (down[:, None] * columns + across).ravel()


def _cells(near: float, far: float, count: int, end: int) -> tuple[IntArray, IntArray]:
    """Of ``count`` cells from ``near`` to ``far`` the one at each pixel of a side of ``end`` pixels, and these."""
    pixels = np.arange(max(0, round(near)), min(end, round(far)))
    which = np.floor((pixels + 0.5 - near) / max(far - near, 1e-9) * count).astype(np.int64)
    return np.clip(which, 0, count - 1), pixels


def dashed(points: Sequence[Point], width: float, dash: Sequence[float], size: Size) -> Fragments:
    """A dashed stroke with round caps: dots along its dashes, a quarter of a pixel apart or less than a tenth of the
    width, of which the nearest to a pixel counts."""
    spacing = max(0.25, width / 32)
    control = np.asarray(points, float)
    pieces = flatten(control, np.array([0, len(control)]))
    corners = np.concatenate([pieces.starts, pieces.ends[-1:]])
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    on = np.linspace(0.0, dash[0], 2 + int(dash[0] / spacing))
    at = (np.arange(0.0, lengths[-1], sum(dash))[:, None] + on).ravel()
    at = at[at <= lengths[-1]]
    dots = np.stack([np.interp(at, lengths, corners[:, 0]), np.interp(at, lengths, corners[:, 1])], axis=1)
    radii = np.full(len(dots), width / 2)
    many = max(1, int(_MOST_DOTTED / (width + 3) ** 2))
    shares = np.zeros(size[0] * size[1], np.float32)
    for start in range(0, len(dots), many):
        found = discs(dots[start : start + many], radii[start : start + many], size)
        np.maximum.at(shares, found.pixels, found.shares)
    pixels = np.flatnonzero(shares)
    return Fragments(np.zeros(len(pixels), np.int64), pixels, shares[pixels])


#: Pixels of dots that are drawn at once.
_MOST_DOTTED = 1 << 20
