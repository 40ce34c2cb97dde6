"""Progress: a bar on a terminal for what takes longer than a second.

In: what is being done, in a word or two. Out: a callback for ``done`` of ``total``; until it is called for the first
time the bar says that work goes on. Nothing is shown where standard error is no terminal.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

#: seconds without a bar
PATIENCE: Final = 1.0


class Bar:
    """A bar that appears after a while. Calling it says how far the work is."""

    def __init__(self, label: str, patience: float = PATIENCE) -> None:
        self._label = label
        self._lock = threading.Lock()
        self._done: tuple[int, int] | None = None
        self._bar: tuple[Progress, TaskID] | None = None
        self._over = False
        self._timer = threading.Timer(patience, self._appear)
        self._timer.daemon = True

    def __call__(self, done: int, total: int) -> None:
        """Say that ``done`` of ``total`` is done."""
        with self._lock:
            self._done = (done, total)
            self._update()

    def start(self) -> None:
        """Begin to count the seconds."""
        self._timer.start()

    def stop(self) -> None:
        """Take the bar away, or let it not appear."""
        self._timer.cancel()
        with self._lock:
            self._over = True
            if self._bar is not None:
                self._bar[0].stop()

    def _appear(self) -> None:
        from rich.console import Console
        from rich.progress import Progress

        with self._lock:
            if self._over:
                return
            bar = Progress(console=Console(stderr=True), transient=True)
            self._bar = (bar, bar.add_task(self._label, total=None))
            self._update()
            bar.start()

    def _update(self) -> None:
        if self._bar is not None and self._done is not None:
            done, total = self._done
            self._bar[0].update(self._bar[1], completed=done, total=total)


def on_terminal() -> bool:
    """Whether somebody reads standard error: what is piped stays clean."""
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def progress(label: str) -> Iterator[Bar]:
    """A bar for the time of a block."""
    bar = Bar(label)
    shown = on_terminal()
    if shown:
        bar.start()
    try:
        yield bar
    finally:
        if shown:
            bar.stop()
