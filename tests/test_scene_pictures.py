"""Every shipped picture: no text over a text or a disc, all within the picture, no line over a foreign neuron, every
neuron and box with its name; and the same of networks that are hard on labels and titles."""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pytest
from examples import EXAMPLES, shipped
from hypothesis import given
from laws import examples
from random_specs import Spec, specs
from scenes import scene_of

import neurovis_spec as nv
from neurovis_spec.layout.geometry import Rect, meet
from neurovis_spec.scene import Arrowhead, Disc, Rectangle, Scene, Spline, Text, texts
from neurovis_spec.scene.boxes import Box
from neurovis_spec.scene.geometry import sample
from neurovis_spec.scene.obstacles import Obstacles
from neurovis_spec.scene.themes import THEMES
from neurovis_spec.scene.titles import Titled, elsewhere, in_one_place, outline

NETWORKS = {
    "long names": """
neurons:
  a_neuron_with_a_long_name: {bias: 0.3, box: a box of sensors with quite a long title}
  another_neuron_with_a_long_name: {box: a box of sensors with quite a long title}
  short: {label: "Δθ/dt"}
  wide: {label: "神經元神經元"}
  step: {count: 5, label: Übergang}
connections: {a_neuron_with_a_long_name -> short: 1, another_neuron_with_a_long_name -> step: 0.4, wide -> step: -1}
""",
    "a rank of 45": """
neurons: {A: {count: 45, bias: 0.1}, B: {count: 5}, LongNameHere: {count: 42}}
connections:
  A -> B: {weight: 0.3, pattern: all_to_all}
  B -> LongNameHere: {weight: 0.3, pattern: all_to_all}
""",
    "loops and parallels": """
neurons: {A: {bias: 0.3}, B: {}, C: {}}
connections:
  - A -> A: 0.5
  - A -> B: {weight: 1, delay: 0}
  - A -> B: {weight: -1, delay: 1}
  - A -> B: {weight: 0.5, delay: 4}
  - B -> A: {weight: 0.5, delay: 4}
  - B -> B: {weight: 0.5, delay: 1}
  - B -> C: {weight: 1, delay: 0}
  - C -> B: 0.2
""",
    "modules": """
modules:
  leg:
    inputs: {load: {}}
    neurons: {S: {input: load}, K: {count: 3, box: kernels}, M: {}}
    connections: {S -> K: 1, K -> M: 0.5, M -> K: -0.4}
neurons: {G: {bias: 0.2}, H: {}}
instances: {left: {module: leg, count: 3}, right: {module: leg, count: 3}}
connections:
  {G -> H: 1, H -> G: -1, G -> left1.S: 0.2, H -> right1.S: 0.2, left1.M -> left2.S: 1, right1.M -> right2.S: 1}
layout: {mirror: [[left, right]]}
""",
    "one neuron": "neurons: {A: {}}",
    "no connection": "neurons: {A: {count: 7}, B: {box: x}}",
}


@dataclass(frozen=True)
class Drawn:
    network: nv.CompiledNetwork
    scene: Scene


def drawn(network: nv.CompiledNetwork, step: int = 20) -> Drawn:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return Drawn(network, scene_of(network, network.run(step + 1).snapshot(step)))


@pytest.fixture(scope="module", params=EXAMPLES, ids=lambda path: path.stem)
def example(request: pytest.FixtureRequest) -> Drawn:
    return drawn(shipped(request.param))


def hard(name: str) -> Drawn:
    return drawn(nv.compile_text("neurovis: 1\nname: hard\n" + NETWORKS[name]))


def text_rect(text: Text) -> Rect:
    """What a text covers at most: digits and capitals above its line, little below."""
    width = texts.width(text.text, text.size, text.weight, text.subscript)
    left = text.point[0] - {"start": 0.0, "middle": width / 2, "end": width}[text.anchor]
    return left, text.point[1] - 0.75 * text.size, left + width, text.point[1] + 0.2 * text.size


