"""NumPy's files: one array from the bytes of a ``.npy`` file; one array or sparse matrix from those of an ``.npz``.

In: bytes, and perhaps the name of an array. Out: a float64 array of two dimensions, all finite; an array of the kind
that is asked for; a Table. A header is read by its grammar, never as Python, and checked against the bytes that are
there, or that an archive's directory says, before an array is made or the rest unpacked, so a file takes no more memory
than the table that it holds. Objects and structures are refused, so nothing is ever unpickled. (NumPy's own reader
hands whatever the header says to ``numpy.dtype``, which ends the process for some texts, such as a date that counts by
the 0th part of a year.)
"""

from __future__ import annotations

import io
import math
import re
import zipfile
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from neurovis_spec.language.data.table import (
    MOST_CELLS,
    SPARSER,
    CellError,
    Room,
    Table,
    check_cells,
    check_finite,
    full,
    not_finite,
    printable,
    quoted,
    repeated,
    scattered,
)
from neurovis_spec.likeness import suggest

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

MOST_MEMBERS: Final = 4_000
#: what each entry of an archive's directory begins with
_ENTRY: Final = b"PK\x01\x02"
_SUFFIX: Final = ".npy"
#: names that are listed, and compared with one that is unknown
_SHOWN, _COMPARED = 8, 200
#: what an archive holds that scipy.sparse.save_npz wrote, beside the places of its entries
_SPARSE = frozenset({"format", "shape", "data"})


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


class Archive:
    """The arrays of an archive by name, unpacked when they are asked for. Raises CellError."""

    def __init__(self, data: bytes) -> None:
        if not zipfile.is_zipfile(io.BytesIO(data)):
            raise CellError("file-format", "this is no .npz file, or its end is missing")
        if data.count(_ENTRY) > MOST_MEMBERS:
            raise CellError("too-large", f"the archive has more than {MOST_MEMBERS:,} members")
        try:
            self._archive = zipfile.ZipFile(io.BytesIO(data))
        except Exception as error:  # zipfile has errors of its own and of others for every way to be damaged
            raise CellError("file-format", "the directory of the archive is damaged") from error
        self._members: dict[str, zipfile.ZipInfo] = {}
        for member in self._archive.infolist():
            if member.filename.endswith(_SUFFIX):
                name = member.filename.removesuffix(_SUFFIX)
                if name in self._members:
                    raise CellError("file-format", f"the archive holds {quoted(member.filename)} twice")
                self._members[name] = member
        self.names = tuple(self._members)

    def array(
        self, name: str, kinds: str, dimensions: tuple[int, ...], room: Room | None = None
    ) -> NDArray[np.generic]:
        """An array as it stands, of one of these kinds and numbers of dimensions."""
        member = self._members[name]
        header = read_header(self._unpacked(member, LONGEST_HEADER), member.file_size, kinds, dimensions)
        if room is not None:
            room(math.prod(header.shape))
        content = self._unpacked(member)
        if len(content) != member.file_size:
            message = f"{quoted(member.filename)} does not unpack to the {member.file_size} bytes it promises"
            raise CellError("file-format", message)
        return parse_array(content, kinds, dimensions)

    def part(self, name: str, kinds: str, dimensions: int = 1, room: Room | None = None) -> NDArray[np.generic]:
        """An array that a sparse matrix has, or a column of a table."""
        if name not in self._members:
            raise CellError("file-format", f"there is no array {quoted(name)}, which a sparse matrix has")
        try:
            return self.array(name, kinds, (dimensions,), room)
        except CellError as error:
            raise CellError(error.code, f"{quoted(name)}: {error}", error.hint) from error

    def _unpacked(self, member: zipfile.ZipInfo, most: int = -1) -> bytes:
        """The first bytes of a member, or all of them, whose checksum is then right."""
        called = quoted(member.filename)
        if member.flag_bits & 1:
            raise CellError("file-format", f"{called} is encrypted")
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            message = f"{called} is packed by a method that is not read"
            raise CellError("file-format", message, "numpy.savez and numpy.savez_compressed write what is read")
        try:
            with self._archive.open(member) as file:
                return file.read(most)
        except Exception as error:  # as above, and zlib
            message = f"{called} is damaged: it cannot be unpacked, or its checksum is another one"
            raise CellError("file-format", message) from error


