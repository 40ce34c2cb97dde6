"""Raster pictures: a Scene as PNG, GIF or WebP, the same picture as the SVG.

In: a Scene or a Film. Out: the bytes of a file, with the pixels that the scene states. Shapes are drawn by coverage
(``canvas``, ``moving``); Pillow draws texts, quantises and compresses. Films are written frame by frame, and no picture
is kept but the one before: Pillow's own way of writing many pictures holds them all at once.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable, Iterator
from itertools import chain, pairwise
from typing import BinaryIO

import numpy as np
import numpy.typing as npt
from PIL import GifImagePlugin, Image

from neurovis_renderers.canvas import Pixels, paint
from neurovis_renderers.frames import all_frames
from neurovis_renderers.lettering import warn_of_letters
from neurovis_spec.scene import Film, Progress, RendererCapabilities, Scene

#: pixels of all frames of a WebP: its encoder keeps them compressed until the end, some 50 MB for each 2^30
MOST_PIXELS = 1 << 34
#: Colours of a picture of a GIF; one more is for what has not changed.
_COLOURS = 255
#: The longest that a picture of a GIF can last, in milliseconds.
_LONGEST = 655_350


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


def gif(frames: Iterator[Pixels], lasts: Iterable[int], file: BinaryIO) -> None:
    """Write a GIF: the first picture, then of each the rectangle in which it differs from the one before."""
    before, times = next(frames), iter(lasts)
    high, wide = before.shape[:2]
    file.write(b"GIF89a" + struct.pack("<HHBBB", wide, high, 0x70, 0, 0))
    file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")
    changed, corner, picture, waiting = np.ones((high, wide), bool), (0, 0), before, next(times)
    for after, last in zip(frames, times, strict=True):
        differs = (after != before).any(axis=2)
        if not differs.any():  # a picture that stays longer
            waiting += last
            continue
        _write_picture(file, picture, changed, corner, waiting)
        rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
        window = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        changed, corner, picture = differs[window], (int(columns[0]), int(rows[0])), after[window]
        before, waiting = after, last
    _write_picture(file, picture, changed, corner, waiting)
    file.write(b";")


def _write_picture(
    file: BinaryIO, picture: Pixels, changed: npt.NDArray[np.bool_], corner: tuple[int, int], lasts: int
) -> None:
    """A picture with a palette of its own, seen through where nothing has changed."""
    reduced = Image.fromarray(picture).convert("P", palette=Image.Palette.ADAPTIVE, colors=_COLOURS)
    palette = bytes(reduced.getpalette() or ())[: 3 * _COLOURS].ljust(768, b"\0")
    indices = np.where(changed, np.asarray(reduced), np.uint8(_COLOURS))
    for start in range(0, lasts, _LONGEST):
        part = Image.frombytes("P", indices.shape[::-1], indices.tobytes())
        part.putpalette(palette)
        how = {"duration": min(lasts - start, _LONGEST), "transparency": _COLOURS, "disposal": 1}
        file.writelines(GifImagePlugin.getdata(part, corner, include_color_table=True, **how))
        indices = np.full((1, 1), _COLOURS, np.uint8)  # then nothing changes for as long again


def webp(frames: Iterator[Pixels], lasts: Iterable[int], file: BinaryIO) -> None:
    """Write a WebP; its encoder keeps compressed pictures only."""
    durations = list(lasts)
    film = _Film(frames, len(durations))
    film.save(file, "WEBP", save_all=True, duration=durations, loop=0, quality=85, method=2)


class _Film(Image.Image):
    """An image of many pictures, as Pillow's readers give it: each is made when it is sought, in order."""

    def __init__(self, frames: Iterator[Pixels], count: int) -> None:
        super().__init__()
        self._frames, self.n_frames, self._place = frames, count, -1
        self.seek(0)

    def seek(self, frame: int) -> None:
        """Make this picture; going back to the beginning, which Pillow does at the end, changes nothing."""
        if frame != self._place + 1:
            return
        picture = Image.fromarray(next(self._frames))
        self._size, self._mode, self.im = picture.size, picture.mode, picture.im
        self._place = frame

    def tell(self) -> int:
        """Which picture it is."""
        return self._place
