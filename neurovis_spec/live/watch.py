"""Watching: a saved spec is in the page at once.

In: the files of a spec. Out: calls, from a thread of its own, whenever one of them has another size or date.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from threading import Event, Thread
from typing import Final, TypeAlias

#: Seconds between two looks.
EVERY: Final = 0.15

Marks: TypeAlias = dict[Path, tuple[int, int] | None]


def marks(files: Iterable[Path]) -> Marks:
    """The date and the size of each file; None where it is not there."""
    result: Marks = {}
    for file in files:
        try:
            found = file.stat()
        except OSError:
            result[file] = None
        else:
            result[file] = found.st_mtime_ns, found.st_size
    return result


class Watch:
    """Calls ``changed`` when files change; it gives the files to watch from then on."""

    def __init__(self, files: Iterable[Path], changed: Callable[[], Iterable[Path]]) -> None:
        self._changed = changed
        self._marks = marks(files)
        self._ended = Event()
        self._thread = Thread(target=self._watch, name="live watch", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def end(self) -> None:
        """Stop; a spec that is being compiled is not waited for long."""
        self._ended.set()
        self._thread.join(1.0)

    def _watch(self) -> None:
        while not self._ended.wait(EVERY):
            now = marks(self._marks)
            if now == self._marks:
                continue
            files = self._changed()
            # what was saved while it was checked counts as changed
            self._marks = {file: now.get(file, mark) for file, mark in marks(files).items()}
