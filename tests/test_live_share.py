"""Sharing: a link shows the page where it stood, and copies and the picture alone are a click away."""

from __future__ import annotations

import asyncio
import gzip
import json
from pathlib import Path
from urllib.parse import quote

import pytest
from test_live_browser import STEP, pause, shown
from test_live_hand import at_hand
from test_live_strips import JOIN, SCRUB, TYPED, scrub
from test_live_undo import undone

import neurovis_spec as nv
from neurovis_spec.diagnostics import Findings
from neurovis_spec.live.saved_views import file_beside, views_in
from neurovis_spec.live.view import view_of

pytestmark = pytest.mark.browser

CURVES = "[...document.querySelectorAll('#strips .of')].map((one) => one.title).filter(Boolean)"
#: Where the step that is shown lies on the axis below the curves.
AXIS = """(({left, width}) => left + 8 + (scrub.value - scrub.min) / (scrub.max - scrub.min) * (width - 16))
(ticks.getBoundingClientRect())"""
NAME = "after the lesion"
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

            await opened.key("]")
            await opened.key("p")
            await scrub(opened, f"{step} / 2")
            await opened.until(f"{STEP} == {SCRUB}.value && {STEP} < {step}")
            cursor = "cursor.getBoundingClientRect().left"
            await opened.until(f"Math.abs({cursor} - ({AXIS})) < 1")
            await opened.key("f")
            await opened.until("!document.querySelector('#bar').offsetHeight")
            assert await opened.ask("document.querySelector('#picture').offsetHeight > 100")
            assert await opened.ask("!time.offsetHeight && cursor.offsetHeight > 20")
            await opened.until(f"Math.abs({cursor} - ({AXIS})) < 1")
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
            await opened.until(
                f"{said.format('curves')} == 'C1 with K2\\nO against T\\nT' && {said.format('branch')} == '0'"
            )
            first, curves = await opened.ask("location.href"), await opened.ask(CURVES)
            assert isinstance(curves, list)
            assert curves[:2] == ["C1 and K2", "O against T"]
            await scrub(opened, 20)
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


