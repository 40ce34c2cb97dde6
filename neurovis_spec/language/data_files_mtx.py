"""A matrix from the bytes of an ``.mtx`` file: Matrix Market, coordinate or array.

In: bytes. Out: Table; a cell that a coordinate file leaves out is absent, and so is the diagonal of a skew-symmetric
matrix, which no file states. A fault is a CellError that names the line, from 1. Numbers are read in one go; lines are
counted only for a fault. Source: R. Boisvert, R. Pozo, K. Remington, The Matrix Market exchange formats (1996).
"""

from __future__ import annotations

import io
import math
import re
import warnings
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.diagnostics import nearest
from neurovis_spec.language.data_files_table import (
    SPARSER,
    CellError,
    Room,
    Table,
    check_cells,
    quoted,
    repeated,
    scattered,
)

_BANNER: Final = "%%matrixmarket"
_LONGEST_LINE: Final = 1024
_LONGEST_PREFACE: Final = 1 << 20
_LONGEST_SIZE: Final = 15
_NUMBER: Final = rb"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_NOT_FINITE: Final = re.compile(rb"[-+]?(?:nan|inf|infinity)", re.IGNORECASE)
_PLAIN: Final = b"0123456789+-.eE \t\r\n"
#: lines that say nothing; without steps back, so that a file of nothing else takes no memory
_NOTHING: Final = re.compile(rb"(?:[ \t\r]*+(?:%[^\n]*+)?\n)*+")
_SHORT_LINES: Final = re.compile(rb"(?:[^\n]{0,%d}+(?:\n|\Z))*+" % _LONGEST_LINE)
_COMMENT: Final = re.compile(rb"^[ \t]*+%[^\n]*+", re.MULTILINE)
_WORDS: Final = (
    ("matrix",),
    ("coordinate", "array"),
    ("real", "integer", "pattern"),
    ("general", "symmetric", "skew-symmetric"),
)
_REFUSED: Final = {
    "vector": "a vector is no matrix",
    "complex": "complex numbers are no weights",
    "hermitian": "complex numbers are no weights",
}


@dataclass(frozen=True, slots=True)
class _Head:
    """What the first line and the line of sizes say."""

    sparse: bool
    field: str
    symmetry: str
    rows: int
    columns: int
    entries: int

    @property
    def width(self) -> int:
        """How many numbers a line has."""
        return (2 if self.sparse else 0) + (self.field != "pattern")


@dataclass(frozen=True, slots=True)
class _Body:
    """The lines after those, comments blanked out; ``line`` is the number of the first one."""

    data: bytes
    line: int

    def check(self) -> None:
        """Refuse lines that are longer than any that holds three numbers. Raises CellError."""
        match = _SHORT_LINES.match(self.data)
        assert match is not None
        if match.end() < len(self.data):
            number = self.line + self.data.count(b"\n", 0, match.end())
            raise CellError("file-format", f"line {number} is longer than {_LONGEST_LINE} bytes")

    def line_of(self, entry: int) -> int:
        """The line of an entry, counted from 0."""
        for number, text in enumerate(io.BytesIO(self.data), self.line):
            if text.strip():
                if not entry:
                    return number
                entry -= 1
        raise AssertionError("there are as many lines as entries")


def parse_mtx(data: bytes, room: Room | None = None) -> Table:
    """The matrix; in a pattern every entry is 1. Raises CellError."""
    if data.startswith(b"\xef\xbb\xbf"):
        data = data[3:]
    words = _banner(data)
    preface = _NOTHING.match(data, data.find(b"\n") + 1 or len(data), _LONGEST_PREFACE)
    start = len(data) if preface is None else preface.end()
    line = data.count(b"\n", 0, start) + 1
    sizes, _, rest = data[start:].partition(b"\n")
    head = _sizes(words, sizes[:_LONGEST_LINE], line)
    if room is not None:
        room(head.rows * head.columns)
    body = _Body(_COMMENT.sub(b"", rest) if b"%" in rest else rest, line + 1)
    body.check()
    i, j, values = _entries(head, body, _numbers(head, body, line))
    if head.symmetry != "general":
        other = i != j
        mirrored = -values[other] if head.symmetry == "skew-symmetric" else values[other]
        i, j = np.concatenate([i, j[other]]), np.concatenate([j, i[other]])
        values = np.concatenate([values, mirrored])
    return scattered((head.rows, head.columns), i, j, values)


