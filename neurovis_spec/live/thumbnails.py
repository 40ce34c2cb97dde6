"""Small pictures of specs: each network as it is laid out, before anything happens.

In: what is listed, and what draws it. Out: an SVG, or why there is none, in words. It is kept in the user's cache
until one of the files that it was made of has another size or date, or the program is another one.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final, TypeAlias

from neurovis_spec.diagnostics import SpecError, show_text
from neurovis_spec.live.listing import Listed
from neurovis_spec.live.watch import marks
from neurovis_spec.user_cache import UserCache
from neurovis_spec.version import __version__

KEPT: Final = UserCache("pictures")


#: Draws what is listed, and says which files it has read for that. Raises SpecError.
Draw: TypeAlias = Callable[[Listed], tuple[str, Iterable[Path]]]


@dataclass(frozen=True, slots=True)
class Thumbnail:
    """A picture, or words in its place."""

    svg: str
    words: str


class Thumbnails:
    """Makes pictures."""

    def __init__(self, draw: Draw) -> None:
        self._draw = draw

    def of(self, listed: Listed) -> Thumbnail:
        """The picture of a spec."""
        key = json.dumps([_program(), str(listed.path), listed.text])
        known = _known(key)
        if known is not None:
            return known
        begun = time.time_ns()
        try:
            svg, files = self._draw(listed)
        except SpecError as error:
            return Thumbnail("", show_text(error.diagnostics, error.sources))
        except Exception as error:  # a layout engine, ours or anybody's, may fail
            return Thumbnail("", f"{type(error).__name__}: {error}")
        found = marks(files)
        if not any(_changed_since(path, begun) for path in found):
            now = [[str(path), mark] for path, mark in sorted(found.items())]
            KEPT.keep(key, json.dumps([now, svg]).encode())
        return Thumbnail(svg, "")


def _changed_since(path: Path, when: int) -> bool:
    """Whether a file may have been written while it was drawn, so that the picture is of what it was before."""
    try:
        return path.stat().st_mtime_ns >= when
    except OSError:
        return True


def _known(key: str) -> Thumbnail | None:
    """The picture that was kept, where all that it was made of is as it was."""
    data = KEPT.read(key)
    if data is None:
        return None
    try:
        then, svg = json.loads(data)
        found = marks(Path(path) for path, _ in then)
        same = all(mark is not None and found[Path(path)] == tuple(mark) for path, mark in then)
    except (ValueError, TypeError, KeyError):
        return None
    return Thumbnail(svg, "") if same and isinstance(svg, str) else None


@cache
def _program() -> str:
    """The size and the date of all of the program."""
    here = Path(__file__).parents[1]
    found = marks([*here.rglob("*.py"), *here.rglob("*.yaml")])
    stamps = repr(sorted((str(path), mark) for path, mark in found.items()))
    return f"{__version__} {hashlib.sha256(stamps.encode()).hexdigest()}"
