"""The live page: strips over the time axis of the scrubber, jumps to events, branches, and the matrix of weights."""

from __future__ import annotations

import asyncio
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from chromium import Page
from live_window import HEAD
from test_live_browser import STEP, pause, shown
from test_live_looking import places, told

pytestmark = pytest.mark.browser

SCRUB = "document.querySelector('#scrub')"
#: Whether a strip, by its place, has its trace, and what is said of it.
TRACE = "document.querySelectorAll('.trace')[{0}]?.getAttribute('aria-label')"
TITLE = "document.querySelectorAll('.of')[{0}]?.textContent"
#: Whether there is anything on a canvas.
INK = (
    "(c => c.toDataURL() != Object.assign(document.createElement('canvas'), {{width: c.width, "
    "height: c.height}}).toDataURL())({0})"
)
#: A curve is asked for by typing it.
JOIN = (
    "((place, how) => {{ const menu = document.querySelectorAll('.join')[place]; "
    "menu.value = [...menu.options].find((one) => one.text == how).value; menu.onchange(); }})({0}, '{1}')"
)
TYPED = "document.querySelector('#measure').value = {0}; document.querySelector('#measuring').requestSubmit()"
MARKS = INK.format("document.querySelector('#marks')")


async def scrub(opened: Page, step: object) -> None:
    """Drag the slider to a step."""
    await opened.ask(f"{SCRUB}.value = {step}; {SCRUB}.dispatchEvent(new Event('input'))")


async def numbers(opened: Page, *scripts: str) -> list[float]:
    """The values of some expressions."""
    found = await opened.ask(f"[{', '.join(scripts)}].map(Number)")
    assert isinstance(found, list)
    return found


async def drawn(opened: Page, place: int) -> bool:
    """Whether a strip shows a line."""
    found = await opened.ask(INK.format(f"document.querySelectorAll('.trace')[{place}]"))
    return bool(found)


