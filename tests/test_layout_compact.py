"""Compact of the layered engine: shapes are tried as drafts, and the one that is chosen is drawn in full."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from neurovis_layouts.layered import component_layout, hierarchy
from neurovis_layouts.layered.compact import RANKS, WHOLE, Shape
from neurovis_layouts.layered.levels import Levels
from neurovis_layouts.layered.order import Order, ordered
from neurovis_layouts.layered.page_cost import PageCost
from neurovis_layouts.layered.templates import Book

import neurovis_spec as nv
from neurovis_spec.layout.geometry import near_pairs
from neurovis_spec.layout.model import RADIUS, Effort, Layout, LayoutProblem
from neurovis_spec.layout.problem import problem_of

#: Sixteen instances that are declared together, with two links each: in one row they are five times as wide as high.
RING = (
    "neurovis: 1\nname: ring\n"
    "modules: {m: {neurons: {x: {count: 3}, y: {}}, connections: {x -> y: 1, y -> x1: 1}}}\n"
    "instances: {"
    + ", ".join(f"i{k}: {{module: m}}" for k in range(16))
    + "}\nconnections: {"
    + ", ".join(f"i{k}.y -> i{(k + far) % 16}.x{port}: 1" for k in range(16) for port, far in ((2, 1), (3, 7)))
    + "}\n"
)


@pytest.fixture(scope="module")
def problem() -> LayoutProblem:
    return problem_of(nv.compile_text(RING).network)


def test_the_order_is_improved_once_for_each_kind_of_frame(
    problem: LayoutProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: Counter[bool] = Counter()

    def counted(levels: Levels, free: frozenset[int], effort: Effort, draft: bool) -> tuple[Levels, Order]:
        drawn[draft] += 1
        return ordered(levels, free, effort, draft)

    monkeypatch.setattr(component_layout, "ordered", counted)
    hierarchy.Composer(problem).whole()
    assert drawn[False] == 2  # the whole, and its one kind of instance
    assert drawn[True] > 4


def test_what_is_chosen_is_drawn_as_if_nothing_else_had_been_tried(
    problem: LayoutProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    composer = hierarchy.Composer(problem)
    found = composer.whole()
    shape = composer._shape
    assert (shape.rows(WHOLE, 0) or 1) > 1
    assert not shape.draft
    monkeypatch.setattr(hierarchy, "compact", lambda *_: shape)
    assert hierarchy.Composer(problem).whole() == found


def test_a_draft_is_no_drawing(problem: LayoutProblem) -> None:
    whole = Book(problem).whole()
    draft, drawing = Shape({(WHOLE, 0): 2}, draft=True), Shape({(WHOLE, 0): 2})
    assert draft.of(WHOLE, whole) != drawing.of(WHOLE, whole)
    assert draft.changed((WHOLE, RANKS), 2) == Shape({(WHOLE, 0): 2, (WHOLE, RANKS): 2}, draft=True)


FAN = (
    "neurovis: 1\nname: fan\n"
    "modules: {m: {neurons: {A: {}, B: {count: 2}, C: {}}, connections: {A -> B: 1, B -> C: 1}}}\n"
    "instances: {u: {module: m, count: COUNT}}\nneurons: {R: {bias: 1}}\nconnections: {R -> u.A: 1}\n"
    "render: {size: [WIDE, HIGH]}\n"
)


@pytest.mark.parametrize("count", [6, 12])
@pytest.mark.parametrize(("wide", "high"), [(500, 1200), (1000, 1000), (1600, 800)])
def test_instances_stand_as_the_page_that_is_asked_for(count: int, wide: int, high: int) -> None:
    text = FAN.replace("COUNT", f"{count}").replace("WIDE", f"{wide}").replace("HIGH", f"{high}")
    layout = nv.compile_text(text).layout()
    xs, ys = zip(*layout.positions.values(), strict=True)
    proportions = (max(xs) - min(xs) + 1) / (max(ys) - min(ys) + 1)
    assert 1 / 1.7 < proportions / (wide / high) < 1.7


def test_a_ring_of_instances_comes_near_to_a_page() -> None:
    ring = ", ".join(f"u{k}.C -> u{k % 8 + 1}.A: 1" for k in range(1, 9))
    text = FAN.replace("COUNT", "8").replace("R -> u.A: 1", ring).replace("neurons: {R: {bias: 1}}\n", "")
    layout = nv.compile_text(text.partition("render")[0]).layout()
    xs, ys = zip(*layout.positions.values(), strict=True)
    assert (max(xs) - min(xs) + 1) / (max(ys) - min(ys) + 1) < 2


@pytest.mark.parametrize(("wide", "high"), [(1600, 400), (400, 1600)])
def test_mirrored_chains_stand_as_the_page_that_is_asked_for(wide: int, high: int) -> None:
    chain = ", ".join(f"{side}{k}.O -> {side}{k + 1}.O: 1" for side in "lr" for k in range(1, 4))
    text = f"""
