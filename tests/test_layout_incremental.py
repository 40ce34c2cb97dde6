"""Memory (§10, ``file``): what an earlier layout placed stays there, what is new finds a free place, alike where it is
drawn alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path

import layout_conformance as suite
import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st
from laws import examples
from neurovis_layouts.alike import Alike
from neurovis_layouts.occupancy import Occupancy, Wish, lone

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.diagnostics import Findings
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.file import dump, parse
from neurovis_spec.layout.geometry import distance, sampled
from neurovis_spec.layout.metrics import metrics
from neurovis_spec.layout.model import Layout, LayoutProblem, Point
from neurovis_spec.layout.problem import NamedProblem, problem_of

ENGINES = ("layered", "organic", "circular", "grid")
LEG = """
neurovis: 1
name: legs
modules:
  leg:
    neurons: {S: {bias: 1}, K: {count: 3}EXTRA}
    connections: {S -> K: 1, K -> S: 0.2INNER}
instances: {left: {module: leg, count: COUNT}, right: {module: leg, count: COUNT}}
neurons: {C: {count: 2, bias: 0.1}, M: {}NEW}
connections:
  C -> C: {pattern: all_to_all}
  C1 -> left.S: 1
  C2 -> right.S: 1
  left.K + right.K -> M: 0.5
  MORE
MIRROR
"""


@cache
def legs(
    count: int = 2, extra: str = "", inner: str = "", new: str = "", more: str = "C1 -> M: 0.1", mirror: str = ""
) -> nv.CompiledNetwork:
    text = LEG
    for key, value in (("COUNT", str(count)), ("EXTRA", extra), ("INNER", inner), ("NEW", new), ("MORE", more)):
        text = text.replace(key, value)
    return nv.compile_text(text.replace("MIRROR", mirror))


@cache
def laid_out(network: nv.CompiledNetwork, engine: str = "layered") -> Layout:
    """The layout of a network that was not drawn before."""
    return network.layout(engine).value


def after(earlier: nv.CompiledNetwork, later: nv.CompiledNetwork, engine: str = "layered") -> tuple[Layout, Layout]:
    before = laid_out(earlier, engine)
    return before, later.layout(engine, earlier=before).value


ROW = """\
neurovis: 1
name: row
modules:
  col: {neurons: {a: {bias: 1}, b: {}, c: {}}, connections: {a -> b: 1, b -> c: 1, c -> a: 0.3}}
