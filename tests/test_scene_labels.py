"""Long labels beside discs are shortened, so that every neuron has its own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec import pipeline
from neurovis_spec.scene import Disc, Text, beside
from neurovis_spec.scene.texts import shorten, width

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


@example("obstacle_avoidance_interneuron", 1.0, 15.0)
@given(st.text("il mW_…é", min_size=1, max_size=40), st.floats(0.5, 20), st.floats(0, 30))
def test_a_shortened_text_uses_all_of_its_room(text: str, size: float, sizes: float) -> None:
    """Whatever the unit is in which its letters are measured: names beside discs are, in sizes."""
    found = shorten(text, size, sizes * size)
    if found == text:
        assert width(text, size) <= sizes * size
        return
    assert width(text, size) > sizes * size
    assert width(found, size) <= sizes * size
    kept = len(found) - 1 if found else 0
    assert text.startswith(found[:kept])
    longer = [text[:end].rstrip() + "…" for end in range(kept + 1, len(text))]
    assert all(width(one, size) > sizes * size for one in longer if len(one) > kept + 1)


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
    assert {name: text.text + text.subscript for name, text in found.items()} == {name: name for name in found}
    assert found["right_wheel"].anchor == "start"
    assert {found[f"proximity{i}"].anchor for i in (1, 2, 3)} == {"end"}


def test_a_label_across_the_line_of_a_box_keeps_it_away() -> None:
    found = labels(
        "neurons: {a_neuron_with_a_long_name: {}, B: {box: b}, C: {box: c}}\nconnections: {B -> C: 1}\n"
        "layout: {engine: manual, positions: {a_neuron_with_a_long_name: [0, 0], B: [-1.4, 0], C: [1.4, 0]}}\n"
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


@pytest.mark.parametrize(("border", "right"), [([], True), ([[1.0, 0.0]], False)])
def test_a_label_lies_on_lines_rather_than_on_the_border_of_a_frame(border: list[list[float]], right: bool) -> None:
    around = [(x, y) for x, y in np.stack(np.meshgrid(*2 * [np.arange(-2, 2, 0.1)]), -1).reshape(-1, 2).tolist()]
    lines = np.array([(x, y) for x, y in around if x < 0.4 or abs(y) > 0.3])  # to the right there is none
    field = beside.Field(
        np.zeros((1, 2)), np.full(1, 0.35), lines, np.array(border).reshape(-1, 2), (-3, -3, 3, 3), 50.0, False,
        np.zeros((0, 4)),
    )  # fmt: skip
    found = beside.placed([beside.Wanted((0,), (4.0,))], field, lambda _: 10.0, 66.0)
    assert (found[0] == beside.Slot(1, 0)) is right


NAMED = """neurovis: 1
name: named
neurons: {C: {count: 2, bias: 1}, K: {count: 6}, O: {label: "the output"}}
connections:
  C -> C: {pattern: all_to_all, label: rotation, weight: 0.3}
  C -> K: {label: "sensory: tuning", weight: i - j, pattern: all_to_all}
  K -> O: {label: readout, description: learned later}
