"""Files in other people's shape: edges with their own columns, rows that count, units, what separates cells."""

from __future__ import annotations

import csv
import io
import re
import sys
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pandas
import pytest
from data_attempts import HERE, fault, table
from hypothesis import given
from hypothesis import strategies as st
from lsp_marks import marked
from small_specs import HEAD, answer, codes, compiled, network_of, wires

import neurovis_spec as nv
from neurovis_spec.cli.overview import overview
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.data import sheet
from neurovis_spec.language.data.cells import separator_of
from neurovis_spec.language.data.edge_list import parse_edges
from neurovis_spec.language.located import Located
from neurovis_spec.language.tables import Condition, EdgeFile, FileReference
from neurovis_spec.language.yaml.source import Scalar
from neurovis_spec.lsp.completion import complete

#: As a connectome is given away: a row a pair of cells, both kinds of connections together.
WORM = "Source\tTarget\tType\tN\tdelay_ms\tE_rev\nAVAL\tAVAR\tchemical\t3\t1\t0\nAVAR\tAVBL\telectrical\t1\t\t\n"
WORM += "AVAL\tAVBL\tchemical\t2\t2.5\t-70\nAVBL\tAVAL\tchemical\t\t1\t\n"
CELLS = "time: {dt: 0.5 ms}\nneurons: {C: {names: [AVAL, AVAR, AVBL]}}\n"


def parameters(network: Network) -> dict[str, list[float]]:
    """Those of its synapses and rules, one number a connection."""
    uses = [use for projection in network.projections for use in projection.uses]
    return {name: values.tolist() for use in uses for name, values in use.parameters.items()}


def located(text: str) -> Located[str]:
    return Located(text, Scalar(text, HERE))


def test_edges_by_the_columns_of_others(tmp_path: Path) -> None:
    (tmp_path / "worm.tsv").write_text(WORM)
    columns = "columns: {from: Source, to: Target, weight: N, delay: {column: delay_ms, unit: ms}}"
    text = f"{CELLS}connections: {{C -> C: {{edges: {{file: worm.tsv, {columns}, where: {{Type: chemical}}}}}}}}"
    assert wires(network_of(text, tmp_path)) == [
        ("AVAL", "AVAR", 3.0, 2),
        ("AVAL", "AVBL", 2.0, 5),
        ("AVBL", "AVAL", 1.0, 2),
    ]
    several = text.replace("Type: chemical", "Type: [chemical, electrical], N: 1")
    assert wires(network_of(several, tmp_path)) == [("AVAR", "AVBL", 1.0, 1)]
    nothing = text.replace("Type: chemical", "N: null")
    assert wires(network_of(nothing, tmp_path)) == [("AVBL", "AVAL", 1.0, 2)]


def test_further_columns_are_values_of_synapses_and_rules(tmp_path: Path) -> None:
    (tmp_path / "worm.tsv").write_text(WORM)
    edges = "edges: {file: worm.tsv, columns: {from: Source, to: Target}, where: {Type: chemical}}"
    synapse = "synapses: {push: {parameters: {E: 0}, signal: weight*(E - post)}}"
    body = "{%s, synapse: {push: {E: {column: E_rev, default: -7}}}, plasticity: {decay: {rate: {column: N}}}}"
    text = f"{CELLS}{synapse}\nconnections: {{C -> C: {body % edges}}}"
    code, message, hint = answer(text, tmp_path)
    assert (code, message) == ("file-format", "row 5, column 4 of the file is empty")
    assert "default" in hint
    text = text.replace("column: N}", "column: N, default: 0.5}")
    network = compiled(text, tmp_path)
    assert parameters(network.network) == {"E": [0, -70, -7], "rate": [3, 2, 0.5]}
    again = nv.compile_text(network.text())
    assert again.hash == network.hash