instances: {x: {module: col, count: 3}}
neurons: {O: {}, I: {count: 3, bias: 1}, H: {count: COUNT}NEW}
connections: {I -> H: {pattern: all_to_all, weight: 1}, H -> x1.a: 1, x1.c -> x2.a: 1, x2.c -> O: 1, x3.c -> O: 1MORE}
layout: {direction: DIRECTION}
"""


@pytest.mark.parametrize("direction", ["down", "right"])
@pytest.mark.parametrize(("new", "more"), [("", ""), (", N: {}", ", N -> O: 1, I2 -> N: 1")])
def test_new_members_go_on_with_the_row_of_their_group(direction: str, new: str, more: str) -> None:
    text = ROW.replace("DIRECTION", direction)
    spec = text.replace("NEW", "").replace("MORE", "").replace("COUNT", "5")
    grown = text.replace("NEW", new).replace("MORE", more).replace("COUNT", "7")
    before, now = after(nv.compile_text(spec), nv.compile_text(grown))
    at = now.positions
    assert all(at[name] == point for name, point in before.positions.items())
    dx, dy = at["H5"][0] - at["H4"][0], at["H5"][1] - at["H4"][1]
    assert at["H6"] == (at["H5"][0] + dx, at["H5"][1] + dy)
    assert at["H7"] == (at["H6"][0] + dx, at["H6"][1] + dy)


@pytest.mark.parametrize(("lost", "back"), [("H3", (2.0, 2.0)), ("H1", (0.0, 2.0))])
def test_a_new_member_fills_the_gap_in_the_row_of_its_group(lost: str, back: Point) -> None:
    network = nv.compile_text(
        ROW.replace("NEW", "").replace("MORE", "").replace("COUNT", "5").replace("DIRECTION", "down")
    )
    before = network.layout().value
    assert before.positions[lost] == back
    gap = replace(before, positions={name: point for name, point in before.positions.items() if name != lost})
    assert network.layout(earlier=gap).value.positions == before.positions


def apart(layout: Layout) -> bool:
    return all(distance(a, b) >= 0.6 for a, b in combinations(layout.positions.values(), 2))


@pytest.mark.parametrize("engine", ENGINES)
def test_the_same_network_gives_the_same_file(engine: str) -> None:
    before, now = after(legs(), legs(), engine)
    assert now == before


@pytest.mark.parametrize("engine", ENGINES)
def test_a_new_connection_moves_nobody_and_reroutes_nothing_else(engine: str) -> None:
    before, now = after(legs(), legs(more="M -> C1: 0.1"), engine)
    assert now.positions == before.positions
    shared = [name for name in before.routes if name in now.routes]
    assert len(shared) == len(before.routes) - 1
    assert all(now.routes[name] == before.routes[name] for name in shared)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_new_neuron_finds_a_free_place_near_its_neighbour(engine: str) -> None:
    before, now = after(legs(), legs(new=", N: {}", more="M -> N: 1"), engine)
    assert all(now.positions[name] == point for name, point in before.positions.items())
    assert apart(now)
    assert distance(now.positions["N"], now.positions["M"]) < 4.5


def test_what_is_gone_leaves_the_rest_where_it_was() -> None:
    before, now = after(legs(count=3), legs(count=2))
    assert set(now.positions) < set(before.positions)
    assert all(before.positions[name] == point for name, point in now.positions.items())


def test_a_new_instance_is_drawn_like_the_others_and_its_frame_is_its_own() -> None:
    before, now = after(legs(count=1), legs(count=2))
    assert all(now.positions[name] == point for name, point in before.positions.items())
    assert apart(now)
    for path in ("left", "right"):
        own = {name: point for name, point in now.positions.items() if name.startswith(f"{path}2.")}
        frame = (*map(min, zip(*own.values(), strict=True)), *map(max, zip(*own.values(), strict=True)))
        for name, (x, y) in now.positions.items():
            assert name in own or not (frame[0] < x < frame[2] and frame[1] < y < frame[3]), name
        assert relative(now.positions, f"{path}2") in (
            relative(now.positions, "left1"),
            relative(now.positions, "right1"),
            {name: (-x, y) for name, (x, y) in relative(now.positions, "left1").items()},
        )


HEXAPOD = """
neurovis: 1
name: hexapod
modules:
  joint:
    neurons: {A: {bias: 1}, B: {}}
    connections: {A -> B: 1, B -> A: -1, A -> A: 0.5}
  leg:
    INSIDE
instances: {left: {module: leg, count: COUNT}, right: {module: leg, count: COUNT}}
neurons: {C: {count: 2}}
connections:
  C1 -> left.FIRST: 1
  C2 -> right.FIRST: 1
  C1 -> C2: -1
  C2 -> C1: -1
  left1.M -> left2.FIRST: 1
  right1.M -> right2.FIRST: 1
