"""The widget in Chromium, in a page that passes messages on as a notebook does: it plays, and is turned."""

from __future__ import annotations

import asyncio
import base64
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
import pytest
from aiohttp import web
from chromium import Page, chromium
from PIL import Image

import neurovis_spec as nv
from neurovis_spec.notebook.widget import LiveWidget

pytestmark = pytest.mark.browser

ROOT = Path(__file__).parents[1]
HOST = """<!doctype html><title>host</title><link rel="icon" href="data:,"><div id="cell"></div>
<script type="module">
import widget from './widget.js';
const socket = new WebSocket(`ws://${location.host}/comm`), listeners = {};
const bytes = (text) => new DataView(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
const known = {title: 'a network', height: 400};
const model = {
  get: (name) => known[name],
  on: (event, listener) => { listeners[event] = listener; },
  off: (event) => { delete listeners[event]; },
  send: (content, _, buffers = []) => socket.send(JSON.stringify(
    [content, buffers.map((buffer) => btoa(String.fromCharCode(...new Uint8Array(buffer))))])),
};
socket.onmessage = ({data}) => {
  const [content, buffers] = JSON.parse(data);
  listeners['msg:custom']?.(content, buffers.map(bytes));
};
socket.onopen = () => { window.end = widget.render({model, el: document.querySelector('#cell')}); };
window.taller = () => { known.height = 500; listeners['change:height'](); };
</script>"""