@pytest.mark.parametrize(
    ("edges", "code", "message", "hint"),
    [
        ("columns: {from: Sorce, to: Target}", "file-format", "no column 'Sorce'", "did you mean 'Source'?"),
        ("columns: {to: Target}", "file-format", "no column 'from'", "write columns: {from: NAME}"),
        ("columns: {source: Source, to: Target}", "unknown-key", "unknown key 'source'", "did you mean 'from'?"),
        ("columns: {from: Source, to: Target, delay: delay_ms}", "file-format", "row 4, column 5: '2.5' is no delay",
         "of times, write delay: {column: NAME, unit: ms}"),
        ("columns: {from: Source, to: Target}, where: {Type: chemcal}", "file-format",
         "no row has 'chemcal' in the column 'Type'", "did you mean 'chemical'?"),
        ("columns: {from: Source, to: Target}, where: {Tpe: chemical}", "file-format", "no column 'Tpe'", "'Type'?"),
        ("columns: {from: Source, to: Target}, where: {}", "wrong-type", "expected columns", "write where"),
        ("columns: {from: Source, to: Target}, where: {Type: []}", "wrong-type", "expected a value", ""),
        ("columns: [from, to]", "wrong-type", "expected the names of columns", "write columns"),
        ("columns: {from: Source, to: Target, delay: {unit: ms}}", "wrong-type", "the column of the delays", "write"),
        ("columns: {from: Source, to: Target, delay: {column: N, unit: mV}}", "unknown-value", "'mV'", ""),
    ],
)  # fmt: skip
def test_columns_that_are_none(tmp_path: Path, edges: str, code: str, message: str, hint: str) -> None:
    (tmp_path / "worm.tsv").write_text(WORM)
    found = answer(f"{CELLS}connections: {{C -> C: {{edges: {{file: worm.tsv, {edges}}}}}}}", tmp_path)
    assert found[0] == code
    assert message in found[1]
    assert hint in found[2]


def test_a_finding_stands_at_the_name_of_the_column(tmp_path: Path) -> None:
    (tmp_path / "worm.tsv").write_text(WORM)
    text = f"{HEAD}{CELLS}connections:\n  C -> C: {{edges: {{file: worm.tsv, columns: {{from: Src, to: Target}}}}}}\n"
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(text, folder=tmp_path)
    (finding,) = caught.value.diagnostics
    line = text.splitlines()[finding.span.line - 1]
    assert line[finding.span.column - 1 : finding.span.end_column - 1] == "Src"


def test_what_is_no_column_of_edges(tmp_path: Path) -> None:
    group = "neurons: {A: {count: 2}, B: {}}\nconnections: {A -> B: {%splasticity: {decay: {rate: %s}}}}"
    assert codes(group % ("", "{column: r}")) == ["useless-key"]
    assert codes(group % ("", "{file: r.csv, column: r}")) == ["wrong-type"]
    (tmp_path / "e.csv").write_text("from,to,r\nA1,B,0.5\nA2,B,\n")
    edges = "edges: {file: e.csv}, "
    assert codes(group % (edges, "{column: q}"), tmp_path) == ["file-format"]
    assert codes(group % (edges, "{column: r, default: 2*3}"), tmp_path) == ["wrong-type"]
    network = network_of(group % (edges, "{column: r, default: 2}"), tmp_path)
    assert parameters(network) == {"rate": [0.5, 2]}


@pytest.mark.parametrize(
    ("name", "text", "noun"),
    [
        ("a.csv", "a,b\n1,2\n", "commas"),
        ("a.csv", "a;b\n0,5;1,2\n", "semicolons"),
        ("a.csv", "a, b\tc\nx,y\tz\nu\tv\n", "tabs"),
        ("a.tsv", "a,b\tc,d\n1,2\t3,4\n", "tabs"),
        ("a.txt", "a  b\n1\t 2\n", "blanks"),
        ("a.csv", "my column\n1\n2\n", "commas"),
        ("a.csv", '"a b";"c, d"\n1;2\n', "semicolons"),
        ("a.csv", "a\n1\n", "commas"),
        ("a.csv", "a,b\n1\n", "commas"),
    ],
)
def test_what_separates_cells_is_found_by_looking(name: str, text: str, noun: str) -> None:
    assert separator_of([text.encode()], name).noun == noun


