"""Connections become what §4 of the language says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_specs import HEAD, answer, codes, compiled, network_of, pairs, weights, wires

import neurovis_spec as nv
from neurovis_spec.compiler.values.draws import Stream

AB = """parameters: {a: 2}
neurons: {A: {count: 2}, B: {count: 3}, O: {}, D: {count: 2, combine: distance}}
connections: """


def of(connections: str) -> list[tuple[str, str, float, int]]:
    return wires(network_of(AB + connections))


def made(connections: str) -> list[str]:
    return pairs(AB + connections)


# ---- weights and single ends --------------------------------------------------------------------------------------


def test_a_bare_weight_a_body_and_nothing() -> None:
    assert of("{O -> A1: 0.5}") == [("O", "A1", 0.5, 1)]
    assert of("{O -> A1: a/4}") == [("O", "A1", 0.5, 1)]
    assert of("{O -> A1: {weight: 3, delay: 0}}") == [("O", "A1", 3, 0)]
    assert of("{O -> A1: }") == of("{O -> A1: {}}") == [("O", "A1", 1, 1)]
    assert of("{O->A1: 2}") == [("O", "A1", 2, 1)]


def test_a_single_neuron_connects_to_all_of_the_other() -> None:
    assert made("{O -> B: 1}") == ["O B1", "O B2", "O B3"]
    assert made("{B -> O: 1}") == ["B1 O", "B2 O", "B3 O"]
    assert made("{B2 -> B: 1}") == ["B2 B1", "B2 B3"]
    assert made("{B -> B2: 1}") == ["B1 B2", "B3 B2"]
    assert made("{B2 -> B: {self: true}}") == ["B2 B1", "B2 B2", "B2 B3"]


def test_a_single_neuron_to_itself_is_a_self_loop() -> None:
    assert made("{O -> O: 1}") == ["O O"]
    assert made("{B2 -> B2: 1}") == ["B2 B2"]
    assert codes(AB + "{O -> O: {self: false}}") == ["no-connection"]


def test_several_to_several_say_how() -> None:
    code, message, hint = answer(AB + "{A -> B: 1}")
    assert code == "pattern-missing"
    assert "2 neurons to 3 neurons" in message
    assert "all_to_all" in hint
    assert "one_to_one" in hint


def test_joined_ends() -> None:
    assert made("{O + B2..B3 -> A1: 1}") == ["O A1", "B2 A1", "B3 A1"]
    assert made("{A1 -> B3+O: 1}") == ["A1 B3", "A1 O"]


def test_what_a_weight_sees() -> None:
    text = AB + "{A -> B: {pattern: all_to_all, weight: 100*i + 10*j + n_from/n_to}}"
    assert weights(text) == pytest.approx([2 / 3, 10 + 2 / 3, 20 + 2 / 3, 100 + 2 / 3, 110 + 2 / 3, 120 + 2 / 3])
    assert weights(AB + "{B2..B3 -> O: i}") == [0, 1]  # from 0 within the reference


def test_distance_is_that_of_the_positions() -> None:
    text = "neurons: {A: {position: [0, 3]}, B: {count: 2, position: [[4, 0], [0, 0]]}, C: {}}\nconnections: "
    assert weights(text + "{A -> B: 2*distance}") == [10, 6]
    assert codes(text + "{C -> B: distance}") == ["no-position"]
    assert weights("parameters: {distance_scale: 3}\n" + text + "{C -> B: distance_scale}") == [3, 3]


def test_draws_depend_on_names_alone() -> None:
    one = "{'A -> B': {pattern: all_to_all, weight: 'normal(0, 1)'}, 'A -> O': 'uniform(0, 1)'}"
    other = "{A -> O: 'uniform(0, 1)', A  ->  B: {weight: 'normal(0, 1)', pattern: all_to_all}}"
    assert sorted(of(one)) == sorted(of(other))
    body = "{pattern: all_to_all, weight: 'normal(0, 1)'}"
    renamed = f"{HEAD}neurons: {{A: {{count: 2}}, C: {{count: 3}}}}\nconnections: {{A -> C: {body}}}"
    first = [weight for source, target, weight, _ in of(one) if target != "O"]
    assert not set(nv.compile_text(renamed).network.connections.weights.tolist()).intersection(first)
    twice = "[{A -> O: 'normal(0, 1)'}, {A -> O: 'normal(0, 1)'}]"
    assert len({weight for _, _, weight, _ in of(twice)}) == 4
    reseeded = nv.compile_text(HEAD + AB + one, seed=3).network.connections.weights.whole()
    assert not set(reseeded.tolist()).intersection(first)


# ---- matrices ---------------------------------------------------------------------------------------------------


def test_rows_are_sources() -> None:
    assert of("{A -> B: {matrix: [[1, 2, 3], [4, a*2.5, null]]}}") == [
        ("A1", "B1", 1, 1),
        ("A1", "B2", 2, 1),
        ("A1", "B3", 3, 1),
        ("A2", "B1", 4, 1),
        ("A2", "B2", 5, 1),
    ]
    plain = of("{A -> B: {matrix: [[1, 2, 3], [4, 5, null]]}}")
    assert of("{A -> B: {matrix: [[1, 4], [2, 5], [3, null]], rows: to}}") == plain
    assert of("{A -> B: {matrix: [[1, 2, 3], [4, 5, null]], rows: from}}") == plain


def test_a_null_is_no_connection_and_a_zero_is_one() -> None:
    assert of("{A -> A: {matrix: [[0, null], [null, 0]]}}") == [("A1", "A1", 0, 1), ("A2", "A2", 0, 1)]
    assert codes(AB + "{A -> A: {matrix: [[null, null], [null, null]]}}") == ["no-connection"]


def test_cells_see_source_and_target_also_where_rows_are_targets() -> None:
    plain = AB + "{A -> B: {matrix: [[10*i + j, 10*i + j, 7], [10*i + j, 'normal(0, 1)', n_to]]}}"
    turned = AB + "{A -> B: {matrix: [[10*i + j, 10*i + j], [10*i + j, 'normal(0, 1)'], [7, n_to]], rows: to}}"
    assert weights(plain) == weights(turned)
    assert weights(plain)[:4] == [0, 1, 7, 10]
    assert weights(plain)[4] == Stream(0, "weight", "A -> B").normal(1, 1, 0, 0)


def test_a_shape_that_fits_only_transposed() -> None:
    code, message, hint = answer(AB + "{A -> B: {matrix: [[1, 2], [3, 4], [5, 6]]}}")
    assert code == "transposed"
    assert "3 × 2" in message
    assert "2 × 3" in message
    assert "rows: to" in hint
    assert answer(AB + "{A -> B: {matrix: [[1, 2, 3], [4, 5, 6]], rows: to}}")[0] == "transposed"
    assert answer(AB + "{A -> B: {matrix: [[1, 2, 3]]}}")[0] == "wrong-size"


@pytest.mark.parametrize(
    ("matrix", "found"),
    [
        ("[[1, 2, 3], [4, 5]]", ["ragged-matrix"]),
        ("[]", ["wrong-size"]),
        ("[[], []]", ["wrong-size"]),
        ("[[1, 2, b], [4, b, 6]]", ["unknown-name"]),
        ("[[1, 2, true], [4, 5, [6]]]", ["wrong-type", "wrong-type"]),
        ("[[1, 2, 3], [4, 5, 1/(i - 1)]]", ["not-finite"]),
        ("[1, 2, 3]", ["wrong-type"]),
        ("{file: none.csv}", ["file-missing"]),
        ("{file: ../x.csv}", ["path-outside"]),
        ("{path: x.csv}", ["unknown-key"]),
    ],
)
def test_wrong_matrices(matrix: str, found: list[str]) -> None:
    assert sorted(codes(f"{AB}{{A -> B: {{matrix: {matrix}}}}}")) == sorted(found)


def test_a_finding_in_a_matrix_stands_at_its_cell() -> None:
    line = "connections: {A -> B: {matrix: [[1/(1-i), 2, 3], [4, 1/(1-i), 1/(1-i)]]}}"
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(f"{HEAD}neurons: {{A: {{count: 2}}, B: {{count: 3}}}}\n{line}")
    (item,) = caught.value.diagnostics
    assert (item.span.line, item.span.column) == (4, line.index("4, 1/") + 4)


def test_matrix_files(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text("x,y,z\n1,2,3\n4,,6\n")
    np.save(tmp_path / "m.npy", np.array([[1.0, 2, 3], [4, 5, 6]]))
    csv = wires(network_of(AB + "{A -> B: {matrix: {file: m.csv}}}", tmp_path))
    assert [wire[2] for wire in csv] == [1, 2, 3, 4, 6]
    npy = wires(network_of(AB + "{B -> A: {matrix: {file: m.npy}, rows: to}}", tmp_path))
    assert npy[:3] == [("B1", "A1", 1, 1), ("B1", "A2", 4, 1), ("B2", "A1", 2, 1)]


def test_a_long_matrix_of_formulas_is_the_same_as_one_of_numbers() -> None:
    text = "parameters: {w: 0.25}\nneurons: {A: {count: 90}}\nconnections: {A -> A: {matrix: [%s]}}"
    numbers = ", ".join("[" + ", ".join("null" if (i + j) % 7 else "0.25" for j in range(90)) + "]" for i in range(90))
    assert wires(network_of(text % numbers)) == wires(network_of(text % numbers.replace("0.25", "w")))


# ---- edges ------------------------------------------------------------------------------------------------------


def test_edges() -> None:
    assert of("{A -> B: {edges: [[A1, B3], [A2, B1, a], [A1, B3, 10*i + j, 4], [A1, B1, 1, 0]], delay: 2}}") == [
        ("A1", "B3", 1, 2),
        ("A2", "B1", 2, 2),
        ("A1", "B3", 2, 4),
        ("A1", "B1", 1, 0),
    ]


def test_a_weight_of_null_is_1() -> None:
    assert of("{A -> B: {edges: [[A1, B1, null], [A2, B1, 2], [A1, B2, null, 3]]}}") == [
        ("A1", "B1", 1, 1),
        ("A2", "B1", 2, 1),
        ("A1", "B2", 1, 3),
    ]


def test_equal_edges_are_parallel_connections() -> None:
    network = network_of(AB + "{A -> B: {edges: [[A1, B1, 2], [A1, B1, 2], [A1, B1, 1, 3], [A1, B1, 1]]}}")
    assert wires(network)[0] == wires(network)[1]
    # by delay, rule, weight, then place
    assert network.connection_names == ("A1 -> B1 (2)", "A1 -> B1 (3)", "A1 -> B1 (4)", "A1 -> B1")


def test_edge_files(tmp_path: Path) -> None:
    (tmp_path / "e.csv").write_text("from,to,weight,delay\nA1,B1,0.5,3\nA2,B2,,\nA2,B3,-1,\n")
    (tmp_path / "bad.csv").write_text("from,to,weight\nA1,B1,1\nA1,C1,2\nA1,C1,3\n")
    assert wires(network_of(AB + "{A -> B: {edges: {file: e.csv}}}", tmp_path)) == [
        ("A1", "B1", 0.5, 3),
        ("A2", "B2", 1, 1),
        ("A2", "B3", -1, 1),
    ]
    code, message, hint = answer(AB + "{A -> B: {edges: {file: bad.csv}}}", tmp_path)
    assert code == "edge-outside"
    assert "'C1' (row 3 of the file)" in message
    assert "B1" in hint


@pytest.mark.parametrize(
    ("edges", "found"),
    [
        ("[]", ["wrong-size"]),
        ("[[A1]]", ["wrong-type"]),
        ("[[A1, B1, 1, 1, 1]]", ["wrong-type"]),
        ("[A1, B1]", ["wrong-type"]),
        ("[[A1, 3]]", ["wrong-type"]),
        ("[[A1, O], [A3, B1]]", ["edge-outside", "edge-outside"]),
        ("[[A1, B1, 1, null]]", ["wrong-type"]),
        ("[[null, B1]]", ["wrong-type"]),
        ("[[A1, B1, 1, -1]]", ["out-of-range"]),
        ("[[A1, B1, 1, 0.5]]", ["not-an-integer"]),
        ("[[A1, B1, 1, 1e7]]", ["out-of-range"]),
        ("[[A1, B1, b], [A1, B2, b]]", ["unknown-name"]),
    ],
)
def test_wrong_edges(edges: str, found: list[str]) -> None:
    assert codes(f"{AB}{{A -> B: {{edges: {edges}}}}}") == found


def test_long_lists_of_edges_are_read_like_short_ones() -> None:
    text = "parameters: {w: 0.5}\nneurons: {A: {count: 30}}\nconnections: {A -> A: {edges: [%s]}}"
    edges = [f"[A{i % 30 + 1}, A{i * 7 % 30 + 1}, {'w' if i % 3 else i}, {i % 4 + 1}]" for i in range(200)]
    long = wires(network_of(text % ", ".join(edges)))
    short = [wires(network_of(text % edge))[0] for edge in edges[::17]]
    assert long[::17] == short
    broken = text % ", ".join([*edges, "[A31, A1]", "[A1, A1, q]"])
    assert codes(broken) == ["edge-outside", "unknown-name"]
    many = text % ", ".join(f"[A1, A{i}]" for i in range(31, 331))
    assert len(codes(many)) == 20  # then the author has understood


# ---- patterns -----------------------------------------------------------------------------------------------------


def test_patterns() -> None:
    assert made("{A -> B: {pattern: all_to_all}}") == ["A1 B1", "A1 B2", "A1 B3", "A2 B1", "A2 B2", "A2 B3"]
    assert made("{B -> B: {pattern: all_to_all}}") == ["B1 B2", "B1 B3", "B2 B1", "B2 B3", "B3 B1", "B3 B2"]
    assert len(made("{B -> B: {pattern: all_to_all, self: true}}")) == 9
    assert made("{A -> B2..B3: {pattern: one_to_one}}") == ["A1 B2", "A2 B3"]
    assert made("{B -> B: {pattern: one_to_one}}") == ["B1 B1", "B2 B2", "B3 B3"]
    assert made("{B -> B: {pattern: chain}}") == ["B1 B2", "B2 B3"]
    assert made("{B -> B: {pattern: ring}}") == ["B1 B2", "B2 B3", "B3 B1"]
    assert made("{A -> D: {pattern: chain}}") == ["A1 D2"]
    assert made("{A -> D: {pattern: ring}}") == ["A1 D2", "A2 D1"]


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ("{pattern: one_to_one}", "wrong-size"),
        ("{pattern: chain}", "wrong-size"),
        ("{pattern: ring}", "wrong-size"),
        ("{pattern: al_to_all}", "unknown-pattern"),
        ("{pattern: {all_to_all: {size: 1}}}", "unknown-parameter"),
        ("{pattern: random}", "missing-key"),
        ("{pattern: {random: {probability: 1.5}}}", "out-of-range"),
        ("{pattern: all_to_all, matrix: [[1, 2, 3], [4, 5, 6]]}", "conflicting-keys"),
        ("{weight: 1, matrix: [[1, 2, 3], [4, 5, 6]]}", "conflicting-keys"),
        ("{edges: [[A1, B1]], weight: 1}", "conflicting-keys"),
        ("{edges: [[A1, B1]], self: true}", "useless-key"),
        ("{pattern: all_to_all, rows: to}", "useless-key"),
        ("{pattern: all_to_all, bounds: [0, 1]}", "useless-key"),
        ("{pattern: all_to_all, centre: 1}", "useless-key"),
        ("{pattern: all_to_all, delay: -1}", "out-of-range"),
        ("{pattern: all_to_all, delay: 0.5}", "not-an-integer"),
    ],
)
def test_wrong_bodies(body: str, code: str) -> None:
    assert codes(f"{AB}{{A -> B: {body}}}") == [code]


def test_entries_that_make_no_connection() -> None:
    for entry in ("{O -> O: {self: false}}", "{A1 -> A1: {pattern: chain}}"):
        assert codes(AB + entry) == ["no-connection"]
    assert codes(
        "neurons: {A: {count: 1}, B: {count: 2}}\nconnections: {B -> B: {pattern: one_to_one, self: false}}"
    ) == ["no-connection"]


def test_random_pairs_come_from_the_seed() -> None:
    body = "{pattern: {random: {probability: p}}}"
    text = f"seed: 5\nneurons: {{A: {{count: 20}}, B: {{count: 30}}}}\nconnections: {{A -> B: {body}}}"
    found = pairs("parameters: {p: 0.2}\n" + text)
    i, j = Stream(5, "edges", "A -> B").random_pairs(20, 30, 0.2)
    assert found == [f"A{s + 1} B{t + 1}" for s, t in zip(i.tolist(), j.tolist(), strict=True)]
    assert 60 < len(found) < 180
    assert len(pairs("parameters: {p: 1}\n" + text)) == 600
    assert found != pairs(("parameters: {p: 0.2}\n" + text).replace("seed: 5", "seed: 6"))


def test_random_within_a_group_makes_no_self_loops_unless_allowed() -> None:
    text = "neurons: {A: {count: 12}}\nconnections: {A -> A: {pattern: {random: {probability: 1}}%s}}"
    assert len(pairs(text % "")) == 12 * 11
    assert len(pairs(text % ", self: true")) == 144


# ---- centres, bounds, plasticity ----------------------------------------------------------------------------------


def test_centres(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text("1,2\n3,\n")

    def centres(body: str) -> list[float]:
        found: list[float] = network_of(f"{AB}{{A -> D: {body}}}", tmp_path).connections.centres.tolist()
        return found

    assert centres("{pattern: all_to_all, centre: a}") == [2, 2, 2, 2]
    assert centres("{pattern: all_to_all, centre: 10*i + j}") == [0, 1, 10, 11]
    assert centres("{centre: [[1, null], [3, a]]}") == [1, 3, 2]
    assert centres("{centre: {file: c.csv}}") == [1, 2, 3]
    assert centres("{centre: [[1, 3], [2, null]], rows: to}") == [1, 2, 3]
    assert centres("{matrix: [[1, null], [1, 1]], centre: [[5, 6], [null, 8]]}") == [5, 8]
    assert centres("{edges: [[A1, D2, 3], [A2, D2]], centre: 0.5}") == [0.5, 0.5]
    assert centres("{pattern: all_to_all}") == [0, 0, 0, 0]
    assert codes(AB + "{A -> D: {matrix: [[1, 1], [1, 1]], centre: [[1, 2, 3]]}}") == ["wrong-size"]
    assert codes(AB + "{A -> D: {pattern: all_to_all, centre: [[1, 2], [3, 4]]}}") == ["conflicting-keys"]
    assert codes(AB + "{A -> D: {edges: [[A1, D1]], centre: [[1, 2], [3, 4]]}}") == ["conflicting-keys"]


def test_bounds() -> None:
    def bounds(body: str) -> list[tuple[float, float]]:
        connections = network_of(f"{AB}{{O -> A: {body}}}").connections
        return list(zip(connections.low.tolist(), connections.high.tolist(), strict=True))

    assert bounds("{plasticity: hebbian, bounds: [-a, a]}") == [(-2, 2)] * 2
    assert bounds("{plasticity: hebbian}") == [(-np.inf, np.inf)] * 2
    for wrong, code in (("[2, 1]", "out-of-range"), ("[2, 3]", "weight-outside"), ("[1]", "wrong-type")):
        assert codes(f"{AB}{{O -> A: {{plasticity: hebbian, bounds: {wrong}}}}}") == [code]


def test_signals_of_rules() -> None:
    text = (
        "inputs: {s: {}, v: {size: 3}}\nneurons: {O: {}, A: {count: 2}, T: {count: 2}, U: {count: 4}}\n"
        "connections: {O -> A: {plasticity: {delta: {rate: [1, 2], target: %s}}}}"
    )

    def signal(target: str) -> list[int]:
        (rule,) = network_of(text % target).projections
        assert rule.rule.parameters["rate"].tolist() == [1, 2]
        found: list[int] = rule.signals["target"].tolist()
        return found

    assert signal("O") == [0, 0]
    assert signal("T") == [3, 4]  # of the targets' size: one each
    assert signal("T2") == [4, 4]
    assert signal("U2..U3") == [6, 7]
    assert signal("s") == [9, 9]  # inputs stand behind the activities
    assert signal("[U2, U4]") == [6, 8]  # a list is taken together
    assert signal("[s, O]") == [9, 0]
    assert signal("[T]") == [3, 4]
    assert codes(text % "U") == ["wrong-size"]
    assert codes(text % "v") == ["wrong-size"]
    assert codes(text % "[T, O]") == ["wrong-size"]
    assert codes(text % "[]") == ["wrong-type"]
    assert codes(text % "[T1, 3]") == ["wrong-type"]
    assert codes(text % "[T1, Z1]") == ["unknown-signal"]
    assert codes(text % "[Y1, Z1]") == ["unknown-signal"] * 2
    assert codes(text % "Z") == ["unknown-signal"]
    assert codes(text % "3") == ["wrong-type"]
    assert codes(text.replace(", target: %s", "")) == ["missing-signal"]


def test_a_list_as_a_signal_is_named_where_the_rule_is_shown() -> None:
    text = "neurons: {O: {}, A: {count: %d}, T: {count: 9}}\nconnections: {O -> A: {plasticity: {delta: {target: %s}}}}"
    assert network_of(text % (2, "[T1, T2]")).connections.learns == ("delta(rate=0.01, target=[T1, T2])",)
    (learns,) = network_of(text % (4, "[T1, T2, T3, T4]")).connections.learns
    assert learns == "delta(rate=0.01, target=[T1, T2, T3, …])"
    code, message, _ = answer(text % (4, "[T1, T2]"))
    assert (code, message) == (
        "wrong-size",
        "the signal 'target' has 2 components; 1 or 4, one for each target, are wanted",
    )


def rates(rate: str, pattern: str = "all_to_all") -> list[float]:
    """The rates of the connections from three neurons to two, in order."""
    text = "neurons: {A: {count: 3, bias: 1}, B: {count: 2, bias: 1}}\n"
    body = f"{{pattern: {pattern}, plasticity: {{hebbian: {{rate: {rate}}}}}}}"
    (rule,) = network_of(f"{text}connections: {{A -> B: {body}}}").projections
    return list(rule.rule.parameters["rate"])


def test_parameters_of_rules_know_the_ends_of_a_connection() -> None:
    assert rates("i") == [0, 0, 1, 1, 2, 2]
    assert rates("j") == [0, 1, 0, 1, 0, 1]
    assert rates("n_from + n_to / 10") == [3.2] * 6
    assert rates("10*i + j", "{band: {width: 0}}") == [0, 11]
    assert rates("[1, 2*i, j, 4, 5, i]") == [1, 0, 0, 4, 5, 2]  # in the order of the connections


def test_parameters_of_rules_that_do_not_fit() -> None:
    with pytest.raises(nv.SpecError) as caught:
        rates("[1, 2, 3]")
    (finding,) = caught.value.diagnostics
    assert (finding.code, finding.message) == ("wrong-size", "'rate' has 3 values for 6 connections")
    with pytest.raises(nv.SpecError) as caught:
        rates("1/n")
    (finding,) = caught.value.diagnostics
    assert finding.code == "unknown-name"
    known = "how many neurons the group, or numbers the input, has; a connection has n_from and n_to"
    assert finding.hint == f"'n' is known elsewhere: {known}"


def test_parameters_of_the_rule_of_an_entry_at_fault_are_looked_at() -> None:
    text = "neurons: {A: {count: 3, bias: 1}, B: {count: 2, bias: 1}}\n"
    body = "{pattern: one_to_one, plasticity: {hebbian: {rate: %s}}}"
    assert codes(f"{text}connections: {{A -> B: {body % 'i + j/n_to'}}}") == ["wrong-size"]
    assert codes(f"{text}connections: {{A -> B: {body % 'i/n'}}}") == ["wrong-size", "unknown-name"]


def test_entries_of_the_same_ends() -> None:
    network = network_of("neurons: {A: {}, B: {}}\nconnections: [{A -> B: 2}, {A->B: 1}, {B -> A: 0}]")
    assert network.connections.entries == ("A -> B", "A -> B (2)", "B -> A")
    assert network.connection_names == ("A -> B (2)", "A -> B", "B -> A")
    assert codes("neurons: {A: {}, B: {}}\nconnections: {A -> B: 2, A->B: 1}") == ["duplicate-key"]


def test_cycles_within_a_step() -> None:
    code, message, _ = answer(
        "neurons: {A: {}, B: {}, C: {}}\nconnections: {A -> B: {delay: 0}, B -> C: {delay: 0}, C -> A: {delay: 0}}"
    )
    assert code == "delay-0-cycle"
    path = message.split(": ")[1].split(" -> ")
    assert path[0] == path[-1]
    assert sorted(path[1:]) == ["A", "B", "C"]
    assert codes("neurons: {A: {}}\nconnections: {A -> A: {delay: 0}}") == ["delay-0-cycle"]
    # of single neurons, not of groups
    assert len(pairs("neurons: {A: {count: 3}}\nconnections: {A -> A: {pattern: chain, delay: 0}}")) == 2


# ---- limits -----------------------------------------------------------------------------------------------------


def test_the_limit_counts_all_entries_and_can_be_set() -> None:
    text = "neurons: {A: {count: 3}, O: {}}\nconnections: {A -> A: {pattern: all_to_all}, A -> O: 1}"
    assert len(nv.compile_text(HEAD + text, limit=9).network.connections) == 9
    assert codes(text, limit=8) == ["too-many"]
    edges = "neurons: {A: {}}\nconnections: {A -> A: {edges: [[A, A], [A, A]]}}"
    assert codes(edges, limit=1) == ["too-many"]
    matrix = "neurons: {A: {count: 2}}\nconnections: {A -> A: {matrix: [[1, null], [1, null]]}}"
    assert len(nv.compile_text(HEAD + matrix, limit=2).network.connections) == 2


def test_too_many_neurons_and_signals() -> None:
    assert codes("neurons: {A: {count: 2000000}}") == ["too-many"]
    assert codes("neurons: {A: {count: 600000}, B: {count: 600000}}") == ["too-many"]
    assert len(nv.compile_text(HEAD + "neurons: {A: {count: 1000001}}", limit=20_000_000).network.neurons) == 1_000_001
    assert codes("neurons: {A: {}}\nconnections: {A -> A: {delay: 1000001}}") == ["out-of-range"]
    text = "neurons: {A: {count: 600}}\nconnections: {A -> A: {pattern: all_to_all, delay: 1000}}"
    assert codes(text) == ["too-many"]


def test_the_compiled_network_says_its_size() -> None:
    text = "neurons: {A: {count: 2}}\nconnections: {A1 -> A2: {plasticity: hebbian}}"
    assert repr(compiled(text)) == "<network x: 2 neurons, 1 connection, 1 plastic>"
