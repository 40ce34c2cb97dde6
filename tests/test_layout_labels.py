"""Labels and titles that do not fit find room in the layout, and scenes put them there."""

from __future__ import annotations

import math
import random
from itertools import combinations, pairwise

import pytest
from scenes import scene_of

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.diagnostics import Findings
from neurovis_spec.layout import Layout
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.file import dump, parse
from neurovis_spec.layout.geometry import Rect, meet
from neurovis_spec.layout.labels import WIDEST, label_rect
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.problem import NamedProblem, problem_of
from neurovis_spec.scene import Disc, Rectangle, Text
from neurovis_spec.scene.texts import width

WORDS = [
    "left",
    "front",
    "coxa-trochanter",
    "femur-tibia",
    "thorax-coxa",
    "load",
    "sensor",
    "of the ground",
    "joint",
    "x",
]


def label(chooser: random.Random) -> str:
    return " ".join(chooser.sample(WORDS, chooser.choice([1, 2, 2, 3])))


def generated(seed: int) -> str:
    """A network with long names: in boxes, in instances, in mirrored halves, in any direction."""
    chooser = random.Random(seed)
    names = [f"N{i}" for i in range(chooser.choice([5, 8, 12]))]
    box = {name: f', box: "{label(chooser)} {i % 3}"' for i, name in enumerate(names) if chooser.random() < 0.4}
    lines = ["neurovis: 1", "name: generated", "modules:", "  limb:", "    neurons:"]
    lines += [f'      {name}: {{label: "{label(chooser)}"}}' for name in "abc"]
    lines += ["    connections: {a -> b: 1, a -> c: 1}", "neurons:"]
    lines += [f'  {name}: {{label: "{label(chooser)}"{box.get(name, "")}}}' for name in names]
    limbs = [f"{label(chooser).replace(' ', '_').replace('-', '_')}_{side}" for side in ("l", "r")]
    lines += ["instances:", *(f"  {limb}: {{module: limb}}" for limb in limbs), "connections:"]
    lines += [f"  N0 -> {limb}.a: 1" for limb in limbs]
    lines += [f"  {names[chooser.randrange(i)]} -> {name}: 1" for i, name in enumerate(names) if i]
    lines += [f"layout: {{direction: {chooser.choice(['down', 'right', 'up', 'left'])}"]
    lines[-1] += f", mirror: [[{limbs[0]}, {limbs[1]}]]}}" if chooser.random() < 0.5 else "}"
    return "\n".join(lines) + "\n"


def overlaps(network: CompiledNetwork, layout: Layout) -> float:
    return metrics(layout, problem_of(network.network)).get("label_overlaps", 0)


@pytest.mark.parametrize("seed", range(24))
def test_no_label_lies_on_anything_in_a_layered_layout(seed: int) -> None:
    network = nv.compile_text(generated(seed))
    assert any(wide for wide, _ in problem_of(network.network).labels)
    assert overlaps(network, network.layout("layered").value) == 0


def shown(
    network: CompiledNetwork,
) -> tuple[dict[str, list[Text]], dict[str, Disc], dict[str, Text], dict[str, Rectangle]]:
    """The lines of labels and the discs by neuron, the titles and the frames by path, of a picture."""
    scene = scene_of(network, network.run(2).snapshot(1))
    labels: dict[str, list[Text]] = {}
    discs: dict[str, Disc] = {}
    titles: dict[str, Text] = {}
    frames: dict[str, Rectangle] = {}
    for group in scene.groups:
        for shape in group.shapes:
            if isinstance(shape, Text) and "neuron" in group.data:
                labels.setdefault(group.data["neuron"], []).append(shape)
            elif isinstance(shape, Disc) and "neuron" in group.data:
                discs[group.data["neuron"]] = shape
            elif isinstance(shape, Text) and group.id.startswith("title:"):
                titles[group.id.removeprefix("title:")] = shape
            elif isinstance(shape, Rectangle) and group.id.startswith(("box:", "instance:")):
                frames[group.id.partition(":")[2]] = shape
    return labels, discs, titles, frames


def covers(text: Text) -> Rect:
    wide, (x, y) = width(text.text, text.size, text.weight, text.subscript), text.point
    left = x - {"start": 0.0, "middle": wide / 2, "end": wide}[text.anchor]
    return left, y - 0.78 * text.size, left + wide, y + 0.22 * text.size


def around(frame: Rectangle) -> Rect:
    (x, y), wide, high = frame.corner, frame.width, frame.height
    return x, y, x + wide, y + high


