"""Archives of arrays: which array is read, sparse matrices, and every way in which an archive may lie."""

from __future__ import annotations

import os
import pickle
import struct
import tracemalloc
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from data_attempts import HERE, THERE, attempt, fault, npy, npz, table, zipped
from hypothesis import given
from hypothesis import strategies as st

from neurovis_spec.language.data.npy import MOST_MEMBERS, parse_npz
from neurovis_spec.language.data.table import CellError
from neurovis_spec.language.unknown import UNKNOWN

MATRIX = np.array([[1.0, -2.5, 0.0], [4.0, 5.0, 1e-300]])


@pytest.mark.parametrize("compress", [False, True])
def test_the_only_array_is_read_without_a_key_and_any_with_its_own(tmp_path: Path, compress: bool) -> None:
    got = table(tmp_path, "a.npz", npz(compress, w=MATRIX))
    np.testing.assert_array_equal(got.values, MATRIX)
    assert got.present.all()
    assert got.header is None
    two = npz(compress, w=MATRIX, b=np.arange(3, dtype=">i2"))
    np.testing.assert_array_equal(table(tmp_path, "b.npz", two, "w").values, MATRIX)
    np.testing.assert_array_equal(table(tmp_path, "b.npz", two, "b").values, [[0], [1], [2]])


def test_what_numpy_writes_is_read(tmp_path: Path) -> None:
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", w=MATRIX)
        np.testing.assert_array_equal(parse_npz((tmp_path / "a.npz").read_bytes()).values, MATRIX)


def test_what_is_no_array_does_not_count(tmp_path: Path) -> None:
    data = zipped({"readme.txt": b"hello", "w.npy": npy(MATRIX)})
    np.testing.assert_array_equal(table(tmp_path, "a.npz", data).values, MATRIX)
    assert "holds no array" in fault(tmp_path, "b.npz", zipped({"readme.txt": b"hello"})).message


def test_several_arrays_ask_for_a_key_and_an_unknown_one_is_answered_with_the_nearest(tmp_path: Path) -> None:
    data = npz(weights=MATRIX, bias=np.zeros(3))
    finding = fault(tmp_path, "a.npz", data)
    assert (finding.code, finding.span) == ("missing-key", HERE)
    assert "2 arrays: weights, bias" in finding.message
    assert finding.hint == "name one of them with 'key'"
    for key, hint in (("wieghts", "did you mean 'weights'?"), ("x", "its arrays: weights, bias")):
        found, (finding,) = attempt(tmp_path, "a.npz", data, key)
        assert found is UNKNOWN
        assert (finding.code, finding.span, finding.hint) == ("unknown-array", THERE, hint)
    (finding,) = attempt(tmp_path, "b.npz", zipped({"readme.txt": b""}), "x")[1]
    assert finding.hint == "it holds none"


@pytest.mark.parametrize("name", ["a.csv", "a.npy", "a.mtx"])
def test_a_key_beside_a_file_of_one_table(tmp_path: Path, name: str) -> None:
    found, (finding,) = attempt(tmp_path, name, "1\n", "x")
    assert found is UNKNOWN
    assert (finding.code, finding.span) == ("useless-key", THERE)


# ---- sparse matrices ----------------------------------------------------------------------------------------------

#: row 0: 5 at column 1; row 1: nothing; row 2: a 0 at column 0 and 7 at column 2
SPARSE = np.array([[np.nan, 5, np.nan], [np.nan, np.nan, np.nan], [0, np.nan, 7]])
CSR = {
    "indices": np.array([1, 0, 2], dtype=np.int32),
    "indptr": np.array([0, 1, 1, 3], dtype=np.int32),
    "format": np.array(b"csr"),
    "shape": np.array([3, 3]),
    "data": np.array([5.0, 0, 7]),
}
CSC = {**CSR, "format": np.array(b"csc"), "indices": np.array([2, 0, 2]), "indptr": np.array([0, 1, 2, 3])}
CSC["data"] = np.array([0.0, 5, 7])
COO = {"row": np.array([2, 0, 2]), "col": np.array([2, 1, 0]), "format": np.array("coo"), "shape": CSR["shape"]}
COO["data"] = np.array([7, 5, 0], dtype=np.int8)


