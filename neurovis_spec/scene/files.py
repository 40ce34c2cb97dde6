"""A Film as the content of a file: bounded in size, with a warning for all that it leaves out.

In: what makes a Film in any settings, a Look. Out: bytes; of an SVG with so many connections as make it no larger than
5 MB.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final, TypeAlias

from neurovis_spec.arguments import callers_level
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.progress import Progress
from neurovis_spec.scene.film import still
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.model import Film, Renderer, Scene
from neurovis_spec.scene.renderers import RendererError, drawing
from neurovis_spec.scene.shown import LeftOut

#: A picture, in whatever settings.
Filmed: TypeAlias = Callable[[RenderSettings], Film]

#: The largest SVG, in bytes, with as many connections as there are.
_LARGEST_SVG = 5_000_000
#: How wide a picture is in a notebook at most, in pixels: JupyterLab cuts off what is wider than its column.
_CELL = 900.0
#: Pixels of an inch where a user unit is one pixel, and the most that are drawn of a picture.
CSS: Final = 96.0
_MOST_PIXELS = 1 << 28


def content_of(film: Filmed, look: Look, renderer: Renderer, progress: Progress | None = None) -> bytes:
    """A picture as the content of its file. Raises RendererError for one that is too large."""

    def draws(settings: RenderSettings) -> tuple[Scene, bytes]:
        made = film(settings)
        if look.moving:
            return made.scene, renderer.animate(made, look.suffix, progress)
        scene = still(made, 0)
        return scene, renderer.draw(scene if look.density is None else _denser(scene, look.density), look.suffix)

    return _bounded(draws, look.settings, look.suffix)


def notebook_svg(film: Filmed, settings: RenderSettings) -> str:
    """A picture of one step for a notebook: a pixel a unit, but no wider than a cell."""

    def draws(settings: RenderSettings) -> tuple[Scene, bytes]:
        scene = still(film(settings), 0)
        return scene, drawing(replace(scene, density=min(1.0, _CELL / scene.width)), ".svg")

    return _bounded(draws, settings, ".svg").decode()


def noting(films: Iterator[Film]) -> Iterator[Film]:
    """The parts of a film; of the first one the notes are warned of."""
    for place, film in enumerate(films):
        if place == 0:
            _note(film.scene)
        yield film


def _denser(scene: Scene, density: float) -> Scene:
    scene = replace(scene, density=density)
    wide, high = scene.pixels
    if wide * high > _MOST_PIXELS:
        most = int(CSS * math.sqrt(_MOST_PIXELS / (scene.width * scene.height)))
        raise RendererError(f"a picture of {wide:,} × {high:,} pixels is too large", f"take at most {most} an inch")
    return scene


def _bounded(draws: Callable[[RenderSettings], tuple[Scene, bytes]], settings: RenderSettings, suffix: str) -> bytes:
    """The file of a picture, an SVG with so many connections as make it no larger than 5 MB, unless all are asked for,
    or it is larger without any; and a warning for each note in it."""
    scene, content = draws(settings)
    if suffix == ".svg" and not settings.full and len(content) > _LARGEST_SVG:
        lines = sum("connection" in group.data for group in scene.groups)
        bare = len(draws(replace(settings, most=0))[1]) if lines else len(content)
        for _ in range(3 if bare <= _LARGEST_SVG else 0):  # strong lines may take more room than weak ones
            if len(content) <= _LARGEST_SVG or not lines:
                break
            lines = max(0, int(0.98 * lines * (_LARGEST_SVG - bare) / max(len(content) - bare, 1)))
            scene, content = draws(replace(settings, most=lines))
    _note(scene)
    return content


def _note(scene: Scene) -> None:
    for note in scene.notes:
        warnings.warn(note, LeftOut, stacklevel=callers_level())