def test_a_view_is_saved_by_name_and_gone_to_in_windows_of_other_sizes(tmp_path: Path) -> None:
    view = "new URLSearchParams(location.hash.slice(1)).get('view')"
    there = "[...document.querySelectorAll('#views .go')].map((one) => one.textContent)"
    go = "document.querySelector('#views .go').click()"

    async def main() -> None:
        async with at_hand(tmp_path) as (opened, desk, spec):
            file = file_beside(spec)
            await opened.until(f"{STEP} > 30")
            step = await pause(opened)
            await opened.ask("[...document.querySelectorAll('#strips .pin')].slice(1).forEach((one) => one.click())")
            for name in ("C1", "K2", "rms(T - O, last=9)"):
                await opened.ask(TYPED.format(f"'{name}'"))
            await opened.until(f"{CURVES}.length == 4")
            await opened.ask(JOIN.format(1, "with K2"))
            await opened.ask("{ const s = document.querySelector('#speed'); s.value = '2'; s.onchange() }")
            await opened.ask("document.activeElement.blur()")
            for key in ("+", "+", "+", "l"):
                await opened.key(key)
            await opened.until("location.hash.includes('view=') && location.hash.includes('speed=2')")
            curves = await opened.ask(CURVES)
            assert isinstance(curves, list)
            await opened.key("t")
            await opened.ask(f"document.querySelector('#viewname').value = {json.dumps(NAME)}")
            await opened.ask("document.querySelector('#keep').requestSubmit()")
            await opened.until(f"{there}.join() == {json.dumps(NAME)}")
            await opened.ask("document.querySelector('#keep').scrollIntoView()")
            (tmp_path / "saved.png").write_bytes(await opened.shot())
            findings = Findings()
            (saved,) = views_in(file, desk.placed.compiled.network, findings).values()
            assert not findings.sorted()
            assert (saved.step, saved.speed, saved.theme, saved.closed) == (step, "2", "", ())
            assert isinstance(saved.camera, tuple)
            assert saved.curves == ("O over T", "C1 with K2", "rms(T - O, last=9)")

            await opened.key("0")
            await opened.ask("document.querySelector('#step').click()")
            await opened.ask("document.querySelector('#strips .pin').click()")
            await opened.until(f"{STEP} == {step} + 1 && !location.hash.includes('view=')")
            await opened.size(900, 700)
            await opened.ask(go)
            await opened.until(f"{STEP} == {step} && location.hash.includes('view=')")
            assert await opened.ask(CURVES) == curves
            zoom, x, y = saved.camera  # in units of the layout, and the address in those of the picture
            compiled = desk.placed.compiled
            constants = json.loads(gzip.decompress(view_of(compiled, compiled.gains).content))["constants"]
            left, top, scale = (constants[name] for name in ("left", "top", "scale"))
            wanted = [zoom, left + scale * x, top + scale * y]
            await opened.until(f"{view}.split(' ').every((one, at) => Math.abs(one - {wanted}[at]) < 0.05)")
            await opened.ask("document.querySelector('#undo').click()")
            await opened.until(f"{STEP} == {step} + 1 && !location.hash.includes('view=')")
            assert await opened.ask(CURVES) == curves[1:]

            file.write_text(file.read_text().replace("C1", "C99"))
            said = "document.querySelector('#viewsfound:not([hidden])')?.textContent.includes({})"
            await opened.until(said.format("\"shows 'C99'\""))  # by itself
            url = str(await opened.ask("location.href")).partition("#")[0]
            for called in (NAME, "nothing"):
                await opened.call("Page.navigate", url="about:blank")
                await opened.call("Page.navigate", url=f"{url}#saved={quote(called)}")
                if called == NAME:
                    await opened.until(f"{STEP} == {step} && location.hash.includes('view=')")
                    assert await opened.ask(CURVES) == [curves[0], curves[2]]
                else:
                    await opened.until("document.querySelector('#refusal')?.textContent.includes('no view nothing')")
            await opened.ask("document.querySelector('#viewname').value = 'now'")
            await opened.ask("document.querySelector('#keep').requestSubmit()")
            await opened.until(f"{there}.join() == {json.dumps(NAME + ',now')}")

    asyncio.run(main())