@pytest.mark.parametrize("seed", range(8))
def test_labels_and_titles_are_drawn_where_they_have_room(seed: int) -> None:
    text = generated(seed) + "render: {size: [4000, 4000], title: false, legend: false}\n"
    network = nv.compile_text(text)
    labels, discs, titles, frames = shown(network)
    for name, words in zip(network.network.neurons.names, network.network.neurons.labels, strict=True):
        said = " ".join(line.text for line in labels[name])
        assert said.replace("- ", "-") == words or (width(words, 1.0, 600) > WIDEST and "…" in said)
    written = [line for lines in labels.values() for line in lines]
    texts = [*written, *titles.values()]
    assert not [(a.text, b.text) for a, b in combinations(texts, 2) if meet(covers(a), covers(b))]
    for label in [label for label in written if not label.on_disc] + [*titles.values()]:
        x0, y0, x1, y1 = covers(label)
        for disc in discs.values():
            (x, y), reach = disc.centre, disc.radius
            assert math.hypot(max(x0 - x, x - x1, 0), max(y0 - y, y - y1, 0)) > reach
    for path, title in titles.items():
        x0, y0, x1, y1 = covers(title)
        left, top, right, bottom = around(frames[path])
        assert min(x0 - left, right - x1, y0 - top, bottom - y1) > 0


def corner(title: Text, frame: Rectangle) -> tuple[bool, bool]:
    x0, y0, x1, y1 = covers(title)
    left, top, right, bottom = around(frame)
    return x0 - left < right - x1 + 1e-6, y0 - top < bottom - y1


@pytest.mark.parametrize("direction", ["down", "right"])
def test_titles_of_all_boxes_stand_in_one_place_in_mirrored_pictures_too(direction: str) -> None:
    network = nv.compile_text(f"""
neurovis: 1
name: mirrored
modules:
  leg:
    neurons: {{A: {{count: 3, box: upper}}, B: {{count: 2, box: lower}}, C: {{}}}}
    connections: {{A -> B: {{pattern: all_to_all}}, B -> C: 1}}
neurons: {{P: {{count: 2, box: brain}}}}
instances: {{left: {{module: leg}}, right: {{module: leg}}}}
connections: {{P1 -> left.A: 1, P2 -> right.A: 1}}
layout: {{direction: {direction}, mirror: [[left, right], [P1, P2]]}}
""")
    _, _, titles, frames = shown(network)
    assert set(titles) == set(frames) == {
        "left", "right", "left.upper", "left.lower", "right.upper", "right.lower", "brain"
    }  # fmt: skip
    wide = {path for path in titles if around(frames[path])[2] - around(frames[path])[0] > 100}
    assert len({corner(titles[path], frames[path]) for path in wide}) == 1
    assert len({title.size for title in titles.values()}) == 1


LEGS = """
neurovis: 1
name: legs
modules: {leg: {neurons: {A: {label: "coxa-trochanter {number}"}, B: {}}, connections: {A -> B: 1}}}
neurons: {P: {}}
instances: {left: {module: leg, count: 2}, right: {module: leg, count: 2}}
connections: {P -> left.A: 1, P -> right.A: 1}
layout: {mirror: [[left, right]]}
"""


def test_instances_of_one_make_and_mirror_images_keep_room_alike() -> None:
    network = nv.compile_text(LEGS)
    layout, problem = network.layout().value, problem_of(network.network)
    rooms = {name: room for name, room in zip(problem.neurons, problem.labels, strict=True) if room[0]}
    assert set(rooms) == {"left1.A", "left2.A", "right1.A", "right2.A"}
    assert len(set(rooms.values())) == 1
    assert {layout.labels[f"left{n}.A"] for n in (1, 2)} == {"right"}
    assert {layout.labels[f"right{n}.A"] for n in (1, 2)} == {"left"}
    assert metrics(layout, problem)["symmetry"] == 1


@pytest.mark.parametrize("direction", ["down", "right", "up", "left"])
@pytest.mark.parametrize("boxed", [False, True])
def test_a_chain_that_is_folded_keeps_room_for_its_labels(direction: str, boxed: bool) -> None:
    names = [f"N{i}" for i in range(24)]
    own = ["", "", ", box: one box of three", ", box: another one"]
    neurons = [f'  {name}: {{label: "{random.Random(i).choice(WORDS)} of joint {i}"{own[i // 6] if boxed else ""}}}'
               for i, name in enumerate(names)]  # fmt: skip
    links = [f"  {a} -> {b}: 1" for a, b in pairwise(names)]
    network = nv.compile_text(
        "\n".join(["neurovis: 1", "name: chain", "neurons:", *neurons, "connections:", *links,
                   f"layout: {{direction: {direction}}}"]) + "\n"
    )  # fmt: skip
    assert overlaps(network, network.layout("layered").value) == 0


