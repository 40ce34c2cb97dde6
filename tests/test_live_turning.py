"""Turning in the live page: sliders, clamps and lesions take effect, are listed, taken back, and copied as events."""

from __future__ import annotations

import asyncio
import gzip
import io
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from chromium import Page
from live_window import area_of
from PIL import Image
from test_live_browser import SPECS, STEP, pause, shown
from test_live_looking import TIP, places, told

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.live.declared import declared
from neurovis_spec.live.view import view_of
from neurovis_spec.themes import THEMES

pytestmark = pytest.mark.browser

SLIDER = "document.querySelector('#slider-eta')"
TURNED = "[...document.querySelectorAll('#turned li')].map(row => row.firstChild.textContent)"
EVENTS = "document.querySelector('#events').value"
LESIONED = "/^lesioned$/m"


def test_what_is_declared_has_its_bounds_and_description() -> None:
    head = "neurovis: 1\nname: x\n"
    given = "parameters: {a: {value: 2, max: 3, unit: V, description: gain}, c: 3}\nneurons: {A: {count: c, bias: a}}\n"
    assert declared(nv.compile_text(head + given))["parameters"] == [
        {"name": "a", "value": 2.0, "low": None, "high": 3.0, "description": "gain", "unit": "V"}
    ]
    follows = "parameters: {a: 2, b: {value: 1, min: -a, max: 2*a}}\nneurons: {A: {bias: a + b}}\n"
    assert declared(nv.compile_text(head + follows))["parameters"][1] == {
        "name": "b", "value": 1.0, "low": -2.0, "high": 4.0, "description": "", "unit": "",
    }  # fmt: skip


async def press(opened: Page, name: str) -> None:
    """Click in the middle of a button."""
    script = f"(box => [box.x + box.width / 2, box.y + box.height / 2])({name}.getBoundingClientRect())"
    at = await opened.ask(script)
    assert isinstance(at, list)
    await opened.click(*at)


async def turned(opened: Page, *wanted: str) -> None:
    """Wait until just this is listed, without the steps."""
    rows = f"{TURNED}.map(words => words.split(': ')[1])"
    await opened.until(f"JSON.stringify({rows}) == JSON.stringify({list(wanted)})")


