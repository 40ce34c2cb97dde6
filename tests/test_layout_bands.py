"""Bands of the layered engine: what is much longer than a page is cut between ranks, its parts side by side."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.diagnostics import Findings
from neurovis_spec.layout import Layout
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.file import parse
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.model import LayoutProblem
from neurovis_spec.layout.problem import problem_of

CHAIN = "neurovis: 1\nname: line\nneurons: {a: {count: 30}}\nconnections:\n  a -> a: {pattern: chain}\n"
LINE = f"{CHAIN}render: {{size: [800, 600]}}\n"
#: Six legs, each of which drives the next on its side.
LEGS = (
    "neurovis: 1\nname: legs\nmodules:\n  leg: {neurons: {a: {count: 15}}, connections: {a -> a: {pattern: chain}}}\n"
    "neurons: {C: {}}\ninstances: {left: {module: leg, count: 3}, right: {module: leg, count: 3}}\n"
    "connections: {C -> left.a1: 1, C -> right.a1: 1"
    + "".join(f", {side}{i}.a15 -> {side}{i + 1}.a1: 1" for side in ("left", "right") for i in (1, 2))
    + "}\nlayout: {mirror: [[left, right]]}\n"
)
MODULES = (
    "neurovis: 1\nname: chain\nmodules: {m: {neurons: {x: {count: 3}, y: {}}, connections: {x -> y: 1}}}\n"
    "instances: {"
    + ", ".join(f"{name}: {{module: m}}" for name in "abcdefghij")
    + "}\nconnections: {"
    + ", ".join(f"{a}.y -> {b}.x1: 1" for a, b in zip("abcdefghi", "bcdefghij", strict=True))
    + "}\n"
)


def drawn(text: str) -> tuple[LayoutProblem, Layout]:
    problem = problem_of(nv.compile_text(text).network)
    return problem, lay_out_problem(problem, "layered")


def stretched(layout: Layout, aspect: float = 4 / 3) -> float:
    """How much wider or higher than a page neurons stand."""
    xs, ys = [x for x, _ in layout.positions.values()], [y for _, y in layout.positions.values()]
    wide, high = max(xs) - min(xs) + 1, max(ys) - min(ys) + 1
    return max(wide / high / aspect, high / wide * aspect)


@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
@pytest.mark.parametrize("text", [LINE, MODULES], ids=["line", "modules"])
def test_a_long_chain_stands_in_bands_without_a_crossing(text: str, direction: str) -> None:
    problem, layout = drawn(f"{text}layout: {{direction: {direction}}}\n")
    found = metrics(layout, problem)
    assert (found["crossings"], found["edges_over_neurons"], found["overlaps"]) == (0, 0, 0)
    assert found["flow"] >= 0.8  # in each band signals run the same way
    assert stretched(layout) < 2


def test_bands_are_read_like_columns_of_a_text() -> None:
    _, layout = drawn(f"{LINE}layout: {{direction: down}}\n")
    columns: dict[float, list[str]] = {}
    for name, (x, y) in sorted(layout.positions.items(), key=lambda item: item[1]):
        columns.setdefault(x, []).append(name)
        assert y == layout.positions[columns[x][0]][1] + 2 * (len(columns[x]) - 1)
    assert [name for column in columns.values() for name in column] == [f"a{i}" for i in range(1, 31)]


def test_legs_of_fifteen_ranks_fold_alike_and_mirror_images_are_exact() -> None:
    _, layout = drawn(LEGS)
    assert stretched(layout) < 2.5
    axis = 2 * layout.positions["C"][0]
    first = [layout.positions[f"left1.a{i}"] for i in range(1, 16)]
    assert max(y for _, y in first) - min(y for _, y in first) < 20
    for leg in (1, 2, 3):
        (ax, ay), (bx, by) = layout.positions[f"left{leg}.a1"], first[0]
        for i in range(1, 16):
            x, y = layout.positions[f"left{leg}.a{i}"]
            assert layout.positions[f"right{leg}.a{i}"] == (axis - x, y)
            assert (x - ax, y - ay) == (first[i - 1][0] - bx, first[i - 1][1] - by)


def test_what_is_near_to_a_page_runs_one_way() -> None:
    problem, layout = drawn(f"{LINE}layout: {{direction: down}}\n".replace("30", "11"))
    assert metrics(layout, problem)["flow"] == 1


def test_the_size_of_the_picture_is_that_of_the_page() -> None:
    _, wide = drawn(f"{CHAIN}render: {{size: [1200, 400]}}\n")
    _, high = drawn(f"{CHAIN}render: {{size: [400, 1200]}}\n")
    assert stretched(wide, 3) < 2
    assert stretched(high, 1 / 3) < 2


@pytest.mark.parametrize("size", [(400, 1200), (1200, 400)])
def test_a_picture_is_laid_out_for_the_page_that_is_asked_for(tmp_path: Path, size: tuple[int, int]) -> None:
    """Without a size it is as ever; the direction, where the author says none, is that which fills the page better."""
    names = [f"n{i}" for i in range(8)]
    text = f"neurovis: 1\nname: line\nneurons: {{{': {}, '.join(names)}: {{}}}}\nconnections:\n"
    text += "".join(f"  {a} -> {b}: 1\n" for a, b in pairwise(names))
    long = size[1] > size[0]

    def across(network: nv.CompiledNetwork, size: tuple[int, int] | None = None) -> list[float]:
        """How far discs are apart to the side and down."""
        network.render(tmp_path / "x.svg", step=0, size=size)
        found = re.findall(r'<circle[^>]* cx="([^"]*)" cy="([^"]*)"', (tmp_path / "x.svg").read_text())
        wide, high = np.ptp(np.array(found[-len(names) :], float), axis=0)
        return [float(wide), float(high)]

    network = nv.compile_text(text)
    wide, high = across(network, size)
    assert (high > 400 and not wide) if long else (wide > 400 and not high)
    for spec, page in (
        (text, None),
        (f"{text}layout: {{direction: down}}\n", size),
        (f"{text}layout: {{arrange: {{n0: column}}}}\n", size),
    ):
        assert not across(nv.compile_text(spec), page)[0]
    written = nv.compile_text(f"{text}render: {{size: [{size[0]}, {size[1]}]}}\n")
    assert across(written) == [wide, high]
    # what remembers it keeps it, on any page
    made = written.layout()
    assert made.metrics()["flow"] == 1
    assert parse(made.dump(), "x.layout", Findings()) == made.value
    assert network.layout(earlier=made.value).positions == made.positions
    new = nv.compile_text(f"{text}  n7 -> m: 1\n".replace("n7: {}", "n7: {}, m: {}")).layout(earlier=made.value)
    (x, y), (mx, my) = (new.positions[name] for name in ("n7", "m"))
    assert (my > y and mx == x) if long else (mx > x and my == y)


def test_neurons_in_no_instance_and_no_group_run_one_way_unless_a_page_is_asked_for() -> None:
    """A group that is cut is followed by its name."""
    names = [f"n{i}" for i in range(30)]
    arrows = "".join(f"  {a} -> {b}: 1\n" for a, b in pairwise(names))
    problem, layout = drawn(
        f"neurovis: 1\nname: line\nneurons: {{{', '.join(f'{name}: {{}}' for name in names)}}}\nconnections:\n{arrows}"
    )
    assert metrics(layout, problem)["flow"] == 1
    assert len({x for x, _ in layout.positions.values()}) == 1
    _, cut = drawn(CHAIN)
    across, down = (np.ptp([point[axis] for point in cut.positions.values()]) + 1 for axis in (0, 1))
    assert max(across, down) <= 2.5 * min(across, down)


def test_pins_keep_ranks_uncut() -> None:
    problem, layout = drawn(f"{LINE}layout: {{positions: {{a1: [0, 0]}}}}\n")
    assert metrics(layout, problem)["flow"] == 1


def test_a_box_is_not_cut() -> None:
    _, layout = drawn(f"{LINE}layout: {{boxes: {{middle: [a10..a14]}}}}\n")
    assert len({layout.positions[f"a{i}"][0] for i in range(10, 15)}) == 1
    assert stretched(layout) < 2


WIDE = (
    "neurovis: 1\nname: wide\nmodules:\n"
    "  leg: {neurons: {s: {}, a: {count: 9}, m: {}}, connections: {s -> a: 1, a -> m: 1}}\n"
    "neurons: {C: {}}\ninstances: {left: {module: leg, count: 3}, right: {module: leg, count: 3}}\n"
    "connections: {C -> left.s: 1, C -> right.s: 1}\nlayout: {mirror: [[left, right]]}\n"
)
RING = (
    "neurovis: 1\nname: ring\nmodules: {m: {neurons: {E: {}, F: {}}, connections: {E -> F: -1, F -> E: -1}}}\n"
    "instances: {c: {module: m, count: 16}}\nneurons: {O: {count: 16}}\nconnections: {"
    + ", ".join(f"c{i}.F -> c{i % 16 + 1}.E: 1, c{i}.E -> O{i}: 1" for i in range(1, 17))
    + "}\n"
)


def test_instances_of_one_row_that_is_too_wide_stand_in_rows() -> None:
    problem, layout = drawn(WIDE)
    assert stretched(layout) < 2
    assert metrics(layout, problem)["flow"] == 1
    axis = 2 * layout.positions["C"][0]
    rows = [layout.positions[f"left{leg}.s"][1] for leg in (1, 2, 3)]
    assert rows == sorted(rows)
    assert len(set(rows)) > 1
    for name, (x, y) in layout.positions.items():
        if name.startswith("left"):
            assert layout.positions[name.replace("left", "right")] == (axis - x, y)


def test_a_line_holds_instances_in_one_row() -> None:
    _, layout = drawn(WIDE.replace("right]]", "right]], align: [[left1.s, left2.s, left3.s]]"))
    assert len({layout.positions[f"{side}{leg}.s"][1] for side in ("left", "right") for leg in (1, 2, 3)}) == 1


def test_rows_are_numbered_from_the_first_on() -> None:
    _, layout = drawn(RING)
    assert stretched(layout) < 2
    heights = [layout.positions[f"c{i}.E"][1] for i in range(1, 17)]
    assert heights == sorted(heights)
