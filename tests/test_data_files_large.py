"""Data files that are large: read a stretch at a time, and refused before they are made where nothing needs them."""

from __future__ import annotations

import csv
import io
import math
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from data_attempts import HERE, fault, npy, npz, table
from hypothesis import given
from hypothesis import strategies as st
from small_specs import HEAD, answer, network_of

import neurovis_spec as nv
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.data import cells as data_files_cells
from neurovis_spec.language.data import columns
from neurovis_spec.language.data import csv_table as data_files_csv
from neurovis_spec.language.data.csv_table import parse_numbers
from neurovis_spec.language.data.edge_list import parse_edges
from neurovis_spec.language.data.files import CellError, NamedFile, locate, read_edges, read_table
from neurovis_spec.language.unknown import UNKNOWN

CELLS = ["1", "-2.5", "3e-7", "", " 7", "\t8 ", "\u00a09", "0", ".5", "1.", " "]
NAMES = ["A", " B1 ", "K", '"Q"']
LINE_ENDS = ["\n", "\r\n", "\r"]


def tables(width: int) -> st.SearchStrategy[list[list[str]]]:
    row = st.lists(st.sampled_from(CELLS), min_size=width, max_size=width)
    return st.lists(row, min_size=1, max_size=12)


def plain(text: str) -> np.ndarray:
    """The numbers of a text as the module csv and float make them."""
    rows = csv.reader(io.StringIO(text.rstrip("\r\n"), newline=""))
    return np.array([[float(cell.strip() or "nan") for cell in row or [""]] for row in rows])


@given(st.integers(1, 4).flatmap(tables), st.sampled_from(LINE_ENDS), st.sampled_from([1, 5, 1 << 18]), st.booleans())
def test_stretches_do_not_show_in_the_numbers(rows: list[list[str]], end: str, stretch: int, quoted: bool) -> None:
    text = end.join(",".join(f'"{cell}"' if quoted else cell for cell in row) for row in rows)
    if not text.strip("\r\n"):
        return
    with (
        patch.object(data_files_cells, "STRETCH", stretch),
        patch.object(data_files_csv, "_FEW", 2),
    ):
        got = parse_numbers(text.encode())
    np.testing.assert_array_equal(got.values, plain(text))


@pytest.mark.parametrize("stretch", [1, 7, 64, 1 << 18])
@pytest.mark.parametrize(
    ("row", "cell", "code", "words"),
    [
        (3, "x", "file-format", "row 12, column 4: 'x' is no number"),
        (3, "-inf", "not-finite", "row 12, column 4: '-inf'"),
        (0, "1_0", "file-format", "row 12, column 1: '1_0'"),
        (4, "5,6", "file-format", "row 12 has 6 cells, the first row 5"),
        (1, "é", "file-format", "row 12, column 2: 'é' is no number"),
    ],
)
def test_a_fault_is_found_in_any_stretch(row: int, cell: str, code: str, words: str, stretch: int) -> None:
    rows = [["1", "2", "3", "4", "5"] for _ in range(30)]
    rows[11][row] = cell
    rows[20][0] = "later"
    text = "\n".join(map(",".join, rows))
    with patch.object(data_files_cells, "STRETCH", stretch), pytest.raises(CellError) as refused:
        parse_numbers(text.encode())
    assert refused.value.code == code
    assert words in str(refused.value)


@given(
    st.lists(st.tuples(*(st.sampled_from(NAMES),) * 2, st.sampled_from(["1", "", "-2e3"]), st.sampled_from("012 "))),
    st.sampled_from(LINE_ENDS),
    st.sampled_from([1, 1 << 18]),
)
def test_stretches_do_not_show_in_the_edges(edges: list[tuple[str, str, str, str]], end: str, stretch: int) -> None:
    text = end.join(["from,to,weight,delay", *map(",".join, edges)])
    with patch.object(data_files_cells, "STRETCH", stretch):
        got = parse_edges([text.encode()])
    rows = [[cell.strip(' "') for cell in edge] for edge in edges]
    assert got.sources == tuple(row[0] for row in rows)
    assert got.targets == tuple(row[1] for row in rows)
    assert got.weights.tolist() == [float(row[2] or 1) for row in rows]
    assert got.delays.tolist() == [int(row[3] or -1) for row in rows]
    assert [*map(got.row, range(len(got)))] == list(range(2, 2 + len(edges)))


