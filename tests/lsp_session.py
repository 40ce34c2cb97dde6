"""A client and a server of the language server protocol in one process, which speak through a pair of sockets."""

from __future__ import annotations

import asyncio
import socket
import sys
import threading
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from pygls.io_ import run_async
from pytest_lsp import ClientServerConfig, LanguageClient
from pytest_lsp.client import make_test_lsp_client

from neurovis_spec.lsp.server import make_server


@asynccontextmanager
async def session() -> AsyncIterator[LanguageClient]:
    """A client of a server that begins with it and ends with it."""
    server, client, stop = make_server(), make_test_lsp_client(), threading.Event()
    speaking = []
    for end, protocol in zip(socket.socketpair(), (server.protocol, client.protocol), strict=True):
        reader, writer = await asyncio.open_connection(sock=end)
        protocol.set_writer(writer)
        speaking.append((writer, asyncio.create_task(run_async(stop, reader, protocol))))
    try:
        yield client
    finally:
        await client.shutdown_async(None)
        stop.set()
        for writer, _ in speaking:
            writer.close()
        await asyncio.gather(*(task for _, task in speaking))
        shutdown: Callable[[], None] = server.shutdown  # has no annotations of its own
        shutdown()


@asynccontextmanager
async def process() -> AsyncIterator[LanguageClient]:
    """The same with ``neurovis lsp`` as an editor starts it."""
    config = ClientServerConfig(server_command=[sys.executable, "-m", "neurovis_spec", "lsp", "--stdio"])
    client = await config.start()
    assert isinstance(client, LanguageClient)
    try:
        yield client
    finally:
        await client.shutdown_session()
        stop: Callable[[], Awaitable[object]] = client.stop  # has no annotations of its own
        await stop()