def test_short_names_and_numbers_take_no_room() -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {A: {}, LongNameHere: {count: 9}}\nconnections: {A -> LongNameHere: 1}\n"
    )
    assert problem_of(network.network).labels == ()
    assert network.layout().value.labels == {}


def test_a_long_name_that_ends_in_a_number_takes_room_where_the_number_alone_says_nothing() -> None:
    network = nv.compile_text("""
neurovis: 1
name: x
neurons: {bitter_receptor: {}, extension_motor_neuron_9: {}, extension_motor_neuron_11: {}, K: {count: 2}, Int1: {}}
connections: {bitter_receptor -> extension_motor_neuron_9 + extension_motor_neuron_11 + K + Int1: 1}
""")
    problem = problem_of(network.network)
    beside = {name for name, (wide, _) in zip(problem.neurons, problem.labels, strict=True) if wide}
    assert beside == {"bitter_receptor", "extension_motor_neuron_9", "extension_motor_neuron_11"}
    assert overlaps(network, network.layout().value) == 0
    labels, *_ = shown(network)
    assert {line.text for name in beside for line in labels[name]} == beside


def test_no_room_is_kept_where_labels_are_left_out() -> None:
    assert problem_of(nv.compile_text(LEGS + "render: {labels: false}\n").network).labels == ()


def test_a_layout_file_says_on_which_side_labels_stand() -> None:
    layout = nv.compile_text(LEGS).layout().value
    findings = Findings({})
    assert parse(dump(layout), "legs.layout.yaml", findings) == layout
    text = dump(layout).replace("left1.A: right\n", "left1.A: aside\n")
    assert parse(text, "legs.layout.yaml", findings) is None
    (found,) = findings.sorted()
    assert (found.code, found.span.line) == ("wrong-type", text.count("\n", 0, text.index("aside")) + 1)


def test_a_remembered_layout_keeps_its_sides() -> None:
    before = nv.compile_text(LEGS).layout()
    more = nv.compile_text(LEGS.replace("neurons: {P: {}}", 'neurons: {P: {}, Q: {label: "another long label"}}'))
    after = more.layout(earlier=before.value)
    assert after.value.positions["left1.A"] == before.value.positions["left1.A"]
    assert after.value.labels == {**before.value.labels, "Q": after.value.labels["Q"]}


def test_boxes_that_pins_leave_no_room_for_their_titles_are_drawn_without_that() -> None:
    network = nv.compile_text("""
neurovis: 1
name: pinned
neurons:
  A: {box: "a box with a title that is long"}
  B: {box: "another with a title that is long"}
  C: {}
connections: {A -> B: 1, B -> C: 1}
layout: {engine: layered, positions: {A: [0, 0], B: [1.7, 0]}}
""")
    assert not network.layout().warnings
    _, _, _, frames = shown(network)
    assert len(frames) == 2
    one, other = (around(frame) for frame in frames.values())
    assert not meet(one, other)


def test_a_label_needs_no_more_room_than_it_has_beside_its_disc() -> None:
    assert label_rect((0.0, 0.0), (1.0, 0.2), "right")[0] > 0.3
    assert label_rect((0.0, 0.0), (1.0, 0.2), "left")[2] < -0.3
    assert label_rect((0.0, 0.0), (1.0, 0.2), "below")[1] > 0.3
    assert label_rect((0.0, 0.0), (1.0, 0.2), "above")[3] < -0.3


@pytest.mark.parametrize("engine", ["circular", "grid"])
def test_formations_keep_room_for_labels(engine: str) -> None:
    for seed in range(6):
        text = generated(seed)
        network = nv.compile_text(text[: text.index(", mirror")] + "}\n" if ", mirror" in text else text)
        assert overlaps(network, network.layout(engine).value) == 0


def without_mirror(text: str) -> str:
    return text[: text.index(", mirror")] + "}\n" if ", mirror" in text else text


def test_an_engine_that_places_neurons_anywhere_keeps_room_for_labels() -> None:
    for seed in range(10):
        network = nv.compile_text(without_mirror(generated(seed)))
        assert overlaps(network, network.layout("organic").value) == 0


