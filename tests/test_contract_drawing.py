"""The sections ``layout`` and ``render`` as the language states them (§10): words, defaults, refusals."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from small_specs import answer, codes, compiled, network_of

from neurovis_spec.scene import THEMES, colours

PAIR = "neurons: {A: {bias: 1, position: [0, 0]}, B: {position: [3, 4]}}\nconnections: {A -> B: 1}\n"


@pytest.mark.parametrize("engine", ["auto", "layered", "organic", "large", "circular", "grid", "spatial"])
def test_every_engine_of_the_list_is_there(engine: str) -> None:
    """Both neurons are placed, a disc apart at least."""
    layout = compiled(f"{PAIR}layout: {{engine: {engine}}}").layout()
    (ax, ay), (bx, by) = layout.positions["A"], layout.positions["B"]
    assert (ax - bx) ** 2 + (ay - by) ** 2 >= 0.36 - 1e-9
    assert engine in ("auto", layout.engine)


def test_manual_takes_pins_alone() -> None:
    """And says whose place is missing."""
    text = PAIR + "layout: {engine: manual, positions: {A: [1, 2], B: [5, 2]}}"
    assert compiled(text).layout().positions == {"A": (1, 2), "B": (5, 2)}


def test_without_engine_it_is_auto_and_an_unknown_one_is_answered() -> None:
    """With the nearest."""
    assert network_of(PAIR).layout.engine == "auto"
    assert answer(PAIR + "layout: {engine: layerd}")[2] == "did you mean 'layered'?"


@pytest.mark.parametrize(
    ("direction", "step"), [("down", (0, 1)), ("up", (0, -1)), ("right", (1, 0)), ("left", (-1, 0))]
)
def test_signals_go_in_the_direction(direction: str, step: tuple[int, int]) -> None:
    """x grows right, y grows down; the default is down."""
    (ax, ay), (bx, by) = (
        compiled(f"{PAIR}layout: {{engine: layered, direction: {direction}}}").layout().positions.values()
    )
    assert ((bx > ax) - (bx < ax), (by > ay) - (by < ay)) == step
    assert network_of(PAIR).layout.direction == "down"


@pytest.mark.parametrize("how", ["row", "column", "grid", "ring", "arc"])
def test_a_group_may_be_arranged(how: str) -> None:
    """In one of five ways."""
    text = (
        f"neurons: {{K: {{count: 4, bias: 1}}, O: {{}}}}\nconnections: {{K -> O: 1}}\nlayout: {{arrange: {{K: {how}}}}}"
    )
    places = [place for name, place in compiled(text).layout().positions.items() if name != "O"]
    columns, rows = len({x for x, _ in places}), len({y for _, y in places})
    if how in ("row", "column", "grid"):
        assert (columns, rows) == {"row": (4, 1), "column": (1, 4), "grid": (2, 2)}[how]
    else:
        assert columns > 1 < rows
    assert codes(text.replace(f"K: {how}", "K: heap")) == ["unknown-value"]


def test_what_is_pinned_stays_exactly_there() -> None:
    """The rest is arranged around it."""
    text = "neurons: {K: {count: 5, bias: 1}, O: {}}\nconnections: {K -> O: 1}\n"
    layout = compiled(text + "layout: {positions: {K3: [1.1, -7.3], O: [0.1, 0]}}").layout()
    assert (layout.positions["K3"], layout.positions["O"]) == ((1.1, -7.3), (0.1, 0))
    assert layout.metrics()["pins_moved"] == 0


def test_a_pin_names_a_neuron_or_a_group_of_one() -> None:
    """Of a group of several it is refused; so are pins closer than discs are wide."""
    text = "neurons: {K: {count: 2, bias: 1}, O: {count: 1, bias: 1}}\nlayout: {positions: {%s}}"
    assert compiled(text % "K1: [0, 0], O: [3, 0]").layout().positions["O1"] == (3, 0)
    assert codes(text % "K: [0, 0]") == ["bad-pin"]
    assert codes(text % "K1: [0, 0], K2: [0.59, 0]") == ["pins-overlap"]
    assert compiled(text % "K1: [0, 0], K2: [0.6, 0]").warnings == ()


def test_boxes_may_be_named_by_the_neurons_or_by_the_layout() -> None:
    """Both say the same."""
    one = "neurons: {A: {bias: 1, box: in here}, B: {}, C: {box: in here}}\nconnections: {A -> B: 1, B -> C: 1}\n"
    other = one.replace(", box: in here", "").replace("{box: in here}", "{}") + "layout: {boxes: {in here: [A, C]}}\n"
    assert compiled(one).layout().dump() == compiled(other).layout().dump()


def test_lines_mirrors_and_spacing_hold() -> None:
    """``align`` puts a list on one line across the direction; of a mirrored pair the second is the first's image."""
    text = """
neurons: {L: {count: 2, bias: 1}, R: {count: 2, bias: 1}, O: {}, Q: {}}
connections: {L -> O: 1, R -> O: 1, L1 -> Q: 1}
layout: {mirror: [[L, R]], align: [[O, Q]], spacing: {neuron: 1.5, rank: 3}}
"""
    layout = compiled(text).layout()
    places = layout.positions
    assert places["O"][1] == places["Q"][1]
    middles = {places[f"L{i}"][0] + places[f"R{i}"][0] for i in (1, 2)}
    assert len(middles) == 1
    assert all(places[f"L{i}"][1] == places[f"R{i}"][1] for i in (1, 2))
    assert layout.metrics()["symmetry"] == 1
    assert places["O"][1] - places["L1"][1] >= 3
    assert codes("neurons: {L: {count: 2}, R: {}}\nlayout: {mirror: [[L, R]]}") == ["unequal-mirror"]


