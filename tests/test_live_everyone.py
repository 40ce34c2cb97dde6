"""The live page for everyone: found by name, read by screen readers, no motion where none is wanted, on a telephone."""

from __future__ import annotations

import asyncio
import io
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
import pytest
from chromium import Page, chromium
from live_window import HEAD, area_of
from PIL import Image
from test_live_browser import STEP, pause, shown
from test_live_looking import TIP, places, told

import neurovis_spec as nv
from neurovis_spec.live.view import view_of

pytestmark = pytest.mark.browser

ROOT = Path(__file__).parents[1]
AXE = ROOT / "node_modules/axe-core/axe.min.js"
SAID = "document.querySelector('#said').textContent"
ROWS = "[...document.querySelectorAll('#found li')]"
NAMES = f"{ROWS}.map(row => row.querySelector('b').textContent)"
CHOSEN = "document.querySelector('#found [aria-selected=true]').textContent"


async def violations(opened: Page) -> list[str]:
    """What axe-core finds in the page as it stands, in short."""
    assert AXE.exists(), "axe-core is not installed: make node_modules/made"
    if not await opened.ask("'axe' in window"):
        await opened.call("Runtime.evaluate", expression=AXE.read_text(encoding="utf-8"))
    found = await opened.ask(
        "axe.run({resultTypes: ['violations']}).then(found => found.violations.map("
        "({id, nodes}) => `${id}: ${nodes.map(({html}) => html.slice(0, 160)).join(' ')}`))"
    )
    assert isinstance(found, list)
    return found


async def tap(opened: Page, *points: tuple[float, float]) -> None:
    """Put fingers where they are said to be; none: take them away."""
    fingers = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(points)]
    await opened.call("Input.dispatchTouchEvent", type="touchStart" if points else "touchEnd", touchPoints=fingers)


@asynccontextmanager
async def telephone(spec: str, folder: Path) -> AsyncIterator[tuple[Page, nv.CompiledNetwork]]:
    """A live view on a telephone."""
    async with shown(spec, folder) as (opened, compiled, _):
        await opened.call("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=2, mobile=True)
        await opened.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=5)
        await opened.call("Page.reload")
        await opened.until(f"document.readyState == 'complete' && {STEP} > 3")
        yield opened, compiled


@pytest.mark.parametrize("theme", ["default", "dark"])
def test_axe_finds_nothing_whatever_is_open(theme: str, tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path, theme) as (opened, _, _):
            assert await violations(opened) == [], "playing"
            await pause(opened)
            await opened.key("]")
            await opened.until(f"!{TIP}.hidden")
            assert await violations(opened) == [], "held"
            await opened.key("t")
            await opened.ask("document.querySelector('#lesion').click()")
            await opened.until("document.querySelector('#turned').children.length")
            assert await violations(opened) == [], "turning"
            await opened.ask("document.querySelector('#save').click()")
            await opened.until("document.activeElement.id == 'svg'")
            assert await violations(opened) == [], "saving"
            await opened.ask("document.querySelector('#present').click()")
            await opened.until("!document.querySelector('#saves').offsetParent")
            await opened.ask("document.querySelector('#picture').focus()")
            await opened.key("f")
            await opened.ask("document.querySelector('#back').click()")
            await opened.ask("document.querySelector('#mend').click()")
            await opened.until("document.querySelectorAll('#others button').length == 5")
            await opened.ask("document.querySelectorAll('#others button')[1].click()")
            await opened.ask("document.querySelectorAll('#others button')[2].click()")
            await opened.until("document.body.classList.contains('compared')")
            await opened.ask("document.querySelectorAll('#others button')[3].click()")
            assert await violations(opened) == [], "a branch is compared, shown beside and named"
            await opened.ask("document.querySelector('#alone').click()")
            await opened.key("Escape")
            await opened.ask("document.querySelector('#picture').focus()")
            await opened.key("/")
            # names are written into the rows with the next frame
            await opened.until(f"{ROWS}.length > 3 && {NAMES}.every(name => name)")
            assert await violations(opened) == [], "searching"
            await opened.key("Escape")
            await opened.key("?")
            assert await violations(opened) == [], "the keys"
            await opened.key("?")
            await opened.key("c")
            typed = (
                "document.querySelector('#measure').value = '{0}'; document.querySelector('#measuring').requestSubmit()"
            )
            await opened.ask(typed.format("K3"))
            await opened.ask(typed.format("mean("))
            await opened.until("document.querySelector('#mismeasured').classList.contains('wrong')")
            assert await violations(opened) == [], "a curve is typed"

    asyncio.run(main())


