"""One array from the bytes of a ``.npy`` file.

In: bytes. Out: a float64 array of two dimensions, all finite; or an array of the kind that is asked for. The header is
checked against the bytes that are there before an array is made; objects and structures are refused, so nothing is
ever unpickled.
"""

from __future__ import annotations

import io
import math
import tokenize
import warnings
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from neurovis_spec.language.data_files_table import CellError, check_cells, check_finite

#: real numbers, as kinds of NumPy's types
REAL: Final = "iuf"
#: a header lies within so many bytes; NumPy reads no longer ones
LONGEST_HEADER: Final = 16_384
_MAGIC: Final = b"\x93NUMPY"
_KINDS: Final = {"O": "Python objects", "c": "complex numbers", "b": "truth values", "V": "structures"}
_HEADER_ERRORS: Final = (
    ValueError,
    TypeError,
    KeyError,
    SyntaxError,
    EOFError,
    OverflowError,
    RecursionError,
    MemoryError,
    UnicodeError,
    tokenize.TokenError,
)


@dataclass(frozen=True, slots=True)
class Header:
    """What an array is, and where in the file its numbers begin."""

    shape: tuple[int, ...]
    column_major: bool
    dtype: np.dtype[np.generic]
    offset: int


def parse_npy(data: bytes) -> NDArray[np.float64]:
    """The array, rows × columns; one of one dimension as a column. Raises CellError."""
    array = parse_array(data, REAL, (1, 2))
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
    count = math.prod(header.shape)
    if not count:
        return np.zeros(header.shape, dtype=header.dtype)
    flat: NDArray[np.generic] = np.frombuffer(data, dtype=header.dtype, count=count, offset=header.offset)
    return flat.reshape(header.shape, order="F" if header.column_major else "C")


def read_header(data: bytes, size: int, kinds: str, dimensions: tuple[int, ...]) -> Header:
    """The header of a file of ``size`` bytes that begins with ``data``, held against these. Raises CellError."""
    header = _header(data)
    if header.dtype.kind not in kinds:
        wanted = "real numbers" if kinds == REAL else _named(kinds)
        raise CellError("file-format", f"an array of {_named(header.dtype.kind)} is no array of {wanted}")
    if len(header.shape) not in dimensions:
        wanted = " or ".join({0: "none", 1: "one", 2: "two"}[number] for number in dimensions)
        verb = "is" if dimensions == (1,) else "are"
        raise CellError("file-format", f"an array of {len(header.shape)} dimensions where {wanted} {verb} wanted")
    if min(header.shape, default=0) < 0:
        raise CellError("file-format", "the array is empty")
    promised, there = math.prod(header.shape) * header.dtype.itemsize, size - header.offset
    if promised != there:
        raise CellError("file-format", f"its header promises {_bytes(promised)} of numbers, there are {there}")
    if not header.dtype.itemsize:
        raise CellError("file-format", "the array is empty")
    check_cells(math.prod(header.shape))
    return header


def _header(data: bytes) -> Header:
    if not data.startswith(_MAGIC):
        raise CellError("file-format", "this is no .npy file")
    stream = io.BytesIO(data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            version = npy.read_magic(stream)
            read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, column_major, dtype = read(stream)
    except _HEADER_ERRORS as error:
        raise CellError("file-format", "the header of the .npy file cannot be read") from error
    return Header(tuple(int(size) for size in shape), bool(column_major), dtype, stream.tell())


def _named(kinds: str) -> str:
    if kinds == "iu":
        return "integers"
    return "numbers" if kinds in REAL else _KINDS.get(kinds, "texts or dates")


def _bytes(number: int) -> str:
    return f"{number} bytes" if number < 10**18 else "more bytes than any file has"
