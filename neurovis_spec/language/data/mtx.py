"""A matrix from the bytes of an ``.mtx`` file: Matrix Market, coordinate or array.

In: bytes. Out: Table; a cell that a coordinate file leaves out is absent, and so is the diagonal of a skew-symmetric
matrix, which no file states. A fault is a CellError that names the line, from 1, and holds those behind it. Numbers are
read in one go; lines are counted only for a fault. Source: R. Boisvert, R. Pozo, K. Remington, The Matrix Market
exchange formats (1996).
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.diagnostics import nearest
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

    def lines_of(self, entries: Collection[int]) -> dict[int, int]:
        """The lines of entries, which are counted from 0."""
        found: dict[int, int] = {}
        wanted, entry = set(entries), 0
        for number, text in enumerate(io.BytesIO(self.data), self.line):
            if len(found) == len(wanted):
                break
            if text.strip():
                if entry in wanted:
                    found[entry] = number
                entry += 1
        return found


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
    faults = Faults()
    body, table = _numbers(head, body, line, faults)
    i, j, values = _entries(head, body, table, faults)
    faults.check()
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


def _numbers(head: _Head, body: _Body, line: int, faults: Faults) -> tuple[_Body, NDArray[np.float64]]:
    """The numbers of all lines, (entries, width), and the lines, those invalid blanked out, which is reported."""
    table = _loaded(head, body)
    if table is None:
        body = _without_bad_lines(head, body, faults)
        table = _loaded(head, body)
    if table is None:  # loadtxt and we do not agree on what is a number
        raise CellError("file-format", f"the lines from {body.line} on hold something else than numbers")
    if len(table) != head.entries and not faults:
        there = "there are more" if len(table) > head.entries else f"there are {len(table)}"
        faults.note(line, CellError("file-format", f"line {line} promises {head.entries} entries, {there}"))
    return body, table


def _loaded(head: _Head, body: _Body) -> NDArray[np.float64] | None:
    """The numbers of all lines, one line more than is promised at most; None where lines are invalid."""
    if not body.data.strip():
        return np.zeros((0, head.width))
    if body.data.translate(None, _PLAIN):
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # which would say that empty lines are not counted
            most = head.entries + 1
            table = np.loadtxt(io.BytesIO(body.data), ndmin=2, comments=None, dtype=np.float64, max_rows=most)
    except (ValueError, OverflowError):
        return None
    return table if table.shape[1] == head.width else None


def _without_bad_lines(head: _Head, body: _Body, faults: Faults) -> _Body:
    """The lines without those that do not hold as many numbers as they should, which are reported, and without what is
    behind the last one that is."""
    line = rb"[ \t\r]*(?:%b(?:[ \t]+%b){%d}[ \t\r]*)?(?:\n|\Z)" % (_NUMBER, _NUMBER, head.width - 1)
    good = re.compile(rb"(?:%b){0,%d}" % (line, _TOGETHER))
    parts: list[bytes] = []
    start, number = 0, body.line
    while start < len(body.data) and not faults.many:
        match = good.match(body.data, start)
        assert match is not None
        if match.end() > start:
            parts.append(match[0])
            number += match[0].count(b"\n")
            start = match.end()
            continue
        end = body.data.find(b"\n", start) % (len(body.data) + 1)
        faults.note(number, _bad_line(head, body.data[start : min(end, start + _LONGEST_LINE)], number))
        parts.append(b"\n")
        start, number = end + 1, number + 1
    return _Body(b"".join(parts), body.line)


def _bad_line(head: _Head, text: bytes, number: int) -> CellError:
    """What is wrong with a line that does not hold as many numbers as it should."""
    words = text.split()
    for word in words:
        if not re.fullmatch(_NUMBER, word):
            shown = quoted(word.decode("utf-8", "replace"))
            if _NOT_FINITE.fullmatch(word):
                return CellError("not-finite", f"line {number}: {shown} is not finite")
            return CellError("file-format", f"line {number}: {shown} is no number")
    wanted = "1 number is" if head.width == 1 else f"{head.width} numbers are"
    return CellError("file-format", f"line {number}: {wanted} wanted, not {len(words)}")


def _entries(
    head: _Head, body: _Body, table: NDArray[np.float64], faults: Faults
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
    lines = body.lines_of({entry for entry, _ in wrong})
    for entry, message in wrong:
        code = "not-finite" if message is _BEYOND else "file-format"
        faults.note(lines[entry], CellError(code, f"line {lines[entry]}: {message}"))
    if not head.sparse:
        faults.check()  # what is missing moves all that is behind it
        return (*_dense_places(head), values)
    if wrong:
        faults.check()
    i, j = table[:, 0].astype(np.int64) - 1, table[:, 1].astype(np.int64) - 1
    _check_once(head, body, (i, j), faults)
    return i, j, values


#: Lines that are checked together; no more, since a match remembers each. (Not possessively: alternatives at the end
#: of such a group are invalid in Python before 3.11.5.)
_TOGETHER: Final = 500
_BEYOND: Final = "the value is beyond double precision"


def _few(wrong: NDArray[np.bool_]) -> list[int]:
    """The first entries that are wrong."""
    return [int(entry) for entry in np.flatnonzero(wrong)[:MOST_FAULTS]]


def _dense_places(head: _Head) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Table and columns of an array's cells, column by column; of a symmetric one from the diagonal down."""
    if head.symmetry == "general":
        j, i = np.divmod(np.arange(head.entries), head.rows)
    else:
        j, i = np.triu_indices(head.rows, 1 if head.symmetry == "skew-symmetric" else 0)
    return i, j


def _check_once(head: _Head, body: _Body, cells: tuple[NDArray[np.int64], NDArray[np.int64]], faults: Faults) -> None:
    """No cell is given twice, not even by way of the symmetry; else that is reported."""
    i, j = cells
    if head.symmetry == "skew-symmetric":
        for line in body.lines_of(set(_few(i == j))).values():
            message = f"line {line}: the diagonal of a skew-symmetric matrix is not given"
            faults.note(line, CellError("file-format", message))
    low, high = (np.minimum(i, j), np.maximum(i, j)) if head.symmetry != "general" else (i, j)
    twice = repeated(low, high, head.columns)
    if twice is not None:
        lines = body.lines_of(set(twice))
        first, second = (lines[entry] for entry in twice)
        cell = f"row {i[twice[1]] + 1}, column {j[twice[1]] + 1}"
        by = "" if (i[twice[0]], j[twice[0]]) == (i[twice[1]], j[twice[1]]) else " by way of the symmetry"
        message = f"line {second}: {cell} is given on line {first} already{by}"
        faults.note(second, CellError("file-format", message))
