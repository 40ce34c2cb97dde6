"""Scales that never mislead: weights that are far apart are compressed, what is one-sided uses its whole colour, and
where everything learns the largest changes glow. What needs none of this stays exact."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.live.commands import AS_IT_IS, Appearance
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.view import FINENESS, LEVELS, view_of
from neurovis_spec.scene import Ramp, Spline, Text
from neurovis_spec.scene.encode import looks
from neurovis_spec.scene.encoding import THINNEST
from neurovis_spec.scene.film import scene_of_step
from neurovis_spec.scene.gains import choose_gains
from neurovis_spec.scene.legend_scales import colour, glow, thickness
from neurovis_spec.scene.model import Shape
from neurovis_spec.scene.reached import Reached, reached
from neurovis_spec.scene.texts import number
from neurovis_spec.scene.themes import THEMES

#: a hundred connections, most of them of weight 1, a few of 40
TAIL = """neurovis: 1
name: tail
time: {steps: 4}
neurons:
  A: {count: 10, bias: "uniform(0.2, 1)", activation: tanh}
  B: {count: 10, activation: tanh}
connections:
  A -> B: {weight: "40 if i == j and i < 4 else 1 + 0.01*i - 3*(j == 9)", pattern: all_to_all}
"""


def tail(more: str = "") -> CompiledNetwork:
    return nv.compile_text(TAIL + more)


def random(count: int, more: str = "") -> CompiledNetwork:
    """``count`` connections with weights of a normal distribution."""
    rows, columns = (20, count // 20)
    return nv.compile_text(
        f"neurovis: 1\nname: many\ntime: {{steps: 4}}\nneurons:\n  A: {{count: {rows}, bias: 0.5}}\n"
        f"  B: {{count: {columns}}}\nconnections:\n"
        f'  A -> B: {{weight: "normal(0, 1)", pattern: all_to_all}}\n{more}'
    )


def texts_of(shapes: tuple[Shape, ...]) -> list[str]:
    return [shape.text for shape in shapes if isinstance(shape, Text)]


def test_an_entry_is_compressed_where_it_is_large_or_its_weights_are_far_apart_and_no_gain_is_given() -> None:
    for made, compressed in ((random(500), False), (random(520), True), (tail(), True)):
        gains = made.gains
        assert set(gains.thickness_compressed.tolist()) == set(gains.signal_compressed.tolist()) == {compressed}
        assert {scale.compressed for scale in (*gains.thickness_scales, *gains.signal_scales)} == {compressed}
    given = tail("render: {gain: {thickness: 0.1}}\n").gains
    assert not given.thickness_compressed.any()
    assert given.signal_compressed.all()
    given = tail("render: {gain: {signal: {A1 -> B: 2}}}\n").gains
    assert given.thickness_compressed.all()
    assert given.signal_compressed.tolist() == [False] * 10 + [True] * 90
    assert [scale.compressed for scale in given.signal_scales] == [True, False]


def test_of_many_weights_that_are_all_alike_nothing_is_compressed() -> None:
    text = "neurovis: 1\nname: x\nneurons: {A: {count: 30}}\nconnections: {A -> A: {weight: 2, pattern: all_to_all}}\n"
    assert not nv.compile_text(text).gains.thickness_compressed.any()


@pytest.mark.parametrize("made", [tail(), random(520)], ids=["tail", "many"])
def test_widths_and_colours_are_of_the_square_root_and_few_are_at_their_ends(made: CompiledNetwork) -> None:
    gains, snapshot = made.gains, made.run().snapshot(3)
    seen, weights = looks(made.network, snapshot, gains, 1e9), snapshot.weights
    (scale,) = gains.thickness_scales
    assert seen.widths == pytest.approx(np.maximum(THINNEST, scale.gain * np.sqrt(np.abs(weights))))
    signals = snapshot.activity[made.network.connections.sources.whole()] * weights
    (scale,) = gains.signal_scales
    wanted = np.sign(signals) * np.minimum(1, scale.gain * np.sqrt(np.abs(signals)))
    assert seen.lines == pytest.approx(wanted)
    assert np.mean(np.abs(seen.lines) == 1) <= 0.05
    assert np.mean(seen.widths > THINNEST) >= 0.5
    assert seen.widths.max() >= 2


def test_the_legend_has_true_values_at_its_marks() -> None:
    gains, theme = tail().gains, THEMES["default"]
    (entry,) = thickness(gains, theme)
    assert "line: weight |w|, square root" in texts_of(entry.shapes)
    strokes = [shape.width for shape in entry.shapes if isinstance(shape, Spline)]
    weights = [float(word) for word in texts_of(entry.shapes) if word[0].isdigit()]
    assert len(weights) == 3
    alone = replace(gains, thickness=np.full(3, gains.thickness[0]), thickness_compressed=np.ones(3, bool))
    assert strokes == pytest.approx(np.maximum(THINNEST, alone.widths(np.array(weights))))
    *_, lines = colour(gains, "w·a", theme)
    (ramp,) = [shape for shape in lines.shapes if isinstance(shape, Ramp)]
    (scale,) = gains.signal_scales
    for shape in lines.shapes:
        if isinstance(shape, Text) and shape.text.startswith(("+", "−")):
            value = float(shape.text.replace("−", "-"))
            place = 2 * (shape.point[0] - ramp.corner[0]) / ramp.width - 1
            assert np.sign(value) * scale.gain * scale.shown(abs(value)) == pytest.approx(place, abs=0.02)


def test_tooltips_have_the_exact_weight_and_say_what_is_compressed(tmp_path: Path) -> None:
    made = tail()
    made.render(tmp_path / "x.svg")
    text = (tmp_path / "x.svg").read_text(encoding="utf-8")
    (told,) = re.findall(r'data-connection="A2 -&gt; B2"[^>]*><title>([^<]*)<', text)
    assert "weight 40\n" in told
    assert re.search(r"signal \S+ of the square root, thickness \S+ of the square root", told)


def test_the_matrix_has_the_same_scale_and_says_so(tmp_path: Path) -> None:
    tail().render(tmp_path / "x.svg", view="matrix")
    assert ">weight, square root<" in (tmp_path / "x.svg").read_text(encoding="utf-8")
    tail("render: {gain: {thickness: 0.1}}\n").render(tmp_path / "y.svg", view="matrix")
    assert ">weight<" in (tmp_path / "y.svg").read_text(encoding="utf-8")


def test_what_is_added_up_is_compressed_as_other_lines_are() -> None:
    """Pathways between collapsed groups whose sums are far apart."""
    counts = {"A": 2, "B": 2, "C": 2, "D": 30, "E": 30}
    groups = "".join(f"  {name}: {{count: {count}, bias: 0.2}}\n" for name, count in counts.items())
    pairs = ((a, b, 9 if a + b == "DE" else 0.1) for a in counts for b in counts if a != b)
    entries = "".join(f"  {a} -> {b}: {{weight: {weight}, pattern: all_to_all}}\n" for a, b, weight in pairs)
    made = nv.compile_text(
        f"neurovis: 1\nname: x\ntime: {{steps: 3}}\nneurons:\n{groups}connections:\n{entries}"
        "render: {collapse: [A, B, C, D, E]}\n"
    )
    (scale,) = made.gains.thickness_scales
    assert scale.compressed
    drawn = scene_of_step(made.network, made.placed(), made.run().snapshot(2), made.gains, made.network.render)
    (tip,) = [group.title for group in drawn.groups if group.data.get("connection") == "D -> E"]
    assert "weight 8100\n" in tip


def test_the_live_page_shows_what_pictures_show_with_all_scales_and_gains_turned_up() -> None:
    for text in (TAIL, LEARNS):
        made = nv.compile_text(text)
        source = SimulatedSource(made.simulator())
        recording = made.run(steps=4)
        for appearance in (AS_IT_IS, Appearance(signal=2.0, thickness=0.5, change=3.0)):
            view = view_of(made, made.gains, appearance=appearance)
            assert view.largest.max() > 1
        for step in range(4):
            seen = source.seen()
            assert seen.snapshot.step == step
            look = view.glance(seen)
            wanted = looks(made.network, recording.snapshot(step), view.gains, view.plan.frame.widest)
            assert np.abs(look.lines / LEVELS - wanted.lines).max() <= 0.5 / LEVELS
            assert np.abs(look.widths / FINENESS - wanted.widths).max() <= 0.5 / FINENESS
            assert np.abs(look.glows / FINENESS - wanted.glows).max() <= 0.5 / FINENESS
            source.advance()


#: activations, and whether they are one-sided
SIDED = {"relu": True, "sigmoid": True, "tanh": False, "identity": False}


@settings(max_examples=12, deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from(sorted(SIDED)), st.floats(-3, 1)), min_size=1, max_size=6),
)
def test_one_sided_groups_span_all_that_they_reach_and_change_nothing_of_others(made: list[tuple[str, float]]) -> None:
    """Groups of any size that sway around 0 before their activation."""
    of = "neurovis: 1\nname: x\ntime: {steps: 40}\ninputs: {x: {expression: sin(0.3*k)}}\nneurons:\n"
    groups = [
        f"  {'RN'[not SIDED[kind]]}{number}: {{count: 3, input: x, activation: {kind}}}\n"
        for number, (kind, _) in enumerate(made)
    ]
    sizes = np.repeat([10.0**size for _, size in made], 3)
    network = nv.compile_text(of + "".join(groups))
    recording = network.run()
    run = reached(network.network, replace(recording, activity=recording.activity * sizes))
    gains = choose_gains(network.network, network.network.render, run)
    other = choose_gains(network.network, network.network.render, replace(run, lowest=-run.highest))
    one_sided = np.repeat([SIDED[kind] for kind, _ in made], 3)
    assert (gains.activity[~one_sided] == other.activity[~one_sided]).all()
    full = gains.activity * run.activity
    if len(set(np.round(np.log10(run.activity[one_sided]), 1))) <= 4:
        assert ((full[one_sided] >= 0.75) & (full[one_sided] <= 1.06)).all()


def test_a_few_neurons_far_above_the_rest_of_a_large_group_saturate() -> None:
    peaks = np.array([1.0] * 991 + [50.0] * 9)
    text = "neurovis: 1\nname: x\nneurons: {R: {count: 1000, activation: relu}}\n"
    network, none = nv.compile_text(text).network, np.zeros(0)
    run = Reached(0 * peaks, peaks, peaks, none, none, none, np.zeros((0, 0)))
    assert set(choose_gains(network, network.render, run).activity.tolist()) == {1.0}


#: all of thirty connections change at nearly every step
LEARNS = """neurovis: 1
name: learns
time: {steps: 200}
inputs: {x: {expression: sin(0.3*k)}}
neurons:
  A: {count: 6, input: x, bias: "uniform(-1, 1)", activation: tanh}
  B: {count: 5, activation: tanh, bias: "uniform(-0.5, 0.5)"}
