"""What is held in the live page shows all its connections, also those for which the picture has no room."""

from __future__ import annotations

import asyncio
import gzip
import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from live_window import area_of
from test_live_browser import STEP, pause, shown
from test_live_hand import at_hand
from test_live_looking import TIP, places, told
from test_live_server import Eyes, Live, served
from test_live_zoom import picture
from test_scene_bundles import LAYERS

import neurovis_spec as nv
from neurovis_spec.live.commands import Appearance
from neurovis_spec.live.held import told_of
from neurovis_spec.live.joined import joined
from neurovis_spec.live.protocol import values_message
from neurovis_spec.live.show import Show
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.sums import Sums
from neurovis_spec.live.turns import Lesion
from neurovis_spec.live.view import View, view_of

#: The second layer in a box; what a picture draws of 90 connections is a part.
BOXED = LAYERS.replace("B: {count: 8}", "B: {count: 8, box: second}").replace("engine: grid", "engine: layered")
PAIRS = """
neurovis: 1
name: pairs
neurons: {A: {count: 4}, B: {count: 4}}
connections: {A -> B: {pattern: all_to_all, weight: 1, symmetric: true}, A1 -> A1: 1}
layout: {engine: grid}
"""


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures have room for 20 lines."""
    for name, number in {"_ALL": 20, "_MOST_LINES": 20, "_LINES_EACH": 1}.items():
        monkeypatch.setattr(f"neurovis_spec.scene.shown.{name}", number)


def asked(seen: View, item: str, weights: np.ndarray | None = None) -> dict[str, Any]:
    first = seen.drawn.network.connections.weights.whole()
    found = json.loads(gzip.decompress(told_of(seen, item, first if weights is None else weights)))
    assert isinstance(found, dict)
    return found


@cache
def view(text: str) -> View:
    compiled = nv.compile_text(text)
    return view_of(compiled, compiled.gains)


def item_of(seen: View, name: str, kind: str = "") -> tuple[str, set[int]]:
    """The id of what is held, and its neurons."""
    names = seen.drawn.network.neurons.names
    own = set(seen.plan.boxes[f"{kind}:{name}"]) if kind else {names.index(name)}
    return f"{kind}:{name}" if kind else f"n{names.index(name)}", own


@pytest.mark.parametrize(
    ("text", "name", "kind"),
    [
        (BOXED, "A2", ""),
        (BOXED, "B8", ""),
        (BOXED, "second", "box"),
        (PAIRS, "A1", ""),
        (LAYERS + "render: {collapse: [A]}\n", "A", ""),
    ],
)
def test_what_the_picture_leaves_out_of_what_is_held_is_told(text: str, name: str, kind: str) -> None:
    seen = view(text)
    item, own = item_of(seen, name, kind)
    ends, counts = seen.drawn.network.connections, seen.drawn.counts.tolist()
    found = asked(seen, item)
    pairs = list(zip(ends.sources.tolist(), ends.targets.tolist(), strict=True))
    every = {index for index, (a, b) in enumerate(pairs) if a in own or b in own}
    told = {int(group["id"][1:]) for group in found["groups"]}
    second = set(ends.second.tolist())
    assert not told & seen.plan.lines.keys()
    assert told | (seen.plan.lines.keys() & every) == {
        int(ends.twins[index]) if ends.twins is not None and index in second else index for index in every
    }
    into = sum(counts[i] for i in every if pairs[i][0] not in own)
    out = sum(counts[i] for i in every if pairs[i][1] not in own)
    assert (found["inputs"], found["outputs"]) == (into, out)
    assert into + out + found["within"] == sum(counts[i] for i in every)
    for group in found["groups"]:
        assert group["title"].startswith(group["data"]["from"])
        assert [shape["kind"] for shape in group["shapes"]][:2] == ["line", "head"]


def test_of_a_bundle_it_is_what_is_left_out_of_its_pathway_and_of_nothing_nothing() -> None:
    seen = view(BOXED)
    for item, pathway in seen.plan.left.items():
        found = asked(seen, item)
        assert {int(group["id"][1:]) for group in found["groups"]} == set(pathway.members.tolist())
        assert found["within"] == pathway.count
    for item in ("n999", "c999", "box:nobody", "bundle:A -> nobody"):
        assert asked(seen, item) == {
            "of": item,
            **dict.fromkeys(("inputs", "outputs", "within", "undrawn"), 0),
            "groups": [],
        }


def test_of_very_many_the_strongest_by_the_weights_of_now_are_drawn_and_all_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("neurovis_spec.live.held.MOST", 3)
    seen = view(BOXED)
    hidden = sorted(set(range(90)) - seen.plan.lines.keys())
    weights = np.zeros(90)
    weights[hidden[10:13]] = 5, -7, np.nan
    weights[hidden[14]] = -0.5
    found = asked(seen, "box:second", weights)
    assert [group["id"] for group in found["groups"]] == [f"c{hidden[place]}" for place in (10, 11, 14)]
    assert found["undrawn"] == len(hidden) - 3
    assert found["inputs"] + found["outputs"] + found["within"] == 90


@given(data=st.data())
def test_bundles_add_up_what_lines_do_now_and_how_many_are_lesioned(data: st.DataObject) -> None:
    seen = view(BOXED)
    some = list(seen.plan.left.values())
    numbers = st.lists(st.integers(-3, 3), min_size=90, max_size=90)
    weights = np.array(data.draw(numbers), float)
    ends = np.sign(data.draw(numbers)).astype(np.int8)
    lost = np.array(data.draw(numbers)) > 1
    found = Sums.of(some, seen.drawn.counts).at(weights, ends, lost)
    for one, row in zip(some, found.tolist(), strict=True):
        own = one.members.tolist()
        sums = [sum(weights[i] for i in own if ends[i] == end) for end in (1, -1, 0)]
        counts = [sum(ends[i] == end for i in own) for end in (1, -1, 0)]
        assert row == [*sums, *counts, sum(lost[i] for i in own)]


NESTED = """
neurovis: 1
name: nested
modules:
  leg: {neurons: {A: {count: 2}, B: {count: 3, box: inner}}, connections: {A -> B: {pattern: all_to_all, weight: 1}}}
