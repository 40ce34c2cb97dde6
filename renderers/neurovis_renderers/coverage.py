"""Coverage: how much of each pixel a shape covers, computed from distances rather than by supersampling.

In: discs, strokes, polygons and rectangles in pixels. Out: a Mask: the pixels that a shape touches and the share of
each that it covers. A Field keeps the distances of a stroke's pixels, so that another width costs no geometry.
NumPy alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
Point = tuple[float, float]
Size = tuple[int, int]  # width, height

#: Powers of two, so that a pixel (up to 2^28 of them), a distance and a dot fit into 62 bits.
_LEVELS, _MOST_DOTS = 1 << 16, 1 << 18
#: Pairs of a pixel and a dot that are compared at once: they take some 16 MB.
_MOST_PAIRS = 1 << 18
#: A stroke wider than this (in pixels) is drawn from dots that are further apart; the same as how far it reaches.
WIDE = 62.5
_FAR = WIDE / 2 + 0.75


@dataclass(frozen=True, slots=True)
class Mask:
    """``pixels``: indices into the picture, row by row; ``share`` of each, 0…1."""

    pixels: IntArray
    share: FloatArray

    @property
    def nbytes(self) -> int:
        """What it takes of memory."""
        return self.pixels.nbytes + self.share.nbytes

    def onto(self, picture: FloatArray, colour: tuple[int, int, int], opacity: float = 1.0) -> None:
        """Blend a colour over a picture (height · width, 3), in sRGB as browsers do."""
        behind = picture[self.pixels]
        picture[self.pixels] = behind + (self.share * opacity)[:, None] * (np.array(colour, float) - behind)


@dataclass(frozen=True, slots=True)
class Field:
    """The pixels near a curve: how far each is to its side, and what share of it lies before the curve's ends."""

    pixels: IntArray
    across: FloatArray
    ends: FloatArray

    @property
    def nbytes(self) -> int:
        """What it takes of memory."""
        return self.pixels.nbytes + self.across.nbytes + self.ends.nbytes

    def mask(self, width: float) -> Mask:
        """The stroke of this width."""
        half = width / 2
        share = np.minimum(half, self.across + 0.5) - np.maximum(-half, self.across - 0.5)
        share = np.clip(share, 0.0, 1.0) * self.ends
        touched = share > 1e-3
        return Mask(self.pixels[touched], share[touched])


def flatten(points: Sequence[Point], spacing: float = 1.0) -> FloatArray:
    """A cubic spline as points that are about ``spacing`` apart along it, both ends included."""
    control = np.asarray(points, float)
    coarse = [control[:1]]
    for start in range(0, len(control) - 1, 3):
        p = control[start : start + 4]
        steps = max(8, int(np.abs(np.diff(p, axis=0)).sum() / 2))
        t = (np.arange(1, steps + 1) / steps)[:, None]
        s = 1 - t
        coarse.append(s**3 * p[0] + 3 * s * s * t * p[1] + 3 * s * t * t * p[2] + t**3 * p[3])
    dots = np.concatenate(coarse)
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(dots, axis=0).T))])
    count = min(max(2, int(np.ceil(lengths[-1] / spacing)) + 1), _MOST_DOTS)
    at = np.linspace(0.0, lengths[-1], count)
    return np.stack([np.interp(at, lengths, dots[:, 0]), np.interp(at, lengths, dots[:, 1])], axis=1)


def stroke_field(points: Sequence[Point], widest: float, size: Size) -> Field:
    """The field of a spline for strokes up to ``widest``, with butt caps.

    Where the stroke is wide, so are the steps along the curve: at a dot the curve is taken for straight, and a bend as
    narrow as its stroke is wide cannot be seen beneath it.
    """
    reach = widest / 2 + 0.75
    dots = flatten(points)
    tangents = np.gradient(dots, axis=0)
    lengths = np.hypot(*tangents.T)[:, None]
    tangents = np.divide(tangents, lengths, out=np.tile([1.0, 0.0], (len(dots), 1)), where=lengths > 1e-12)
    if reach > _FAR:
        some = (
            np.linspace(0, len(dots) - 1, min(len(dots), max(2, int(2 * len(dots) * _FAR / reach))))
            .round()
            .astype(np.int64)
        )
        dots, tangents = dots[some], tangents[some]
    pixels, centres, nearest = _near(dots, reach, size)
    away = centres - dots[nearest]
    along = (away * tangents[nearest]).sum(axis=1)
    across = np.abs(away[:, 0] * tangents[nearest, 1] - away[:, 1] * tangents[nearest, 0])
    beyond = np.where(nearest == 0, -along, np.where(nearest == len(dots) - 1, along, -1.0))
    return Field(pixels, across, np.clip(0.5 - beyond, 0.0, 1.0))


