"""The layout by hand in Chromium: a neuron is dragged, routes follow, what was put is undone, saved and clamped."""

from __future__ import annotations

import asyncio
import io
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from chromium import Page, chromium
from live_window import HEAD, area_of, fit
from PIL import Image
from renderer_conformance import similarity
from scenes import file_of, scene_of
from test_live_browser import SPECS, STEP, pause
from test_live_everyone import tap
from test_live_looking import places

import neurovis_spec as nv
from neurovis_spec.live.access import Access
from neurovis_spec.live.commands import REQUESTS
from neurovis_spec.live.desk import Desk, Written
from neurovis_spec.live.hub import Hub
from neurovis_spec.live.live import listen
from neurovis_spec.live.run import Run
from neurovis_spec.live.server import Server
from neurovis_spec.live.show import Show
from neurovis_spec.live.view import view_of
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record

pytestmark = pytest.mark.browser

TOLD = "document.querySelector('#told').textContent"


@asynccontextmanager
async def at_hand(
    folder: Path, name: str = "cpg_rbf.yaml", owner: bool = True, pins: str = ""
) -> AsyncIterator[tuple[Page, Desk, Path]]:
    """A live view of a copy of an example, which can be saved."""
    where = folder / "spec"
    shutil.copytree(SPECS, where)
    spec = where / name
    if pins:
        spec.write_text(spec.read_text().replace("direction: down}", f"direction: down, {pins}}}"))
    compiled = nv.compile(spec)
    show = Show()
    hub = Hub(asyncio.get_running_loop(), REQUESTS)
    run = Run(*show.stage(compiled), hub.show, lambda: hub.watched)
    written = Written(spec, lambda text: nv.compile_text(text, file=str(spec), folder=spec.parent))
    desk = Desk(compiled, None, show.view, run, hub.keep_soon, written)
    sock = listen("127.0.0.1", 0)
    access = Access("127.0.0.1", sock.getsockname()[1], viewers=True)
    server = Server(access, hub, run, desk)
    await server.start(sock)
    run.start()
    desk.start()
    try:
        async with chromium(folder) as opened:
            size = area_of(show.view(compiled)).size
            await opened.size(*size)
            await opened.call("Page.navigate", url=access.url(owner))
            await opened.until(f"{STEP} >= 0")
            await fit(opened, *size)
            yield opened, desk, spec
            assert opened.errors == []
    finally:
        desk.end()
        run.end()
        await server.stop()


async def drag(
    opened: Page, start: tuple[float, float], end: tuple[float, float], release_it: bool = True, shift: bool = False
) -> None:
    """Press the left button, move, and release it."""
    more = {"modifiers": 8 if shift else 0, "button": "left"}
    await opened.point(*start)
    await opened.call("Input.dispatchMouseEvent", type="mousePressed", x=start[0], y=start[1], clickCount=1, **more)
    for part in range(1, 9):
        x, y = (a + (b - a) * part / 8 for a, b in zip(start, end, strict=True))
        await opened.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, buttons=1, **more)
        await asyncio.sleep(0.02)
    if release_it:
        await release(opened, end)


async def release(opened: Page, at: tuple[float, float]) -> None:
    """Release the left button."""
    await opened.call("Input.dispatchMouseEvent", type="mouseReleased", x=at[0], y=at[1], button="left", clickCount=1)


def above(shot: bytes, x: float, y: float) -> Image.Image:
    """A part of a screenshot, in which lines run to a neuron."""
    image = Image.open(io.BytesIO(shot)).convert("RGB")
    return image.crop((round(x) - 80, round(y) - 80, round(x) + 80, round(y) - 40))


def beside(shot: bytes, x: float, y: float) -> Image.Image:
    """A part of a screenshot left of a neuron's middle: half of its disc, and heads of lines that come to it."""
    image = Image.open(io.BytesIO(shot)).convert("RGB")
    return image.crop((round(x) - 90, round(y) - 90, round(x), round(y) + 30))


def dark(shot: bytes, x: float, y: float) -> int:
    """How many pixels left of a neuron's middle and above it are of the darkest ink."""
    corner = Image.open(io.BytesIO(shot)).convert("L").crop((round(x) - 15, round(y) - 15, round(x), round(y)))
    return sum(corner.histogram()[:60])


#: What the menu of what is saved offers.
CHOICES = (
    "[...document.querySelectorAll('#saves button')].filter((b) => b.offsetParent && !b.disabled).map((b) => b.id)"
)
PUT = "document.querySelector('#placed').textContent"


async def still(opened: Page) -> None:
    """Wait until the page has drawn what it has."""
    await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


