"""Raster pictures: a Scene as PNG, GIF or WebP, the same picture as the SVG.

In: a Scene or a Film. Out: the bytes of a file, with the pixels that the scene states. Shapes are drawn by coverage
(``coverage``), texts and file formats are Pillow's. What does not change from frame to frame is computed once, as far
as it is small; a big picture is painted in bands, and a film frame by frame, so that memory stays bounded.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Generic, TypeVar

import numpy as np
from PIL import Image as Pillow

from neurovis_renderers import coverage
from neurovis_renderers.coverage import Field, FloatArray, IntArray, Mask, Size
from neurovis_renderers.films import Pixels, gif, webp
from neurovis_renderers.lettering import lettering
from neurovis_spec.scene import (
    Arrowhead,
    Disc,
    Film,
    Image,
    Point,
    Progress,
    Ramp,
    Rectangle,
    RendererCapabilities,
    Scene,
    Shape,
    Spline,
    Text,
    channels,
    still,
)

#: bytes of masks and of fields that are remembered
_MOST_KEPT = 1 << 27
#: pixels that are painted at a time: a picture that has more is painted in bands, one after the other
_MOST_AT_ONCE = 1 << 21
#: pixels of all frames of a film: compressed they are kept until the end, some 50 MB for each 2^30
MOST_PIXELS = 1 << 34
_FORMATS = {".png": "PNG", ".gif": "GIF", ".webp": "WEBP"}


class PillowRenderer:
    """Stills as PNG, GIF and WebP, films as GIF and WebP."""

    name = "pillow"
    capabilities = RendererCapabilities(
        stills=frozenset({".png", ".gif", ".webp"}), films=frozenset({".gif", ".webp"}), pixels=MOST_PIXELS
    )

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """The picture as a file."""
        picture = Pillow.fromarray(Canvas(scene).paint(scene))
        buffer = io.BytesIO()
        if suffix == ".webp":
            picture.save(buffer, "WEBP", lossless=True)
        else:
            picture.save(buffer, _FORMATS[suffix])
        return buffer.getvalue()

    def animate(self, film: Film, suffix: str, progress: Progress | None = None) -> bytes:
        """The film as a file that starts over at its end. A frame lasts whole milliseconds, in a GIF hundredths of a
        second and at least two, kept in step with the film by rounding the times of the frames."""
        unit = 10 if suffix == ".gif" else 1
        times = [round(1000 * frame / film.fps / unit) * unit for frame in range(film.frames + 1)]
        lasts = [max(end - start, 2 * unit) for start, end in pairwise(times)]
        frames = _frames(film, progress)
        return gif(frames, lasts) if suffix == ".gif" else webp(frames, lasts)


def _frames(film: Film, progress: Progress | None) -> Iterator[Pixels]:
    """The pictures of a film, each made when it is asked for."""
    canvas = Canvas(film.scene)
    for frame in range(film.frames):
        picture = canvas.paint(still(film, frame))
        if progress is not None:
            progress(frame + 1, film.frames)
        yield picture


class Canvas:
    """Draws scenes of one size; remembers the masks of shapes it has seen."""

    def __init__(self, scene: Scene) -> None:
        wide, high = self._size = scene.pixels
        rows = max(1, _MOST_AT_ONCE // wide)
        self._bands = [_Band(scene.density, (wide, min(rows, high - top)), top) for top in range(0, high, rows)]

    def paint(self, scene: Scene) -> Pixels:
        """The picture, (height, width, 3)."""
        if len(self._bands) == 1:
            return self._bands[0].paint(scene)
        picture = np.empty((self._size[1], self._size[0], 3), np.uint8)
        for band in self._bands:
            picture[band.top : band.top + band.size[1]] = band.paint(scene)
            band.forget()
        return picture


class _Band:
    """Some rows of a picture, from row ``top`` on: what it takes of memory does not grow with the picture."""

    def __init__(self, density: float, size: Size, top: int) -> None:
        self.size, self.top = size, top
        self._density = density
        self._masks = _Memory[Mask]()
        self._fields = _Memory[tuple[float, Field]]()

    def forget(self) -> None:
        """Give back the memory of what was seen."""
        self._masks.clear()
        self._fields.clear()

    def paint(self, scene: Scene) -> Pixels:
        """The rows, (height, width, 3)."""
        wide, high = self.size
        picture: FloatArray = np.tile(np.array(channels(scene.theme.background), float), (wide * high, 1))
        for group in scene.groups:
            before = picture.copy() if group.opacity < 1 else None
            for shape in group.shapes:
                if self._touches(shape):
                    self._draw(picture, shape)
            if before is not None:  # the group as one: what it has changed, in part
                picture = before + group.opacity * (picture - before)
        return np.rint(picture, out=picture).astype(np.uint8).reshape(high, wide, 3)

    def _touches(self, shape: Shape) -> bool:
        """Whether a shape may reach into these rows; most of those that are far above or below do not."""
        match shape:
            case Spline():
                rows, reach = [y for _, y in shape.points], shape.width
            case Arrowhead():
                rows, reach = [y for _, y in shape.points], 0.0
            case Disc():
                rows, reach = [shape.centre[1]], shape.radius + shape.stroke_width
            case Text():
                rows, reach = [shape.point[1]], 3 * shape.size
            case _:
                return True
        low, high = (min(rows) - reach) * self._density, (max(rows) + reach) * self._density
        return high > self.top - 2 and low < self.top + self.size[1] + 2

    def _draw(self, picture: FloatArray, shape: Shape) -> None:
        size, density = self.size, self._density
        match shape:
            case Spline():
                self._stroke(shape).onto(picture, channels(shape.stroke), shape.opacity)
            case Arrowhead():
                mask = self._kept(shape.points, lambda: coverage.polygon(self._pixels(shape.points), size))
                mask.onto(picture, channels(shape.fill))
            case Disc():
                (centre,), radius = self._pixels((shape.centre,)), shape.radius * density
                mask = self._kept(("disc", centre, radius), lambda: coverage.disc(centre, radius, size))
                mask.onto(picture, channels(shape.fill))
                width = shape.stroke_width * density
                rim = self._kept(("ring", centre, radius), lambda: coverage.ring(centre, radius, width, size))
                rim.onto(picture, channels(shape.stroke))
            case Rectangle():
                (corner,), extent = self._pixels((shape.corner,)), (shape.width * density, shape.height * density)
                radius = shape.radius * density
                coverage.rectangle(corner, extent, radius, size).onto(picture, channels(shape.fill))
                edge = coverage.outline(corner, extent, radius, shape.stroke_width * density, size)
                edge.onto(picture, channels(shape.stroke))
            case Ramp():
                self._ramp(picture, shape)
            case Image():
                self._image(picture, shape)
            case Text():
                key = (shape.point, shape.text, shape.size, shape.weight, shape.subscript, shape.anchor)
                if shape.halo:
                    around = self._kept((*key, "halo"), lambda: self._lettering(shape, halo=True))
                    around.onto(picture, channels(shape.halo))
                self._kept(key, lambda: self._lettering(shape)).onto(picture, channels(shape.fill))

    def _pixels(self, points: Sequence[Point]) -> list[Point]:
        """User units to pixels of the band."""
        return [(x * self._density, y * self._density - self.top) for x, y in points]

    def _lettering(self, text: Text, halo: bool = False) -> Mask:
        (point,) = self._pixels((text.point,))
        return lettering(replace(text, point=point, size=text.size * self._density), self.size, halo)

    def _kept(self, key: object, make: Callable[[], Mask]) -> Mask:
        mask = self._masks.get(key)
        if mask is None:
            mask = make()
            self._masks.put(key, mask, mask.nbytes)
        return mask

    def _stroke(self, shape: Spline) -> Mask:
        """Another width of a line costs no geometry, as long as it is not wider than any before."""
        width = shape.width * self._density
        if shape.dash:
            key, dash = (shape.points, width, shape.dash), [part * self._density for part in shape.dash]
            return self._kept(key, lambda: coverage.dashed(self._pixels(shape.points), width, dash, self.size))
        if width > coverage.WIDE:
            return coverage.stroke_field(self._pixels(shape.points), width, self.size).mask(width)
        widest, field = self._fields.get(shape.points) or (0.0, None)
        if field is None or width > widest:
            widest = width if field is None else min(1.5 * width, coverage.WIDE)
            field = coverage.stroke_field(self._pixels(shape.points), widest, self.size)
            self._fields.put(shape.points, (widest, field), field.nbytes)
        return field.mask(width)

    def _ramp(self, picture: FloatArray, shape: Ramp) -> None:
        """Stripes without seams: each is drawn to the end of the ramp, over the one before."""
        near, far = self._pixels((shape.corner, (shape.corner[0] + shape.width, shape.corner[1] + shape.height)))
        step = (far[0] - near[0]) / len(shape.colours)
        for place, colour in enumerate(shape.colours):
            corner = (round(near[0] + place * step), round(near[1]))
            extent = (round(far[0]) - corner[0], round(far[1]) - corner[1])
            coverage.rectangle(corner, extent, 0, self.size).onto(picture, channels(colour))

    def _image(self, picture: FloatArray, shape: Image) -> None:
        """Each pixel has the colour of the cell in which its centre lies."""
        near, far = self._pixels((shape.corner, (shape.corner[0] + shape.width, shape.corner[1] + shape.height)))
        columns, x = _cells(near[0], far[0], shape.columns, self.size[0])
        rows, y = _cells(near[1], far[1], shape.rows, self.size[1])
        cells = np.frombuffer(shape.pixels, np.uint8).reshape(shape.rows, shape.columns, 3)
        picture.reshape(self.size[1], self.size[0], 3)[y, x] = cells[rows[:, None], columns[None, :]]


def _cells(near: float, far: float, count: int, end: int) -> tuple[IntArray, slice]:
    """Of ``count`` cells from ``near`` to ``far`` the one at each pixel of a side of ``end`` pixels, and which these
    pixels are."""
    first, last = max(0, round(near)), min(end, round(far))
    centres = np.arange(first, last) + 0.5
    which = np.floor((centres - near) / max(far - near, 1e-9) * count).astype(np.int64)
    return np.clip(which, 0, count - 1), slice(first, max(first, last))


Kept = TypeVar("Kept")


class _Memory(Generic[Kept]):
    """What was made, by key, as far as it fits into ``_MOST_KEPT`` bytes; what was put in first goes first."""

    def __init__(self) -> None:
        self._kept: dict[object, tuple[Kept, int]] = {}
        self._bytes = 0

    def get(self, key: object) -> Kept | None:
        found = self._kept.get(key)
        return None if found is None else found[0]

    def put(self, key: object, value: Kept, size: int) -> None:
        self._bytes += size - self._kept.pop(key, (value, 0))[1]
        self._kept[key] = value, size
        while self._bytes > _MOST_KEPT:
            first = next(iter(self._kept))
            self._bytes -= self._kept.pop(first)[1]

    def clear(self) -> None:
        self._kept.clear()
        self._bytes = 0
