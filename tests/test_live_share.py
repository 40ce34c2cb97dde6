"""Sharing: a link shows the page where it stood, and copies and the picture alone are a click away."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest
from test_live_browser import STEP, pause, shown
from test_live_strips import JOIN, SCRUB, TYPED

pytestmark = pytest.mark.browser

CURVES = "[...document.querySelectorAll('#strips .of')].map((one) => one.title).filter(Boolean)"
VIEW = "new URLSearchParams(%s).get('view').split(' ').map((one) => (+one).toFixed(2))"
COPIES = """navigator.clipboard.writeText = async (text) => { window.copied = text };
navigator.clipboard.write = async ([item]) => { window.blob = await item.getType('image/png') }"""


def test_a_link_opens_the_page_where_it_stood_for_owners_and_viewers(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path, curves=True) as (opened, _, access):
            await opened.until(f"{STEP} > 20")
            assert await opened.ask("location.hash") == ""
            step = await pause(opened)
            await opened.ask("document.querySelector('#strips .pin').click()")
            await opened.ask("{ const s = document.querySelector('#speed'); s.value = '2'; s.onchange() }")
            for key in ("]", "p", "Escape", "+", "+", "+", "l"):
                await opened.key(key)
            await opened.until("location.hash.includes('view=') && location.hash.includes('speed=2')")
            await opened.until(f"location.hash.includes('step={step}&')")
            await opened.ask(COPIES)
            await opened.ask("document.querySelector('#link').click(); document.querySelector('#clip').click()")
            await opened.until("window.copied && window.blob?.size > 10000")
            link, curves = await opened.ask("copied"), await opened.ask(CURVES)
            assert isinstance(link, str)
            assert link == await opened.ask("location.href")
            assert f"token={access.owner}" in link
            assert curves
            fragment = link.partition("#")[2]

            await opened.ask("document.querySelector('#play').click()")
            await opened.until(f"{STEP} > {step} + 5")
            for token, owner in ((access.viewer, False), (access.owner, True)):
                await opened.call("Page.navigate", url="about:blank")
                await opened.call("Page.navigate", url=f"{access.url(owner)}#{fragment}")
                await opened.until(f"{STEP} >= 0 && document.querySelector('#strips .of').title")
                assert token in str(await opened.ask("location.search"))
                assert await opened.ask(CURVES) == curves
                await opened.until("location.hash.includes('view=')")
                assert await opened.ask(VIEW % "location.hash.slice(1)") == await opened.ask(
                    VIEW % json.dumps(fragment)
                )
                if owner:
                    await opened.until(f"{STEP} == {step}")
                    await opened.until("document.querySelector('#speed').value == '2'")
                else:
                    assert await opened.ask(f"{STEP} > {step}")

            await opened.call("Page.navigate", url="about:blank")
            wrong = "step=-1&speed=99&view=a b&curves=nobody%0Ae99"
            await opened.call("Page.navigate", url=f"{access.url()}#{wrong}")
            await opened.until(f"{STEP} >= 0")
            assert await opened.ask(STEP) == step

            await opened.key("f")
            await opened.until("!document.querySelector('#bar').offsetHeight")
            assert await opened.ask("document.querySelector('#picture').offsetHeight > 100")
            (tmp_path / "alone.png").write_bytes(await opened.shot())
            await opened.key("f")
            await opened.until("document.querySelector('#bar').offsetHeight")

    asyncio.run(main())


def test_a_link_goes_to_its_branch_and_says_where_it_cannot(tmp_path: Path) -> None:
    """A branch keeps its number; an edited address is followed; signals in one axis and planes are in it."""
    said = "new URLSearchParams(location.hash.slice(1)).get('{}')"
    refusal = "document.querySelector('#refusal:not([hidden])')?.textContent.includes('{}')"

    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, access):
            await opened.until(f"{STEP} > 40")
            last = await pause(opened)
            for name in ("C1", "K2", "O", "T"):
                await opened.ask(TYPED.format(f"'{name}'"))
            await opened.until(f"{CURVES}.length == 4")
            await opened.ask(JOIN.format(0, "with K2"))
            await opened.ask(JOIN.format(1, "against T"))
            await opened.until(f"{said.format('curves')} == 'C1~+K2\\nO~/T\\nT' && {said.format('branch')} == '0'")
            first, curves = await opened.ask("location.href"), await opened.ask(CURVES)
            assert isinstance(curves, list)
            assert curves[:2] == ["C1 and K2", "O against T"]
            await opened.ask(f"{SCRUB}.value = 20; {SCRUB}.dispatchEvent(new Event('input'))")
            await opened.until(f"{STEP} == 20 && !document.querySelector('#branch').disabled")
            await opened.ask("['branch', 'step'].forEach((id) => document.getElementById(id).click())")
            await opened.ask("document.querySelector('#strips .pin').click()")
            await opened.until(f"{said.format('branch')} == '1' && {said.format('step')} == '21'")
            second = await opened.ask("location.href")

            await opened.ask(f"location.href = {json.dumps(first)}")
            await opened.until(f"{STEP} == {last} && {SCRUB}.max == '{last}'")
            await opened.until(f"{said.format('branch')} == '0'")
            assert await opened.ask(CURVES) == curves
            await opened.ask(f"location.href = {json.dumps(second)}")
            await opened.until(f"{STEP} == 21 && {SCRUB}.max == '21' && {said.format('branch')} == '1'")

            await opened.call("Page.navigate", url="about:blank")
            await opened.call("Page.navigate", url=str(first).replace(access.owner, str(access.viewer)))
            await opened.until(f"{refusal.format('only the owner can go there')} && {STEP} == 21")
            assert await opened.ask(CURVES) == curves
            (tmp_path / "viewer.png").write_bytes(await opened.shot())
            await opened.call("Page.navigate", url="about:blank")
            await opened.call("Page.navigate", url=str(second).replace("branch=1", "branch=7"))
            await opened.until(f"{refusal.format('is no more')} && {STEP} == 21")

    asyncio.run(main())
