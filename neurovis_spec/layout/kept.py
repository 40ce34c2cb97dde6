"""Layouts that were made before, in the user's cache.

In: a LayoutProblem and an engine's name, and what makes the layout. Out: the layout, from the cache where it is known
to be what the engine would give. The key is all of the problem, the engine, and the code that would make the layout, so
what is kept is never another; engines of others are not kept, as nobody knows what their code reads.
"""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Final, cast

import numpy as np

from neurovis_spec import plugins
from neurovis_spec.layout.choose import choose_engine
from neurovis_spec.layout.model import (
    DIRECTIONS,
    SIDES,
    Direction,
    Layout,
    LayoutProblem,
    LayoutRefusalError,
    Point,
    Route,
    Side,
)
from neurovis_spec.user_cache import UserCache
from neurovis_spec.version import __version__

KEPT: Final = UserCache("layouts")
#: The package with our engines, which see the layout types of the core alone.
_OURS: Final = "neurovis_layouts"


def kept(problem: LayoutProblem, engine: str, make: Callable[[], Layout]) -> Layout:
    """What ``make`` gives, or gave when it was called for the same before. Raises what ``make`` raises."""
    key = key_of(problem, engine) if KEPT.on else None
    if key is None:
        return make()
    data = KEPT.read(key)
    known = None if data is None else _read(data, problem)
    if known is None:
        known = make()
        KEPT.keep(key, _written(known))
    return known


def key_of(problem: LayoutProblem, engine: str) -> str | None:
    """All that the layout follows from, as a text; None where that is not known."""
    if engine == "auto" and not all(map(_is_ours, plugins.names(plugins.LAYOUTS))):
        try:
            engine = choose_engine(problem)[0]
        except LayoutRefusalError:
            return None
    if engine != "auto" and not _is_ours(engine):
        return None
    return json.dumps([code(), engine, problem], default=_plain)


def _is_ours(engine: str) -> bool:
    if engine not in plugins.names(plugins.LAYOUTS):
        return False
    return plugins.package(plugins.LAYOUTS, engine).partition(".")[0] == _OURS


def _plain(value: object) -> object:
    """What JSON has no word for: our values by their fields, in order."""
    if is_dataclass(value):
        return [getattr(value, field.name) for field in fields(value)]
    if isinstance(value, Mapping):
        return list(value.items())
    raise TypeError(f"a layout problem holds {type(value).__name__}")


@cache
def code() -> str:
    """What makes layouts: the hash of the code of our engines and of what they see of the core, and the versions of
    what computes for them."""
    digest = hashlib.sha256()
    for folder in sorted({Path(__file__).parent, Path(__file__).parents[1], *_folders()}):
        pattern = "*.py" if folder == Path(__file__).parents[1] else "**/*.py"
        for path in sorted(folder.glob(pattern)):
            digest.update(str(path.relative_to(folder)).encode() + b"\0")
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    machine = platform.machine(), sys.platform, ".".join(map(str, sys.version_info[:2]))
    return " ".join((digest.hexdigest(), __version__, np.__version__, _version("networkx"), *machine))


def _folders() -> tuple[Path, ...]:
    """Where our engines are, which are not imported for that."""
    found = find_spec(_OURS)
    return tuple(map(Path, () if found is None else found.submodule_search_locations or ()))


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _written(layout: Layout) -> bytes:
    parts = [layout.network, layout.engine, layout.positions, layout.routes, layout.labels, layout.direction]
    return json.dumps([dict(part) if isinstance(part, Mapping) else part for part in parts]).encode()


def _read(data: bytes, problem: LayoutProblem) -> Layout | None:
    """The layout that was written so; None where it is none of this problem."""
    try:
        network, engine, positions, routes, labels, direction = json.loads(data)
        layout = Layout(
            network,
            engine,
            {name: _point(point) for name, point in positions.items()},
            {name: _route(points) for name, points in routes.items()},
            {name: cast(Side, side) for name, side in labels.items() if side in SIDES},
            cast(Direction, direction) if direction in DIRECTIONS else None,
        )
    except (ValueError, TypeError, AttributeError):
        return None
    whole = list(layout.positions) == list(problem.neurons) and network == problem.network and isinstance(engine, str)
    return layout if whole and list(layout.routes) == [edge.name for edge in problem.edges] else None


def _point(point: list[float]) -> Point:
    x, y = point
    return float(x), float(y)


def _route(points: list[list[float]]) -> Route:
    return tuple(map(_point, points))