layout: {mirror: [[left, right], [C1, C2]], direction: DIRECTION}
"""
CHAIN = "{neurons: {S: {bias: 1}, K: {}, M: {}}, connections: {S -> K: 1, K -> M: 1, M -> S: 0.2, K -> K: 0.5}}"
NESTED = """{instances: {u: {module: joint, count: 2}}, neurons: {M: {}},
      connections: {u1.B -> u2.A: 1, u2.B -> M: 1, u1.B -> M: 1}}"""


@cache
def hexapod(count: int, inside: str = CHAIN, direction: str = "down", first: str = "S") -> nv.CompiledNetwork:
    text = HEXAPOD.replace("  leg:\n    INSIDE", f"  leg: {inside}")
    for key, value in (("COUNT", str(count)), ("DIRECTION", direction), ("FIRST", first)):
        text = text.replace(key, value)
    return nv.compile_text(text)


def in_order(network: nv.CompiledNetwork, layout: Layout) -> None:
    problem = problem_of(network.network)
    assert not suite.frames_meet(layout, problem)
    assert suite.through_frames(layout, problem) == []
    measured = metrics(layout, problem)
    assert (measured["edges_over_neurons"], measured["overlaps"], measured["symmetry"]) == (0, 0, 1)


@pytest.mark.parametrize(
    ("inside", "first", "direction"),
    [
        *((CHAIN, "S", direction) for direction in ("down", "right", "up", "left")),
        *((NESTED, "u1.A", direction) for direction in ("down", "left")),
    ],
)
def test_legs_grow_from_two_to_five_a_side_in_frames_of_their_own(inside: str, first: str, direction: str) -> None:
    before = laid_out(hexapod(2, inside, direction, first))
    across = 0 if direction in ("down", "up") else 1
    for count in (3, 4, 5):
        network = hexapod(count, inside, direction, first)
        now = network.layout("layered", earlier=before).value
        assert all(now.positions[name] == point for name, point in before.positions.items())
        in_order(network, now)
        sides = {name[:4]: now.positions[name][across] for name in now.positions if name.endswith(".M")}
        middle = (now.positions["C1"][across] + now.positions["C2"][across]) / 2
        assert all(
            (point[across] < middle) == ((sides["left"] < middle) == name.startswith("left"))
            for name, point in now.positions.items()
            if name.endswith(".M")
        )
        before = now


def test_what_narrow_legs_get_new_is_mirrored_too() -> None:
    """All of a leg stands in one column, so that only the mirror tells which way it is turned."""
    column = "{neurons: {S: {bias: 1}, KNEW: {}, M: {}}, connections: {S -> M: 1MORE}}"
    earlier = hexapod(2, column.replace("KNEW: {}, ", "").replace("MORE", ""))
    before = laid_out(earlier)
    network = hexapod(2, column.replace("KNEW", "K").replace("MORE", ", S -> K: 1"))
    now = network.layout("layered", earlier=before).value
    assert all(now.positions[name] == point for name, point in before.positions.items())
    in_order(network, now)
    assert network.layout("layered", earlier=now).positions == now.positions


def test_legs_grow_from_one_to_five_in_frames_of_their_own() -> None:
    before: Layout | None = None
    for count in range(1, 6):
        network = legs(count, inner=", K1 -> K1: 0.5")
        now = network.layout("layered", earlier=before).value
        for name, point in ({} if before is None else before.positions).items():
            assert now.positions[name] == point
        in_order(network, now)
        before = now


def test_a_new_neuron_beside_instances_stands_in_no_frame() -> None:
    network = legs(new=", N: {count: 4}", more="M -> N: 1\n  left1.K1 -> N1: 0.1")
    in_order(network, after(legs(), network)[1])


def test_new_connections_and_boxes_keep_off_each_other() -> None:
    text = """
neurovis: 1
name: boxes
neurons: {A: {count: SIZE, bias: 0.1}, B: {count: SIZE}, O: {}, P: {count: SIZE}}
connections:
  A -> B: {weight: 0.5, pattern: one_to_one}
  B -> O: 1
  O -> P: 1
  MORE
