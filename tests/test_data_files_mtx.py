"""Matrix Market files: every kind that is read, and every way in which one may be at fault, with its line."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from random import Random

import numpy as np
import pytest
from data_attempts import fault, table
from hypothesis import given
from hypothesis import strategies as st

from neurovis_spec.language.data.mtx import parse_mtx
from neurovis_spec.language.data.table import CellError

NO = np.nan


def first(kind: str) -> str:
    return f"%%MatrixMarket matrix {kind}\n"


@pytest.mark.parametrize(
    ("kind", "body", "expected"),
    [
        ("coordinate real general", "2 3 3\n1 2 0.5\n2 1 -1e-3\n2 3 0\n", [[NO, 0.5, NO], [-1e-3, NO, 0]]),
        ("coordinate integer general", "2 2 2\n2 2 -7\n1 1 3\n", [[3, NO], [NO, -7]]),
        ("coordinate pattern general", "2 3 2\n1 3\n2 1\n", [[NO, NO, 1], [1, NO, NO]]),
        ("coordinate real symmetric", "3 3 3\n1 1 4\n2 1 5\n2 3 6\n", [[4, 5, NO], [5, NO, 6], [NO, 6, NO]]),
        ("coordinate pattern symmetric", "2 2 1\n2 1\n", [[NO, 1], [1, NO]]),
        ("coordinate real skew-symmetric", "3 3 2\n2 1 5\n1 3 6\n", [[NO, -5, 6], [5, NO, NO], [-6, NO, NO]]),
        ("coordinate real general", "1 2 0\n", [[NO, NO]]),
        ("array real general", "2 3\n1\n2\n3\n4\n5\n6\n", [[1, 3, 5], [2, 4, 6]]),
        ("array integer symmetric", "3 3\n1\n2\n3\n4\n5\n6\n", [[1, 2, 3], [2, 4, 5], [3, 5, 6]]),
        ("array real skew-symmetric", "3 3\n1\n2\n3\n", [[NO, -1, -2], [1, NO, -3], [2, 3, NO]]),
        ("array real skew-symmetric", "1 1\n", [[NO]]),
    ],
)
def test_every_kind(tmp_path: Path, kind: str, body: str, expected: list[list[float]]) -> None:
    np.testing.assert_array_equal(table(tmp_path, "a.mtx", first(kind) + body).values, expected)


@pytest.mark.parametrize(
    "text",
    [
        "%%MatrixMarket MATRIX Coordinate Real GENERAL\n2 2 1\n2 1 0.5",
        "\ufeff%%MatrixMarket matrix coordinate real general\n2 2 1\n2 1 0.5\n",
        first("coordinate real general") + "% by hand\n%\n\n  % more\n 2\t2  1 \n\n\t2 1  +.5 \n\n  \n",
        first("coordinate real general") + "2 2 1\n%% a remark: 3 entries\n2 1 5e-1\n% 1 1 1\n",
        (first("coordinate real general") + "2 2 1\n2 1 00.50\n").replace("\n", "\r\n"),
    ],
)
def test_comments_blanks_and_line_ends_do_not_matter(tmp_path: Path, text: str) -> None:
    np.testing.assert_array_equal(table(tmp_path, "a.mtx", text).values, [[NO, NO], [0.5, NO]])


REAL, PATTERN = first("coordinate real general"), first("coordinate pattern general")
SYMMETRIC, SKEW = first("coordinate real symmetric"), first("coordinate real skew-symmetric")


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ("", "file-format", "no Matrix Market file"),
        ("2 2 1\n1 1 1\n", "file-format", "no Matrix Market file"),
        ("%%MatrixMarket matrix coordinate real\n1 1 1\n1 1 1\n", "file-format", "line 1 has 3 words"),
        ("%%MatrixMarket" + " x" * 1000, "file-format", "line 1 has 505 words"),
        ("%%MatrixMarket vector coordinate real general\n", "file-format", "a vector is no matrix"),
        (first("coordinate complex general") + "1 1 1\n1 1 1 0\n", "file-format", "complex numbers are no weights"),
        (first("coordinate complex hermitian") + "1 1 1\n1 1 1 0\n", "file-format", "complex numbers"),
        (first("coordinate real hermitian") + "1 1 1\n1 1 1\n", "file-format", "'hermitian': complex numbers"),
        (first("coordinat real general"), "file-format", "line 1: 'coordinat' is not known here"),
        (first("array pattern general") + "1 1\n", "file-format", "a pattern has no values, and 'array'"),
        (first("coordinate pattern skew-symmetric") + "1 1 0\n", "file-format", "'skew-symmetric' needs them"),
        (REAL, "file-format", "line 2: the numbers of rows, columns and entries are wanted"),
        (REAL + "%\n2 2\n", "file-format", "line 3: the numbers of rows, columns and entries are wanted"),
        (first("array real general") + "2 2 4\n", "file-format", "line 2: the numbers of rows and columns are wanted"),
        (REAL + "2 -2 1\n", "file-format", "line 2: the numbers"),
        (REAL + "2.0 2 1\n", "file-format", "line 2: the numbers"),
        (REAL + "0 2 0\n", "file-format", "line 2: a matrix has one row"),
        (SYMMETRIC + "2 3 0\n", "file-format", "line 2: 2 × 3 cannot be symmetric"),
        (REAL + "1000000000 1000000000 3\n1 1 1\n2 2 2\n3 3 3\n", "too-large", "33,554,432 cells"),
        (first("array real general") + "1000000 1000000\n1\n", "too-large", "33,554,432 cells"),
        (REAL + "1" * 900 + " 1 1\n1 1 1\n", "too-large", "line 2: '111"),
        (REAL + "2 2 999999999\n1 1 1\n", "file-format", "promises 999999999 entries; a general matrix of this size"),
        (SKEW + "2 2 2\n2 1 1\n1 2 -1\n", "file-format", "a skew-symmetric matrix of this size has 1"),
        (REAL + "2 2 2\n1 1 1\n", "file-format", "line 2 promises 2 entries, there are 1"),
        (REAL + "2 2 1\n", "file-format", "line 2 promises 1 entries, there are 0"),
        (REAL + "2 2 1\n1 1 1\n2 2 2\n1 2 3\n", "file-format", "line 2 promises 1 entries, there are more"),
        (first("array real general") + "2 2\n1\n2\n3\n", "file-format", "line 2 promises 4 entries, there are 3"),
        (REAL + "2 2 2\n1 1 1\n%\n\n1 2\n", "file-format", "line 6: 3 numbers are wanted, not 2"),
        (REAL + "2 2 1\n1 1 1 0\n", "file-format", "line 3: 3 numbers are wanted, not 4"),
        (PATTERN + "2 2 1\n1 1 1\n", "file-format", "line 3: 2 numbers are wanted, not 3"),
        (first("array real general") + "1 2\n1 2\n", "file-format", "line 3: 1 number is wanted, not 2"),
        (REAL + "2 2 2\n1 1 1\n1 2 x\n", "file-format", "line 4: 'x' is no number"),
        (REAL + "2 2 2\n1 1 1\n1 2 1.0D+00", "file-format", "line 4: '1.0D+00' is no number"),
        (REAL + "2 2 2\n1 1 1\n1 2 1e\n", "file-format", "line 4: '1e' is no number"),
        (REAL + "2 2 2\n1 1 1\n1 2 --1\n", "file-format", "line 4: '--1' is no number"),
        (REAL + "2 2 1\n1 1 1,5\n", "file-format", "line 3: '1,5' is no number"),
        (REAL + "2 2 1\n1 1 0x1f\n", "file-format", "line 3: '0x1f' is no number"),
        (REAL + "2 2 1\n1 1 ١\n", "file-format", "line 3: '١' is no number"),
        (REAL + "2 2 1\n1 1 \x00\n", "file-format", "line 3: '?' is no number"),
        (REAL + "2 2 1\n1 1 1\r2 2 2\r", "file-format", "line 3: 3 numbers are wanted, not 6"),
        (REAL + "2 2 1\n1 1 NaN\n", "not-finite", "line 3: 'NaN' is not finite"),
        (REAL + "2 2 1\n1 1 -inf\n", "not-finite", "line 3: '-inf' is not finite"),
        (REAL + "2 2 2\n\n1 1 1\n1 2 1e999\n", "not-finite", "line 5: the value is beyond double precision"),
        (REAL + "2 2 1\n1 1 " + "1" * 2000 + "\n", "file-format", "line 3 is longer than 1024 bytes"),
        (first("array integer general") + "2 1\n1\n1.5\n", "file-format", "line 4: 1.5 is no integer"),
        (REAL + "2 3 2\n1 1 1\n3 1 1\n", "file-format", "line 4: there is no row 3, only 1 to 2"),
        (REAL + "2 3 1\n1 0 1\n", "file-format", "line 3: there is no column 0, only 1 to 3"),
        (REAL + "2 3 1\n1 1.5 1\n", "file-format", "line 3: there is no column 1.5"),
        (REAL + "2 3 1\n1 1e300 1\n", "file-format", "line 3: there is no column 1e+300"),
        (REAL + "2 3 3\n2 1 1\n% one\n1 1 5\n2 1 1\n", "file-format", "line 6: row 2, column 1 is given on line 3"),
        (SYMMETRIC + "2 2 2\n2 1 1\n1 2 1\n", "file-format", "line 4: row 1, column 2 is given on line 3 already by"),
        (SKEW + "2 2 1\n2 2 0\n", "file-format", "line 3: the diagonal of a skew-symmetric matrix is not given"),
    ],
)
def test_faults(tmp_path: Path, text: str, code: str, words: str) -> None:
    finding = fault(tmp_path, "a.mtx", text)
    assert finding.code == code
    assert words in finding.message


def test_a_word_that_is_nearly_right_and_a_matrix_too_large_are_helped(tmp_path: Path) -> None:
    assert fault(tmp_path, "a.mtx", first("coordinat real general")).hint == "did you mean 'coordinate'?"
    assert "edges" in str(fault(tmp_path, "a.mtx", REAL + "9000 9000 1\n1 1 1\n").hint)


@st.composite
def grids(draw: st.DrawFn, square: bool = False) -> np.ndarray:
    """A matrix with cells that are left out."""
    rows = draw(st.integers(1, 5))
    columns = rows if square else draw(st.integers(1, 5))
    cell = st.none() | st.floats(allow_nan=False, allow_infinity=False)
    cells = draw(st.lists(cell, min_size=rows * columns, max_size=rows * columns))
    return np.array([NO if one is None else one for one in cells]).reshape(rows, columns)


def written(kind: str, sizes: tuple[int, int], lines: list[str], sparse: bool = True) -> bytes:
    counts = [*map(str, sizes), *([str(len(lines))] if sparse else [])]
    return (first(kind) + " ".join(counts) + "\n" + "\n".join(lines)).encode()


@given(grids(), st.randoms(use_true_random=False))
def test_coordinates_read_back_exactly_in_any_order(grid: np.ndarray, random: Random) -> None:
    lines = [f"{i + 1} {j + 1} {float(grid[i, j])!r}" for i, j in np.argwhere(~np.isnan(grid))]
    random.shuffle(lines)
    got = parse_mtx(written("coordinate real general", grid.shape, lines))
    np.testing.assert_array_equal(got.values, grid)


@given(grids(square=True), st.booleans())
def test_symmetric_files_say_the_same_as_whole_ones(grid: np.ndarray, skew: bool) -> None:
    n = len(grid)
    lower, sign = np.tril(np.ones((n, n), dtype=bool), -1 if skew else 0), -1 if skew else 1
    whole = np.where(lower, grid, sign * grid.T)
    if skew:
        np.fill_diagonal(whole, NO)
    lines = [f"{i + 1} {j + 1} {float(grid[i, j])!r}" for i, j in np.argwhere(lower & ~np.isnan(grid))]
    kind = "skew-symmetric" if skew else "symmetric"
    np.testing.assert_array_equal(parse_mtx(written(f"coordinate real {kind}", grid.shape, lines)).values, whole)
    if not np.isnan(grid[lower]).any():
        lines = [repr(float(grid[i, j])) for j in range(n) for i in range(n) if lower[i, j]]
        got = parse_mtx(written(f"array real {kind}", grid.shape, lines, sparse=False))
        np.testing.assert_array_equal(got.values, whole)


@given(st.data())
def test_nothing_but_its_own_error_leaves_the_parser(data: st.DataObject) -> None:
    base = (SYMMETRIC + "% two\n3 3 2\n1 1 0.5\n3 2 -1e3\n").encode()
    changed = bytearray(base)
    for _ in range(data.draw(st.integers(1, 4))):
        changed[data.draw(st.integers(0, len(changed) - 1))] = data.draw(
            st.sampled_from(b"%\n\r \t0139-+.eE\x00\xffxn")
        )
    for tried in (bytes(changed), base[:50] + data.draw(st.binary(max_size=40)), first("").encode() + bytes(changed)):
        with suppress(CellError):
            got = parse_mtx(tried)
            assert np.isfinite(got.values[got.present]).all()
