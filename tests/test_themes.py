"""Themes: ours can be told apart, a spec may have its own, and what is wrong with one is said."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import colour_vision
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_specs import compiled

import neurovis_spec as nv
from neurovis_spec import vision
from neurovis_spec.scene.themes import theme_of
from neurovis_spec.themes import COLOURS, THEMES

#: what cannot be told apart, for the contract gives the colours: the red and the green of the paper
ALIKE = {("paper", "deuteranopia", "negative", "positive")}
PAIR = "neurons: {A: {initial: 1}, B: {}}\nconnections: {A -> B: 1, B -> A: -1}\n"


@pytest.mark.parametrize("seen", colour_vision.VISIONS)
@pytest.mark.parametrize("name", THEMES)
def test_the_anchors_of_our_themes_can_be_told_apart(name: str, seen: str) -> None:
    anchors = THEMES[name].anchors
    assert list(anchors) == ["negative", "zero", "positive"]
    for one, other in combinations(anchors, 2):
        apart = colour_vision.difference(anchors[one], anchors[other], seen)
        assert (apart >= 20) == ((name, seen, one, other) not in ALIKE), (one, other, apart)


colours = st.integers(0, 0xFFFFFF).map("#{:06x}".format)


@settings(max_examples=300, deadline=None)
@given(colours, colours, st.sampled_from(list(zip(vision.VISIONS, colour_vision.VISIONS, strict=True))))
def test_the_difference_that_warns_is_that_of_the_tests(one: str, other: str, names: tuple[str, str]) -> None:
    ours, theirs = names
    expected = colour_vision.difference(one, other, theirs)
    assert vision.difference(one, other, ours) == pytest.approx(expected, abs=1e-9)
    assert vision.difference(other, one, ours) == pytest.approx(expected, abs=1e-9)


def test_a_name_is_a_theme_and_a_mapping_changes_one() -> None:
    assert theme_of(compiled(PAIR + "render: {theme: dark}").network.render) is THEMES["dark"]
    own = theme_of(compiled(PAIR + 'render: {theme: {base: dark, glow: "#FFFFFF", ends: arrows}}').network.render)
    assert (own.glow, own.ends) == ("#ffffff", "arrows")
    assert [getattr(own, name) for name in COLOURS if name != "glow"] == [
        getattr(THEMES["dark"], name) for name in COLOURS if name != "glow"
    ]
    assert theme_of(compiled(PAIR + 'render: {theme: {ink: "#000000"}}').network.render).zero == "#969696"
    assert theme_of(compiled(PAIR + "render: {theme: {}}").network.render) is THEMES["default"]


@pytest.mark.parametrize("name", COLOURS)
def test_every_colour_can_be_changed(name: str) -> None:
    own = theme_of(compiled(PAIR + f'render: {{theme: {{{name}: "#123456"}}}}').network.render)
    assert getattr(own, name) == "#123456"


def test_a_picture_has_the_colours_and_the_ends_of_its_theme(tmp_path: Path) -> None:
    network = compiled(
        PAIR + 'render: {gain: {activity: 1}, theme: {positive: "#00ff88", background: "#fafad2", ends: arrows}}'
    )
    network.render(tmp_path / "own.svg", step=0)
    drawn = (tmp_path / "own.svg").read_text(encoding="utf-8")
    assert 'fill="#00ff88"' in drawn
    assert 'fill="#fafad2"' in drawn
    assert 'class="bar"' not in drawn
    assert ">End<" not in drawn
    network.render(tmp_path / "paper.svg", step=0, theme="paper")  # a name goes before all of it
    drawn = (tmp_path / "paper.svg").read_text(encoding="utf-8")
    assert 'fill="#2ca02c"' in drawn
    assert "#fafad2" not in drawn
    assert 'class="bar"' in drawn


def test_a_theme_is_no_part_of_the_hash() -> None:
    assert compiled(PAIR).hash == compiled(PAIR + 'render: {theme: {zero: "#888888"}}').hash


@pytest.mark.parametrize(
    ("theme", "warned"),
    [
        ('{negative: "#d62728", positive: "#2ca02c"}', True),
        ('{base: paper, glow: "#ffee00"}', False),  # the anchors are not the author's
        ('{zero: "#d06010"}', True),
        ('{negative: "#aa0000", zero: "#dddddd", positive: "#0000aa"}', False),
    ],
)
def test_anchors_that_look_alike_are_warned_of(theme: str, warned: bool) -> None:
    found = nv.compile_text(f"neurovis: 1\nname: x\n{PAIR}render: {{theme: {theme}}}\n").warnings
    assert [warning.code for warning in found] == ["like-colours"] * warned