layout: {boxes: {a: [A], b: [B]}}
"""
    before = nv.compile_text(text.replace("SIZE", "3").replace("MORE", "")).layout("layered").value
    network = nv.compile_text(text.replace("SIZE", "5").replace("MORE", "P1 -> A3: 1\n  O -> A2: 0.1"))
    now = network.layout("layered", earlier=before).value
    assert all(now.positions[name] == point for name, point in before.positions.items())
    problem = problem_of(network.network)
    assert not suite.frames_meet(now, problem)
    assert suite.through_frames(now, problem) == []


@pytest.mark.parametrize("moved", ["left2.S", "right1.K", "right3.M"])
def test_the_template_goes_before_a_place_edited_by_hand(moved: str) -> None:
    network = hexapod(3)
    before = laid_out(network)
    x, y = before.positions[moved]
    edited = replace(before, positions={**before.positions, moved: (x - 0.5, y + 9)})
    now = network.layout("layered", earlier=edited).value
    assert now.positions == before.positions
    in_order(network, now)


def moved_by_hand(layout: Layout, paths: tuple[str, ...], by: Point) -> Layout:
    """The layout file with these instances, or neurons, put elsewhere, its routes as they were."""
    there = dict(layout.positions)
    for name, (x, y) in layout.positions.items():
        if name.startswith(tuple(f"{path}." for path in paths)) or name in paths:
            there[name] = x + by[0], y + by[1]
    return replace(layout, positions=there)


@pytest.mark.parametrize("path", ["left1", "right2", "C2"])
def test_what_was_moved_by_hand_stays_and_its_image_follows(path: str) -> None:
    network = hexapod(3)
    before = laid_out(network)
    by = (0.25, -1.5) if path == "C2" else (1.5, 40)
    edited = moved_by_hand(before, (path,), by)
    now = network.layout("layered", earlier=edited).value
    own = {name for name in before.positions if name == path or name.startswith(f"{path}.")}
    images = {b if a in own else a for a, b in images_of(network) if a in own or b in own}
    assert all(now.positions[name] == edited.positions[name] for name in own)
    across = -by[0], by[1]
    for name in images:
        (x, y), (a, b) = before.positions[name], now.positions[name]
        assert (a - x, b - y) == across
    assert all(now.positions[name] == before.positions[name] for name in now.positions.keys() - own - images)
    assert metrics(now, problem_of(network.network))["symmetry"] == 1
    assert network.layout("layered", earlier=now).positions == now.positions


def images_of(network: nv.CompiledNetwork) -> list[tuple[str, str]]:
    problem = problem_of(network.network)
    return [(problem.neurons[a], problem.neurons[b]) for mirror in problem.mirrors for a, b in mirror.pairs]


@pytest.mark.parametrize("by", [(0.5, 0.25), (-1, 1), (1.5, -2)])
def test_the_rest_gives_way_to_what_was_moved_by_hand(by: Point) -> None:
    network = legs()
    before = laid_out(network)
    (x, y), (a, b) = before.positions["left1.S"], before.positions["right2.S"]
    edited = moved_by_hand(before, ("left1",), (a - x + by[0], b - y + by[1]))
    drawn = network.layout("layered", earlier=edited)
    for name, point in edited.positions.items():
        if name.startswith(("left1.", "left2.", "right1.")):
            assert drawn.positions[name] == point
    assert apart(drawn.value)
    assert not suite.frames_meet(drawn.value, problem_of(network.network))
    assert drawn.warnings == ()


def test_two_moved_on_to_each_other_by_hand_stay_and_are_warned_of(tmp_path: Path) -> None:
    spec, file = tmp_path / "legs.yaml", tmp_path / "legs.layout.yaml"
    text = legs().sources["<text>"]
    before = laid_out(legs())
    (x, y), (a, b) = before.positions["left1.S"], before.positions["left2.S"]
    edited = moved_by_hand(before, ("left1",), (0, 40))
    edited = moved_by_hand(edited, ("left2",), (x - a + 3.25, y - b + 40))
    spec.write_text(f"{text}layout: {{file: {file.name}}}\n", encoding="utf-8")
    file.write_text(dump(edited), encoding="utf-8")
    drawn = nv.compile(spec).layout("layered")
    assert drawn.positions == edited.positions
    (warning,) = drawn.warnings
    assert warning.message == "the frames of 'left1' and 'left2' lie on each other"
    line = spec.read_text(encoding="utf-8").split("\n")[warning.span.line - 1]
    assert line[warning.span.column - 1 : warning.span.end_column - 1] == file.name


def test_a_route_goes_round_what_was_moved_on_to_it_by_hand() -> None:
    text = "neurovis: 1\nname: fork\nneurons: {N: {count: 3, bias: 1}}\nconnections: {N3 -> N1: 1, N3 -> N2: 1}\n"
    network = nv.compile_text(text)
    before = laid_out(network)
    (x, y), (a, b) = before.positions["N3"], before.positions["N2"]
    edited = replace(before, positions={**before.positions, "N1": ((x + a) / 2, (y + b) / 2)})
    now = network.layout("layered", earlier=edited).value
    assert now.positions == edited.positions
    assert metrics(now, problem_of(network.network))["edges_over_neurons"] == 0


def test_an_instance_moved_on_to_its_own_image_finds_a_place_beside_it() -> None:
    network = hexapod(2)
    before = laid_out(network)
    (x, _), (a, _) = before.positions["left1.S"], before.positions["right1.S"]
    now = network.layout("layered", earlier=moved_by_hand(before, ("left1",), ((a - x) / 2, 0))).value
    assert apart(now)
    assert metrics(now, problem_of(network.network))["symmetry"] == 1


def test_what_follows_a_place_edited_by_hand_follows_the_first() -> None:
    network = hexapod(3)
    before = laid_out(network)
    x, y = before.positions["left1.M"]
    edited = replace(before, positions={**before.positions, "left1.M": (x - 0.25, y + 0.25)})
    now = network.layout("layered", earlier=edited).value
    assert now.positions["left1.M"] == (x - 0.25, y + 0.25)
    assert relative(now.positions, "left1") == relative(now.positions, "left2") == relative(now.positions, "left3")
    in_order(network, now)
    assert network.layout("layered", earlier=now).positions == now.positions


def relative(positions: Mapping[str, Point], path: str) -> dict[str, Point]:
    x, y = positions[f"{path}.S"]
    return {name[len(path) :]: (a - x, b - y) for name, (a, b) in positions.items() if name.startswith(f"{path}.")}


def test_a_new_neuron_of_a_module_stands_alike_in_all_instances() -> None:
    """The instances are drawn alike by hand; a neuron that the module gets new stands alike in them as well."""
    earlier, later = legs(), legs(extra=", X: {}", inner=", K1 -> X: 1")
    leg = {"S": (0.0, 0.0), "K1": (-1.0, 2.0), "K2": (0.0, 2.0), "K3": (1.0, 2.0)}
    flips = {"left1": (0.0, 1.0), "left2": (4.0, 1.0), "right1": (12.0, -1.0), "right2": (8.0, -1.0)}
    positions = {
        f"{path}.{name}": (x0 + flip * x, 4 + y) for path, (x0, flip) in flips.items() for name, (x, y) in leg.items()
    }
    positions |= {"C1": (5.0, 0.0), "C2": (7.0, 0.0), "M": (6.0, 9.0)}
    before = Layout("legs", "layered", positions, {})
    now = later.layout("layered", earlier=before).value
    assert earlier.layout("layered", earlier=before).positions == positions
    assert all(now.positions[name] == point for name, point in positions.items())
    first = now.positions["left1.X"]
    for path, (x0, flip) in flips.items():
        assert now.positions[f"{path}.X"] == (x0 + flip * first[0], first[1])
    assert apart(now)
    one = now.routes["left1.K1 -> left1.X"]
    for path, (x0, flip) in flips.items():
        assert now.routes[f"{path}.K1 -> {path}.X"] == tuple((x0 + flip * x, y) for x, y in one)


def test_new_neurons_of_a_mirrored_pair_are_mirror_images() -> None:
    groups = "neurovis: 1\nname: x\nneurons: {A: {count: N, bias: 1}, B: {count: N, bias: 1}, C: {}}\n"
    text = f"{groups}connections: {{A -> C: 1, B -> C: 1}}\nlayout: {{mirror: [[A, B]]}}"
    later = nv.compile_text(text.replace("N", "3"))
    before = Layout("x", "layered", {"A1": (0, 0), "A2": (1, 0), "B1": (6, 0), "B2": (5, 0), "C": (3, 2)}, {})
    now = later.layout("layered", earlier=before).value
    (ax, ay), (bx, by) = now.positions["A3"], now.positions["B3"]
    assert (ax + bx, ay) == (6, by)
    assert apart(now)


def test_a_pin_goes_before_memory() -> None:
    text = "neurovis: 1\nname: x\nneurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: 1}\n"
    before = Layout("x", "layered", {"A": (0.0, 0.0), "B": (0.0, 2.0)}, {})
    pinned = nv.compile_text(text + "layout: {positions: {B: [5.3, 7]}}")
    assert pinned.layout(earlier=before).positions == {"A": (0.0, 0.0), "B": (5.3, 7.0)}
    on_top = nv.compile_text(text + "layout: {positions: {B: [0.1, 0]}}")
    now = on_top.layout(earlier=before).value
    assert now.positions["B"] == (0.1, 0.0)
    assert apart(now)


@st.composite
def _edits(draw: st.DrawFn) -> tuple[LayoutProblem, LayoutProblem]:
    """A small network, and the same with a few neurons and connections more or less."""
    size = draw(st.integers(1, 12))
    names = [f"N{i}" for i in range(size)]
    pairs = draw(st.sets(st.tuples(st.sampled_from(names), st.sampled_from(names)), max_size=20))
    gone = draw(st.sets(st.sampled_from(names), max_size=2))
    new = [f"M{i}" for i in range(draw(st.integers(0, 3)))]
    more = draw(st.sets(st.tuples(st.sampled_from(names + new), st.sampled_from(names + new)), max_size=6))
    left = [name for name in names if name not in gone] + new
    kept = [(a, b) for a, b in sorted(pairs | more) if a in left and b in left]
    return (
        NamedProblem("x", names, edges=[(f"{a} -> {b}", a, b, 1) for a, b in sorted(pairs)]).canonical(),
        NamedProblem("x", left or ["Z"], edges=[(f"{a} -> {b}", a, b, 1) for a, b in kept]).canonical(),
    )


@given(_edits(), st.sampled_from(ENGINES))
@examples(12)
def test_who_was_there_stays_and_nobody_overlaps(edit: tuple[LayoutProblem, LayoutProblem], engine: str) -> None:
    earlier, later = edit
    before = lay_out_problem(earlier, engine)
    now = lay_out_problem(replace(later, memory=before), engine)
    assert all(now.positions[name] == before.positions[name] for name in now.positions if name in before.positions)
    assert apart(now)
    assert now == lay_out_problem(replace(later, memory=before), engine)


def run(*words: str | Path) -> Result:
    return CliRunner().invoke(neurovis, list(map(str, words)))


SPEC = "neurovis: 1\nname: x\nneurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: 1}\nlayout: {file: x.layout.yaml}\n"


def test_update_makes_the_file_keeps_it_and_takes_in_what_is_new(tmp_path: Path) -> None:
    spec, lock = tmp_path / "x.yaml", tmp_path / "x.layout.yaml"
    spec.write_text(SPEC)
    first = run("layout", spec, "--update", lock)
    assert first.exit_code == 0
    assert "0 neurons where they were, 2 new" in first.stdout
    assert first.stderr == f"1 warning: neurovis validate {spec}\n"  # that the file is missing
    text = lock.read_text()
    again = run("layout", spec, "--update", lock)
    assert "2 neurons where they were, 0 new" in again.stdout
    assert again.stderr == ""
    assert lock.read_text() == text
    spec.write_text(SPEC.replace("B: {}", "B: {}, D: {}").replace("A -> B: 1", "A -> B: 1, A -> D: 1"))
    third = run("layout", spec, "--update", lock)
    assert "2 neurons where they were, 1 new" in third.stdout
    old, new = text.splitlines(), lock.read_text().splitlines()
    assert [line for line in old if line not in new] == []
    assert len(new) == len(old) + 2


def test_a_spec_is_drawn_as_its_file_says(tmp_path: Path) -> None:
    spec = tmp_path / "x.yaml"
    spec.write_text(SPEC)
    (tmp_path / "x.layout.yaml").write_text("neurovis_layout: 1\npositions: {A: [3, 1], B: [7, -2]}\n")
    network = nv.compile(spec)
    assert network.layout().positions == {"A": (3.0, 1.0), "B": (7.0, -2.0)}
    assert network.warnings == ()


def test_names_that_are_gone_are_a_warning_and_update_takes_them_out(tmp_path: Path) -> None:
    spec, lock = tmp_path / "x.yaml", tmp_path / "x.layout.yaml"
    spec.write_text(SPEC)
    lock.write_text("neurovis_layout: 1\npositions: {A: [3, 1], B: [7, -2], Z: [0, 0]}\n")
    (warning,) = nv.compile(spec).warnings
    assert (warning.code, warning.span.line, warning.span.column) == ("forgotten-neuron", 5, 16)
    assert "1 gone" in run("layout", spec, "--update", lock).stdout
    findings = Findings()
    kept = parse(lock.read_text(), "x", findings)
    assert kept is not None
    assert kept.positions == {"A": (3.0, 1.0), "B": (7.0, -2.0)}
    assert nv.compile(spec).warnings == ()


def test_a_file_that_is_no_layout_is_the_inputs_fault_and_is_left_alone(tmp_path: Path) -> None:
    spec, lock = tmp_path / "x.yaml", tmp_path / "x.layout.yaml"
    spec.write_text(SPEC)
    lock.write_text("neurovis_layout: 1\npositions: {A: [3]}\n")
    with pytest.raises(nv.SpecError) as caught:
        nv.compile(spec)
    (finding,) = caught.value.diagnostics
    assert (Path(finding.span.file).name, finding.span.line, finding.span.column) == ("x.layout.yaml", 2, 16)
    spec.write_text(SPEC.replace("layout: {file: x.layout.yaml}", ""))
    done = run("layout", spec, "--update", lock)
    assert done.exit_code == 1
    assert lock.read_text() == "neurovis_layout: 1\npositions: {A: [3]}\n"


def test_update_and_output_exclude_each_other(tmp_path: Path) -> None:
    spec = tmp_path / "x.yaml"
    spec.write_text(SPEC)
    assert run("layout", spec, "--update", tmp_path / "a", "-o", tmp_path / "b").exit_code == 2


@pytest.mark.parametrize("engine", ["layered", "circular", "grid", "organic"])
@pytest.mark.parametrize("count", [3, 12])
def test_what_a_file_edited_by_hand_puts_on_each_other_gives_way(engine: str, count: int) -> None:
    text = (
        f"neurovis: 1\nname: heap\nneurons: {{A: {{bias: 1, count: {count}}}}}\n"
        f"connections: {{A -> A: {{pattern: chain}}, A1 -> A3: 1, A3 -> A1: 1}}\nlayout: {{engine: {engine}}}\n"
    )
    network = nv.compile_text(text)
    fresh = network.layout().value
    heap = replace(fresh, positions=dict.fromkeys(fresh.positions, (2.0, 2.0)), routes={})
    laid = network.layout(earlier=heap)
    assert laid.metrics()["overlaps"] == 0
    assert laid.value.positions["A1"] == (2.0, 2.0)


def test_a_new_neuron_stands_off_the_lines_that_are_drawn() -> None:
    text = """