@pytest.mark.parametrize("arrays", [CSR, CSC, COO], ids=["csr", "csc", "coo"])
def test_what_a_sparse_matrix_leaves_out_is_absent(tmp_path: Path, arrays: dict[str, np.ndarray]) -> None:
    got = table(tmp_path, "a.npz", npz(True, **arrays))
    np.testing.assert_array_equal(got.values, SPARSE)
    np.testing.assert_array_equal(table(tmp_path, "a.npz", npz(**arrays), "data").values[:, 0], arrays["data"])


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"format": np.array(b"bsr")}, "format 'bsr'"),
        ({"format": np.array([b"csr"])}, "'format': an array of 1 dimensions where none are wanted"),
        ({"format": np.array(3)}, "'format': an array of integers is no array of byte strings or texts"),
        ({"shape": np.array([3])}, "two sizes"),
        ({"shape": np.array([3, 0])}, "two sizes"),
        ({"shape": np.array([3, 2**63], dtype=np.uint64)}, "two sizes"),
        ({"shape": np.array([10**9, 10**9])}, "33,554,432 cells"),
        ({"shape": np.array([3.0, 3.0])}, "'shape': an array of real numbers is no array of integers"),
        ({"data": np.array([1.0, 2])}, "'indptr' does not ascend from 0 to the number of values, 2"),
        ({"data": np.array([1.0, np.nan, 2])}, "row 3, column 1 is NaN"),
        ({"data": np.array([1.0, 2, -np.inf])}, "row 3, column 3 is infinity"),
        ({"data": np.array([1j, 2, 3])}, "'data': an array of complex numbers"),
        ({"data": np.array([[1.0, 2, 3]])}, "'data': an array of 2 dimensions where one is wanted"),
        ({"indices": np.array([1, 0])}, "'indices' has 2 indices for 3 values"),
        ({"indices": np.array([1, 0, 3])}, "'indices' holds the index 3, outside 0 … 2"),
        ({"indices": np.array([1, -1, 2])}, "'indices' holds the index -1"),
        ({"indices": np.array([1, 2, 2])}, "row 3, column 3 has two values"),
        ({"indptr": np.array([0, 1, 3])}, "'indptr' has 3 numbers; 4 are wanted"),
        ({"indptr": np.array([0, 2, 1, 3])}, "'indptr' does not ascend"),
        ({"indptr": np.array([1, 1, 1, 3])}, "'indptr' does not ascend"),
        ({"format": np.array(b"coo")}, "no array 'row'"),
    ],
)
def test_faults_of_a_sparse_matrix(tmp_path: Path, changed: dict[str, np.ndarray], words: str) -> None:
    assert words in fault(tmp_path, "a.npz", npz(**{**CSR, **changed})).message


@st.composite
def entries(draw: st.DrawFn) -> tuple[int, int, list[tuple[int, int]], list[float]]:
    """Sizes, distinct cells in any order, and their numbers."""
    rows, columns = draw(st.integers(1, 5)), draw(st.integers(1, 5))
    cells = st.tuples(st.integers(0, rows - 1), st.integers(0, columns - 1))
    chosen = draw(st.lists(cells, unique=True))
    number = st.floats(allow_nan=False, allow_infinity=False)
    return rows, columns, chosen, draw(st.lists(number, min_size=len(chosen), max_size=len(chosen)))