def test_a_view_of_the_matrix_or_of_pathways_is_kept_called_otherwise_and_deleted(tmp_path: Path) -> None:
    there = "[...document.querySelectorAll('#views .go')].map((one) => one.textContent).join()"
    press = "[...document.querySelectorAll('#views button')].find((one) => one.ariaLabel == '{0}').click()"
    shown = "['matrix', 'pathways'].filter((id) => document.getElementById(id).ariaPressed == 'true').join()"
    undo = "document.querySelector('#undo').click()"

    async def main() -> None:
        async with at_hand(tmp_path) as (opened, _, spec):
            await opened.until(f"{STEP} > 5")
            await pause(opened)
            await opened.key("t")

            async def keep(name: str) -> None:
                await opened.ask(f"document.querySelector('#viewname').value = '{name}'")
                await opened.ask("document.querySelector('#keep').requestSubmit()")
                await opened.until(f"{there}.split(',').includes('{name}')")

            curves = str(await opened.ask(f"{CURVES}.join()"))
            await keep("plain")
            await opened.ask("document.querySelector('#matrix').click()")
            await keep("weights")
            await opened.ask("document.querySelector('#matrix').click()")
            await opened.ask("document.querySelector('#pathways').click()")
            await opened.until(f"{shown} == 'pathways'")
            await keep("ways")
            for number, wanted in ((1, "matrix"), (2, "pathways"), (0, ""), (1, "matrix")):
                await opened.ask(f"document.querySelectorAll('#views .go')[{number}].click()")
                await opened.until(f"{shown} == '{wanted}'")
                if number == 0:
                    await opened.until(f"{CURVES}.join() == {json.dumps(curves)}")
                    assert await opened.ask("document.querySelector('#refusal').textContent") == ""
            await opened.ask(undo)
            await opened.until(f"{shown} == ''")
            await opened.ask(f"document.querySelectorAll('#views .go')[2].click(); {undo}")  # before it is there
            await opened.ask("new Promise((done) => setTimeout(done, 1500))")
            assert await opened.ask(shown) == ""

            await opened.ask(press.format("rename ways"))
            await opened.ask("document.activeElement.value = 'plain'")
            await opened.key("Enter")
            await opened.until("document.querySelector('#refusal').textContent.includes('another view is called')")
            await opened.ask(press.format("rename ways"))
            await opened.ask("document.activeElement.value = 'half'")
            file_beside(spec).write_text(file_beside(spec).read_text() + "# edited\n")
            await opened.ask("new Promise((done) => setTimeout(done, 800))")
            assert await opened.ask("document.activeElement.value") == "half"
            assert "half" not in file_beside(spec).read_text()
            await opened.key("Escape")
            await opened.until(f"{there} == 'plain,weights,ways'")

            await opened.ask(press.format("rename weights"))
            await opened.ask("document.activeElement.value = ' of  numbers'")
            await opened.key("Enter")
            await opened.until(f"{there} == 'plain,of  numbers,ways'")
            seen = "[...document.querySelectorAll('#views .go')].map((one) => one.innerText)"
            assert await opened.ask(seen) == ["plain", "of  numbers", "ways"], "both blanks are seen"
            for name in ("plain", "of  numbers"):  # what is undone is called as it was
                await opened.ask(press.format(f"delete {name}"))
                await opened.until(f"!{there}.split(',').includes('{name}')")
                await opened.ask(undo)
                await opened.until(f"{there} == 'plain,of  numbers,ways'")
            await opened.ask(undo)
            await opened.until(f"{there} == 'plain,weights,ways'")
            findings = Findings()
            found = views_in(file_beside(spec), nv.compile(spec).network, findings)
            assert found["plain"].camera == "whole"
            assert [(name, one.shows) for name, one in found.items()] == [
                ("plain", "network"), ("weights", "matrix"), ("ways", "pathways")
            ]  # fmt: skip

    asyncio.run(main())


#: A network that has a curve of each kind, and a neuron that is called as a page calls an error.
NAMED = """neurovis: 1
name: named
time: {dt: 0.05, steps: 400}
models: {cell: {state: {v: {initial: 0, derivative: drive - v}, u: {initial: 0, derivative: v - u}}, activity: v}}
inputs: {touch: {expression: sin(k/9)}}
neurons:
  N: {count: 3, model: cell, bias: i}
  e0: {activation: tanh, bias: 0.2}
  T: {input: touch}
  O: {}
connections:
  - N1 -> N2: 0.5
  - N1 -> N2: 0.1
  - N3 -> O: {weight: 0.1, plasticity: {delta: {rate: 0.01, target: T}}}
"""
#: The same curves as links had them first, and as links and files of views have them.
OF_OLD = "O~T\nN2|u~+N1 -> N2 (2)\ni0~+e0\nN3~/N2|u\nm0"
BY_NAME = ["O over T", "N2.u with N1 -> N2 (2)", "touch with e0", "N3 against N2.u", "rms(T - O, last=9)"]
OPENED = ["O and T", "N2.u and N1 → N2 (2)", "touch and e0", "N3 against N2.u", "rms(T - O, last=9)"]


