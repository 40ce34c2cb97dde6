"""The process that draws a film while it is shot: ``python -m neurovis_spec.ros.filming``.

In: from the process that started it, over a pipe, a Shooting and then numbered snapshots; frames that were left out
repeat the one before them. Out: the file. It ends where the pipe does, also because the other process was killed.
"""

from __future__ import annotations

import pickle
import sys
from collections import deque
from collections.abc import Iterator
from itertools import chain, repeat
from threading import Condition, Thread
from typing import IO, Final

from neurovis_spec.ros.video import Shooting
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.scene import Film
from neurovis_spec.scene.film import films
from neurovis_spec.scene.renderers import RendererError, streaming_renderer

#: seconds of a film that are drawn together, at least and at most; what each has in common is worked out once
_LEAST, _MOST = 1.0, 10.0
#: snapshots that wait; the others wait in the pipe, or are not made
_WAITING: Final = 500


class Shots:
    """The frames that come over a pipe."""

    def __init__(self, pipe: IO[bytes], fps: float) -> None:
        self._pipe, self._least, self._most = pipe, max(1, round(_LEAST * fps)), max(1, round(_MOST * fps))
        self._there, self._came, self._over = Condition(), deque[tuple[int, Snapshot]](), False
        Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        while True:
            try:
                frame = pickle.load(self._pipe)  # from our own process, and nobody else
            except (EOFError, OSError, pickle.UnpicklingError):
                frame = None
            with self._there:
                if frame is None:
                    self._over = True
                else:
                    self._came.append(frame)
                self._there.notify_all()
                self._there.wait_for(lambda: len(self._came) < _WAITING)
            if frame is None:
                return

    def _next(self, wait: bool) -> tuple[int, Snapshot] | None:
        with self._there:
            if wait:
                self._there.wait_for(lambda: self._came or self._over)
            frame = self._came.popleft() if self._came else None
            self._there.notify_all()
        return frame

    def parts(self) -> Iterator[list[Snapshot]]:
        """The frames in parts: all that there are by the time that one is asked for, at least those of a second."""
        part: list[Snapshot] = []
        frame, made, last = self._next(True), 0, None
        while frame is not None:
            number, snapshot = frame
            for one in chain(repeat(snapshot if last is None else last, number - made), [snapshot]):
                part.append(one)
                if len(part) == self._most:
                    yield part
                    part = []
            made, last = number + 1, snapshot
            frame = self._next(len(part) < self._least)
            if frame is None and part:
                yield part
                part = []
                frame = self._next(True)
        if part:
            yield part


def film(shooting: Shooting, pipe: IO[bytes]) -> None:
    """Draw what comes until nothing more does. Raises RendererError, OSError."""
    parts = Shots(pipe, shooting.fps).parts()
    made = films(shooting.network, shooting.layout, parts, shooting.gains, shooting.settings, shooting.fps)
    first = next(made, None)
    if first is not None:
        with shooting.path.open("wb") as file:
            together: Iterator[Film] = chain([first], made)
            streaming_renderer(shooting.path.suffix).stream(together, 0, shooting.path.suffix.lower(), file)


def main() -> int:
    """Draw what comes over standard input."""
    pipe = open(sys.stdin.fileno(), "rb", closefd=False)  # noqa: SIM115  # a thread may still read it at the end
    try:
        film(pickle.load(pipe), pipe)
    except (RendererError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