async def holds(opened: Page, at: tuple[float, float], name: str) -> None:
    """A pointer finds a neuron there."""
    for _ in range(50):
        await opened.point(at[0] + 1, at[1])
        await opened.point(*at)
        await still(opened)
        found = await opened.ask("document.querySelector('#tip').textContent.split('\\n')[0]")
        if found == name:
            return
        await asyncio.sleep(0.1)
    raise AssertionError(f"{found} is there, not {name}")


async def settled(opened: Page) -> bytes:
    """The picture, once the lines of what is dragged have followed."""
    last, same = b"", 0
    for _ in range(20):
        await asyncio.sleep(1.0)  # routes come from the server, which takes most of that on a slow machine
        now = await opened.shot()
        same = same + 1 if now == last else 0
        if same == 2:
            return now
        last = now
    raise AssertionError("it does not come to rest")


def test_a_neuron_is_dragged_and_put_back(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path) as (opened, desk, _):
            await pause(opened)
            x, y = places(desk.placed.compiled)["O"]
            end = (x + 99, y - 24.75)  # whole steps of what is put by hand
            await opened.ask("tip.style.opacity = 0")
            before = await opened.shot()
            await drag(opened, (x, y), end, release_it=False)
            await holds(opened, end, "O")
            (tmp_path / "dragging.png").write_bytes(dragging := await settled(opened))
            assert desk.placed.moved == (), "it is not put before it is let go"
            await release(opened, end)
            await opened.until(f"{PUT} == 'O'")
            await holds(opened, end, "O")
            (tmp_path / "dragged.png").write_bytes(await opened.shot())
            dragged = await opened.shot()
            assert similarity(above(dragging, *end), above(dragged, *end)) > 0.95, "routes are those that it gets"
            assert similarity(above(before, *end), above(dragged, *end)) < 0.9
            await opened.key("z")
            await opened.until(f"{PUT} == ''")
            await holds(opened, (x, y), "O")

    asyncio.run(main())


def test_near_by_a_neuron_and_its_lines_follow_the_pointer_as_they_are_drawn_there(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path) as (opened, desk, _):
            await pause(opened)
            (x, y), zoom = places(desk.placed.compiled)["O"], 1.25**3
            wide, high = area_of(view_of(desk.placed.compiled, desk.placed.compiled.gains)).size
            at = (wide / 2 + zoom * (x - wide / 2), HEAD + high / 2 + zoom * (y - HEAD - high / 2) - 0.5 * high)
            end = (at[0] - 24.75 * zoom, at[1] - 24.75 * zoom)
            await opened.ask("tip.style.opacity = 0")
            for key in "+++jjjjj":
                await opened.key(key)
            await holds(opened, at, "O")
            before = await opened.shot()
            await drag(opened, at, end, release_it=False)
            dragging = await settled(opened)
            await release(opened, end)
            await opened.until(f"{PUT} == 'O'")
            await holds(opened, end, "O")
            dragged = await opened.shot()
            (tmp_path / "dragging.png").write_bytes(dragging)
            (tmp_path / "dragged.png").write_bytes(dragged)
            assert similarity(beside(before, *end), beside(dragged, *end)) < 0.9
            assert similarity(beside(dragging, *end), beside(dragged, *end)) > 0.95

    asyncio.run(main())


def test_what_is_lesioned_takes_its_cross_along(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path) as (opened, desk, _):
            await pause(opened)
            x, y = places(desk.placed.compiled)["O"]
            await opened.click(x, y)
            await opened.ask("document.querySelector('#lesion').click()")
            await opened.until("document.querySelector('#tip').textContent.includes('lesioned')")
            end = (x - 99, y - 24.75)
            before = await opened.shot()
            await drag(opened, (x, y), end, release_it=False)
            await asyncio.sleep(0.2)
            dragging = await opened.shot()
            (tmp_path / "dragging.png").write_bytes(dragging)
            crossed, along, left = dark(before, x, y), dark(dragging, *end), dark(dragging, x, y)
            assert crossed > 10
            assert along == pytest.approx(crossed, rel=0.3)
            assert left == 0

    asyncio.run(main())


def test_a_drag_is_given_up_by_escape_by_a_second_finger_and_by_another_network(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path) as (opened, desk, _):
            await pause(opened)
            x, y = places(desk.placed.compiled)["O"]
            await drag(opened, (x, y), (x + 60, y), release_it=False)
            await opened.key("Escape")
            await release(opened, (x + 60, y))
            await holds(opened, (x, y), "O")
            await drag(opened, (x, y), (x + 60, y), release_it=False)
            await opened.ask(
                "document.querySelector('#theme').value = 'dark'; theme.dispatchEvent(new Event('change'))"
            )
            await opened.until("getComputedStyle(document.body).backgroundColor == 'rgb(13, 17, 23)'")
            await release(opened, (x + 60, y))
            await holds(opened, (x, y), "O")
            await opened.click(x, y)
            await opened.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=5)
            await tap(opened, (x, y))
            for by in (10, 20, 30):
                fingers = [{"x": x + by, "y": y, "id": 0}]
                await opened.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=fingers)
            await tap(opened, (x + 30, y), (x + 230, y))
            await still(opened)
            await opened.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
            await holds(opened, (x, y), "O")
            assert desk.placed.moved == ()

    asyncio.run(main())