def test_a_slash_searches_by_name_and_enter_holds(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await pause(opened)
            await opened.key("/")
            await opened.until("document.activeElement.id == 'search'")
            await opened.call("Input.insertText", text="k2")
            await opened.until(f"{NAMES}[0] == 'K2'")
            names = await opened.ask(NAMES)
            assert isinstance(names, list)
            assert "K2 → O" in names
            assert all("k2" in name.lower() for name in names)
            heights = f"{ROWS}.slice(1).map((row) => row.offsetHeight)"
            assert await opened.ask(f"new Set({heights}).size") == 1, "a line each, whatever the digits"
            await opened.key("ArrowDown")
            await opened.until(f"!{CHOSEN}.startsWith('K2 activity')")
            await opened.key("ArrowUp")
            await opened.until(f"{CHOSEN}.startsWith('K2 activity')")
            await opened.key("Enter")
            await opened.until(f"{TIP}.textContent.startsWith('K2\\n')")
            assert await opened.ask("document.activeElement.id") == "search", "the search goes on"
            await opened.ask("document.querySelector('#search').select()")
            await opened.call("Input.insertText", text="K2 -> O")
            await opened.until(f"{NAMES}[0] == 'K2 → O'")
            await opened.key("Enter")
            await opened.until(f"{TIP}.textContent.startsWith('K2 → O\\n')")
            await opened.ask("document.querySelector('#search').select()")
            await opened.call("Input.insertText", text="nobody")
            await opened.until(f"{ROWS}.length == 0")
            assert await opened.ask("document.querySelector('#more').textContent") == "nothing is called so"
            await opened.key("Escape")
            await opened.until("document.activeElement.id == 'picture' && document.querySelector('#outline').hidden")

    asyncio.run(main())


def test_what_is_searched_beside_the_window_is_brought_into_it(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await pause(opened)
            for _ in range(12):
                await opened.key("+")
            await opened.key("/")
            await opened.call("Input.insertText", text="T")
            await opened.until(f"{NAMES}[0] == 'T'")
            await opened.key("Enter")
            await opened.until(f"{TIP}.textContent.startsWith('T\\n')")
            inside = (
                "(({left, top}) => left > 300 && left < innerWidth - 300 && top > 200)({0}.getBoundingClientRect())"
            )
            await opened.until(inside.replace("{0}", TIP))

    asyncio.run(main())


def test_the_outline_reads_names_and_values_of_what_is_held_and_its_inputs_and_outputs(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            step = await pause(opened)
            await opened.key("o")
            await opened.until(
                f"{ROWS}.length == {3 + len(compiled.network.neurons) + len(compiled.network.connections)}"
            )
            await opened.until(f"{NAMES}.slice(0, 3).join() == 'kernels,rhythm,C1'")
            for _ in range(2):
                await opened.key("ArrowDown")
            await opened.until(f"/^C1 activity [+−]/.test({CHOSEN})")
            row = await opened.ask("document.querySelector('#search').getAttribute('aria-activedescendant')")
            assert await opened.ask(f"document.getElementById('{row}').textContent == {CHOSEN}")
            await opened.key("Enter")
            names = compiled.network.connection_names
            wanted = [name.replace("->", "→") for name in names if "C1" in name.replace(" (", " ").split(" ")]
            await opened.until(f"{NAMES}.length == {len(wanted) + 1}")
            await opened.until(f"{ROWS}.every(row => / (activity|weight) /.test(row.textContent))")
            listed = await opened.ask(NAMES)
            assert isinstance(listed, list)
            assert sorted(listed[1:]) == sorted(wanted)
            assert listed[1].endswith("→ C1"), "inputs first"
            value = compiled.run(step + 1).snapshot(step).activity[compiled.network.neurons.names.index("C1")]
            said = await opened.ask(f"{ROWS}[0].textContent.match(/activity ([+−].*?),/)[1].replace('−', '-')")
            assert float(str(said)) == pytest.approx(value, rel=1e-5)

    asyncio.run(main())


def test_it_says_what_is_asked_and_nothing_while_it_plays(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await opened.ask(
                "window.told = []; for (const place of document.querySelectorAll("
                "'[aria-live], [role=status], [role=alert], output')) "
                "new MutationObserver(() => told.push(place.textContent)).observe(place, "
                "{childList: true, characterData: true, subtree: true})"
            )
            step = await opened.ask(STEP)
            await opened.until(f"{STEP} > {step} + 20")
            assert await opened.ask("told") == [], "a step is no news"
            await opened.key("v")
            await opened.until(f"/^Function approximation, step .* playing, neurons 12/.test({SAID})")
            await pause(opened)
            await opened.key("]")
            await opened.until(f"/^C1.*, activity [+−][\\d.]+, tanh/.test({SAID})")
            await opened.key("v")
            await opened.until("told.filter(text => text.startsWith('C1')).length == 2")

    asyncio.run(main())


async def network_at(opened: Page) -> tuple[int, int]:
    """Where the network begins, in pixels of its picture: the leftmost and the topmost of its ink."""
    await asyncio.sleep(0.4)  # for pictures on their way
    high = int(str(await opened.ask("picture.clientHeight")))
    taken = np.asarray(Image.open(io.BytesIO(await opened.shot())).convert("L"))[HEAD : HEAD + high, :800]
    down, across = np.nonzero(taken < 170)
    return int(across.min()), int(down.min())


def test_the_picture_is_moved_by_keys(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await pause(opened)
            before = await network_at(opened)
            await opened.key("h")
            await opened.key("k")
            after = await network_at(opened)
            assert after[0] > before[0] + 20
            assert after[1] > before[1] + 20
            await opened.key("0")
            assert await network_at(opened) == before
            await opened.ask("document.querySelector('#scrub').focus()")
            await opened.key("t")
            await opened.until("!document.querySelector('#turning').hidden")

    asyncio.run(main())


def test_with_reduced_motion_pictures_come_seldom_and_nothing_glides(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            count = (
                "new Promise(done => { const seen = new Set(); const at = setInterval(() => seen.add("
                "document.querySelector('#told').textContent), 10); "
                "setTimeout(() => { clearInterval(at); done(seen.size); }, 2000); })"
            )
            assert int(str(await opened.ask(count))) > 20
            await opened.call(
                "Emulation.setEmulatedMedia", features=[{"name": "prefers-reduced-motion", "value": "reduce"}]
            )
            assert 2 <= int(str(await opened.ask(count))) <= 7, "fewer than three flashes a second"

    asyncio.run(main())


def test_no_panel_lies_on_the_picture_nor_the_tooltip_elsewhere(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await pause(opened)
            await opened.size(1300, 1100)
            edges = "(name => { const {left, right} = document.getElementById(name).getBoundingClientRect(); "
            for key in ("t", "o"):
                await opened.key(key)
            await opened.until(f"{ROWS}.length > 10 && !document.querySelector('#turning').hidden")
            ends = await opened.ask(f"['outline', 'picture', 'turning'].flatMap({edges} return [left, right]; }}))")
            assert ends == [0, 300, 300, 1000, 1000, 1300]
            await opened.ask("document.querySelector('#picture').focus()")
            await opened.key("]")
            await opened.until(f"!{TIP}.hidden")
            await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
            left = await opened.ask(f"{TIP}.getBoundingClientRect().left")
            assert isinstance(left, (int, float))
            found = await opened.ask(
                "(async () => { for (let y = 0; y < 400; y += 4) for (let x = LEFT - 60; x < LEFT + 8; x += 4) {"
                "picture.dispatchEvent(new PointerEvent('pointermove', {clientX: x, clientY: y}));"
                "if (picture.style.cursor) return true; } })()".replace("LEFT", str(left))
            )
            assert found

    asyncio.run(main())


@pytest.mark.parametrize(("theme", "scheme"), [("default", "light"), ("dark", "dark")])
def test_what_the_browser_draws_itself_is_as_dark_as_the_theme(theme: str, scheme: str, tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path, theme) as (opened, _, _):
            assert await opened.ask("getComputedStyle(document.documentElement).colorScheme") == scheme

    asyncio.run(main())


def test_on_a_telephone_two_fingers_come_closer_and_a_tap_holds(tmp_path: Path) -> None:
    async def main() -> None:
        async with telephone("cpg_rbf.yaml", tmp_path) as (opened, compiled):
            await pause(opened)
            area, high = area_of(view_of(compiled, compiled.gains)), await opened.ask("picture.clientHeight")
            await tap(opened, area.within((390, float(str(high))), places(compiled)["O"]))
            await tap(opened)
            await told(opened, "O")
            (tmp_path / "held.png").write_bytes(await opened.shot())
            await opened.key("Escape")
            await opened.until(f"{TIP}.hidden")
            assert await opened.ask("document.documentElement.scrollWidth <= innerWidth")
            assert await violations(opened) == []
            small = await opened.ask(
                "[...document.querySelectorAll('button, input, select')].filter(one => !one.closest('#strips'))"
                ".filter(one => one.offsetWidth).filter("
                "one => one.offsetWidth < 44 || one.offsetHeight < 44).map(one => one.id)"
            )
            assert small == [], "fingers are wider than pointers"
            before = Image.open(io.BytesIO(await opened.shot())).convert("RGB")
            await tap(opened, (195, 300), (195, 380))
            for by in range(0, 100, 10):
                fingers = [{"x": 195, "y": 300 - by, "id": 0}, {"x": 195, "y": 380 + by, "id": 1}]
                await opened.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=fingers)
            await tap(opened)
            await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
            after = Image.open(io.BytesIO(await opened.shot())).convert("RGB")
            after.save(tmp_path / "pinched.png")
            assert before.tobytes() != after.tobytes()
            assert await opened.ask(f"{TIP}.hidden"), "a pinch is no tap"
            await opened.key("0")
            await opened.key("o")
            await opened.until(f"{ROWS}.length > 10")
            panel = await opened.ask("JSON.stringify(document.querySelector('#outline').getBoundingClientRect())")
            box = json.loads(str(panel))
            assert box["width"] == 390
            picture = await opened.ask("document.querySelector('#picture').getBoundingClientRect().bottom")
            assert 200 < float(str(picture)) <= box["top"], "all of the picture is seen above it"
            (tmp_path / "outline.png").write_bytes(await opened.shot())
            assert await violations(opened) == []

    asyncio.run(main())


@pytest.mark.parametrize(("spec", "theme"), [("ring.yaml", None), ("ring.yaml", "default")])
def test_where_nobody_asks_for_a_theme_each_page_is_dark_where_its_system_is(
    spec: str, theme: str | None, tmp_path: Path
) -> None:
    asked = theme is not None or nv.compile(ROOT / "specs" / spec).spec.render is not None

    async def main() -> None:
        async with shown(spec, tmp_path, theme) as (opened, _, access), chromium(tmp_path / "other") as viewer:
            back = "getComputedStyle(document.body).backgroundColor"
            for owner in (True, False):
                page = opened if owner else viewer
                await page.call("Page.navigate", url=access.url(owner))
                for scheme, rgb in (("dark", "rgb(13, 17, 23)"), ("light", "rgb(255, 255, 255)")):
                    scheming = [{"name": "prefers-color-scheme", "value": scheme}]
                    await page.call("Emulation.setEmulatedMedia", features=scheming)
                    await page.until(f"{STEP} > 3")
                    await page.until(f"{back} == '{'rgb(255, 255, 255)' if asked else rgb}'")
                    assert await opened.ask(back) == "rgb(255, 255, 255)" or owner, "the other one is as it was"
            assert viewer.errors == []

    asyncio.run(main())
