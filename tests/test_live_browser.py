"""The live page in Chromium: the same picture as ``render``, play, pause, step and back, and nothing in its console."""

from __future__ import annotations

import asyncio
import io
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from chromium import Page, chromium
from live_window import area_of, fit
from PIL import Image
from renderer_conformance import similarity
from scenes import file_of, scene_of
from test_scene_bundles import LAYERS

import neurovis_spec as nv
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.live.access import Access
from neurovis_spec.live.commands import REQUESTS
from neurovis_spec.live.hub import Hub
from neurovis_spec.live.live import listen
from neurovis_spec.live.protocol import findings_message
from neurovis_spec.live.run import Run
from neurovis_spec.live.server import Server
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import Capabilities
from neurovis_spec.live.view import view_of
from neurovis_spec.scene.fading import snapshots_of

pytestmark = pytest.mark.browser

SPECS = Path(__file__).parents[1] / "specs"
STEP = "Number(document.querySelector('#told')?.textContent.split(' ')[1])"


@asynccontextmanager
async def shown(
    spec: str, folder: Path, theme: str | None = None, takes: frozenset[str] | None = None, curves: bool = False
) -> AsyncIterator[tuple[Page, nv.CompiledNetwork, Access]]:
    """A live view of an example, opened in a window that shows its network a pixel a pixel; of what its source takes
    only these messages count, where they are given. Unless ``curves`` are wanted, those that it begins with are
    unpinned."""
    compiled = nv.compile(SPECS / spec)
    view = view_of(compiled, compiled.gains, theme)
    hub = Hub(asyncio.get_running_loop(), REQUESTS if takes is None else frozenset())
    source = SimulatedSource(compiled.simulator())
    if takes is not None:
        source.capabilities = Capabilities(takes)
    run = Run(source, view, hub.show, lambda: hub.watched)
    sock = listen("127.0.0.1", 0)
    access = Access("127.0.0.1", sock.getsockname()[1], viewers=True)
    server = Server(access, hub, run)
    await server.start(sock)
    run.start()
    width, height = area_of(view).size
    try:
        async with chromium(folder) as opened:
            await opened.size(width, height)
            await opened.call("Page.navigate", url=access.url())
            await opened.until(f"{STEP} >= 0")
            if not curves:
                await opened.ask("document.querySelectorAll('#strips .pin').forEach((pin) => pin.click())")
            await fit(opened, width, height)
            yield opened, compiled, access
            assert opened.errors == []
    finally:
        run.end()
        await server.stop()


async def pause(opened: Page) -> int:
    await opened.ask("document.querySelector('#play').click()")
    await opened.until("document.querySelector('#play').getAttribute('aria-label') == 'play'")
    before: object = None
    step = await opened.ask(STEP)
    while step != before:  # on a busy machine the last frames come late
        before, step = step, await opened.ask(f"new Promise(done => setTimeout(() => done({STEP}), 150))")
    assert isinstance(step, int)
    return step


@pytest.mark.parametrize(
    ("spec", "theme"), [("cpg_rbf.yaml", "default"), ("cpg_rbf.yaml", "dark"), ("hexapod/hexapod.yaml", "default")]
)
def test_the_page_shows_the_picture_that_render_draws(spec: str, theme: str, tmp_path: Path) -> None:
    async def main() -> None:
        async with shown(spec, tmp_path, theme) as (opened, compiled, _):
            await opened.until(f"{STEP} > 30")
            step = await pause(opened)
            taken = Image.open(io.BytesIO(await opened.shot())).convert("RGB")
            settings = RenderSettings(theme=theme) if spec == "cpg_rbf.yaml" else compiled.network.render
            snapshot = compiled.run(step + 1).snapshot(step)
            scene = scene_of(compiled, snapshot, settings=settings)
            drawn = Image.open(io.BytesIO(file_of(scene, ".png"))).convert("RGB")
            area = area_of(view_of(compiled, compiled.gains, theme))
            seen, drawn = area.seen(taken), area.drawn(drawn)
            seen.save(tmp_path / "seen.png")
            drawn.save(tmp_path / "drawn.png")
        assert similarity(seen, drawn) >= 0.98

    asyncio.run(main())


