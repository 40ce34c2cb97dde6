"""Tables and edges from files: values, and every way in which a file may be at fault."""

from __future__ import annotations

import math
import os
import pickle
import struct
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from data_attempts import HERE, attempt, fault, npy, table
from hypothesis import example, given
from hypothesis import strategies as st

from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.language.data.cells import number_of, numbers_of
from neurovis_spec.language.data.csv_table import parse_numbers
from neurovis_spec.language.data.edge_list import EdgeTable, parse_edges
from neurovis_spec.language.data.files import NamedFile, read_edges, read_table
from neurovis_spec.language.data.npy import parse_npy
from neurovis_spec.language.data.table import CellError
from neurovis_spec.language.unknown import UNKNOWN, Unknown


def npy_header(text: str, data: bytes = b"", version: int = 1) -> bytes:
    header = text.encode() + b"\n"
    return b"\x93NUMPY" + struct.pack("<BBH" if version == 1 else "<BBL", version, 0, len(header)) + header + data


def test_csv_with_header_and_empty_cells(tmp_path: Path) -> None:
    data = "\ufeffx, y\r\n1,\r\n-2.5e1,.5\r\n"
    got = table(tmp_path, "a.csv", data)
    assert got.header == ("x", "y")
    np.testing.assert_array_equal(got.values, [[1, np.nan], [-25, 0.5]])
    np.testing.assert_array_equal(got.present, [[True, False], [True, True]])
    assert got.values.dtype == np.float64


def test_csv_of_any_line_ends(tmp_path: Path) -> None:
    for end in ("\n", "\r\n", "\r"):
        got = table(tmp_path, "a.csv", f"x,y{end}1,2{end},4{end}{end}")
        np.testing.assert_array_equal(got.values, [[1, 2], [np.nan, 4]])


def test_line_ends_of_several_kinds_in_a_csv(tmp_path: Path) -> None:
    got = table(tmp_path, "a.csv", "1,2\r3,4\n5,6\r\n7,8\r9,0")
    np.testing.assert_array_equal(got.values, [[1, 2], [3, 4], [5, 6], [7, 8], [9, 0]])


def test_csv_without_header_takes_the_quick_way_to_the_same_numbers(tmp_path: Path) -> None:
    body = "1,2.5,-3e-7\n4,5,0.1\n"
    got = table(tmp_path, "a.csv", body)
    assert got.header is None
    np.testing.assert_array_equal(got.values, [[1, 2.5, -3e-7], [4, 5, 0.1]])
    assert got.present.all()
    np.testing.assert_array_equal(table(tmp_path, "b.csv", "a,b,c\n" + body).values, got.values)


@pytest.mark.parametrize(
    ("data", "numbered"),
    [
        ("0,1\n0.5,0.25\n0.75,0.125\n", True),
        ('"0","1"\r\n0.5,0.25\r\n0.75,1e-05\r\n', True),
        ("0,1,2\n-0.5,0.25,0.1\n0.5,0.5,0.2\n0.1,0.9,0.4\n", True),
        ("0.0,1.0\n0.5,0.25\n0.75,0.125\n", False),  # floats, as the others
        ("0,1\n1,0\n0,1\n", False),  # integers, as the others
        ("0,1\n0.5,0.25\n0.75,0\n", False),  # somebody who writes no needless points
        ("0,1\n0.5,0.25\n", False),
        ("0\n0.5\n0.4\n", False),
        ("1,2\n0.5,0.25\n0.75,0.125\n", False),
        ("\n".join(f"{math.sin(k / 10):g},{math.cos(k / 10):g}" for k in range(50)), False),
        ("\n".join(f"{k / 100:g},{1 + k / 100:g}" for k in range(99)), False),
    ],
)
def test_a_first_row_that_numbers_the_columns(tmp_path: Path, data: str, numbered: bool) -> None:
    got = table(tmp_path, "x.csv", data)
    assert got.numbered == numbered
    assert len(got.values) == len(data.split())  # it is read all the same


