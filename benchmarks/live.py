"""The live page in Debian's Chromium, headless, without a GPU, beside sigma.js, pixi.js and a canvas that strokes anew.

    (cd benchmarks/page_peers && npm install)
    .venv/bin/python benchmarks/live.py [--quick] [--sizes 200,448] [--no-peers] [--no-frames] [--shots FOLDER]

For each size every contender is measured in turn, several times, in a Chromium of its own, in a window that shows the
picture a pixel a pixel; what is told is the median. Frames shown are different steps that were drawn, of a run that
makes one in 16 ms, with all that belongs to it: the run, the server, the websocket, the page with four curves below its
picture. "page" is the page's drawing alone, with its labels, and the peers draw the same discs and curves (sigma.js:
straight arrows) without labels: these have nothing else to do, and make their colours up, as fast as the display asks
for frames.

From activity to screen: from when a step was made to when the display asks for the frame after the one in which it was
drawn. Bytes are those of all messages. The run's delay is how late each of its steps is made, from the earliest of
them, with nobody looking on, one, and a hundred, one of them stalled; the clients are in a process of their own, draw
nothing and acknowledge every frame, but for the one that never does. What the machine does besides shows in the row
without clients.

A start is the time of the processor that "neurovis live" takes until it prints its URL: where nobody has laid out the
network before, and where its layout is in the user's cache. An edit of the title is that until a page has it.
"""

from __future__ import annotations

import argparse
import asyncio
import gzip
import json
import multiprocessing
import os
import re
import shutil
import statistics
import struct
import sys
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from multiprocessing.synchronize import Event
from pathlib import Path

import aiohttp
import numpy as np
import numpy.typing as npt
from aiohttp import web

import neurovis_spec as nv
from neurovis_spec.live.access import Access
from neurovis_spec.live.hub import Hub
from neurovis_spec.live.live import listen
from neurovis_spec.live.run import Run
from neurovis_spec.live.server import Server
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.view import FINENESS, View, view_of
from neurovis_spec.user_cache import ENVIRONMENT_VARIABLE

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))

from chromium import Page, chromium  # noqa: E402
from live_window import area_of, fit  # noqa: E402

SIZES = ((12, 28), (150, 200), (200, 400), (448, 7379), (1000, 10_000))
#: So many curves are drawn below the picture.
CURVES = 4
PEERS = ("page", "sigma", "pixi", "stroked")
#: WebGL is drawn by the processor.
WEBGL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
_SPEC = """neurovis: 1
name: random
time: {{steps: 100, dt: 0.016}}
neurons: {{R: {{count: {neurons}, activation: tanh, initial: "uniform(-1, 1)", noise: "normal(0, 0.3)"}}}}
connections:
  R -> R: {{weight: "normal(0, {deviation})", pattern: {{random: {{probability: {probability}}}}}}}
render: {{min_weight: 0}}
"""
#: Of these it is measured how long it takes until the page is there.
STARTS = (HERE.parent / "specs/walk/walk.yaml", HERE.parent / "specs/hexapod/hexapod.yaml")
_USE_CASE = HERE.parent / "specs" / "cpg_rbf.yaml"
#: Notes when frames are drawn, which the page says, and when the display asks for the next one.
_NOTES = """
window.notes = { bytes: 0, frames: [], steps: {} };
window.WebSocket = class extends WebSocket {
  constructor(...of) {
    super(...of);
    this.addEventListener('message', ({ data }) => {
      notes.bytes += typeof data === 'string' ? data.length : data.byteLength;
      const view = typeof data === 'string' ? null : new DataView(data);
      if (view && view.getUint8(0) === 2) notes.steps[view.getUint32(4, true)] = view.getFloat64(12, true);
    });
  }
  send(data) {
    if (typeof data !== 'string') {
      const step = notes.steps[new Uint32Array(data)[0]];
      requestAnimationFrame(() => notes.frames.push([step, performance.timeOrigin + performance.now()]));
    }
    super.send(data);
  }
};"""


@dataclass(frozen=True)
class Measured:
    """Frames a second, p95 from activity to screen in ms, bytes a second."""

    frames: float
    late: float
    bytes: float


