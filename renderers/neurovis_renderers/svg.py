"""SVG: a Scene as one file, without script, link or style sheet.

In: a Scene. Out: the bytes of an ``.svg``, the same for the same scene. Colours and widths are attributes, so that
programs can read them.
"""

from __future__ import annotations

from neurovis_renderers.markup import document, unchanging
from neurovis_spec.scene import Film, Progress, RendererCapabilities, Scene


class SvgRenderer:
    """Stills as SVG."""

    name = "svg"
    capabilities = RendererCapabilities(stills=frozenset({".svg"}))

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """The picture as an SVG file."""
        return document(scene, "".join(unchanging(group) for group in scene.groups))

    def animate(self, film: Film, suffix: str, progress: Progress | None = None) -> bytes:
        """Films are made by ``animated_svg``. Raises ValueError."""
        raise ValueError("this renderer makes no films")
