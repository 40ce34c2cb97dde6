"""Files in other people's shape: edges with their own columns, rows that count, units, what separates cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from data_attempts import HERE
from hypothesis import given
from hypothesis import strategies as st
from small_specs import HEAD, answer, codes, compiled, network_of, wires

import neurovis_spec as nv
from neurovis_spec.cli.overview import overview
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.data.cells import separator_of
from neurovis_spec.language.data.edge_list import parse_edges
from neurovis_spec.language.located import Located
from neurovis_spec.language.tables import Condition, EdgeFile, FileReference
from neurovis_spec.language.yaml.source import Scalar

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
