"""A live view from its beginning to its end.

In: how a network is compiled, run and drawn, where to listen. Out: a server that runs until it is told to end.
"""

from __future__ import annotations

import asyncio
import signal
import socket
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import TypeAlias

from neurovis_spec.compilation import Compilation
from neurovis_spec.diagnostics import Diagnostic, SpecError, show_text
from neurovis_spec.interrupts import ENDING, Ended
from neurovis_spec.layout.model import LayoutRefusalError
from neurovis_spec.live.access import Access
from neurovis_spec.live.commands import REQUESTS
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.hub import Hub
from neurovis_spec.live.protocol import findings_message, refused_message
from neurovis_spec.live.retitled import retitled
from neurovis_spec.live.run import Change, Run, Stage
from neurovis_spec.live.server import Server
from neurovis_spec.live.show import Show
from neurovis_spec.live.watch import Marks, Watch, marks
from neurovis_spec.runtime.errors import RecordingError

#: Tells everybody, and those who come later.
Tell: TypeAlias = Callable[[str], None]


def listen(host: str, port: int) -> socket.socket:
    """A socket bound to an address; port 0 is any that is free. Raises OSError."""
    family, kind, number, _, address = socket.getaddrinfo(
        host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    sock = socket.socket(family, kind, number)
    try:
        if sys.platform != "win32":
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.bind(address)
    except BaseException:
        sock.close()
        raise
    return sock


@dataclass(frozen=True)
class Edited:
    """The file of a spec that may be edited, and what compiles it anew."""

    path: Path
    compile: Callable[[], Compilation]

    def files(self, compiled: Compilation) -> set[Path]:
        """The files that an edit may change."""
        return {self.path, *compiled.files}


class Edits:
    """Shows a spec anew when one of its files was edited; if it is invalid, or cannot be shown at this step, reports
    that and keeps the old network."""

    def __init__(self, show: Show, edited: Edited, run: Run, tell: Tell, desk: Desk) -> None:
        self._show, self._spec, self._run, self._tell, self._desk = show, edited, run, tell, desk
        self._watched = edited.files(desk.placed.compiled)
        #: the files beside the spec, as they were when what is shown was compiled
        self._beside: Marks | None = self._now()

    def watch(self) -> Watch:
        """What watches the files."""
        return Watch(self._watched, self._edited)

    def _now(self) -> Marks:
        return marks(self._watched - {self._spec.path})

    def _edited(self) -> Iterable[Path]:
        before, now = self._desk.placed.compiled, self._now()
        try:
            again = retitled(before, self._spec.path) if now == self._beside else None
            placed = self._desk.renew(again or self._spec.compile())
        except Exception as error:  # a layout engine, ours or anybody's, may fail
            return self._refused(_words(error))
        compiled = placed.compiled
        try:
            view = self._run.view
            if again is not None and placed.layout is view.layout:
                change = self._show.retitled(again, view)
            else:
                change = self._show.changed(compiled, self._run.appearance, placed.layout)
            refused = self._changed(change)
        except Exception as error:  # so may a body
            refused = _words(error)
        if refused is not None:
            self._desk.unrenew()
            return self._refused(refused)
        self._watched, self._beside = self._spec.files(compiled), now
        if self._now().keys() != now.keys():
            self._beside = None  # files that nobody has looked at before
        self._tell(findings_message(show_text(compiled.warnings, compiled.sources), errors=False))
        return self._watched

    def _refused(self, words: str) -> Iterable[Path]:
        self._tell(findings_message(words, errors=True))
        return self._watched

    def _changed(self, change: Change) -> str | None:
        """Have the run show the edited network; why it does not, None where it does."""
        answer: SimpleQueue[str | None] = SimpleQueue()
        self._run.change(change, answer.put, lambda: answer.put(None))
        return answer.get()


def _words(error: Exception) -> str:
    """What is wrong with an edited spec."""
    if isinstance(error, SpecError):
        return show_text(error.diagnostics, error.sources)
    if isinstance(error, LayoutRefusalError):
        found: tuple[Diagnostic, ...] = () if error.diagnostic is None else (error.diagnostic,)
        return show_text(found, error.sources) or str(error)
    if isinstance(error, RecordingError | OSError | ValueError):
        return str(error)
    return f"the edited spec cannot be shown: {type(error).__name__}: {error}"


async def serve(
    stage: Stage,
    sock: socket.socket,
    access: Access,
    announce: Callable[[], None],
    desk: Callable[[Run, Tell], Desk],
    edits: Callable[[Run, Tell, Desk], Watch] | None = None,
) -> None:
    """Serve until a signal asks for an end. Raises Ended."""
    loop = asyncio.get_running_loop()
    ended: asyncio.Future[int] = loop.create_future()
    heed_signals(loop, ended)
    await serve_until(ended, stage, sock, access, announce, desk, edits)
    raise Ended(ended.result())


async def serve_until(
    ended: asyncio.Future[int],
    stage: Stage,
    sock: socket.socket,
    access: Access,
    announce: Callable[[], None],
    desk: Callable[[Run, Tell], Desk],
    edits: Callable[[Run, Tell, Desk], Watch] | None = None,
) -> None:
    """Serve until it is at its end, whatever a source raises."""
    loop = asyncio.get_running_loop()
    hub = Hub(loop, REQUESTS)
    run = Run(*stage, hub.show, lambda: hub.watched, lambda reason: hub.tell_soon(refused_message(reason)))

    at_desk = desk(run, hub.keep_soon)
    server = Server(access, hub, run, at_desk)
    threads: list[Run | Desk | Watch] = [run, at_desk]
    if edits is not None:
        threads.append(edits(run, hub.keep_soon, at_desk))
    await server.start(sock)
    try:
        for thread in threads:
            thread.start()
        announce()
        await ended
    finally:
        for thread in reversed(threads):
            thread.end()
        await server.stop()


def heed_signals(loop: asyncio.AbstractEventLoop, ended: asyncio.Future[int]) -> None:
    """Let the signals that would end the process end the server, those that are not ignored."""

    def end(number: int) -> None:
        if not ended.done():
            ended.set_result(number)

    for number in ENDING:
        if callable(signal.getsignal(number)):
            loop.add_signal_handler(number, end, int(number))
