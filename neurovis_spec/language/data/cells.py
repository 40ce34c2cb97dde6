"""Cells of a ``.csv`` file: the numbers in them, many at a time or one by one.

In: cells as they are written. Out: float64 numbers, NaN for an empty cell; or a CellError that names row and column.
"""

from __future__ import annotations

import codecs
import math
import re
from typing import Final

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.language.data.table import EMPTY_CELL, CellError, quoted

#: bytes of a cell; Python's reader takes twice as many
LONGEST_CELL: Final = 1 << 16
_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE: Final = re.compile(r"[-+]?\.?(?:nan|inf|infinity)", re.IGNORECASE)
_BEGINS: Final = "0123456789+-.nNiI"
_DIGITS: Final = b"0123456789+-.eE"
_BLANK: Final = b" \t"
_LONGEST_NUMBER: Final = 1000


def check_lengths(data: bytes) -> None:
    """Refuse a cell that is longer than any number or name, before a text is made of it. Raises CellError.

    Such a cell covers a stretch of half its length that holds no separator; few stretches have none.
    """
    half = LONGEST_CELL // 2
    for start in range(0, len(data) - half, half):
        if any(data.find(mark, start, start + half) >= 0 for mark in (b",", b"\n", b"\r")):
            continue
        low, high = max(0, start - LONGEST_CELL), start + LONGEST_CELL + half
        begin = max(data.rfind(mark, low, start) for mark in (b",", b"\n", b"\r")) + 1
        ends = [end for mark in (b",", b"\n", b"\r") if (end := data.find(mark, start + half, high)) >= 0]
        if min(ends, default=min(len(data), high)) - max(begin, low) > LONGEST_CELL:
            *before, line = data[: max(begin, low)].replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
            at = len(before) + 1, line.count(b",") + 1
            message = f"row {at[0]}, column {at[1]}: no number or name has more than {LONGEST_CELL:,} bytes"
            raise CellError("file-format", message, at=at)


def check_utf8(data: bytes) -> None:
    """Refuse a file that is no text, without making one text of all of it. Raises CellError."""
    if data.isascii():
        return
    decoder = codecs.getincrementaldecoder("utf-8")()
    fed = 0
    try:
        while fed < len(data):
            part = data[fed : fed + LONGEST_CELL]
            fed += len(part)
            decoder.decode(part, final=fed == len(data))
    except UnicodeDecodeError as error:
        row = data.count(b"\n", 0, fed - len(error.object) + error.start) + 1
        raise CellError("invalid-utf8", f"row {row} is not UTF-8", "save the file as UTF-8", (row, 0)) from None


def is_number(cell: str) -> bool:
    """Whether a cell holds a number, be it a finite one or not."""
    return cell[:1] in _BEGINS and bool(_NUMBER.fullmatch(cell) or _NOT_FINITE.fullmatch(cell))


def numbers_in(text: bytes, empty: NDArray[np.bool_]) -> NDArray[np.float64] | None:
    """The numbers of cells that commas separate, NaN where ``empty`` says that a cell has no byte; None where not all
    others hold plain numbers without blanks."""
    values = np.full(len(empty), np.nan)
    if empty.all():
        return values
    if text.translate(None, _DIGITS + b","):
        return None
    cells = text.decode("ascii").split(",")
    numbers = _floats(list(filter(None, cells)) if empty.any() else cells)
    if numbers is not None:
        values[~empty] = numbers
    return None if numbers is None else values


def _floats(cells: list[str]) -> NDArray[np.float64] | None:
    """The numbers of cells that hold digits, signs and points; None where one is no number, or not finite."""
    if len(max(cells, key=len, default="")) > _LONGEST_NUMBER:
        return None
    try:
        numbers = np.array(list(map(float, cells)), dtype=np.float64)
    except ValueError:
        return None
    return numbers if np.isfinite(numbers).all() else None


def numbers_of(cells: list[str]) -> NDArray[np.float64] | None:
    """The numbers of cells, NaN for an empty one; None where these are not all plain ones, if any is not.

    >>> numbers_of(["1", "", " 2e-1"]), numbers_of(["1", "1_0"])
    (array([1. , nan, 0.2]), None)
    """
    text = "".join(cells).encode("utf-8", "replace")
    if not text:
        return np.full(len(cells), np.nan)
    rest = text.translate(None, _DIGITS)
    if rest.strip(_BLANK):
        return None
    if rest:
        cells = [cell.strip() for cell in cells]
    filled = [cell for cell in cells if cell]
    numbers = _floats(filled)
    if numbers is None:
        return None
    if len(filled) == len(cells):
        return numbers
    values = np.full(len(cells), np.nan)
    values[np.fromiter(map(bool, cells), dtype=np.bool_, count=len(cells))] = numbers
    return values


def number_of(cell: str, row: int, column: int) -> float:
    """A cell's number, NaN for an empty cell. Raises CellError."""
    if not cell:
        return math.nan
    plain = len(cell) <= _LONGEST_NUMBER and _NUMBER.fullmatch(cell)
    if plain and math.isfinite(value := float(cell)):
        return value
    place, at = f"row {row}, column {column}", (row, column)
    if plain:
        raise CellError("not-finite", f"{place}: {quoted(cell)} is beyond double precision", at=at)
    if _NOT_FINITE.fullmatch(cell):
        raise CellError("not-finite", f"{place}: '{cell}' is not finite", EMPTY_CELL, at)
    raise CellError("file-format", f"{place}: {quoted(cell)} is no number", separated(cell), at)


def separated(cell: str) -> str | None:
    """A hint, where a cell seems to be several that something else than commas separates."""
    return "columns are separated by commas" if ";" in cell or "\t" in cell else None


def counted(cells: int) -> str:
    """A number of cells, with its noun."""
    return "1 cell" if cells == 1 else f"{cells} cells"
