"""The look of a picture: all that says what it is, in one value, from whoever asks for it down to the figure.

In: what a reader asks for, where nothing the spec's own. Out: a Look, with every name in it resolved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from neurovis_spec.compiler.drawing.drawing_settings import Panel, RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.references import Arrow, parse
from neurovis_spec.language.words import TIMED
from neurovis_spec.runtime.names import Names, names_of
from neurovis_spec.scene.renderers import RendererError
from neurovis_spec.scene.shown import check_path


@dataclass(frozen=True)
class Look:
    """What a picture is: how the network is drawn (``settings``: theme, size, what of it is seen, …), which views are
    on the page, from top to bottom, none where it is the network alone, and of which steps it has frames."""

    settings: RenderSettings
    panels: tuple[Panel, ...] = ()
    #: whether somebody asks for these views; else the body is among them only where a run has one that can be drawn
    asked: bool = True
    #: the step of the first frame; None: the last one of the run
    first: int | None = None
    #: how many steps from there on are seen, and of how many each one is a frame
    count: int = 1
    every: int = 1
    #: frames a second of a picture that moves, None for a still
    fps: float | None = None
    #: the layout that it is drawn in: the spec's by default
    engine: str | None = None
    effort: str | None = None
    #: what kind of file it is, in small letters
    suffix: str = ".svg"
    #: pixels of a user unit, by default the picture's own
    density: float | None = None

    @property
    def moving(self) -> bool:
        """Whether it is a film."""
        return self.fps is not None

    @property
    def frames(self) -> int:
        """How many frames it has."""
        return -(-self.count // self.every)

    @property
    def timed(self) -> bool:
        """Whether a view over time is in it."""
        return any(panel.view in TIMED for panel in self.panels)

    def shows(self, *views: str) -> bool:
        """Whether one of these views is in it."""
        return "network" in views if not self.panels else any(panel.view in views for panel in self.panels)


def with_views(look: Look, panels: tuple[Panel, ...]) -> Look:
    """A look with these views: pathways are a picture of the network with each group as one glyph. What its author
    finds too weak to be drawn is of connections, not of these."""
    if not any(panel.view == "pathways" for panel in panels):
        return replace(look, panels=panels)
    settings = replace(look.settings, pathways=True, min_weight=None)
    panels = tuple(Panel("network") if panel.view == "pathways" else panel for panel in panels)
    return replace(look, settings=settings, panels=panels if len(panels) > 1 else ())


@dataclass(frozen=True, slots=True)
class Excerpt:
    """What of a network a reader asks to see, as texts. ``collapse``: groups and instances that are one glyph each;
    ``focus``: neurons to show with all that they are connected to; ``path``: ``A -> B``, to show the shortest paths;
    ``min_weight``: connections with less are left out; ``full``: all are drawn, however many there are."""

    collapse: Sequence[str] = ()
    focus: str | None = None
    path: str | None = None
    min_weight: float | None = None
    full: bool = False


def excerpted(network: Network, settings: RenderSettings, excerpt: Excerpt) -> RenderSettings:
    """The settings with this excerpt. Raises RendererError for a name that there is not, and where there is no path."""
    names = names_of(network)
    if excerpt.collapse:
        settings = replace(settings, collapse=_collapsed(network, names, excerpt.collapse))
    if excerpt.focus is not None:
        settings = replace(settings, focus=(excerpt.focus, _found(network, names, excerpt.focus)))
    if excerpt.path is not None:
        path = parse(excerpt.path)
        if not (isinstance(path, Arrow) and path.sources.text and path.targets.text):
            raise RendererError(f"'{excerpt.path}' is no path", "write 'A -> B'")
        sources, targets = _found(network, names, path.sources.text), _found(network, names, path.targets.text)
        settings = replace(settings, path=(path.normal, sources, targets))
        check_path(network, settings)
    if excerpt.min_weight is not None:
        if not (math.isfinite(excerpt.min_weight) and excerpt.min_weight >= 0):
            raise RendererError(f"the least weight is a number that is not negative, not {excerpt.min_weight}")
        settings = replace(settings, min_weight=float(excerpt.min_weight))
    return replace(settings, full=settings.full or excerpt.full)


def _collapsed(network: Network, names: Names, texts: Sequence[str]) -> tuple[tuple[str, tuple[int, ...]], ...]:
    taken: dict[int, str] = {}
    result = []
    for text in dict.fromkeys(texts):
        members = _found(network, names, text)
        for index in members:
            other = taken.setdefault(index, text)
            if other != text:
                raise RendererError(f"'{network.neurons.names[index]}' is in '{other}' and in '{text}': collapse one")
        result.append((text, members))
    return tuple(result)


def _found(network: Network, names: Names, text: str) -> tuple[int, ...]:
    """The neurons of a reference, which may name instances."""
    inside = [index for one in network.instances if text in (one.path, one.declared) for index in one.indices]
    if inside:
        return tuple(inside)
    found = names.find(text)
    if isinstance(found, str):
        raise RendererError(found)
    return found.neurons