def test_a_mirror_image_follows_a_key(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path, "hexapod/hexapod.yaml") as (opened, desk, _):
            await pause(opened)
            names = desk.placed.compiled.network.neurons.names
            before = desk.placed.layout.positions
            for _ in range(names.index("left1.BC") + 1):
                await opened.key("]")
            await opened.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowUp", modifiers=8)
            await opened.until(f"{PUT} == 'left1.BC'")
            after = desk.placed.layout.positions
            assert {name for name in names if before[name] != after[name]} == {
                f"{side}{number}.BC" for side in ("left", "right") for number in (1, 2, 3)
            }

    asyncio.run(main())


def test_what_was_put_is_written_after_the_difference_is_shown(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path) as (opened, desk, spec):
            text = spec.read_text()
            x, y = places(desk.placed.compiled)["O"]
            await drag(opened, (x, y), (x + 60, y))
            await opened.until(f"{PUT} == 'O'")
            await opened.key("t")
            await opened.ask("document.querySelector('#tospec').click()")
            await opened.until("document.querySelector('#saving').open")
            diff = await opened.ask("document.querySelector('#diff').textContent")
            (tmp_path / "difference.png").write_bytes(await opened.shot())
            assert isinstance(diff, str)
            assert "+  positions:\n" in diff
            assert spec.read_text() == text
            await opened.ask("document.querySelector('#leave').click()")
            await opened.until("!document.querySelector('#saving').open")
            await opened.ask("document.querySelector('#tofile').click()")
            await opened.until("document.querySelector('#diff').textContent.includes('routes:')")
            assert spec.read_text() == text
            await opened.ask("document.querySelector('#write').click()")
            await opened.until("!document.querySelector('#saving').open")
            await opened.until(f"{PUT} == ''")
            assert "file: cpg_rbf.layout.yaml" in spec.read_text()
            assert nv.compile(spec).layout().positions == desk.placed.layout.positions
            assert await opened.ask("document.querySelector('#tospec').disabled")

    asyncio.run(main())


def test_a_place_that_cannot_be_is_told_and_left(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path, pins="positions: {C1: [2.5, 0], O: [3.5, 4]}") as (opened, desk, _):
            await pause(opened)
            found = places(desk.placed.compiled)
            await drag(opened, found["O"], (found["C1"][0] + 5, found["C1"][1]))
            await holds(opened, found["O"], "O")
            await holds(opened, found["C1"], "C1")
            assert desk.placed.moved == ()

    asyncio.run(main())


def test_a_viewer_moves_the_picture_instead(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path, owner=False) as (opened, desk, _):
            x, y = places(desk.placed.compiled)["O"]
            await drag(opened, (x, y), (x + 60, y))
            await holds(opened, (x + 60, y), "O")
            assert desk.placed.moved == ()
            for button in ("unplace", "tospec", "tofile", "svg", "pdf", "npz", "film"):
                assert await opened.ask(f"document.querySelector('#{button}').disabled")
            await opened.ask("document.querySelector('#save').click()")
            await opened.until(f'JSON.stringify({CHOICES}) == \'["png","clip","link","present"]\'')

    asyncio.run(main())


def test_a_disc_dragged_up_with_shift_clamps_its_neuron(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path) as (opened, desk, _):
            await pause(opened)
            x, y = places(desk.placed.compiled)["O"]
            await opened.point(x, y)
            await opened.until("/^activity /m.test(document.querySelector('#tip').textContent)")
            told = await opened.ask("document.querySelector('#tip').textContent.match(/activity (.*)/)[1]")
            assert isinstance(told, str)
            await drag(opened, (x, y), (x, y - 80), shift=True)
            await opened.until("document.querySelectorAll('#turned li').length == 1")
            wanted = float(told.replace("−", "-")) + 0.8  # while it is dragged there are others
            found = r"document.querySelector('#turned li').textContent.match(/clamp O = (-?[\d.]+)/)[1]"
            await opened.until(f"Math.abs({found} - {wanted}) < 0.02")
            assert desk.placed.moved == ()
            (tmp_path / "clamped.png").write_bytes(await opened.shot())

    asyncio.run(main())


