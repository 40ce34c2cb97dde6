"""The live page of what arrives, served by a thread of its own.

In: a Listening that is shown, and where the page is served. Out: a Page, which is there for a block.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.live.access import Access
from neurovis_spec.live.live import serve_until
from neurovis_spec.live.run import Stage
from neurovis_spec.live.source import Source
from neurovis_spec.live.view import view_of


class Page:
    """A page that is served; ``url`` is where. ``failure`` says why it is no more."""

    def __init__(self, stage: Stage, sock: socket.socket, host: str = "127.0.0.1") -> None:
        self._stage, self._sock = stage, sock
        self._access = Access(host, sock.getsockname()[1], False)
        self._there, self._loop = Event(), asyncio.new_event_loop()
        self._ended: asyncio.Future[int] = self._loop.create_future()
        self._thread = Thread(target=self._serve, name="live page", daemon=True)
        self.failure: Exception | None = None

    @property
    def url(self) -> str:
        """Where it is, with the token that opens it."""
        return self._access.url()

    def _serve(self) -> None:
        try:
            served = serve_until(self._ended, self._stage, self._sock, self._access, self._there.set)
            self._loop.run_until_complete(served)
        except Exception as failure:
            self.failure = failure
        finally:
            self._there.set()
            self._loop.close()

    @contextmanager
    def served(self) -> Iterator[str]:
        """Serve it for a block; gives its URL. Raises what has kept it from being served."""
        self._thread.start()
        self._there.wait()
        try:
            if self.failure is not None:
                raise self.failure
            yield self.url
        finally:
            if self._thread.is_alive():
                self._loop.call_soon_threadsafe(self._end)
                self._thread.join(10.0)

    def _end(self) -> None:
        if not self._ended.done():
            self._ended.set_result(0)


def stage_of(compiled: CompiledNetwork, source: Source, theme: str | None = None, engine: str | None = None) -> Stage:
    """The source, and how it is drawn. Raises LayoutRefusalError."""
    return source, view_of(compiled, compiled.gains_for(None), theme, engine)