JOINED = """neurovis: 1
name: joined
time: {dt: 0.05, steps: 400}
models: {cell: {state: {v: {initial: 0, derivative: drive - v}}, activity: v}}
synapses:
  gap: {signal: weight*(pre.v - post.v), sign: 0}
  graded: {parameters: {E: 1}, signal: weight*pre.v*(E - post.v), sign: E}
neurons: {N: {count: 5, model: cell, initial: {v: i - 2}, bias: i}}
connections:
  - N -> N: {weight: 0.5, synapse: gap, pattern: chain, symmetric: true}
  - N1 -> N3: {weight: 0.4, synapse: {graded: {E: -1}}}
  - N2 -> N4: {weight: 0.2, synapse: graded}
  - N3 -> N5: {weight: 0.3, symmetric: true}
  - N1 -> N5: {weight: -0.2, symmetric: true}
"""


STYLED = """neurovis: 1
name: styled
neurons: {N: {count: 4, bias: 0.1}}
connections:
  N -> N:
    edges:
      csv: |
        from,to,weight,kind
        N1,N2,2,a
        N2,N3,-3,b
        N3,N4,1,c
        N4,N1,2,d
        N1,N3,2,b
      columns: {from: from}
render: {lines: {style: {column: kind}}}
"""


#: Layers of which activities stay small and weights stay, as bundles do.
CALM = LAYERS.replace("bias: 1}", "bias: 1, activation: tanh}").replace("rate: 0.01", "rate: 0")
CALM = CALM.replace("count: 8}", "count: 8, activation: tanh}")


