"""Bundles: what a picture leaves out of a pathway is drawn, counted and added up, and nothing else is."""

from __future__ import annotations

import gzip
import io
import json
import math
import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_renderers.animated_svg import AnimatedSvgRenderer
from neurovis_renderers.canvas import paint
from neurovis_renderers.frames import frames
from PIL import Image
from scenes import file_of, film_of, scene_of
from test_scene_thinned import ENTRY, network_of

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.layout import Layout
from neurovis_spec.live.view import view_of
from neurovis_spec.scene import Arrowhead, Disc, Film, Group, Scene, Spline, Text, shown, still
from neurovis_spec.scene.renderers import renderer_for
from neurovis_spec.scene.themes import channels

#: Two layers of which the second learns and inhibits itself; 90 connections, of which 20 are drawn.
LAYERS = """
neurovis: 1
name: layers
time: {steps: 3}
neurons: {A: {count: 6, bias: 1}, B: {count: 8}}
connections:
  A -> B: {pattern: all_to_all, weight: "normal(0.1, 1)", delay: 3}
  B -> A: {pattern: {total: {count: 32}}, weight: 0.25, plasticity: {hebbian: {rate: 0.01}}}
  B -> B: {pattern: {total: {count: 10}}, weight: -0.5}
layout: {engine: grid}
"""


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if a picture had room for few lines."""
    for name, number in {"_ALL": 20, "_MOST_LINES": 20, "_LINES_EACH": 1}.items():
        monkeypatch.setattr(shown, name, number)


def drawn(network: CompiledNetwork, step: int = 0, **asked: object) -> Scene:
    wanted = replace(network.network.render, **asked)  # type: ignore[arg-type]
    return scene_of(network, network.run(step + 1).snapshot(step), settings=wanted)


def bundles_of(scene: Scene) -> dict[str, Group]:
    return {group.data["pathway"]: group for group in scene.groups if "pathway" in group.data}


@pytest.fixture(scope="module")
def layers() -> CompiledNetwork:
    return nv.compile_text(LAYERS)


def test_a_bundle_says_how_many_are_left_out_what_they_do_and_who_learns(layers: CompiledNetwork) -> None:
    scene, ends = drawn(layers, 2), layers.network.connections
    whole, group = layers.network, [one.name for one in layers.network.neurons.groups for _ in one.indices]
    weights = layers.run(3).snapshot(2).weights
    seen = {one.data["connection"] for one in scene.groups if "connection" in one.data}
    gone = [index for index, name in enumerate(whole.connection_names) if name not in seen]
    bundles = bundles_of(scene)
    assert sorted(bundles) == ["A -> B", "B -> A", "B -> B"]
    for name, bundle in bundles.items():
        own = [i for i in gone if f"{group[ends.sources[i]]} -> {group[ends.targets[i]]}" == name]
        total, data = weights[own].sum(), bundle.data
        assert int(data["count"]) == len(own)
        assert float(data["sum"]) == pytest.approx(total)
        parts = {1: weights[own][weights[own] >= 0], -1: weights[own][weights[own] < 0]}
        for end, word in ((1, "excite"), (-1, "inhibit")):
            assert (word in data) == (len(parts[end]) > 0)
            assert float(data.get(word, "0")) == pytest.approx(parts[end].sum())
        assert bundle.title.startswith(f"{name.replace('->', '→')} · {len(own):,}\n")
        assert ("learns" in data) == (name == "B -> A")
    assert "Σ w = " in bundles["B -> A"].title
    assert " at step 2\nhebbian(" in bundles["B -> A"].title
    assert bundles["A -> B"].title.endswith("delay 3")
    kinds = [[shape.kind for shape in b.shapes if isinstance(shape, Arrowhead)] for b in bundles.values()]
    assert sorted(kinds) == [["arrow"], ["arrow", "bar"], ["bar"]]


def test_a_band_is_as_wide_as_the_root_of_its_sum_and_wider_than_lines(layers: CompiledNetwork) -> None:
    scene = drawn(layers)
    widths, sums = list[float](), list[float]()
    for bundle in bundles_of(scene).values():
        widths += [shape.width for shape in bundle.shapes if isinstance(shape, Spline)]
        sums += [abs(float(bundle.data[word])) for word in ("excite", "inhibit") if word in bundle.data]
    assert np.allclose(np.array(widths) ** 2 / np.array(sums), widths[0] ** 2 / sums[0])
    words = [
        shape.text
        for group in scene.groups
        if group.id == "legend"
        for shape in group.shapes
        if isinstance(shape, Text)
    ]
    assert f"left out, added up: |Σ w| up to {max(sums):.3g}" in words
    assert {"Bundle", "excite", "inhibit"} <= set(words)


def test_bundles_lie_beneath_neurons_and_names_and_within_the_picture(layers: CompiledNetwork) -> None:
    scene = drawn(layers)
    places = {id_: place for place, id_ in enumerate(group.id for group in scene.groups)}
    bands = [places[group.id] for group in bundles_of(scene).values()]
    assert max(place for id_, place in places.items() if re.fullmatch(r"c\d+", id_)) < min(bands)
    assert max(bands) < min(place for id_, place in places.items() if re.fullmatch(r"n\d+|title:.*|hubs", id_))
    for bundle in bundles_of(scene).values():
        for shape in bundle.shapes:
            for x, y in shape.points if isinstance(shape, Spline | Arrowhead) else ():
                assert 0 < x < scene.width
                assert 0 < y < scene.height
    (hubs,) = [group for group in scene.groups if group.id == "hubs"]
    assert [shape.text for shape in hubs.shapes if isinstance(shape, Text)] == ["A ×6", "B ×8"]
    assert Counter(group.data["group"] for group in scene.groups if "neuron" in group.data) == {"A": 6, "B": 8}


def test_nothing_is_bundled_where_nothing_is_left_out_or_the_reader_left_it_out(layers: CompiledNetwork) -> None:
    for asked in ({"full": True}, {"focus": ("A1", (0,))}, {"min_weight": 0.3}, {"path": ("A -> B", (0,), (10,))}):
        scene = drawn(layers, **asked)
        assert not bundles_of(scene)
        assert "Bundle" not in str(scene.groups[-1])


@given(
    st.lists(st.integers(1, 9), min_size=4, max_size=4),
    st.lists(ENTRY, min_size=1, max_size=6, unique_by=lambda entry: entry[:2]),
    st.floats(0, 1),
)
@settings(max_examples=8, deadline=None)
def test_no_pathway_is_missing_from_any_picture(
    counts: list[int], entries: list[tuple[str, str, str, str]], room: float
) -> None:
    network = network_of(counts, entries)
    ends, group = network.network.connections, [g.name for g in network.network.neurons.groups for _ in g.indices]
    of = zip(ends.sources.tolist(), ends.targets.tolist(), strict=True)
    there = Counter(f"{group[source]} -> {group[target]}" for source, target in of)
    names = network.network.neurons.names
    places = {name: (float(number % 6), float(number // 6)) for number, name in enumerate(names)}
    settings_ = replace(network.network.render, most=int(room * len(ends)), labels=False)
    scene = scene_of(network, network.run(1).snapshot(0), Layout("x", "manual", places, {}), settings_)
    found = Counter({name: int(bundle.data["count"]) for name, bundle in bundles_of(scene).items()})
    for one in scene.groups:
        if "connection" in one.data:
            found[" -> ".join(group[names.index(one.data[end])] for end in ("from", "to"))] += 1
    assert found == there


def test_single_neurons_are_their_own_hubs_and_glyphs_say_what_they_hold() -> None:
    network = nv.compile_text(LAYERS + "render: {collapse: [B]}\n")
    scene = drawn(network, most=0)
    bundles = bundles_of(scene)
    assert {name: int(one.data["count"]) for name, one in bundles.items()} == {"A -> B": 48, "B -> A": 32}
    (disc,) = [s for g in scene.groups if g.data.get("neuron") == "B" for s in g.shapes if isinstance(s, Disc)]
    heads = [shape.tip for shape in bundles["A -> B"].shapes if isinstance(shape, Arrowhead)]
    assert all(math.dist(tip, disc.centre) < disc.radius + 12 for tip in heads)


def test_what_is_left_out_between_two_neurons_is_a_thin_line_beneath_the_others() -> None:
    names = "ABCDEFG"
    lines = ", ".join(f"{a} -> {b}: {-1 if b == 'G' else 1}" for a in names for b in names if a != b)
    network = nv.compile_text(
        f"neurovis: 1\nname: x\nneurons: {{{', '.join(f'{name}: {{}}' for name in names)}}}\n"
        f"connections: {{{lines}}}\nlayout: {{engine: circular}}\n"
    )
    scene = drawn(network)
    bundles, ids = bundles_of(scene), [group.id for group in scene.groups]
    assert len(bundles) == 42 - 20
    first = min(place for place, id_ in enumerate(ids) if re.fullmatch(r"c\d+", id_))
    for name, bundle in bundles.items():
        assert ids.index(bundle.id) < first
        (band,) = [shape for shape in bundle.shapes if isinstance(shape, Spline)]
        assert band.width < 1
        assert ("inhibit" in bundle.data) == name.endswith("G")
    words = [shape.text for group in scene.groups for shape in group.shapes if isinstance(shape, Text)]
    assert "left out" in words
    assert not any("added up" in word for word in words)


def test_both_of_a_symmetric_pair_are_counted_and_neither_way_is_missing() -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {A: {count: 3}, B: {count: 4}}\nlayout: {engine: grid}\n"
        "connections: {A -> B: {pattern: all_to_all, weight: 1, symmetric: true}}\n"
    )
    bundles = bundles_of(drawn(network, most=2))
    assert {name: int(one.data["count"]) for name, one in bundles.items()} == {"A -> B": 10, "B -> A": 10}


def test_what_neither_excites_nor_inhibits_is_said_in_words() -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {A: {count: 3, bias: 1}, B: {count: 4}}\nlayout: {engine: grid}\n"
        "synapses: {gap: {signal: weight*(pre - post), sign: 0}}\n"
        "connections: {A -> B: {pattern: all_to_all, weight: 1, delay: 1, synapse: gap}}\n"
    )
    scene = drawn(network, most=2)
    (bundle,) = bundles_of(scene).values()
    assert bundle.title.startswith("A → B · 10\n10 neither excite nor inhibit: Σ w = 10")
    assert float(bundle.data["neither"]) == 10
    assert "neither excite nor inhibit" in [shape.text for shape in scene.shapes() if isinstance(shape, Text)]


def test_what_is_lesioned_is_faint_and_said() -> None:
    text = (
        "neurovis: 1\nname: x\nneurons: {A: {count: 5, bias: 1}, B: {count: 5}}\nlayout: {engine: grid}\n"
        "connections: {A -> B: {pattern: all_to_all, weight: 1}}\nevents: [{at: 2, lesion: [GONE]}]\n"
    )
    whole, some = (nv.compile_text(text.replace("GONE", gone)) for gone in ("A", "A1"))
    for network, step, lost in ((whole, 1, 0), (whole, 2, 20), (some, 2, 5)):
        (bundle,) = bundles_of(drawn(network, step, most=5)).values()
        assert bundle.opacity == (0.3 if lost == 20 else 1)
        assert ("of them lesioned" in bundle.title) == bool(lost)
        assert int(bundle.data.get("lesioned", 0)) <= lost
    svg = file_of(drawn(whole, 2, most=5), ".svg").decode()
    assert re.search('<g class="bundle"[^>]* opacity="\\.3">', svg)


def test_all_kinds_of_files_show_them(layers: CompiledNetwork) -> None:
    recording = layers.run(3)
    scene = drawn(layers)
    svg = file_of(scene, ".svg").decode()
    assert len(re.findall('<g class="bundle" data-pathway="[AB] -&gt; [AB]" data-count="[0-9]+" data-sum=', svg)) == 3
    film = film_of(layers, [recording.snapshot(step) for step in range(3)])
    moving = renderer_for(".svg", moving=True).animate(film, ".svg").decode()
    (first, *_) = re.findall(r'<g class="bundle".*?</g>', moving, re.DOTALL)
    assert first.count("<path") == first.count('class="fixed"') - first.count("<polygon") > 0
    assert 'class="bundle' not in file_of(drawn(layers, full=True), ".svg").decode()
    png = Image.open(io.BytesIO(file_of(scene, ".png"))).convert("RGB")
    band = next(shape for shape in bundles_of(scene)["A -> B"].shapes if isinstance(shape, Spline))
    assert png.getcolors(1 << 24) is not None
    assert channels(band.stroke) in {colour for _, colour in png.getcolors(1 << 24) or ()}


def test_the_live_page_gets_them(layers: CompiledNetwork) -> None:
    content = json.loads(gzip.decompress(view_of(layers, layers.gains).content))
    found = [group for group in content["groups"] if "pathway" in group["data"]]
    assert sorted(group["id"] for group in found) == ["bundle:A -> B", "bundle:B -> A", "bundle:B -> B"]
    assert all(group["title"].split("\n")[0].endswith(f" · {int(group['data']['count']):,}") for group in found)


#: Two layers of neurons that stay where they are, so that each step adds as much to weights as any other.
GROWING = """
neurovis: 1
name: growing
time: {steps: 21}
neurons: {A: {count: 6, bias: 3, activation: tanh}, B: {count: 8, bias: 3, activation: tanh}}
connections:
  A -> B: {pattern: all_to_all, weight: WEIGHT, delay: 2, plasticity: {hebbian: {rate: RATE}}}