neurons: {O: {count: 2}, P: {}}
instances: {left: {module: leg}, right: {module: leg}}
connections:
  left.B -> O: {pattern: all_to_all, weight: -2}
  O -> right.A: {pattern: all_to_all, weight: 0.5}
  left.A -> right.B: {pattern: all_to_all, weight: 3}
  O -> P: {pattern: all_to_all, weight: 1}
"""


@pytest.mark.parametrize(
    "boxes", [["instance:left"], ["instance:right", "instance:left", "no:body"], ["box:left.inner"]]
)
def test_what_runs_from_and_to_closed_boxes_is_added_up(boxes: list[str]) -> None:
    seen = view(NESTED)
    ends = seen.drawn.network.connections
    weights = ends.weights.whole()
    found = joined(seen, boxes)
    rows = found.sums.at(weights, np.sign(weights).astype(np.int8), np.zeros(len(ends), bool))
    known = [box for box in boxes if box in seen.plan.boxes]
    assert known
    assert found.boxes == tuple(known)

    def unit(neuron: int) -> str:
        return next((box for box in known if neuron in seen.plan.boxes[box]), f"n{neuron}")

    wanted: dict[tuple[str, str], list[float]] = {}
    for a, b, weight in zip(ends.sources.tolist(), ends.targets.tolist(), weights.tolist(), strict=True):
        pair = unit(a), unit(b)
        if pair[0] != pair[1] and {*pair} & {*known}:
            wanted.setdefault(pair, []).append(weight)
    told = {pair: (row[:2].sum(), row[3:6].sum()) for pair, row in zip(found.ends, rows, strict=True)}
    assert told == {pair: (sum(some), len(some)) for pair, some in wanted.items()}


@pytest.mark.parametrize("owner", [True, False])
def test_whoever_asks_is_told_and_who_asks_again_is_told_of_that(owner: bool) -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.owner if owner else live.access.viewer) as stream:
            found = list[dict[str, Any]]()
            eyes = Eyes(stream)
            await eyes.until(lambda: eyes.step > 2)
            for of in ("n3", "c0", "box:none"):
                await stream.send_json({"type": "connections", "of": of})
            while not found or found[-1]["of"] != "box:none":
                message = await stream.receive(30)
                if isinstance(message.data, bytes) and message.data[0] == 7:
                    found.append(json.loads(gzip.decompress(message.data[4:])))
            assert [one["of"] for one in found] in (["n3", "box:none"], ["n3", "c0", "box:none"], ["c0", "box:none"])
            counts = {one["of"]: (one["inputs"], one["outputs"], one["within"], one["groups"]) for one in found}
            assert counts.get("n3", (3, 3, 0, [])) == (3, 3, 0, [])
            assert counts.get("c0", (0, 0, 1, [])) == (0, 0, 1, [])

    served(test)


@pytest.mark.browser
def test_what_is_held_is_drawn_listed_and_counted_with_the_weights_of_now(tmp_path: Path) -> None:
    text = BOXED.replace("count: 6, bias: 1}", "count: 6, activation: tanh, bias: 1}").replace(
        "steps: 3", "steps: 3, dt: 0.05"
    )
    (tmp_path / "layers.yaml").write_text(text.replace("count: 8,", "count: 8, activation: tanh,"))
    rows = "[...document.querySelectorAll('#found li')].map((row) => row.textContent)"

    async def main() -> None:
        async with shown(str(tmp_path / "layers.yaml"), tmp_path) as (opened, compiled, _):
            await opened.until("Number(document.querySelector('#told').textContent.split(' ')[1]) > 9")
            step = await pause(opened)
            seen = view_of(compiled, compiled.gains)
            network, lines = compiled.network, seen.plan.lines
            ends, names = network.connections, network.neurons.names
            at, within = places(compiled), area_of(seen).at

            await opened.click(*at["B3"])
            await told(opened, "B3")
            own = [i for i in range(len(ends)) if "B3" in (names[ends.sources[i]], names[ends.targets[i]])]
            into = sum(names[ends.targets[i]] == "B3" for i in own)
            hidden = [i for i in own if i not in lines]
            assert hidden
            await opened.until(f"{TIP}.textContent.includes('connections {into} in, {len(own) - into} out')")
            await opened.point(2, 2)
            await picture(opened)
            pixels = np.array(await picture(opened)).astype(int).min(axis=2)
            groups = asked(seen, f"n{names.index('B3')}")["groups"]
            assert {int(group["id"][1:]) for group in groups} == set(hidden)
            for group in groups:
                a, b, c, d = np.reshape(group["shapes"][0]["points"][:8], (4, 2))
                x, y = np.rint(within(*(a + 3 * b + 3 * c + d) / 8)).astype(int)
                # a thin line between two pixels is as pale as 182, one that recedes as 242
                assert pixels[y - 2 : y + 3, x - 2 : x + 3].min() < 200, "the line is there, and all else recedes"
            # the outline has the same, each with its weight of this step
            await opened.key("o")
            await opened.until(
                f"{rows}.length == {1 + len(own)} && {rows}.slice(1, 9).every((row) => /weight /.test(row))"
            )
            weights, listed = compiled.run(step + 1).snapshot(step).weights, await opened.ask(rows)
            assert isinstance(listed, list)
            called = {network.connection_names[i].replace("->", "→"): i for i in own}
            assert {str(row).split(" weight ")[0] for row in listed[1:9]} <= called.keys()
            for row in listed[1:9]:
                name, _, rest = str(row).partition(" weight ")
                value = float(re.split("[, ]", rest)[0].replace("−", "-"))
                assert value == pytest.approx(weights[called[name]], rel=1e-5)
            # a box has all of its neurons', a bundle what is left out of its pathway; Escape lets go of both
            await opened.ask("Object.assign(document.querySelector('#search'), {value: 'second'}).oninput()")
            await opened.until(f"{rows}.length > 0")
            await opened.key("Enter")
            await opened.until(f"/connections 48 in, 32 out, 10 within/.test({TIP}.textContent)")
            await opened.ask("Object.assign(document.querySelector('#search'), {value: 'B → A'}).oninput()")
            await opened.until(f"{rows}[0]?.startsWith('B → A ·')")
            await opened.key("Enter")
            left = seen.plan.left["bundle:B -> A"].members
            await opened.until(f"{TIP}.textContent.startsWith('B → A · {len(left)} connections, sum ')")
            words = str(await opened.ask(f"{TIP}.textContent")).split("\n")[0]
            total = weights[left].sum()
            assert abs(total - network.connections.weights[left].sum()) > 0.01, "they have learned"
            assert float(words.split("sum ")[1].replace("−", "-")) == pytest.approx(total, rel=1e-3)
            await opened.ask("Object.assign(document.querySelector('#search'), {value: ''}).oninput()")
            await opened.until(f"{rows}.filter((row) => /^B\\d+ → A/.test(row)).length == {len(left)}")
            await opened.key("Escape")
            await opened.ask("document.querySelector('#picture').focus()")
            await opened.key("Escape")
            await opened.until(f"{TIP}.hidden")

    asyncio.run(main())


#: A network of which a picture with room for four lines leaves out pathways of one connection, and a part of others.
LONE = """neurovis: 1
name: lone
neurons: {A: {count: 2, activation: tanh, bias: 0.1}, B: {activation: tanh}, C: {activation: tanh}, D: {}, E: {}}
connections:
  - A -> B: 1
  - A -> C: 1
  - A -> D: 1
  - B -> D: {weight: -0.05, delay: 3}
  - C -> D: 0.05
  - C -> E: 1
  - E -> C: 1