def test_an_empty_line_of_one_column_is_an_empty_cell(tmp_path: Path) -> None:
    got = table(tmp_path, "a.csv", "1\n\n3\n\n\n")
    np.testing.assert_array_equal(got.values, [[1], [np.nan], [3]])
    np.testing.assert_array_equal(table(tmp_path, "b.csv", "\n1\n").values, [[np.nan], [1]])


@given(st.lists(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=3), min_size=1))
def test_csv_numbers_read_back_exactly(rows: list[list[float]]) -> None:
    text = "\n".join(",".join(map(repr, row)) for row in rows)
    np.testing.assert_array_equal(parse_numbers(text.encode()).values, rows)
    np.testing.assert_array_equal(parse_numbers(b'a,b,"c"\n' + text.encode()).values, rows)


@given(st.lists(st.text("12+-.eE \t", max_size=4), min_size=1, max_size=4))
@example(["1", "2e"])
@example([" ", "1"])
@example(["1", "-"])
def test_numbers_of_many_cells_are_those_of_each(cells: list[str]) -> None:
    many = numbers_of(",".join(cells).encode())
    try:
        each = [number_of(cell.strip(), 1, 1) for cell in cells]
    except CellError:
        assert many is None
    else:
        np.testing.assert_array_equal(many, each)


@pytest.mark.parametrize(
    ("data", "code", "words"),
    [
        ("1,2\n3\n", "file-format", "row 2 has 1 cell, the first row 2"),
        ("x,y\n1,2\n3,4,5\n", "file-format", "row 3 has 3 cells, the first row 2"),
        ("1,2\n\n3,4\n", "file-format", "row 2 has 1 cell"),
        ("1,nan\n", "not-finite", "row 1, column 2: 'nan'"),
        ("x,y\n1,2\n-inf,3\n", "not-finite", "row 3, column 1: '-inf'"),
        ("1,.NaN\n", "not-finite", "row 1, column 2"),
        ("1\n1e999\n", "not-finite", "row 2, column 1: '1e999'"),
        ("1,x\n", "file-format", "row 1, column 2: 'x' is no number"),
        ("1,2\n3,1_000\n", "file-format", "row 2, column 2: '1_000'"),
        ("1,2\n3,0x1f\n", "file-format", "row 2, column 2: '0x1f'"),
        ("1,2\n3,١\n", "file-format", "row 2, column 2"),
        ("1,2 3\n", "file-format", "row 1, column 2: '2 3'"),
        ("x,y\n", "file-format", "no row of numbers"),
        ("", "file-format", "empty"),
        ("\n\n", "file-format", "empty"),
        (b"1,2\n3,\xff\n", "invalid-utf8", "row 2"),
        ('1,"2\n', "file-format", "no CSV"),
        ("1,2\x00\n", "file-format", "row 1, column 2"),
        ("1," + "9" * 200_000, "file-format", "row 1"),
        ("x,y\n1,2\n" + "9" * 200_000, "file-format", "row 3, column 1: no number or name"),
        ("1,\x1b[2J\n", "file-format", "row 1, column 2: '?[2J' is no number"),
    ],
)
def test_faults_of_a_csv(tmp_path: Path, data: str | bytes, code: str, words: str) -> None:
    finding = fault(tmp_path, "a.csv", data)
    assert finding.code == code
    assert words in finding.message
    assert "'a.csv'" in finding.message
    assert len(finding.message) < 300


def test_a_table_of_too_many_cells_is_refused_before_they_are_made(tmp_path: Path) -> None:
    for name, data in (
        ("a.csv", b"," * 2**25 + b"\n"),
        ("b.csv", b"x\n" * (2**25 + 1)),
        ("c.npy", npy(np.zeros(2**25 + 1, dtype="u1"))),
    ):
        finding = fault(tmp_path, name, data)
        assert finding.code == "too-large"
        assert "33,554,432 cells" in finding.message


def test_a_comment_is_explained(tmp_path: Path) -> None:
    assert "all rows of a .csv are read" in str(fault(tmp_path, "a.csv", "# made by hand\n1,2\n3,4\n").hint)
    assert "all rows of a .csv are read" in str(fault(tmp_path, "a.csv", '# made by hand\n"1",2\n').hint)
    _, findings = edges(tmp_path, "# made by hand\nfrom,to\nA,B\n")
    assert "all rows of a .csv are read" in str(findings[0].hint)