def _banner(data: bytes) -> tuple[str, ...]:
    """The four words of the first line, in lower case."""
    words = data[:_LONGEST_LINE].partition(b"\n")[0].decode("latin-1").lower().split()
    if not words or words[0] != _BANNER:
        hint = "its first line is such as '%%MatrixMarket matrix coordinate real general'"
        raise CellError("file-format", "this is no Matrix Market file", hint)
    if len(words) != 1 + len(_WORDS):
        message = f"line 1 has {len(words) - 1} words after %%MatrixMarket; four are wanted"
        raise CellError("file-format", message, "such as '%%MatrixMarket matrix coordinate real general'")
    for word, known in zip(words[1:], _WORDS, strict=True):
        if word in _REFUSED:
            raise CellError("file-format", f"line 1: '{word}': {_REFUSED[word]}", "known: " + ", ".join(known))
        if word not in known:
            close = nearest(word, known, 1)
            hint = f"did you mean '{close[0]}'?" if close else "known: " + ", ".join(known)
            raise CellError("file-format", f"line 1: {quoted(word)} is not known here", hint)
    _, form, field, symmetry = words[1:]
    needy = form if form == "array" else symmetry
    if field == "pattern" and needy in ("array", "skew-symmetric"):
        raise CellError("file-format", f"line 1: a pattern has no values, and '{needy}' needs them")
    return tuple(words[2:])


