"""Long labels beside discs are shortened, so that every neuron has its own."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scenes import scene_of

import neurovis_spec as nv
from neurovis_spec.layout.labels import WEIGHT, WIDEST
from neurovis_spec.scene import Disc, Text
from neurovis_spec.scene.beside import placed
from neurovis_spec.scene.labels import _among_own
from neurovis_spec.scene.spots import Field, Slot, Wanted
from neurovis_spec.scene.texts import shorten, width

LONG = "a very long label that goes on for forty"
SPEC = f"""
neurovis: 1
name: labels
neurons: {{A: {{count: 3, label: ["{LONG} a", "{LONG} b", "{LONG} c"], bias: 1}}, B: {{count: 12}}}}
connections: {{A -> B: {{pattern: all_to_all}}}}
"""


def test_every_neuron_of_a_row_has_a_label_shortened_where_there_is_no_room_for_all_of_it() -> None:
    network = nv.compile_text(SPEC)
    scene = scene_of(network, network.run(3).snapshot(2))
    texts = {group.data.get("neuron"): [s.text for s in group.shapes if isinstance(s, Text)] for group in scene.groups}
    for name, letter in (("A1", "a"), ("A2", "b"), ("A3", "c")):
        text = " ".join(texts[name])
        assert text == f"{LONG} {letter}" or (text.endswith("…") and LONG.startswith(text[:-1].rstrip()))
        assert len(text) >= 8
    assert all(LONG in group.title for group in scene.groups if group.data.get("neuron") in ("A1", "A2", "A3"))


def test_what_all_neurons_of_a_group_are_called_is_said_once() -> None:
    spec = SPEC.replace(f'["{LONG} a", "{LONG} b", "{LONG} c"]', f'"{LONG}"')
    network = nv.compile_text(spec)
    scene = scene_of(network, network.run(3).snapshot(2))
    said = {g.id: [s.text for s in g.shapes if isinstance(s, Text)] for g in scene.groups}
    assert " ".join(said["label:A"]) == LONG
    assert [said[f"n{index}"] for index in range(3)] == [[], [], []]
    rects = [s for g in scene.groups if g.id == "label:A" for s in g.shapes if isinstance(s, Text)]
    discs = [s for g in scene.groups if g.data.get("neuron", "")[:1] == "A" for s in g.shapes if isinstance(s, Disc)]
    ends = {"start": max(d.centre[0] for d in discs), "end": min(d.centre[0] for d in discs)}
    assert all(abs(one.point[0] - ends.get(one.anchor, one.point[0])) < 2 * discs[0].radius for one in rects)
    apart = nv.compile_text(spec + "layout: {positions: {A1: [0, 0], A2: [3, 0], A3: [6, 0], B1: [4.5, 0]}}\n")
    scene = scene_of(apart, apart.run(1).snapshot(0))
    assert "label:A" not in {group.id for group in scene.groups}


@pytest.mark.parametrize(
    ("label", "lines"),
    [
        ("a neuron of the cord that drives the muscles beside it", 2),
        ("a neuron of the ventral cord that drives all the muscles that are beside it", 3),
        ("descending_interneuron_of_the_anterior_ganglion_type_four", 3),
        ("of average length", 1),
    ],
)
def test_a_long_name_stands_in_lines_beside_its_disc_where_there_is_room(label: str, lines: int) -> None:
    names = [f"{letter}: {{label: '{letter} {label}'}}" for letter in "ABCD"]
    spec = (
        f"neurovis: 1\nname: long\nneurons: {{{', '.join(names)}}}\nconnections: {{A -> B: 1, B -> C: 1, C -> D: 1}}\n"
    )
    compiled = nv.compile_text(spec)
    scene = scene_of(compiled, compiled.run(1).snapshot(0))
    for group in scene.groups:
        if "neuron" in group.data:
            said = [shape for shape in group.shapes if isinstance(shape, Text)]
            assert len(said) == lines
            assert "".join(one.text for one in said).replace(" ", "") == f"{group.data['neuron']}{label}".replace(
                " ", ""
            )
            assert max(width(one.text, one.size, WEIGHT) for one in said) <= WIDEST * said[0].size
            assert {one.point[0] for one in said} == {said[0].point[0]}
            assert all(b.point[1] - a.point[1] > a.size for a, b in pairwise(said))


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
    scene = scene_of(network, network.run(3).snapshot(2))
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
    scene = scene_of(network, network.run(3).snapshot(2))
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
    field = Field(
        np.zeros((1, 2)), np.full(1, 0.35), lines, np.array(border).reshape(-1, 2), (-3, -3, 3, 3), 50.0, False,
        np.zeros((0, 4)),
    )  # fmt: skip
    found = placed([Wanted((0,), (((4.0, 1),),))], field, lambda _: 10.0, 66.0)
    assert (found[0] == (Slot(1, 0), 0)) is right


def field(places: list[tuple[float, float]], lines: list[tuple[float, float]] | None = None, far: float = 3) -> Field:
    """Discs of radius 0.3, sample points of lines; as wide and high as ``far`` around all of it."""
    at, none = np.array(places, float).reshape(-1, 2), np.zeros((0, 2))
    low, high = at.min(axis=0, initial=0) - far, at.max(axis=0, initial=0) + far
    around = (*low.tolist(), *high.tolist())
    dots = none if lines is None else np.array(lines, float).reshape(-1, 2)
    return Field(at, np.full(len(at), 0.3), dots, none, around, 0.0, False, np.zeros((0, 4)))


def sides_of(wanted: list[Wanted], ground: Field, scale: float = 66.0) -> dict[int, tuple[Slot, int]]:
    return placed(wanted, ground, lambda _: 10.0, scale)


BELOW, ABOVE, RIGHT, LEFT = Slot(0, 1), Slot(0, -1), Slot(1, 0), Slot(-1, 0)
#: Discs all round one at (0, 0), as near as labels, but for the side beneath.
WALL = [(0.0, -1.0), (1.0, -0.7), (-1.0, -0.7), (1.0, 0.3), (-1.0, 0.3), (1.0, -0.2), (-1.0, -0.2)]


def test_a_label_makes_way_for_one_that_has_no_room_elsewhere() -> None:
    ground = field([(0.0, 0.0), (0.0, 0.95), *WALL])
    (alone,) = {slot for slot, _ in sides_of([Wanted((0,), (((5.0, 1),),))], ground).values()}
    assert alone == BELOW
    # the other is more important, and would rather stand above
    up = Wanted((1,), (((5.0, 1),),), kept=(ABOVE,))
    assert sides_of([up], ground) == {1: (ABOVE, 0)}
    both = sides_of([up, Wanted((0,), (((5.0, 1),),))], ground)
    assert both[0] == (BELOW, 0)
    assert both[1][0] != ABOVE


def test_a_name_is_cut_before_it_is_left_out_and_said_in_full_where_there_is_room() -> None:
    narrow = field([(0.0, 0.0), (0.0, 1.0), *WALL])  # beneath there is room for half of it
    wordings = (((30.0, 1),), ((20.0, 1),), ((4.0, 1),))
    one = Wanted((0,), wordings, usual=1)
    assert sides_of([one], narrow) == {0: (BELOW, 2)}
    free = field([(0.0, 0.0)])
    assert sides_of([one], free) == {0: (BELOW, 0)}  # more than usual, as nothing is in the way
    beside = Wanted((1,), (((8.0, 1),),))
    (_, first), (_, second) = sides_of([one, beside], field([(0.0, 0.0), (2.4, 0.4)], far=2.0)).values()
    assert (first, second) == (1, 0)  # but not where that is another's room


def test_names_of_one_line_stand_on_one_side() -> None:
    column = [(0.0, 2.0 * row) for row in range(6)]
    lines = [(0.0, 2.0 * row + (0.45 if row % 2 else -0.45)) for row in range(6)]  # beneath some, above the others
    names = [Wanted((row,), (((3.0, 1),),)) for row in range(6)]
    assert {slot for slot, _ in sides_of(names, field(column, lines)).values()} == {BELOW, ABOVE}
    lined = [replace(one, line=0) for one in names]
    assert len({slot for slot, _ in sides_of(lined, field(column, lines)).values()}) == 1


def test_names_of_a_close_row_stand_on_one_side_and_the_other_by_turns() -> None:
    """Where each finds its own side first those that come last find none."""
    row = field([(0.55 * place, 0.0) for place in range(8)])
    names = [Wanted((place,), (((6.0, 1),),), line=0) for place in (0, 3, 6, 1, 4, 7, 2, 5)]
    found = sides_of(names, row)
    assert {found[place][0] for place in range(8)} == {BELOW, ABOVE}
    assert all(found[place][0] != found[place + 1][0] for place in range(7))


def test_no_name_is_nearer_to_another_disc_than_to_its_own_where_another_side_is_free() -> None:
    """Beneath a disc of a close column it could be the name of the next."""
    names = [Wanted((row,), (((3.0, 1),),)) for row in range(5)]
    close, wide = (field([(0.0, apart * row) for row in range(5)], far=2.0) for apart in (0.85, 2.0))
    assert all(slot.across for row, (slot, _) in sides_of(names, close).items() if 0 < row < 4)
    assert {slot for slot, _ in sides_of(names, wide).values()} == {BELOW}


@pytest.mark.parametrize("mixed", [True, False])
def test_a_number_stands_alone_only_among_its_own(mixed: bool) -> None:
    order = [(group, number) for number in range(1, 7) for group in ("Basketcell", "Stellatecell")]
    order = order if mixed else sorted(order)
    places = ", ".join(f"{group}{number}: [{0.61 * place:.2f}, 0]" for place, (group, number) in enumerate(order))
    found = labels(
        "neurons: {Basketcell: {count: 6, bias: 1}, Stellatecell: {count: 6}}\n"
        "connections: {Basketcell -> Stellatecell: {pattern: one_to_one}}\n"
        f"layout: {{positions: {{{places}}}}}\nrender: {{size: [380, 150], legend: false, title: false}}\n"
    )
    alone = [name for name, text in found.items() if text.text.isdecimal()]
    assert bool(alone) is not mixed
    assert "Basketcell1" not in alone  # at the end of the row there is room


@given(st.lists(st.tuples(*[st.integers(0, 9)] * 2, st.integers(0, 2)), max_size=12), st.sampled_from([1, 7]))
def test_who_stands_among_its_own_is_found_however_far_these_are(discs: list[tuple[int, int, int]], far: int) -> None:
    places, group = np.array([disc[:2] for disc in discs], float).reshape(-1, 2) * far, [own for *_, own in discs]

    def among_own(index: int) -> bool:
        others = [k for k in range(len(discs)) if k != index]
        near = sorted((math.dist(places[k], places[index]), group[k] != group[index]) for k in others)[:2]
        return len(near) == 2 and not any(foreign for _, foreign in near)

    every = np.arange(len(discs), dtype=np.int64)
    found = _among_own(places, np.array(group, dtype=np.int64), every)
    assert sorted(found.tolist()) == [index for index in every.tolist() if among_own(index)]


def test_names_that_find_no_room_in_a_reduced_picture_are_cut() -> None:
    """There is room in the layout, but letters get no smaller with it."""
    found = labels("""