def check(scene: Scene) -> None:
    rects = [(t, text_rect(t)) for t in scene.shapes() if isinstance(t, Text)]
    for place, (text, one) in enumerate(rects):
        assert one[0] >= 0, text.text
        assert one[1] >= 0, text.text
        assert one[2] <= scene.width, text.text
        assert one[3] <= scene.height, text.text
        assert not [(text.text, t.text) for t, other in rects[place + 1 :] if meet(one, other)]
    discs = [shape for shape in scene.shapes() if isinstance(shape, Disc)]
    for text, (x0, y0, x1, y1) in rects:
        for disc in discs:
            (x, y), r = disc.centre, disc.radius
            apart = math.hypot(x - min(max(x, x0), x1), y - min(max(y, y0), y1))
            assert text.on_disc or apart > r, text.text
    for group in scene.groups:  # what stands on a disc does not reach beyond it
        inside = [shape for shape in group.shapes if isinstance(shape, Disc)]
        for label in group.shapes:
            if isinstance(label, Text) and label.on_disc:
                (x0, _, x1, _), (disc,) = text_rect(label), inside
                assert x1 - x0 <= 2 * disc.radius, label.text
    dots = np.concatenate([_reach(shape) for shape in scene.shapes()] or [np.zeros((1, 2))])
    assert dots.min() >= 0
    assert dots[:, 0].max() <= scene.width
    assert dots[:, 1].max() <= scene.height


def _reach(shape: object) -> npt.NDArray[np.float64]:
    match shape:
        case Spline():
            line = sample(shape.points, 16)
            return np.concatenate([line - shape.width / 2, line + shape.width / 2])
        case Disc():
            reach = shape.radius + shape.stroke_width / 2
            x, y = shape.centre
            return np.array([(x - reach, y - reach), (x + reach, y + reach)])
        case Arrowhead():
            return np.array(shape.points)
        case Rectangle():
            x, y = shape.corner
            return np.array([(x, y), (x + shape.width, y + shape.height)])
    return np.zeros((0, 2))


def test_the_examples_touch_nothing_they_should_not(example: Drawn) -> None:
    check(example.scene)


@pytest.mark.parametrize("name", NETWORKS)
def test_hard_networks_touch_nothing_they_should_not(name: str) -> None:
    check(hard(name).scene)


@examples(6)
@given(specs())
def test_any_network_touches_nothing_it_should_not(spec: Spec) -> None:
    check(drawn(nv.compile_text(json.dumps(spec)), step=2).scene)


def test_no_line_runs_over_a_foreign_neuron(example: Drawn) -> None:
    found = example.network.drawn().metrics()
    assert found["edges_over_neurons"] == 0
    assert found["overlaps"] == 0


def test_every_neuron_of_the_examples_has_a_label(example: Drawn) -> None:
    scene = example.scene
    bare = [g.data["neuron"] for g in scene.groups if "neuron" in g.data and not _texts(g.shapes)]
    assert not bare


def test_every_box_of_the_examples_has_its_whole_name(example: Drawn) -> None:
    scene = example.scene
    said = {g.id: text for g in scene.groups if g.id.startswith("title:") for text in _texts(g.shapes)}
    frames = [g for g in scene.groups if g.id.startswith(("box:", "instance:"))]
    assert {f"title:{g.title}" for g in frames} == set(said)
    for frame in frames:
        assert said[f"title:{frame.title}"].startswith(frame.title.rpartition(".")[2])


def _texts(shapes: tuple[object, ...]) -> list[str]:
    return [shape.text for shape in shapes if isinstance(shape, Text)]


def test_numbered_neurons_that_are_crowded_say_their_numbers() -> None:
    said: dict[str, str] = {}
    for group in hard("a rank of 45").scene.groups:
        for shape in group.shapes if "neuron" in group.data else ():
            if isinstance(shape, Text):
                said[group.data["neuron"]] = shape.subscript or shape.text
    assert len(said) == 92
    numbers = {name: name.removeprefix(name.rstrip("0123456789")) for name in said}
    assert all(words in (name, numbers[name]) for name, words in said.items())
    assert len({words == name for name, words in said.items() if name.startswith("A")}) == 1


