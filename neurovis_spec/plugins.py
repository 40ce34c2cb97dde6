"""Plug-ins: engines, renderers, backends and formats are found by name, through entry points.

In: a group and a name. Out: what the entry point names, called without arguments. Ours are registered in the same way
as anybody's. Nothing is listed or imported before somebody asks; then all are listed, once in a process.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

LAYOUTS = "neurovis.layouts"
RENDERERS = "neurovis.renderers"
BACKENDS = "neurovis.backends"
FORMATS = "neurovis.formats"
#: packages with YAML files of definitions
LIBRARIES = "neurovis.libraries"
BODIES = "neurovis.bodies"


class PluginError(ValueError):
    """What is installed under a name cannot be loaded: the fault is the plug-in's."""


@cache
def _points(group: str) -> Mapping[str, EntryPoint]:
    return {point.name: point for point in sorted(_select()(group=group), key=lambda p: (p.name, p.value))}


@cache
def _select() -> Callable[..., Iterable[EntryPoint]]:
    """What gives some of all entry points there are: to find those of a group takes as long as to find all."""
    from importlib.metadata import entry_points  # slow to import, and the help of a command needs none of it

    return entry_points().select


def names(group: str) -> tuple[str, ...]:
    """The names registered in a group, in order."""
    return tuple(_points(group))


def load(group: str, name: str) -> object:
    """What is registered under this name, made. Raises KeyError where there is none, PluginError where it fails."""
    point = _points(group)[name]
    try:
        made: object = point.load()()
    except Exception as error:  # whatever somebody's code raises while it is imported
        raise PluginError(f"the plug-in '{name}' ({point.value}) cannot be loaded: {error!r}") from error
    return made


def working(group: str) -> Iterator[object]:
    """All of a group, one after the other; one that cannot be loaded does not stand in the way of the others."""
    for name in names(group):
        try:
            yield load(group, name)
        except PluginError as error:
            warnings.warn(str(error), RuntimeWarning, stacklevel=2)


def package(group: str, name: str) -> str:
    """The name of the package that is registered under this name."""
    return _points(group)[name].module