def test_neighbours_are_1_apart_and_ranks_2_by_default() -> None:
    """In units of the layout."""
    text = "neurons: {A: {count: 2, bias: 1}, B: {}}\nconnections: {A -> B: 1}\n"
    settings = network_of(text).layout
    assert (settings.neuron_spacing, settings.rank_spacing) == (1, 2)
    places = compiled(text).layout().positions
    assert (places["A2"][0] - places["A1"][0], places["B"][1] - places["A1"][1]) == (1, 2)


def test_the_same_spec_gives_the_same_layout_byte_for_byte() -> None:
    """The order of keys and edges does not show in it, nor does renaming that keeps the names' order."""
    every = "A -> B: {pattern: all_to_all}"
    one = f"neurons: {{A: {{count: 3, bias: 1}}, B: {{count: 2}}, C: {{}}}}\nconnections: {{{every}, B -> C: 1}}\n"
    other = f"connections: {{B -> C: 1, {every}}}\nneurons: {{C: {{}}, B: {{count: 2}}, A: {{bias: 1, count: 3}}}}\n"
    first = compiled(one).layout()
    assert first.dump() == compiled(one).layout().dump() == compiled(other).layout().dump()
    renamed = compiled(one.replace("A", "P").replace("B", "Q").replace("C", "R")).layout()
    assert list(renamed.positions.values()) == list(first.positions.values())
    assert list(renamed.routes.values()) == list(first.routes.values())


def test_coordinates_that_no_pin_gives_are_multiples_of_1_1024_from_0_on() -> None:
    """Without pins the smallest x and y are 0."""
    text = "neurons: {A: {count: 5, bias: 1}, B: {count: 3}}\nconnections: {A -> B: {pattern: all_to_all}}\n"
    places = compiled(text).layout().positions.values()
    assert all((1024 * c).is_integer() for place in places for c in place)
    assert (min(x for x, _ in places), min(y for _, y in places)) == (0, 0)


def test_the_defaults_of_render() -> None:
    """The default theme, labels, a legend and a title, no gain of the author's, the size from the layout."""
    render = network_of(PAIR).render
    assert (render.theme, render.labels, render.legend, render.title, render.size) == (
        "default",
        True,
        True,
        True,
        None,
    )
    assert (render.activity, render.signal, render.thickness, render.change) == ((), (), (), ())