def test_titles_of_boxes_that_are_alike_stand_alike() -> None:
    """In the same place of their frames, or in its mirror image; those of instances are heavier."""
    scene = hard("modules").scene
    frames = {g.title: s for g in scene.groups if g.id.startswith(("box:", "instance:")) for s in g.shapes}
    titles = {g.id.removeprefix("title:"): s for g in scene.groups if g.id.startswith("title:") for s in g.shapes}
    assert set(titles) == set(frames)
    for end, weight in ((".kernels", 400), ("", 600)):
        found = set()
        for side in ("left", "right"):
            for number in (1, 2, 3):
                frame, title = frames[f"{side}{number}{end}"], titles[f"{side}{number}{end}"]
                assert isinstance(frame, Rectangle)
                assert isinstance(title, Text)
                assert title.weight == weight
                x, y = title.point[0] - frame.corner[0], title.point[1] - frame.corner[1]
                width = texts.width(title.text, title.size, title.weight)
                beyond = frame.width - x - width
                inset = -1.0 if abs(x - beyond) < 1e-6 else round(min(x, beyond), 6)  # in the middle both are as wide
                found.add((title.size, round(y, 6), inset))
        assert len(found) == 1


def test_a_box_that_foreign_neurons_stand_in_has_no_frame() -> None:
    words = "neurovis: 1\nname: b\nneurons: {A: {}, B: {}, C: {}}\nlayout: {engine: manual, boxes: {both: [A, C]}, "
    for x, shown in ((1, False), (5, True)):
        scene = drawn(nv.compile_text(words + f"positions: {{A: [0, 0], B: [{x}, 0], C: [2, 0]}}}}\n")).scene
        assert bool([g for g in scene.groups if g.id == "box:both"]) == shown


NEST = """\
neurovis: 1
name: nest
modules:
  a: {neurons: {n: {bias: 1}, m: {}}, connections: {n -> m: 1}}
  b: {instances: {i: {module: a, count: 2}}, connections: {i1.m -> i2.n: 1}}
  c: {instances: {i: {module: b, count: 2}}, connections: {i1.i2.m -> i2.i1.n: 1}}
  d: {instances: {i: {module: c, count: 2}}, connections: {i1.i2.i2.m -> i2.i1.i1.n: 1}}
instances: {z: {module: d, count: 2}}
connections: {z1.i1.i1.i1.m -> z2.i2.i2.i2.n: 1, z2.i1.i1.i1.m -> z1.i2.i2.i2.n: 1}
"""


def test_titles_stand_in_one_place_of_narrow_frames_within_frames_and_lines_keep_off_their_letters() -> None:
    scene = drawn(nv.compile_text(NEST)).scene
    found = {g.id.removeprefix("title:"): s for g in scene.groups if g.id.startswith("title:") for s in g.shapes}
    frames = {g.id.partition(":")[2]: s for g in scene.groups if g.id.startswith("instance:") for s in g.shapes}
    titles = [title for title in found.values() if isinstance(title, Text)]
    assert {title.text for title in titles} == {"z1", "z2", "i1", "i2"}
    places = set()
    sides: list[tuple[float, float]] = []
    for path, title in found.items():
        frame = frames[path]
        assert isinstance(title, Text)
        assert isinstance(frame, Rectangle)
        x0, _, x1, _ = text_rect(title)
        sides.append((x0 - frame.corner[0], frame.corner[0] + frame.width - x1))
        places.add((title.size, round(title.point[1] - frame.corner[1], 6)))
    assert len(places) == 1
    assert any(max(gaps) - min(gaps) < 0.01 for gaps in zip(*sides, strict=True)), "as far from one side in all"
    lines = np.concatenate([sample(s.points, 200) for s in scene.shapes() if isinstance(s, Spline)])
    for number, title in enumerate(titles):
        x0, y0, x1, y1 = text_rect(title)
        assert title.halo or not ((lines > (x0, y0)) & (lines < (x1, y1))).all(axis=1).any()
        assert not any(meet(text_rect(title), text_rect(other)) for other in titles[:number])