@asynccontextmanager
async def shown(widget: LiveWidget, folder: Path) -> AsyncIterator[Page]:
    """A page with the widget in it; what it sends and is sent goes as in a notebook."""
    loop = asyncio.get_running_loop()

    async def comm(request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse()
        await socket.prepare(request)

        def send(content: object, buffers: list[bytes] | None = None) -> None:
            text = json.dumps([content, [base64.b64encode(buffer).decode() for buffer in buffers or []]])
            asyncio.run_coroutine_threadsafe(socket.send_str(text), loop)

        widget.send = send
        async for message in socket:
            content, buffers = json.loads(message.data)
            widget._take_message(widget, content, [base64.b64decode(buffer) for buffer in buffers])
        return socket

    async def page(_: web.Request) -> web.Response:
        return web.Response(text=HOST, content_type="text/html")

    async def script(_: web.Request) -> web.Response:
        return web.Response(text=widget._esm, content_type="text/javascript")

    app = web.Application()
    app.add_routes([web.get("/", page), web.get("/widget.js", script), web.get("/comm", comm)])
    runner = web.AppRunner(app)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    try:
        async with chromium(folder) as opened:
            await opened.size(900, 520)
            await opened.call("Page.navigate", url=f"http://127.0.0.1:{runner.addresses[0][1]}/")
            yield opened
            assert opened.errors == []
    finally:
        widget.close()
        await runner.cleanup()


async def until(true: Callable[[], bool]) -> None:
    """Wait until a function gives True."""
    for _ in range(750):
        if true():
            return
        await asyncio.sleep(0.02)
    raise AssertionError("never")


@asynccontextmanager
async def inside(opened: Page) -> AsyncIterator[None]:
    """What is asked in the block is asked of the widget's frame, which is closed off from the page around it."""
    frames = list[str]()
    for _ in range(500):
        if frames:
            break
        await asyncio.sleep(0.02)
        targets = (await opened.call("Target.getTargets"))["targetInfos"]
        assert isinstance(targets, list)
        frames = [target["targetId"] for target in targets if target["type"] == "iframe"]
    attached = await opened.call("Target.attachToTarget", targetId=frames[0], flatten=True)
    around, opened.session = opened.session, str(attached["sessionId"])
    for name in ("Runtime", "Log"):
        await opened.call(f"{name}.enable")
    try:
        yield
    finally:
        opened.session = around


def coloured(png: bytes, folder: Path) -> int:
    """How many of the pixels are neither white nor grey."""
    (folder / "shot.png").write_bytes(png)
    pixels = np.array(Image.open(folder / "shot.png").convert("RGB"), dtype=int)
    return int((np.ptp(pixels, axis=2) > 60).sum())


def test_a_network_plays_in_a_cell_and_is_turned_on_both_sides(tmp_path: Path) -> None:
    async def main() -> None:
        widget = nv.compile(ROOT / "specs/cpg_rbf.yaml").live()
        async with shown(widget, tmp_path) as opened:
            await until(lambda: widget.step > 20)
            assert coloured(await opened.shot(), tmp_path) > 1000
            async with inside(opened):
                await opened.ask("document.querySelector('#play').click()")
                await until(lambda: not widget.playing)
                step = widget.step
                await opened.ask("document.querySelector('#step').click()")
                await until(lambda: widget.step == step + 1)
                await asyncio.to_thread(setattr, widget, "alpha", 1.2)
                alpha = "document.querySelector('#sliders input[type=number]')"
                await opened.until(f"{alpha}.value == '1.2'")
                await opened.ask(f"{alpha}.value = 1.1; {alpha}.dispatchEvent(new Event('change'))")
                await until(lambda: bool(widget.alpha == 1.1))
            await opened.ask("const box = document.querySelector('#cell > div'); box.append(box.firstChild)")
            async with inside(opened):
                step = widget.step
                await opened.until(f"document.querySelector('#told')?.textContent == 'step {step}'")
                await opened.ask("document.querySelector('#step').click()")
                await until(lambda: widget.step == step + 1)
            assert len(widget._session._frames) == 1
            await opened.ask("window.taller()")
            assert await opened.ask("document.querySelector('#cell > div').offsetHeight") == 500
            await opened.ask("window.end()")
            await until(lambda: not widget._session._frames)
            assert await opened.ask("document.querySelector('#cell').childElementCount") == 0

    asyncio.run(main())


def test_the_page_takes_the_wheel_once_it_is_clicked_and_may_copy(tmp_path: Path) -> None:
    async def wheel(opened: Page) -> object:
        """Whether the page has taken it."""
        async with inside(opened):
            await opened.ask(
                "addEventListener('wheel', (event) => { window.taken = event.defaultPrevented; }); taken = -1"
            )
        await opened.call("Input.dispatchMouseEvent", type="mouseWheel", x=300, y=200, deltaX=0, deltaY=40)
        async with inside(opened):
            await opened.until("taken !== -1")
            return await opened.ask("taken")

    async def main() -> None:
        widget = nv.compile(ROOT / "specs/cpg_rbf.yaml").live()
        async with shown(widget, tmp_path) as opened:
            await until(lambda: widget.step > 5)
            assert await wheel(opened) is False
            await opened.click(30, 30)
            assert await wheel(opened) is True
            async with inside(opened):
                assert (
                    await opened.ask("navigator.clipboard.writeText('events').then(() => 'copied', String)") == "copied"
                )

    asyncio.run(main())


def test_a_recording_waits_for_play_and_ends(tmp_path: Path) -> None:
    async def main() -> None:
        compiled = nv.compile(ROOT / "specs/cpg_rbf.yaml")
        widget = compiled.live(compiled.run(30), play=False)
        async with shown(widget, tmp_path) as opened:
            await opened.until("!!document.querySelector('iframe[srcdoc]')")
            async with inside(opened):
                await opened.until("document.querySelector('#told').textContent.startsWith('step 0')")
                assert await opened.ask("document.querySelector('#scrub').max") == "29"
                assert not widget.playing
                await opened.ask("document.querySelector('#play').click()")
                await until(lambda: widget.step == 29)

    asyncio.run(main())


def test_the_page_in_a_cell_has_what_the_page_has(tmp_path: Path) -> None:
    """A curve from the start, branches side by side, undo, other views. A link, which needs an address, and saved
    views, which need a file, are not offered."""
    trace = "document.querySelector('.trace').getAttribute('aria-label')"
    press = "document.querySelector('{0}').click()"
    beside = "[...document.querySelectorAll('#others button')].find((one) => one.textContent == 'A | B')"
    compared = "document.body.classList.contains('compared')"

    async def main() -> None:
        widget = nv.compile(ROOT / "specs/cpg_rbf.yaml").live()
        async with shown(widget, tmp_path) as opened:
            await until(lambda: widget.step > 60)
            async with inside(opened):
                await opened.until(f"{trace}.startsWith('O and T from step 0')")
                await opened.ask(press.format("#play"))
                await until(lambda: not widget.playing)
                await opened.ask("scrub.value = 30; scrub.dispatchEvent(new Event('input'))")
                await until(lambda: widget.step == 30)
                await opened.until("!document.querySelector('#branch').disabled")
                before = widget.alpha
                await asyncio.to_thread(setattr, widget, "alpha", 1.2)
                await opened.until("document.querySelectorAll('#others .branch').length == 1")
                await opened.ask(press.format("#play"))
                await until(lambda: widget.step > 50)
                await opened.ask(press.format("#play"))
                await until(lambda: not widget.playing)
                await opened.until(f"{trace}.includes('behind it how it went before')")
                await opened.ask(f"{beside}.click()")
                await opened.until(f"{compared} && other.width == picture.width")
                await opened.ask(press.format("#undo"))
                await opened.until(f"!{compared}")
                await opened.ask(press.format("#others .go"))
                await until(lambda: bool(widget.alpha == before))
                await opened.ask(press.format("#undo"))
                await until(lambda: bool(widget.alpha == 1.2))
                for view in ("matrix", "pathways"):
                    await opened.ask(press.format(f"#{view}"))
                    await opened.until(f"document.querySelector('#{view}').ariaPressed == 'true'")
                offered = "['link', 'keep', 'svg', 'film'].filter((id) => !document.getElementById(id).hidden).join()"
                assert await opened.ask(offered) == "svg,film"

    asyncio.run(main())