@pytest.mark.parametrize(
    ("name", "text"),
    [("a.tsv", "a\tb\n1\t2\n\t-4e1\n"), ("a.txt", "a;b\n1;2\n;-4e1\n"), ("a.dat", "1, 2\n, -4e1\n")],
)
def test_tables_of_numbers_between_something_else(name: str, text: str, tmp_path: Path) -> None:
    got = table(tmp_path, name, text)
    np.testing.assert_array_equal(got.values, [[1, 2], [np.nan, -40]])
    (tmp_path / "b.txt").write_text(" 1   2\n 3   4 \n")
    matrix = "neurons: {A: {count: 2, bias: 1}, B: {count: 2}}\nconnections: {A -> B: {matrix: {file: b.txt}}}"
    assert [one[2] for one in wires(network_of(matrix, tmp_path))] == [1, 2, 3, 4]
    told = fault(tmp_path, "c.txt", "1;2\n3;4,5\n")
    assert "row 2 has a comma, and semicolons separate its cells" in told.message
    assert told.hint == "numbers have a decimal point"
    assert "row 2, column 2: 'x' is no number" in fault(tmp_path, "d.txt", "1 2\n3  x\n").message
    assert "the file is empty" in fault(tmp_path, "e.txt", "").message


@given(
    st.lists(st.tuples(*(st.sampled_from(["K1", "K2", "a longer name than eight", "é"]),) * 2,
                       st.sampled_from(["1", "-2.5e-3", "0"]), st.sampled_from("xyz")), min_size=1),
    st.sampled_from([",", "\t", ";"]), st.sampled_from(["\n", "\r\n"]), st.booleans(),
)  # fmt: skip
def test_what_separates_does_not_show(rows: list[tuple[str, ...]], by: str, end: str, quoted: bool) -> None:
    lines = [("to", "from", "weight", "kind"), *rows]
    text = end.join(by.join(f'"{cell}"' if quoted else cell for cell in line) for line in lines)
    where = Condition(located("kind"), (Scalar("x", HERE),))
    wanted = EdgeFile(FileReference(located("e.csv"), None, HERE), where=(where,))
    keep = [row for row in rows if row[3] == "x"]
    if not keep:
        return
    got = parse_edges([text.encode()], None, wanted)
    assert got.fault is None
    assert got.sources == tuple(row[1] for row in keep)
    assert got.targets == tuple(row[0] for row in keep)
    np.testing.assert_array_equal(got.weights, [float(row[2]) for row in keep])
    assert [*map(got.row, range(len(got)))] == [k for k, row in enumerate(rows, 2) if row[3] == "x"]


def test_inspect_says_what_was_found_by_looking(tmp_path: Path) -> None:
    (tmp_path / "worm.tsv").write_text(WORM)
    (tmp_path / "own.csv").write_text("from,to\nAVAL,AVAR\n")
    edges = "{file: worm.tsv, columns: {from: Source, to: Target}, where: {Type: chemical}}"
    text = f"{CELLS}connections:\n  - C -> C: {{edges: {edges}}}\n  - C -> C: {{edges: {{file: own.csv}}}}\n"
    files = compiled(text, tmp_path).files
    assert {path.name: about for path, about in files.items()} == {
        "own.csv": "",
        "worm.tsv": "separated by tabs, 3 of 4 rows",
    }
    assert "files\n  worm.tsv  separated by tabs, 3 of 4 rows" in overview(compiled(text, tmp_path))


#: A row a neuron, as it comes out of a spreadsheet; not in the order of the neurons, and with others among them.
SHEET = """\
cell;x;y;leak;start;offset;what
K2;1;0;0.5;;-1;two
K1;0;0;0.25;0.1;-2;one
other;9;9;9;9;9;else
"""


def test_settings_from_a_table(tmp_path: Path) -> None:
    (tmp_path / "cells.csv").write_text(SHEET)
    by = "file: cells.csv, by: cell"
    text = (
        f"neurons: {{K: {{count: 2, model: {{leaky_integrator: {{leak: {{{by}, column: leak}}}}}}, "
        f"bias: {{{by}, column: offset}}, initial: {{v: {{{by}, column: start, default: 7}}}}, "
        f"activation: {{gaussian: {{sigma: {{{by}, column: leak}}}}}}, position: {{{by}, columns: [x, y]}}}}}}"
    )
    network = compiled(text, tmp_path)
    neurons = network.network.neurons
    assert neurons.groups[0].model_parameters == {"leak": (0.25, 0.5)}
    assert neurons.groups[0].activation_parameters == {"sigma": (0.25, 0.5)}
    assert neurons.bias.tolist() == [-2, -1]
    assert neurons.position.tolist() == [[0, 0], [1, 0]]
    assert nv.compile_text(network.text()).hash == network.hash
    by_hand = "model: {leaky_integrator: {leak: [0.25, 0.5]}}, bias: [-2, -1], initial: {v: [0.1, 7]}, "
    by_hand += "activation: {gaussian: {sigma: [0.25, 0.5]}}, position: [[0, 0], [1, 0]]"
    assert compiled(f"neurons: {{K: {{count: 2, {by_hand}}}}}").hash == network.hash