def test_a_field_without_a_number_within_its_bounds_turns_nothing_and_says_so(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await pause(opened)
            await opened.key("]")
            await opened.key("t")
            field = "document.querySelector('#slider-eta + input')"
            for bad in ("7", ""):
                await opened.ask(f"document.activeElement.blur(), {field}.value = '{bad}'")
                await opened.ask(f"{field}.dispatchEvent(new Event('change'))")
                assert await opened.ask(f"document.activeElement == {field} && {field}.matches(':invalid')")
            await opened.ask("document.querySelector('#saves').showPopover()")
            for name, bad, button in (("clampto", "", "clamp"), ("seconds", "999", "film"), ("seconds", "", "film")):
                await opened.ask(f"document.querySelector('#{name}').value = '{bad}'")
                await opened.ask(f"document.querySelector('#{button}').click()")
                assert await opened.ask("document.activeElement.id") == name
            await opened.ask("document.querySelector('#clampto').value = '0.5'")
            await opened.ask("document.querySelector('#clamp').click()")
            await turned(opened, "clamp C1 = 0.5")

    asyncio.run(main())


def test_a_slider_sets_a_parameter_within_its_bounds_and_a_double_click_resets_it(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            step = await pause(opened)
            await opened.key("t")
            await opened.until("!document.querySelector('#turning').hidden")
            assert await opened.ask(f"[{SLIDER}.min, {SLIDER}.max, {SLIDER}.value].map(Number)") == [0, 1, 0.01]
            words = await opened.ask(f"{SLIDER}.closest('.slider').textContent")
            assert words == "etalearning rate"
            await opened.ask(f"{SLIDER}.value = 0.5; {SLIDER}.dispatchEvent(new Event('change'))")
            await turned(opened, "eta = 0.5")
            await opened.ask(f"{SLIDER}.value = 0.25; {SLIDER}.dispatchEvent(new Event('change'))")
            await turned(opened, "eta = 0.25")
            assert await opened.ask(EVENTS) == f"events:\n  - {{at: {step + 1}, set: {{eta: 0.25}}}}\n"
            await opened.ask(f"{SLIDER}.dispatchEvent(new Event('dblclick'))")
            await turned(opened, "eta = 0.01")
            await opened.until(f"{SLIDER}.value == 0.01")
            await opened.ask(f"{SLIDER}.value = 0.5; {SLIDER}.dispatchEvent(new Event('change'))")
            await turned(opened, "eta = 0.5")
            await opened.ask("document.querySelector('#turned button').click()")
            await turned(opened)
            await opened.until(f"{SLIDER}.value == 0.01")
            await opened.key("t")
            await opened.until("document.querySelector('#turning').hidden")

    asyncio.run(main())


def test_what_is_held_is_clamped_lesioned_and_mended_and_taken_back(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await pause(opened)
            await opened.click(*places(compiled)["K2 -> O"])
            await told(opened, "K2 → O")
            await press(opened, "document.querySelector('#turn')")
            await opened.until("document.querySelector('#parted').textContent == 'K2 -> O'")
            assert await opened.ask("document.querySelector('#clamps').hidden")
            weigh, number = "document.querySelector('#weigh')", "document.querySelector('#weight [type=number]')"
            await opened.until(f"{weigh}?.checkVisibility() && Number({number}.value) != 0")
            before = await opened.ask(f"{number}.value")
            assert f"weight {float(str(before)):+.6g}".replace("-", "−") in await told(opened, "K2 → O")
            await opened.ask(f"{weigh}.value = 0.4; {weigh}.onchange()")
            await turned(opened, "weight of K2 -> O = 0.4")
            assert ", set: {K2 -> O: 0.4}}" in str(await opened.ask(EVENTS))
            await opened.ask("document.querySelector('#step').click()")
            await opened.until(f"Math.abs({number}.value - 0.4) < 0.02 && {TIP}.textContent.includes('weight +0.')")
            await opened.ask("document.querySelector('#turned button').click()")
            await opened.until(f"{TURNED}.length == 2")
            back = str(await opened.ask(f"{TURNED}[0]")).partition(" = ")[2]
            assert abs(float(back) - float(str(before))) < 0.02, "what its rule had made of it"
            await opened.ask("document.querySelector('#restart').click()")
            await turned(opened)
            await press(opened, "document.querySelector('#lesion')")
            await turned(opened, "lesion K2 -> O")
            await opened.until(f"{LESIONED}.test({TIP}.textContent)")
            await opened.ask("document.querySelector('#turned button').click()")
            await turned(opened)
            await opened.until(f"!{LESIONED}.test({TIP}.textContent)")
            await opened.ask("document.querySelector('#picture').focus()")
            await opened.key("Escape")
            await opened.key("]")
            await opened.until("document.querySelector('#parted').textContent == 'C1'")
            await opened.ask("document.querySelector('#clampto').value = 0.75")
            await press(opened, "document.querySelector('#clamp')")
            await opened.ask("document.querySelector('#step').click()")
            await opened.until(f"/activity \\+0.75\\n[^]*\\nclamped$/m.test({TIP}.textContent)")
            await opened.ask("document.querySelector('#turned button').click()")
            await opened.ask("document.querySelector('#step').click()")
            await opened.until(f"!{TIP}.textContent.includes('activity +0.75\\n')")
            await turned(opened, "release C1", "clamp C1 = 0.75")

    asyncio.run(main())


def test_the_events_that_are_copied_do_in_the_spec_what_was_done_by_hand(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, access):
            await opened.call(
                "Browser.grantPermissions", origin=f"http://{access.host}:{access.port}",
                permissions=["clipboardReadWrite", "clipboardSanitizedWrite"],
            )  # fmt: skip
            await opened.size(1000, 1000)  # no button has to be scrolled to
            step = await pause(opened)
            await opened.key("t")
            await opened.key("]")

            async def click(button: str) -> None:
                count = await opened.ask(f"{TURNED}.length")
                await opened.ask(f"document.querySelector('#{button}').click()")
                await opened.until(f"{TURNED}.length == {count} + 1")

            async def on() -> None:
                nonlocal step
                step += 1
                await opened.ask("document.querySelector('#step').click()")
                await opened.until(f"document.querySelector('#told').textContent == 'step {step}'")

            await opened.ask("document.querySelector('#clampto').value = -0.5")
            await click("clamp")
            await on()
            await click("release")
            await click("lesion")
            await on()
            await click("mend")
            await on()
            await opened.ask(f"{SLIDER}.value = 0.5; {SLIDER}.dispatchEvent(new Event('change'))")
            await opened.until(f"{TURNED}.length == 5")
            await opened.key("]")
            await opened.until("document.querySelector('#parted').textContent == 'C2'")
            await click("lesion")
            for _ in range(3):
                await on()
            await press(opened, "document.querySelector('#copy')")
            copied = await opened.ask("navigator.clipboard.readText()")
            assert isinstance(copied, str)
            assert copied.startswith("events:\n")
            (tmp_path / "data").mkdir()
            shutil.copy(SPECS / "data/centres.csv", tmp_path / "data")
            (tmp_path / "cpg.yaml").write_text((SPECS / "cpg_rbf.yaml").read_text() + copied)
            again = nv.compile(tmp_path / "cpg.yaml")
            assert [found.code for found in again.warnings] == [found.code for found in compiled.warnings]
            for name in ("C1", "C2", "K3", "O"):
                await opened.ask("document.querySelector('#picture').focus()")
                for _ in range(len(again.network.neurons)):
                    if await opened.ask("document.querySelector('#parted').textContent") == name:
                        break
                    await opened.key("]")
                words = await told(opened, name)
                value = float(words[1].removeprefix("activity ").replace("−", "-"))
                index = again.network.neurons.names.index(name)
                assert np.isclose(value, again.run(step + 1).snapshot(step).activity[index], rtol=1e-5, atol=1e-9)

    asyncio.run(main())


FED = """neurovis: 1
name: fed
time: {dt: 0.02}
parameters: {pull: {value: 0.1, min: 0, max: 1}}
inputs: {push: {size: 2, description: what the hands do}, wind: {}}
neurons: {A: {count: 2, activation: tanh, input: push}, B: {activation: tanh, input: wind}}
connections:
  A1 -> B: {weight: 0.5, delay: 3, plasticity: {hebbian: {rate: 0.01}}}
  A2 -> B: pull
"""


async def drag(opened: Page, name: str, *shares: float) -> None:
    """Drag a slider to parts of its length, one after the other."""
    script = f"(box => [box.x, box.y + box.height / 2, box.width])({name}.getBoundingClientRect())"
    at = await opened.ask(script)
    assert isinstance(at, list)

    async def mouse(kind: str, share: float) -> None:
        await opened.call(
            "Input.dispatchMouseEvent", type=kind, x=at[0] + share * at[2], y=at[1], button="left", buttons=1,
            clickCount=1,
        )  # fmt: skip

    await mouse("mousePressed", shares[0])
    for share in shares:
        await mouse("mouseMoved", share)
        await asyncio.sleep(0.08)
    await mouse("mouseReleased", shares[-1])


def test_a_slider_that_is_dragged_while_it_plays_is_one_turn(tmp_path: Path) -> None:
    async def main() -> None:
        (tmp_path / "fed.yaml").write_text(FED)
        async with shown(str(tmp_path / "fed.yaml"), tmp_path) as (opened, _, _):
            await opened.size(1000, 800)
            await opened.key("t")
            seen = (
                "window.seen = new Set(); new MutationObserver(() => window.seen.add("
                f"{TURNED}.map(words => words.split(': ')[1]).join())).observe(turned, {{childList: true}})"
            )
            await opened.ask(f"{seen}; 0")
            slider = "document.querySelector('#slider-pull')"
            await drag(opened, slider, 0.2, 0.4, 0.6, 0.8)
            await opened.until(f"{TURNED}.length == 1")
            value = await opened.ask(f"{slider}.value")
            assert 0.7 < float(str(value)) < 0.9
            await turned(opened, f"pull = {value}")
            past = await opened.ask("[...window.seen]")
            assert isinstance(past, list)
            assert len(past) >= 3, "it had its effect while it was dragged"
            assert not any("," in row for row in past), "and was one turn all the time"
            copied = str(await opened.ask(EVENTS)).splitlines()
            assert len(copied) == 3
            assert copied[2].startswith("# step "), "and its comment says what it does not hold"
            assert copied[2].endswith(": what pull was while it was dragged is left out")
            here = await opened.ask(STEP)
            await opened.until(f"{STEP} > {here} + 1")
            await opened.ask("document.querySelector('#turned button').click()")
            await turned(opened, "pull = 0.1", f"pull = {value}")

    asyncio.run(main())


def test_a_slider_that_is_moved_by_keys_is_one_turn(tmp_path: Path) -> None:
    async def main() -> None:
        (tmp_path / "fed.yaml").write_text(FED)
        async with shown(str(tmp_path / "fed.yaml"), tmp_path) as (opened, _, _):
            await opened.key("t")
            slider = "document.querySelector('#slider-pull')"
            await opened.ask(f"{slider}.focus()")
            for _ in range(4):
                before, here = await opened.ask(f"{slider}.value"), await opened.ask(STEP)
                for kind in ("rawKeyDown", "keyUp"):
                    await opened.call("Input.dispatchKeyEvent", type=kind, key="ArrowRight", windowsVirtualKeyCode=39)
                await opened.until(f"{slider}.value != '{before}' && {STEP} > {here} + 3")
            await turned(opened, f"pull = {await opened.ask(f'{slider}.value')}")
            for kind in ("rawKeyDown", "keyUp"):
                await opened.call("Input.dispatchKeyEvent", type=kind, key="Delete", windowsVirtualKeyCode=46)
            await opened.until(f"{slider}.value == '0.1'")

    asyncio.run(main())


def test_inputs_without_a_source_are_fed_by_sliders_until_they_are_reset(tmp_path: Path) -> None:
    async def main() -> None:
        (tmp_path / "fed.yaml").write_text(FED)
        async with shown(str(tmp_path / "fed.yaml"), tmp_path) as (opened, _, _):
            await opened.size(1000, 800)
            await pause(opened)
            await opened.key("t")
            names = "[...document.querySelectorAll('#feeds label')].map(label => label.textContent).join()"
            assert await opened.ask(names) == "push 1,push 2,wind"
            assert await opened.ask("document.querySelector('#feeds small').textContent") == "what the hands do"
            await opened.ask("((one) => { one.value = 0.5; one.onchange(); })(document.querySelector('#feed-push-2'))")
            await turned(opened, "feed push = 0, 0.5")
            await opened.ask("((one) => { one.value = -1; one.onchange(); })(document.querySelector('#feed-wind'))")
            await turned(opened, "feed wind = -1", "feed push = 0, 0.5")
            rows = [row.partition(", ")[2] for row in str(await opened.ask(EVENTS)).splitlines()[1:]]
            assert rows == ["feed: {push: [0, 0.5]}}", "feed: {wind: -1}}"]
            await opened.key("]")
            await opened.key("]")
            await opened.ask("document.querySelector('#step').click()")
            await told(opened, "A2")
            await opened.until(f"{TIP}.textContent.includes('activity +{np.tanh(0.5):.6g}\\n')")
            two = "document.querySelector('#feed-push-2')"
            await opened.ask(f"{two}.dispatchEvent(new Event('dblclick'))")
            await turned(opened, "feed push no more", "feed wind = -1", "feed push = 0, 0.5")
            await opened.until(f"{two}.value == 0")
            await opened.ask("document.querySelectorAll('#turned button')[1].click()")
            await opened.until("document.querySelector('#feed-wind').value == 0")

    asyncio.run(main())


def test_rules_are_switched_off_and_on(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            step = await pause(opened)
            await opened.key("t")
            one = "document.querySelector('#rules input')"
            words = await opened.ask(f"{one}.parentNode.textContent")
            assert words == " K -> O delta(rate=0.01, target=T)"
            assert await opened.ask(f"{one}.checked")
            await opened.ask(f"{one}.click()")
            await turned(opened, "learning of K -> O off")
            assert await opened.ask(EVENTS) == f"events:\n  - {{at: {step + 1}, learning: {{K -> O: false}}}}\n"
            await opened.until(f"!{one}.checked")
            await opened.ask("document.querySelector('#turned button').click()")
            await turned(opened)
            await opened.until(f"{one}.checked")

    asyncio.run(main())


def test_a_refusal_is_read_while_it_plays_until_something_else_is_done(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, access):
            await opened.call("Page.navigate", url=access.url(owner=False))
            said = "document.querySelector('#refusal')"
            await opened.until(f"{said}?.hidden && {STEP} > 3")
            await opened.key("Home")
            await opened.until(f"{said}.textContent == 'this page only looks on'")
            here = await opened.ask(STEP)
            await opened.until(f"{STEP} > {here} + 30")
            assert not await opened.ask(f"{said}.hidden")
            await opened.key("Escape")
            await opened.until(f"{said}.hidden")

    asyncio.run(main())


def test_what_is_lesioned_is_crossed_out(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await pause(opened)
            view = view_of(compiled, compiled.gains)
            scene, area = json.loads(gzip.decompress(view.content)), area_of(view)
            groups = {next(iter(group["data"].values()), ""): group["shapes"][0] for group in scene["groups"]}
            x, y = groups["K5"]["at"]
            reach = 0.4 * groups["K5"]["radius"]
            points = groups["C1 -> C2"]["points"]
            middle = len(points) // 12 * 6  # the begin of the piece in the middle
            assert (len(points) - 2) // 6 % 2 == 1
            ends = np.array(points[middle : middle + 8]).reshape(4, 2)
            line = np.array(area.at(*(np.array([1, 3, 3, 1]) @ ends / 8)))
            disc = np.array(area.at(x + reach, y - reach))

            async def dark(place: FloatArray) -> bool:
                await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
                taken = np.array(Image.open(io.BytesIO(await opened.shot())).convert("L"))
                column, row = np.rint(place).astype(int)
                return bool(taken[row - 1 : row + 2, column - 1 : column + 2].min() < 60)

            async def lesion(name: str) -> None:
                await opened.ask("document.querySelector('#picture').focus()")
                await opened.click(*places(compiled)[name])
                await opened.until(f"document.querySelector('#parted').textContent == '{name}'")
                await opened.ask("document.querySelector('#lesion').click()")
                await opened.until(f"{LESIONED}.test({TIP}.textContent)")
                await opened.key("Escape")
                await opened.point(2, 2)
                await opened.until(f"{TIP}.hidden")

            assert not await dark(disc)
            assert not await dark(line)
            await lesion("K5")
            assert await dark(disc)
            await lesion("C1 -> C2")
            assert await dark(line)
            await lesion("C1")
            assert not await dark(line), "the line of a neuron that is crossed out is not"

    asyncio.run(main())


@pytest.mark.filterwarnings("ignore:the activity of A is inf")
def test_a_neuron_whose_activity_is_no_finite_number_has_a_question_mark(tmp_path: Path) -> None:
    spec = tmp_path / "x.yaml"
    spec.write_text(
        "neurovis: 1\nname: x\nneurons: {A: {initial: 1e300}, B: {}}\nconnections: {A -> A: 1e300, A -> B: 0}\n"
    )

    async def main() -> None:
        async with shown(str(spec), tmp_path) as (opened, compiled, _):
            await opened.until(f"{STEP} > 3")
            await pause(opened)
            view = view_of(compiled, compiled.gains)
            scene, area = json.loads(gzip.decompress(view.content)), area_of(view)
            (disc,) = (group["shapes"][0] for group in scene["groups"] if group["data"].get("neuron") == "B")

            async def dark() -> int:
                """Dark pixels on the right above the disc."""
                await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
                taken = np.array(Image.open(io.BytesIO(await opened.shot())).convert("L"))
                x, y = area.at(*(np.array(disc["at"]) + 0.85 * disc["radius"] * np.array([1, -1])))
                reach = disc["radius"] * scene["density"]
                return int((taken[int(y - reach) : int(y), int(x) : int(x + reach)] < 60).sum())

            assert await dark() > 10
            await opened.click(*places(compiled)["B"])
            await opened.until(f"{TIP}.textContent.includes('activity not finite')")
            await opened.ask("document.querySelector('#restart').click()")
            await opened.until(f"{STEP} == 0")
            assert await dark() == 0

    asyncio.run(main())


def test_the_page_offers_what_is_taken_and_nothing_else(tmp_path: Path) -> None:
    offered = (
        "[...document.querySelectorAll('[data-asks]')].filter((one) => !one.hidden).map((one) => one.dataset.asks)"
    )

    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path, takes=frozenset({"set"})) as (opened, compiled, _):
            await opened.click(*places(compiled)["K5"])
            await opened.until(f"{TIP}.textContent.startsWith('K5')")
            await opened.key("t")
            assert await opened.ask(offered) == ["set"]
            assert await opened.ask("document.querySelector('#part').hidden")
            buttons = "[...document.querySelectorAll('{0} button:not(.shut)')].filter((one) => one.checkVisibility())"
            words = f"{buttons}.map((one) => one.textContent.trim())"
            assert await opened.ask(words.format("#turning")) == ["copy as events"]
            assert await opened.ask("events.hidden && copy.disabled"), "there is nothing to copy yet"
            await opened.ask("document.querySelector('#save').click()")
            assert await opened.ask(words.format("#saves")) == ["PNG", "copy picture", "copy link", "present"]

    asyncio.run(main())


def test_the_theme_and_the_gains_are_chosen_while_it_runs(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await opened.click(*places(compiled)["K2 -> O"])
            await opened.key("t")
            theme, gain = (f"document.querySelector('#{name}')" for name in ("theme", "gain-thickness"))
            assert await opened.ask(f"[...{theme}.options].map(one => one.value)") == ["", *THEMES]
            back = "getComputedStyle(document.body).backgroundColor"
            before = await opened.ask(back)
            await opened.ask(f"{theme}.value = 'dark'; {theme}.onchange()")
            await opened.until(f"{back} != '{before}' && {theme}.value == 'dark'")
            tip = f"{TIP}.textContent.includes"
            await opened.until(f"{tip}('thickness 10') && {gain}.value == '0'")
            await opened.ask(f"{gain}.value = 2; {gain}.oninput(); {gain}.onchange()")
            await opened.until(f"{gain}.ariaValueText == '4'")
            assert await opened.ask(f"{gain}.parentNode.querySelector('[type=number]').value") == "4"
            await opened.until(f"{tip}('thickness 40')")
            assert await opened.ask(TURNED) == ["gain of thickness × 4"], "a theme is a viewer's own"
            await opened.ask(f"{gain}.dispatchEvent(new Event('dblclick'))")
            await opened.until(f"{tip}('thickness 10') && {gain}.value == '0'")
            await opened.call("Page.reload")
            await opened.until(f"{theme}?.value == 'dark' && {back} != '{before}'")
            await opened.ask(f"{theme}.value = ''; {theme}.onchange()")
            await opened.until(f"{back} == '{before}' && {theme}.value == ''")

    asyncio.run(main())


def test_a_viewer_turns_nothing(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, access):
            await opened.call("Page.navigate", url=access.url(owner=False))
            await opened.until("document.querySelector('#turns')?.disabled")
            assert await opened.ask("document.querySelector('#drawn').disabled")

    asyncio.run(main())
