"""The room that the live page gives the network: most of the window; curves beside it or below, a legend that folds."""

from __future__ import annotations

import asyncio
import base64
import gzip
import io
import json
from pathlib import Path

import numpy as np
import pytest
from chromium import Page, chromium
from live_window import Area, area_of
from PIL import Image
from test_live_browser import SPECS, STEP, pause, shown
from test_live_drawing import opened as drawn_alone

import neurovis_spec as nv
from neurovis_spec.live.access import Access
from neurovis_spec.live.hub import Hub
from neurovis_spec.live.live import listen
from neurovis_spec.live.room import network_rect
from neurovis_spec.live.run import Run
from neurovis_spec.live.server import Server
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.view import View, view_of
from neurovis_spec.scene import Disc, Group, Rectangle, Scene, Spline, Text
from neurovis_spec.themes import THEMES

BOX = "(one => { const {left, top, right, bottom} = one.getBoundingClientRect(); return [left, top, right, bottom]; })"


def test_the_network_of_a_picture_is_all_but_its_title_and_legend() -> None:
    groups = (
        Group((Text((0, 10), "a title", 20, "#000000"),), "title"),
        Group((Rectangle((100, 60), 200, 40, 0, "#ffffff", "#000000", 1),), "box:a"),
        Group((Spline(((120, 80), (120, 30), (280, 30), (280, 80)), "#000000", 2),), "c0", {"connection": "a -> b"}),
        Group((Disc((300, 80), 12, "#ffffff", "#000000", 2),), "n0", {"neuron": "a"}),
        Group((Text((200, 130), "under", 10, "#000000", "middle"),), "title:a"),
        Group((Text((0, 300), "a legend", 20, "#000000"),), "legend"),
    )
    scene = Scene(400, 320, THEMES["default"], "", groups)
    x0, y0, x1, y1 = network_rect(scene)
    assert (x0, x1) == (99, 314)
    assert 40 <= y0 <= 42.5, "the line, and not what bends it"
    assert 132 <= y1 <= 134, "below the baseline of the text"
    assert network_rect(Scene(400, 320, THEMES["default"], "", groups[:1])) == (0, 0, 400, 320)


def discs(view: View) -> dict[str, tuple[float, float, float]]:
    """Where a scene has its discs, and how large."""
    groups = json.loads(gzip.decompress(view.content))["groups"]
    found = [(group["data"]["neuron"], group["shapes"][0]) for group in groups if "neuron" in group["data"]]
    return {name: (*disc["at"], disc["radius"]) for name, disc in found}


async def box(opened: Page, of: str) -> list[float]:
    """The left, the top, the right and the bottom edge of something of the page."""
    found = await opened.ask(f"{BOX}(document.querySelector('{of}'))")
    assert isinstance(found, list)
    return found


async def share(opened: Page, view: View) -> float:
    """How many pixels neurons have, from the first to the last, once a pointer has found one where it is to be."""
    left, top, right, bottom = await box(opened, "#picture")
    area: Area = area_of(view)
    all_discs = discs(view)
    corners = [
        area.within((right - left, bottom - top), area.at(x + way * r, y + way * r))
        for x, y, r in all_discs.values()
        for way in (-1, 1)
    ]
    name, (x, y, _) = next(iter(all_discs.items()))
    await opened.point(*area.within((right - left, bottom - top), area.at(x, y)))
    await opened.until(f"document.querySelector('#tip').textContent.split('\\n')[0] == '{name}'")
    await opened.point(left + 1, top + 1)
    wide, high = np.ptp(np.array(corners), axis=0).tolist()
    return float(wide * high)


