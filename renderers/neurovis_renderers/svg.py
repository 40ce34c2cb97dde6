"""SVG: a Scene as one file, without script, link or style sheet.

In: a Scene. Out: the bytes of an ``.svg``, the same for the same scene. Colours and widths are attributes, so that
programs can read them.
"""

from __future__ import annotations

from neurovis_renderers.markup import document, element, open_group
from neurovis_spec.scene import Film, Group, Progress, RendererCapabilities, Scene


class SvgRenderer:
    """Stills as SVG."""

    name = "svg"
    capabilities = RendererCapabilities(stills=frozenset({".svg"}))

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """The picture as an SVG file."""
        return document(scene, "".join(_group(group) for group in scene.groups))

    def animate(self, film: Film, suffix: str, progress: Progress | None = None) -> bytes:
        """Films are made by ``animated_svg``. Raises ValueError."""
        raise ValueError("this renderer makes no films")


def _group(group: Group) -> str:
    shapes = "".join(element(shape) for shape in group.shapes)
    if not group.title and not group.data and group.opacity == 1:
        return shapes + "\n"
    return f"{open_group(group)}{shapes}</g>\n"