neurovis: 1
name: lines
modules: {leg: {neurons: {s: {}, u: {}, v: {}}, connections: {s -> u: 1, u -> v: 1}}}
instances: {l: {module: leg}, r: {module: leg}}
neurons: {A: {bias: 1}, O: {}MORE}
connections:
  A -> l.s + r.s + O: 1
  l.v -> O: 1
  r.v -> O: 1
  LINKED
layout: {mirror: [[l, r]]}
"""
    before = nv.compile_text(text.replace("MORE", "").replace("LINKED", "")).layout("layered").value
    network = nv.compile_text(text.replace("MORE", ", Z: {}").replace("LINKED", "Z -> O: 1"))
    now = network.layout("layered", earlier=before).value
    assert now.positions.items() >= before.positions.items()
    assert {name: route for name, route in now.routes.items() if name in before.routes} == before.routes
    z = now.positions["Z"]
    assert all(distance(z, point) >= 0.45 for route in before.routes.values() for point in sampled(route))


def test_copies_that_would_stand_on_each_other_anywhere_each_find_a_place() -> None:
    occupancy = Occupancy(placed={0: (0.0, 0.0)})
    assert occupancy.put(Wish((lone(1), lone(2)), (0.0, 0.0)))
    assert all(distance(a, b) >= 0.6 for a, b in combinations(occupancy.placed.values(), 2))


def test_new_mirror_images_of_what_is_known_stand_where_they_are_reflected() -> None:
    network = legs(mirror="layout: {mirror: [[C1, C2], [left, right]]}")
    problem, before = problem_of(network.network), laid_out(network)
    left = {name: point for name, point in before.positions.items() if not name.startswith("right")}
    earlier = replace(before, positions={**left, "C2": (left["C2"][0] + 3.0, left["C2"][1])}, routes={})
    now = lay_out_problem(replace(problem, memory=earlier), "layered")
    at = [now.positions[name] for name in problem.neurons]
    assert len({at[a][0] + at[b][0] for mirror in problem.mirrors for a, b in mirror.pairs}) == 1
    assert all(now.positions[name] == point for name, point in earlier.positions.items())


@pytest.mark.parametrize("engine", ["layered", "grid", "circular"])
def test_instances_that_are_drawn_around_their_pins_stay_so(engine: str) -> None:
    """They are not made alike again: they were drawn otherwise because of their pins."""
    pins = "left1.K1: [0, 0], left1.K3: [4, 3], right1.K1: [10, 0], right1.K3: [9, 5]"
    network = legs(mirror=f"layout: {{positions: {{{pins}}}}}")
    first = network.layout(engine).value
    assert network.layout(engine, earlier=first).value == first


def test_an_instance_that_something_was_put_on_gives_way_as_a_whole() -> None:
    network = legs(mirror="layout: {mirror: [[left, right]]}")
    problem, before = problem_of(network.network), laid_out(network)
    earlier = replace(before, positions={**before.positions, "M": before.positions["left1.K2"]}, routes={})
    now = lay_out_problem(replace(problem, memory=earlier), "layered")
    assert apart(now)
    for leg in ("left1", "right1"):
        own = [name for name in problem.neurons if name.startswith(leg)]
        way = {tuple(now.positions[name][k] - before.positions[name][k] for k in (0, 1)) for name in own}
        assert len(way) == 1
    assert lay_out_problem(replace(problem, memory=now), "layered").positions == now.positions


TURNED = """\
neurovis: 1
name: turned
modules:
  joint: {neurons: {F: {bias: 1}, E: {bias: 1}}, connections: {F -> E: -1, E -> F: -1}, layout: {mirror: [[F, E]]}}
  leg:
    instances: {hip: {module: joint}, knee: {module: joint}}
    neurons: {foot: {bias: 1}EXTRA}
    connections: {hip.F -> knee.E: 1, hip.E -> knee.F: 1, foot -> hip.E: 1INNER}