async def looked_at(opened: Page, spec: str, folder: Path) -> None:
    """Look at a spec in windows of several shapes."""
    compiled = nv.compile(SPECS / spec)
    view, hub = view_of(compiled, compiled.gains), Hub(asyncio.get_running_loop())
    run = Run(SimulatedSource(compiled.simulator()), view, hub.show, lambda: hub.watched)
    sock = listen("127.0.0.1", 0)
    access = Access("127.0.0.1", sock.getsockname()[1])
    server = Server(access, hub, run)
    await server.start(sock)
    run.start()
    try:
        await opened.size(1280, 800)
        await opened.call("Page.navigate", url=access.url())
        await opened.until(f"{STEP} > 3")
        await pause(opened)
        (folder / f"{compiled.name}.png").write_bytes(await opened.shot())
        assert await share(opened, view) >= 0.45 * 1280 * 800
        assert await opened.ask("titled.textContent") == compiled.network.title
        assert str(await opened.ask("caption.textContent")).startswith("step ")
        picture, past = await box(opened, "#picture"), await box(opened, "#past")
        strip = await box(opened, "#strips canvas")
        is_beside = bool(await opened.ask("document.body.classList.contains('beside')"))
        assert is_beside == (spec == "cpg_rbf.yaml"), "a network that is wide has its curves below it"
        assert past[0] >= picture[2] if is_beside else past[1] >= picture[3]
        assert strip[2] - strip[0] >= (200 if is_beside else 900)
        assert await opened.ask("past.scrollHeight <= past.clientHeight + 4"), "no strip has to be scrolled to"
        cursor, hint = await box(opened, "#cursor"), await box(opened, "#strips .label:nth-last-child(3)")
        assert cursor[3] <= hint[1] + 1, "the line of now runs through no words"
        overlaps = "[...document.querySelectorAll('.scale')].some(one => one.scrollWidth > one.clientWidth + 1)"
        assert not await opened.ask(overlaps), "a number leaves its button where it is"
        for across in (0.02, 0.48, 0.98):
            await opened.point(strip[0] + across * (strip[2] - strip[0]), strip[1] + 10)
            await opened.until("!under.hidden && under.textContent")
            words = await box(opened, "#under > div")
            assert 0 <= words[0] < words[2] <= 1280, "what is said of the curves is not cut"
        await opened.point(picture[0] + 1, picture[1] + 1)
        legend = await box(opened, "#legend")
        assert await opened.ask("document.querySelector('#legend').open") == is_beside
        assert legend[0] >= picture[2] or legend[3] <= picture[1] + 1, "it lies on nothing"
        if is_beside:
            await legends(opened)
        await opened.size(390, 844)
        await opened.until("picture.clientWidth == 390")
        picture, past = await box(opened, "#picture"), await box(opened, "#past")
        assert past[1] >= picture[3]
        await opened.until("document.documentElement.scrollWidth <= innerWidth")
        await opened.call("Page.navigate", url="about:blank")
        await opened.until("location.href == 'about:blank'")
    finally:
        run.end()
        await server.stop()


async def legends(opened: Page) -> None:
    """The legend folds by its key and by a click, and stays so; on a telephone it is folded beside the title."""
    closed = "!document.querySelector('#legend').open"
    shape = "document.querySelector('#legend canvas').getAttribute('aria-label')"
    assert "Thickness" in str(await opened.ask(shape))
    await opened.size(390, 844)
    await opened.until(closed)
    assert (await box(opened, "#legend"))[3] <= (await box(opened, "#picture"))[1] + 1
    await opened.size(1280, 800)
    await opened.until(f"!({closed})")
    await opened.key("i")
    await opened.until(closed)
    await opened.ask("document.querySelector('#legend summary').click()")
    await opened.until(f"!({closed})")
    await opened.size(500, 800)
    await opened.until("picture.clientWidth == 500")
    assert not await opened.ask(closed), "it was opened by hand"
    await opened.key("i")
    await opened.until(closed)


@pytest.mark.browser
def test_the_network_has_the_window_and_curves_stand_where_it_leaves_room(tmp_path: Path) -> None:
    async def main() -> None:
        async with chromium(tmp_path) as opened:
            for spec in ("cpg_rbf.yaml", "stick_insect/stick_insect.yaml", "worm/worm.yaml"):
                await looked_at(opened, spec, tmp_path)
            assert opened.errors == []

    asyncio.run(main())