neurons:
  canal: {names: [left_canal, right_canal], bias: 0.2}
  VN: {names: [left_vestibular, right_vestibular]}
  N: {count: 6, label: "NI L{i+1}"}
  M: {count: 6, label: "NI R{i+1}"}
  ABD: {names: [left_abducens, right_abducens]}
  OMN: {names: [left_oculomotor, right_oculomotor]}
  LR: {names: [left_lateral_rectus, right_lateral_rectus]}
  MR: {names: [left_medial_rectus, right_medial_rectus]}
connections:
  - {canal -> VN: {pattern: one_to_one}, left_vestibular -> right_abducens: 1, right_vestibular -> left_abducens: 1}
  - {left_vestibular -> left_abducens: -1, right_vestibular -> right_abducens: -1}
  - {left_vestibular -> right_vestibular: -0.4, right_vestibular -> left_vestibular: -0.4}
  - {right_vestibular -> N: 0.3, left_vestibular -> M: 0.3, N -> N: {pattern: chain}, M -> M: {pattern: chain}}
  - {N -> M: {pattern: one_to_one}, M -> N: {pattern: one_to_one}, N -> left_abducens: 1, M -> right_abducens: 1}
  - {left_abducens -> right_oculomotor: 1, right_abducens -> left_oculomotor: 1}
  - {ABD -> LR: {pattern: one_to_one}, OMN -> MR: {pattern: one_to_one}}
layout:
  mirror: [[N, M], [left_canal, right_canal], [left_vestibular, right_vestibular], [left_abducens, right_abducens],
    [left_oculomotor, right_oculomotor], [left_lateral_rectus, right_lateral_rectus],
    [left_medial_rectus, right_medial_rectus]]
""")
    assert len(found) == 24
    for name in ("left_oculomotor", "right_oculomotor"):
        said = found[name].text
        assert said == name or (said.endswith("…") and name.startswith(said[:-1]) and len(said) > 8)


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
    scene = scene_of(network, network.run(3).snapshot(2))
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
    scene = scene_of(network, network.run(3).snapshot(2))
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
