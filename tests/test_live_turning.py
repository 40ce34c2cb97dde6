"""Turning in the live page: sliders, clamps and lesions take effect, are listed, taken back, and copied as events."""

from __future__ import annotations

import asyncio
import shutil
from pathlib import Path

import numpy as np
import pytest
from chromium import Page
from test_live_browser import SPECS, pause, shown
from test_live_looking import TIP, places, told

import neurovis_spec as nv
from neurovis_spec.live.declared import declared

pytestmark = pytest.mark.browser

SLIDER = "document.querySelector('#slider-eta')"
TURNED = "[...document.querySelectorAll('#turned li')].map(row => row.firstChild.textContent)"
EVENTS = "document.querySelector('#events').value"


def test_what_is_declared_has_its_bounds_and_description() -> None:
    head = "neurovis: 1\nname: x\n"
    given = "parameters: {a: {value: 2, max: 3, description: the gain}, c: 3}\nneurons: {A: {count: c, bias: a}}\n"
    assert declared(nv.compile_text(head + given)) == [
        {"name": "a", "value": 2.0, "low": None, "high": 3.0, "description": "the gain"}
    ]
    follows = "parameters: {a: 2, b: {value: 1, min: -a, max: 2*a}}\nneurons: {A: {bias: a + b}}\n"
    assert declared(nv.compile_text(head + follows))[1] == {
        "name": "b", "value": 1.0, "low": -2.0, "high": 4.0, "description": "",
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
            await turned(opened, "eta = 0.01")
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
            await press(opened, "document.querySelector('#lesion')")
            await turned(opened, "lesion K2 -> O")
            await opened.until(f"{TIP}.textContent.endsWith('lesioned')")
            await opened.ask("document.querySelector('#turned button').click()")
            await turned(opened, "mend K2 -> O", "lesion K2 -> O")
            await opened.until(f"!{TIP}.textContent.endsWith('lesioned')")
            await opened.ask("document.querySelector('#picture').focus()")
            await opened.key("Escape")
            await opened.key("]")
            await opened.until("document.querySelector('#parted').textContent == 'C1'")
            await opened.ask("document.querySelector('#clampto').value = 0.75")
            await press(opened, "document.querySelector('#clamp')")
            await opened.ask("document.querySelector('#step').click()")
            await opened.until(f"{TIP}.textContent.includes('activity +0.75\\n')")
            await opened.ask("document.querySelector('#turned button').click()")
            await opened.ask("document.querySelector('#step').click()")
            await opened.until(f"!{TIP}.textContent.includes('activity +0.75\\n')")
            await turned(opened, "release C1", "clamp C1 = 0.75", "mend K2 -> O", "lesion K2 -> O")

    asyncio.run(main())


def test_the_events_that_are_copied_do_in_the_spec_what_was_done_by_hand(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, access):
            await opened.call(
                "Browser.grantPermissions", origin=f"http://{access.host}:{access.port}",
                permissions=["clipboardReadWrite", "clipboardSanitizedWrite"],
            )  # fmt: skip
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


def test_a_viewer_turns_nothing(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, access):
            await opened.call("Page.navigate", url=access.url(owner=False))
            await opened.until("document.querySelector('#turns')?.disabled")

    asyncio.run(main())