def test_labels_where_neurons_have_positions_choose_sides_and_move_nobody() -> None:
    chooser = random.Random(7)
    names = [f"N{i}" for i in range(30)]
    spots = [(12.0 * (i % 6) + chooser.random(), 2.5 * (i // 6) + chooser.random()) for i in range(30)]
    neurons = [
        f'  {name}: {{label: "{label(chooser)}", position: [{x:.2f}, {y:.2f}]}}'
        for name, (x, y) in zip(names, spots, strict=True)
    ]
    links = sorted({(chooser.randrange(i), i) for i in range(1, 30)})
    text = "\n".join(["neurovis: 1", "name: here", "neurons:", *neurons, "connections:"]
                     + [f"  N{a} -> N{b}: 1" for a, b in links]) + "\n"  # fmt: skip
    network = nv.compile_text(text + "layout: {engine: spatial}\n")
    layout = network.layout().value
    assert layout.engine == "spatial"
    labels, discs, _, _ = shown(network)
    written = [line for lines in labels.values() for line in lines if not line.on_disc]
    assert {line.anchor for line in written} >= {"start", "end"}
    assert not [(a.text, b.text) for a, b in combinations(written, 2) if meet(covers(a), covers(b))]
    for (x, y), reach in [(disc.centre, disc.radius) for disc in discs.values()]:
        assert not [line for line in written if meet(covers(line), (x - reach, y - reach, x + reach, y + reach))]
    bare = nv.compile_text(text + "layout: {engine: spatial}\nrender: {labels: false}\n").layout().value
    assert bare.positions == layout.positions


def test_a_label_stands_where_no_line_runs() -> None:
    network = nv.compile_text("""
neurovis: 1
name: aside
neurons: {A: {label: "a rather long name"}, B: {}, C: {}, D: {}}
connections: {A -> B: 1, A -> C: 1, A -> D: 1}
layout: {engine: manual, positions: {A: [0, 0], B: [5, 0], C: [0, 5], D: [0, -5]}}
""")
    assert {line.anchor for line in shown(network)[0]["A"]} == {"end"}


def test_of_equal_sides_labels_of_one_line_take_the_same() -> None:
    network = nv.compile_text("""
neurovis: 1
name: aside
neurons: {A: {names: [a_rather_long_name, another_long_name]}, B: {}, a_name_of_no_group: {}}
connections: {another_long_name -> B: 1}
layout:
  engine: manual
  positions: {a_rather_long_name: [0, 0], another_long_name: [8, 0], B: [13, 0], a_name_of_no_group: [-6, 0]}
""")
    labels = shown(network)[0]
    assert {line.anchor for lines in labels.values() for line in lines if not line.on_disc} == {"end"}


def test_labels_of_mirror_images_stand_on_mirrored_sides_in_organic_layouts() -> None:
    network = nv.compile_text(
        """
neurovis: 1
name: halves
neurons:
  A: {label: "a neuron between"}
  LR
connections: {L1 -> L2: 1, L2 -> L3: 1, L3 -> L4: 1, R1 -> R2: 1, R2 -> R3: 1, R3 -> R4: 1, L1 -> A: 1, R1 -> A: 1}
layout: {engine: organic, mirror: [[L1, R1], [L2, R2], [L3, R3], [L4, R4]]}
""".replace("LR", "\n  ".join(f'{side}{i}: {{label: "{i} of one half"}}' for side in "LR" for i in range(1, 5)))
    )
    layout = network.layout().value
    flip = {"right": "left", "left": "right", "below": "below", "above": "above"}
    assert overlaps(network, layout) == 0
    assert [layout.labels[f"R{i}"] for i in range(1, 5)] == [flip[layout.labels[f"L{i}"]] for i in range(1, 5)]
    assert metrics(layout, problem_of(network.network))["symmetry"] == 1


def test_frames_hold_the_labels_of_their_neurons_in_reduced_pictures_too() -> None:
    network = nv.compile_text("""
neurovis: 1
name: wide
neurons: {A: {label: "coxa-trochanter load", box: b}, H: {}, B: {count: 40}}
connections: {A -> H: 1, H -> B: 1}
""")
    labels, discs, _, frames = shown(network)
    assert discs["A"].radius < 0.75 * 0.3 * 66
    (left, top, right, bottom), (x0, y0, x1, y1) = around(frames["b"]), covers(labels["A"][0])
    assert min(x0 - left, y0 - top, right - x1, bottom - y1) > 0


def test_of_mirror_images_one_alone_may_have_a_label_beside_its_disc() -> None:
    problem = NamedProblem(
        "x",
        ["A", "B", "C"],
        edges=[("A -> C", "A", "C", 1), ("B -> C", "B", "C", 1)],
        mirrors=[("", [("A", "B")], [])],
        labels={"A": (0.9, 0.25)},
    ).canonical()
    assert lay_out_problem(problem, "layered").labels.keys() == {"A"}
