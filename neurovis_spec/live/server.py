"""The server: the page and its websocket, over aiohttp.

In: requests. Out: one page at ``/``, and at ``/live`` the stream of a hub; everything else is refused. Nothing that a
client does or leaves undone is waited for by the others or by the run.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import logging
import re
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final
from weakref import WeakSet

from aiohttp import WSCloseCode, WSMsgType, web

from neurovis_spec.live.access import STREAM, Access, Refused
from neurovis_spec.live.commands import Present
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.hub import Client, Hub, Reception
from neurovis_spec.live.protocol import LARGEST, ProtocolError
from neurovis_spec.live.run import Run
from neurovis_spec.live.shipped import page

#: Websockets at once, and connections of any kind.
MOST_CLIENTS, MOST_CONNECTIONS = 128, 256
#: Seconds in which a connection must have asked for something, a message must be on its way, and between pings.
ASKING, SENDING, PINGS = 10.0, 15.0, 20.0
_LOG: Final = logging.getLogger(__name__)
_POLICY: Final = "Content-Security-Policy"
#: Messages a second that a client may send in the long run, and at once.
RATE, BURST = 200, 400


def policy(html: str) -> str:
    """The Content-Security-Policy of a page: its own script and style alone, and its own websocket."""

    def hashed(tag: str) -> str:
        found = re.findall(rf"<{tag}[^>]*>(.*?)</{tag}>", html, re.DOTALL)
        digests = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in found]
        return " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"

    return (
        f"default-src 'none'; script-src {hashed('script')}; style-src {hashed('style')}; connect-src 'self'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


def headers(csp: str) -> dict[str, str]:
    """What every answer carries."""
    return {
        _POLICY: csp,
        "X-Content-Type-Options": "nosniff",
        "X-Frame-Options": "DENY",
        "Referrer-Policy": "no-referrer",
        "Cache-Control": "no-store",
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
        "Server": "neurovis",
    }


@dataclass(frozen=True, slots=True)
class Place:
    """Where a websocket looks on: whose hub it joins, what takes its messages, and what is called when it has come and
    when it has gone."""

    hub: Hub
    take: Callable[[Client, bytes | str], None]
    come: Callable[[], object]
    gone: Callable[[], object]


class Front(ABC):
    """Answers requests of whoever has a token, with pages and websockets, and refuses all others."""

    def __init__(self, access: Access) -> None:
        self._access = access
        self._html = page()
        self._headers = headers(policy(self._html))
        self._streams: WeakSet[web.WebSocketResponse] = WeakSet()
        #: connections that have asked for nothing yet
        self._silent: set[asyncio.Protocol] = set()
        self._app = web.Application(client_max_size=LARGEST)
        self._app.router.add_route("*", "/{path:.*}", self._answer)
        self._app.on_response_prepare.append(self._prepare)
        self._runner = web.AppRunner(
            self._app, access_log=None, keepalive_timeout=15.0, handle_signals=False, shutdown_timeout=1.0
        )
        self._listening: asyncio.Server | None = None

    @abstractmethod
    async def _get(self, request: web.Request) -> web.StreamResponse:
        """Answer a request that is no websocket, of somebody who has a token."""

    @abstractmethod
    def _place(self, request: web.Request) -> Place | Refused:
        """Where a websocket looks on."""

    async def start(self, sock: socket.socket) -> None:
        """Listen at a socket that is bound."""
        await self._runner.setup()
        self._listening = await asyncio.get_running_loop().create_server(self._accept, sock=sock, backlog=128)

    async def stop(self) -> None:
        """Say goodbye to everybody."""
        if self._listening is not None:
            self._listening.close()
        goodbyes = [stream.close(code=WSCloseCode.GOING_AWAY, message=b"the server ends") for stream in self._streams]
        if goodbyes:
            await asyncio.wait([asyncio.ensure_future(goodbye) for goodbye in goodbyes], timeout=1.0)
        await self._runner.cleanup()

    def _accept(self) -> asyncio.Protocol:
        """A connection: refused where there are too many, and closed where it asks for nothing."""
        server = self._runner.server
        assert server is not None
        if len(server.connections) >= MOST_CONNECTIONS:
            return _Closed()
        protocol = server()
        self._silent.add(protocol)
        asyncio.get_running_loop().call_later(ASKING, self._close_silent, protocol)
        return protocol

    def _close_silent(self, protocol: web.RequestHandler) -> None:
        if protocol in self._silent:
            self._silent.discard(protocol)
            if protocol.transport is not None:
                protocol.transport.abort()

    async def _prepare(self, request: web.Request, response: web.StreamResponse) -> None:
        own = response.headers.get(_POLICY)  # of another page than that of a run
        response.headers.update(self._headers if own is None else {**self._headers, _POLICY: own})

    async def _answer(self, request: web.Request) -> web.StreamResponse:
        self._silent.discard(request.protocol)
        token = request.query.get("token")
        head = request.headers
        refused = self._access.refusal(request.method, request.path, head.get("Host"), head.get("Origin"), token)
        if refused is not None:
            return self._refuse(refused.status, refused.reason)
        if request.path == STREAM:
            return await self._stream(request, bool(self._access.of(token)))
        return await self._get(request)

    def _live_page(self) -> web.Response:
        response = web.Response(text=self._html, content_type="text/html", charset="utf-8")
        response.enable_compression()
        return response

    @staticmethod
    def _refuse(status: int, reason: str) -> web.Response:
        more = {"Allow": "GET"} if status == 405 else {}
        response = web.Response(status=status, text=f"{reason}\n", headers=more)
        response.force_close()
        return response

    async def _stream(self, request: web.Request, owner: bool) -> web.StreamResponse:
        stream = web.WebSocketResponse(max_msg_size=LARGEST, heartbeat=PINGS, compress=False, timeout=1.0)
        if not stream.can_prepare(request):
            return self._refuse(426, "here is a websocket")
        place = self._place(request)
        if isinstance(place, Refused):
            return self._refuse(place.status, place.reason)
        if len(place.hub) >= MOST_CLIENTS:
            return self._refuse(503, f"{MOST_CLIENTS} clients look on already")
        client = Client(owner)
        place.hub.join(client)
        writer: asyncio.Task[None] | None = None
        try:
            await stream.prepare(request)
            self._streams.add(stream)
            place.come()
            writer = asyncio.create_task(self._write(stream, client, place.hub, request))
            await self._read(stream, client, place)
        finally:
            place.hub.leave(client)
            place.gone()
            if writer is not None:
                writer.cancel()
        return stream

    @staticmethod
    async def _write(stream: web.WebSocketResponse, client: Client, hub: Hub, request: web.Request) -> None:
        """Send what there is for a client whenever there is something."""
        try:
            while True:
                await client.wake.wait()
                client.wake.clear()
                for message in list(hub.messages(client)):
                    async with asyncio.timeout(SENDING):
                        await (stream.send_bytes(message) if isinstance(message, bytes) else stream.send_str(message))
        except Exception as error:
            if not isinstance(error, TimeoutError | ConnectionError):
                _LOG.exception("a client cannot be told anything any more")
            if request.transport is not None:
                request.transport.abort()

    @staticmethod
    async def _read(stream: web.WebSocketResponse, client: Client, place: Place) -> None:
        """Take what a client sends; a message that no page of ours sends ends its connection."""
        left, then = float(BURST), time.monotonic()
        async for message in stream:
            now = time.monotonic()
            left, then = min(BURST, left + (now - then) * RATE), now
            left -= 1
            if left < 0:
                await stream.close(code=WSCloseCode.POLICY_VIOLATION, message=b"too many messages")
                return
            try:
                if message.type in (WSMsgType.BINARY, WSMsgType.TEXT):
                    place.take(client, message.data)
            except ProtocolError as error:
                await stream.close(code=WSCloseCode.POLICY_VIOLATION, message=str(error).encode()[:120])
                return


class Server(Front):
    """Serves a run to whoever has a token; with a ``desk`` neurons can be put by hand, and files saved."""

    def __init__(self, access: Access, hub: Hub, run: Run, desk: Desk | None = None) -> None:
        super().__init__(access)
        self._looked_on = Place(hub, Reception(hub, run, desk).take, lambda: run.ask(Present()), lambda: None)

    async def _get(self, request: web.Request) -> web.StreamResponse:
        return self._live_page()

    def _place(self, request: web.Request) -> Place | Refused:
        return self._looked_on


class _Closed(asyncio.Protocol):
    """A connection that is closed at once."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Close it."""
        transport.close()
