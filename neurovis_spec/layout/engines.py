"""Engines by name.

In: a name. Out: the layout engine that is installed under it, or a LayoutRefusalError.
"""

from __future__ import annotations

from neurovis_spec import plugins
from neurovis_spec.diagnostics import suggest
from neurovis_spec.layout.model import Capabilities, LayoutEngine, LayoutRefusalError


def engine_of(name: str) -> LayoutEngine:
    """The engine of a name. Raises LayoutRefusalError."""
    try:
        made: object = plugins.load(plugins.LAYOUTS, name)
    except KeyError:
        known = plugins.names(plugins.LAYOUTS)
        hint = suggest(name, ("auto", *known), "known engines")
        raise LayoutRefusalError("unknown-engine", f"there is no layout engine '{name}' here", hint) from None
    if not isinstance(made, LayoutEngine) or not isinstance(made.capabilities, Capabilities):
        raise LayoutRefusalError("broken-engine", f"what is installed as layout engine '{name}' is none")
    return made
