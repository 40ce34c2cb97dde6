from __future__ import annotations

from dataclasses import replace

import layout_conformance as suite
from hypothesis import given
from hypothesis import strategies as st
from networks_by_hand import cpg_rbf

from neurovis_spec.compiler.drawing.drawing_settings import LayoutSettings
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.naming import edge_key, natural_key
from neurovis_spec.layout.problem import NamedProblem, problem_of


def test_numbers_in_names_count_as_numbers() -> None:
    names = ["K10", "K2", "left10.K1", "left2.K1", "K", "a", "_x", "K02", "C1"]
    assert sorted(names, key=natural_key) == ["C1", "K", "K02", "K2", "K10", "_x", "a", "left2.K1", "left10.K1"]


@given(st.lists(st.from_regex(r"[A-Za-z_][A-Za-z0-9_.]{0,6}", fullmatch=True), unique=True))
def test_natural_order_is_total(names: list[str]) -> None:
    assert len({natural_key(name) for name in names}) == len(names)
    backwards = names[::-1]
    assert sorted(names, key=natural_key) == sorted(backwards, key=natural_key)


def test_edges_stand_by_source_target_and_number() -> None:
    names = ["K10 -> O", "K2 -> O (10)", "K2 -> O (2)", "K2 -> O", "K2 -> A", "K -> O"]
    assert sorted(names, key=edge_key) == [
        "K -> O", "K2 -> A", "K2 -> O", "K2 -> O (2)", "K2 -> O (10)", "K10 -> O"
    ]  # fmt: skip


@given(st.lists(st.tuples(*[st.sampled_from(["K", "K2", "K10", "K02", "left2.K1", "left10.K1", "_x"])] * 2)))
def test_edges_of_a_problem_stand_as_their_names_do(pairs: list[tuple[str, str]]) -> None:
    edges = suite.named(pairs)
    problem = NamedProblem("x", sorted({name for pair in pairs for name in pair}), edges=edges).canonical()
    assert [edge.name for edge in problem.edges] == sorted((name for name, *_ in edges), key=edge_key)


def test_a_problem_is_in_canonical_order() -> None:
    problem = NamedProblem(
        "x",
        ["K10", "B", "K2"],
        [("K", ["K2", "K10"]), ("B", ["B"])],
        [("K10 -> B", "K10", "B", 1), ("K2 -> B", "K2", "B", 0)],
        {"K10": (1, 2), "B": (0, 0)},
        boxes=[("b", ["K10"]), ("a", ["B"]), ("b", ["K2"])],
        spacing=(1.5, 3.0),
        exits=["B"],
    ).canonical()
    assert problem.neurons == ("B", "K2", "K10")
    assert [(g.name, g.members) for g in problem.groups] == [("B", (0,)), ("K", (1, 2))]
    assert [(e.name, e.source, e.target, e.delay) for e in problem.edges] == [
        ("K2 -> B", 1, 0, 0),
        ("K10 -> B", 2, 0, 1),
    ]
    assert list(problem.pins.items()) == [(0, (0.0, 0.0)), (2, (1.0, 2.0))]
    assert problem.boxes == (("a", (0,)), ("b", (1, 2)))
    assert (problem.neuron_spacing, problem.rank_spacing, problem.exits) == (1.5, 3.0, (0,))


def test_the_problem_of_a_network_holds_its_structure_and_settings() -> None:
    network = cpg_rbf()
    names = network.neurons.names
    settings = LayoutSettings(
        engine="layered",
        direction="right",
        positions={names.index("O"): (4.0, 1.0)},
        arrange=((tuple(names.index(f"K{i}") for i in range(1, 9)), "arc"),),
        boxes=(("ends", (names.index("O"), names.index("T"))),),
        neuron_spacing=1.25,
    )
    problem = problem_of(replace(network, layout=settings))
    assert problem.neurons == ("C1", "C2", *(f"K{i}" for i in range(1, 9)), "O", "T")
    assert sorted(edge.name for edge in problem.edges) == sorted(network.connection_names)
    delays = {edge.name: edge.delay for edge in problem.edges}
    assert (delays["C1 -> C2"], delays["C1 -> K1"], delays["K8 -> O"]) == (1, 0, 0)
    assert problem.pins == {10: (4.0, 1.0)}
    assert problem.arrange == ((tuple(range(2, 10)), "arc"),)
    assert ("ends", (10, 11)) in problem.boxes
    assert (problem.direction, problem.neuron_spacing, problem.rank_spacing) == ("right", 1.25, 2.0)


def test_a_network_is_laid_out_by_its_own_engine_or_the_one_named() -> None:
    network = replace(cpg_rbf(), layout=LayoutSettings(engine="grid"))
    assert lay_out_problem(problem_of(network), network.layout.engine).engine == "grid"
    layout = lay_out_problem(problem_of(network), "layered")
    assert layout.engine == "layered"
    assert set(layout.positions) == set(network.neurons.names)
    assert set(layout.routes) == set(network.connection_names)
