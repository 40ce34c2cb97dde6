"""One array from the bytes of a ``.npy`` file.

In: bytes. Out: a float64 array of two dimensions, all finite. The header is checked against the bytes that are there
before an array is made; objects and structures are refused, so nothing is ever unpickled.
"""

from __future__ import annotations

import io
import math
import tokenize
import warnings
from typing import Final

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from neurovis_spec.language.data_files_csv import CellError

_REAL: Final = "iuf"
_MAGIC: Final = b"\x93NUMPY"
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


def parse_npy(data: bytes) -> NDArray[np.float64]:
    """The array, rows × columns; one of one dimension as a column. Raises CellError."""
    shape, column_major, dtype, offset = _header(data)
    if dtype.kind not in _REAL:
        raise CellError("file-format", f"an array of {_kind(dtype)} is no array of real numbers")
    if len(shape) not in (1, 2):
        raise CellError("file-format", f"an array of {len(shape)} dimensions where one or two are wanted")
    count = math.prod(shape)
    if min(shape) < 1:
        raise CellError("file-format", "the array is empty")
    wanted = count * dtype.itemsize
    if len(data) - offset != wanted:
        raise CellError("file-format", f"its header promises {wanted} bytes of numbers, there are {len(data) - offset}")
    flat = np.frombuffer(data, dtype=dtype, count=count, offset=offset)
    array = flat.reshape(shape, order="F" if column_major else "C")
    with np.errstate(over="ignore", invalid="ignore"):
        values = np.array(array, dtype=np.float64, order="C")
    values = values.reshape(shape[0], -1)
    _check_finite(values)
    return values


def _header(data: bytes) -> tuple[tuple[int, ...], bool, np.dtype[np.generic], int]:
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
    return tuple(int(size) for size in shape), bool(column_major), dtype, stream.tell()


def _kind(dtype: np.dtype[np.generic]) -> str:
    kinds = {"O": "Python objects", "c": "complex numbers", "b": "truth values", "V": "structures"}
    return kinds.get(dtype.kind, "texts or dates")


def _check_finite(values: NDArray[np.float64]) -> None:
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        row, column = (int(index) + 1 for index in bad[0])
        what = "NaN" if math.isnan(values[row - 1, column - 1]) else "infinity"
        raise CellError("not-finite", f"row {row}, column {column} is {what}")
