"""What tables call neurons, where that is no name of the language."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_specs import answer, compiled, network_of, wires

import neurovis_spec as nv

CELLS = "id,bias\nAVA-L,0.1\nAVA-R,0.2\n12a,0.3\n"
EDGES = "Source,Target,N\nAVA-L,AVA-R,1\n12a,AVA-L,2\nC2,AVA-L,3\n"
TEXT = """neurons: {C: {count: 3, ids: {file: c.csv, column: id}, bias: {file: c.csv, by: id, column: bias}}}
connections: {C -> C: {edges: {file: e.csv, columns: {from: Source, to: Target, weight: N}}}}
"""
WIRES = [("C1", "C2", 1.0, 1), ("C3", "C1", 2.0, 1), ("C2", "C1", 3.0, 1)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "c.csv").write_text(CELLS)
    (tmp_path / "e.csv").write_text(EDGES)
    return tmp_path


def test_edges_and_rows_are_found_by_ids(folder: Path) -> None:
    network = compiled(TEXT, folder)
    assert wires(network.network) == WIRES
    assert network.network.neurons.bias.tolist() == [0.1, 0.2, 0.3]
    assert nv.compile_text(network.text()).hash == network.hash
    listed = TEXT.replace("{file: c.csv, column: id}", "[AVA-L, AVA-R, 12a]")
    assert network_of(listed, folder).hash == network.hash
    # those of several groups, and of edges that stand in the spec
    both = "neurons: {A: {count: 2, ids: [x-1, x-2]}, B: {ids: y z}}\n"
    both += "connections: {A + B -> A + B: {edges: [[x-2, y z, 0.5], [B, x-1, 1]]}}"
    assert wires(network_of(both)) == [("A2", "B", 0.5, 1), ("B", "A1", 1.0, 1)]


def test_a_name_goes_before_an_id(folder: Path) -> None:
    (folder / "e.csv").write_text("Source,Target,N\nC1,C2,1\n")
    ids = TEXT.replace("{file: c.csv, column: id}", "[C2, AVA-R, 12a]").replace(
        "bias: {file: c.csv, by: id, column: bias}", "bias: 1"
    )
    assert wires(network_of(ids, folder)) == [("C1", "C2", 1.0, 1)]


@pytest.mark.parametrize(
    ("old", "new", "code", "message", "hint"),
    [
        ("{file: c.csv, column: id}", "[AVA-L, AVA-R]", "wrong-size", "'ids' has 2 texts for 3 neurons", ""),
        (
            "{file: c.csv, column: id}",
            "[AVA-L, AVA-R, AVA-L]",
            "duplicate-name",
            "the id of 'C1' and of 'C3'",
            "its own",
        ),
        ("{file: c.csv, column: id}", "[AVA-L, AVA-R, 12b]", "file-format", "no row of the table is of 'C3'", ""),
    ],
)
def test_ids_that_do_not_do(folder: Path, old: str, new: str, code: str, message: str, hint: str) -> None:
    with pytest.raises(nv.SpecError) as caught:
        compiled(TEXT.replace(old, new), folder)
    found, *more = caught.value.diagnostics
    assert not more or code == "file-format"  # nothing of rows and edges that go by what is invalid
    assert found.code == code
    assert message in found.message
    assert hint in (found.hint or "")


def test_ends_that_no_id_or_several_are_of(folder: Path) -> None:
    (folder / "e.csv").write_text(EDGES.replace("12a,AVA-L", "12a,AVA-l"))
    code, message, hint = answer(TEXT, folder)
    assert code == "edge-outside"
    assert "'AVA-l' (row 3 of the file)" in message
    assert "AVA-L" in hint
    twice = "neurons: {A: {ids: [u-1]}, B: {ids: [u-1]}, O: {}}\nconnections: {A + B -> O: {edges: [[u-1, O]]}}"
    assert answer(twice)[1] == "'u-1' is the id of 2 sources of this entry"
