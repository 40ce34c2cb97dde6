"""How late the run of a live view is, with nobody looking on, one, and a hundred, one of them stalled.

Steps are due every 20 ms; how late each is made is told in milliseconds (median, p95, p99), from the earliest of them.
The clients are in a process of their own, draw nothing and acknowledge every frame, but for one that never does. What
the machine does besides shows most in the row without clients: subtract it, or measure on a quiet one.

    .venv/bin/python benchmarks/live_run.py [SPEC]
"""

from __future__ import annotations

import asyncio
import multiprocessing
import struct
import sys
import time
from multiprocessing.synchronize import Event

import aiohttp
import numpy as np

import neurovis_spec as nv
from neurovis_spec.live.access import Access
from neurovis_spec.live.hub import Hub
from neurovis_spec.live.live import listen
from neurovis_spec.live.run import Run
from neurovis_spec.live.server import Server
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.view import view_of

DT, SECONDS = 0.02, 10.0


class Timed(SimulatedSource):
    """Notes when each step was made."""

    made: list[float]

    def advance(self) -> bool:
        self.made.append(time.perf_counter())
        return super().advance()


async def look_on(url: str, clients: int) -> None:
    async def client(session: aiohttp.ClientSession, stalled: bool) -> None:
        async with session.ws_connect(url, max_msg_size=1 << 26) as stream:
            async for message in stream:
                if isinstance(message.data, bytes) and message.data[0] == 2 and not stalled:
                    await stream.send_bytes(struct.pack("<I", struct.unpack_from("<I", message.data, 4)[0]))

    async with aiohttp.ClientSession(connector=aiohttp.TCPConnector(limit=0)) as session:
        await asyncio.gather(*(client(session, clients > 1 and not number) for number in range(clients)))


def clients(url: str, count: int, ready: Event) -> None:
    ready.set()
    asyncio.run(look_on(url, count))


async def measured(compiled: nv.CompiledNetwork, count: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    hub = Hub(asyncio.get_running_loop())
    source = Timed(compiled.simulator())
    source.made = []
    run = Run(source, view_of(compiled, compiled.gains), hub.show, lambda: hub.watched)
    sock = listen("127.0.0.1", 0)
    access = Access("127.0.0.1", sock.getsockname()[1], viewers=True)
    server = Server(access, hub, run)
    await server.start(sock)
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    others = context.Process(
        target=clients, args=(access.url(count < 2).replace("/?", "/live?"), count, ready), daemon=True
    )
    if count:
        others.start()
    run.start()
    while len(hub) < count:
        await asyncio.sleep(0.05)
    await asyncio.sleep(1.0)
    begin = len(source.made)
    await asyncio.sleep(SECONDS)
    made = np.array(source.made[begin:])
    run.end()
    if count:
        others.terminate()
    await server.stop()
    due = made - np.arange(len(made)) * DT
    late: np.ndarray[tuple[int], np.dtype[np.float64]] = 1000 * (due - due.min())
    return late


def main() -> None:
    spec = sys.argv[1] if len(sys.argv) > 1 else "specs/cpg_rbf.yaml"
    from pathlib import Path

    text = Path(spec).read_text(encoding="utf-8")
    compiled = nv.compile_text(text.replace("dt: 0.05", f"dt: {DT}"), folder=Path(spec).parent)
    sys.setswitchinterval(0.0005)
    for count in (0, 1, 100):
        late = asyncio.run(measured(compiled, count))
        median, high, highest = np.percentile(late, [50, 95, 99]).tolist()
        print(f"{count:4} clients: {len(late)} steps, late by {median:.2f}, p95 {high:.2f}, p99 {highest:.2f} ms")


if __name__ == "__main__":
    main()
