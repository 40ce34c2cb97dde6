"""Raster pictures: a Scene as PNG, GIF or WebP, the same picture as the SVG.

In: a Scene or a Film. Out: the bytes of a file, with the pixels that the scene states. Shapes are drawn by coverage
(``canvas``, ``moving``), texts and file formats are Pillow's.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from itertools import chain, pairwise
from typing import BinaryIO

from PIL import Image

from neurovis_renderers.canvas import paint
from neurovis_renderers.films import gif, webp
from neurovis_renderers.frames import all_frames
from neurovis_renderers.lettering import warn_of_letters
from neurovis_spec.scene import Film, Progress, RendererCapabilities, Scene

#: pixels of all frames of a WebP: its encoder keeps them compressed until the end, some 50 MB for each 2^30
MOST_PIXELS = 1 << 34


class PillowRenderer:
    """Stills as PNG, GIF and WebP, films as GIF and WebP."""

    name = "pillow"
    capabilities = RendererCapabilities(
        stills=frozenset({".png", ".gif", ".webp"}),
        films=frozenset({".gif", ".webp"}),
        streams=frozenset({".gif", ".webp"}),
        pixels={".webp": MOST_PIXELS},
    )

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """The picture as a file."""
        warn_of_letters(scene)
        picture = Image.fromarray(paint(scene))
        buffer = io.BytesIO()
        if suffix == ".webp":
            picture.save(buffer, "WEBP", lossless=True)
        elif suffix == ".png":
            dots = 96 * scene.density  # a user unit is a pixel of CSS, 96 of which are an inch
            picture.save(buffer, "PNG", dpi=(dots, dots))
        else:
            picture.save(buffer, "GIF")
        return buffer.getvalue()

    def animate(self, film: Film, suffix: str, progress: Progress | None = None) -> bytes:
        """The film as the content of a file."""
        buffer = io.BytesIO()
        self.stream(iter([film]), film.frames, suffix, buffer, progress)
        return buffer.getvalue()

    def stream(
        self, films: Iterator[Film], frames: int, suffix: str, file: BinaryIO, progress: Progress | None = None
    ) -> None:
        """Write a film that comes in parts, which starts over at its end. A frame lasts whole milliseconds, in a GIF
        hundredths of a second and at least two, kept in step with the film by rounding the times of the frames."""
        first = next(films)
        unit = 10 if suffix == ".gif" else 1
        times = (round(1000 * frame / first.fps / unit) * unit for frame in range(frames + 1))
        lasts = (max(end - start, 2 * unit) for start, end in pairwise(times))
        pictures = all_frames(chain([first], films), frames, progress)
        (gif if suffix == ".gif" else webp)(pictures, lasts, file)
