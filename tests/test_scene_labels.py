"""Long labels beside discs are shortened, so that every neuron has its own."""

from __future__ import annotations

import math

import neurovis_spec as nv
from neurovis_spec import pipeline
from neurovis_spec.scene import Disc, Text
from neurovis_spec.scene.texts import width

LONG = "a very long label that goes on for forty"
SPEC = f"""
neurovis: 1
name: labels
neurons: {{A: {{count: 3, label: "{LONG}", bias: 1}}, B: {{count: 12}}}}
connections: {{A -> B: {{pattern: all_to_all}}}}
"""


def test_every_neuron_of_a_row_has_a_shortened_label() -> None:
    network = nv.compile_text(SPEC)
    snapshot = network.run(3).snapshot(2)
    layout = network.layout().value
    scene = pipeline.picture(network.network, layout, snapshot, network.gains, network.network.render)
    texts = {group.data.get("neuron"): [s.text for s in group.shapes if isinstance(s, Text)] for group in scene.groups}
    for name in ("A1", "A2", "A3"):
        (text,) = texts[name]
        assert text.endswith("…")
        assert LONG.startswith(text[:-1].rstrip())
        assert len(text) >= 8
    assert all(LONG in group.title for group in scene.groups if group.data.get("neuron") in ("A1", "A2", "A3"))


def labels(spec: str) -> dict[str, Text]:
    network = nv.compile_text("neurovis: 1\nname: labels\n" + spec)
    snapshot, layout = network.run(3).snapshot(2), network.layout().value
    scene = pipeline.picture(network.network, layout, snapshot, network.gains, network.network.render)
    return {g.data["neuron"]: s for g in scene.groups if "neuron" in g.data for s in g.shapes if isinstance(s, Text)}


def test_labels_on_discs_are_of_much_the_same_size() -> None:
    found = labels("neurons: {a: {}, hidden: {count: 3}, food: {}}\nconnections: {a -> hidden: 1, hidden -> food: 1}\n")
    assert set(found) == {"a", "hidden1", "hidden2", "hidden3", "food"}
    sizes = [text.size for text in found.values()]
    assert all(text.on_disc for text in found.values())
    assert max(sizes) <= 1.25 * min(sizes)


def test_where_signals_run_across_names_stand_at_the_ends() -> None:
    spec = "neurons: {right_wheel: {}, proximity: {count: 3}}\nconnections: {proximity -> right_wheel: 1}\n"
    found = labels(spec + "layout: {direction: right}\n")
    assert {name: text.text for name, text in found.items()} == {name: name for name in found}
    assert found["right_wheel"].anchor == "start"
    assert {found[f"proximity{i}"].anchor for i in (1, 2, 3)} == {"end"}


def test_a_label_across_the_line_of_a_box_keeps_it_away() -> None:
    found = labels(
        "neurons: {a_neuron_with_a_long_name: {box: b}, B: {}}\nconnections: {a_neuron_with_a_long_name -> B: 1}\n"
    )
    assert found["a_neuron_with_a_long_name"].text == "a_neuron_with_a_long_name"
    assert found["a_neuron_with_a_long_name"].halo
    assert not found["B"].halo


def test_a_label_on_a_disc_leaves_its_ring_free() -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {saliva: {}, right: {}, food: {}}\n"
        "connections: {food -> saliva: 1, right -> saliva: 1}\n"
    )
    scene = pipeline.picture(
        network.network, network.layout().value, network.run(3).snapshot(2), network.gains, network.network.render
    )
    for group in (group for group in scene.groups if "neuron" in group.data):
        (disc,) = (shape for shape in group.shapes if isinstance(shape, Disc))
        (text,) = (shape for shape in group.shapes if isinstance(shape, Text))
        assert text.on_disc
        corner = math.hypot(width(text.text, text.size, 600) / 2, 0.4 * text.size)
        assert corner <= disc.radius - disc.stroke_width / 2 + 0.1


def test_a_label_beside_a_disc_keeps_off_the_line_of_a_box_where_it_can() -> None:
    found = labels(
        "neurons: {a: {count: 6, box: b}, shoulder: {box: b}, c: {count: 3}}\n"
        "connections: {a -> shoulder: 1}\nrender: {size: [300, 300]}\nlayout: {arrange: {c: row}}\n"
    )
    assert found["shoulder"].text == "shoulder"
    assert not found["shoulder"].on_disc
    assert not found["shoulder"].halo