def test_a_title_that_has_no_room_in_the_place_of_the_others_stands_in_its_mirror_image() -> None:
    frames = [(0.0, 0.0, 120.0, 60.0), (200.0, 0.0, 320.0, 60.0)]
    # only the upper left corner of the first frame is free, and the upper right one of the second
    kept = [(60.0, 0.0, 120.0, 60.0), (0.0, 25.0, 120.0, 60.0), (200.0, 0.0, 260.0, 60.0), (200.0, 25.0, 320.0, 60.0)]
    boxes = [Titled(Box(name, name, (0,), rect), rect, rect) for name, rect in zip("ab", frames, strict=True)]

    def placed(kept: list[Rect]) -> list[Text]:
        titles = in_one_place(boxes, Obstacles([], [], np.zeros((0, 2)), np.zeros(0)), THEMES["default"], kept)
        return [titles[0].lines[0], titles[1].lines[0]]

    left, right = placed(kept)
    assert left.point == (10.0, right.point[1])
    assert right.point[0] + texts.width("b", right.size, right.weight) == pytest.approx(320 - 10)
    # where both have room in the same place they stand there
    assert [title.point[0] - rect[0] for rect, title in zip(frames, placed(kept[1::2]), strict=True)] == [10.0, 10.0]


def test_boxes_that_compute_the_same_all_say_it_or_none_does() -> None:
    """Where one of them has no room for it, the others of them do not say it either; what else others compute stays."""
    wide, narrow, long = (0.0, 0.0, 200.0, 60.0), (250.0, 0.0, 300.0, 60.0), (350.0, 0.0, 550.0, 60.0)
    left, right = Box("left · relu", "left", (0,), wide), Box("right · relu", "right", (1,), narrow)
    other = Box("out · tanh", "out", (2,), long)

    def free() -> Obstacles:
        return Obstacles([], [], np.zeros((0, 2)), np.zeros(0))

    boxes = [Titled(left, wide, wide), Titled(right, narrow, narrow), Titled(other, long, long)]
    said = in_one_place(boxes, free(), THEMES["default"])
    assert [said[place].words for place in range(3)] == ["left", "right", "out · tanh"]
    # elsewhere it stands in two lines
    found = [(one.words, len(one.lines)) for one in elsewhere(boxes, free(), THEMES["default"]) if one]
    assert found == [("left · relu", 1), ("right · relu", 2), ("out · tanh", 1)]
    boxes[1] = Titled(replace(right, rect=wide), wide, wide)
    assert {in_one_place([box], free(), THEMES["default"])[0].words for box in boxes} == {
        "left · relu", "right · relu", "out · tanh"
    }  # fmt: skip
    (alone,) = elsewhere([boxes[0]], free(), THEMES["default"], {" · relu"})  # in one place others do not say it
    assert alone
    assert alone.words == "left"


def test_a_title_close_to_its_frame_does_not_cover_it() -> None:
    rect = (0.0, 0.0, 34.0, 60.0)
    obstacles = Obstacles([], [], np.zeros((0, 2)), np.zeros(0))
    obstacles.add_frame(outline(rect))
    heading = in_one_place([Titled(Box("abc", "abc", (0,), rect), rect, rect)], obstacles, THEMES["default"])[0]
    (title,) = heading.lines
    assert title.point[0] == 5.0  # nearer to the side than the ten units that titles leave where they can
    assert not title.halo


def test_a_title_does_not_stand_in_the_frame_of_another_box() -> None:
    """Where frames stand close together there is room beside one only within the other."""
    words = "neurovis: 1\nname: b\nneurons:\n  A: {count: 3, box: wide title}\n  B: {count: 3, box: other title}\n"
    places = "{A1: [0, 0], A2: [0, 1], A3: [0, 2], B1: [1.3, 0], B2: [1.3, 1], B3: [1.3, 2]}"
    scene = drawn(nv.compile_text(words + f"layout: {{engine: manual, positions: {places}}}\n")).scene
    frames = {g.title: s for g in scene.groups if g.id.startswith("box:") for s in g.shapes}
    titles = {g.id.removeprefix("title:"): s for g in scene.groups if g.id.startswith("title:") for s in g.shapes}
    assert set(titles) == set(frames) == {"wide title", "other title"}
    for name, title in titles.items():
        (other,) = [frame for path, frame in frames.items() if path != name]
        assert isinstance(title, Text)
        assert isinstance(other, Rectangle)
        (x, y), wide, high = other.corner, other.width, other.height
        assert not meet(text_rect(title), (x, y, x + wide, y + high))