layout: {engine: grid}
render: {theme: THEME}
"""


def growing(weight: float, rate: float, theme: str = "default") -> tuple[Film, list[float]]:
    """A film of every fifth step, and the sum of what is left out at each."""
    text = GROWING.replace("WEIGHT", str(weight)).replace("RATE", str(rate)).replace("THEME", theme)
    network = nv.compile_text(text)
    steps, recording = range(0, 21, 5), network.run(21)
    made = film_of(network, [recording.snapshot(step) for step in steps])
    (bundle,) = bundles_of(made.scene).values()
    drawn = [int(group.id[1:]) for group in made.scene.groups if re.fullmatch(r"c\d+", group.id)]
    assert int(bundle.data["count"]) == 48 - len(drawn)
    left = [np.delete(recording.snapshot(step).weights, drawn).sum() for step in steps]
    return made, [abs(float(total)) for total in left]


def band_of(scene: Scene) -> tuple[Spline, Arrowhead]:
    (bundle,) = bundles_of(scene).values()
    line, head = bundle.shapes
    assert isinstance(line, Spline)
    assert isinstance(head, Arrowhead)
    return line, head


@pytest.mark.parametrize(
    ("weight", "rate", "theme"), [(0.25, 0.02, "default"), (-0.8, 0.06, "dark")], ids=["arrow", "bar"]
)
def test_in_a_film_a_bundle_is_as_wide_as_its_sum_is_by_then(weight: float, rate: float, theme: str) -> None:
    """As the root of it; its colour stays, and its head goes with it."""
    made, sums = growing(weight, rate, theme)
    bands = [band_of(still(made, frame)) for frame in range(made.frames)]
    assert bands[0] == band_of(made.scene)
    first, last = bands[0][0].width, bands[-1][0].width
    assert abs(last - first) > 0.25 * first
    for (line, head), total in zip(bands, sums, strict=True):
        assert line.width == pytest.approx(first * math.sqrt(total / sums[0]), rel=1e-6)
        assert (line.stroke, head.kind) == (bands[0][0].stroke, bands[0][1].kind)
        assert head.half_width > line.width / 2
    ink = np.array(channels(bands[0][0].stroke))
    for frame, picture in enumerate(frames(made)):
        pictures = picture, paint(still(made, frame))
        seen, whole = (int((np.abs(pixels - ink) <= 2).all(axis=2).sum()) for pixels in pictures)
        assert seen == pytest.approx(whole, rel=0.01)


def test_an_animated_svg_has_the_widths_of_its_bundles() -> None:
    made, _ = growing(0.25, 0.02)
    svg = AnimatedSvgRenderer().animate(made, ".svg").decode()
    (said,) = re.findall(r'<g class="band (w\d+)">.*?values="([^"]*)"', svg)
    widths = {name: float(width) for name, width in re.findall(r"\.(w\d+)\{--w:([\d.]+)\}", svg)}
    tokens = [token.removeprefix("band ") for token in said[1].split(";")]
    assert tokens[0] == said[0]
    assert [widths[token] for token in tokens] == pytest.approx(made.band_widths[:, 0].tolist(), abs=0.04)


def test_a_bundle_grows_to_twice_the_widest_and_not_on() -> None:
    made, sums = growing(0.02, 0.5)
    assert sums[-1] > 100 * sums[0]
    assert made.band_widths.max() == pytest.approx(2 * made.band_widths[0, 0])


def test_bundles_of_what_does_not_learn_stay_as_they_are(layers: CompiledNetwork) -> None:
    recording = layers.run(3)
    made = film_of(layers, [recording.snapshot(step) for step in range(3)])
    assert {name for name, _ in made.bands} <= {"bundle:B -> A"}
    still_ = film_of(layers, [recording.snapshot(0)])
    assert still_.bands == ()
