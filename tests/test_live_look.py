"""How the live page looks: the checklist of ``benchmarks/live_look.py``, parts that stay folded, what greets who comes
first, and what it says of an activity that is not finite."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

import pytest
from chromium import chromium

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "benchmarks"))

from live_look import NOTES, looked, opened_in, served
from test_live_everyone import violations

pytestmark = pytest.mark.browser

ROOT = Path(__file__).parents[1]
#: It grows beyond all bounds, soon, and B takes it in.
GROWS = """neurovis: 1
name: grows
time: {dt: 0.05}
parameters: {alpha: {value: 1, unit: mV}}
neurons: {A: {initial: 1e300}, B: {bias: alpha}}
connections: {A -> A: 1e300, A -> B: 0}
"""


def test_it_holds_the_checklist_on_a_telephone_in_the_dark_and_its_parts_stay_folded(tmp_path: Path) -> None:
    async def main() -> None:
        async with chromium(tmp_path) as page, served(ROOT / "specs/cpg_rbf.yaml") as url:
            await page.call("Page.addScriptToEvaluateOnNewDocument", source=NOTES)
            hint, fold = "document.querySelector('#hint')", "document.querySelector('[data-fold=learning]')"
            for size, scheme in (("1280x800", "light"), ("390x844", "dark")):
                telephone = await opened_in(page, url, size, scheme, panels=False)
                assert await page.ask(f"{hint}.checkVisibility()") is not telephone, "who has been here is not greeted"
                if not telephone:
                    await page.key("t")
                    assert not await page.ask(f"{hint}.checkVisibility()")
                    await page.ask(f"{fold}.querySelector('summary').click()")
                else:
                    await page.key("t")
                    assert not await page.ask(f"{fold}.open")
                    await page.ask("document.querySelector('#turning .shut').click()")
                    assert await page.ask("document.querySelector('#turning').hidden")
                    await page.key("t")
                found = await looked(page, telephone)
                missing = {name for name, good in found.passed.items() if not good}
                assert missing <= {"share", "label"}, found
                assert await violations(page) == []
                assert await page.ask(
                    "getComputedStyle(document.body).fontFamily == notes.scene.constants.families.map("
                    "(name) => name.includes(' ') ? JSON.stringify(name) : name).join(', ')"
                ), "the page has the font of the picture"
            assert page.errors == []

    asyncio.run(main())


@pytest.mark.filterwarnings("ignore:the activity of A is inf")
def test_it_says_which_activity_is_not_finite_since_when_and_goes_before_it(tmp_path: Path) -> None:
    spec = tmp_path / "grows.yaml"
    spec.write_text(GROWS, encoding="utf-8")

    async def main() -> None:
        async with chromium(tmp_path) as page, served(spec) as url:
            await page.call("Page.navigate", url=url)
            told = "document.querySelector('#undefined')"
            await page.until(f"{told}?.textContent.includes('and 1 other')")
            assert str(await page.ask(f"{told}.textContent")).startswith("? A is not finite since step 1 and 1 other")
            await page.ask("document.querySelector('#undefinedname').click()")
            await page.until("document.querySelector('#tip').textContent.startsWith('A')")
            assert await page.ask("document.querySelector('#sliders .unit').textContent") == " mV"
            await page.ask("document.querySelector('#defined').click()")
            await page.until(f"{told}.hidden && document.querySelector('#told').textContent == 'step 0'")
            assert page.errors == []

    asyncio.run(main())
