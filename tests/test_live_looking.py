"""Looking in the live page: the tooltip says what a neuron or a connection is, and what is held stands out."""

from __future__ import annotations

import asyncio
import gzip
import io
import json
from pathlib import Path

import numpy as np
import pytest
from chromium import Page
from live_window import HEAD, area_of, fit
from PIL import Image
from test_live_browser import pause, shown

import neurovis_spec as nv
from neurovis_spec.compilation import Compilation
from neurovis_spec.live.view import view_of

pytestmark = pytest.mark.browser

#: Pixels that are free above and below the network where tooltips need them.
BESIDE = 150

TIP = "document.querySelector('#tip')"


def places(compiled: Compilation) -> dict[str, tuple[float, float]]:
    """Where the window of ``shown`` has each neuron, and the end of each connection."""
    view = view_of(compiled, compiled.gains)
    scene, area = json.loads(gzip.decompress(view.content)), area_of(view)
    result = {}
    for group in scene["groups"]:
        name = group["data"].get("neuron") or group["data"].get("connection")
        if name is not None:
            at = group["shapes"][0 if "neuron" in group["data"] else 1]["at"]
            if "neuron" not in group["data"]:  # a little before the tip of the arrow
                along = group["shapes"][1]["along"]
                at = [at[axis] - 8 * along[axis] for axis in (0, 1)]
            result[name] = area.at(*at)
    return result


async def told(opened: Page, name: str) -> list[str]:
    """What the tooltip says, once it is about this."""
    await opened.until(f"!{TIP}.hidden && {TIP}.textContent.split('\\n')[0] == '{name}'")
    await opened.until(f"/^(activity|weight) /m.test({TIP}.textContent)")
    found = await opened.ask(f"{TIP}.textContent")
    assert isinstance(found, str)
    return found.split("\n")


def bends(compiled: nv.CompiledNetwork) -> dict[str, tuple[tuple[str, str], list[tuple[float, float]]]]:
    """The ends of each connection, and the points halfway along the pieces of its line in the window of ``shown``."""
    view = view_of(compiled, compiled.gains)
    scene, area = json.loads(gzip.decompress(view.content)), area_of(view)
    result = {}
    for group in scene["groups"]:
        if "connection" in group["data"]:
            points = np.array([area.at(x, y) for x, y in np.reshape(group["shapes"][0]["points"], (-1, 2))])
            pieces = [points[first : first + 4] for first in range(0, len(points) - 3, 3)]
            middles = [(a + 3 * b + 3 * c + d) / 8 for a, b, c, d in pieces]
            found = [(float(x), float(y)) for x, y in [*middles, *points[::3]]]
            result[group["data"]["connection"]] = ((group["data"]["from"], group["data"]["to"]), found)
    return result


def test_the_tooltip_does_not_lie_on_what_it_tells_of(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await pause(opened)
            wide, high = area_of(view_of(compiled, compiled.gains)).size
            await fit(opened, wide, high + 2 * BESIDE)  # so that there is room for it
            at = {name: (x, y + BESIDE) for name, (x, y) in places(compiled).items()}
            lines = {
                name: (ends, [(x, y + BESIDE) for x, y in points]) for name, (ends, points) in bends(compiled).items()
            }

            async def covered(points: list[tuple[float, float]]) -> int:
                await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
                ask = f"(({{left, top, right, bottom}}) => [left, top, right, bottom])({TIP}.getBoundingClientRect())"
                box = await opened.ask(ask)
                assert isinstance(box, list)
                return sum(box[0] < x < box[2] and box[1] < y < box[3] for x, y in points)

            for name in ("C1 -> K8", "C2 -> K8", "K1 -> O", "K8 -> O"):
                await opened.point(*lines[name][1][0])
                await told(opened, name.replace("->", "→"))
                assert await covered(lines[name][1]) == 0, name
            for name in ("K1", "K8", "O"):
                await opened.point(*at[name])
                await told(opened, name)
                own = [point for ends, points in lines.values() if name in ends for point in points]
                assert await covered(own) == 0, name

    asyncio.run(main())


def test_a_pointer_is_told_name_value_delay_and_rule(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await opened.until("Number(document.querySelector('#told').textContent.split(' ')[1]) > 20")
            step, at = await pause(opened), places(compiled)
            run = compiled.run(step + 1)
            await opened.point(*at["C1"])
            words = await told(opened, "C1")
            value = float(words[1].removeprefix("activity ").replace("−", "-"))
            neuron = compiled.network.neurons.names.index("C1")
            assert value == pytest.approx(run.snapshot(step).activity[neuron], rel=1e-5)
            assert "tanh" in words
            await opened.point(*at["K2 -> O"])
            words = await told(opened, "K2 → O")
            assert float(words[1].removeprefix("weight ").replace("−", "-")) == pytest.approx(
                run.snapshot(step).weights[compiled.network.connection_index["K2 -> O"]], rel=1e-5
            )
            assert "delay 0" in words
            assert "delta(rate=0.01, target=T)" in words
            await opened.point(*at["C2 -> C1"])
            words = await told(opened, "C2 → C1")
            assert "delay 1" in words
            assert words[1][len("weight ")] in "+−", "the sign is not told by colour alone"
            await opened.point(2, 2)
            await opened.until(f"{TIP}.hidden")

    asyncio.run(main())


def test_a_click_holds_until_escape_and_the_rest_recedes(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, compiled, _):
            await pause(opened)
            at = places(compiled)

            async def colours(*names: str) -> list[tuple[int, ...]]:
                """The colours of discs, above their labels."""
                await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
                pixels = np.array(Image.open(io.BytesIO(await opened.shot())).convert("RGB"))
                return [tuple(pixels[round(at[name][1]) - 13, round(at[name][0])].tolist()) for name in names]

            before = await colours("K2", "O", "K5")
            await opened.click(*at["K2"])
            await told(opened, "K2")
            await opened.point(2, 2)
            await told(opened, "K2")
            held = await colours("K2", "O", "K5")
            assert held[:2] == before[:2], "its inputs and outputs stand out"
            assert min(held[2]) > min(before[2]), "the rest recedes"
            await opened.key("Escape")
            await opened.until(f"{TIP}.hidden")
            assert await colours("K2", "O", "K5") == before
            await opened.click(*at["K2 -> O"])
            await opened.point(2, 2)
            await told(opened, "K2 → O")
            held = await colours("K2", "O", "K5")
            assert held[:2] == before[:2]
            assert min(held[2]) > min(before[2])
            await opened.click(12, HEAD + 40)
            await opened.until(f"{TIP}.hidden")

    asyncio.run(main())


def test_neurons_are_held_one_after_the_other_by_keys(tmp_path: Path) -> None:
    async def main() -> None:
        async with shown("cpg_rbf.yaml", tmp_path) as (opened, _, _):
            await opened.key("]")
            await told(opened, "C1")
            await opened.key("]")
            await told(opened, "C2")
            await opened.key("[")
            await opened.key("[")
            await told(opened, "T")

    asyncio.run(main())