connections:
  A -> B: {weight: "normal(0, 0.4)", pattern: all_to_all, plasticity: {hebbian: {rate: 0.02}}}
"""


def test_where_everything_learns_at_every_step_the_largest_changes_glow_and_the_legend_says_which() -> None:
    made = nv.compile_text(LEARNS)
    recording, (scale,) = made.run(), made.gains.change_scales
    changes = np.abs(np.diff(recording.weights, axis=0))
    assert scale.least == pytest.approx(np.quantile(changes, 0.9), rel=0.02)
    glowing = [looks(made.network, recording.snapshot(k), made.gains, 1e9).glows > 0 for k in range(1, 200)]
    assert 0.05 <= np.mean(glowing) <= 0.12
    assert (np.array(glowing) == (changes >= scale.least)).all()
    (entry,) = glow(made.gains, THEMES["default"])
    assert f"only the largest, from {number(scale.least)}" in texts_of(entry.shapes)


def test_what_learns_now_and_then_glows_whenever_it_does() -> None:
    now_and_then = LEARNS.replace("sin(0.3*k)", "1 if k % 50 < 3 else 0").replace('bias: "uniform(-1, 1)"', "bias: 0")
    assert not nv.compile_text(now_and_then).gains.least_change.any()
    stated = nv.compile_text(LEARNS + "render: {gain: {change: 20}}\n").gains
    assert not stated.least_change.any()
    assert stated.change_scales[0].gain == 20