class Timed(SimulatedSource):
    """Notes when each step was made: by the clock that never goes back, and by that of pages."""

    made: list[float]
    at: dict[int, float]

    def advance(self) -> bool:
        self.made.append(time.perf_counter())
        going = super().advance()
        self.at[self.step] = 1000 * time.time()
        return going


def network(neurons: int, connections: int) -> nv.CompiledNetwork:
    """The use case, or a random network of about that size, which makes a step in 16 ms."""
    if neurons == 12:
        return nv.compile_text(
            _USE_CASE.read_text(encoding="utf-8").replace("dt: 0.05", "dt: 0.016"), folder=_USE_CASE.parent
        )
    probability = connections / neurons**2
    deviation = 1.6 / (neurons * probability) ** 0.5
    return nv.compile_text(_SPEC.format(neurons=neurons, deviation=deviation, probability=probability))


@asynccontextmanager
async def served(compiled: nv.CompiledNetwork, view: View) -> AsyncIterator[tuple[Access, Timed, Hub]]:
    """A live run with its server."""
    hub = Hub(asyncio.get_running_loop())
    source = Timed(compiled.simulator())
    source.made, source.at = [], {}
    run = Run(source, view, hub.show, lambda: hub.watched)
    sock = listen("127.0.0.1", 0)
    access = Access("127.0.0.1", sock.getsockname()[1], viewers=True)
    server = Server(access, hub, run)
    await server.start(sock)
    run.start()
    try:
        yield access, source, hub
    finally:
        run.end()
        await server.stop()


def window(view: View) -> tuple[int, int]:
    frame = view.plan.frame
    return round(frame.width * frame.density), round(frame.height * frame.density)


async def ours(compiled: nv.CompiledNetwork, view: View, seconds: float, shot: Path | None) -> Measured:
    """The live page."""
    width, height = area_of(view).size
    with tempfile.TemporaryDirectory() as folder:
        async with served(compiled, view) as (access, source, _), chromium(Path(folder)) as page:
            await page.size(width, height)
            await page.call("Page.addScriptToEvaluateOnNewDocument", source=_NOTES)
            await page.call("Page.navigate", url=access.url())
            await page.until("window.notes?.frames.length > 10", 60)
            await page.ask("document.querySelectorAll('#strips .pin').forEach((pin) => pin.click())")
            for name in compiled.network.neurons.names[:CURVES]:
                await page.ask(f"measure.value = {json.dumps(name)}; measuring.requestSubmit()")
            await fit(page, width, height)
            assert await page.ask("document.querySelectorAll('#strips .trace').length") == CURVES + 1
            await page.ask("Object.assign(notes, { bytes: 0, frames: [], begun: performance.now() }); 0")
            await asyncio.sleep(seconds)
            found = await page.ask("[notes.frames, notes.bytes, performance.now() - notes.begun]")
            assert isinstance(found, list)
            frames, size, milliseconds = found
            await photographed(page, shot)
            late = [when - source.at[int(step)] for step, when in frames]
            shown = len({step for step, _ in frames})
            return Measured(1000 * shown / milliseconds, float(np.percentile(late, 95)), 1000 * size / milliseconds)


async def peer(name: str, view: View, compiled: nv.CompiledNetwork, seconds: float, shot: Path | None) -> float | None:
    """Frames a second of a peer; None where it draws none."""
    data = json.dumps(of_peers(view, compiled))

    async def scene(request: web.Request) -> web.Response:
        return web.Response(text=data, content_type="application/json")

    app = web.Application()
    app.router.add_get("/scene", scene)
    app.router.add_static("/page", HERE.parent / "neurovis_spec/live/page")
    app.router.add_static("/", HERE / "page_peers")
    runner, sock = web.AppRunner(app), listen("127.0.0.1", 0)
    await runner.setup()
    await web.SockSite(runner, sock).start()
    width, height = window(view)
    try:
        with tempfile.TemporaryDirectory() as folder:
            async with chromium(Path(folder), *WEBGL) as page:
                await page.size(width, height)
                await page.call("Page.navigate", url=f"http://127.0.0.1:{sock.getsockname()[1]}/peers.html")
                await page.until("window.ready", 30)
                found = await page.ask(f"measure({name!r}, {1000 * seconds})")
                await photographed(page, shot)
                return found if isinstance(found, float | int) else None
    except (AssertionError, TimeoutError) as failure:
        print(f"    {name}: {str(failure)[:200]}", file=sys.stderr)
        return None
    finally:
        await runner.cleanup()


