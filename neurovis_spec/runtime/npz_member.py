"""An array in an archive whose rows are written one after another, and counted only at the end.

In: an archive that is being written, rows of numbers. Out: a member of it. Its header has a fixed length, so that the
number of rows can be put in when it is known; sizes and the checksum of a member are written at its end in any case.
"""

from __future__ import annotations

import zipfile
from typing import BinaryIO
from zlib import crc32

#: bytes of the header of an array, and those that are read together
_HEADER, _CHUNK = 128, 1 << 20
_MAGIC = b"\x93NUMPY\x01\x00"


def npy_header(descr: str, shape: tuple[int, ...]) -> bytes:
    """The header of an array in NumPy's format, version 1.0, always of the same length.

    >>> npy_header("<f8", (3, 2))[10:70]
    b"{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), } "
    """
    room = _HEADER - len(_MAGIC) - 2
    text = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"
    return _MAGIC + room.to_bytes(2, "little") + text.ljust(room - 1).encode("ascii") + b"\n"


class GrowingMember:
    """A member of an archive: numbers (rows, columns), of which ``rows`` are expected. No other member may be written
    before it is finished. ``file`` is the archive's, open for writing and reading."""

    def __init__(self, archive: zipfile.ZipFile, file: BinaryIO, name: str, rows: int, columns: int) -> None:
        self._archive, self._file = archive, file
        self._rows, self._columns = rows, columns
        self._info = zipfile.ZipInfo(name)
        self._info.external_attr = 0o600 << 16
        self._info.CRC = 0
        self._info.header_offset = archive.start_dir
        file.seek(archive.start_dir)
        file.write(self._info.FileHeader(zip64=True))
        self._begin = file.tell()
        header = npy_header("<f8", (rows, columns))
        file.write(header)
        self._sum = crc32(header)

    def write(self, data: bytes) -> None:
        """Further numbers."""
        self._file.write(data)
        self._sum = crc32(data, self._sum)

    def finish(self, rows: int) -> None:
        """End the member, of which so many rows were written."""
        file, info, archive = self._file, self._info, self._archive
        end = file.tell()
        if rows != self._rows:
            file.seek(self._begin)
            file.write(npy_header("<f8", (rows, self._columns)))
            self._sum = self._summed()
        info.file_size = info.compress_size = end - self._begin
        info.CRC = self._sum
        file.seek(info.header_offset)
        file.write(info.FileHeader(zip64=True))
        file.seek(end)
        archive.filelist.append(info)
        archive.NameToInfo[info.filename] = info
        archive.start_dir = end

    def _summed(self) -> int:
        """The checksum of what was written, with the header as it is now."""
        self._file.seek(self._begin)
        total = 0
        while data := self._file.read(_CHUNK):
            total = crc32(data, total)
        return total