"""


def test_of_what_is_added_up_each_lesioned_connection_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, number in {"_ALL": 1, "_MOST_LINES": 1, "_LINES_EACH": 0}.items():
        monkeypatch.setattr(f"neurovis_spec.scene.shown.{name}", number)
    compiled = nv.compile_text(LONE, file="lone.yaml")
    view, source = Show().view(compiled, Appearance(pathways=True)), SimulatedSource(compiled.simulator())
    items = ["c0", "c1", "n0", "n99", "c1.g", "e0"]
    assert (view.partly(source.seen(), items), view.glance(source.seen()).sums[:, -1].sum()) == ({}, 0)
    source.turn(Lesion("A1 -> C"))
    assert (view.partly(source.seen(), items), view.glance(source.seen()).sums[:, -1].sum()) == ({"c1": (1, 2)}, 1)
    source.turn(Lesion("A2 -> C"))
    assert (view.partly(source.seen(), items), view.glance(source.seen()).sums[:, -1].sum()) == ({}, 2)
    assert np.flatnonzero(view.lesioned(source.seen())[1]).tolist() == [1]
    source.turn(Lesion("A1"))
    assert view.partly(source.seen(), items)["n0"] == (1, 2)
    message = json.loads(values_message(3, {}, {}, ({"n0": (1, 2)}, {})))
    assert message == {"type": "values", "step": 3, "values": {}, "other": {}, "lost": {"n0": [1, 2]}, "otherLost": {}}


@pytest.mark.browser
def test_a_bundle_says_what_of_it_is_lesioned_also_if_it_is_one_connection(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, number in {"_ALL": 4, "_MOST_LINES": 4, "_LINES_EACH": 0}.items():
        monkeypatch.setattr(f"neurovis_spec.scene.shown.{name}", number)
    (tmp_path / "lone.yaml").write_text(LONE)
    rows = "[...document.querySelectorAll('#found li')].map((row) => row.textContent)"
    scrub = "document.querySelector('#scrub')"

    async def main() -> None:
        async with at_hand(tmp_path, str(tmp_path / "lone.yaml")) as (opened, desk, _):
            await opened.until(f"{STEP} > 30")
            await pause(opened)
            compiled = desk.placed.compiled
            view = view_of(compiled, compiled.gains)
            scene, area = json.loads(gzip.decompress(view.content)), area_of(view)
            assert set(scene["bundles"]["lone"]) == {"bundle:B -> D", "bundle:C -> D"}
            bundles = {
                group["id"]: group["shapes"][0] for group in scene["groups"] if group["id"].startswith("bundle:")
            }

            async def over(bundle: str, *wanted: str) -> str:
                a, b, c, d = np.reshape(bundles[f"bundle:{bundle}"]["points"][:8], (4, 2))
                await opened.point(2, 2)
                await opened.point(*area.at(*(a + 3 * b + 3 * c + d) / 8))
                said = f"{json.dumps(wanted)}.every((words) => {TIP}.textContent.includes(words))"
                await opened.until(f"!{TIP}.hidden && {said}")
                return str(await opened.ask(f"{TIP}.textContent"))

            async def hold(name: str) -> None:
                await opened.ask(f"Object.assign(document.querySelector('#search'), {{value: '{name}'}}).oninput()")
                await opened.until(f"{rows}[0]?.startsWith('{name} ')")
                await opened.ask("document.querySelector('#search').focus()")
                await opened.key("Enter")

            async def lesion(name: str) -> None:
                await hold(name)
                await opened.until("!document.querySelector('#part').hidden")
                await opened.ask("document.querySelector('#lesion').click()")
                await opened.until(f"{rows}[0]?.startsWith('{name} ') && {rows}[0].includes('lesioned')")

            assert await over("B -> D", "weight") == "B → D\nweight −0.05\ndelay 3"
            await opened.ask(f"{scrub}.value = 20; {scrub}.dispatchEvent(new Event('input'))")
            await opened.until(f"{STEP} == 20")
            await opened.key("o")
            await lesion("B → D")
            await hold("A → C")  # which lists what it stands for
            await lesion("A1 → C")
            for _ in range(2):
                await opened.key("Escape")
                await opened.ask("document.querySelector('#picture').focus()")
            words = (await over("B -> D", "weight", "lesioned")).split("\n")
            assert (words[:3], words[-1]) == (["B → D", "weight −0.05", "delay 3"], "lesioned")
            assert await over("A -> C", "lesioned") == "A → C · 2 connections, sum 2 (1 lesioned)\nall excite"
            assert "lesioned" not in await over("C -> D", "weight")
            (tmp_path / "told.png").write_bytes(await opened.shot())
            await opened.key("g")  # as pathways: of what is added up a part is lesioned
            await opened.until("document.querySelector('#pathways').ariaPressed == 'true'")
            await opened.key("o")
            await opened.until(f"!{rows}.some((row) => row.startsWith('A1 → C'))")
            await hold("A → C")
            await opened.until(f"{rows}[0].includes('1 of 2 lesioned')")

    asyncio.run(main())