def test_what_is_held_has_its_trace_and_several_are_pinned(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await opened.until(f"{STEP} > 60")
            step, at = await pause(opened), places(compiled)
            run = compiled.run(step + 1)
            await opened.click(*at["C1"])
            await told(opened, "C1")
            await opened.until(f"{TRACE.format(0)}?.startsWith('C1 from step 0 to {step}')")
            assert await drawn(opened, 0)
            values = run["C1"]
            for number in (values.min(), values.max()):
                text = f"{number:.6g}".replace("-", "−")
                assert text in str(await opened.ask(TRACE.format(0)))
            value = float(str(await opened.ask("document.querySelector('.now').textContent")).replace("−", "-"))
            assert value == pytest.approx(values[step], rel=1e-5)
            await opened.key("p")
            await opened.until(f"{TITLE.format(0)} == 'C1' && document.querySelectorAll('.trace').length == 2")
            await opened.key("]")
            await opened.until(f"{TITLE.format(1)} == 'C2'")
            await opened.until(f"{TRACE.format(1)}?.startsWith('C2 from step 0 to {step}')")
            await opened.key("Escape")
            await opened.until(f"{TITLE.format(1)} == ''")
            assert await drawn(opened, 0)
            await opened.key("ArrowLeft")
            await opened.until(f"{STEP} == {step - 1}")
            now = "Number(document.querySelector('.now').textContent.replace('−', '-'))"
            await opened.until(f"Math.abs({now} - {values[step - 1]}) < 1e-5")
            await opened.ask("document.querySelector('.pin').click()")
            await opened.until("document.querySelectorAll('.trace').length == 1")

    asyncio.run(main())


def test_a_page_begins_with_the_output_its_target_and_the_error(tmp_path: Path) -> None:
    """And the error falls, without a click."""

    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path, curves=True) as (opened, compiled, _):
            assert [await opened.ask(TITLE.format(at)) for at in range(3)] == ["OT", "T − O", ""]
            await opened.ask("const speed = document.querySelector('#speed'); speed.value = 'max'; speed.onchange()")
            await opened.until(f"{STEP} > 2000")
            last = await pause(opened)
            steps = f"from step {last - 1000} to {last}"
            await opened.until(f"{TRACE.format(0)}?.startsWith('O and T {steps}')")
            await opened.until(f"{TRACE.format(1)}?.startsWith('T − O {steps}')")
            run = compiled.run(last + 1)
            error = run["T"] - run["O"]
            assert np.abs(error[last - 1000 :]).max() < 0.7 * np.abs(error[:1000]).max()
            now = float(str(await opened.ask("document.querySelectorAll('.now')[1].textContent")).replace("−", "-"))
            assert now == pytest.approx(error[last], rel=1e-5)
            assert await drawn(opened, 0)
            assert await drawn(opened, 1)
            await opened.ask("document.querySelectorAll('.of')[1].click()")  # of an error there is nothing to be held
            assert await opened.ask(TITLE.format(2)) == ""
            assert await opened.ask("document.querySelector('#unit').textContent") == "time, s"
            assert await opened.ask(INK.format("document.querySelector('#ticks')"))
            box = "document.querySelector('.trace').getBoundingClientRect()"
            left, top, width = await numbers(opened, *(f"{box}.{name}" for name in ("left", "top", "width")))
            await opened.point(left + 8 + 0.5 * (width - 16), top + 20)
            under = str(await opened.ask("document.querySelector('#under').innerText")).replace("−", "-").split("\n")
            step = last - 500
            assert abs(float(under[0].removesuffix(" s")) / 0.05 - step) < 2
            told = [line.split("  ") for line in under[1:]]
            assert [name for name, _ in told] == ["O", "T", "T - O"]
            every = int(-(-1001 // (width - 16)))  # steps of a bin, whose least and greatest values are told
            bins = [slice(at, at + every) for near in range(step - 2, step + 3) for at in [near // every * every]]
            for (_, value), of in zip(told, (run["O"], run["T"], error), strict=True):
                ends = [float(end) for end in value.split(" … ")]
                assert any(ends == pytest.approx([of[one].min(), of[one].max()], rel=1e-3, abs=1e-4) for one in bins)
            await opened.point(left, 10)
            assert await opened.ask("document.querySelector('#under').hidden")

    asyncio.run(main())


def test_strips_share_their_axis_with_the_scrubber(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await opened.key("]")
            await opened.ask("const speed = document.querySelector('#speed'); speed.value = 'max'; speed.onchange()")
            await opened.until(f"{STEP} > 1500")
            last = await pause(opened)
            axis = tuple(f"{SCRUB}.{name}" for name in ("min", "max", "value"))
            assert await numbers(opened, *axis) == [last - 1000, last, last]
            assert await opened.ask("document.querySelector('#reach').textContent") == "back to 0"
            box = "document.querySelector('.trace').getBoundingClientRect()"
            left, top, width = await numbers(opened, *(f"{box}.{name}" for name in ("left", "top", "width")))
            await opened.click(left + 8 + 0.25 * (width - 16), top + 20)
            await opened.until(f"Math.abs({STEP} - {last - 750}) <= 2")
            assert await numbers(opened, *axis, STEP) == [last - 1000, last, *(await numbers(opened, STEP, STEP))]
            cursor = "document.querySelector('#cursor').getBoundingClientRect().left"
            assert (await numbers(opened, cursor))[0] == pytest.approx(left + 8 + 0.25 * (width - 16), abs=3)
            for _ in range(4):  # 3,000, 10,000, 30,000, all
                await opened.key("<")
            await opened.until(f"{SCRUB}.min == '0'")
            await opened.until(f"{TRACE.format(0)}?.includes('from step 0 to {last}')")
            await scrub(opened, 200)
            await opened.until(f"{STEP} == 200")
            for _ in range(5):
                await opened.key(">")
            await opened.until(f"{SCRUB}.max - {SCRUB}.min == 300")
            low, high, here = await numbers(opened, *axis)
            assert low < here == 200 < high < last, "the axis shows the steps around the one that is shown"

    asyncio.run(main())


def test_a_restart_is_seen_though_a_longer_run_is_behind_it(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path, curves=True) as (opened, _, _):
            await opened.ask("const speed = document.querySelector('#speed'); speed.value = 'max'; speed.onchange()")
            await opened.until(f"{STEP} > 2500")
            last = await pause(opened)
            await scrub(opened, last - 500)
            await opened.until(f"{STEP} == {last - 500}")
            await opened.key("]")
            await opened.key("t")
            await opened.ask("document.querySelector('#lesion').click()")
            await opened.until("document.querySelector('#others').children.length == 1")
            assert await opened.ask(f"{SCRUB}.max") == str(last)
            await opened.ask("document.querySelector('#restart').click()")
            await opened.until(f"{STEP} == 0 && {SCRUB}.min == '0'")
            assert not await opened.ask("document.querySelector('#cursor').hidden")

    asyncio.run(main())


def test_it_jumps_to_events_which_are_marked_as_turns_are(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await opened.until(f"{STEP} > 3")
            assert await opened.ask("document.querySelector('#next').disabled"), "it has no events"
            assert not await opened.ask(MARKS)
            await pause(opened)
            await opened.key("]")
            await opened.key("t")
            await opened.ask("document.querySelector('#lesion').click()")
            await opened.key("ArrowRight")
            await opened.until(MARKS)
            await opened.key("Home")
            await opened.until(f"{STEP} == 0")
            await opened.until(f"!{MARKS}")
        async with shown("hexapod/hexapod.yaml", tmp_path / "events") as (opened, compiled, _):
            steps = sorted({change.at for change in compiled.network.changes})
            await pause(opened)
            await opened.key("Home")
            await opened.key("e")
            await opened.until(f"{STEP} == {steps[0]}")
            await opened.ask("document.querySelector('#next').click()")
            await opened.until(f"{STEP} == {steps[1]}")
            await opened.until(MARKS)
            await opened.ask("document.querySelector('#before').click()")
            await opened.until(f"{STEP} == {steps[0]}")
            await opened.key("E")
            await opened.until("document.querySelector('#refusal').textContent.startsWith('there is no event before')")

    asyncio.run(main())


def test_a_new_curve_runs_over_the_pale_old_one_which_one_click_goes_back_to(tmp_path: Path) -> None:
    """Without a click the output, its target and the error; back, a lesion, on again; and back to how it was."""

    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path, curves=True) as (opened, compiled, _):
            await opened.ask("speed = document.querySelector('#speed'); speed.value = '16'; speed.onchange()")
            await opened.until(f"{STEP} > 400")
            last = await pause(opened)
            went = "', behind it how it went before'"
            assert not await opened.ask(f"{TRACE.format(0)}.includes({went})")
            await scrub(opened, 150)
            await opened.until(f"{STEP} == 150")
            x, y = places(compiled)["K3"]
            await opened.click(x, y)
            await told(opened, "K3")
            await opened.key("t")
            await opened.ask("document.querySelector('#lesion').click()")
            await opened.until("document.querySelector('#others').children.length == 1")
            words = await opened.ask("document.querySelector('#others button').textContent")
            assert words == f"from step 151 to {last}: as it went"
            told_ = f"{TRACE.format(0)}.startsWith('O and T from step 0 to {last}:')"
            await opened.until(f"{told_} && {TRACE.format(0)}.includes({went})")  # before it is gone over
            await scrub(opened, last)
            assert await opened.ask(f"{SCRUB}.value") == "150", "the last step that there is by now"
            await opened.ask("document.querySelector('#back').click()")
            await opened.until(f"{STEP} == 149")
            await opened.ask("document.querySelector('#step').click()")
            await opened.until(f"{STEP} == 150")
            await opened.key(" ")
            await opened.until(f"{STEP} > {last - 40} && {TRACE.format(0)}?.includes({went})")
            now = await pause(opened)
            await opened.ask("document.querySelector('#others button').click()")
            words = f"from step 151 to {now}: step 151: lesion K3"
            await opened.until(f"document.querySelector('#others button').textContent == '{words}'")
            run = compiled.run(last + 1)
            here = min(now, last)
            await opened.until(f"{STEP} == {here}")
            now_ = "Number(document.querySelector('.now').textContent.replace('−', '-'))"
            wanted = float(run["O"][here])
            await opened.until(f"Math.abs({now_} - {wanted}) < {1e-5 * abs(wanted)}")
            buttons = "[...document.querySelectorAll('#others button')]"
            labels = f"{buttons}.map((one) => one.ariaLabel ?? '')"
            await opened.ask("document.querySelector('#current button').click()")
            await opened.call("Input.insertText", text="as it was")
            await opened.key("Enter")
            await opened.until("document.querySelector('#current span').textContent == 'this run: as it was'")
            await side_by_side(opened, buttons)
            await opened.ask(f"{buttons}[3].click()")
            await opened.call("Input.insertText", text="without K3")
            await opened.key("Enter")
            await opened.until(f"{buttons}[0]?.textContent == 'without K3, {words}'")
            assert await opened.ask(labels) == [
                "",
                *(f"{one} without K3" for one in ("compare with", "A | B with", "rename", "delete")),
            ]
            await opened.ask(f"{buttons}[1].click()")
            await opened.until(f"{TRACE.format(0)}.includes(', behind it without K3')")
            row = "document.querySelector('.trace').getBoundingClientRect()"
            at = await opened.ask(f"[{row}.x + {row}.width * 0.6, {row}.y + 20]")
            assert isinstance(at, list)
            await opened.point(*at)
            await opened.until("document.querySelector('#under').textContent.includes('  (without K3 ')")
            (tmp_path / "branches.png").write_bytes(await opened.shot())
            await opened.ask(f"{buttons}[4].click()")
            await opened.until("document.querySelector('#futures').hidden")
            assert await opened.ask("document.querySelector('#did').textContent") == "deleted without K3"
            for kind in ("rawKeyDown", "keyUp"):
                await opened.call("Input.dispatchKeyEvent", type=kind, key="z", modifiers=2)
            await opened.until(f"{buttons}[0]?.textContent == 'without K3, {words}'")

    asyncio.run(main())


async def side_by_side(opened: Page, buttons: str) -> None:
    """Another branch is shown beside the run (A | B) at the same step, with what is held; when both change places their
    pictures are the same to the pixel, as they are before they part."""
    pictures = "[picture, other].map((one) => one.toDataURL())"
    frames = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
    two = "document.body.classList.contains('compared') && other.width == picture.width"

    async def seen() -> list[object]:
        await opened.ask(frames)
        found = await opened.ask(pictures)
        assert isinstance(found, list)
        return found

    await opened.ask(f"{buttons}[2].click()")
    await opened.until(two)
    await scrub(opened, 250)
    await opened.until(f"{STEP} == 250 && other.ariaLabel.includes('step 250')")
    run, branch = await seen()
    assert run != branch
    await pointed_at_in(opened)
    await scrub(opened, 120)
    await opened.until(f"{STEP} == 120 && other.ariaLabel.includes('step 120')")
    before = await seen()
    assert before[0] == before[1]
    await scrub(opened, 250)
    await opened.until(f"{STEP} == 250")
    await opened.ask(f"{buttons}[0].click()")
    await opened.until("!document.body.classList.contains('compared')")
    await opened.ask(f"{buttons}[2].click()")
    await opened.until(f"{two} && other.ariaLabel.includes('step 250')")
    assert await seen() == [branch, run]
    await opened.ask(f"{buttons}[0].click()")
    await opened.until("!document.body.classList.contains('compared')")


#: Move the pointer over the other picture until it is on something whose value is told.
OVER = """
(async () => {
  const { left, top, width, height } = other.getBoundingClientRect();
  for (let x = left + 5; x < left + width; x += 9) for (let y = top + 5; y < top + height; y += 9) {
    other.dispatchEvent(new PointerEvent('pointermove', {clientX: x, clientY: y, bubbles: true}));
    for (let wait = 0; other.style.cursor === 'pointer' && wait < 50; wait++) {
      await new Promise(requestAnimationFrame);
      if (!tip.hidden && /(activity|weight) [^,]+, in B [+−0]/.test(tip.textContent)) return tip.textContent;
    }
  }
  return '';
})()
"""


async def pointed_at_in(opened: Page) -> None:
    """What is pointed at in the other picture has its tooltip there, with its values in both."""
    assert await opened.ask(OVER)
    inside = """(([a, b]) => a.left >= b.left - 1 && a.right <= b.right + 1 && a.top >= b.top - 1)(
        [tip, other].map((one) => one.getBoundingClientRect()))"""
    assert await opened.ask(inside)
    await opened.ask("other.dispatchEvent(new PointerEvent('pointerleave'))")


def test_a_branch_goes_on_from_the_step_that_is_shown(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await opened.key("]")
            await opened.until(f"{STEP} > 30")
            await pause(opened)
            assert await opened.ask("document.querySelector('#branch').disabled"), "nothing came after"
            await scrub(opened, 20)
            await opened.until(f"{STEP} == 20 && !document.querySelector('#branch').disabled")
            await opened.key("b")
            await opened.until(f"{SCRUB}.max == '20' && document.querySelector('#branch').disabled")
            await opened.until(f"{TRACE.format(0)}?.includes('from step 0 to 20')")

    asyncio.run(main())


def test_the_matrix_is_in_place_of_the_picture_with_the_same_click(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await opened.until(f"{STEP} > 100")
            step = await pause(opened)
            await opened.key("m")
            await opened.until("document.querySelector('#matrix').getAttribute('aria-pressed') == 'true'")
            assert "matrix" in str(await opened.ask("document.querySelector('#picture').getAttribute('aria-label')"))
            names = list(compiled.network.neurons.names)  # here in the order of the layout
            margin, side = 20 + 0.7 * 11 * 2, 20
            size = margin + 2 * 11 + side * len(names)
            across, down = await numbers(
                opened, *(f"document.querySelector('#picture').{s}" for s in ("width", "height"))
            )
            scale = min(across / size, down / size)
            left, top = (across - scale * size) / 2, HEAD + (down - scale * size) / 2

            def cell(source: str, target: str) -> tuple[float, float]:
                row, column = names.index(source), names.index(target)
                x, y = (margin + (place + 0.3) * side for place in (column, row))
                return left + scale * x, top + scale * y

            snapshot = compiled.run(step + 1).snapshot(step)
            await opened.point(*cell("C2", "C1"))
            words = await told(opened, "C2 → C1")
            weight = snapshot.weights[compiled.network.connection_index["C2 -> C1"]]
            assert float(words[1].removeprefix("weight ").replace("−", "-")) == pytest.approx(weight, rel=1e-5)
            await opened.click(*cell("K2", "O"))
            await opened.point(2, 2)
            await told(opened, "K2 → O")
            await opened.until(f"{TITLE.format(0)} == 'K2 → O'")
            await opened.click(left + scale * (margin - 5), cell("K3", "O")[1])
            await told(opened, "K3")
            await opened.key("m")
            await opened.until("document.querySelector('#matrix').getAttribute('aria-pressed') == 'false'")
            await told(opened, "K3")

    asyncio.run(main())


def test_a_click_on_a_cell_holds_the_next_of_parallel_connections(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("reward.yaml", tmp_path) as (opened, _, _):
            await pause(opened)
            await opened.key("m")
            await opened.key("/")
            await opened.call("Input.insertText", text="L -> B")
            await opened.until("document.querySelector('#found b')?.textContent == 'L → B'")
            await opened.key("Enter")
            await told(opened, "L → B")
            await opened.key("Escape")
            await opened.ask("new Promise(done => setTimeout(() => requestAnimationFrame(done), 300))")
            box = await opened.ask(
                "(({left, top, right, bottom}) => [left - 14, top - 14, right + 14, bottom + 14])"
                "(document.querySelector('#tip').getBoundingClientRect())"
            )
            assert isinstance(box, list)
            title = "document.querySelector('#tip').textContent.split('\\n')[0]"
            for x, y in ((box[across], box[down]) for across in (0, 2) for down in (1, 3)):
                await opened.point(x, y)  # what is held stands at a corner of its tooltip
                await opened.ask("new Promise(done => setTimeout(() => requestAnimationFrame(done), 100))")
                if await opened.ask(title) == "L → B (2)":
                    break
            for name in ("L → B (2)", "L → B"):
                await opened.click(x, y)
                await opened.point(2, 2)
                await told(opened, name)

    asyncio.run(main())


GATES = """neurovis: 1
name: gates
time: {dt: 0.01}
models: {cell: {state: {v: {derivative: drive - v}}, activity: v}}
synapses: {gate: {state: {g: {initial: 0.5, derivative: pre.v - g}}, signal: weight*g*(1 - post.v)}}
inputs: {wave: {expression: sin(2*t)}}
neurons: {A: {model: cell, input: wave}, B: {model: cell}}
connections: {A -> B: {weight: 2, synapse: gate}}
"""


def test_states_and_signals_are_chosen_and_pinned(tmp_path: Path) -> None:
    spec = tmp_path / "gates.yaml"
    spec.write_text(GATES)
    choice = "document.querySelectorAll('.what:not(.join)')[{0}]"

    async def chosen(opened: Page, place: int, name: str) -> None:
        await opened.ask(f"{choice.format(place)}.value = '{name}'; {choice.format(place)}.onchange()")

    async def main() -> None:
        async with shown(str(spec), tmp_path) as (opened, compiled, _):
            await opened.until(f"{STEP} > 60")
            step = await pause(opened)
            made = compiled.run(step + 1, states="all")
            await opened.click(*places(compiled)["A -> B"])
            await told(opened, "A → B")
            await opened.size(1000, 1000)  # curves stand below, as wide as the window
            await opened.until("innerWidth == 1000")
            options = f"[...{choice.format(0)}.options].map((one) => one.text).join()"
            assert await opened.ask(options) == "weight,g,signal"
            assert not await opened.ask(f"{choice.format(0)}.hidden")
            now = "Number(document.querySelectorAll('.now')[{0}].textContent.replace('−', '-'))"
            await chosen(opened, 0, "g")
            await opened.key("p")
            await chosen(opened, 1, "signal")
            for place, name in enumerate(("g", "signal")):
                values = made[f"(A -> B).{name}"]
                await opened.until(f"{TRACE.format(place)}?.startsWith('A → B, {name} from step 0 to {step}')")
                await opened.until(f"Math.abs({now.format(place)} - {values[step]}) < 1e-5")
                await opened.until(INK.format(f"document.querySelectorAll('.trace')[{place}]"))
                for number in (values.min(), values.max()):
                    assert f"{number:.6g}".replace("-", "−") in str(await opened.ask(TRACE.format(place)))
            await opened.key("Escape")
            await opened.key("]")
            await opened.until(f"{TITLE.format(1)} == 'A'")
            assert await opened.ask(f"[...{choice.format(1)}.options].map((one) => one.text).join()") == "activity,v"
            assert await opened.ask(f"{choice.format(1)}.value") == ""
            await opened.ask("document.querySelector('.pin').click()")
            await opened.until("document.querySelectorAll('.trace').length == 1")

    asyncio.run(main())


def test_a_group_that_fires_has_a_raster(tmp_path: Path) -> None:
    spec = """neurovis: 1
name: fires
time: {dt: 1 ms, steps: 400}
models: {cell: {time: ms, state: {v: {derivative: (drive - v)/20}}, spike: {when: v >= 1, set: {v: 0}}}}
neurons: {K: {count: 3, model: cell, bias: [1.5, 0, 3]}, Q: {}}
connections: {K -> Q: 1}
"""
    (tmp_path / "fires.yaml").write_text(spec, encoding="utf-8")

    async def main() -> None:
        async with shown(str(tmp_path / "fires.yaml"), tmp_path) as (opened, compiled, _):
            await opened.size(1000, 1000)  # curves stand below, as wide as the window
            await opened.until(f"{STEP} > 100")
            step = await pause(opened)
            await opened.key("]")
            await opened.until(f"{TRACE.format(0)}?.startsWith('K')")
            options = "[...document.querySelector('.what').options].map((one) => one.text).join()"
            assert await opened.ask(options) == "activity,v,spike,raster"
            choose = "(s => {{ s.value = '{0}'; s.onchange(); return 1 }})(document.querySelector('.what'))"
            await opened.ask(choose.format("*"))
            first = max(0, step - 1000)
            await opened.until(f"{TRACE.format(0)} == 'raster of K1 … K3 from step {first} to {step}'")
            #: stretches of ink in the middle of each row, a spike each
            marks = (
                "((c, all = c.getContext('2d').getImageData(0, 0, c.width, c.height).data) => [0, 1, 2].map((row) => "
                "[...Array(c.width).keys()].map((x) => all[4 * (Math.round((row + 0.4) * c.height / 3) * c.width + x) "
                "+ 3] > 40).filter((on, x, line) => on && !line[x - 1]).length))(document.querySelector('.trace'))"
            )
            fired = (compiled.run(step + 1)["K"][first:] != 0).sum(axis=0)
            found = await opened.ask(marks)
            assert isinstance(found, list)
            assert np.abs(np.array(found) - fired).max() <= 1  # a bin may begin before the axis
            assert found[1] == fired[1] == 0
            assert fired.max() > 30
            ends = "[...document.querySelectorAll('.ends .end')].map((one) => one.textContent).join()"
            assert str(await opened.ask(ends)).startswith("K1,K3")
            await opened.key("p")
            await opened.until("document.querySelectorAll('.trace.raster').length >= 1")
            await opened.ask(choose.format("v"))
            await opened.until(f"{TRACE.format(0)}?.startsWith('K')")

    asyncio.run(main())


def test_the_ends_of_an_axis_are_told_apart_and_what_rests_has_one(tmp_path: Path) -> None:
    """S is 1 and −1 in turns, R 0.0001 above 0.495 and below it; Q only rounds."""
    spec = """neurovis: 1
name: rests
time: {steps: 10, dt: 0.01}
neurons: {S: {initial: 1}, R: {bias: 0.495}, Q: {bias: 0.495}}
connections: {S -> S: -1, S -> R: 0.0001, S -> Q: 1.0e-8}
outputs: {r: R, q: Q}
render: {min_weight: 0}
"""
    (tmp_path / "rests.yaml").write_text(spec)

    async def main() -> None:
        async with shown(str(tmp_path / "rests.yaml"), tmp_path / "page") as (opened, _, _):
            await opened.size(1280, 800)
            await opened.until(f"{STEP} > 3")
            for name in ("R", "Q"):
                await opened.ask(f"measure.value = '{name}'; measuring.requestSubmit()")
            await opened.until("document.querySelectorAll('.trace').length == 3")
            await opened.ask("{ const s = document.querySelector('#speed'); s.value = 'max'; s.onchange() }")
            await opened.until(f"{STEP} > 1200")
            last = await pause(opened)
            await opened.until(f"{TRACE.format(1)}?.includes('to {last}')")
            ends = "[...document.querySelectorAll('.ends')].map((one) => one.innerText.replace('\\n', ' ')).join()"
            await opened.until(f"{ends}.startsWith('0.4951 0.4949,0.495')")

    asyncio.run(main())


def test_a_strip_of_a_potential_has_marks_where_it_fires(tmp_path: Path) -> None:
    spec = """neurovis: 1
name: fires
time: {dt: 1 ms, steps: 400}
models: {cell: {time: ms, state: {v: {derivative: (drive - v)/20}}, spike: {when: v >= 1, set: {v: 0}}}}
neurons: {K: {model: cell, bias: 1.5}}
"""
    (tmp_path / "fires.yaml").write_text(spec, encoding="utf-8")

    async def main() -> None:
        async with shown(str(tmp_path / "fires.yaml"), tmp_path) as (opened, _, _):
            await opened.size(1000, 1000)  # curves stand below, as wide as the window
            await opened.until(f"{STEP} > 100")
            await pause(opened)
            await opened.key("]")
            await opened.until(f"{TRACE.format(0)}?.startsWith('K')")
            #: pixels with ink in a row that marks alone reach
            above = (
                "(c => [...c.getContext('2d').getImageData(0, 2, c.width, 1).data].filter((value, at) => "
                "at % 4 == 3 && value > 100).length)(document.querySelector('.trace'))"
            )
            await opened.ask("(s => { s.value = 'v'; s.onchange(); return 1 })(document.querySelector('.what'))")
            await opened.until(f"{TRACE.format(0)}?.startsWith('K, v')")
            assert (await numbers(opened, above))[0] > 3
            await opened.ask("(s => { s.value = 'spike'; s.onchange(); return 1 })(document.querySelector('.what'))")
            await opened.until(f"{TRACE.format(0)}?.startsWith('K, spike')")

    asyncio.run(main())


def test_a_curve_is_added_by_typing_it_and_those_who_look_on_see_it(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, access):
            await opened.until(f"{STEP} > 60")
            step = await pause(opened)
            await opened.key("c")
            said = "document.querySelector('#mismeasured').textContent"
            await opened.ask(TYPED.format("'mean(hiden)'"))
            await opened.until(f"{said}.includes(\"no neuron, output or parameter 'hiden'\")")
            field = "document.querySelector('#measure')"
            assert await opened.ask(f"{field}.value.slice({field}.selectionStart, {field}.selectionEnd)") == "hiden"
            await opened.ask(f"{field}.value = 'rms(T - '; {field}.dispatchEvent(new Event('input'))")
            offered = str(
                await opened.ask("[...document.querySelector('#measurable').options].map((o) => o.value).join()")
            )
            assert {"rms(T - O", "rms(T - K3", "rms(T - eta"} <= set(offered.split(","))
            assert not await opened.ask("document.querySelector('#mismeasured').classList.contains('wrong')")
            await opened.ask(TYPED.format("'rms(T - O, last=20)'"))
            await opened.until(f"{TRACE.format(0)}?.startsWith('rms(T - O, last=20) from step 0 to {step}')")
            run = compiled.run(step + 1)
            values = compiled.measure("rms(T - O, last=20)", run)
            ends = [float(number) for number in re.findall(r"\+([\d.]+)", str(await opened.ask(TRACE.format(0))))]
            assert ends == pytest.approx([np.nanmin(values), np.nanmax(values)], rel=1e-4)
            now = "Number(document.querySelectorAll('.now')[0].textContent.replace('−', '-'))"
            await opened.until(f"Math.abs({now} - {values[step]}) < 1e-5")
            assert await opened.ask(f"{field}.value") == ""
            await opened.ask(TYPED.format("'K3 -> O'"))
            await opened.until(f"{TITLE.format(1)} == 'K3 → O'")
            await opened.ask("document.querySelectorAll('.pin')[1].click()")
            await opened.key("Escape")
            await opened.call("Page.navigate", url=access.url(owner=False))
            await opened.until(
                f"[0, 1, 2].some((at) => {TRACE.replace('{0}', 'at')}?.startsWith('rms(T - O, last=20) from'))"
            )
            await opened.ask(TYPED.format("'mean(K)'"))
            await opened.until("document.querySelector('#refusal').textContent.includes('only looks on')")
            await opened.call("Page.navigate", url=access.url())
            await opened.until(f"{TITLE.format(2)}?.startsWith('rms')")
            await opened.ask("document.querySelectorAll('.pin')[2].click()")
            await opened.until(f"{TITLE.format(2)} == ''")

    asyncio.run(main())


async def behind_a_plane(opened: Page, step: int, before: list[npt.NDArray[np.float64]], ink: str) -> None:
    """How a plane went in the branch that is left lies pale in it, in an axis that has room for both."""
    await scrub(opened, 60)
    await opened.until(f"{STEP} == 60")
    await opened.key("t")
    await opened.ask("document.querySelector('#picture').focus()")
    await opened.key("]")
    await opened.ask("document.querySelector('#lesion').click()")
    await opened.until("document.querySelector('#others').children.length == 1")
    await opened.key(" ")
    await opened.until(f"{STEP} > 120 && {TRACE.format(1)}?.includes('behind it how it went before')")
    last = min(step, await pause(opened))
    await opened.key("t")
    canvas = "document.querySelector('.plane')"
    await opened.until(f"{canvas}.width == {canvas}.clientWidth * devicePixelRatio")
    label = str(await opened.ask(TRACE.format(1))).replace("−", "-")
    found = re.search(r"between (\S+) and (\S+), C1 between (\S+) and (\S+),", label)
    assert found
    bottom, top, left, right = (float(one) for one in found.groups())
    height = (await numbers(opened, "document.querySelector('.plane').height"))[0]
    sides = [
        (of[61 : last + 1] - low) / (high - low)
        for of, (low, high) in zip(before, ((left, right), (bottom, top)), strict=True)
    ]
    pairs = zip(*(side.tolist() for side in sides), strict=True)
    points = [[8 + (2 * height - 16) * x, height - 8 - (height - 16) * y] for x, y in pairs][::7]
    assert await opened.ask(ink.replace("> 60", "> 15").format([points])) == [len(points)]


def test_two_signals_share_an_axis_or_span_a_plane_and_part_again(tmp_path: Path) -> None:
    """What is drawn in the plane are the values of the steps, each against that of the same step."""
    ink = (  # of several lists of points, how many of each have some
        "((c, lists, copy = new OffscreenCanvas(c.width, c.height).getContext('2d'), "
        "pixels = (copy.drawImage(c, 0, 0), copy.getImageData(0, 0, c.width, c.height).data), "
        "there = (x, y) => pixels[4 * (Math.round(y) * c.width + Math.round(x)) + 3] > 60) => lists.map((points) => "
        "points.filter(([x, y]) => [-1, 0, 1].some((dx) => [-1, 0, 1].some((dy) => there(x + dx, y + dy)))).length))"
        "(document.querySelector('.plane'), {0})"
    )

    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await opened.size(1000, 1000)  # curves stand below, as wide as the window
            await opened.until(f"{STEP} > 200")
            step = await pause(opened)
            for name in ("C1", "K2", "O"):
                await opened.ask(TYPED.format(f"'{name}'"))
            run = compiled.run(step + 1)
            await opened.ask(JOIN.format(0, "with K2"))
            await opened.until(f"{TITLE.format(0)} == 'C1K2' && {TITLE.format(1)} == 'O'")
            await opened.until(f"{TRACE.format(0)}?.startsWith('C1 and K2 from step 0 to {step}')")
            ends = str(await opened.ask(TRACE.format(0))).replace("−", "-").partition("between ")[2].split(" and ")
            assert [float(one) for one in ends] == pytest.approx([run["C1"].min(), run["K2"].max()], rel=1e-4)
            await opened.ask("document.querySelector('#undo').click()")
            await opened.until(f"{TITLE.format(0)} == 'C1' && {TITLE.format(1)} == 'K2'")
            assert await opened.ask("document.querySelector('#did').textContent") == "undone: C1 with K2"
            await opened.ask("document.querySelector('#redo').click()")
            await opened.until(f"{TITLE.format(0)} == 'C1K2'")
            await opened.ask(JOIN.format(0, "apart"))
            await opened.until(f"{TITLE.format(0)} == 'C1' && {TITLE.format(2)} == 'K2'")
            await opened.ask(JOIN.format(1, "against C1"))
            await opened.until(f"{TRACE.format(1)}?.startsWith('O against C1 from step 0 to {step}')")
            height = (await numbers(opened, "document.querySelector('.plane').height"))[0]
            wide = 2 * height
            sides = [(run[name] - run[name].min()) / np.ptp(run[name]) for name in ("C1", "O")]
            pairs = zip(*(side.tolist() for side in sides), strict=True)
            points = [[8 + (wide - 16) * x, height - 8 - (height - 16) * y] for x, y in pairs][::7]
            mirrored = [[wide - x, y] for x, y in points]
            found = await opened.ask(ink.format([points, mirrored]))
            assert isinstance(found, list)
            assert found[0] == len(points)
            assert found[1] < 0.7 * len(points)
            await opened.ask("document.querySelector('#undo').click()")
            await opened.until(f"{TRACE.format(1)}?.startsWith('O from step 0 to {step}')")
            await opened.ask("document.querySelector('#redo').click()")
            await opened.until(f"{TRACE.format(1)}?.startsWith('O against C1 from step 0 to {step}')")
            await behind_a_plane(opened, step, [run["C1"], run["O"]], ink)
            await opened.ask(JOIN.format(1, "over time"))
            await opened.until(f"{TRACE.format(1)}?.startsWith('O from step 0 to')")
            await opened.ask("document.querySelector('#picture').focus()")
            await opened.key("f")
            await opened.until("document.documentElement.classList.contains('presenting')")
            await opened.ask("document.querySelector('#unpresent').click()")
            await opened.until("!document.documentElement.classList.contains('presenting')")

    asyncio.run(main())


def test_a_range_is_shown_alone_and_played_over_and_over(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await opened.until(f"{STEP} > 300")
            last = await pause(opened)
            await opened.ask(TYPED.format("'O'"))
            await opened.until(f"{TRACE.format(0)}?.startsWith('O from step 0 to {last}')")
            box = "document.querySelector('.trace').getBoundingClientRect()"
            left, top, width = await numbers(opened, *(f"{box}.{name}" for name in ("left", "top", "width")))
            for kind, share in (("mousePressed", 0.25), ("mouseMoved", 0.4), ("mouseReleased", 0.5)):
                x = left + 8 + share * (width - 16)
                more = {"button": "left", "buttons": 1, "clickCount": 1, "modifiers": 8}
                await opened.call("Input.dispatchMouseEvent", type=kind, x=x, y=top + 20, **more)
            low, high = round(0.25 * last), round(0.5 * last)
            await opened.until(f"Math.abs({SCRUB}.min - {low}) < 3 && Math.abs({SCRUB}.max - {high}) < 3")
            low, high, here = (int(one) for one in await numbers(opened, f"{SCRUB}.min", f"{SCRUB}.max", STEP))
            assert here == last, "to look closer is not to go elsewhere"
            await opened.until(f"{TRACE.format(0)}?.startsWith('O from step {low} to {high}')")
            assert await opened.ask("document.querySelector('#cursor').hidden")
            await opened.ask("document.querySelector('#loop').click()")
            await opened.until(
                f"document.querySelector('#loop').getAttribute('aria-pressed') == 'true' && {STEP} < {high}"
            )
            await opened.until(f"{STEP} > {high - 20}", 60)
            await opened.until(f"{STEP} < {low + 20}", 60)
            assert await opened.ask(f"{SCRUB}.max") == str(high)
            turned = {"x": left + 0.5 * width, "y": top + 20, "deltaX": 0, "deltaY": -100, "modifiers": 8}
            await opened.call("Input.dispatchMouseEvent", type="mouseWheel", **turned)
            await opened.until(f"{SCRUB}.min > {low} && {SCRUB}.max < {high}")
            await opened.ask("document.querySelector('#unzoom').click()")
            await opened.until(f"{SCRUB}.min == '0' && document.querySelector('#zoomed').hidden")

    asyncio.run(main())