def of_peers(view: View, compiled: nv.CompiledNetwork) -> dict[str, object]:
    """What the peers draw: the discs, the curves with their heads, the colours."""
    scene = json.loads(gzip.decompress(view.content))
    source = SimulatedSource(compiled.simulator())
    source.advance()
    sizes = view.glance(source.seen()).widths.tolist()
    names: dict[str, int] = {}
    discs: list[object] = []
    lines: list[object] = []
    for group in scene["groups"]:
        if "neuron" in group["data"]:
            names[group["data"]["neuron"]] = len(discs)
            discs.append([*group["shapes"][0]["at"], group["shapes"][0]["radius"]])
    for group in scene["groups"]:
        if "connection" in group["data"]:
            line, head = group["shapes"][:2]
            (x, y), (dx, dy), notch = head["at"], head["along"], -scene["constants"]["notch"] * head["length"]
            corners = [(0, 0), (-head["length"], head["half"]), (notch, 0), (-head["length"], -head["half"])]
            at = [value for a, b in corners for value in (x + a * dx - b * dy, y + a * dy + b * dx)]
            ends = {"from": names[group["data"]["from"]], "to": names[group["data"]["to"]]}
            lines.append(
                {**ends, "points": line["points"], "width": sizes[int(group["id"][1:])] / FINENESS, "head": at}
            )
    anchors = [
        [int(scene["theme"][name][i : i + 2], 16) for i in (1, 3, 5)] for name in ("negative", "zero", "positive")
    ]
    shares = np.linspace(-1, 1, 255)
    rgb = [np.interp(shares, (-1, 0, 1), channel).round().astype(int) for channel in zip(*anchors, strict=True)]
    fills = (rgb[0] * 65536 + rgb[1] * 256 + rgb[2]).tolist()
    size = {"width": scene["width"], "height": scene["height"], "scale": scene["density"]}
    return {**size, "discs": discs, "lines": lines, "fills": fills, "scene": scene, "widths": sizes}


async def photographed(page: Page, shot: Path | None) -> None:
    if shot is not None:
        shot.write_bytes(await page.shot())


# --- how late the run is


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


async def delays(compiled: nv.CompiledNetwork, view: View, count: int, seconds: float) -> npt.NDArray[np.float64]:
    """How late each step is made, in ms, with so many clients."""
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    async with served(compiled, view) as (access, source, hub):
        url = access.url(count < 2).replace("/?", "/live?")
        others = context.Process(target=clients, args=(url, count, ready), daemon=True)
        if count:
            others.start()
        while len(hub) < count:
            await asyncio.sleep(0.05)
        await asyncio.sleep(1.0)
        begin = len(source.made)
        await asyncio.sleep(seconds)
        made = np.array(source.made[begin:])
        if count:
            others.terminate()
    due = made - np.arange(len(made)) * compiled.network.dt
    late: npt.NDArray[np.float64] = 1000 * (due - due.min())
    return late


# --- how long it takes until a page is there


async def starts(spec: Path) -> list[float]:
    """Seconds of the processor until ``neurovis live --watch`` prints its URL, with a layout that nobody has made
    before and with one that is known, and those that an edit of the title takes; of a copy of an example with a folder
    of its own."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(shutil.copytree(spec.parent, Path(folder) / spec.stem)) / spec.name
        environment = {**os.environ, "XDG_CACHE_HOME": folder, ENVIRONMENT_VARIABLE: ""}
        command = (sys.executable, "-m", "neurovis_spec", "live", str(copy), "--watch", "--no-body")
        found: list[float] = []
        for again in (False, True):
            process = await asyncio.create_subprocess_exec(
                *command, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL, env=environment
            )
            assert process.stdout is not None
            url = (await process.stdout.readline()).decode().strip()
            found.append(processor_time(process.pid))
            if again:
                found.append(await edited(process.pid, url, copy))
            process.terminate()
            await process.wait()
        return found


async def edited(pid: int, url: str, spec: Path) -> float:
    """Seconds of the processor from an edit of the title until a page has it, while the run stands still."""
    async with aiohttp.ClientSession() as session, session.ws_connect(url.replace("/?", "/live?")) as stream:
        await stream.send_str('{"type": "pause"}')

        async def quiet() -> None:
            with suppress(TimeoutError):
                while await stream.receive(1.0):
                    pass

        await quiet()
        before = processor_time(pid)
        text = spec.read_text(encoding="utf-8")
        spec.write_text(re.sub(r"^title:.*$", "title: Another", text, count=1, flags=re.MULTILINE), encoding="utf-8")
        await quiet()
        return processor_time(pid) - before


def processor_time(pid: int) -> float:
    """Seconds of the processor that a process has had."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


