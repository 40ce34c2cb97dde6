"""Plug-ins: engines, renderers, backends and formats are found by name, through entry points.

In: a group and a name. Out: what the entry point names, called without arguments. Ours are registered in the same way
as anybody's. Nothing is listed or imported before somebody asks.
"""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points

LAYOUTS = "neurovis.layouts"
RENDERERS = "neurovis.renderers"
BACKENDS = "neurovis.backends"
FORMATS = "neurovis.formats"
#: packages with YAML files of activations, models and rules
LIBRARIES = "neurovis.libraries"


def _points(group: str) -> dict[str, EntryPoint]:
    return {point.name: point for point in sorted(entry_points(group=group), key=lambda p: (p.name, p.value))}


def names(group: str) -> tuple[str, ...]:
    """The names registered in a group, in order."""
    return tuple(_points(group))


def load(group: str, name: str) -> object:
    """What is registered under this name, made. Raises KeyError where there is none."""
    made: object = _points(group)[name].load()()
    return made


def package(group: str, name: str) -> str:
    """The name of the package that is registered under this name."""
    return _points(group)[name].module