def test_curves_have_the_same_names_in_links_of_now_and_of_old_and_in_files(tmp_path: Path) -> None:
    said = "new URLSearchParams(location.hash.slice(1)).get('curves')"
    (tmp_path / "named.yaml").write_text(NAMED)
    views = f"neurovis_view: 1\nviews:\n  old:\n    curves: {json.dumps(BY_NAME)}\n"
    file_beside(tmp_path / "named.yaml").write_text(views)

    async def main() -> None:
        async with at_hand(tmp_path, str(tmp_path / "named.yaml")) as (opened, _, _):
            await opened.until(f"{STEP} > 20")
            await pause(opened)
            url = str(await opened.ask("location.href")).partition("#")[0]
            await opened.ask(TYPED.format("'rms(T - O, last=9)'"))
            await opened.until(f"{CURVES}.length == 2")
            for curves in (OF_OLD, "\n".join(BY_NAME), None):
                await opened.call("Page.navigate", url="about:blank")
                if curves is None:
                    await opened.call("Page.navigate", url=f"{url}#saved=old")
                else:
                    await opened.call("Page.navigate", url=f"{url}#curves={quote(curves)}")
                await opened.until(f"{CURVES}.join() == {json.dumps(','.join(OPENED))}")
                await opened.until(f"{said} == {json.dumps(chr(10).join(BY_NAME))}")
            await opened.call("Page.navigate", url="about:blank")
            await opened.call("Page.navigate", url=f"{url}#curves={quote('N1~nobody~T' + chr(10) + 'nobody~T|v')}")
            await opened.until(f"{CURVES}.join() == 'N1 and T'")
            await opened.until("document.querySelector('#refusal').textContent == 'left out, as there is none: nobody'")
            await opened.call("Page.navigate", url="about:blank")
            await opened.call("Page.navigate", url=f"{url}#curves={quote('rms(O, last=7)')}")
            await opened.until(f"{CURVES}.join() == 'rms(O, last=7)'")

    asyncio.run(main())


def test_what_begins_at_the_step_that_is_shown_is_gone_back_to_and_undone(tmp_path: Path) -> None:
    current = "new URLSearchParams(location.hash.slice(1)).get('branch')"
    go = "document.querySelector('#others .go')"

    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await opened.until(f"{STEP} > 30")
            last = await pause(opened)
            await scrub(opened, 20)
            await opened.until(f"{STEP} == 20")
            await opened.key("]")
            await opened.ask("document.querySelector('#lesion').click()")
            await opened.until(f"{go}?.textContent == 'from step 21 to {last}: as it went'")
            await opened.ask(f"{go}.click()")
            await opened.until(f"{go}?.textContent == 'from step 21 on: step 21: lesion C1'")
            await scrub(opened, 25)
            await opened.until(f"{STEP} == 25 && {current} == '0'")
            await opened.ask(f"{go}.click()")
            await opened.until(f"{STEP} == 20 && {current} == '1'")
            await undone(opened, "went to the branch from step 21 on")
            await opened.until(f"{STEP} == 25 && {current} == '0'")
            await undone(opened, f"went to the branch from step 21 to {last}")
            await opened.until(f"{STEP} == 20 && {current} == '1'")
            await undone(opened, "lesion C1")
            await opened.until(f"{current} == '0' && document.querySelector('#futures').hidden")
            assert await opened.ask("document.querySelector('#refusal').hidden")

    asyncio.run(main())


def test_going_to_a_branch_is_undone(tmp_path: Path) -> None:
    current = "new URLSearchParams(location.hash.slice(1)).get('branch')"

    async def main() -> None:
        async with at_hand(tmp_path) as (opened, _, _):
            await opened.until(f"{STEP} > 30")
            await pause(opened)
            await scrub(opened, 20)
            await opened.until(f"{STEP} == 20 && !document.querySelector('#branch').disabled")
            await opened.ask("['branch', 'step'].forEach((id) => document.getElementById(id).click())")
            await opened.until(f"{current} == '1'")
            await opened.ask("document.querySelector('#others .go').click()")
            await opened.until(f"{current} == '0'")
            await opened.ask("document.querySelector('#undo').click()")
            await opened.until(f"{current} == '1'")
            await opened.ask("document.querySelector('#redo').click()")
            await opened.until(f"{current} == '0'")

    asyncio.run(main())
