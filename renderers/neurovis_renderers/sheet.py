"""A sheet: the shapes of a scene as arrays in pixels, from which fragments are made for any part of its order.

In: groups of a Scene. Out: for shapes ``low`` to ``high`` of their order from back to front the fragments. A shape of
a scene may have several places in the order: a disc has one for its filling and one for its ring. So of a group that
holds a line, a disc and a text the line is at 0, the filling at 1, the ring at 2, the text at 3.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property, lru_cache
from itertools import chain

import numpy as np
import numpy.typing as npt

from neurovis_renderers import coverage
from neurovis_renderers.coverage import BoolArray, Extent, Filled, Fragments, Heads, Numbers, Pieces, Size, Strokes
from neurovis_renderers.lettering import lettering
from neurovis_spec.scene import (
    Arrowhead,
    Disc,
    FloatArray,
    Group,
    Image,
    IntArray,
    Point,
    Polygon,
    Polyline,
    Ramp,
    Rectangle,
    Shape,
    Spline,
    Text,
)

#: A colour and its weight are whole numbers: red, green and blue times a weight of at most ``WHOLE`` stand side by side
#: in one integer of 64 bits, ``LANE`` bits each, and are added at once.
WHOLE, LANE = 1 << 13, 21
#: Colours as red, green, blue and nothing, a byte each.
Words = npt.NDArray[np.uint32]
#: No letter is wider, in sizes of its text.
_WIDEST = 2.0


@lru_cache(maxsize=4096)
def packed(colour: str) -> int:
    """A colour as an integer of three lanes.

    >>> [packed("#010203") >> lane & 255 for lane in (0, LANE, 2 * LANE)]
    [1, 2, 3]
    """
    number = int(colour[1:], 16)
    return number >> 16 | (number >> 8 & 255) << LANE | (number & 255) << 2 * LANE


def packed_all(colours: npt.NDArray[np.uint8]) -> IntArray:
    """Colours (n, 3) as integers of three lanes."""
    wide = colours.astype(np.int64)
    result: IntArray = wide[:, 0] | wide[:, 1] << LANE | wide[:, 2] << 2 * LANE
    return result


def unpacked(sums: IntArray) -> npt.NDArray[np.uint8]:
    """Sums of colours times weights that add up to ``WHOLE``, as colours (n, 3).

    >>> unpacked(np.array([packed("#000000") * (WHOLE // 2) + packed("#646464") * (WHOLE // 2)])).tolist()
    [[50, 50, 50]]
    """
    result = np.empty((len(sums), 3), np.uint8)
    for lane in range(3):
        value = sums >> (lane * LANE)
        value &= (1 << LANE) - 1
        value += WHOLE // 2
        value >>= 13
        result[:, lane] = value
    return result


def lanes(sums: IntArray) -> IntArray:
    """Sums of colours times weights that add up to ``WHOLE``, as packed colours."""
    rounded = sums + (WHOLE // 2) * (1 | 1 << LANE | 1 << 2 * LANE)
    mask = (1 << LANE) - 1
    result = rounded >> 13 & 255
    result |= (rounded >> LANE & mask) >> 13 << LANE
    result |= (rounded >> 2 * LANE & mask) >> 13 << 2 * LANE
    return result


def bytes_of(colours: IntArray) -> Words:
    """Packed colours as red, green, blue and nothing, a byte each."""
    result = colours & 255
    result |= colours >> LANE - 8 & 255 << 8
    result |= colours >> 2 * LANE - 16 & 255 << 16
    return result.astype(np.uint32)


def lanes_of(words: Words) -> IntArray:
    """Red, green and blue, a byte each, as packed colours."""
    wide = words.astype(np.int64)
    result: IntArray = wide & 255 | (wide >> 8 & 255) << LANE | (wide >> 16 & 255) << 2 * LANE
    return result


class Sheet:
    """The shapes of groups, each with its place in the order (0 is the furthest back), its colour and its opacity."""

    def __init__(
        self, groups: Sequence[Group], density: float, left_out: Collection[str] = (), bars: bool = False
    ) -> None:
        """Groups whose id is in ``left_out`` have their places, but nothing is drawn there. With ``bars`` lines along
        an axis are drawn as what they are, rectangles, and not by pieces: that is quicker, and as good as the same."""
        self.density, self._with_bars = density, bars
        self.colours: list[int] = []
        #: where each shape of a group begins in the order: ``places[group][shape]``
        self.places: list[list[int]] = []
        #: where each group begins in the order
        self.firsts: list[int] = []
        #: of shapes on pages the first pixel of that of each, its rows, and where it lies on the sheet, by its place
        self._begins: IntArray | None = None
        self._rows: IntArray = np.empty(0, np.int64)
        self._corners: IntArray = np.empty((0, 2), np.int64)
        #: groups with an opacity of their own: first and last place, opacity
        self.veiled: list[tuple[int, int, float]] = []
        self._splines: list[tuple[int, Spline]] = []
        self._heads: list[tuple[int, Arrowhead]] = []
        self._discs: list[tuple[int, Disc]] = []
        self._bars: list[tuple[int, Polyline]] = []
        #: place, corners, margin
        self._polygons: list[tuple[int, tuple[Point, ...], float]] = []
        #: first place, the place above the last
        self._others: list[tuple[int, int, Shape]] = []
        for group in groups:
            begin = len(self.colours)
            self.firsts.append(begin)
            if group.id in left_out:
                self.places.append([begin])
                self.colours.append(0)
                continue
            self.places.append([self._add(shape) for shape in group.shapes])
            if group.opacity != 1:
                self.veiled.append((begin, len(self.colours), group.opacity))

    def __len__(self) -> int:
        return len(self.colours)

    def _add(self, shape: Shape) -> int:
        place = len(self.colours)
        if self._colour(place, shape):
            self._others.append((place, len(self.colours), shape))
        return place

    def _colour(self, place: int, shape: Shape) -> bool:
        """Give a shape its places with their colours, and say whether it is one of the few that are drawn singly."""
        match shape:
            case Spline() if shape.flat or not shape.dash:
                self._splines.append((place, shape))
                self.colours.append(packed(shape.stroke))
                return False
            case Polyline() if shape.round and len(shape.points) == 2 and shape.opacity == 1:
                self._polygons.append((place, shape.points, shape.width / 2))
                self.colours.append(packed(shape.stroke))
                return False
            case Polyline() if self._with_bars and not shape.round and _is_straight(shape.points):
                self._bars.append((place, shape))
                self.colours.append(packed(shape.stroke))
                return False
            case Polyline():
                self._splines.append((place, shape.spline))
                self.colours.append(packed(shape.stroke))
                for end in (shape.points[0], shape.points[-1]) if shape.round else ():
                    cap = Disc(end, shape.width / 2, shape.stroke, shape.stroke, 0.0)
                    self._discs.append((len(self.colours), cap))
                    self.colours += 2 * [packed(shape.stroke)]
                return False
            case Arrowhead():
                self._heads.append((place, shape))
                self.colours.append(packed(shape.fill))
                return False
            case Polygon():
                self._polygons.append((place, shape.points, shape.margin))
                self.colours.append(packed(shape.fill))
                return False
            case Disc():
                self._discs.append((place, shape))
                self.colours += [packed(shape.fill), packed(shape.stroke)]
                return False
            case Spline():
                self.colours.append(packed(shape.stroke))
            case Rectangle():
                self.colours += [packed(shape.fill), packed(shape.stroke)]
            case Ramp():
                self.colours += [packed(colour) for colour in shape.colours]
            case Image():
                cells = np.frombuffer(shape.pixels, np.uint8).reshape(-1, 3)
                self.colours += np.unique(packed_all(cells)).tolist()
            case Text():
                self.colours += [packed(colour) for colour in (shape.halo, shape.fill) if colour]
        return True

    def parts(self) -> list[tuple[int, int, float]]:
        """The order in parts that are drawn each as one: first place, the place above the last, opacity."""
        result, low = [], 0
        for begin, end, opacity in (*self.veiled, (len(self), len(self), 1.0)):
            if begin > low:
                result.append((low, begin, 1.0))
            if end > begin:
                result.append((begin, end, opacity))
            low = end
        return result

    @cached_property
    def areas(self) -> FloatArray:
        """How many pixels each shape may touch, by its place; without solid splines."""
        result = np.zeros(len(self))
        places, table = self._head_arrays
        result[places] = (table[:, 4] + 2 * table[:, 5] + 2) ** 2
        places, table = self._disc_arrays
        result[places] = (2 * table[:, 2] + 2) ** 2
        places, corners = self._polygon_arrays
        result[places] = np.prod(np.ptp(corners, axis=1), axis=1)
        result[self._bar_arrays[0]] = self._bar_areas
        for place, _, shape in self._others:
            if isinstance(shape, Rectangle | Ramp | Image):
                result[place] = shape.width * shape.height * self.density**2
        return result

    @cached_property
    def pieces(self) -> Pieces:
        """All solid splines as straight pieces, by the order of their shapes; a piece's owner is its place."""
        if not self._splines:
            return coverage.NO_PIECES
        points = np.array(list(chain.from_iterable(shape.points for _, shape in self._splines)), float).reshape(-1, 2)
        begins = np.concatenate([[0], np.cumsum([len(shape.points) for _, shape in self._splines])]).astype(np.int64)
        found = coverage.flatten(points * self.density, begins)
        dashes = {number: shape.dash for number, (_, shape) in enumerate(self._splines) if shape.dash}
        if dashes:
            found = coverage.cut(found, dashes, self.density)
        places = np.array([place for place, _ in self._splines], np.int64)
        return replace(found, owners=places[found.owners])

    @cached_property
    def halves(self) -> Numbers:
        """Half the width of each solid spline in pixels, by its place."""
        result = np.zeros(len(self), np.float32)
        result[[place for place, _ in self._splines]] = [shape.width * self.density / 2 for _, shape in self._splines]
        return result

    @cached_property
    def paints(self) -> IntArray:
        """The colour of each shape, by its place."""
        return np.array(self.colours, np.int64)

    def with_halves(self, halves: Numbers, stems: Numbers) -> Sheet:
        """The same with lines, heads and stems of other half widths, by their place."""
        shared = self.pieces, self.opacities, self.head_lengths  # worked out once
        result = copy(self)
        places, table = self._head_arrays
        table = table.copy()
        table[:, 5] = halves[places]
        result.__dict__.update(_head_arrays=(places, table), halves=halves, head_halves=halves, head_stems=stems)
        assert result.pieces is shared[0]
        return result

    def on_pages(self, page_of: IntArray, corners: IntArray, wide: int, rows: IntArray) -> Sheet:
        """The same with shapes on pages of one width, one after the other: which each is on, by its place, which pixel
        of the sheet is the first of each page, (pages, 2), and how many rows that has."""
        result = copy(self)
        shifts = corners[page_of]
        moved = {}
        for name in ("_head_arrays", "_disc_arrays"):
            places, table = getattr(self, name)
            moved[name] = places, np.concatenate([table[:, :2] - shifts[places], table[:, 2:]], axis=1)
        places, outlines = self._polygon_arrays
        moved["_polygon_arrays"] = places, outlines - shifts[places][:, None]
        places, bars = self._bar_arrays
        twice = np.tile(shifts[places], 2)
        moved["_bar_arrays"] = places, np.concatenate([bars[:, :4] - twice, bars[:, 4:]], axis=1)
        by = shifts[self.pieces.owners]
        pieces = replace(self.pieces, starts=self.pieces.starts - by, ends=self.pieces.ends - by)
        begins = (wide * (np.cumsum(rows) - rows))[page_of]
        result.__dict__.update(moved, pieces=pieces, _corners=shifts, _begins=begins, _rows=rows[page_of])
        return result

    def stroke_shares(self, made: Strokes) -> Numbers:
        """What strokes cover, as wide as their shapes are."""
        shares: Numbers = made.shares(self.halves[made.owners]) * self.opacities[made.owners]
        return shares

    def head_shares(self, made: Heads) -> Numbers:
        """What heads cover, as wide as they are."""
        owners = made.owners
        return made.shares(self.head_lengths[owners], self.head_halves[owners], self.head_stems[owners])

    @cached_property
    def opacities(self) -> Numbers:
        """The opacity of each shape by itself, by its place."""
        result = np.ones(len(self), np.float32)
        result[[place for place, _ in self._splines]] = [shape.opacity for _, shape in self._splines]
        for place, _, shape in self._others:
            if isinstance(shape, Spline):
                result[place] = shape.opacity
        return result

    @cached_property
    def head_lengths(self) -> Numbers:
        """The length of each head in pixels, by its place."""
        result = np.zeros(len(self), np.float32)
        result[self._head_arrays[0]] = self._head_arrays[1][:, 4]
        return result

    @cached_property
    def head_halves(self) -> Numbers:
        """Half the width of each head in pixels, by its place."""
        result = np.zeros(len(self), np.float32)
        result[self._head_arrays[0]] = self._head_arrays[1][:, 5]
        return result

    @cached_property
    def head_stems(self) -> Numbers:
        """Half the width of the stem of each bar, and of what has no other end, in pixels, by its place; −1 for
        arrows."""
        result = np.full(len(self), -1, np.float32)
        for place, head in self._heads:
            if head.kind != "arrow":
                result[place] = head.width * self.density / 2
        return result

    @cached_property
    def _head_arrays(self) -> tuple[IntArray, FloatArray]:
        rows = [(*head.tip, *head.direction, head.length, head.half_width) for _, head in self._heads]
        table = np.array(rows, float).reshape(-1, 6)
        table[:, [0, 1, 4, 5]] *= self.density
        return np.array([place for place, _ in self._heads], np.int64), table

    @cached_property
    def _disc_arrays(self) -> tuple[IntArray, FloatArray]:
        rows = [(*disc.centre, disc.radius, disc.stroke_width) for _, disc in self._discs]
        table = np.array(rows, float).reshape(-1, 4) * self.density
        return np.array([place for place, _ in self._discs], np.int64), table

    @cached_property
    def _bar_arrays(self) -> tuple[IntArray, FloatArray]:
        """Places of bars; of each where it begins and ends, half its width, its opacity."""
        rows = [(*bar.points[0], *bar.points[1], bar.width / 2, bar.opacity) for _, bar in self._bars]
        table = np.array(rows, float).reshape(-1, 6)
        table[:, :5] *= self.density
        return np.array([place for place, _ in self._bars], np.int64), table

    @cached_property
    def _bar_areas(self) -> FloatArray:
        """How many pixels each bar may touch."""
        table = self._bar_arrays[1]
        result: FloatArray = np.prod(np.abs(table[:, 2:4] - table[:, :2]) + 2 * table[:, 4:5] + 2, axis=1)
        return result

    @cached_property
    def _polygon_arrays(self) -> tuple[IntArray, FloatArray]:
        """Places of polygons, and their corners in pixels, (n, k, 2), of those with few the last several times."""
        alike: dict[int, list[int]] = {}
        for number, (_, corners, _) in enumerate(self._polygons):
            alike.setdefault(len(corners), []).append(number)
        made: list[tuple[list[int], FloatArray]] = []
        for some in alike.values():
            points = np.array([self._polygons[number][1] for number in some]) * self.density
            margins = np.array([self._polygons[number][2] for number in some]) * self.density
            made.append((some, coverage.rounded(points, margins)))
        rounded = np.zeros((len(self._polygons), max((each.shape[1] for _, each in made), default=1), 2))
        for some, each in made:
            rounded[some, : each.shape[1]] = each
            rounded[some, each.shape[1] :] = each[:, -1:]
        return np.array([place for place, _, _ in self._polygons], np.int64), rounded

    def heads(self, low: int, high: int, corner: Size, size: Size) -> Heads:
        """The heads of lines among shapes ``low`` to ``high``, as they lie over pixels from a ``corner`` on."""
        places, table = _between(*self._head_arrays, low, high)
        if not len(places):
            return coverage.NO_HEADS
        tips, extent = table[:, :2] - corner, self._extent(places, size)
        near = _reaches(tips[:, 1], table[:, 4] + table[:, 5], extent)
        places, tips, table = places[near], tips[near], table[near]
        found = coverage.heads(tips, table[:, 2:4], table[:, 4], table[:, 5], self._extent(places, size))
        owners = places[found.owners]
        return replace(found, owners=owners, pixels=self._on_page(found.pixels, owners))

    def filled(self, low: int, high: int, corner: Size, size: Size) -> Filled:
        """The polygons among shapes ``low`` to ``high``, in pixels from a ``corner`` on."""
        places, corners = _between(*self._polygon_arrays, low, high)
        begins = None if self._begins is None else self._begins[places]
        return coverage.polygons(corners - corner, places, self._extent(places, size), begins)

    def solid(self, low: int, high: int, corner: Size, size: Size) -> Fragments:
        """The fragments of all but solid splines, heads and polygons, of shapes ``low`` to ``high``, in pixels from a
        ``corner`` on."""
        found = []
        places, table = _between(*self._disc_arrays, low - 1, high)
        if len(places):
            near = _reaches(table[:, 1] - corner[1], table[:, 2] + table[:, 3], self._extent(places, size))
            places, table = places[near], table[near]
            discs = coverage.ringed(table[:, :2] - corner, table[:, 2], table[:, 3], self._extent(places, size))
            found += [self._owned(each, places + number) for number, each in enumerate(discs)]
        places, table = _between(*self._bar_arrays, low, high)
        if len(places):
            ends, (halves, opacities) = table[:, :4].reshape(-1, 2, 2) - corner, table[:, 4:].T.astype(np.float32)
            found.append(self._owned(coverage.bars(ends, halves, opacities, self._extent(places, size)), places))
        for place, end, shape in self._others:
            if place < high and end > low:
                parts = self._other(shape, *self._page_of(place, corner, size))
                found += [self._owned(part, np.arange(place + number, end)) for number, part in enumerate(parts)]
        made = coverage.joined(found, coverage.NOTHING)
        return made.only((made.owners >= low) & (made.owners < high)) if low or high < len(self) else made

    def most(self, page_of: IntArray, sizes: IntArray) -> float:
        """How many fragments there may be at most, about, on pages of these sizes, (pages, 2), by the page that each
        shape is on."""
        areas, letters, whole = sizes.prod(axis=1), 0.0, 0.0
        for place, _, shape in self._others:
            if isinstance(shape, Text):
                letters += 6 * shape.size**2 * (len(shape.text) + len(shape.subscript) + 2)
            else:
                whole += areas[page_of[place]]
        if self._polygons:
            whole += 2 * areas.sum()
        if self._discs or self._heads:
            discs, heads = self._disc_arrays[1], self._head_arrays[1]
            whole += 8 * ((discs[:, 2] + discs[:, 3] + 1) ** 2).sum() + 4 * (heads[:, 4:].sum(axis=1) ** 2).sum()
        if self._bars:
            whole += np.minimum(self._bar_areas, areas[page_of[self._bar_arrays[0]]]).sum()
        if self._splines:
            pieces, halves = self.pieces, self.halves[self.pieces.owners] + 2
            length = np.hypot(*(pieces.ends - pieces.starts).T) + 2 * halves
            whole += (np.minimum(length, sizes.sum(axis=1)[page_of[pieces.owners]]) * 3 * halves).sum()
        return float(whole + letters * self.density**2)

    def extents(self, page_of: IntArray, pages: int) -> tuple[FloatArray, FloatArray]:
        """The least and the greatest place at which anything may be seen of the shapes of each page, by the page that
        each is on (by its place); (pages, 2) each, in pixels."""
        ends = np.full((pages, 4), np.inf)

        def reach(places: IntArray, least: FloatArray, most: FloatArray) -> None:
            page = page_of[places]  # in order, as places are
            begins = np.flatnonzero(np.diff(page, prepend=-1))
            some = page[begins]
            ends[some] = np.minimum(ends[some], np.minimum.reduceat(np.concatenate([least, -most], axis=1), begins))

        if self._polygons:
            places, corners = self._polygon_arrays
            each = np.ascontiguousarray(corners.transpose(1, 0, 2))  # NumPy is slow along an axis in the middle
            reach(places, each.min(axis=0), each.max(axis=0))
        for places, table, beyond in (
            (*self._disc_arrays, self._disc_arrays[1][:, 2:4]),
            (*self._head_arrays, self._head_arrays[1][:, 4:6]),
        ):
            if len(places):
                around = beyond.sum(axis=1)[:, None]
                reach(places, table[:, :2] - around, table[:, :2] + around)
        if self._bars:
            places, table = self._bar_arrays
            around = table[:, 4:5] + 1.5
            reach(
                places,
                *(np.minimum(table[:, :2], table[:, 2:4]) - around, np.maximum(table[:, :2], table[:, 2:4]) + around),
            )
        if len(self.pieces):
            halves = self.halves[self.pieces.owners].astype(float)
            reach(self.pieces.owners, *coverage.extent(self.pieces, halves))
        others = [(place, *corner) for place, _, shape in self._others for corner in _reach(shape)]
        if others:
            corners, around = (np.array([each[part] for each in others]) * self.density for part in (1, 2))
            reach(np.array([place for place, _, _ in others]), corners - around, corners + around)
        return ends[:, :2], -ends[:, 2:]

    def _extent(self, places: IntArray, size: Size) -> Extent:
        """The extent of the picture that each of some shapes is on."""
        return size if self._begins is None else (size[0], self._rows[places])

    def _page_of(self, place: int, corner: Size, size: Size) -> tuple[Size, Size]:
        """The first pixel of the picture that a shape is on, and its size."""
        if self._begins is None:
            return corner, size
        x, y = self._corners[place].tolist()
        return (x + corner[0], y + corner[1]), (size[0], int(self._rows[place]))

    def _owned(self, part: Fragments, places: IntArray) -> Fragments:
        """Fragments of shapes with these places."""
        owners = places[part.owners]
        return Fragments(owners, self._on_page(part.pixels, owners), part.shares)

    def _on_page(self, pixels: IntArray, owners: IntArray) -> IntArray:
        """Pixels of shapes among those of all pictures."""
        return pixels if self._begins is None else pixels + self._begins[owners]

    def _other(self, shape: Shape, corner: Size, size: Size) -> list[Fragments]:
        density = self.density

        def pixels(point: Point) -> Point:
            return point[0] * density - corner[0], point[1] * density - corner[1]

        match shape:
            case Spline():
                dash = [part * density for part in shape.dash]
                return [coverage.dashed([pixels(p) for p in shape.points], shape.width * density, dash, size)]
            case Rectangle():
                near, extent = pixels(shape.corner), (shape.width * density, shape.height * density)
                radius, width = shape.radius * density, shape.stroke_width * density
                return [
                    coverage.rectangle(near, extent, radius, size),
                    coverage.outline(near, extent, radius, width, size),
                ]
            case Ramp():
                return self._ramp(shape, pixels(shape.corner), size)
            case Image():
                extent = (shape.width * density, shape.height * density)
                where, cells = coverage.cells(pixels(shape.corner), extent, shape.columns, shape.rows, size)
                shades = packed_all(np.frombuffer(shape.pixels, np.uint8).reshape(-1, 3))
                shade = np.unique(shades, return_inverse=True)[1][cells]
                return [Fragments(shade, where, np.ones(len(where), np.float32))]
            case Text():
                y, reach = pixels(shape.point)[1], 3 * shape.size * density
                if not (shape.upward or (y + reach > -2 and y - reach < size[1] + 2)):
                    return []
                halos = (True, False) if shape.halo else (False,)
                return [lettering(shape, size, halo, density, corner) for halo in halos]
            case _:
                return []

    def _ramp(self, shape: Ramp, near: Point, size: Size) -> list[Fragments]:
        """Stripes without seams: each is drawn to the end of the ramp, over the one before."""
        far = near[0] + shape.width * self.density, near[1] + shape.height * self.density
        step = (far[0] - near[0]) / len(shape.colours)
        result = []
        for number in range(len(shape.colours)):
            corner = (round(near[0] + number * step), round(near[1]))
            extent = (round(far[0]) - corner[0], round(far[1]) - corner[1])
            result.append(coverage.rectangle(corner, extent, 0, size))
        return result

    def strokes(self, pieces: Pieces, corner: Size, size: Size, hidden: BoolArray | None) -> Strokes:
        """The solid splines of these pieces, as they run over pixels from a ``corner`` on."""
        if not len(pieces):
            return coverage.NO_STROKES
        pieces = replace(pieces, starts=pieces.starts - corner, ends=pieces.ends - corner)
        found = coverage.strokes(
            pieces, self.halves[pieces.owners].astype(float), self._extent(pieces.owners, size), hidden
        )
        return replace(found, pixels=self._on_page(found.pixels, found.owners))


def _reach(shape: Shape) -> list[tuple[Point, Point]]:
    """Corners of a shape, and how far it may reach beyond each, across and down, in user units."""
    match shape:
        case Text():
            along, aside = _WIDEST * shape.size * (len(shape.text) + len(shape.subscript) + 1), 3 * shape.size
            return [(shape.point, (aside, along) if shape.upward else (along, aside))]
        case Spline():
            return [(point, (shape.width, shape.width)) for point in shape.points]
        case Rectangle() | Ramp() | Image():
            (x, y), edge = shape.corner, shape.stroke_width if isinstance(shape, Rectangle) else 0.0
            return [(corner, (edge, edge)) for corner in (shape.corner, (x + shape.width, y + shape.height))]
        case _:
            raise TypeError(f"no shape that is drawn singly: {shape}")


def _is_straight(points: Sequence[Point]) -> bool:
    """Whether a line runs along an axis."""
    if len(points) != 2:
        return False
    (x0, y0), (x1, y1) = points
    return (x0 == x1) != (y0 == y1)


def _between(places: IntArray, table: FloatArray, low: int, high: int) -> tuple[IntArray, FloatArray]:
    """The rows of shapes ``low`` to ``high``."""
    some = slice(*np.searchsorted(places, (low, high)))
    return places[some], table[some]


def _reaches(rows: FloatArray, reach: FloatArray, size: Extent) -> BoolArray:
    """Which may reach into the picture, from the row that they are in."""
    result: BoolArray = (rows + reach > -2) & (rows - reach < size[1] + 2)
    return result
