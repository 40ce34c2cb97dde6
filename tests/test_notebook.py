"""In a notebook a network, a layout and a recording draw themselves, as well-formed SVG."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from xml.etree import ElementTree

import pytest

import neurovis_spec as nv

SPEC = Path(__file__).parent.parent / "specs" / "cpg_rbf.yaml"
DATA = "data-neuron"


@pytest.fixture(scope="module")
def network() -> nv.CompiledNetwork:
    return nv.compile(SPEC)


def elements(svg: str) -> list[ElementTree.Element]:
    return list(ElementTree.fromstring(svg).iter())


def test_a_network_and_a_layout_show_every_neuron(network: nv.CompiledNetwork) -> None:
    for svg in (network._repr_svg_(), network.layout()._repr_svg_()):
        assert [e.get(DATA) for e in elements(svg) if e.get(DATA)] == list(network.network.neurons.names)


def test_a_recording_shows_its_traces(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    recording = network.run(700)
    recording.save(tmp_path / "run.npz")
    svg = nv.load(tmp_path / "run.npz")._repr_svg_()
    assert svg == recording._repr_svg_()
    lines = [e for e in elements(svg) if e.tag.endswith("polyline")]
    assert len(lines) == 12 + 8
    heights = {round(float(point.split(",")[1])) for point in lines[0].get("points", "").split()}
    assert len(heights) > 10  # C1 swings


def test_names_are_escaped_and_empty_runs_are_drawn() -> None:
    network = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {label: '<script>'}}")
    assert "<script" not in network._repr_svg_()
    assert "no steps" in network.run(0)._repr_svg_()


@pytest.mark.parametrize("bias", ["5e-324", "1.7e308", "1e-310", "0"])
def test_traces_of_huge_and_tiny_values_stay_in_their_rows(bias: str) -> None:
    text = (
        f"neurovis: 1\nname: x\ninputs: {{s: {{expression: '{bias}*(1 - 2*(k % 2))'}}}}\nneurons: {{A: {{input: s}}}}"
    )
    recording = nv.compile_text(text).run(6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drawn = recording._repr_svg_()
    (points,) = re.findall(r'points="([^"]*)"', drawn)
    assert all(0 < float(pair.split(",")[1]) < 100 for pair in points.split())