def test_rows_are_in_the_order_of_the_neurons_where_nothing_else_is_said(tmp_path: Path) -> None:
    (tmp_path / "cells.txt").write_text("kind value\nbig   1\nsmall 2\nbig   3\n")
    column = "file: cells.txt, column: value"
    assert network_of(f"neurons: {{K: {{count: 3, bias: {{{column}}}}}}}", tmp_path).neurons.bias.tolist() == [1, 2, 3]
    some = f"neurons: {{K: {{count: 2, bias: {{{column}, where: {{kind: big}}}}}}}}"
    assert network_of(some, tmp_path).neurons.bias.tolist() == [1, 3]
    code, message, hint = answer(f"neurons: {{K: {{count: 2, bias: {{{column}}}}}}}", tmp_path)
    assert (code, message) == ("wrong-size", "the table has 3 rows, and there are 2 neurons")
    assert "by: COLUMN" in hint


def test_rows_of_instances_by_their_whole_names_or_those_of_their_scope(tmp_path: Path) -> None:
    (tmp_path / "cells.csv").write_text("name,bias\nA,1\nleft2.A,2\n")
    text = "modules: {leg: {neurons: {A: {bias: {file: cells.csv, by: name, column: bias}}}}}\n"
    network = network_of(text + "instances: {left: {module: leg, count: 3}}", tmp_path)
    assert network.neurons.bias.tolist() == [1, 2, 1]


@pytest.mark.parametrize(
    ("setting", "code", "message", "hint"),
    [
        ("file: c.csv, by: cell, column: lek", "file-format", "no column 'lek'", "did you mean 'leak'?"),
        ("file: c.csv, by: sell, column: leak", "file-format", "no column 'sell'", "did you mean 'cell'?"),
        ("file: c.csv, by: cell, column: start", "file-format", "row 2, column 5 of the table is empty", "'default'"),
        ("file: c.csv, by: what, column: leak", "file-format", "no row of the table is of 'K1'", "there are"),
        ("file: c.csv, by: cell, column: what", "file-format", "row 2, column 7: 'two' is no number", ""),
        ("file: c.csv, column: leak, default: many", "wrong-type", "a default is a number", ""),
        ("column: leak", "missing-key", "the key 'file' is missing", "write"),
        ("file: c.csv", "missing-key", "the key 'column' is missing", "write {file: PATH, column: NAME}"),
        ("file: c.csv, by: cell, colum: leak", "unknown-key", "unknown key 'colum'", "did you mean 'column'?"),
        ("file: c.mtx, column: leak", "file-format", "no kind of file whose columns have names", "known: .csv"),
        ("file: c.csv, key: x, column: leak", "useless-key", "'key' names an array", ""),
        ("file: twice.csv, by: cell, column: leak", "file-format", "rows 2 and 4 of the table are both of 'K1'", ""),
        ("file: ragged.csv, column: leak", "file-format", "row 3 has 1 cell, the header 2", ""),
        ("file: none.csv, column: leak", "file-missing", "does not exist", ""),
        ("file: c.csv, by: cell, column: leak, where: {what: three}", "file-format", "no row has 'three'", ""),
    ],
)  # fmt: skip
def test_settings_that_no_table_has(tmp_path: Path, setting: str, code: str, message: str, hint: str) -> None:
    (tmp_path / "c.csv").write_text(SHEET)
    (tmp_path / "twice.csv").write_text("cell,leak\nK1,1\nK2,2\nK1,3\n")
    (tmp_path / "ragged.csv").write_text("cell,leak\nK1,1\nK2\n")
    for group in (f"bias: {{{setting}}}", f"model: {{leaky_integrator: {{leak: {{{setting}}}}}}}"):
        with pytest.raises(nv.SpecError) as caught:
            compiled(f"neurons: {{K: {{count: 2, {group}}}}}", tmp_path)
        first = caught.value.diagnostics[0]
        assert first.code == code
        assert message in first.message
        assert hint in (first.hint or "")


