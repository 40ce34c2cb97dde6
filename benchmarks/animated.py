"""Moving SVG in a browser: frames a second that headless Chromium shows of 128 steps of use case 1 inside ``<img>``.

``.venv/bin/python benchmarks/animated.py``, with ``chromium`` installed. The film has 60 frames a second, as many as
the browser's screen, so that each frame shows another step. What counts is a frame for which the picture was painted
anew and that reached the screen, by a trace of the browser (its DevTools) over some seconds.
"""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
from itertools import pairwise
from pathlib import Path

from tornado.websocket import websocket_connect

import neurovis_spec as nv

_USE_CASE = Path(__file__).parents[1] / "specs" / "cpg_rbf.yaml"
_STEPS, _FROM, _FPS, _SECONDS = 128, 1000, 60, 6.0
_CATEGORIES = "cc,viz,devtools.timeline"
_PAINTED, _SHOWN = "RasterTask", "SubmitCompositorFrameToPresentationCompositorFrame"


async def traced(port: Path) -> list[tuple[float, str]]:
    """When tiles were painted, and when frames reached the screen, in seconds."""
    while not port.exists():
        await asyncio.sleep(0.1)
    await asyncio.sleep(2)
    number, path = port.read_text().split()
    socket = await websocket_connect(f"ws://127.0.0.1:{number}{path}", max_message_size=1 << 30)
    start = {"categories": _CATEGORIES, "transferMode": "ReportEvents"}
    await socket.write_message(json.dumps({"id": 1, "method": "Tracing.start", "params": start}))
    await asyncio.sleep(_SECONDS)
    await socket.write_message(json.dumps({"id": 2, "method": "Tracing.end"}))
    events: list[tuple[float, str]] = []
    while True:
        message = json.loads(await socket.read_message() or "")
        if message.get("method") == "Tracing.dataCollected":
            told = message["params"]["value"]
            events += [(e["ts"] / 1e6, _PAINTED) for e in told if e["name"] == _PAINTED]
            events += [(e["ts"] / 1e6, _SHOWN) for e in told if e["name"] == _SHOWN and e["ph"] == "e"]
        if message.get("method") == "Tracing.tracingComplete":
            return sorted(events)


def shown(chromium: str, folder: Path, page: str) -> list[float]:
    """When frames that were painted anew reached the screen."""
    (folder / "page.html").write_text(page, encoding="utf-8")
    command = [
        chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run",
        "--disable-component-update", "--disable-sync", "--remote-debugging-port=0", "--remote-allow-origins=*",
        "--window-size=1280,960", f"--user-data-dir={folder / 'user'}", (folder / "page.html").as_uri(),
    ]  # fmt: skip
    quiet = subprocess.DEVNULL
    browser = subprocess.Popen(command, stdout=quiet, stderr=quiet, start_new_session=True)
    try:
        events = asyncio.run(asyncio.wait_for(traced(folder / "user" / "DevToolsActivePort"), 60))
    finally:
        os.killpg(browser.pid, signal.SIGTERM)
        browser.wait()
        time.sleep(0.5)
    times, painted = list[float](), False
    for when, what in events:
        if what == _SHOWN and painted:
            times.append(when)
        painted = what == _PAINTED
    return times


def main() -> None:
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("this needs chromium")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        nv.compile(_USE_CASE).animate(folder / "film.svg", start=_FROM, steps=_STEPS, fps=_FPS)
        size = (folder / "film.svg").stat().st_size / 1024
        times = shown(chromium, folder, '<!doctype html><body style="margin:0"><img src="film.svg">')
        lasted = sorted(1000 * (after - before) for before, after in pairwise(times))
        print(f"{_STEPS} steps of use case 1, {size:.0f} KiB: {(len(times) - 1) / (times[-1] - times[0]):.1f} frames/s")
        print(f"99 of 100 stood for at most {lasted[int(0.99 * len(lasted))]:.0f} ms, the longest {lasted[-1]:.0f} ms")


if __name__ == "__main__":
    main()