#: between T and Y, and to the left, stand others
TAUGHT = """\
neurovis: 1
name: taught
neurons: {R: {count: 54, bias: 1}, Y: {}, T: {bias: 1}}
connections: {R -> Y: {weight: 0, pattern: all_to_all, plasticity: {delta: {rate: 0.01, target: T}}}}
layout:
  positions: {T: [5, 0], Y: [5, 10], PINS}
""".replace("PINS", ", ".join(f"R{9 * x + y}: [{x}, {y}]" for x in range(6) for y in range(1, 10)))


@pytest.mark.parametrize("framed", [False, True])
def test_the_dotted_line_of_a_rule_stays_in_the_picture_or_in_the_frame_of_its_instance(framed: bool) -> None:
    text = TAUGHT
    if framed:
        body = "".join(f"    {line}\n" for line in TAUGHT.splitlines()[2:])
        instances = "instances: {a: {module: esn}, b: {module: esn}}"
        text = f"neurovis: 1\nname: framed\nmodules:\n  esn:\n{body}{instances}\n"
    scene = drawn(nv.compile_text(text), 3).scene
    groups = [group for group in scene.groups if "signal" in group.data]
    lines = [shape for group in groups for shape in group.shapes if isinstance(shape, Spline)]
    rooms = [(0.0, 0.0, scene.width, scene.height)]
    if framed:
        frames = [s for g in scene.groups if (g.id or "").startswith("instance:") for s in g.shapes]
        rooms = [(*r.corner, r.corner[0] + r.width, r.corner[1] + r.height) for r in frames if isinstance(r, Rectangle)]
    assert len(lines) == len(rooms) == 1 + framed
    for line in lines:
        dots = sample(line.points, 40)
        (x0, y0), (x1, y1) = dots.min(axis=0), dots.max(axis=0)
        assert any(r[0] <= x0 and r[1] <= y0 and x1 <= r[2] and y1 <= r[3] for r in rooms)


def test_dotted_lines_between_mirror_images_are_mirrored_and_names_keep_off_them() -> None:
    network = nv.compile_text("""\
neurovis: 1
name: taught
neurons:
  LT: {bias: 1}
  LM: {label: a name in the middle}
  LO: {}
  RT: {bias: 1}
  RM: {label: a name in the middle}
  RO: {}
connections:
  LM -> LO: {weight: 0, plasticity: {delta: {rate: 0.01, target: LT}}}
  RM -> RO: {weight: 0, plasticity: {delta: {rate: 0.01, target: RT}}}
layout:
  mirror: [[LT, RT], [LM, RM], [LO, RO]]
  positions: {LT: [0, 0], LM: [1.5, 0], LO: [3, 0], RO: [6, 0], RM: [7.5, 0], RT: [9, 0]}
""")
    scene = drawn(network, 3).scene
    dots = {
        group.data["signal"]: sample(shape.points, 60)
        for group in scene.groups
        for shape in group.shapes
        if "signal" in group.data and isinstance(shape, Spline)
    }
    left, right = dots["LT -> LO"], dots["RT -> RO"]
    assert np.allclose(left[:, 1], right[:, 1])
    assert np.allclose(np.diff(left[:, 0]), -np.diff(right[:, 0]))
    names = {group.data["neuron"]: s for group in scene.groups for s in group.shapes
             if isinstance(s, Text) and group.data.get("neuron") in ("LM", "RM")}  # fmt: skip
    for name, line in (("LM", left), ("RM", right)):
        x0, y0, x1, y1 = text_rect(names[name])
        assert not ((line[:, 0] > x0) & (line[:, 0] < x1) & (line[:, 1] > y0) & (line[:, 1] < y1)).any()
