"""Which renderer makes a file: found by the suffix, among what is installed.

In: a suffix, and whether the picture moves. Out: the Renderer that declares it, or RendererError with what there is; or
the content of a file.
"""

from __future__ import annotations

from neurovis_spec import plugins
from neurovis_spec.likeness import suggest
from neurovis_spec.scene.model import Renderer, RendererCapabilities, Scene, StreamingRenderer


class RendererError(ValueError):
    """Nobody makes files of this kind. ``hint`` says what there is."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        self.hint = hint
        super().__init__(message)


def renderer_for(suffix: str, *, moving: bool) -> Renderer:
    """The first renderer, by name, that declares this suffix, in any case, for stills or for films, and that has what
    it needs."""
    suffix, missing, known = suffix.lower(), "", list[str]()
    for made in plugins.working(plugins.RENDERERS):
        capabilities = getattr(made, "capabilities", None)
        if not isinstance(capabilities, RendererCapabilities):
            raise RendererError(f"what is installed as renderer '{type(made).__name__}' is none")
        suffixes = capabilities.films if moving else capabilities.stills
        if suffix in suffixes and suffix in capabilities.missing:
            missing = capabilities.missing[suffix]
        elif suffix in suffixes:
            renderer: Renderer = made  # type: ignore[assignment]
            return renderer
        known += sorted(suffixes)
    if missing:
        raise RendererError(f"what makes files of the kind '{suffix}' is not installed", missing)
    what = "films" if moving else "pictures"
    message = f"no renderer makes {what} of the kind '{suffix}'" if suffix else f"the file of {what} needs a suffix"
    raise RendererError(message, suggest(suffix, known, f"kinds of {what}"))


def drawing(scene: Scene, suffix: str) -> bytes:
    """A scene as the content of a file of this kind. Raises RendererError where nobody draws such files."""
    return renderer_for(suffix, moving=False).draw(scene, suffix.lower())


def streaming_renderer(suffix: str) -> StreamingRenderer:
    """Who writes films of this kind while they are made. Raises RendererError where nobody does."""
    renderer = renderer_for(suffix, moving=True)
    assert isinstance(renderer, StreamingRenderer)
    return renderer
