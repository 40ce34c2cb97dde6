"""The live page of what arrives, served by a thread of its own.

In: what is shown and how, and where the page is served. Out: a Page, which is there for a block.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.live.access import Access
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.live import Tell, serve_until
from neurovis_spec.live.run import Run
from neurovis_spec.live.show import Show
from neurovis_spec.live.source import Source


class Page:
    """The live page, served at ``url``. If it ends early, ``tell`` gets the reason. Raises LayoutRefusalError."""

    def __init__(
        self,
        compiled: CompiledNetwork,
        source: Source,
        show: Show,
        sock: socket.socket,
        tell: Callable[[str], None],
        host: str = "127.0.0.1",
    ) -> None:
        self._compiled, self._show, self._tell = compiled, show, tell
        self._stage, self._sock = (source, show.view(compiled)), sock
        self._access = Access(host, sock.getsockname()[1], False)
        self._there, self._loop = Event(), asyncio.new_event_loop()
        self._ended: asyncio.Future[int] = self._loop.create_future()
        self._thread = Thread(target=self._serve, name="live page", daemon=True)
        self._failure: Exception | None = None

    @property
    def url(self) -> str:
        """Where it is, with the token that opens it."""
        return self._access.url()

    def _serve(self) -> None:
        try:
            served = serve_until(self._ended, self._stage, self._sock, self._access, self._there.set, self._desk)
            self._loop.run_until_complete(served)
        except Exception as failure:
            if self._there.is_set():
                self._tell(f"the page has ended: {failure}")
            self._failure = failure
        finally:
            self._there.set()
            self._loop.close()

    def _desk(self, run: Run, tell: Tell) -> Desk:
        return Desk(self._compiled, self._show.engine, self._show.view, run, tell)

    @contextmanager
    def served(self) -> Iterator[str]:
        """Serve it for a block; gives its URL. Raises what has kept it from being served."""
        self._thread.start()
        self._there.wait()
        try:
            if self._failure is not None:
                raise self._failure
            yield self.url
        finally:
            if self._thread.is_alive():
                self._loop.call_soon_threadsafe(self._end)
                self._thread.join(10.0)

    def _end(self) -> None:
        if not self._ended.done():
            self._ended.set_result(0)