def test_the_whole_picture_is_saved_as_png(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path, owner=False) as (opened, desk, _):
            await opened.until(f"{STEP} > 5")
            await opened.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
            for _ in range(6):
                await opened.key("+")
            await opened.ask("document.querySelector('#png').click()")
            saved = tmp_path / "cpg_rbf.png"
            for _ in range(200):
                if saved.exists():
                    break
                await asyncio.sleep(0.02)
            picture, compiled = Image.open(saved).convert("RGB"), desk.placed.compiled
            scene = scene_of(compiled, record(compiled.network, Course(8)).snapshot(7), desk.placed.layout)
            drawn = Image.open(io.BytesIO(file_of(scene, ".png"))).convert("RGB")
            assert picture.size == drawn.size
            assert similarity(picture, drawn) >= 0.95, "the step is about the same"

    asyncio.run(main())


def test_the_owner_has_the_picture_a_film_and_the_recording_as_files(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path) as (opened, desk, _):
            await opened.until(f"{STEP} > 30")
            step = await pause(opened)
            await opened.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
            assert await opened.ask("document.querySelectorAll('#turning :is(#svg, #film, #link)').length") == 0

            async def saved(button: str, name: str) -> bytes:
                await opened.ask(f"document.querySelector('#{button}').click()")
                for _ in range(300):
                    if (tmp_path / name).exists():
                        break
                    await asyncio.sleep(0.05)
                return (tmp_path / name).read_bytes()

            assert b"<svg" in (picture := await saved("svg", "cpg_rbf.svg"))
            (tmp_path / "cpg_rbf.svg").unlink()
            assert len(await saved("film", "cpg_rbf.svg")) > len(picture)
            await opened.until("document.querySelector('#film').textContent == 'film of the last'")
            assert (await saved("pdf", "cpg_rbf.pdf")).startswith(b"%PDF")
            await opened.ask("document.querySelector('#seconds').value = 1")
            for kind, begin in (("gif", b"GIF8"), ("webm", bytes.fromhex("1a45dfa3")), ("mp4", b"ftyp")):
                await opened.ask(f"document.querySelector('#kind').value = '{kind}'")
                assert begin in (await saved("film", f"cpg_rbf.{kind}"))[:8]
                await opened.until("document.querySelector('#film').textContent == 'film of the last'")
            await saved("npz", "cpg_rbf.npz")
            found, run = nv.load(tmp_path / "cpg_rbf.npz"), record(desk.placed.compiled.network, Course(step + 1))
            assert (found.activity == run.activity).all()

    asyncio.run(main())


def test_the_menu_of_what_is_saved_goes_by_keys_and_writes_the_spec_with_events(tmp_path: Path) -> None:
    async def main() -> None:
        async with at_hand(tmp_path) as (opened, _, spec):
            text = spec.read_text()
            await opened.until(f"{STEP} > 5")
            step = await pause(opened)
            await opened.key("]")
            await opened.ask("document.querySelector('#save').focus(), document.activeElement.click()")
            await opened.until("document.activeElement.id == 'svg'")
            await opened.until(f"document.querySelector('#upto').textContent == 'up to step {step}'")
            assert await opened.ask("document.querySelector('#withevents').disabled")
            edges = "['#saves', '#save'].map((one) => document.querySelector(one).getBoundingClientRect())"
            assert await opened.ask(f"(([menu, bar]) => 0 <= menu.top && menu.bottom <= bar.top)({edges})"), "upward"
            await opened.key("ArrowDown")
            await opened.until("document.activeElement.id == 'pdf'")
            await opened.key("ArrowUp")
            await opened.key("ArrowUp")
            await opened.until("document.activeElement.id == 'present'")
            await opened.key("Escape")
            await opened.until("document.activeElement.id == 'save'")
            assert await opened.ask(STEP) == step, "arrows go through the menu, not the run"
            assert await opened.ask("document.querySelector('#parted').offsetParent || !part.hidden"), (
                "it is held still"
            )

            await opened.ask("document.querySelector('#lesion').click()")
            await opened.until("!document.querySelector('#withevents').disabled")
            await opened.ask("document.querySelector('#withevents').click()")
            await opened.until("document.querySelector('#saving').open")
            assert "+events:\n" in str(await opened.ask("document.querySelector('#diff').textContent"))
            await opened.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
            await opened.ask("document.querySelector('#download').click()")
            for _ in range(200):
                if (tmp_path / spec.name).exists():
                    break
                await asyncio.sleep(0.02)
            fetched = (tmp_path / spec.name).read_text()
            assert spec.read_text() == text
            await opened.ask("document.querySelector('#write').click()")
            await opened.until("!document.querySelector('#saving').open")
            assert spec.read_text() == fetched == text + f"\nevents:\n  - {{at: {step + 1}, lesion: C1}}\n"

    asyncio.run(main())
