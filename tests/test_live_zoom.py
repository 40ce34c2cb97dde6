"""Zooming in the live page: near by no line or label grows, at a distance boxes close and have their mean colour."""

from __future__ import annotations

import asyncio
import io
import re
from pathlib import Path

import numpy as np
import pytest
from chromium import Page
from live_window import area_of, fit
from PIL import Image
from test_live_browser import STEP, pause, shown
from test_live_drawing import opened as drawn_alone
from test_live_looking import TIP, places, told
from test_live_strips import scrub
from test_live_undo import undone

from neurovis_spec.live.view import LEVELS, view_of
from neurovis_spec.scene import Spline, Text
from neurovis_spec.scene.encode import looks

pytestmark = pytest.mark.browser


async def picture(opened: Page) -> Image.Image:
    """The window, once all that was asked is drawn."""
    await opened.ask(
        "new Promise(done => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(done)), 300))"
    )
    return Image.open(io.BytesIO(await opened.shot())).convert("RGB")


def test_near_by_discs_grow_while_lines_and_labels_keep_their_weight(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("ring.yaml", tmp_path) as (opened, compiled, _):
            await pause(opened)
            name = compiled.network.neurons.names[0]
            x, y = places(compiled)[name]
            await opened.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=0)
            before = np.array(await picture(opened)).astype(int)
            # four times as close, about the middle of a disc
            delta = -400 * float(np.log(4))
            await opened.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=delta)
            after_image = await picture(opened)
            after_image.save(tmp_path / "near.png")
            after = np.array(after_image).astype(int)

            def ring(pixels: np.ndarray) -> tuple[int, int]:
                """Where the ring of the disc begins to the right of its middle, and how thick it is."""
                row = pixels[round(y) - 20, round(x) :]
                inside = row[8]
                other = np.flatnonzero(np.abs(row[8:] - inside).sum(axis=1) > 60) + 8
                first = int(other[0])
                paper = np.flatnonzero(row[first:].sum(axis=1) > 3 * 235)
                return first, int(paper[0])

            (reach, thick), (far, thin) = ring(before), ring(after)
            assert far > 2.5 * reach, "the disc is larger"
            assert thin <= thick + 3, "its ring is not thicker"
            await opened.key("0")
            again = np.array(await picture(opened)).astype(int)
            assert np.abs(again - before).mean() < 0.5, "and all is as it was"

    asyncio.run(main())


