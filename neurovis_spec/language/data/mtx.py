"""A matrix from the bytes of an ``.mtx`` file: Matrix Market, coordinate or array.

In: bytes. Out: Table; a cell that a coordinate file leaves out is absent, and so is the diagonal of a skew-symmetric
matrix, which no file states. A fault is a CellError that names the line, from 1, and holds those behind it. Numbers are
read in one go; lines are counted only for a fault. Source: R. Boisvert, R. Pozo, K. Remington, The Matrix Market
exchange formats (1996).
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.language.data.cells import below, stretches_of
from neurovis_spec.language.data.table import (
    MOST_FAULTS,
    SPARSER,
    CellError,
    Faults,
    Room,
    Table,
    check_cells,
    quoted,
    repeated,
    scattered,
)
from neurovis_spec.likeness import nearest

_BANNER: Final = "%%matrixmarket"
_LONGEST_LINE: Final = 1024
_LONGEST_SIZE: Final = 15
_NUMBER: Final = re.compile(rb"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE: Final = re.compile(rb"[-+]?(?:nan|inf|infinity)", re.IGNORECASE)
_PLAIN: Final = b"0123456789+-.eE \t\r\n"
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


def _in_line(line: int, message: str, code: str = "file-format", hint: str | None = None) -> CellError:
    """What is wrong with a line."""
    return CellError(code, f"line {line}: {message}", hint, (line, 0))


def parse_mtx(data: bytes, room: Room | None = None) -> Table:
    """The matrix; in a pattern every entry is 1. Raises CellError."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    file = io.BytesIO(data)
    words = _banner(file.readline())
    line, sizes = 2, file.readline()
    while sizes and (not sizes.strip() or sizes.lstrip().startswith(b"%")):
        line, sizes = line + 1, file.readline()
    head = _sizes(words, sizes[:_LONGEST_LINE], line)
    if room is not None:
        room(head.rows * head.columns)
    faults = Faults()
    lines, table = _numbers(data, line, head, faults)
    if len(table) != head.entries and not faults:
        there = "there are more" if len(table) > head.entries else f"there are {len(table)}"
        faults.note(CellError("file-format", f"line {line} promises {head.entries} entries, {there}", at=(line, 0)))
    i, j, values = _entries(head, lines, table, faults)
    faults.check()
    if head.symmetry != "general":
        other = i != j
        mirrored = -values[other] if head.symmetry == "skew-symmetric" else values[other]
        i, j = np.concatenate([i, j[other]]), np.concatenate([j, i[other]])
        values = np.concatenate([values, mirrored])
    return scattered((head.rows, head.columns), i, j, values)


def _banner(line: bytes) -> tuple[str, ...]:
    """What the first line says: form, field and symmetry."""
    words = line[:_LONGEST_LINE].decode("latin-1").lower().split()
    if not words or words[0] != _BANNER:
        hint = "its first line is such as '%%MatrixMarket matrix coordinate real general'"
        raise CellError("file-format", "this is no Matrix Market file", hint)
    if len(words) != 1 + len(_WORDS):
        message = f"line 1 has {len(words) - 1} words after %%MatrixMarket; four are wanted"
        raise CellError("file-format", message, "such as '%%MatrixMarket matrix coordinate real general'")
    for word, known in zip(words[1:], _WORDS, strict=True):
        if word in _REFUSED:
            raise _in_line(1, f"'{word}': {_REFUSED[word]}", hint="known: " + ", ".join(known))
        if word not in known:
            close = nearest(word, known, 1)
            hint = f"did you mean '{close[0]}'?" if close else "known: " + ", ".join(known)
            raise _in_line(1, f"{quoted(word)} is not known here", hint=hint)
    _, form, field, symmetry = words[1:]
    needy = form if form == "array" else symmetry
    if field == "pattern" and needy in ("array", "skew-symmetric"):
        raise _in_line(1, f"a pattern has no values, and '{needy}' needs them")
    return tuple(words[2:])