@given(entries())
def test_the_three_formats_say_the_same(made: tuple[int, int, list[tuple[int, int]], list[float]]) -> None:
    rows, columns, cells, numbers = made
    expected = np.full((rows, columns), np.nan)
    for cell, number in zip(cells, numbers, strict=True):
        expected[cell] = number
    about = {"shape": np.array([rows, columns]), "data": np.array(numbers, dtype=np.float64)}
    i = np.array([cell[0] for cell in cells], dtype=np.int64)
    j = np.array([cell[1] for cell in cells], dtype=np.int64)
    archives = [npz(format=np.array("coo"), row=i, col=j, **about)]
    for kind, outer, inner, size in (("csr", i, j, rows), ("csc", j, i, columns)):
        order = np.argsort(outer, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(outer, minlength=size))]).astype(np.int64)
        about["data"] = np.array(numbers, dtype=np.float64)[order]
        archives.append(npz(format=np.array(kind), indices=inner[order], indptr=starts, **about))
    for archive in archives:
        np.testing.assert_array_equal(parse_npz(archive).values, expected)


# ---- archives that lie --------------------------------------------------------------------------------------------


class Bomb:
    """What a pickle would call when it is loaded."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, ("exploded",)


def patched(data: bytes, signature: bytes, offset: int, code: str, value: int) -> bytes:
    """An archive with one number of its first record of this kind replaced."""
    at = data.index(signature) + offset
    new = struct.pack("<" + code, value)
    return data[:at] + new + data[at + len(new) :]


def twice() -> bytes:
    """Two members of one name, made from two of equal length."""
    return zipped({"w.npy": npy(MATRIX), "v.npy": npy(MATRIX)}).replace(b"v.npy", b"w.npy")


def promising(count: int, size: int | None = None) -> bytes:
    """An archive of a thousand bytes whose header promises ``count`` and whose directory ``size``, else as many."""
    header = f"{{'descr': '|u1', 'fortran_order': False, 'shape': ({count},)}}\n".encode()
    beginning = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header
    archive = zipped({"w.npy": beginning + b"0" * 1000})
    return patched(archive, ENTRY, 24, "L", len(beginning) + (count if size is None else size))


LOCAL, ENTRY, END = b"PK\x03\x04", b"PK\x01\x02", b"PK\x05\x06"
GOOD, PACKED = npz(w=MATRIX), npz(True, w=np.zeros((50, 50)))
#: two members, the second of which is said to begin where the first one does
OVERLAPPING = patched(npz(a=MATRIX, w=MATRIX)[::-1], ENTRY[::-1], -42, "L", 0)[::-1]


@pytest.mark.parametrize(
    ("data", "code", "words"),
    [
        (zipped({"w.npy": npy(np.array([Bomb()], dtype=object), allow_pickle=True)}), "file-format", "Python objects"),
        (zipped({"w.npy": pickle.dumps(Bomb())}), "file-format", "no .npy file"),
        (pickle.dumps(Bomb()), "file-format", "no .npz file"),
        (npy(MATRIX), "file-format", "no .npz file"),
        (b"", "file-format", "no .npz file"),
        (GOOD[:-1], "file-format", "end is missing"),
        (GOOD[:40], "file-format", "end is missing"),
        (GOOD[1:], "file-format", "damaged"),
        (patched(GOOD, END, 16, "L", 0xFFFFFFFF), "file-format", "damaged"),
        (patched(GOOD, END, 12, "L", 10), "file-format", "damaged"),
        (patched(GOOD, ENTRY, 42, "L", 10**9), "file-format", "damaged"),
        (patched(GOOD, ENTRY, 42, "L", 7), "file-format", "damaged"),
        (patched(GOOD, ENTRY, 24, "L", 0xFFFFFFFF), "file-format", "promises 48 bytes"),
        (patched(GOOD, LOCAL, 28, "H", 60_000), "file-format", "damaged"),
        (patched(GOOD, ENTRY, 8, "H", 1), "file-format", "encrypted"),
        (patched(GOOD, ENTRY, 10, "H", 12), "file-format", "method"),
        (patched(GOOD, ENTRY, 16, "L", 0), "file-format", "checksum"),
        (patched(GOOD, ENTRY, 24, "L", 177), "file-format", "promises 48 bytes"),
        (patched(GOOD, ENTRY, 20, "L", 150), "file-format", "checksum"),
        (patched(PACKED, ENTRY, 20, "L", 5), "file-format", "cannot be unpacked"),
        (patched(PACKED, LOCAL, 55, "L", 0xFFFFFFFF), "file-format", "cannot be unpacked"),
        (zipped({"w.npy": npy(MATRIX)}, zipfile.ZIP_BZIP2), "file-format", "method"),
        (zipped({"w.npy": npy(MATRIX)}, zipfile.ZIP_LZMA), "file-format", "method"),
        (twice(), "file-format", "'w.npy' twice"),
        (zipped({f"{n}.txt": b"" for n in range(MOST_MEMBERS + 1)}, zipfile.ZIP_STORED), "too-large", "members"),
        (zipped({"\x1b[2J.npy": b"x", "b.npy": b""}), "missing-key", "2 arrays: ?[2J, b"),
        (npz(w=np.array([1, np.nan])), "not-finite", "row 2, column 1 is NaN"),
        (npz(w=np.array("text")), "file-format", "texts"),
        (npz(w=np.zeros((0, 3))), "file-format", "empty"),
        (npz(w=np.array(1.0)), "file-format", "0 dimensions"),
        # 4 GB; the same in the directory alone; in the header alone; what could be read, but is not there
        (promising(4_294_967_000), "too-large", "33,554,432 cells"),
        (promising(1000, 4_294_967_000), "file-format", "promises 1000 bytes"),
        (promising(4_294_967_000, 1000), "file-format", "promises 4294967000 bytes"),
        (promising(20_000_000), "file-format", "does not unpack to"),
    ],
)
def test_faults_of_an_archive(
    tmp_path: Path, data: bytes, code: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    finding = fault(tmp_path, "a.npz", data)
    assert not (tmp_path / "exploded").exists()
    assert finding.code == code
    assert words in finding.message


@pytest.mark.parametrize(
    "data",
    [
        b"x" + GOOD,
        patched(GOOD, END, 10, "H", 0xFFFF),
        patched(patched(GOOD, END, 10, "H", 2), END, 8, "H", 2),
        patched(GOOD, END, 4, "H", 1),
        patched(GOOD, ENTRY, 28, "H", 60_000),
        patched(GOOD, ENTRY, 20, "L", 10**9),
    ],
)
def test_an_archive_that_counts_wrongly_is_read_all_the_same(data: bytes) -> None:
    np.testing.assert_array_equal(parse_npz(data, "w").values, MATRIX)


def test_members_that_share_their_bytes_are_refused() -> None:
    with pytest.raises(CellError, match=r"'w\.npy' is damaged"):
        parse_npz(OVERLAPPING, "w")


def test_a_bomb_takes_no_memory(tmp_path: Path) -> None:
    """64 MB of zeros in 64 KB, whose header is none or promises another size, are never unpacked."""
    wrong = npy(np.zeros(10))[:-80]
    for content in (bytes(1 << 26), wrong + bytes(1 << 26)):
        data = zipped({"w.npy": content})
        tracemalloc.start()
        try:
            fault(tmp_path, "a.npz", data)
            assert tracemalloc.get_traced_memory()[1] < 1 << 25  # a file is read by 16 MB
        finally:
            tracemalloc.stop()


@given(st.data())
def test_nothing_but_its_own_error_leaves_the_parser(data: st.DataObject) -> None:
    base = data.draw(st.sampled_from([GOOD, PACKED, npz(**CSR), npz(True, **COO)]))
    changed = bytearray(base)
    for _ in range(data.draw(st.integers(1, 4))):
        # most of an archive's bytes are those of its directory, at the end
        place = data.draw(st.integers(0, len(changed) - 1) | st.integers(1, 100).map(lambda n: len(base) - n))
        changed[place] = data.draw(st.integers(0, 255))
    for tried in (bytes(changed), bytes(changed[: data.draw(st.integers(0, len(base)))]), base[:-22] + base[-30:]):
        with suppress(CellError):
            got = parse_npz(tried)
            assert np.isfinite(got.values[got.present]).all()