instances: {A: {module: leg}, B: {module: leg}}
connections: {A.hip.F -> B.hip.F: 1}
layout: {DIRECTIONplan: PLAN}
"""


@pytest.mark.parametrize("direction", ["", "direction: right, "])
@pytest.mark.parametrize("plan", ["[[A], [B]]", "[[A, B]]"])
def test_what_a_plan_turns_keeps_the_mirror_images_within_it(plan: str, direction: str) -> None:
    """The axis of an instance is as its pairs stand, not along the direction of the page."""
    text = TURNED.replace("PLAN", plan).replace("DIRECTION", direction)
    earlier = nv.compile_text(text.replace("EXTRA", "").replace("INNER", ""))
    later = nv.compile_text(text.replace("EXTRA", ", skin: {bias: 1}").replace("INNER", ", skin -> foot: 1"))
    before, now = after(earlier, later)
    assert now.positions.items() >= before.positions.items()
    assert apart(now)
    assert metrics(now, problem_of(later.network))["symmetry"] == 1
    steps = {
        tuple(abs(a - b) for a, b in zip(now.positions[f"{leg}.skin"], now.positions[f"{leg}.foot"], strict=True))
        for leg in "AB"
    }
    assert len(steps) == 1
    assert later.layout("layered", earlier=now).positions == now.positions


SIDES = """\
neurovis: 1
name: sides
modules: {u: {neurons: {O: {}, L: {}, C: {}, M: {}EXTRA}, connections: {O -> L + C + M: 1, L -> C: -1}}}
instances: {l: {module: u, count: 2}, r: {module: u, count: 2}}
neurons: {D: {bias: 1}}
connections:
  l1.C -> l2.O: 1
  r1.C -> r2.O: 1
  l2.C -> r1.O: -1
  r2.C -> l1.O: -1
  D -> l1.O + l2.O + r1.O + r2.O: 1