def _sizes(words: tuple[str, ...], text: bytes, line: int) -> _Head:
    form, field, symmetry = words
    sparse = form == "coordinate"
    sizes = text.split()
    if len(sizes) != 2 + sparse or not all(size.isdigit() for size in sizes):
        wanted = "rows, columns and entries" if sparse else "rows and columns"
        raise CellError("file-format", f"line {line}: the numbers of {wanted} are wanted")
    if max(len(size) for size in sizes) > _LONGEST_SIZE:
        raise CellError("too-large", f"line {line}: {quoted(max(sizes, key=len).decode())} is more than any matrix has")
    rows, columns = int(sizes[0]), int(sizes[1])
    if not rows or not columns:
        raise CellError("file-format", f"line {line}: a matrix has one row and one column at least")
    if symmetry != "general" and rows != columns:
        raise CellError("file-format", f"line {line}: {rows} × {columns} cannot be {symmetry}")
    check_cells(rows * columns, hint=SPARSER)
    lower = {"general": rows * columns, "symmetric": rows * (rows + 1) // 2, "skew-symmetric": rows * (rows - 1) // 2}
    entries = int(sizes[2]) if sparse else lower[symmetry]
    if entries > lower[symmetry]:
        message = f"line {line} promises {entries} entries; a {symmetry} matrix of this size has {lower[symmetry]}"
        raise CellError("file-format", message)
    return _Head(sparse, field, symmetry, rows, columns, entries)


def _numbers(head: _Head, body: _Body, line: int) -> NDArray[np.float64]:
    """The numbers of all lines: (entries, width). Raises CellError."""
    if not body.data.strip():
        table = np.zeros((0, head.width))
    elif body.data.translate(None, _PLAIN):
        raise _bad_line(head, body)
    else:
        try:
            # one line more than is promised, and no more than that
            most = head.entries + 1
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # which would say that empty lines are not counted
                table = np.loadtxt(io.BytesIO(body.data), ndmin=2, comments=None, dtype=np.float64, max_rows=most)
        except (ValueError, OverflowError):
            raise _bad_line(head, body) from None
        if table.shape[1] != head.width:
            raise _bad_line(head, body)
    if len(table) != head.entries:
        there = "there are more" if len(table) > head.entries else f"there are {len(table)}"
        raise CellError("file-format", f"line {line} promises {head.entries} entries, {there}")
    return table


def _bad_line(head: _Head, body: _Body) -> CellError:
    """The first line that does not hold as many numbers as it should."""
    good = rb"(?:[ \t\r]*+(?:%b(?:[ \t]++%b){%d}[ \t\r]*+)?+\n)*+" % (_NUMBER, _NUMBER, head.width - 1)
    match = re.match(good, body.data)
    assert match is not None
    number = body.line + body.data.count(b"\n", 0, match.end())
    words = body.data[match.end() : match.end() + _LONGEST_LINE].partition(b"\n")[0].split()
    for word in words:
        if not re.fullmatch(_NUMBER, word):
            text = quoted(word.decode("utf-8", "replace"))
            if _NOT_FINITE.fullmatch(word):
                return CellError("not-finite", f"line {number}: {text} is not finite")
            return CellError("file-format", f"line {number}: {text} is no number")
    wanted = "1 number is" if head.width == 1 else f"{head.width} numbers are"
    return CellError("file-format", f"line {number}: {wanted} wanted, not {len(words)}")


def _entries(
    head: _Head, body: _Body, table: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Table and columns (from 0) and values, as the file states them. Raises CellError."""
    values = np.ones(len(table)) if head.field == "pattern" else table[:, -1]
    whole = np.isfinite(values) & ((values == np.rint(values)) if head.field == "integer" else True)
    if not whole.all():
        entry = int(np.argmin(whole))
        line = body.line_of(entry)
        if not math.isfinite(values[entry]):
            raise CellError("not-finite", f"line {line}: the value is beyond double precision")
        raise CellError("file-format", f"line {line}: {values[entry]:g} is no integer, which line 1 promises")
    if not head.sparse:
        return (*_dense_places(head), values)
    for column, size, what in ((0, head.rows, "row"), (1, head.columns, "column")):
        given = table[:, column]
        fits = (given >= 1) & (given <= size) & (given == np.rint(given))
        if not fits.all():
            entry = int(np.argmin(fits))
            message = f"line {body.line_of(entry)}: there is no {what} {given[entry]:g}, only 1 to {size}"
            raise CellError("file-format", message)
    i, j = table[:, 0].astype(np.int64) - 1, table[:, 1].astype(np.int64) - 1
    _check_once(head, body, i, j)
    return i, j, values


def _dense_places(head: _Head) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Table and columns of an array's cells, column by column; of a symmetric one from the diagonal down."""
    if head.symmetry == "general":
        j, i = np.divmod(np.arange(head.entries), head.rows)
    else:
        j, i = np.triu_indices(head.rows, 1 if head.symmetry == "skew-symmetric" else 0)
    return i, j


def _check_once(head: _Head, body: _Body, i: NDArray[np.int64], j: NDArray[np.int64]) -> None:
    """No cell is given twice, not even by way of the symmetry."""
    if head.symmetry == "skew-symmetric" and (i == j).any():
        line = body.line_of(int(np.argmax(i == j)))
        raise CellError("file-format", f"line {line}: the diagonal of a skew-symmetric matrix is not given")
    low, high = (np.minimum(i, j), np.maximum(i, j)) if head.symmetry != "general" else (i, j)
    twice = repeated(low, high, head.columns)
    if twice is not None:
        first, second = (body.line_of(entry) for entry in twice)
        cell = f"row {i[twice[1]] + 1}, column {j[twice[1]] + 1}"
        by = "" if (i[twice[0]], j[twice[0]]) == (i[twice[1]], j[twice[1]]) else " by way of the symmetry"
        raise CellError("file-format", f"line {second}: {cell} is given on line {first} already{by}")