def _sizes(words: tuple[str, ...], text: bytes, line: int) -> _Head:
    form, field, symmetry = words
    sparse = form == "coordinate"
    sizes = text.split()
    if len(sizes) != 2 + sparse or not all(size.isdigit() for size in sizes):
        wanted = "rows, columns and entries" if sparse else "rows and columns"
        raise _in_line(line, f"the numbers of {wanted} are wanted")
    if max(len(size) for size in sizes) > _LONGEST_SIZE:
        raise _in_line(line, f"{quoted(max(sizes, key=len).decode())} is more than any matrix has", "too-large")
    rows, columns = int(sizes[0]), int(sizes[1])
    if not rows or not columns:
        raise _in_line(line, "a matrix has one row and one column at least")
    if symmetry != "general" and rows != columns:
        raise _in_line(line, f"{rows} × {columns} cannot be {symmetry}")
    check_cells(rows * columns, hint=SPARSER)
    lower = {"general": rows * columns, "symmetric": rows * (rows + 1) // 2, "skew-symmetric": rows * (rows - 1) // 2}
    entries = int(sizes[2]) if sparse else lower[symmetry]
    if entries > lower[symmetry]:
        message = f"line {line} promises {entries} entries; a {symmetry} matrix of this size has {lower[symmetry]}"
        raise CellError("file-format", message)
    return _Head(sparse, field, symmetry, rows, columns, entries)


def _numbers(data: bytes, number: int, head: _Head, faults: Faults) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """For each entry below the line of this number its line and its numbers; no more than a few entries more than are
    promised. What is wrong with lines is reported."""
    numbers, tables = [np.zeros(0, dtype=np.int32)], [np.zeros((0, head.width))]
    entries = 0
    for first, part in below(stretches_of([data]), number):
        lines = part.split(b"\n")
        table = None if part.translate(None, _PLAIN) else _loaded(lines, head.width)
        if table is not None:
            places = np.arange(first, first + len(lines), dtype=np.int32)
        else:
            places, table = _one_by_one(lines, first, head.width, faults)
        numbers.append(places)
        tables.append(table)
        entries += len(table)
        if entries > head.entries or faults.many:
            break
    return np.concatenate(numbers), np.concatenate(tables)


def _loaded(lines: list[bytes], width: int) -> NDArray[np.float64] | None:
    """The numbers of lines; None where lines are invalid, or empty."""
    if not all(map(bytes.strip, lines)) or max(map(len, lines)) > _LONGEST_LINE:
        return None
    try:
        table = np.loadtxt(lines, ndmin=2, comments=None, dtype=np.float64)
    except (ValueError, OverflowError):
        return None
    return table if table.shape[1] == width else None


def _one_by_one(
    lines: list[bytes], number: int, width: int, faults: Faults
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """The same of lines of which some are empty, or comments, or invalid, which is reported."""
    found: dict[int, list[float]] = {}
    for at, line in enumerate(lines, number):
        words = line.split()
        if len(line) > _LONGEST_LINE:
            faults.note(CellError("file-format", f"line {at} is longer than {_LONGEST_LINE} bytes", at=(at, 0)))
        elif len(words) == width and all(map(_NUMBER.fullmatch, words)):
            found[at] = [*map(float, words)]
        elif words and not words[0].startswith(b"%"):
            faults.note(_bad_line(words, at, width))
        if faults.many:
            break
    return np.array([*found], dtype=np.int32), np.array([*found.values()], dtype=np.float64).reshape(-1, width)


def _bad_line(words: list[bytes], number: int, width: int) -> CellError:
    """What is wrong with a line that does not hold as many numbers as it should."""
    for word in words:
        if not _NUMBER.fullmatch(word):
            shown = quoted(word.decode("utf-8", "replace"))
            if _NOT_FINITE.fullmatch(word):
                return _in_line(number, f"{shown} is not finite", "not-finite")
            return _in_line(number, f"{shown} is no number")
    wanted = "1 number is" if width == 1 else f"{width} numbers are"
    return _in_line(number, f"{wanted} wanted, not {len(words)}")


def _entries(
    head: _Head, lines: NDArray[np.int32], table: NDArray[np.float64], faults: Faults
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Rows and columns (from 0) and values, as the file states them; what is wrong with them is reported."""
    values = np.ones(len(table)) if head.field == "pattern" else table[:, -1]
    finite = np.isfinite(values)
    wrong = [(entry, _BEYOND) for entry in _few(~finite)]
    if head.field == "integer":
        wrong += [
            (entry, f"{values[entry]:g} is no integer, which line 1 promises")
            for entry in _few(finite & (values != np.rint(values)))
        ]
    if head.sparse:
        for column, size, what in ((0, head.rows, "row"), (1, head.columns, "column")):
            given = table[:, column]
            outside = ~((given >= 1) & (given <= size) & (given == np.rint(given)))
            wrong += [(entry, f"there is no {what} {given[entry]:g}, only 1 to {size}") for entry in _few(outside)]
    for entry, message in wrong:
        faults.note(_in_line(int(lines[entry]), message, "not-finite" if message is _BEYOND else "file-format"))
    if not head.sparse:
        faults.check()  # what is missing moves all that is behind it
        return (*_dense_places(head), values)
    if wrong:
        faults.check()
    i, j = table[:, 0].astype(np.int64) - 1, table[:, 1].astype(np.int64) - 1
    _check_once(head, lines, (i, j), faults)
    return i, j, values


_BEYOND: Final = "the value is beyond double precision"


def _few(wrong: NDArray[np.bool_]) -> list[int]:
    """The first entries that are wrong."""
    return [int(entry) for entry in np.flatnonzero(wrong)[:MOST_FAULTS]]


def _dense_places(head: _Head) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns of an array's cells, column by column; of a symmetric one from the diagonal down."""
    if head.symmetry == "general":
        j, i = np.divmod(np.arange(head.entries), head.rows)
    else:
        j, i = np.triu_indices(head.rows, 1 if head.symmetry == "skew-symmetric" else 0)
    return i, j


def _check_once(
    head: _Head, lines: NDArray[np.int32], cells: tuple[NDArray[np.int64], NDArray[np.int64]], faults: Faults
) -> None:
    """No cell is given twice, not even by way of the symmetry; else that is reported."""
    i, j = cells
    if head.symmetry == "skew-symmetric":
        for entry in _few(i == j):
            faults.note(_in_line(int(lines[entry]), "the diagonal of a skew-symmetric matrix is not given"))
    low, high = (np.minimum(i, j), np.maximum(i, j)) if head.symmetry != "general" else (i, j)
    twice = repeated(low, high, head.columns)
    if twice is not None:
        first, second = twice
        cell = f"row {i[second] + 1}, column {j[second] + 1}"
        by = "" if (i[first], j[first]) == (i[second], j[second]) else " by way of the symmetry"
        faults.note(_in_line(int(lines[second]), f"{cell} is given on line {lines[first]} already{by}"))