def parse_npz(data: bytes, key: str | None = None, room: Room | None = None) -> Table:
    """The array that ``key`` names; without it the only one, or a matrix of scipy.sparse. Raises CellError.

    The codes ``unknown-array`` and ``missing-key`` are about ``key``, not about the file.
    """
    archive = Archive(data)
    names = archive.names
    if key is not None:
        if key not in names:
            known = [printable(name) for name in names[:_COMPARED]]
            hint = suggest(key, known, "its arrays") if known else "it holds none"
            raise CellError("unknown-array", f"there is no array {quoted(key)} in the file", hint)
        return full(numbers_in(archive.array(key, REAL, (1, 2), room)))
    if _SPARSE.issubset(names):
        return _sparse(archive, room)
    if not names:
        raise CellError("file-format", "the archive holds no array")
    if len(names) > 1:
        listed = ", ".join(printable(name) for name in names[:_SHOWN]) + (", …" if len(names) > _SHOWN else "")
        raise CellError("missing-key", f"it holds {len(names)} arrays: {listed}", "name one of them with 'key'")
    return full(numbers_in(archive.array(names[0], REAL, (1, 2), room)))


def _sparse(archive: Archive, room: Room | None) -> Table:
    """A matrix as scipy.sparse.save_npz writes it; an entry that is stored is there, also if it is 0."""
    kind = _text(archive.part("format", "SU", 0))
    if kind not in ("csr", "csc", "coo"):
        message = f"a sparse matrix of the format {quoted(kind)} is not read"
        raise CellError("file-format", message, "save it as csr, csc or coo")
    sizes = _integers(archive, "shape")
    if len(sizes) != 2 or sizes.min() < 1:
        raise CellError("file-format", "'shape': a matrix has two sizes of at least 1")
    rows, columns = (int(size) for size in sizes)
    check_cells(rows * columns, hint=SPARSER)
    if room is not None:
        room(rows * columns)
    with np.errstate(over="ignore", invalid="ignore"):
        values = archive.part("data", REAL).astype(np.float64)
    if kind == "coo":
        i = _places(archive, "row", rows, len(values))
        j = _places(archive, "col", columns, len(values))
    elif kind == "csr":
        i = _lines(archive, rows, len(values))
        j = _places(archive, "indices", columns, len(values))
    else:
        j = _lines(archive, columns, len(values))
        i = _places(archive, "indices", rows, len(values))
    twice = repeated(i, j, columns)
    if twice is not None:
        place = f"row {i[twice[0]] + 1}, column {j[twice[0]] + 1}"
        raise CellError("file-format", f"{place} has two values", "sum_duplicates() adds them up")
    finite = np.isfinite(values)
    if not finite.all():
        at = int(np.argmin(finite))
        raise CellError("not-finite", f"row {i[at] + 1}, column {j[at] + 1} is {not_finite(values[at])}")
    return scattered((rows, columns), i, j, values)


def _text(array: NDArray[np.generic]) -> str:
    value = array.item()
    return value.decode("ascii", "replace") if isinstance(value, bytes) else str(value)


def _integers(archive: Archive, name: str) -> NDArray[np.int64]:
    """An array of integers; what is beyond 64 bits becomes negative, and is refused as such."""
    return archive.part(name, "iu").astype(np.int64)


def _places(archive: Archive, name: str, size: int, count: int) -> NDArray[np.int64]:
    """One index below ``size`` for each of ``count`` entries. Raises CellError."""
    places = _integers(archive, name)
    if len(places) != count:
        raise CellError("file-format", f"'{name}' has {len(places)} indices for {count} values")
    if count and (places.min() < 0 or places.max() >= size):
        wrong = int(places[(places < 0) | (places >= size)][0])
        raise CellError("file-format", f"'{name}' holds the index {wrong}, outside 0 … {size - 1}")
    return places


def _lines(archive: Archive, size: int, count: int) -> NDArray[np.int64]:
    """For each of ``count`` entries the row (csc: column) in which it stands, from where these begin."""
    starts = _integers(archive, "indptr")
    if len(starts) != size + 1:
        raise CellError("file-format", f"'indptr' has {len(starts)} numbers; {size + 1} are wanted")
    steps = np.diff(starts)
    if starts[0] != 0 or starts[-1] != count or steps.min() < 0:
        raise CellError("file-format", f"'indptr' does not ascend from 0 to the number of values, {count}")
    return np.repeat(np.arange(size), steps)
