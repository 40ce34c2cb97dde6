"""Neurons in space: positions of three numbers, drawn or read, the distances between them, and how they are seen."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_specs import compiled, network_of

from neurovis_spec.language.words import VIEWPOINTS, Viewpoint
from neurovis_spec.projection import projected

HELIX = "position: [cos(i), sin(i), i/4]"
SVG = "{http://www.w3.org/2000/svg}"


def places(count: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    i = np.arange(count)
    return np.column_stack((np.cos(i), np.sin(i), i / 4))


def test_positions_have_three_numbers_and_those_of_two_are_at_height_0() -> None:
    network = network_of(f"neurons: {{A: {{count: 5, {HELIX}}}, B: {{position: [1, 2]}}, C: {{}}}}\n")
    np.testing.assert_allclose(network.neurons.position[:5], places(5), rtol=1e-15)
    assert network.neurons.position[5].tolist() == [1, 2, 0]
    assert np.isnan(network.neurons.position[6]).all()
    assert network_of("neurons: {B: {position: [1, 2]}}\n").neurons.position.shape == (1, 2)


def test_distances_are_in_space() -> None:
    text = (
        f"neurons: {{A: {{count: 5, {HELIX}}}}}\nconnections: {{A -> A: {{weight: distance, pattern: all_to_all}}}}\n"
    )
    network = network_of(text)
    at, lines = places(5), network.connections
    apart = np.linalg.norm(at[lines.sources.whole()] - at[lines.targets.whole()], axis=1)
    np.testing.assert_allclose(lines.weights.whole(), apart, rtol=1e-15)


def test_the_nearest_are_nearest_in_space() -> None:
    """In the plane the neuron above is the nearest."""
    text = "neurons: {A: {position: [0, 0, 0]}, B: {count: 3, position: [[0, 0, 5], [1, 0, 0], [2, 0, 0]]}}\n"
    network = network_of(f"{text}connections: {{A -> B: {{pattern: {{nearest: {{count: 1}}}}}}}}\n")
    assert network.connection_names == ("A -> B2",)


def test_weights_follow_distances_that_follow_parameters() -> None:
    text = (
        "parameters: {h: 3}\n"
        "neurons: {A: {position: [0, 0, h], bias: 1}, B: {position: [4, 0, 0]}, F: {position: [1, 1]}}\n"
        "connections: {A -> B: {weight: distance}}\nevents: [{at: 2, set: {h: 0}}]\n"
    )
    for backend in ("reference", "numpy"):
        assert compiled(text).run(4, backend=backend).weight("A -> B").tolist() == [5, 5, 4, 4]


@pytest.mark.compiler
def test_exported_weights_follow_distances_in_space(tmp_path: Path) -> None:
    from test_export_c import runs_alike

    text = (
        "parameters: {h: 3}\nneurons: {A: {count: 2, position: [i, 0, h*i], bias: 1}, B: {position: [4, 0.5, 0.1]}}\n"
        "connections: {A -> B: {weight: distance}}\nevents: [{at: 2, set: {h: 0.3}}]\n"
    )
    runs_alike(compiled(text), tmp_path, steps=5)


def test_positions_are_drawn_by_the_names_of_groups() -> None:
    drawn = 'position: ["uniform(0, 1)", "normal(0, 2)", "uniform(0, 1)"]'
    one = network_of(f"seed: 3\nneurons: {{A: {{count: 40, {drawn}}}, B: {{count: 2, {drawn}}}}}\n").neurons.position
    other = network_of(f"seed: 3\nneurons: {{B: {{count: 2, {drawn}}}, A: {{count: 40, {drawn}}}}}\n").neurons.position
    np.testing.assert_array_equal(one[:40], other[2:])
    np.testing.assert_array_equal(one[40:], other[:2])
    assert len(np.unique(one)) == one.size
    assert 0 <= one[:, 0].min() <= one[:, 0].max() < 1
    assert one[:, 1].min() < 0
    again = network_of(f"seed: 4\nneurons: {{A: {{count: 40, {drawn}}}}}\n").neurons.position
    assert not (again == one[:40]).any()


def test_positions_are_read_from_files(tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_text("1,2,3\n4,5,6\n")
    (tmp_path / "cells.csv").write_text("name,x,y,z\nA2,4,5,6\nA1,1,2,3\n")
    for position in ("{file: rows.csv}", "{file: cells.csv, columns: [x, y, z], by: name}"):
        found = network_of(f"neurons: {{A: {{count: 2, position: {position}}}}}\n", tmp_path).neurons.position
        assert found.tolist() == [[1, 2, 3], [4, 5, 6]]


@given(st.floats(-720, 720), st.floats(-90, 90), st.lists(st.floats(-9, 9), min_size=6, max_size=6))
def test_a_view_turns_and_keeps_lengths(azimuth: float, elevation: float, numbers: list[float]) -> None:
    points = np.array(numbers).reshape(2, 3)
    page, near = projected(points, Viewpoint(azimuth, elevation))
    seen = np.column_stack((page, near))
    assert math.dist(*seen.tolist()) == pytest.approx(math.dist(*points.tolist()), abs=1e-12)


def test_the_named_views_are_exact() -> None:
    point = np.array([[0.1, 0.2, 0.3]])
    seen = {name: np.column_stack(tuple(projected(point, view)))[0].tolist() for name, view in VIEWPOINTS.items()}
    # x to the right and y down from above; from in front and from the side z goes up
    assert seen == {"top": [0.1, 0.2, 0.3], "front": [0.1, -0.3, 0.2], "side": [0.2, -0.3, -0.1]}


def discs(svg: Path) -> dict[str, tuple[float, float, float]]:
    """By neuron, in the order of the picture: where its disc is, and its radius."""
    root = ElementTree.fromstring(svg.read_text())
    found = {}
    for group in root.iter(f"{SVG}g"):
        circle = group.find(f"{SVG}circle")
        if group.get("data-neuron") is not None and circle is not None:
            x, y, r = (float(circle.get(name, "nan")) for name in ("cx", "cy", "r"))
            found[group.get("data-neuron", "")] = (x, y, r)
    return found


@pytest.mark.parametrize("view", [*VIEWPOINTS, "[30, 20]"])
def test_a_picture_shows_what_is_near_larger_and_last(view: str, tmp_path: Path) -> None:
    text = f"neurons: {{A: {{count: 7, {HELIX}, bias: 1}}}}\nconnections: {{A -> A: {{pattern: ring, weight: 0.1}}}}\n"
    network = compiled(f"{text}layout: {{engine: spatial, view: {view}}}\n")
    network.render(tmp_path / "x.svg", step=1)
    found = discs(tmp_path / "x.svg")
    page, near = projected(network.network.neurons.position, network.network.layout.view)
    order = np.argsort(near, kind="stable")
    assert list(found) == [f"A{i + 1}" for i in order]
    radii = np.array([found[f"A{i + 1}"][2] for i in order])
    assert (np.diff(radii) > 0).all()
    assert radii[0] / radii[-1] == pytest.approx(0.55, rel=0.01)
    drawn = np.array([found[f"A{i + 1}"][:2] for i in range(7)])
    for axis in (0, 1):  # one factor for both
        assert np.corrcoef(drawn[:, axis], page[:, axis])[0, 1] > 0.99
    assert "nearer is larger" in (tmp_path / "x.svg").read_text()


def test_a_view_of_a_plane_is_told() -> None:
    found = compiled("neurons: {A: {position: [1, 2]}}\nlayout: {view: side}\n").warnings
    assert [(one.code, one.hint) for one in found if one.code == "no-effect"] == [
        ("no-effect", "give position: [x, y, z]")
    ]


def test_neurons_behind_each_other_stand_aside_and_stay_large(tmp_path: Path) -> None:
    """cos(i·π/3) is the same for two of six but for its last bits."""
    text = "neurons: {A: {count: 12, position: [cos(pi*i/3), sin(pi*i/3), floor(i/6)], bias: 1}}\n"
    compiled(f"{text}layout: {{engine: spatial, view: front}}\n").render(tmp_path / "x.svg", step=1)
    found = np.array([*discs(tmp_path / "x.svg").values()])
    apart = np.hypot(*(found[:, None, :2] - found[None, :, :2]).transpose(2, 0, 1))
    room = found[:, None, 2] + found[None, :, 2]
    assert found[:, 2].min() > 5
    assert (apart + 1e9 * np.eye(12) > room).all()
