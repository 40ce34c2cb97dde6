"""Undo and redo in the live page: what is turned, strips, panels, views and the theme, act by act."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from chromium import Page
from test_live_browser import pause, shown
from test_live_turning import press, turned

pytestmark = pytest.mark.browser

DID = "document.querySelector('#did').textContent"
PINS = "document.querySelectorAll('#strips .pin').length"


async def control(opened: Page, key: str, shift: bool = False) -> None:
    """Press a key with Ctrl."""
    for kind in ("rawKeyDown", "keyUp"):
        await opened.call("Input.dispatchKeyEvent", type=kind, key=key, modifiers=10 if shift else 2)


async def undone(opened: Page, words: str) -> None:
    await control(opened, "z")
    await opened.until(f"{DID} == 'undone: {words}'")


async def redone(opened: Page, words: str, key: str = "Z") -> None:
    await control(opened, key, shift=key == "Z")
    await opened.until(f"{DID} == 'done again: {words}'")


def test_what_is_done_is_undone_act_by_act_and_done_again(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await opened.size(1400, 900)
            await opened.until("innerWidth == 1400")
            await pause(opened)
            await opened.key("]")
            await press(opened, "document.querySelector('#turn')")
            for name in ("lesion", "mend", "lesion"):
                await press(opened, f"document.querySelector('#{name}')")
                await opened.until(f"document.querySelector('#undo').title == 'undo: {name} C1 (ctrl+z)'")
            await turned(opened, "lesion C1", "mend C1", "lesion C1")
            await undone(opened, "lesion C1")
            await turned(opened, "mend C1", "lesion C1")
            await undone(opened, "mend C1")
            await undone(opened, "lesion C1")
            await turned(opened)
            assert await opened.ask("document.querySelector('#futures').hidden")
            await redone(opened, "lesion C1")
            await turned(opened, "lesion C1")
            await redone(opened, "mend C1", "y")
            await turned(opened, "mend C1", "lesion C1")
            await opened.key("p")
            pins = await opened.ask(PINS)
            await undone(opened, "pinned C1")
            await opened.until(f"{PINS} < {pins}")
            await redone(opened, "pinned C1")
            await opened.until(f"{PINS} == {pins}")
            await opened.key("m")
            pressed = "document.querySelector('#matrix').ariaPressed"
            await opened.until(f"{pressed} == 'true'")
            await undone(opened, "the matrix of the weights")
            await opened.until(f"{pressed} == 'false'")
            back = "getComputedStyle(document.body).backgroundColor"
            before = await opened.ask(back)
            await opened.ask("((one) => { one.value = 'dark'; one.onchange(); })(document.querySelector('#theme'))")
            await opened.until(f"{back} != '{before}'")
            await undone(opened, "theme dark")
            await opened.until(f"{back} == '{before}'")
            await undone(opened, "pinned C1")
            await press(opened, "document.querySelector('#undo')")
            await opened.until(f"{DID} == 'undone: mend C1'")
            await turned(opened, "lesion C1")

    asyncio.run(main())