neurovis: 1
name: chains
modules: {{u: {{neurons: {{O: {{}}, M: {{}}}}, connections: {{O -> M: 1}}}}}}
instances: {{l: {{module: u, count: 4}}, r: {{module: u, count: 4}}}}
neurons: {{D: {{bias: 1}}}}
connections: {{{chain}, D -> l1.O + r1.O: 1}}
layout: {{mirror: [[l, r]]}}
render: {{size: [{wide}, {high}]}}
"""
    layout = nv.compile_text(text).layout()
    xs, ys = zip(*layout.positions.values(), strict=True)
    assert (max(xs) - min(xs) > max(ys) - min(ys)) == (wide > high)


def test_instances_that_nothing_connects_stand_in_rows() -> None:
    layout = nv.compile_text(f"{FAN.partition('neurons: {R')[0].replace('COUNT', '24')}").layout()
    xs, ys = zip(*layout.positions.values(), strict=True)
    assert max(xs) - min(xs) + 1 < 2.5 * (max(ys) - min(ys) + 1)


def test_a_page_costs_its_size_its_proportions_and_what_is_hard_to_follow_on_it(problem: LayoutProblem) -> None:
    square = [(0.0, 0.0), (12.0, 0.0), (0.0, 9.0), (12.0, 9.0)]
    page = (0.0, 0.0, 12.0, 9.0)  # of 4:3
    plain, crossed = PageCost(problem, [(0, 2), (1, 3)], True), PageCost(problem, [(0, 3), (1, 2)], True)
    assert plain(square, page) < crossed(square, page)
    assert plain(square, page) < plain(square, (0.0, 0.0, 12.0, 18.0))
    # as large, and with as much line, but too high
    assert plain(square, page) < plain(square, (0.0, 0.0, 6.0, 18.0))
    back = PageCost(problem, [(0, 2), (3, 1)], True)
    assert plain(square, page) < back(square, page)
    free, through = PageCost(problem, [(0, 2)], False), [(0.0, 0.0), (12.0, 0.0), (0.0, 9.0), (0.0, 4.0)]
    assert free(square, page) < free(through, page)
    assert plain([(12.0 - x, y) for x, y in square], page) == plain(square, page)


def _long(layout: Layout) -> float:
    """How many times as wide as high it is, or as high as wide."""
    wide, high = (np.ptp([point[axis] for point in layout.positions.values()]) + 1 for axis in (0, 1))
    return float(max(wide / high, high / wide))


def _compiled(lines: str) -> Layout:
    return nv.compile_text(f"neurovis: 1\nname: large\n{lines}\n").layout().value


def test_a_chain_of_many_instances_stands_in_as_many_bands_as_it_takes() -> None:
    module = "modules: {m: {neurons: {A: {}, B: {}}, connections: {A -> B: 1}}}"
    links = ", ".join(f"m{i}.B -> m{i + 1}.A: 1" for i in range(1, 80))
    assert _long(_compiled(f"{module}\ninstances: {{m: {{module: m, count: 80}}}}\nconnections: {{{links}}}")) < 2


def test_instances_of_one_module_that_are_declared_one_by_one_stand_in_rows() -> None:
    parts = ["modules:", "  l0: {neurons: {A: {}, B: {}}, connections: {A -> B: 1}}"]
    for level in range(1, 7):
        own = f"instances: {{x: {{module: l{level - 1}}}, y: {{module: l{level - 1}}}}}"
        parts.append(f"  l{level}: {{neurons: {{A: {{}}}}, {own}, connections: {{A -> x.A: 1, A -> y.A: 1}}}}")
    assert _long(_compiled("\n".join([*parts, "instances: {r: {module: l6}}"]))) < 2.5  # 5.7 side by side


def _levels(count: int, size: int, back: bool) -> str:
    groups = ", ".join(f"G{i}_: {{count: {size}, box: level {i}}}" for i in range(count))
    drawn = "{weight: 1, pattern: {random: {probability: 0.12}}}"
    links = [f"G{i}_ -> G{i + 1}_: {drawn}" for i in range(count - 1)]
    links += [f"G{i + 1}_ -> G{i}_: {drawn}" for i in range(count - 1)] if back else []
    return f"neurons: {{{groups}}}\nconnections: {{{', '.join(links)}}}"


@pytest.mark.parametrize(("back", "engine"), [(False, "layered"), (True, "organic")])
def test_many_levels_stand_in_bands_or_go_to_and_fro(back: bool, engine: str) -> None:
    layout = _compiled(_levels(*((40, 6) if not back else (22, 14)), back))
    assert layout.engine == engine
    assert _long(layout) < 2.5


def test_a_network_of_few_neurons_is_as_long_as_it_is() -> None:
    names = ", ".join(f"N{i}_: {{}}" for i in range(60))
    links = ", ".join(f"N{i}_ -> N{i + 1}_: 1" for i in range(59))
    assert _long(_compiled(f"neurons: {{{names}}}\nconnections: {{{links}}}")) > 60


@pytest.mark.parametrize(("sizes", "wide"), [((64, 32, 10), 40), ((784, 16, 10), 80)])
def test_layers_are_neither_flat_nor_endless(sizes: tuple[int, ...], wide: float) -> None:
    groups = ", ".join(f"L{'XHY'[i]}: {{count: {size}}}" for i, size in enumerate(sizes))
    drawn = "{weight: 1, pattern: {random: {probability: 0.05}}}"
    links = ", ".join(f"L{a} -> L{b}: {drawn}" for a, b in ("XH", "HY"))
    layout = _compiled(f"neurons: {{{groups}}}\nconnections: {{{links}}}")
    assert _long(layout) < 2.6
    assert np.ptp([x for x, _ in layout.positions.values()]) < wide
    places = np.array(list(layout.positions.values()))
    assert near_pairs(places, 2 * RADIUS)[0].size == 0
    depth = {own: [y for name, (_, y) in layout.positions.items() if name[1] == own] for own in "XHY"}
    assert max(depth["X"]) < min(depth["H"]) <= max(depth["H"]) < min(depth["Y"])