# --- all of it


async def measure(
    size: tuple[int, int], rounds: int, seconds: float, peers: tuple[str, ...], shots: Path | None
) -> None:
    """A row of the table."""
    compiled = network(*size)
    view = view_of(compiled, compiled.gains)
    counts = f"{len(compiled.network.neurons):,}/{len(compiled.network.connections):,}"
    found: list[Measured] = []
    others: dict[str, list[float]] = {name: [] for name in peers}
    for turn in range(rounds):

        def shot(name: str, first: bool = turn == 0) -> Path | None:
            return shots / f"{size[0]}-{name}.png" if shots and first else None

        found.append(await ours(compiled, view, seconds, shot("ours")))
        for name in peers:
            frames = await peer(name, view, compiled, seconds, shot(name))
            if frames is not None:
                others[name].append(frames)
    frames = statistics.median(entry.frames for entry in found)
    late = statistics.median(entry.late for entry in found)
    bytes_sent = statistics.median(entry.bytes for entry in found)
    width, height = window(view)
    row = [counts, f"{width} × {height}", f"{frames:.1f}"]
    row += [f"{statistics.median(values):.1f}" if values else "–" for values in others.values()]
    print(
        f"| {' | '.join([*row, f'{late:.0f}', f'{bytes_sent / 1000:,.0f}', f'{os.getloadavg()[0]:.1f}'])} |", flush=True
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one round of two seconds in place of three of five")
    parser.add_argument("--sizes", help="numbers of neurons, of those that there are")
    parser.add_argument("--no-peers", action="store_true", help="the live page alone")
    parser.add_argument("--no-frames", action="store_true", help="the run's delay alone")
    parser.add_argument("--shots", type=Path, help="a folder into which pictures of all windows are written")
    asked = parser.parse_args()
    rounds, seconds = (1, 2.0) if asked.quick else (3, 5.0)
    peers = () if asked.no_peers else PEERS
    if peers and not (HERE / "page_peers/node_modules").exists():
        parser.error("the peers are missing: (cd benchmarks/page_peers && npm install), or --no-peers")
    if asked.shots:
        asked.shots.mkdir(parents=True, exist_ok=True)
    sizes = [size for size in SIZES if not asked.sizes or str(size[0]) in asked.sizes.split(",")]
    sys.setswitchinterval(0.0005)
    if not asked.no_frames:
        heads = ["neurons/connections", "pixels", "frames/s", *peers, "to screen, p95 ms", "kB/s", "load"]
        print(f"| {' | '.join(heads)} |\n|{' --- |' * len(heads)}")
        for size in sizes:
            asyncio.run(measure(size, rounds, seconds, peers, asked.shots))
        print()
    heads = ["start", "first, s of the processor", "layout known", "title edited", "load"]
    print(f"| {' | '.join(heads)} |\n|{' --- |' * len(heads)}")
    for spec in STARTS:
        rows = [asyncio.run(starts(spec)) for _ in range(rounds)]
        values = " | ".join(f"{statistics.median(column):.2f}" for column in zip(*rows, strict=True))
        print(f"| {spec.stem} | {values} | {os.getloadavg()[0]:.1f} |", flush=True)
    print()
    heads = ["clients", "steps", "late by, median ms", "p95", "p99", "load"]
    print(f"| {' | '.join(heads)} |\n|{' --- |' * len(heads)}")
    compiled = network(12, 28)
    view = view_of(compiled, compiled.gains)
    for count in (0, 1, 100):
        late = asyncio.run(delays(compiled, view, count, seconds * rounds))
        values = " | ".join(f"{value:.2f}" for value in np.percentile(late, [50, 95, 99]).tolist())
        print(f"| {count} | {len(late)} | {values} | {os.getloadavg()[0]:.1f} |", flush=True)


if __name__ == "__main__":
    main()