@pytest.mark.parametrize("theme", ["default", "dark", "print", "paper"])
def test_every_theme_of_the_list_is_there(theme: str) -> None:
    """Another is answered with the nearest."""
    assert network_of(f"{PAIR}render: {{theme: {theme}}}").render.theme == theme
    assert answer(f"{PAIR}render: {{theme: {theme}x}}")[2] == f"did you mean '{theme}'?"


def drawn(text: str, folder: Path) -> str:
    compiled(text).render(folder / "x.svg", step=1)
    return (folder / "x.svg").read_text(encoding="utf-8")


def test_gains_size_labels_legend_and_title_do_what_they_say(tmp_path: Path) -> None:
    """γ_NC colours the disc, γ_CT widens the line; a size is in pixels; a title may be another text."""
    gains = "gain: {activity: 1, signal: 0.5, thickness: 7, change: 3}"
    svg = drawn(
        f"{PAIR}render: {{{gains}, size: [640, 300], labels: false, legend: false, title: Quite another}}", tmp_path
    )
    assert 'width="640"' in svg
    assert 'height="300"' in svg
    assert 'stroke-width="7"' in svg
    assert 'fill="#0072b2"' in svg, "the activity 1 by the gain 1 is the end of the scale"
    assert "Quite another" in svg
    plain = drawn(PAIR, tmp_path)
    texts = [len(re.findall(r"<text", shown)) for shown in (svg, plain)]
    assert texts[0] < texts[1]
    assert "Quite another" not in plain


def test_gains_are_for_all_or_for_what_references_name(tmp_path: Path) -> None:
    """Entries as the spec writes them, or any A -> B; where they overlap, the one that names the fewest holds."""
    text = """
neurons: {K: {count: 4, bias: 0.25}, O: {}}
connections: {K -> O: {weight: 0.5, delay: 0}}
render: {gain: {activity: {K: 1, K2: 2, K2..K3: 4}, signal: 2, thickness: {K -> O: 10, K4 -> O: 2}}}
"""
    svg = drawn(text, tmp_path)
    values = [1, 2, 4, 1]
    for neuron, value in zip(("K1", "K2", "K3", "K4"), values, strict=True):
        fill = re.search(rf'data-neuron="{neuron}".*?fill="(#\w+)"', svg, re.DOTALL)
        assert fill is not None
        assert [fill[1]] == colours(THEMES["default"], [value * 0.25])
    widths = re.findall(r'data-from="K\d".*?stroke-width="([\d.]+)"', svg, re.DOTALL)
    assert sorted(widths) == ["1", "5", "5", "5"]


def test_a_range_maps_on_the_colours(tmp_path: Path) -> None:
    """From low, which is −1, to high, which is +1: for what is not centred on 0."""
    text = "neurons: {N: {count: 3, bias: i*50 - 80}}\nrender: {gain: {activity: {N: [-80, 20]}}}\n"
    svg = drawn(text, tmp_path)
    fills = re.findall(r'data-neuron="N\d".*?fill="(#\w+)"', svg, re.DOTALL)
    assert fills == colours(THEMES["default"], [-1, 0, 1])
    words = re.findall(r">([^<>]+)</text>", svg)
    assert {"−80", "+20"} <= set(words), "the legend says what the ends of the colours are"


def test_a_tooltip_says_the_gain(tmp_path: Path) -> None:
    text = PAIR + "render: {gain: {activity: {A: 3}, signal: 4, thickness: 5}}"
    titles = re.findall(r"<title>([^<]*)</title>", drawn(text, tmp_path))
    assert any("gain 3" in title for title in titles if title.startswith("A\n"))
    assert any("gain: signal 4, thickness 5" in title for title in titles if title.startswith("A → B"))
    ranged = drawn(PAIR + "render: {gain: {activity: [-80, 20]}}", tmp_path)
    assert "colours from −80 to 20" in ranged


def test_words_that_no_section_knows_are_findings() -> None:
    """In both, and in what they hold."""
    lost = ["layout: {egnine: grid}", "layout: {spacing: {neurons: 1}}", "render: {gain: {activty: 1}}"]
    for text in (*lost, "render: {them: dark}"):
        code, _, hint = answer(PAIR + text)
        assert code == "unknown-key"
        assert "did you mean" in hint