def dashed(points: Sequence[Point], width: float, dash: Sequence[float], size: Size) -> Mask:
    """A dashed stroke with round caps."""
    spacing = 0.25
    dots = flatten(points, spacing)
    at = np.arange(len(dots)) * spacing
    period, on = sum(dash), dash[0]
    place = np.mod(at, period)
    drawn = dots[(place <= on) | (place < spacing / 2) | (place > period - spacing / 2)]
    pixels, centres, nearest = _near(drawn, width / 2 + 0.75, size)
    share = np.clip(width / 2 + 0.5 - np.hypot(*(centres - drawn[nearest]).T), 0.0, 1.0)
    return Mask(pixels, share)


def _near(dots: FloatArray, reach: float, size: Size) -> tuple[IntArray, FloatArray, IntArray]:
    """The pixels within ``reach`` of dots: their indices, their centres, and the dot that is nearest to each."""
    pixels, nearest = (_near_far if reach > _FAR else _near_close)(dots, reach, size)
    centres: FloatArray = np.stack([pixels % size[0] + 0.5, pixels // size[0] + 0.5], axis=1)
    return pixels, centres, nearest


def _near_close(dots: FloatArray, reach: float, size: Size) -> tuple[IntArray, IntArray]:
    """``_near`` by all pairs of a dot and a pixel in the square around it, so many at a time."""
    wide, high = size
    most = int(np.ceil(reach - 0.5))
    steps = np.arange(-most, most + 1)
    together = max(1, _MOST_PAIRS // len(steps) ** 2)
    found = [np.empty(0, np.int64)]
    for start in range(0, len(dots), together):
        some = dots[start : start + together]
        x = np.floor(some[:, 0]).astype(np.int64)[:, None, None] + steps[None, None, :]
        y = np.floor(some[:, 1]).astype(np.int64)[:, None, None] + steps[None, :, None]
        distance = (x + 0.5 - some[:, 0, None, None]) ** 2 + (y + 0.5 - some[:, 1, None, None]) ** 2
        kept = (x >= 0) & (x < wide) & (y >= 0) & (y < high) & (distance <= reach**2)
        # one number for pixel, distance and dot, so that one sort finds the nearest dot of each pixel
        level = (distance[kept] * ((_LEVELS - 1) / reach**2)).astype(np.int64)
        which = np.broadcast_to(np.arange(start, start + len(some))[:, None, None], kept.shape)[kept]
        found.append(_least(((y * wide + x)[kept] * _LEVELS + level) * _MOST_DOTS + which))
    keys = _least(np.concatenate(found))
    return keys // (_LEVELS * _MOST_DOTS), keys % _MOST_DOTS


def _least(keys: IntArray) -> IntArray:
    """The least key of each pixel, by pixel."""
    keys = np.sort(keys)
    owner = keys // (_LEVELS * _MOST_DOTS)
    first = np.ones(len(keys), bool)
    first[1:] = owner[1:] != owner[:-1]
    return keys[first]


def _near_far(dots: FloatArray, reach: float, size: Size) -> tuple[IntArray, IntArray]:
    """``_near`` dot by dot, for a reach that covers much of the picture: memory for its pixels, not for pairs."""
    wide, high = size
    best, which = np.full((high, wide), reach**2), np.full((high, wide), -1, np.int32)
    for number, (x, y) in enumerate(dots.tolist()):
        rows, columns = _span(y, reach, high), _span(x, reach, wide)
        across, down = np.arange(wide)[columns] + 0.5 - x, np.arange(high)[rows] + 0.5 - y
        distance = across[None, :] ** 2 + down[:, None] ** 2
        closer = distance < best[rows, columns]
        best[rows, columns][closer] = distance[closer]
        which[rows, columns][closer] = number
    pixels = np.flatnonzero(which >= 0)
    return pixels, which.reshape(-1)[pixels].astype(np.int64)


def _span(centre: float, reach: float, end: int) -> slice:
    """The pixels of a side of ``end`` pixels that lie within ``reach`` of a place."""
    return slice(max(0, int(centre - reach)), max(0, min(end, int(centre + reach) + 1)))


def _window(x0: float, y0: float, x1: float, y1: float, size: Size) -> tuple[IntArray, FloatArray, FloatArray]:
    """The pixels of a rectangle: indices and the coordinates of their centres."""
    xs = np.arange(max(0, int(np.floor(x0)) - 1), min(size[0], int(np.ceil(x1)) + 2))
    ys = np.arange(max(0, int(np.floor(y0)) - 1), min(size[1], int(np.ceil(y1)) + 2))
    x, y = np.meshgrid(xs, ys)
    pixels: IntArray = np.asarray(y * size[0] + x, np.int64).ravel()
    return pixels, x.ravel().astype(float) + 0.5, y.ravel().astype(float) + 0.5


def _mask(pixels: IntArray, share: FloatArray) -> Mask:
    touched = share > 1e-3
    return Mask(pixels[touched], share[touched])


def disc(centre: Point, radius: float, size: Size) -> Mask:
    """A filled circle."""
    pixels, x, y = _window(centre[0] - radius, centre[1] - radius, centre[0] + radius, centre[1] + radius, size)
    return _mask(pixels, np.clip(radius + 0.5 - np.hypot(x - centre[0], y - centre[1]), 0.0, 1.0))


def ring(centre: Point, radius: float, width: float, size: Size) -> Mask:
    """A circle's outline."""
    outer = radius + width / 2
    pixels, x, y = _window(centre[0] - outer, centre[1] - outer, centre[0] + outer, centre[1] + outer, size)
    away = np.abs(np.hypot(x - centre[0], y - centre[1]) - radius)
    return _mask(pixels, _band(away, width))


def _band(away: FloatArray, width: float) -> FloatArray:
    share: FloatArray = np.clip(np.minimum(width / 2, away + 0.5) - np.maximum(-width / 2, away - 0.5), 0.0, 1.0)
    return share


def _beyond_rounded(
    corner: Point, extent: Point, radius: float, reach: float, size: Size
) -> tuple[IntArray, FloatArray]:
    """Signed distances to a rectangle with round corners, negative inside."""
    (x0, y0), (wide, high) = corner, extent
    pixels, x, y = _window(x0 - reach, y0 - reach, x0 + wide + reach, y0 + high + reach, size)
    radius = min(radius, wide / 2, high / 2)
    over_x = np.abs(x - x0 - wide / 2) - wide / 2 + radius
    over_y = np.abs(y - y0 - high / 2) - high / 2 + radius
    outside = np.hypot(np.maximum(over_x, 0), np.maximum(over_y, 0))
    return pixels, outside + np.minimum(np.maximum(over_x, over_y), 0) - radius


def rectangle(corner: Point, extent: Point, radius: float, size: Size) -> Mask:
    """A filled rectangle with round corners."""
    pixels, away = _beyond_rounded(corner, extent, radius, 1, size)
    return _mask(pixels, np.clip(0.5 - away, 0.0, 1.0))


def outline(corner: Point, extent: Point, radius: float, width: float, size: Size) -> Mask:
    """The outline of a rectangle with round corners."""
    pixels, away = _beyond_rounded(corner, extent, radius, 1 + width, size)
    return _mask(pixels, _band(np.abs(away), width))


def polygon(points: Sequence[Point], size: Size, grid: int = 8) -> Mask:
    """A filled polygon, by the even-odd rule, where its edges run on a grid of ``grid`` by ``grid`` points a pixel."""
    corners = np.asarray(points, float)
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    pixels, x, y = _window(x0, y0, x1, y1, size)
    share = _inside(corners, x, y).astype(float)
    steps = (np.arange(grid) + 0.5) / grid - 0.5
    dx, dy = (a.ravel() for a in np.meshgrid(steps, steps))
    edge = np.flatnonzero(_at_an_edge(corners, x, y))
    together = max(1, _MOST_PAIRS // grid**2)
    for start in range(0, len(edge), together):
        some = edge[start : start + together]
        share[some] = _inside(corners, x[some, None] + dx, y[some, None] + dy).mean(axis=1)
    return _mask(pixels, share)


def _inside(corners: FloatArray, x: FloatArray, y: FloatArray) -> npt.NDArray[np.bool_]:
    """Which points lie within a polygon."""
    inside = np.zeros(x.shape, bool)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if ay != by:
            inside ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) * (bx - ax) / (by - ay))
    return inside


def _at_an_edge(corners: FloatArray, x: FloatArray, y: FloatArray) -> npt.NDArray[np.bool_]:
    """Which pixels, by their centres, an edge of a polygon may run through."""
    found = np.zeros(x.shape, bool)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        dx, dy = bx - ax, by - ay
        along = np.clip(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy or 1.0), 0.0, 1.0)
        found |= (x - ax - along * dx) ** 2 + (y - ay - along * dy) ** 2 < 0.75**2
    return found
