"""A sheet: the shapes of a scene as arrays in pixels, from which fragments are made for any part of its order.

In: groups of a Scene. Out: for shapes ``low`` to ``high`` of their order from back to front the fragments. A shape of
a scene may have several places in the order: a disc has one for its filling and one for its ring. So of a group that
holds a line, a disc and a text the line is at 0, the filling at 1, the ring at 2, the text at 3.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from itertools import chain

import numpy as np
import numpy.typing as npt

from neurovis_renderers import coverage
from neurovis_renderers.coverage import BoolArray, Fragments, Heads, Numbers, Pieces, Size, Strokes
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
#: No letter is wider, in sizes of its text.
_WIDEST = 2.0


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


class Sheet:
    """The shapes of groups, each with its place in the order (0 is the furthest back), its colour and its opacity."""

    def __init__(self, groups: Sequence[Group], density: float, left_out: Collection[str] = ()) -> None:
        """Groups whose id is in ``left_out`` have their places, but nothing is drawn there."""
        self.density = density
        self.colours: list[int] = []
        #: where each shape of a group begins in the order: ``places[group][shape]``
        self.places: list[list[int]] = []
        #: where each group begins in the order
        self.firsts: list[int] = []
        #: of shapes on several pictures the first pixel of that of each, and where that lies on the sheet, by its place
        self._begins: IntArray | None = None
        self._corners: IntArray = np.empty((0, 2), np.int64)
        #: groups with an opacity of their own: first and last place, opacity
        self.veiled: list[tuple[int, int, float]] = []
        self._splines: list[tuple[int, Spline]] = []
        self._heads: list[tuple[int, Arrowhead]] = []
        self._discs: list[tuple[int, Disc]] = []
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

    def on_pages(self, page_of: IntArray, corners: IntArray, size: Size) -> Sheet:
        """The same with shapes on pictures of one size, one after the other: which each is on, by its place, and which
        pixel of the sheet is the first of each picture, (pictures, 2)."""
        result = copy(self)
        shifts = corners[page_of]
        moved = {}
        for name in ("_head_arrays", "_disc_arrays"):
            places, table = getattr(self, name)
            moved[name] = places, np.concatenate([table[:, :2] - shifts[places], table[:, 2:]], axis=1)
        places, outlines = self._polygon_arrays
        moved["_polygon_arrays"] = places, outlines - shifts[places][:, None]
        by = shifts[self.pieces.owners]
        pieces = replace(self.pieces, starts=self.pieces.starts - by, ends=self.pieces.ends - by)
        result.__dict__.update(moved, pieces=pieces, _corners=shifts, _begins=page_of * (size[0] * size[1]))
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
        tips = table[:, :2] - corner
        near = _reaches(tips[:, 1], table[:, 4] + table[:, 5], size)
        found = coverage.heads(tips[near], table[near, 2:4], table[near, 4], table[near, 5], size)
        owners = places[near][found.owners]
        return replace(found, owners=owners, pixels=self._on_page(found.pixels, owners))

    def solid(self, low: int, high: int, corner: Size, size: Size) -> Fragments:
        """The fragments of all but solid splines and heads, of shapes ``low`` to ``high``, in pixels from a ``corner``
        on."""
        found = []
        places, table = _between(*self._disc_arrays, low - 1, high)
        if len(places):
            near = _reaches(table[:, 1] - corner[1], table[:, 2] + table[:, 3], size)
            places, centres, radii, widths = places[near], table[near, :2] - corner, table[near, 2], table[near, 3]
            found.append(self._owned(coverage.discs(centres, radii, size), places))
            found.append(self._owned(coverage.rings(centres, radii, widths, size), places + 1))
        places, corners = _between(*self._polygon_arrays, low, high)
        if len(places):
            begins = None if self._begins is None else self._begins[places]
            some = coverage.polygons(corners - corner, size, begins)
            found.append(replace(some, owners=places[some.owners]))
        for place, end, shape in self._others:
            if place < high and end > low:
                parts = self._other(shape, self._corner_of(place, corner), size)
                found += [self._owned(part, np.arange(place + number, end)) for number, part in enumerate(parts)]
        made = coverage.joined(found, coverage.NOTHING)
        return made.only((made.owners >= low) & (made.owners < high)) if low or high < len(self) else made

    def most(self, size: Size) -> float:
        """How many fragments there may be in a picture of a size, at most, about."""
        texts = [shape for _, _, shape in self._others if isinstance(shape, Text)]
        whole = len(self._others) - len(texts) + 2 * bool(self._polygons)
        letters = sum(6 * shape.size**2 * (len(shape.text) + len(shape.subscript) + 2) for shape in texts)
        discs, heads = self._disc_arrays[1], self._head_arrays[1]
        round_ = 8 * ((discs[:, 2] + discs[:, 3] + 1) ** 2).sum() + 4 * (heads[:, 4:].sum(axis=1) ** 2).sum()
        length = np.hypot(*(self.pieces.ends - self.pieces.starts).T)
        halves = self.halves[self.pieces.owners] + 2
        lines = (np.minimum(length + 2 * halves, sum(size)) * 3 * halves).sum()
        return whole * size[0] * size[1] + letters * self.density**2 + float(round_ + lines)

    def extents(self, page_of: IntArray, pages: int) -> tuple[FloatArray, FloatArray]:
        """The least and the greatest place at which anything may be seen of the shapes of each page, by the page that
        each is on (by its place); (pages, 2) each, in pixels."""
        low, high = np.full((pages, 2), np.inf), np.full((pages, 2), -np.inf)

        def reach(places: IntArray, least: FloatArray, most: FloatArray) -> None:
            np.minimum.at(low, page_of[places], least)
            np.maximum.at(high, page_of[places], most)

        if self._polygons:
            places, corners = self._polygon_arrays
            reach(places, corners.min(axis=1), corners.max(axis=1))
        for places, table, beyond in (
            (*self._disc_arrays, self._disc_arrays[1][:, 2:4]),
            (*self._head_arrays, self._head_arrays[1][:, 4:6]),
        ):
            around = beyond.sum(axis=1)[:, None]
            reach(places, table[:, :2] - around, table[:, :2] + around)
        if self._splines:
            halves = self.halves[self.pieces.owners].astype(float)
            reach(self.pieces.owners, *coverage.extent(self.pieces, halves))
        others = [(place, *corner) for place, _, shape in self._others for corner in _reach(shape)]
        if others:
            corners, around = (np.array([each[part] for each in others]) * self.density for part in (1, 2))
            reach(np.array([place for place, _, _ in others]), corners - around, corners + around)
        return low, high

    def _corner_of(self, place: int, corner: Size) -> Size:
        """The first pixel of the picture that a shape is on."""
        if self._begins is None:
            return corner
        x, y = self._corners[place].tolist()
        return x + corner[0], y + corner[1]

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
                text = replace(shape, point=pixels(shape.point), size=shape.size * density)
                if not (text.upward or _reaches(np.array([text.point[1]]), np.array([3 * text.size]), size).any()):
                    return []
                return [lettering(text, size, halo=halo) for halo in (True, False) if shape.halo or not halo]
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
        found = coverage.strokes(pieces, self.halves[pieces.owners].astype(float), size, hidden)
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


def _between(places: IntArray, table: FloatArray, low: int, high: int) -> tuple[IntArray, FloatArray]:
    """The rows of shapes ``low`` to ``high``."""
    some = slice(*np.searchsorted(places, (low, high)))
    return places[some], table[some]


def _reaches(rows: FloatArray, reach: FloatArray, size: Size) -> BoolArray:
    """Which may reach into the picture, from the row that they are in."""
    result: BoolArray = (rows + reach > -2) & (rows - reach < size[1] + 2)
    return result