def test_at_a_distance_boxes_are_closed_and_have_the_mean_colour_of_their_neurons(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("hexapod/hexapod.yaml", tmp_path) as (opened, compiled, _):
            step = await pause(opened)
            network, view = compiled.network, view_of(compiled, compiled.gains)
            (instance,) = (entry for entry in network.instances if entry.path == "left1")
            at = np.mean([places(compiled)[network.neurons.names[index]] for index in instance.indices], axis=0)
            await fit(opened, 360, 285)
            small = await picture(opened)
            small.save(tmp_path / "closed.png")
            x, y = area_of(view).within((360, 285), (at[0], at[1]))
            await opened.point(x, y)
            await opened.until(f"{TIP}.textContent.startsWith('left1\\nmean ')")
            words = str(await opened.ask(f"{TIP}.textContent")).split("\n")
            seen = compiled.run(step + 1).snapshot(step)
            levels = looks(network, seen, compiled.gains, view.plan.frame.widest).discs[list(instance.indices)]
            mean = 100 * round(float(np.rint(levels * LEVELS).mean())) / LEVELS
            assert words[1] == f"mean {'+' if mean > 0 else ''}{round(mean)} %".replace("-", "−")
            assert words[2] == f"neurons {instance.count}"
            # a click opens it: its neurons are seen, and the others' boxes are gone
            await opened.click(x, y)
            await picture(opened)
            await opened.until("document.querySelector('#picture').matches(':focus')")
            near = await picture(opened)
            near.save(tmp_path / "opened.png")
            await opened.until(f"{TIP}.hidden")
            await opened.point(x + 1, y)
            await opened.until(f"{TIP}.hidden || !{TIP}.textContent.startsWith('left1\\nmean')")
            await opened.key("0")
            await picture(opened)
            await opened.point(x, y)
            await opened.until(f"!{TIP}.hidden && {TIP}.textContent.startsWith('left1\\nmean ')")

    asyncio.run(main())


def test_dotted_lines_recede_too_where_something_else_is_held(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await pause(opened)
            (signal,) = (group for group in view_of(compiled, compiled.gains).plan.back if "signal" in group.data)
            area, spline = area_of(view_of(compiled, compiled.gains)), signal.shapes[0]
            assert isinstance(spline, Spline)
            points = np.array([area.at(*point) for point in spline.points])
            left, top = np.floor(points.min(axis=0) - 3).tolist()
            right, bottom = np.ceil(points.max(axis=0) + 3).tolist()

            async def ink() -> int:
                """How much darker than paper the surroundings of the line are."""
                pixels = np.array((await picture(opened)).crop((left, top, right, bottom))).astype(int)
                return int((255 * 3 - pixels.sum(axis=2)).clip(0).sum())

            await ink()
            before = await ink()
            await opened.click(*places(compiled)["K2"])
            await told(opened, "K2")
            await opened.point(2, 2)
            held = await ink()
            await opened.key("Escape")
            await opened.click(*places(compiled)["T"])
            await told(opened, "T")
            await opened.point(2, 2)
            of_its_own = await ink()
            assert held < 0.7 * before
            assert of_its_own > 1.2 * held

    asyncio.run(main())


def test_a_picture_that_takes_long_is_made_anew_only_when_the_camera_stands(tmp_path: Path) -> None:
    async def main() -> None:
        async with drawn_alone(tmp_path) as opened:
            await opened.ask(
                "import('/zoom.js').then(({Zoom}) => { window.zoom = new Zoom(); "
                "window.passing = () => one.drawing.isPassing(camera); })"
            )
            assert not await opened.ask("passing()"), "it stands"
            await opened.ask(
                "Object.assign(one.drawing, {cost: 1000, since: performance.now()}); camera.closer(2, 9, 9)"
            )
            assert await opened.ask("passing()")
            assert not await opened.ask("draw() && passing()"), "and stands again"
            same = await opened.ask(
                "(({scene}) => { zoom.use(scene); camera.move(0, 0); camera.zoom = 1; const whole = zoom.seen(camera); "
                "camera.zoom = 4; const near = zoom.seen(camera); camera.move(5, 5); "
                "return [whole === scene, near === scene, zoom.seen(camera) === near]; })(one.drawing)"
            )
            assert same == [True, False, True]
            assert opened.errors == []

    asyncio.run(main())


def test_the_ring_around_what_is_held_keeps_its_weight_near_by(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await pause(opened)
            x, y = places(compiled)["O"]
            await opened.click(x, y)
            await opened.point(5, 5)

            async def ring(x: float, y: float) -> int:
                """How many pixels of the darkest ink lie left of a disc's middle, but for its label."""
                await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
                row = (
                    Image.open(io.BytesIO(await opened.shot()))
                    .convert("L")
                    .crop((0, round(y), round(x) - 20, round(y) + 1))
                )
                return sum(row.histogram()[:60])

            before = await ring(x, y)
            for _ in range(5):  # the pixel under the pointer stays where it is
                await opened.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-160)
            await opened.point(5, 5)
            assert 1 <= before <= 5
            assert 1 <= await ring(x, y) <= 5

    asyncio.run(main())


BOXES = """
neurovis: 1
name: boxes
time: {dt: 0.05, steps: 100}
neurons:
  A: {count: 4, activation: tanh, bias: 1, box: one}
  B: {count: 5, activation: tanh, box: two}
  C: {activation: tanh}
connections:
  A -> B: {pattern: all_to_all, weight: 0.5, plasticity: {hebbian: {rate: 0.01}}}
  B -> C: {pattern: all_to_all, weight: -1}
layout: {engine: layered, direction: right}
"""


def test_a_click_on_a_title_closes_a_box_and_what_runs_to_it_is_added_up(tmp_path: Path) -> None:
    (tmp_path / "boxes.yaml").write_text(BOXES)

    async def main() -> None:
        async with shown(str(tmp_path / "boxes.yaml"), tmp_path) as (opened, compiled, _):
            await opened.until("Number(document.querySelector('#told').textContent.split(' ')[1]) > 9")
            step = await pause(opened)
            seen, at = view_of(compiled, compiled.gains), places(compiled)
            middles = {}
            for box in ("one", "two"):
                (title,) = (group.shapes[0] for group in seen.plan.front if group.id == f"title:{box}")
                assert isinstance(title, Text)
                left, across = title.point[0], {"start": 8, "middle": 0, "end": -8}[title.anchor]
                x, y = area_of(seen).at(left + across, title.point[1] - 3)
                names = [compiled.network.neurons.names[index] for index in seen.plan.boxes[f"box:{box}"]]
                middles[box] = np.mean([at[name] for name in names], axis=0)
                await opened.click(x, y)
                await opened.point(*middles[box])
                await opened.until(f"/^{box}\\nmean .* %\\nneurons {len(names)}/.test({TIP}.textContent)")
            (await picture(opened)).save(tmp_path / "closed.png")
            # what runs between both is one band, of which the sum of this step is told
            (x0, y0), (x1, y1) = middles["one"], middles["two"]
            total = compiled.run(step + 1).snapshot(step).weights[:20].sum()
            assert total > 10.001, "it has learned"
            for aside in range(-30, 31, 3):
                await opened.point((x0 + x1) / 2 - aside * (y1 - y0) / 100, (y0 + y1) / 2 + aside * (x1 - x0) / 100)
                if str(await opened.ask(f"{TIP}.hidden ? '' : {TIP}.textContent")).startswith("one → two"):
                    break
            said = str(await opened.ask(f"{TIP}.textContent")).split("\n")[0]
            assert said.startswith("one → two · 20 connections, sum ")
            assert float(said.split("sum ")[1]) == pytest.approx(total, rel=1e-3)
            # a click opens it again; held in the outline, Enter closes it and opens it
            await opened.click(*middles["one"])
            await opened.point(2, 2)
            await opened.point(*at["A1"])
            await told(opened, "A1")
            await opened.key("o")
            await opened.ask("Object.assign(document.querySelector('#search'), {value: 'two'}).oninput()")
            await opened.until("document.querySelectorAll('#found li').length > 0")
            await opened.key("Enter")
            await opened.ask("document.querySelector('#search').value = ''")
            await opened.key("Escape")
            await opened.until("document.querySelector('#picture').matches(':focus')")
            await opened.key("0")
            await picture(opened)
            closed = []
            for _ in range(2):
                await opened.key("Enter")
                await picture(opened)
                await opened.point(2, 2)
                await opened.point(*at["B3"])
                await opened.until(f"/^(B3|two)/.test({TIP}.textContent)")
                closed.append(str(await opened.ask(f"{TIP}.textContent")).startswith("two"))
            assert closed[0] != closed[1]

    asyncio.run(main())


#: Move the pointer over the picture, from its middle out, until something is told of one box and the other.
BETWEEN = """
(async () => {
  const { left, top, width, height } = picture.getBoundingClientRect();
  for (let far = 0; far < height / 2; far += 4) for (let x = left + 5; x < left + width; x += 9) {
    const y = top + height / 2 + (far % 8 ? far : -far);
    picture.dispatchEvent(new PointerEvent('pointermove', {clientX: x, clientY: y, bubbles: true}));
    if (picture.style.cursor != 'pointer') continue;
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    if (tip.textContent.startsWith('one → two')) return tip.textContent;
  }
  return '';
})()
"""


def test_beside_another_branch_what_is_told_is_of_both(tmp_path: Path) -> None:
    """Of neurons, of closed boxes, and of what runs between these; and what shows the run alone is undone, too."""
    (tmp_path / "boxes.yaml").write_text(BOXES)
    compared = "document.body.classList.contains('compared')"

    async def close(opened: Page, box: str) -> None:
        await opened.key("o")
        await opened.ask(f"Object.assign(document.querySelector('#search'), {{value: '{box}'}}).oninput()")
        await opened.until(f"document.querySelector('#found li')?.textContent.startsWith('{box}')")
        await opened.key("Enter")
        await opened.key("Escape")
        await opened.until("document.querySelector('#picture').matches(':focus')")
        await opened.key("0")
        await opened.key("Enter")
        await opened.until(f"{TIP}.textContent.startsWith('{box}\\nmean ')")

    async def main() -> None:
        async with shown(str(tmp_path / "boxes.yaml"), tmp_path) as (opened, _, _):
            await opened.size(1280, 800)
            await opened.until(f"{STEP} > 12")
            await pause(opened)
            await scrub(opened, 5)
            await opened.until(f"{STEP} == 5")
            await opened.key("]")
            await told(opened, "A1")
            await opened.ask("document.querySelector('#lesion').click()")
            await opened.until("document.querySelector('#others .go') !== null")
            await opened.until(f"/\\nlesioned$/m.test({TIP}.textContent)")
            await opened.ask("document.querySelector('#step').click()")
            await opened.until(f"{STEP} == 6")
            beside = "document.querySelectorAll('#others button')[2].click()"
            await opened.ask(beside)
            await opened.until(f"/^lesioned in A$/m.test({TIP}.textContent)")
            await opened.ask("document.querySelector('#others .go').click()")
            await opened.until(f"!{compared}")
            await opened.ask(beside)
            await opened.until(f"/^activity [+]0.7[^,]*, in B 0$/m.test({TIP}.textContent)")
            await opened.until(f"/^lesioned in B$/m.test({TIP}.textContent)")
            await opened.ask("document.querySelector('#alone').click()")
            await opened.until(f"!{compared}")
            await opened.until(f"!/lesioned|in B/.test({TIP}.textContent)")
            await undone(opened, "A alone")
            await opened.until(f"{compared} && /^lesioned in B$/m.test({TIP}.textContent)")
            for box in ("two", "one"):
                await close(opened, box)
            await opened.until(f"/^mean [+]100 %, in B [+]75 %$/m.test({TIP}.textContent)")
            said = str(await opened.ask(BETWEEN))
            (tmp_path / "both.png").write_bytes(await opened.shot())
            await opened.shot()
            first, *rest = said.split("\n")
            assert first.startswith("one → two · 20 connections, sum 10.")
            assert "lesioned" not in first
            assert rest[0] == "all excite"
            assert re.fullmatch(r"in B sum [\d.]+ \(5 lesioned\); all excite", rest[1])

    asyncio.run(main())
