"""The gallery: a page of networks with small pictures; a click opens one, in a room of its own.

In: what is listed, what draws and opens it. Out: a server that runs until it is told to end. What is asked for is a
number in the list, never a path.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from html import escape
from itertools import groupby
from pathlib import Path

from aiohttp import web

from neurovis_spec.interrupts import Ended
from neurovis_spec.live.access import PAGE, PICTURE, Access, Refused
from neurovis_spec.live.commands import Present
from neurovis_spec.live.hub import Client
from neurovis_spec.live.listing import Listed
from neurovis_spec.live.live import heed_signals
from neurovis_spec.live.protocol import Themed, command_of
from neurovis_spec.live.rooms import MOST, Open, Rooms
from neurovis_spec.live.server import Front, Place, policy
from neurovis_spec.live.thumbnails import Draw, Thumbnails


class Gallery(Front):
    """Serves what is listed to whoever has a token."""

    def __init__(self, access: Access, listed: tuple[Listed, ...], draw: Draw, open_: Open) -> None:
        super().__init__(access)
        self._listed, self._rooms, self._thumbnails = listed, Rooms(listed, open_), Thumbnails(draw)
        self._drawing = ThreadPoolExecutor(1)  # one after the other, and in the way of nothing else
        self._gallery = page_of(listed)
        self._gallery_headers = {"Content-Security-Policy": policy(self._gallery)}

    async def stop(self) -> None:
        """Say goodbye to everybody, and end all that runs."""
        await super().stop()
        self._drawing.shutdown(wait=False, cancel_futures=True)
        self._rooms.end()

    def _number(self, request: web.Request) -> int | None:
        """The number of what is asked for; None where none is listed by it."""
        text = request.query.get("spec", "")
        number = int(text) if len(text) <= 6 and text.isascii() and text.isdigit() else -1
        return number if 0 <= number < len(self._listed) else None

    async def _get(self, request: web.Request) -> web.StreamResponse:
        number = self._number(request)
        if request.path == PAGE and "spec" not in request.query:
            return web.Response(text=self._gallery, content_type="text/html", headers=self._gallery_headers)
        if number is None:
            return self._refuse(404, "nothing is listed by this number")
        if request.path != PICTURE:
            return self._live_page()
        loop = asyncio.get_running_loop()
        found = await loop.run_in_executor(self._drawing, self._thumbnails.of, self._listed[number])
        if found.words:
            return web.Response(text=found.words, content_type="text/plain", charset="utf-8")
        response = web.Response(text=found.svg, content_type="image/svg+xml", charset="utf-8")
        response.enable_compression()
        return response

    def _place(self, request: web.Request) -> Place | Refused:
        number = self._number(request)
        if number is None:
            return Refused(404, "nothing is listed by this number")
        room = self._rooms.room(number)
        if room is None:
            return Refused(503, f"{MOST} networks are looked at already")

        def take(client: Client, message: bytes | str) -> None:
            if room.reception is not None:
                room.reception.take(client, message)
            elif isinstance(message, str):  # nothing is shown yet, but the theme of what will be is asked for once
                wish = command_of(message)
                if isinstance(wish, Themed):
                    room.hub.dress(client, wish)

        def come() -> None:
            if room.run is not None:
                room.run.ask(Present())

        return Place(room.hub, take, come, lambda: self._rooms.left(room))


def page_of(listed: tuple[Listed, ...]) -> str:
    """The page that lists them."""
    sections = []
    for heading, some in groupby(enumerate(listed), key=lambda one: one[1].heading):
        cards = "\n".join(
            f'<li><a data-spec="{number}"><span class="picture" aria-hidden="true"></span>'
            f"<span>{escape(one.name)}</span></a><pre hidden></pre></li>"
            for number, one in some
        )
        sections.append(f"<section><h2>{escape(heading)}</h2><ul>\n{cards}\n</ul></section>")
    frame = (Path(__file__).parent / "gallery.html").read_text(encoding="utf-8")
    return frame.replace("<!-- listed -->", "\n".join(sections))


async def serve(gallery: Gallery, sock: socket.socket, announce: Callable[[], None]) -> None:
    """Serve until a signal asks for an end. Raises Ended."""
    loop = asyncio.get_running_loop()
    ended: asyncio.Future[int] = loop.create_future()
    heed_signals(loop, ended)
    await gallery.start(sock)
    try:
        announce()
        number = await ended
    finally:
        await gallery.stop()
    raise Ended(number)
