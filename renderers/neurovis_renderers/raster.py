"""Raster pictures: a Scene as PNG, GIF or WebP, the same picture as the SVG.

In: a Scene or a Film. Out: the bytes of a file, with the pixels that the scene states. Shapes are drawn by coverage
(``coverage``), texts and file formats are Pillow's. What does not change from frame to frame is computed once.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from PIL import Image

from neurovis_renderers import coverage
from neurovis_renderers.coverage import Field, FloatArray, Mask, Size
from neurovis_renderers.lettering import lettering
from neurovis_spec.scene import (
    Arrowhead,
    Disc,
    Film,
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

Pixels = npt.NDArray[np.uint8]
#: masks that are remembered
_MOST_KEPT = 20_000
_FORMATS = {".png": "PNG", ".gif": "GIF", ".webp": "WEBP"}


class PillowRenderer:
    """Stills as PNG, GIF and WebP, films as GIF and WebP."""

    name = "pillow"
    capabilities = RendererCapabilities(stills=frozenset({".png", ".gif", ".webp"}), films=frozenset({".gif", ".webp"}))

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """The picture as a file."""
        picture = Image.fromarray(Canvas(scene).paint(scene))
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
        canvas = Canvas(film.scene)
        pictures = []
        for frame in range(film.frames):
            pictures.append(Image.fromarray(canvas.paint(still(film, frame))))
            if progress is not None:
                progress(frame + 1, film.frames)
        buffer = io.BytesIO()
        rest, first = pictures[1:], pictures[0]
        if suffix == ".gif":
            first.save(buffer, "GIF", save_all=True, append_images=rest, duration=lasts, loop=0)
        else:
            first.save(buffer, "WEBP", save_all=True, append_images=rest, duration=lasts, loop=0, quality=85, method=2)
        return buffer.getvalue()


class Canvas:
    """Draws scenes of one size; remembers the masks of shapes it has seen."""

    def __init__(self, scene: Scene) -> None:
        self._size: Size = scene.pixels
        self._density = scene.density
        self._masks: dict[object, Mask] = {}
        self._fields: dict[object, tuple[float, Field]] = {}

    def paint(self, scene: Scene) -> Pixels:
        """The picture, (height, width, 3)."""
        wide, high = self._size
        picture: FloatArray = np.tile(np.array(channels(scene.theme.background), float), (wide * high, 1))
        for group in scene.groups:
            before = picture.copy() if group.opacity < 1 else None
            for shape in group.shapes:
                self._draw(picture, shape)
            if before is not None:  # the group as one: what it has changed, in part
                picture = before + group.opacity * (picture - before)
        return np.rint(picture).astype(np.uint8).reshape(high, wide, 3)

    def _draw(self, picture: FloatArray, shape: Shape) -> None:
        size, density = self._size, self._density
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
            case Text():
                key = (shape.point, shape.text, shape.size, shape.weight, shape.subscript, shape.anchor)
                if shape.halo:
                    around = self._kept((*key, "halo"), lambda: self._lettering(shape, halo=True))
                    around.onto(picture, channels(shape.halo))
                self._kept(key, lambda: self._lettering(shape)).onto(picture, channels(shape.fill))

    def _pixels(self, points: Sequence[Point]) -> list[Point]:
        """User units to pixels."""
        return [(x * self._density, y * self._density) for x, y in points]

    def _lettering(self, text: Text, halo: bool = False) -> Mask:
        (point,) = self._pixels((text.point,))
        return lettering(replace(text, point=point, size=text.size * self._density), self._size, halo)

    def _kept(self, key: object, make: Callable[[], Mask]) -> Mask:
        mask = self._masks.get(key)
        if mask is None:
            if len(self._masks) > _MOST_KEPT:
                self._masks.clear()
            mask = self._masks[key] = make()
        return mask

    def _stroke(self, shape: Spline) -> Mask:
        """Another width of a line costs no geometry, as long as it is not wider than any before."""
        width = shape.width * self._density
        if shape.dash:
            key, dash = (shape.points, width, shape.dash), [part * self._density for part in shape.dash]
            return self._kept(key, lambda: coverage.dashed(self._pixels(shape.points), width, dash, self._size))
        widest, field = self._fields.get(shape.points, (0.0, None))
        if field is None or width > widest:
            widest = width if field is None else 1.5 * width
            field = coverage.stroke_field(self._pixels(shape.points), widest, self._size)
            self._fields[shape.points] = (widest, field)
        return field.mask(width)

    def _ramp(self, picture: FloatArray, shape: Ramp) -> None:
        """Stripes without seams: each is drawn to the end of the ramp, over the one before."""
        near, far = self._pixels((shape.corner, (shape.corner[0] + shape.width, shape.corner[1] + shape.height)))
        step = (far[0] - near[0]) / len(shape.colours)
        for place, colour in enumerate(shape.colours):
            corner = (round(near[0] + place * step), round(near[1]))
            extent = (round(far[0]) - corner[0], round(far[1]) - corner[1])
            coverage.rectangle(corner, extent, 0, self._size).onto(picture, channels(colour))