@pytest.mark.parametrize("end", LINE_ENDS)
def test_a_header_ends_with_its_line_however_lines_end(end: str) -> None:
    got = parse_edges([end.join(["from,to,weight,delay", *["A,B,1,0"] * 50]).encode()])
    assert (len(got.sources), got.fault) == (50, None)


@pytest.mark.parametrize("edge", ["A", "A,B,x,1", "A,,1,1", "A,B,1,1.5", "A,B,1,-1", "A,B,1,3000000000", "A,B,nan,1"])
def test_a_fault_of_an_edge_is_found_among_many(edge: str) -> None:
    lines = ["from,to,weight,delay", *["A,B,1,1"] * 20, edge, *["A,B,1,1"] * 20, "B"]
    with patch.object(data_files_cells, "STRETCH", 30):
        fault = parse_edges(["\n".join(lines).encode()]).fault
    assert fault is not None
    assert str(fault).startswith(("row 22 ", "row 22,"))
    assert [str(other) for other in fault.others] == ["row 43 has 1 cell, the header 4"]


def peak(work: Callable[[], object]) -> int:
    """The most bytes that something takes."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("before", ["", "1,2\r\n3,", "1\r2\r", ",,,"])
def test_a_long_cell_is_refused_before_its_row_is_read(before: str) -> None:
    data = before.encode() + b"9" * 10_000_000 + b",1\n"

    def refuse() -> None:
        for parse in (lambda: parse_numbers(data), lambda: parse_edges([data])):
            with pytest.raises(CellError, match="no number or name has more than 65,536 bytes") as refused:
                parse()
            place = {"": "row 1, column 1", "1,2\r\n3,": "row 2, column 2", "1\r2\r": "row 3, column 1"}
            assert str(refused.value).startswith(place.get(before, "row 1, column 4"))
            del refused  # its traceback holds what was read

    assert peak(refuse) < 3.5 * len(data)  # copies with other line ends


def test_a_cell_may_be_long(tmp_path: Path) -> None:
    header = ",".join(["x" * 65_000] * 40)
    assert table(tmp_path, "a.csv", header + "\n" + "1," * 39 + "1").header is not None
    assert "row 1, column 2" in fault(tmp_path, "b.csv", "1," + "9" * 65_537).message


def test_a_first_row_of_many_cells_is_no_header_of_edges(tmp_path: Path) -> None:
    (tmp_path / "e.csv").write_text("from," * 1_000_000)
    findings = Findings()
    assert read_edges(NamedFile("e.csv", tmp_path, tmp_path, HERE), findings) is UNKNOWN
    (finding,) = findings.sorted()
    assert "row 1 has 1,000,001 cells" in finding.message
    assert finding.hint is not None


@pytest.mark.parametrize(
    ("name", "data", "cells"),
    [
        ("a.csv", b"x,y\n" + b"1,2\n" * 1000, 2002),
        ("q.csv", b'"x","y"\r\n' + b"1,2\r\n" * 1000, 2002),
        ("a.npy", npy(np.zeros((1000, 3))), 3000),
        ("a.npz", npz(True, a=np.zeros((1000, 4))), 4000),
        ("a.mtx", b"%%MatrixMarket matrix coordinate real general\n1000 5 3\nnothing of this is read", 5000),
    ],
)
def test_who_reads_a_table_may_refuse_its_size(tmp_path: Path, name: str, data: bytes, cells: int) -> None:
    (tmp_path / name).write_bytes(data)
    asked: list[int] = []

    def room(count: int) -> None:
        asked.append(count)
        raise CellError("wrong-size", f"{count} cells are too many")

    findings = Findings()
    assert read_table(NamedFile(name, tmp_path, tmp_path, HERE), findings, room=room) is UNKNOWN
    assert asked == [cells]
    assert [(finding.code, finding.span) for finding in findings.sorted()] == [("wrong-size", HERE)]


@pytest.mark.parametrize(
    ("group", "rest"),
    [
        (", position: {file: a.npz}", ""),
        ("", "connections: {A -> A: {matrix: {file: a.npz}}}"),
        (", combine: distance", "connections: {A -> A: {centre: {file: a.npz}}}"),
    ],
)
def test_a_place_refuses_a_table_that_is_far_too_large_for_it(tmp_path: Path, group: str, rest: str) -> None:
    """A matrix, centres and positions know their size: what is much larger is never unpacked."""
    (tmp_path / "a.npz").write_bytes(npz(True, a=np.zeros((8192, 1024))))

    def refuse() -> None:
        code, message, _ = answer(f"neurons: {{A: {{count: 2, bias: 1{group}}}}}\n{rest}", tmp_path)
        assert code == "wrong-size"
        assert message == "the file 'a.npz': it has 8,388,608 cells; 2 × 2 are wanted"

    refuse()  # what is loaded for the first time does not count
    assert peak(refuse) < 30_000_000


def test_what_is_too_large_for_one_place_may_fit_another(tmp_path: Path) -> None:
    (tmp_path / "a.npy").write_bytes(npy(np.ones((300, 300))))
    text = "neurons: {A: {count: 2, bias: 1}, B: {count: 300}}\nconnections:\n"
    network = network_of(text + "  B -> B: {matrix: {file: a.npy}}\n", tmp_path)
    assert len(network.connections) == 90_000
    code, message, _ = answer(text + "  A -> A: {matrix: {file: a.npy}}\n  B -> B: {matrix: {file: a.npy}}\n", tmp_path)
    assert (code, message) == ("wrong-size", "the file 'a.npy': it has 90,000 cells; 2 × 2 are wanted")


def test_edges_beyond_the_limit_are_refused_before_they_are_made(tmp_path: Path) -> None:
    (tmp_path / "e.csv").write_text("from,to,weight\n" + "nobody,A,1\n" * 101)
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(
            f"{HEAD}neurons: {{A: {{}}}}\nconnections: {{A -> A: {{edges: {{file: e.csv}}}}}}\n",
            folder=tmp_path,
            limit=100,
        )
    (item,) = caught.value.diagnostics
    assert item.code == "too-many"
    assert "it has 101 edges; 100 more connections may be made" in item.message
    assert "--limit" in (item.hint or "")


def test_a_path_has_a_largest_length(tmp_path: Path) -> None:
    for text in ("a/" * 50_000 + "data.csv", "a" * 4093 + ".csv"):
        findings = Findings()
        assert locate(NamedFile(text, tmp_path, tmp_path, HERE), findings) is UNKNOWN
        (finding,) = findings.sorted()
        assert finding.code == "file-missing"
        assert f"a path of {len(text):,} characters" in finding.message
    assert math.isfinite(table(tmp_path, "a.csv", "1").values[0, 0])


@given(
    st.lists(
        st.text("Aaé \u00a0.1", max_size=40).map(str.strip).filter(bool), min_size=1, max_size=8, unique=True
    ).flatmap(lambda names: st.lists(st.tuples(*(st.sampled_from(names),) * 2), min_size=1, max_size=30)),
    st.sampled_from(["", " ", "\t"]),
    st.sampled_from([2, 16]),
)
def test_names_of_any_length_are_told_apart(edges: list[tuple[str, str]], blank: str, places: int) -> None:
    text = "\n".join(["from,to", *(f"{source}{blank},{blank}{target}" for source, target in edges)])
    with (
        patch.object(columns, "_PLACES", places),
        patch.object(data_files_cells, "STRETCH", 50),
    ):  # few places, so that names fall upon each other
        got = parse_edges([text.encode()])
    assert list(zip(got.sources, got.targets, strict=True)) == edges
