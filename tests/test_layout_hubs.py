"""Hubs: the one neuron that a ring drives, and that drives it, stands in its middle, as in pictures of attractors."""

from __future__ import annotations

from math import dist

import pytest

import neurovis_spec as nv
from neurovis_spec.compiled import NetworkLayout

RING = """
  R: {count: COUNT, activation: tanh}
  H: {activation: tanh}
  I: {bias: 1}
connections:
  R -> R: {weight: 0.5, pattern: ring}
  R -> H: {weight: 1, pattern: all_to_all}
  H -> R: {weight: -1, pattern: all_to_all}
  I -> R1: 1
"""
WHOLE = f"neurovis: 1\nname: x\nneurons:{RING}"


def laid_out(text: str) -> NetworkLayout:
    return nv.compile_text(text).layout("layered")


def off_the_middle(layout: NetworkLayout, ring: str, hub: str, count: int) -> float:
    """How far the hub stands from the middle of the ring, by the ring's radius."""
    places = [layout.positions[f"{ring}{number + 1}"] for number in range(count)]
    middle = sum(x for x, _ in places) / count, sum(y for _, y in places) / count
    return dist(middle, layout.positions[hub]) / dist(middle, places[0])


@pytest.mark.parametrize("count", [5, 6, 8, 13])
@pytest.mark.parametrize("direction", ["down", "right"])
def test_the_hub_of_a_ring_stands_in_its_middle(count: int, direction: str) -> None:
    text = WHOLE.replace("COUNT", str(count)) + f"layout: {{direction: {direction}, arrange: {{R: ring}}}}\n"
    layout = laid_out(text)
    assert off_the_middle(layout, "R", "H", count) < 0.01
    found = layout.metrics()
    assert (found["overlaps"], found["edges_over_neurons"]) == (0, 0)
    assert found["crossings"] == 0, "spokes cross nothing"


def test_a_ring_that_nobody_asked_for_has_its_hub_too() -> None:
    assert off_the_middle(laid_out(WHOLE.replace("COUNT", "8")), "R", "H", 8) < 0.01


@pytest.mark.parametrize(
    "more",
    [
        "layout: {boxes: {ring: [R]}}\n",
        "layout: {boxes: {hub: [H, I]}}\n",
        "layout: {align: [[H, I]]}\n",
        "layout: {positions: {H: [9, 0]}}\n",
    ],
)
def test_what_the_author_says_of_the_hub_goes_before(more: str) -> None:
    layout = laid_out(WHOLE.replace("COUNT", "8") + more)
    assert off_the_middle(layout, "R", "H", 8) > 0.5
    if "positions" in more:
        assert layout.positions["H"] == (9, 0)


def test_of_two_that_could_be_the_hub_none_is() -> None:
    text = WHOLE.replace("COUNT", "8").replace("  I:", "  G: {}\n  I:") + "  R + H -> G: 1\n  G -> R + H: 1\n"
    layout = laid_out(text)
    assert min(off_the_middle(layout, "R", hub, 8) for hub in "HG") > 0.5


def test_a_hub_of_two_rings_stands_in_none() -> None:
    text = WHOLE.replace("COUNT", "8").replace("  I:", "  Q: {count: 8}\n  I:")
    text += "  Q -> Q: {weight: 0.5, pattern: ring}\n  Q -> H: 1\n  H -> Q: 1\n"
    layout = laid_out(text)
    assert min(off_the_middle(layout, ring, "H", 8) for ring in "RQ") > 0.5


def test_mirrored_rings_have_their_hubs_and_instances_are_drawn_alike() -> None:
    module = "    neurons:" + RING.replace("COUNT", "8").replace("\n", "\n    ").rstrip()
    text = (
        f"neurovis: 1\nname: x\nmodules:\n  m:\n{module}\ninstances: {{left: {{module: m}}, right: {{module: m}}}}\n"
        "neurons: {O: {}}\nconnections: {left.R -> O: 1, right.R -> O: 1}\nlayout: {mirror: [[left, right]]}\n"
    )
    layout = laid_out(text)
    for instance in ("left", "right"):
        assert off_the_middle(layout, f"{instance}.R", f"{instance}.H", 8) < 0.01
    assert layout.metrics()["symmetry"] == 1


def test_mirrored_rings_without_instances_have_their_hubs() -> None:
    text = WHOLE.replace("COUNT", "6").replace("  I:", "  Q: {count: 6, activation: tanh}\n  J: {}\n  I:")
    text += "  Q -> Q: {weight: 0.5, pattern: ring}\n  Q -> J: 1\n  J -> Q: 1\n  I -> Q1: 1\n"
    layout = laid_out(text + "layout: {mirror: [[R, Q], [H, J]]}\n")
    assert off_the_middle(layout, "R", "H", 6) < 0.01
    assert off_the_middle(layout, "Q", "J", 6) < 0.01
    assert layout.metrics()["symmetry"] == 1
    # a hub with an image is in no ring that has none
    assert laid_out(text + "layout: {mirror: [[H, J]]}\n").metrics()["symmetry"] == 1