def test_names_labels_and_boxes_from_a_table(tmp_path: Path) -> None:
    (tmp_path / "cells.csv").write_text(
        "name,title,part,kind\nAVAL,left command,head,inter\nPVCR,,tail,inter\nM1,motor {1},,motor\n"
    )
    column = "file: cells.csv, where: {kind: [inter, motor]}"
    text = (
        f"neurons: {{C: {{names: {{{column}, column: name}}, label: {{{column}, column: title, default: '?'}}, "
        f"bias: 1, box: {{{column}, by: name, column: part}}}}}}\nconnections: {{AVAL -> M1: 1}}"
    )
    network = compiled(text, tmp_path)
    assert network.network.neurons.names == ("AVAL", "PVCR", "M1")
    assert network.network.neurons.labels == ("left command", "?", "motor {1}")
    assert network.network.layout.boxes == (("head", (0,)), ("tail", (1,)))
    again = nv.compile_text(network.text())
    assert again.hash == network.hash
    assert again.network.layout.boxes == network.network.layout.boxes
    assert again.network.neurons.labels == network.network.neurons.labels
    network.render(tmp_path / "a.svg")
    drawn = (tmp_path / "a.svg").read_text()
    assert "tail" in drawn
    assert "left command" in drawn


def test_the_neurons_of_a_table_are_those_of_its_rows(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text("name\nK1\nK-2\nK1\n\nK5\n")
    text = "neurons: {C: {%snames: {file: c.csv, column: name}}}"
    with pytest.raises(nv.SpecError) as caught:
        compiled(text % "", tmp_path)
    assert [(one.code, one.message) for one in caught.value.diagnostics] == [
        ("file-format", "row 5, column 1 of the table is empty"),
    ]
    (tmp_path / "c.csv").write_text("name\nK1\nK-2\nK1\n")
    with pytest.raises(nv.SpecError) as caught:
        compiled(text % "", tmp_path)
    assert [(one.code, one.message) for one in caught.value.diagnostics] == [
        ("bad-name", "row 3 of the table: 'K-2' is not a name"),
        ("duplicate-neuron", "row 4 of the table: 'K1' is named before (row 2)"),
    ]
    (tmp_path / "c.csv").write_text("name\nK1\nK2\n")
    assert answer(text % "count: 3, ", tmp_path)[1] == "'names' has 2 names, 'count' says 3"
    assert codes(text.replace("column: name", "column: name, by: name") % "", tmp_path) == ["unknown-key"]


def saved(path: Path, columns: dict[str, list[object]]) -> None:
    """A table as NumPy or pandas writes it."""
    if path.suffix == ".npz":
        np.savez_compressed(path, allow_pickle=False, **{name: np.array(values) for name, values in columns.items()})
    else:
        pandas.DataFrame(columns).to_parquet(path)


@pytest.mark.parametrize("name", ["cells.npz", "cells.parquet"])
def test_tables_of_arrays(name: str, tmp_path: Path) -> None:
    saved(tmp_path / name, {
        "cell": ["K2", "K1", "L"], "leak": [0.5, 0.25, 9.0], "kind": [1, 1, 2], "x": [1, 0, 5], "y": [0, 0, 5],
    })  # fmt: skip
    by = f"file: {name}, by: cell"
    text = (
        f"neurons: {{K: {{count: 2, model: {{leaky_integrator: {{leak: {{{by}, column: leak}}}}}}, bias: 1, "
        f"position: {{{by}, columns: [x, y]}}}}, "
        f"L: {{names: {{file: {name}, column: cell, where: {{kind: 2}}}}, bias: {{file: {name}, column: x, "
        f"where: {{cell: L}}}}}}}}"
    )
    network = compiled(text, tmp_path)
    assert network.network.neurons.groups[0].model_parameters == {"leak": (0.25, 0.5)}
    assert network.network.neurons.names == ("K1", "K2", "L")
    assert network.network.neurons.bias.tolist() == [1, 1, 5]
    assert nv.compile_text(network.text()).hash == network.hash
    for wrong, told in (
        ("by: cell, column: lek", "no column 'lek'"),
        ("by: cell, column: cell", "'cell' is no column of numbers"),
        ("column: leak", "the table has 3 rows, and there are 2 neurons"),
        ("column: leak, where: {kind: 3}", "no row has '3'"),
    ):
        assert told in answer(f"neurons: {{K: {{count: 2, bias: {{file: {name}, {wrong}}}}}}}", tmp_path)[1]


@pytest.mark.parametrize("name", ["worm.npz", "worm.parquet"])
def test_edges_in_arrays(name: str, tmp_path: Path) -> None:
    saved(tmp_path / name, {
        "pre": ["AVAL", "AVAL", "AVAR"], "post": ["AVAR", "AVBL", "AVBL"], "N": [3, 2, 1], "ms": [1.0, 2.5, 1.0],
        "kind": ["chemical", "chemical", "gap"], "rate": [0.5, 0.25, 1.0],
    })  # fmt: skip
    columns = "columns: {from: pre, to: post, weight: N, delay: {column: ms, unit: ms}}"
    edges = f"edges: {{file: {name}, {columns}, where: {{kind: chemical}}}}"
    text = f"{CELLS}connections: {{C -> C: {{{edges}, plasticity: {{decay: {{rate: {{column: rate}}}}}}}}}}"
    network = compiled(text, tmp_path)
    assert wires(network.network) == [("AVAL", "AVAR", 3.0, 2), ("AVAL", "AVBL", 2.0, 5)]
    assert parameters(network.network) == {"rate": [0.5, 0.25]}
    assert nv.compile_text(network.text()).hash == network.hash
    assert "row 2, column 4" in answer(text.replace("{column: ms, unit: ms}", "ms"), tmp_path)[1]
    assert "no neuron 'chemical' (row 1 of the file)" in answer(text.replace("to: post", "to: kind"), tmp_path)[1]


def test_arrays_that_are_no_table(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", x=np.arange(2.0), y=np.arange(3), z=np.eye(2), w=np.array([1, np.inf]))
    (tmp_path / "b.parquet").write_bytes(b"PAR1" + bytes(100) + b"PAR1")
    for written, told in (
        ("file: a.npz, column: z", "'z': an array of 2 dimensions where one is wanted"),
        ("file: a.npz, by: x, column: y", "'x' has 2 values, another column 3"),
        ("file: a.npz, column: w", "row 2, column 4: this is infinity"),
        ("file: b.parquet, column: x", "this is no .parquet file, or it is damaged"),
    ):
        assert told in answer(f"neurons: {{K: {{count: 2, bias: {{{written}}}}}}}", tmp_path)[1]


def test_a_parquet_without_its_reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.parquet").write_bytes(b"PAR1")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    code, message, hint = answer("neurons: {K: {bias: {file: a.parquet, column: x}}}", tmp_path)
    assert (code, hint) == ("file-unreadable", "pip install 'neurovis-spec[parquet]'")
    assert "pyarrow, which is not installed" in message


LEG = "modules: {leg: {parameters: {g: 1}, neurons: {A: {bias: g}, K: {}}, connections: {A -> K: g}}}\n"


def test_instances_have_names(tmp_path: Path) -> None:
    """Of a list or of a table; all of them together are called as the entry is."""
    (tmp_path / "legs.csv").write_text("leg,side\nfront,left\nhind,left\nother,right\n")
    rest = "connections: {legs.K -> front.A: 0.5, hind.K -> front.K: 1}\n"
    listed = compiled(LEG + "instances: {legs: {module: leg, names: [front, hind], set: {g: i + 2}}}\n" + rest)
    assert listed.network.neurons.names == ("front.A", "front.K", "hind.A", "hind.K")
    assert listed.network.neurons.bias.tolist() == [2, 0, 3, 0]
    assert [(one.path, one.declared, one.number) for one in listed.network.instances] == [
        ("front", "legs", 1),
        ("hind", "legs", 2),
    ]
    run = listed.run(2)
    assert run["legs.K"].tolist() == [[0, 0], [4, 9]]
    assert run["hind.A"].tolist() == [3, 3]
    table = "{file: legs.csv, column: leg, where: {side: left}}"
    text = LEG + f"instances: {{legs: {{module: leg, names: {table}, set: {{g: i + 2}}}}}}\n" + rest
    assert compiled(text, tmp_path).hash == listed.hash
    assert nv.compile_text(compiled(text, tmp_path).text()).hash == listed.hash
    twice = text.replace("instances: {", "instances: {hind: {module: leg}, ")
    for one in (twice, text.replace("i + 2}}}", "i + 2}}, hind: {module: leg}}")):
        assert codes(one, tmp_path) == ["duplicate-name"]


@pytest.mark.parametrize(
    ("instances", "code", "message"),
    [
        ("{legs: {module: leg, names: [a, a]}}", "duplicate-name", "'a' is named before"),
        ("{legs: {module: leg, names: [a, legs]}}", "duplicate-name", "'legs' is all of these instances"),
        ("{legs: {module: leg, names: [2nd]}}", "bad-name", "'2nd' is not a name"),
        ("{legs: {module: leg, names: []}}", "wrong-size", "'names' has 0 names"),
        ("{legs: {module: leg, count: 3, names: [a, b]}}", "wrong-size", "'names' has 2 names, 'count' says 3"),
        ("{legs: {module: leg, names: [a, b]}, a: {module: leg}}", "duplicate-name", "'a' is called like the"),
    ],
)
def test_instances_that_have_no_names(instances: str, code: str, message: str) -> None:
    found = answer(f"{LEG}instances: {instances}")
    assert found[0] == code
    assert message in found[1]


def test_what_is_exported_is_read_back(tmp_path: Path) -> None:
    """In the columns that the spec names, with learned weights; and not over what it reads."""
    (tmp_path / "worm.tsv").write_text(WORM)
    columns = "columns: {from: Source, to: Target, weight: N, delay: {column: delay_ms, unit: ms}}"
    neurons = (
        "neurons: {C: {names: [AVAL, AVAR, AVBL], bias: [1, 2, 3], position: [[0, 0], [1, 0], [2, 0]], box: head}}"
    )
    body = f"{{edges: {{file: worm.tsv, {columns}, where: {{Type: chemical}}}}, plasticity: hebbian}}"
    text = f"time: {{dt: 0.5 ms}}\n{neurons}\nconnections: {{C -> C: {body}}}"
    network = compiled(text, tmp_path)
    written, kept = network.export(tmp_path / "out", "csv", start=network.run(10))
    learned = network.run(11).weights[-1].tolist()
    assert ([path.name for path in written], kept) == (["neurons.csv", "edges.csv"], [])
    assert (tmp_path / "out" / "edges.csv").read_text().splitlines()[0] == "Source,Target,N,delay_ms,entry"
    table = "file: out/neurons.csv"
    again = (
        f"time: {{dt: 0.5 ms}}\nneurons: {{C: {{names: {{{table}, column: name}}, bias: {{{table}, column: bias}}, "
        f"position: {{{table}, columns: [x, y]}}, box: {{{table}, column: box}}}}}}\n"
        f"connections: {{C -> C: {{edges: {{file: out/edges.csv, {columns}}}, plasticity: hebbian}}}}"
    )
    back = network_of(again, tmp_path)
    assert wires(back) == [(*one[:2], w, one[3]) for one, w in zip(wires(network.network), learned, strict=True)]
    assert back.neurons.bias.tolist() == [1, 2, 3]
    assert back.neurons.position.tolist() == [[0, 0], [1, 0], [2, 0]]
    assert back.layout.boxes == (("head", (0, 1, 2)),)
    with pytest.raises(ValueError, match="a file that the spec reads"):
        compiled(again, tmp_path).export(tmp_path / "out", "csv")


def test_positions_in_space_are_exported_whole(tmp_path: Path) -> None:
    network = compiled("neurons: {A: {count: 2, bias: 1, position: [[0, 0, 1], [1, 0, 2]]}}")
    network.export(tmp_path, "csv")
    table = "file: neurons.csv"
    text = f"neurons: {{A: {{count: 2, bias: {{{table}, column: bias}}, position: {{{table}, columns: [x, y, z]}}}}}}"
    assert network_of(text, tmp_path).neurons.position.tolist() == [[0, 0, 1], [1, 0, 2]]
    assert compiled(text, tmp_path).hash == network.hash


def test_delays_that_are_continuous_are_exported_as_such(tmp_path: Path) -> None:
    text = (
        "time: {dt: 1 ms}\nmodels: {m: {state: {v: {initial: 1, derivative: drive - v}}, activity: v}}\n"
        "neurons: {A: {model: m}, B: {model: m}}\nconnections: {A -> B: {weight: 2, delay: 1.5 ms}, B -> A: 1}"
    )
    network = compiled(text)
    network.export(tmp_path, "csv")
    lines = (tmp_path / "edges.csv").read_text().splitlines()
    assert lines == ["from,to,weight,delay,delay_seconds,entry", "A,B,2.0,,0.0015,A -> B", "B,A,1.0,0,,B -> A"]


RECIPES = re.split(r"^## ", (Path(__file__).parents[1] / "docs" / "tables.md").read_text(encoding="utf-8"), flags=re.M)


@pytest.mark.parametrize("recipe", RECIPES[1:], ids=lambda text: text.partition("\n")[0])
def test_a_recipe_is_right(recipe: str, tmp_path: Path) -> None:
    for name, text in re.findall(r"^`(\S+)`:\n\n```\n(.*?)^```$", recipe, re.M | re.S):
        (tmp_path / name).write_text(text)
    specs = re.findall(r"^```yaml\n(.*?)^```$", recipe, re.M | re.S)
    assert specs
    for spec in specs:
        network = compiled(spec, tmp_path)
        assert network.warnings == ()
        network.run(3)
        assert nv.compile_text(network.text()).hash == network.hash


def test_a_file_is_at_fault_once(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text("cell,leak\nK1,x\nK2,2\n")
    column = "{file: c.csv, column: leak}"
    text = f"neurons: {{K: {{count: 2, bias: {column}, initial: {column}}}, L: {{count: 2, bias: {column}}}}}"
    assert codes(text, tmp_path) == ["file-format"]


@given(
    st.lists(
        st.tuples(st.text(alphabet='ab";, \n', max_size=5), st.sampled_from(["1", "-2.5", "", "7e3"])),
        min_size=1,
        max_size=9,
    ),
    st.booleans(),
)
def test_a_sheet_holds_what_was_written(rows: list[tuple[str, str]], windows: bool) -> None:  # fmt: skip
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n" if windows else "\n")
    writer.writerows([("text", "number"), *rows])
    with patch.object(sheet, "_STRETCH", 16):
        got = sheet.parse_sheet(text.getvalue().encode(), "a.csv")
    assert got.texts(located("text")) == tuple(" ".join(row[0].split("\n")).strip() for row in rows)
    np.testing.assert_array_equal(got.numbers(located("number")), [float(row[1] or "nan") for row in rows])


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("neurons: {K: {bias: {file: c.csv, ¦}}}", {"column", "by", "default", "where", "key", "csv"}),
        ("neurons: {K: {names: {file: c.csv, ¦}}}", {"column", "where", "key", "csv"}),
        ("neurons: {K: {position: {file: c.csv, ¦}}}", {"columns", "by", "where", "key", "csv"}),
        ("neurons: {K: {}}\nconnections: {K -> K: {edges: {file: c.csv, ¦}}}", {"columns", "where", "key"}),
        (
            "neurons: {K: {}}\nconnections: {K -> K: {edges: {file: c.csv, columns: {¦}}}}",
            {"from", "to", "weight", "delay"},
        ),
        (
            "neurons: {K: {}}\nconnections: {K -> K: {edges: {file: c.csv, columns: {delay: {unit: ¦}}}}}",
            {"s", "ms", "us", "min"},
        ),
        ("neurons: {K: {model: {leaky_integrator: {leak: {file: c.csv, ¦}}}}}", {"column", "by", "default", "where"}),
    ],
)
def test_an_editor_offers_the_keys_of_tables(text: str, keys: set[str]) -> None:
    offered = {item.label for item in complete(*marked(HEAD + text))}
    assert keys <= offered
    assert "count" not in offered
