"""The live page's drawing by itself, in Chromium: only what lies otherwise is worked out anew, and then what is shown
is what a drawing from scratch shows."""

from __future__ import annotations

import asyncio
import gzip
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from aiohttp import web
from chromium import Page, chromium

import neurovis_spec as nv
from neurovis_spec.live.live import listen
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.view import view_of

pytestmark = pytest.mark.browser

ROOT = Path(__file__).parents[1]
MODULES = ROOT / "neurovis_spec/live/page"

#: A drawing of the scene in a window, one from scratch of the same, and how many of their pixels differ.
SCRIPT = """(async () => {
  const { Drawing } = await import('/draw.js'), { Camera } = await import('/camera.js');
  const { scene, look } = await (await fetch('/scene')).json();
  window.look = look;
  window.camera = Object.assign(new Camera(), { size: [scene.width, scene.height], window: [1104, 876] });
  const make = () => {
    const canvas = Object.assign(document.createElement('canvas'), { width: 1104, height: 876 });
    const context = canvas.getContext('2d', { willReadFrequently: true });
    return { drawing: new Drawing(structuredClone(scene)), context };
  };
  window.one = make();
  window.draw = () => one.drawing.draw(one.context, camera, look);
  window.apart = (change) => {
    const other = make();
    change(other.drawing);
    other.drawing.draw(other.context, camera, look);
    const [a, b] = [one, other].map(({ context }) => context.getImageData(0, 0, 1104, 876).data);
    let count = 0;
    for (let at = 0; at < a.length; at++) count += a[at] !== b[at];
    return count;
  };
  window.worked = () => one.drawing.mosaic.coverage.stamp;
  window.settle = (change = () => {}) => {
    const before = worked();
    change(one.drawing);
    while (draw()) {}
    return { worked: worked() - before, apart: apart(change) };
  };
  return draw();
})()"""


@asynccontextmanager
async def opened(folder: Path) -> AsyncIterator[Page]:
    """A page with ``one``, a drawing of an example at a step at which it learns."""
    compiled = nv.compile(ROOT / "specs/cpg_rbf.yaml")
    view, source = view_of(compiled, compiled.gains), SimulatedSource(compiled.simulator())
    for _ in range(40):
        source.advance()
    look = view.glance(source.seen())
    names = ("discs", "lines", "widths", "glows", "kinds")
    numbers = {name: getattr(look, name).tolist() for name in names} | {"caption": look.caption}
    scene = json.dumps({"scene": json.loads(gzip.decompress(view.content)), "look": numbers})
    sock = listen("127.0.0.1", 0)
    app = web.Application()

    async def blank(request: web.Request) -> web.Response:
        return web.Response(text="<!doctype html><link rel=icon href=data:,>", content_type="text/html")

    async def given(request: web.Request) -> web.Response:
        return web.Response(text=scene, content_type="application/json")

    app.router.add_get("/", blank)
    app.router.add_get("/scene", given)
    app.router.add_static("/", MODULES)
    runner = web.AppRunner(app)
    await runner.setup()
    await web.SockSite(runner, sock).start()
    try:
        async with chromium(folder) as page:
            await page.call("Page.navigate", url=f"http://127.0.0.1:{sock.getsockname()[1]}/")
            await page.until("document.readyState == 'complete' && location.port")
            assert await page.ask(SCRIPT) is False
            yield page
            assert page.errors == []
    finally:
        await runner.cleanup()


def test_what_lies_otherwise_alone_is_worked_out_anew(tmp_path: Path) -> None:
    async def main() -> None:
        async with opened(tmp_path) as page:
            tiles = await page.ask("one.drawing.mosaic.tiles.length")
            assert await page.ask("worked()") == tiles
            assert isinstance(tiles, int)
            nothing = {"worked": 0, "apart": 0}
            assert await page.ask("settle()") == nothing
            # other colours, of all: no tile
            assert await page.ask("look.lines = look.lines.map((v) => -v); look.discs.reverse(); settle()") == nothing
            # a wider line with a wider glow, and one that is thinner: the tiles that they lie in
            for change in ("look.widths[3] *= 2; look.glows[3] = 400", "look.widths[3] /= 4; look.glows[3] = 0"):
                few = await page.ask(f"{change}; settle()")
                assert isinstance(few, dict)
                assert few["apart"] == 0
                assert 0 < few["worked"] < tiles / 5
            # a route by hand, where it was and where it is
            route = await page.ask(
                "settle((drawing) => { const line = drawing.lines.find(({ index }) => index === 3), { head } = line;"
                "line.points = line.points.map((v) => v + 20);"
                "line.head = { ...head, at: head.at.map((v) => v + 20) }; })"
            )
            assert isinstance(route, dict)
            assert route["apart"] == 0
            assert 0 < route["worked"] < tiles / 5

    asyncio.run(main())


@pytest.mark.parametrize(
    "change",
    [
        "(drawing) => { [drawing.near, drawing.held] = [new Set(['n1', 'n5', 'c4']), 'n5']; }",
        "() => { look.kinds = look.kinds.map((kind, at) => at % 3 ? kind : kind | 2); }",
        "() => { look.kinds = look.kinds.map((kind) => kind ^ 1); }",
        "(drawing) => { const { shape } = drawing.discs[4]; shape.at = [shape.at[0] + 30, shape.at[1] - 20]; }",
        "() => { camera.closer(1.7, 300, 400); }",
        "() => { camera.closer(0.4, 300, 400); camera.move(31.5, -7.25); }",
    ],
)
def test_what_has_changed_is_shown_as_from_scratch(change: str, tmp_path: Path) -> None:
    async def main() -> None:
        async with opened(tmp_path) as page:
            before = await page.ask("one.context.canvas.toDataURL()")
            # the other drawing is made after the change
            await page.ask(f"({change})(one.drawing); while (draw()) {{}}")
            assert await page.ask("one.context.canvas.toDataURL()") != before
            of_drawing = change if change.startswith("(drawing)") else "() => {}"
            assert await page.ask(f"apart({of_drawing})") == 0

    asyncio.run(main())


def test_a_picture_that_takes_long_follows_the_camera_before_it_is_worked_out(tmp_path: Path) -> None:
    async def main() -> None:
        async with opened(tmp_path) as page:
            await page.ask("one.drawing.cost = 1e6; camera.move(16, 8)")
            worked = await page.ask("worked()")
            assert await page.ask("draw()") is True
            assert await page.ask("worked()") == worked
            assert await page.ask("one.context.getImageData(480, 200, 1, 1).data[3]") == 255
            moved = await page.ask("apart(() => {})")
            # the camera stands still: all of it
            assert await page.ask("draw()") is False
            assert await page.ask("apart(() => {})") == 0
            assert isinstance(moved, int)
            assert moved < 1104 * 876 * 4 / 20

    asyncio.run(main())


def test_tiles_that_are_left_are_worked_out_in_the_next_frames(tmp_path: Path) -> None:
    async def main() -> None:
        async with opened(tmp_path) as page:
            await page.ask(
                "const now = performance.now.bind(performance); let i = 0; performance.now = () => now() + ++i * 100"
            )
            await page.ask("look.widths = look.widths.map((width) => width * 2)")
            worked = await page.ask("worked()")
            assert isinstance(worked, int)
            assert await page.ask("draw()") is True
            assert await page.ask("worked()") == worked + 1
            await page.ask("while (draw()) {}")
            assert await page.ask("apart(() => {})") == 0

    asyncio.run(main())
