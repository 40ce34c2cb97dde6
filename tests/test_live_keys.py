"""The live page for everyone: its keys are listed, the focus is seen, and before the first frame nothing is black."""

from __future__ import annotations

import asyncio
import io
import re
from pathlib import Path

import pytest
from chromium import chromium
from PIL import Image
from test_live_browser import pause, shown

import neurovis_spec as nv
from neurovis_spec.live.access import Access
from neurovis_spec.live.hub import Hub
from neurovis_spec.live.live import listen
from neurovis_spec.live.run import Run
from neurovis_spec.live.server import Server
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.view import view_of

pytestmark = pytest.mark.browser

ROOT = Path(__file__).parents[1]
LIST = "document.querySelector('#keys')"


def test_a_question_mark_lists_the_keys_that_are_documented(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await pause(opened)
            await opened.key("?")
            await opened.until(f"{LIST}.open")
            names = await opened.ask(f"[...{LIST}.querySelectorAll('dt kbd')].map(name => name.textContent)")
            text = (ROOT / "docs/live.md").read_text(encoding="utf-8").partition("| key |")[2].partition("**")[0]
            table, _, gestures = text.partition("| gesture |")
            assert isinstance(names, list)
            assert sorted(names) == sorted(re.findall(r"`(\S+)`", table))
            told = await opened.ask(f"[...{LIST}.querySelectorAll('dt span')].map(name => name.textContent)")
            assert told == re.findall(r"(?m)^\| (?!gesture|---)(.*?) \|", gestures)
            step = await opened.ask("document.querySelector('#told').textContent")
            await opened.key("ArrowRight")
            await opened.key("?")
            await opened.until(f"!{LIST}.open")
            assert await opened.ask("document.querySelector('#told').textContent") == step
            await opened.ask("document.querySelector('#help').click()")
            await opened.until(f"{LIST}.open")
            await opened.ask("document.querySelector('#shut').click()")
            await opened.until(f"!{LIST}.open")

    asyncio.run(main())


@pytest.mark.parametrize("theme", ["default", "dark"])
def test_whatever_has_the_focus_has_an_outline_that_is_seen(theme: str, tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path, theme) as (opened, _, _):
            await pause(opened)
            await opened.key("]")
            await opened.key("t")
            await opened.ask("document.querySelector('#lesion').click()")
            await opened.until("!document.querySelector('#copy').disabled")  # there are events to be copied
            await opened.ask("document.activeElement.blur()")
            seen = set()
            for _ in range(80):
                for kind in ("rawKeyDown", "keyUp"):
                    await opened.call("Input.dispatchKeyEvent", type=kind, key="Tab", windowsVirtualKeyCode=9)
                found = await opened.ask(
                    "((at, of) => [at.id || at.ariaLabel, of(at).outlineStyle, of(at).outlineWidth, "
                    "of(at).outlineColor == of(document.body).color])(document.activeElement, getComputedStyle)"
                )
                assert isinstance(found, list)
                if found[0]:
                    seen.add(found[0])
                    assert found[1:] == ["solid", "2px", True], found
            assert {"picture", "play", "scrub", "turn", "help", "slider-eta", "lesion", "copy"} <= seen

    asyncio.run(main())


def test_before_the_first_frame_it_has_a_background_and_says_that_it_connects(tmp_path: Path) -> None:
    async def main() -> None:
        compiled = nv.compile(ROOT / "specs/cpg_rbf.yaml")
        hub = Hub(asyncio.get_running_loop())
        source, view = SimulatedSource(compiled.simulator()), view_of(compiled, compiled.gains)
        run = Run(source, view, hub.show, lambda: hub.watched)  # which has not begun
        sock = listen("127.0.0.1", 0)
        access = Access("127.0.0.1", sock.getsockname()[1])
        server = Server(access, hub, run)
        await server.start(sock)
        try:
            async with chromium(tmp_path) as opened:
                for scheme, colour in {"light": (255, 255, 255), "dark": (13, 17, 23)}.items():
                    await opened.call(
                        "Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}]
                    )
                    await opened.call("Page.navigate", url=access.url())
                    await opened.until("document.querySelector('#told')?.textContent == 'connecting …'")
                    await opened.until("document.querySelector('#picture').width > 300")
                    taken = Image.open(io.BytesIO(await opened.shot())).convert("RGB")
                    assert taken.getpixel((taken.width // 2, taken.height // 2)) == colour
                assert opened.errors == []
        finally:
            await server.stop()

    asyncio.run(main())
