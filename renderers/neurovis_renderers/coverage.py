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


@dataclass(frozen=True, slots=True)
class Mask:
    """``pixels``: indices into the picture, row by row; ``share`` of each, 0…1."""

    pixels: IntArray
    share: FloatArray

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
    """The field of a spline for strokes up to ``widest``, with butt caps."""
    dots = flatten(points)
    tangents = np.gradient(dots, axis=0)
    lengths = np.hypot(*tangents.T)[:, None]
    tangents = np.divide(tangents, lengths, out=np.tile([1.0, 0.0], (len(dots), 1)), where=lengths > 1e-12)
    pixels, centres, nearest = _near(dots, widest / 2 + 0.75, size)
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
    wide, high = size
    most = int(np.ceil(reach - 0.5))
    steps = np.arange(-most, most + 1)
    x = np.floor(dots[:, 0]).astype(np.int64)[:, None, None] + steps[None, None, :]
    y = np.floor(dots[:, 1]).astype(np.int64)[:, None, None] + steps[None, :, None]
    distance = (x + 0.5 - dots[:, 0, None, None]) ** 2 + (y + 0.5 - dots[:, 1, None, None]) ** 2
    kept = (x >= 0) & (x < wide) & (y >= 0) & (y < high) & (distance <= reach**2)
    # one number for pixel, distance and dot, so that one sort finds the nearest dot of each pixel
    level = (distance[kept] * ((_LEVELS - 1) / reach**2)).astype(np.int64)
    which = np.broadcast_to(np.arange(len(dots))[:, None, None], kept.shape)[kept]
    keys = np.sort(((y * wide + x)[kept] * _LEVELS + level) * _MOST_DOTS + which)
    owner = keys // (_LEVELS * _MOST_DOTS)
    first = np.ones(len(keys), bool)
    first[1:] = owner[1:] != owner[:-1]
    pixels = owner[first]
    centres: FloatArray = np.stack([pixels % wide + 0.5, pixels // wide + 0.5], axis=1)
    return pixels, centres, keys[first] % _MOST_DOTS


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
    """A small filled polygon, by the even-odd rule, on a grid of ``grid`` by ``grid`` points a pixel."""
    corners = np.asarray(points, float)
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    pixels, x, y = _window(x0, y0, x1, y1, size)
    steps = (np.arange(grid) + 0.5) / grid - 0.5
    dx, dy = (a.ravel() for a in np.meshgrid(steps, steps))
    px, py = x[:, None] + dx, y[:, None] + dy
    inside = np.zeros(px.shape, bool)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if ay != by:
            inside ^= ((ay > py) != (by > py)) & (px < ax + (py - ay) * (bx - ax) / (by - ay))
    return _mask(pixels, inside.mean(axis=1))