"""


def named(spec: str) -> tuple[dict[str, Text], list[str]]:
    """The labels of connections by entry, and all tooltips."""
    network = nv.compile_text(spec)
    snapshot, layout = network.run(3).snapshot(2), network.layout().value
    scene = pipeline.picture(network.network, layout, snapshot, network.gains, network.network.render)
    found = {g.id: s for g in scene.groups for s in g.shapes if isinstance(s, Text) and g.id.startswith("label:")}
    return found, [group.title for group in scene.groups]


def test_an_entry_has_its_label_once_on_one_of_its_lines() -> None:
    found, titles = named(NAMED)
    assert {name: text.text for name, text in found.items()} == {
        "label:C -> C": "rotation",
        "label:C -> K": "sensory: tuning",
        "label:K -> O": "readout",
    }
    assert len({text.point for text in found.values()}) == 3
    assert all(text.halo for text in found.values())
    readout = [title.splitlines() for title in titles if "readout" in title]
    assert [lines[0] for lines in readout] == [f"K{number} → O: readout" for number in range(1, 7)]
    assert all("learned later" in lines for lines in readout)


def test_labels_of_connections_are_no_content_and_can_be_left_out() -> None:
    without = NAMED.replace("label: readout, ", "")
    assert nv.compile_text(without).hash == nv.compile_text(NAMED).hash
    assert not named(NAMED + "render: {labels: false}\n")[0]
    gathered, titles = named(NAMED + "render: {collapse: [K]}\n")
    assert set(gathered) == {"label:C -> C"}
    assert not any("readout" in title for title in titles)


def test_a_label_of_a_connection_stands_on_no_disc_and_on_no_other() -> None:
    chain = "".join(f"  N{i} -> N{i + 1}: {{label: from the one to the next}}\n" for i in range(1, 9))
    found, _ = named(f"neurovis: 1\nname: n\nneurons: {{N: {{count: 9, bias: 1}}}}\nconnections:\n{chain}")
    boxes = [
        (text.point[0] - width(text.text, text.size) / 2, text.point[1] - text.size, text.point[0], text.point[1])
        for text in found.values()
    ]
    assert all(a[3] <= b[1] or b[3] <= a[1] or a[0] >= b[2] or b[0] >= a[2] for a in boxes for b in boxes if a != b)


def test_a_name_that_is_too_long_for_its_disc_stands_beside_it_at_every_size() -> None:
    for side in range(200, 700, 20):
        found = labels(
            "neurons: {A: {}, sensor: {}, B: {}}\nconnections: {A -> sensor: 1, B -> sensor: 1}\n"
            f"layout: {{engine: manual, positions: {{A: [0, 0], B: [6, 0], sensor: [3, 3]}}}}\n"
            f"render: {{size: [{side}, {side}], legend: false}}\n"
        )
        assert found["sensor"].text == "sensor"


def texts_outside(spec: str) -> tuple[list[str], list[str]]:
    """The texts of a picture, and those of them that leave it to the left or to the right."""
    network = nv.compile_text("neurovis: 1\nname: labels\n" + spec)
    snapshot, layout = network.run(3).snapshot(2), network.layout().value
    scene = pipeline.picture(network.network, layout, snapshot, network.gains, network.network.render)
    texts = [shape for shape in scene.shapes() if isinstance(shape, Text)]
    found = []
    for text in texts:
        wide = width(text.text, text.size, text.weight, text.subscript)
        left = text.point[0] - {"start": 0.0, "middle": wide / 2, "end": wide}[text.anchor]
        if left < 0 or left + wide > scene.width:
            found.append(text.text)
    return [text.text + text.subscript for text in texts], found


def test_names_of_numbered_neurons_at_the_rim_stay_in_the_picture() -> None:
    name = "Along_name_of_group"
    texts, found = texts_outside(
        f"neurons: {{{name}: {{count: 8, bias: 1}}}}\n"
        f"connections: {{{name}1 -> {name}8: 1, {name}5 -> {name}6: 1, {name}3 -> {name}6: 1}}\n"
        f"layout: {{mirror: [[{name}1, {name}7]]}}\n"
    )
    assert {f"{name}1", f"{name}7"} <= set(texts)
    assert found == []


def test_the_label_of_a_connection_at_the_rim_stays_in_the_picture() -> None:
    texts, found = texts_outside(
        "neurons: {A: {bias: 1}, B: {}, C: {bias: 1}, D: {}}\n"
        "connections: {A -> B: {weight: 1, label: inhibitory interneuron of the leg}, C -> D: 1, A -> D: 1}\n"
        "render: {size: [200, 600]}\n"
    )
    assert any(text.startswith("inhibitory") for text in texts)
    assert found == []