@pytest.mark.parametrize("text", [JOINED, STYLED, CALM], ids=["ends", "styles", "bundles"])
def test_the_page_shows_how_lines_end_their_styles_and_what_stands_for_many(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, number in {"_ALL": 20, "_MOST_LINES": 20, "_LINES_EACH": 1}.items():
        monkeypatch.setattr(f"neurovis_spec.scene.shown.{name}", number)
    (tmp_path / "joined.yaml").write_text(text)

    async def main() -> None:
        async with shown(str(tmp_path / "joined.yaml"), tmp_path) as (opened, compiled, _):
            await opened.until(f"{STEP} > 5")
            step = await pause(opened)
            taken = Image.open(io.BytesIO(await opened.shot())).convert("RGB")
            (snapshot,) = snapshots_of(compiled.network, compiled.run(step + 1), [step])
            drawn = Image.open(io.BytesIO(file_of(scene_of(compiled, snapshot), ".png"))).convert("RGB")
            area = area_of(view_of(compiled, compiled.gains))
            seen, drawn = area.seen(taken), area.drawn(drawn)
        seen.save(tmp_path / "seen.png")
        drawn.save(tmp_path / "drawn.png")
        assert similarity(seen, drawn) >= 0.98

    asyncio.run(main())


DENSE = """neurovis: 1
name: dense
neurons: {R: {count: 120, activation: tanh, initial: "uniform(-1, 1)"}}
connections:
  R -> R: {weight: "normal(0, 0.2)", pattern: {random: {probability: 0.14}}}
render: {min_weight: 0}
"""


def test_two_thousand_lines_are_those_of_render_on_a_display_of_two_pixels_a_pixel(tmp_path: Path) -> None:
    async def main() -> None:
        (tmp_path / "dense.yaml").write_text(DENSE)
        async with shown(str(tmp_path / "dense.yaml"), tmp_path) as (opened, compiled, _):
            step = await pause(opened)
            scene = scene_of(compiled, compiled.run(step + 1).snapshot(step))
            area = area_of(view_of(compiled, compiled.gains))
            width, height = area.size
            await fit(opened, width, height, density=2.0)
            await opened.shot()  # headless, a page that stands still notices another display when it is looked at
            await opened.until(f"document.querySelector('#picture').width == {2 * width}")
            await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
            taken = Image.open(io.BytesIO(await opened.shot())).convert("RGB")
            sharp = replace(scene, density=2 * scene.density)
            drawn = Image.open(io.BytesIO(file_of(sharp, ".png"))).convert("RGB")
            seen, drawn = area.seen(taken, 2), area.drawn(drawn, 2)
            seen.save(tmp_path / "seen.png")
            drawn.save(tmp_path / "drawn.png")
            assert len(compiled.network.connections) > 1900
        assert similarity(seen, drawn) >= 0.98

    asyncio.run(main())


def test_it_plays_stands_still_steps_on_and_back(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await opened.until(f"{STEP} > 3")
            step = await pause(opened)
            await opened.ask("document.querySelector('#step').click()")
            await opened.until(f"{STEP} == {step + 1}")
            for _ in range(3):
                await opened.ask("document.querySelector('#back').click()")
            await opened.until(f"{STEP} == {step - 2}")
            await opened.key("ArrowRight")
            await opened.until(f"{STEP} == {step - 1}")
            await opened.key("ArrowLeft")
            await opened.until(f"{STEP} == {step - 2}")
            scrub = "document.querySelector('#scrub')"
            assert await opened.ask(f"[{scrub}.min, {scrub}.max, {scrub}.value].map(Number)") == [0, step + 1, step - 2]
            await opened.ask(f"{scrub}.value = 1; {scrub}.dispatchEvent(new Event('input'))")
            await opened.until(f"{STEP} == 1")
            await opened.ask("const speed = document.querySelector('#speed'); speed.value = 'max'; speed.onchange()")
            await opened.key(" ")
            await opened.until(f"{STEP} > 500")
            await opened.key(" ")
            await opened.until("document.querySelector('#play').getAttribute('aria-label') == 'play'")
            await opened.key("Home")
            await opened.until(f"{STEP} == 0")

    asyncio.run(main())


def test_a_viewer_has_no_controls(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, access):
            await opened.call("Page.navigate", url=access.url(owner=False))
            await opened.until("document.querySelector('#play')?.disabled")
            await opened.until(f"{STEP} > 3")

    asyncio.run(main())


def test_it_is_opened_again_and_shows_the_same_sharp_on_a_display_of_two_pixels_a_pixel(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            step = await pause(opened)
            await opened.call("Page.reload")
            await opened.until(f"document.readyState == 'complete' && {STEP} == {step}")
            await opened.size(700, 800, density=2.0)
            await opened.until("document.querySelector('#picture').width == 1400")
            await opened.size(700, 800)
            await opened.key("ArrowLeft")
            await opened.until("document.querySelector('#picture').width == 700")

    asyncio.run(main())


def test_it_connects_again_by_itself(tmp_path: Path) -> None:
    async def main() -> None:
        compiled = nv.compile(SPECS / "cpg_rbf.yaml")
        hub = Hub(asyncio.get_running_loop())
        run = Run(
            SimulatedSource(compiled.simulator()), view_of(compiled, compiled.gains), hub.show, lambda: hub.watched
        )
        sock = listen("127.0.0.1", 0)
        access = Access("127.0.0.1", sock.getsockname()[1])
        server = Server(access, hub, run)
        await server.start(sock)
        run.start()
        try:
            async with chromium(tmp_path) as opened:
                await opened.call("Page.navigate", url=access.url())
                await opened.until(f"{STEP} > 2")
                assert await opened.ask("document.querySelector('#lost').hidden")
                hub.tell(findings_message("warning: this and that", False))
                await opened.until("document.querySelector('#noticed').textContent == 'warning: this and that'")
                assert await opened.ask("document.querySelector('#findings').checkVisibility()")
                await opened.ask("document.querySelector('#seen').click()")
                assert not await opened.ask("document.querySelector('#findings').checkVisibility()")
                await opened.ask(
                    "const speed = document.querySelector('#speed'); speed.value = 'max'; speed.onchange()"
                )
                await opened.until("/^×[0-9.]+ · in NumPy$/.test(document.querySelector('#rate').textContent)")
                await opened.ask("speed.value = '0.25'; speed.onchange()")
                await opened.until("document.querySelector('#rate').textContent == 'in NumPy'")
                await server.stop()
                await opened.until("document.querySelector('#told').textContent.startsWith('not connected')")
                assert await opened.ask("document.querySelector('#lost').checkVisibility()")
                server = Server(access, hub, run)
                await server.start(listen("127.0.0.1", access.port))
                await opened.until(f"{STEP} > 2 && document.querySelector('#lost').hidden")
                assert all("WebSocket connection" in error for error in opened.errors)
        finally:
            run.end()
            await server.stop()

    asyncio.run(main())
