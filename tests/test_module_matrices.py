"""Matrices of modules, which instances set."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_specs import HEAD, answer, compiled, network_of

import neurovis_spec as nv

INNER = """neurovis: 1
modules:
  inner:
    matrices: {W: {file: w.csv}}
    neurons: {A: {count: 2, bias: 1}, B: {count: 2}}
    connections: {A -> B: {matrix: W}}
"""
SPEC = """include: [sub/inner.yaml]
parameters: {g: 2}
modules:
  leg:
    parameters: {h: 3}
    matrices: {W: {file: w.csv}, D: [[h - 2, 1], [1, 2]]}
    neurons: {A: {count: 2, bias: 1}, B: {count: 2}}
    instances: {x: {module: inner, set: {W: W}}, y: {module: inner}}
    connections: {A -> B: {matrix: W, delay: {matrix: D}}}
instances:
  a: {module: leg}
  b: {module: leg, set: {W: [[g, ~], [i*10, j]], h: 4}}
  c: {module: leg, set: {W: {file: v.csv}}}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "inner.yaml").write_text(INNER)
    (tmp_path / "sub" / "w.csv").write_text("0,0\n0,9\n")
    (tmp_path / "w.csv").write_text("1,2\n3,4\n")
    (tmp_path / "v.csv").write_text("5,6\n7,8\n")
    return tmp_path


def test_instances_have_the_matrices_that_they_set(folder: Path) -> None:
    made = compiled(SPEC, folder)
    network = made.network
    found: dict[str, list[float]] = {}
    rows = zip(network.connection_names, network.connections.weights.tolist(), strict=True)
    for name, weight in rows:
        found.setdefault(name.split(".A")[0], []).append(weight)
    own, others = [1, 2, 3, 4], [0, 0, 0, 9]
    assert found == {
        **{"a": own, "a.x": own, "a.y": others},
        **{"b": [2, 10, 1], "b.x": [2, 10, 1], "b.y": others},
        **{"c": [5, 6, 7, 8], "c.x": [5, 6, 7, 8], "c.y": others},
    }
    delays = dict(zip(network.connection_names, network.connections.delays.tolist(), strict=True))
    assert (delays["a.A1 -> a.B1"], delays["b.A1 -> b.B1"], delays["a.A2 -> a.B2"]) == (1, 2, 2)
    assert network.structural == {"g"}
    assert {one.code for one in made.warnings} == set()
    assert nv.compile_text(made.text()).hash == network.hash


def test_a_matrix_is_the_same_by_its_name_as_where_it_is_used() -> None:
    text = "modules:\n  m: {%sneurons: {A: {count: 2}, B: {}}, connections: {A -> B: {matrix: %s}}}\n"
    text += "parameters: {g: 2}\ninstances: {m: {module: m%s}}"
    plain = network_of(text % ("", "[[2], [3]]", ""))
    assert network_of(text % ("matrices: {W: [[2], [3]]}, ", "W", "")).hash == plain.hash
    assert network_of(text % ("matrices: {W: [[9], [9]]}, ", "W", ", set: {W: [[g], [1 + g]]}")).hash == plain.hash
    # formulas of a matrix that is written in the module follow its parameters in a run
    following = compiled(text % ("parameters: {q: 1}, matrices: {W: [[q], [3]]}, ", "W", ", set: {q: g}"))
    assert following.hash == plain.hash
    simulator = following.simulator()
    simulator.set(g=5)
    simulator.step()
    assert simulator.connection_weights.tolist() == [5, 3]


@pytest.mark.parametrize(
    ("old", "new", "code", "place", "message"),
    [
        ("[[g, ~], [i*10, j]]", "[[1, 2, 3], [3, 4, 5]]", "wrong-size", "[[1, 2, 3]", "2 × 3, 2 × 2 is wanted"),
        ("[[g, ~], [i*10, j]]", "[[q, 2], [1, 1]]", "unknown-name", "q, 2]", "'q'"),
        ("[[g, ~], [i*10, j]]", "[[1, 2], [3]]", "ragged-matrix", "[3]]", "this row has 1 cell"),
        ("file: v.csv", "file: vv.csv", "file-missing", "vv.csv", "'vv.csv'"),
        ("{W: {file: v.csv}}", "{W: 3}", "wrong-type", "3}}", "'W' of the module 'leg' is a matrix"),
        ("{W: {file: v.csv}}", "{h: {file: v.csv}}", "wrong-type", "{file: v", "'h' of the module 'leg' is a number"),
        ("{W: {file: v.csv}}", "{V: {file: v.csv}}", "unknown-parameter", "V: {", "no parameter 'V'"),
        ("set: {W: W}", "set: {W: Wz}", "wrong-type", "Wz}", "is a matrix"),
        ("{matrix: W, d", "{matrix: Wz, d", "unknown-matrix", "Wz, d", "there is no matrix 'Wz'"),
        ("{matrix: D}", "{matrix: E}", "unknown-matrix", "E}", "there is no matrix 'E'"),
        ("matrices: {W", "matrices: {h: [[1]], W", "duplicate-name", "h: [[1", "a parameter of this module"),
        ("matrices: {W", "matrices: {V: {file: none.csv}, W", "file-missing", "none.csv", "'none.csv'"),
        ("matrices: {W", "matrices: {V: [[1], [q]], W", "unknown-name", "q]], W", "'q'"),
        ("{W: {file: w.csv}, D", "{W: {file: none.csv}, D", "file-missing", "none.csv", "'none.csv'"),
        ("[[h - 2, 1], [1, 2]]", "7", "wrong-type", "7}", "a list of rows"),
    ],
)
def test_matrices_that_cannot_be(folder: Path, old: str, new: str, code: str, place: str, message: str) -> None:
    text = SPEC.replace(old, new, 1)
    assert text.count(place) == 1
    with pytest.raises(nv.SpecError) as caught:
        compiled(text, folder)
    first = caught.value.diagnostics[0]
    assert first.code == code
    assert message in first.message
    line = (HEAD + text).splitlines()[first.span.line - 1]
    assert line[first.span.column - 1 :].startswith(place)


def test_what_several_instances_set_is_all_checked(folder: Path) -> None:
    text = SPEC.replace("[[g, ~], [i*10, j]]", "[[1, 2], [3]]").replace("v.csv", "vv.csv")
    with pytest.raises(nv.SpecError) as caught:
        compiled(text, folder)
    assert [one.code for one in caught.value.diagnostics] == ["ragged-matrix", "file-missing"]


def test_a_spec_has_no_matrices_of_its_own() -> None:
    code, message, hint = answer("neurons: {A: {}, B: {}}\nconnections: {A -> B: {matrix: W}}")
    assert (code, message) == ("unknown-matrix", "there is no matrix 'W'")
    assert "{file: …}" in hint
