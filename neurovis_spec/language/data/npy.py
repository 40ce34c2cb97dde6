"""One array from the bytes of a ``.npy`` file.

In: bytes. Out: a float64 array of two dimensions, all finite; or an array of the kind that is asked for. The header is
read by its grammar, never as Python, and checked against the bytes that are there before an array is made; objects
and structures are refused, so nothing is ever unpickled. (NumPy's own reader hands whatever the header says to
``numpy.dtype``, which ends the process for some texts, such as a date that counts by the 0th part of a year.)
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.language.data.table import MOST_CELLS, CellError, Room, check_cells, check_finite

#: real numbers, as kinds of NumPy's types
REAL: Final = "iuf"
#: a header lies within so many bytes; longer ones describe structures
LONGEST_HEADER: Final = 10_000
_LONGEST_SIZE: Final = 18
_MAGIC: Final = b"\x93NUMPY"
#: version of the format to the bytes that hold the length of the header
_VERSIONS: Final = {b"\x01\x00": 2, b"\x02\x00": 4, b"\x03\x00": 4}
_ITEM: Final = rb"\s*(?:'descr'\s*:\s*'([^'\\]*)'|'fortran_order'\s*:\s*(True|False)|'shape'\s*:\s*\(([0-9L,\s]*)\))\s*"
_HEADER: Final = re.compile(rb"\s*\{%b,%b,%b(?:,\s*)?\}\s*" % (_ITEM, _ITEM, _ITEM))
_STRUCTURE: Final = re.compile(rb"'descr'\s*:\s*[\[(]")
_TYPE: Final = re.compile(r"[<>|=]?(?:([a-zA-Z])[0-9]{0,9}|([Mm])8\[.*\])")
_KINDS: Final = {
    **dict.fromkeys("iu", "integers"),
    **{"f": "real numbers", "c": "complex numbers", "b": "truth values", "U": "texts", "S": "byte strings"},
    **{"M": "dates", "m": "spans of time", "O": "Python objects", "V": "structures"},
}


@dataclass(frozen=True, slots=True)
class Header:
    """What an array is, and where in the file its numbers begin."""

    shape: tuple[int, ...]
    column_major: bool
    dtype: np.dtype[np.generic]
    offset: int

    @property
    def count(self) -> int:
        """How many numbers it has."""
        return math.prod(self.shape)

    def array(self, data: bytes, offset: int = 0) -> NDArray[np.generic]:
        """The array whose numbers begin at ``offset``; a view of ``data``."""
        if not self.count:
            return np.zeros(self.shape, dtype=self.dtype)
        flat: NDArray[np.generic] = np.frombuffer(data, dtype=self.dtype, count=self.count, offset=offset)
        return flat.reshape(self.shape, order="F" if self.column_major else "C")


def parse_npy(data: bytes, room: Room | None = None) -> NDArray[np.float64]:
    """The array, rows × columns; one of one dimension as a column. Raises CellError."""
    array = parse_array(data, REAL, (1, 2))
    if room is not None:
        room(array.size)
    return numbers_in(array)


def numbers_in(array: NDArray[np.generic]) -> NDArray[np.float64]:
    """An array of real numbers, rows × columns; one of one dimension as a column. Raises CellError."""
    if not array.size:
        raise CellError("file-format", "the array is empty")
    with np.errstate(over="ignore", invalid="ignore"):
        values = np.array(array, dtype=np.float64, order="C")
    values = values.reshape(array.shape[0], -1)
    check_finite(values)
    return values


def parse_array(data: bytes, kinds: str, dimensions: tuple[int, ...]) -> NDArray[np.generic]:
    """The array as it stands, of one of these kinds and numbers of dimensions; a view of ``data``. Raises CellError."""
    header = read_header(data, len(data), kinds, dimensions)
    return header.array(data, header.offset)


def read_header(data: bytes, size: int, kinds: str, dimensions: tuple[int, ...], most: int = MOST_CELLS) -> Header:
    """The header of a file of ``size`` bytes that begins with ``data``: of one of these kinds and numbers of
    dimensions, and of at most so many cells. Raises CellError."""
    kind, description, column_major, shape, offset = _header(data)
    if kind not in kinds:
        hint = "array.astype(float) makes 0 and 1 of them" if kind == "b" and set(kinds) <= set(REAL) else None
        raise CellError("file-format", f"an array of {_named(kind)} is no array of {_named(kinds)}", hint)
    try:
        dtype = np.dtype(description)
    except (TypeError, ValueError):
        raise CellError("file-format", f"numbers of the type '{description}' are not read here") from None
    if len(shape) not in dimensions:
        wanted = " or ".join({0: "none", 1: "one", 2: "two"}[number] for number in dimensions)
        verb = "is" if dimensions == (1,) else "are"
        raise CellError("file-format", f"an array of {len(shape)} dimensions where {wanted} {verb} wanted")
    promised, there = math.prod(shape) * dtype.itemsize, size - offset
    if promised != there:
        raise CellError("file-format", f"its header promises {_bytes(promised)} of numbers, there are {there}")
    if not dtype.itemsize:
        raise CellError("file-format", "the array is empty")
    check_cells(math.prod(shape), most)
    return Header(shape, column_major, dtype, offset)


def _header(data: bytes) -> tuple[str, str, bool, tuple[int, ...], int]:
    """Kind and description of the type, whether columns come first, the shape, and where the numbers begin."""
    if not data.startswith(_MAGIC):
        raise CellError("file-format", "this is no .npy file")
    width = _VERSIONS.get(data[6:8], 0)
    start = 8 + width
    end = start + int.from_bytes(data[8:start], "little")
    if not width or not start < end <= min(len(data), LONGEST_HEADER):
        raise _unreadable()
    match = _HEADER.fullmatch(data, start, end)
    if match is None:
        if _STRUCTURE.search(data, start, end):
            raise CellError("file-format", f"an array of structures is no array of {_named(REAL)}")
        raise _unreadable()
    found = match.groups()  # the items stand in any order: of each three groups one has matched
    description, order, sizes = (next((one for one in found[group::3] if one is not None), None) for group in range(3))
    if description is None or order is None or sizes is None:
        raise _unreadable()
    numbers = re.findall(rb"[0-9]+", sizes)
    if any(len(number) > _LONGEST_SIZE for number in numbers):
        raise CellError("file-format", f"its header promises {_bytes(10**_LONGEST_SIZE)} of numbers")
    kind = _TYPE.fullmatch(text := description.decode("latin-1"))
    return (kind[1] or kind[2]) if kind else "?", text, order == b"True", tuple(map(int, numbers)), end


def _unreadable() -> CellError:
    return CellError("file-format", "the header of the .npy file cannot be read")


def _named(kinds: str) -> str:
    """What values of these kinds are called.

    >>> _named("iuf"), _named("fiu"), _named("iu"), _named("SU"), _named("?")
    ('real numbers', 'real numbers', 'integers', 'byte strings or texts', 'values of an unknown type')
    """
    found = dict.fromkeys(_KINDS[kind] for kind in kinds if kind in _KINDS)
    if "real numbers" in found:
        found.pop("integers", None)
    return " or ".join(found) or "values of an unknown type"


def _bytes(number: int) -> str:
    return f"{number} bytes" if number < 10**_LONGEST_SIZE else "more bytes than any file has"