def test_semicolons_are_explained(tmp_path: Path) -> None:
    finding = fault(tmp_path, "b.csv", "x\n1;2\n")
    assert finding.hint == "columns are separated by commas"


@pytest.mark.parametrize("dtype", ["<f8", ">f4", "<f2", "<i4", "|u1", ">i8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_npy_of_every_real_type(tmp_path: Path, dtype: str, order: str) -> None:
    array = np.array([[1, 2, 3], [4, 5, 6]], dtype=dtype)
    got = table(tmp_path, "a.npy", npy(np.asfortranarray(array) if order == "F" else array))
    np.testing.assert_array_equal(got.values, [[1, 2, 3], [4, 5, 6]])
    assert got.values.dtype == np.float64
    assert got.header is None
    assert got.present.all()
    assert got.present.shape == (2, 3)


def test_a_header_in_any_order_and_of_any_version(tmp_path: Path) -> None:
    text = "{'shape':(2L, ),'fortran_order':False,'descr':'<f8'}"
    numbers = np.array([1.0, 2]).tobytes()
    for data in (npy_header(text, numbers), npy_header(text, numbers, 2), npy_header(text, numbers, 3)):
        np.testing.assert_array_equal(table(tmp_path, "a.npy", data).values, [[1], [2]])


def test_a_one_dimensional_npy_is_a_column(tmp_path: Path) -> None:
    assert table(tmp_path, "a.npy", npy(np.arange(4.0))).values.shape == (4, 1)


class Bomb:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, ("exploded",)


@pytest.mark.parametrize(
    ("data", "code", "words"),
    [
        (npy(np.array([Bomb()], dtype=object), allow_pickle=True), "file-format", "Python objects"),
        (pickle.dumps(Bomb()), "file-format", "no .npy file"),
        (npy(np.array([1j])), "file-format", "complex"),
        (npy(np.array([True])), "file-format", "truth values"),
        (npy(np.array(["x"])), "file-format", "texts"),
        (npy(np.zeros(2, dtype=[("a", "<f8")])), "file-format", "structures"),
        (npy(np.zeros((2, 2, 2))), "file-format", "3 dimensions"),
        (npy(np.array(1.0)), "file-format", "0 dimensions"),
        (npy(np.zeros((0, 3))), "file-format", "empty"),
        (npy(np.array([[1, 2], [3, np.nan]])), "not-finite", "row 2, column 2 is NaN"),
        (npy(np.array([1, np.inf])), "not-finite", "row 2, column 1 is infinity"),
        (npy(np.zeros(8))[:-1], "file-format", "64 bytes"),
        (npy(np.zeros(8)) + b"x", "file-format", "64 bytes"),
        (
            npy_header("{'descr': '<f8', 'fortran_order': False, 'shape': (" + "9" * 4000 + ",)}"),
            "file-format",
            "bytes",
        ),
        (npy_header("{'descr': '<f8', 'fortran_order': False, 'shape': (10**9,)}"), "file-format", ""),
        (
            npy_header("{'descr': '<f8', 'fortran_order': False, 'shape': (9999999999999, 999999999)}"),
            "file-format",
            "",
        ),
        (npy_header("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -8)}", b"x" * 64), "file-format", "header"),
        (npy_header("{'descr': '<f8', 'fortran_order': False, 'shape': (True, 1)}", b"x" * 8), "file-format", "header"),
        # what ends the process when NumPy's own reader meets it
        (npy_header("{'descr': '<M8[Y/0]', 'fortran_order': False, 'shape': (1,)}", b"x" * 8), "file-format", "dates"),
        (npy_header("{'descr': '<f8', 'descr': '<f8', 'shape': (1,)}", b"x" * 8), "file-format", "header"),
        (npy_header("{'descr': '<f3', 'fortran_order': False, 'shape': (1,)}", b"x" * 8), "file-format", "'<f3'"),
        (npy_header("{'descr': '<i999999999', 'fortran_order': False, 'shape': (1,)}"), "file-format", "not read here"),
        (npy_header("__import__('os').mkdir('exploded')"), "file-format", "header"),
        (npy_header("(" * 5000), "file-format", "header"),
        (npy_header("{"), "file-format", "header"),
        (b"\x93NUMPY\x09\x09", "file-format", "header"),
        (b"\x93NUMPY", "file-format", "header"),
        (b"", "file-format", "no .npy file"),
    ],
)
def test_faults_of_an_npy(tmp_path: Path, data: bytes, code: str, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found, findings = attempt(tmp_path, "a.npy", data)
    assert not (tmp_path / "exploded").exists()
    assert found is UNKNOWN
    assert [finding.code for finding in findings] == [code]
    assert words in findings[0].message
    assert findings[0].span == HERE


@given(st.binary(max_size=200), st.integers(0, 150), st.binary(min_size=1, max_size=3))
def test_nothing_but_its_own_error_leaves_a_parser(noise: bytes, at: int, patch: bytes) -> None:
    base = npy(np.arange(6.0).reshape(2, 3))
    mutated = base[:at] + patch + base[at + len(patch) :]
    for data in (noise, b"\x93NUMPY\x01\x00" + noise, mutated):
        try:
            values = parse_npy(data)
        except CellError:
            continue
        assert np.isfinite(values).all()
    for data in (noise, b"from,to,weight\n" + noise):
        with suppress(CellError):
            parse_numbers(data)
        with suppress(CellError):
            parse_edges([data])


def edges(folder: Path, data: str) -> tuple[EdgeTable | Unknown, tuple[Diagnostic, ...]]:
    (folder / "e.csv").write_text(data, encoding="utf-8", newline="")
    findings = Findings()
    return read_edges(NamedFile("e.csv", folder, folder, HERE), findings), findings.sorted()


def test_edges_by_the_names_of_the_columns(tmp_path: Path) -> None:
    got, findings = edges(tmp_path, "Weight,to,delay,from\n0.5,O1,,K1\n,O2,3,K2\n")
    assert findings == ()
    assert got is not UNKNOWN
    assert got.sources == ("K1", "K2")
    assert got.targets == ("O1", "O2")
    assert got.weights.tolist() == [0.5, 1.0]
    assert got.delays.tolist() == [-1, 3]
    assert [*map(got.row, range(len(got)))] == [2, 3]


def test_edges_without_delays(tmp_path: Path) -> None:
    got, _ = edges(tmp_path, "from,to,weight\nK1,O1,-2\n")
    assert got is not UNKNOWN
    assert (got.weights.tolist(), got.delays.tolist()) == ([-2.0], [-1])


def test_edges_without_weights_have_weight_1(tmp_path: Path) -> None:
    for data in ("to,from\nO1,K1\nO1,K2\n", 'from,to\n"K1",O1\nK2,O1\n'):
        got, _ = edges(tmp_path, data)
        assert got is not UNKNOWN
        assert got.weights.tolist() == [1, 1]
        assert (got.sources, got.fault) == (("K1", "K2"), None)


@pytest.mark.parametrize(
    ("data", "code", "words", "hint"),
    [
        ("K1,O1,0.5\n", "file-format", "row 1, column 1: no column is called 'k1'", "the columns are"),
        ("from,to,wieght\n", "file-format", "row 1, column 3", "did you mean 'weight'?"),
        ("from,weight\nA,1\n", "file-format", "no column 'to'", "from,to,weight"),
        ("from,to,to,weight\n", "file-format", "'to' is there twice", None),
        ("from,to,weight\nA,B\n", "file-format", "row 2 has 2 cells, the header 3", None),
        ("source\ttarget\nA\tB\n", "file-format", "no column is called 'source'", "columns: {from: NAME"),
        ("from,to,weight\nA,,1\n", "file-format", "row 2, column 2: the name", None),
        ("from,to,weight\nA,B,1\nA,B,nan\n", "not-finite", "row 3, column 3", "empty cell"),
        ("from,to,weight\nA,B,x\n", "file-format", "row 2, column 3: 'x' is no number", None),
        ("from,to,weight,delay\nA,B,1,1.5\n", "file-format", "row 2, column 4: '1.5' is no delay", None),
        ("from,to,weight,delay\nA,B,1,-1\n", "file-format", "row 2, column 4: '-1' is no delay", None),
        ("", "file-format", "empty", None),
    ],
)
def test_faults_of_edges(tmp_path: Path, data: str, code: str, words: str, hint: str | None) -> None:
    got, findings = edges(tmp_path, data)
    assert got is UNKNOWN or got.fault is not None
    assert [finding.code for finding in findings] == [code]
    assert words in findings[0].message
    assert (hint or "") in (findings[0].hint or "")


def told(name: str, data: str, folder: Path) -> list[str]:
    """What is said of a table, in order, without the name of the file."""
    (folder / name).write_text(data)
    findings = Findings()
    assert read_table(NamedFile(name, folder, folder, HERE), findings) is UNKNOWN
    return [finding.message.partition(": ")[2] for finding in findings.sorted()]


@pytest.mark.parametrize("mark", ["", '"'])
@pytest.mark.parametrize("stretch", [1, 4, 1 << 18])
def test_all_faults_of_a_csv_are_told_in_their_order(
    tmp_path: Path, mark: str, stretch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("neurovis_spec.language.data.cells.STRETCH", stretch)
    data = f"{mark}1{mark},x,nan\n4,y\n1,2,3\n1,2,3,4\n5,6,nan\n\nz,1,inf\n"
    assert told("a.csv", data, tmp_path) == [
        "row 1, column 2: 'x' is no number",
        "row 1, column 3: 'nan' is not finite",
        "row 2 has 2 cells, the first row 3",
        "row 4 has 4 cells, the first row 3",
        "row 5, column 3: 'nan' is not finite",
        "row 6 has 1 cell, the first row 3",
        "row 7, column 1: 'z' is no number",
        "row 7, column 3: 'inf' is not finite",
    ]


def test_no_more_than_twenty_faults_of_a_file_are_told(tmp_path: Path) -> None:
    many = "\n".join(["1,2", *["x,nan"] * 15, *["1"] * 100])
    assert len(told("a.csv", many, tmp_path)) == 20
    assert len(told("a.csv", many.replace("1,2", '"1",2'), tmp_path)) == 20
    got, findings = edges(tmp_path, "from,to,weight\n" + ",B,x\n" * 100)
    assert got is not UNKNOWN
    assert not got.sources
    assert len(findings) == 20


def test_all_faults_of_edges_are_told_and_those_in_order_are_kept(tmp_path: Path) -> None:
    got, findings = edges(tmp_path, "from,to,weight,delay\nA,B,x,-1\nA,B\n,,1,\nA,C,2,\nA,B,nan,0.5\n")
    assert [finding.message.partition(": ")[2] for finding in findings] == [
        "row 2, column 3: 'x' is no number",
        "row 2, column 4: '-1' is no delay (0, 1, 2, … steps)",
        "row 3 has 2 cells, the header 4",
        "row 4, column 1: the name of a neuron is wanted",
        "row 4, column 2: the name of a neuron is wanted",
        "row 6, column 3: 'nan' is not finite",
        "row 6, column 4: '0.5' is no delay (0, 1, 2, … steps)",
    ]
    assert got is not UNKNOWN
    assert got.targets == ("B", "C", "B")
    assert [*map(got.row, range(len(got)))] == [2, 5, 6]


def test_all_faults_of_an_mtx_are_told_by_line(tmp_path: Path) -> None:
    head = "%%MatrixMarket matrix coordinate integer general\n"
    assert told("a.mtx", head + "2 2 4\n3 9 0.5\n1 1 x\n% remark\n1 2 1e999\n\n1 1\n2 2 1", tmp_path) == [
        "line 3: 0.5 is no integer, which line 1 promises",
        "line 3: there is no row 3, only 1 to 2",
        "line 3: there is no column 9, only 1 to 2",
        "line 4: 'x' is no number",
        "line 6: the value is beyond double precision",
        "line 8: 3 numbers are wanted, not 2",
    ]
    assert told("a.mtx", head + "2 2 2\n1 1 1\n1 1 2\n1 2 1\n", tmp_path) == [
        "line 2 promises 2 entries, there are more",
        "line 4: row 1, column 1 is given on line 3 already",
    ]
    assert len(told("a.mtx", head + "9 9 81\n" + "1 1 x\n" * 81, tmp_path)) == 20


def refused(path: str, root: Path, base: Path) -> Diagnostic:
    findings = Findings()
    assert read_table(NamedFile(path, root, base, HERE), findings) is UNKNOWN
    (finding,) = findings.sorted()
    return finding


def test_paths_are_relative_to_the_file_that_names_them(tmp_path: Path) -> None:
    (tmp_path / "library").mkdir()
    (tmp_path / "a.csv").write_text("1\n")
    findings = Findings()
    got = read_table(NamedFile("../a.csv", tmp_path, tmp_path / "library", HERE), findings)
    assert got is not UNKNOWN
    assert refused("a.csv", tmp_path, tmp_path / "library").code == "file-missing"


def test_no_path_leaves_the_root(tmp_path: Path) -> None:
    root = tmp_path / "root"
    (root / "sub").mkdir(parents=True)
    outside = tmp_path / "secret.csv"
    outside.write_text("1\n")
    (tmp_path / "root-2").mkdir()
    (tmp_path / "root-2" / "a.csv").write_text("1\n")
    (root / "link.csv").symlink_to(outside)
    (root / "folder").symlink_to(tmp_path)
    (root / "inner.csv").write_text("7\n")
    (root / "fine.csv").symlink_to(root / "inner.csv")
    for path in (
        "../secret.csv",
        "sub/../../secret.csv",
        "link.csv",
        "folder/secret.csv",
        "../root-2/a.csv",
        str(outside),
        str(root / "inner.csv"),
        "C:\\secret.csv",
        "\\\\host\\share.csv",
    ):
        assert refused(path, root, root).code == "path-outside", path
    assert table(root, "inner.csv", "7\n").values[0, 0] == 7
    assert read_table(NamedFile("fine.csv", root, root, HERE), Findings()) is not UNKNOWN


def test_what_is_no_regular_file_is_never_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[object] = []
    monkeypatch.setattr(os, "open", lambda *arguments: opened.append(arguments))
    (tmp_path / "folder.csv").mkdir()
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "loop.csv").symlink_to(tmp_path / "loop.csv")
    for name, code in (
        ("folder.csv", "file-kind"),
        ("pipe.csv", "file-kind"),
        ("loop.csv", "file-unreadable"),
        ("none.csv", "file-missing"),
        ("pipe.csv/x.csv", "file-missing"),
        ("", "file-format"),
        ("a\0.csv", "file-missing"),
        ("x" * 5000 + ".csv", "file-"),
        ("a.md", "file-format"),
    ):
        assert refused(name, tmp_path, tmp_path).code.startswith(code), name
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    assert refused("zero.csv", tmp_path, tmp_path).code == "path-outside"
    assert refused("zero.csv", Path("/"), tmp_path).code == "file-kind"
    assert opened == []


def test_a_missing_file_is_answered_with_one_that_is_alike(tmp_path: Path) -> None:
    (tmp_path / "centres.csv").write_text("1\n")
    finding = refused("centers.csv", tmp_path, tmp_path)
    assert finding.hint == "did you mean 'centres.csv'?"
    assert "'centers.csv' does not exist" in finding.message


def test_a_huge_file_is_refused_by_its_size(tmp_path: Path) -> None:
    with (tmp_path / "huge.csv").open("wb") as stream:
        stream.truncate(1 << 40)
    assert refused("huge.csv", tmp_path, tmp_path).code == "too-large"


def test_all_faults_of_a_large_edge_file_are_told() -> None:
    found = parse_edges([b"from,to,weight\nA,B,x\n" + b"A,B,1\n" * 200_000 + b"A\nA,B,1,2,3,4\n"])
    assert found.fault is not None
    assert [str(fault) for fault in (found.fault, *found.fault.others)] == [
        "row 2, column 3: 'x' is no number",
        "row 200003 has 1 cell, the header 3",
        "row 200004 has 6 cells, the header 3",
    ]
