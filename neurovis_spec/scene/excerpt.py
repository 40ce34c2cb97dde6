"""Excerpt: what of a network a reader asks to see, as texts; with references resolved it is part of RenderSettings.

In: a network, what the reader asks for. Out: RenderSettings that say so. Where the reader says nothing the spec's hold.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.references import Arrow, parse
from neurovis_spec.runtime.names import Names, names_of
from neurovis_spec.scene.renderers import RendererError
from neurovis_spec.scene.shown import check_path


@dataclass(frozen=True, slots=True)
class Excerpt:
    """``collapse``: groups and instances that are one glyph each; ``focus``: neurons to show with all that they are
    connected to; ``path``: ``A -> B``, to show the shortest paths; ``min_weight``: connections with less are left out;
    ``full``: all are drawn, however many there are."""

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