#: The sizes of labels on discs, in pixels of a page, from further away to near by; and how dark what recedes is there.
SIZES = """import('/zoom.js').then(({ Zoom }) => {
  const zoom = new Zoom();
  zoom.use(one.drawing.scene);
  return [0.3, 0.6, 1, 1.5, 3, 10].map((by) => {
    camera.zoom = by;
    const texts = zoom.seen(camera).groups.flatMap(({ data, shapes }) =>
      data.neuron === undefined ? [] : shapes.filter(({ kind }) => kind === 'text').map(({ font }) => font));
    return Math.max(...texts) * camera.scale;
  });
})"""


@pytest.mark.browser
def test_labels_grow_with_zoom_and_can_be_read_where_they_recede(tmp_path: Path) -> None:
    async def main() -> None:
        async with drawn_alone(tmp_path) as opened:
            sizes = await opened.ask(SIZES)
            assert isinstance(sizes, list)
            assert sizes[:4] == sorted(sizes[:4])
            assert sizes[1] == pytest.approx(2 * sizes[0])
            assert sizes[2] == pytest.approx(sizes[1] / 0.6)
            assert sizes[3] > 1.2 * sizes[2], "larger than in the picture"
            assert sizes[4:] == pytest.approx([28, 28])
            await opened.ask("camera.zoom = 1; one.drawing.near = new Set(['n1']); while (draw()) {}")
            data = await opened.ask("one.context.canvas.toDataURL().split(',')[1]")
            image = Image.open(io.BytesIO(base64.b64decode(str(data)))).convert("L")
            far = json.loads(str(await opened.ask("JSON.stringify(one.drawing.discs.map(({shape}) => shape.at))")))
            for x, y in far[3:9]:
                at = [round(value) for value in (1.5 * x, 1.5 * y)]
                pixels = image.crop((at[0] - 14, at[1] - 14, at[0] + 14, at[1] + 14))
                levels = np.asarray(pixels)
                assert levels.min() < 110 < 200 < levels.max(), "dark ink on what is pale"

    asyncio.run(main())


@pytest.mark.browser
def test_curves_beside_a_network_are_as_high_as_there_is_room_for(tmp_path: Path) -> None:
    """And stay where they are when something is held; with more of them each is lower, but none is hidden."""

    async def main() -> None:
        async with shown("cpg_printed.yaml", tmp_path, curves=True) as (opened, _, _):
            await opened.size(1280, 800)
            heights = "[...document.querySelectorAll('.trace')].map((one) => one.offsetHeight).join()"
            await opened.until(f"{heights} == '150,0'")
            await opened.until("document.querySelector('.trace').height == 150")
            stood = await box(opened, "#strips canvas")
            await opened.key("]")
            await opened.until(f"{heights} == '150,150'")
            assert await box(opened, "#strips canvas") == stood
            for number, measure in enumerate(("C1 - C2", "C1 * C2", "abs(C1)", "abs(C2)"), 3):
                if number == 6:
                    await opened.until(f"parseInt({heights}) < 90")
                    held = await box(opened, "#strips canvas")
                    await opened.key("Escape")
                    await opened.until(f"{heights}.endsWith(',0')")
                    assert await box(opened, "#strips canvas") == held
                    await opened.key("]")
                await opened.ask(f"measure.value = {json.dumps(measure)}; measuring.requestSubmit()")
                await opened.until(f"document.querySelectorAll('.trace').length == {number}")
            await opened.until(f"new Set({heights}.split(',')).size == 1 && parseInt({heights}) < 90")
            assert await opened.ask("past.scrollHeight <= past.clientHeight + 4")
            await opened.size(1280, 1000)
            await opened.until(f"parseInt({heights}) > 90")
        (tmp_path / "bare.yaml").write_text(
            "neurovis: 1\nname: bare\nneurons: {A: {bias: 1}, B: {}}\noutputs: {o: B}\nrender: {legend: false}\n"
        )
        async with shown(str(tmp_path / "bare.yaml"), tmp_path / "bare", curves=True) as (opened, _, _):
            await opened.size(1280, 500)
            await opened.until("document.body.classList.contains('beside')")
            await opened.until(f"parseInt({heights}) > 90")

    asyncio.run(main())
