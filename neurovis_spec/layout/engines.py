"""Engines by name, and by what they can do.

In: a name, or what is wanted. Out: the layout engines that are installed, or a LayoutRefusalError.
"""

from __future__ import annotations

from collections.abc import Callable

from neurovis_spec import plugins
from neurovis_spec.layout.model import Capabilities, LayoutEngine, LayoutRefusalError
from neurovis_spec.likeness import suggest


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


def engines_that(can: Callable[[Capabilities], bool]) -> list[str]:
    """The names of the installed engines that can do something, in order; one that cannot be loaded can do nothing."""
    result = []
    for name in plugins.names(plugins.LAYOUTS):
        try:
            engine = engine_of(name)
        except (LayoutRefusalError, plugins.PluginError):
            continue
        if can(engine.capabilities):
            result.append(name)
    return result


def they_can(names: list[str]) -> str | None:
    """A help line that names engines.

    >>> they_can(["circular", "grid", "layered"])
    "the engines 'circular', 'grid' and 'layered' can"
    """
    quoted = [f"'{name}'" for name in names]
    if len(quoted) < 2:
        return f"the engine {quoted[0]} can" if quoted else None
    return f"the engines {', '.join(quoted[:-1])} and {quoted[-1]} can"