layout: {direction: DIRECTION, mirror: [[l, r]]}
"""


@pytest.mark.parametrize("direction", ["left", "right", "down"])
def test_routes_beside_frames_that_have_grown_are_mirror_images(direction: str) -> None:
    """Their titles are on top on both sides of an axis that runs across the page: what is clear of one may not be clear
    of the other."""
    text = SIDES.replace("DIRECTION", direction)
    later = nv.compile_text(text.replace("EXTRA", ", Z: {bias: 1}"))
    _, now = after(nv.compile_text(text.replace("EXTRA", "")), later)
    problem = problem_of(later.network)
    suite.check_mirror(now, problem)
    assert not suite.through_frames(now, problem)
    assert later.layout("layered", earlier=now).value == now


@pytest.mark.parametrize("direction", ["left", "down"])
@pytest.mark.parametrize("by", [-2.0, 0.5])
def test_routes_from_a_neuron_moved_along_the_axis_are_mirror_images(by: float, direction: str) -> None:
    network = nv.compile_text(SIDES.replace("DIRECTION", direction).replace("EXTRA", ""))
    before = laid_out(network)
    (x, y), problem = before.positions["D"], problem_of(network.network)
    moved = (x + by, y) if suite.across(problem) else (x, y + by)
    now = network.layout("layered", earlier=replace(before, positions={**before.positions, "D": moved})).value
    assert now.positions == {**before.positions, "D": moved}
    suite.check_mirror(now, problem)
    suite.check_routes(problem, now)


def test_a_neuron_is_drawn_like_its_images_about_the_axis_of_its_instance_and_about_that_of_the_whole() -> None:
    """Two neurons above each other do not show whether their instance is reflected: their images do."""
    joint = "{neurons: {F: {}, E: {}}, layout: {mirror: [[F, E]]}}"
    text = (
        f"neurovis: 1\nname: x\nmodules: {{joint: {joint}}}\ninstances: {{A: {{module: joint}}, B: {{module: joint}}}}"
    )
    problem = problem_of(nv.compile_text(text + "\nlayout: {mirror: [[A, B]], plan: [[A, B]]}").network)
    at = {"A.E": (0.0, 1.0), "A.F": (0.0, 0.0), "B.E": (5.0, 1.0), "B.F": (5.0, 0.0)}
    alike = Alike(problem, dict(enumerate(at.values())))
    assert problem.neurons == tuple(at)
    flips = {problem.neurons[mate]: move.flip for mate, move in alike.of(problem.neurons.index("A.F"))}
    assert flips == {"A.F": (1.0, 1.0), "A.E": (1.0, -1.0), "B.F": (-1.0, 1.0), "B.E": (-1.0, -1.0)}
