"""The members of a zip archive that lies in memory, unpacked within bounds.

In: the bytes of an archive. Out: its members by name, and the bytes of one. Nothing that the archive says of itself is
believed: its directory, its members and what they unpack to are held against each other and against the bytes that are
there. (Python's own reader takes as many members as the directory lists, and lets them overlap.)
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from neurovis_spec.language.data.table import CellError, quoted

MOST_MEMBERS: Final = 4_000
_END: Final = struct.Struct("<4s4H2LH")
_ENTRY: Final = struct.Struct("<4s6H3L5H2L")
_LOCAL: Final = struct.Struct("<4s5H3L2H")
_LONGEST_COMMENT: Final = 0xFFFF
#: an entry that holds this in place of a size has its size elsewhere, since it is larger than 4 GiB
_ELSEWHERE: Final = 0xFFFFFFFF
_ENCRYPTED: Final = 0x2041
_UTF8: Final = 0x800
_STORED, _DEFLATED = 0, 8
#: what a header takes of a packed member beyond its own length, at most
_SLACK: Final = 1024


@dataclass(frozen=True, slots=True)
class Member:
    """A file within the archive: its name, how it is packed, its size unpacked, and where its bytes lie."""

    name: str
    flags: int
    method: int
    checksum: int
    packed: int
    size: int
    #: where its header begins, and where its bytes do
    start: int
    begin: int


def members(data: bytes) -> dict[str, Member]:
    """All members by name. Raises CellError."""
    at = data.rfind(b"PK\x05\x06", max(0, len(data) - _END.size - _LONGEST_COMMENT))
    if at < 0 or len(data) - at < _END.size:
        raise CellError("file-format", "this is no .npz file, or its end is missing")
    _, disk, first_disk, here, count, size, start, _ = _END.unpack_from(data, at)
    if count > MOST_MEMBERS:
        raise CellError("too-large", f"the archive has more than {MOST_MEMBERS:,} members")
    if disk or first_disk or here != count or start + size > at:
        raise _damaged()
    found: dict[str, Member] = {}
    for member in _entries(data, start, start + size, count):
        if member.name in found:
            raise CellError("file-format", f"the archive holds {quoted(member.name)} twice")
        found[member.name] = member
    _check_apart(found, start)
    return found


def _entries(data: bytes, start: int, end: int, count: int) -> Iterator[Member]:
    for _ in range(count):
        if end - start < _ENTRY.size:
            raise _damaged()
        fields = _ENTRY.unpack_from(data, start)
        signature, flags, method, checksum, packed, size = fields[0], fields[3], fields[4], *fields[7:10]
        name_size, extra, comment, at = *fields[10:13], fields[16]
        name = data[start + _ENTRY.size : start + _ENTRY.size + name_size]
        start += _ENTRY.size + name_size + extra + comment
        if signature != b"PK\x01\x02" or start > end or at + _LOCAL.size > len(data):
            raise _damaged()
        if _ELSEWHERE in (packed, size, at):
            raise CellError("too-large", "the archive has members of more than 4 GiB")
        local = _LOCAL.unpack_from(data, at)
        if local[0] != b"PK\x03\x04":
            raise _damaged()
        begin = at + _LOCAL.size + local[9] + local[10]
        text = name.decode("utf-8" if flags & _UTF8 else "cp437", "replace")
        yield Member(text, flags, method, checksum, packed, size, at, begin)


def _check_apart(found: dict[str, Member], end: int) -> None:
    """Each member ends before the next one begins, and all of them before the directory."""
    for member in sorted(found.values(), key=lambda member: member.start, reverse=True):
        if member.begin + member.packed > end:
            raise CellError("file-format", f"{quoted(member.name)} overlaps what follows it in the archive")
        end = member.start


def beginning(data: bytes, member: Member, most: int) -> bytes:
    """The first ``most`` bytes of a member, or fewer. Raises CellError."""
    packed = memoryview(data)[member.begin : member.begin + min(member.packed, most + _SLACK)]
    return _unpacked(packed, member, most)[0]


def unpack(data: bytes, member: Member) -> bytes:
    """All bytes of a member, which are as many as the directory says. Raises CellError."""
    packed = memoryview(data)[member.begin : member.begin + member.packed]
    content, whole = _unpacked(packed, member, member.size + 1)
    if not whole or len(content) != member.size:
        raise CellError("file-format", f"{quoted(member.name)} does not unpack to the {member.size} bytes it promises")
    if zlib.crc32(content) != member.checksum:
        raise CellError("file-format", f"{quoted(member.name)} is damaged: its checksum is another one")
    return content


def _unpacked(packed: memoryview, member: Member, most: int) -> tuple[bytes, bool]:
    """At most this many bytes, and whether the packed ones came to their end."""
    if member.flags & _ENCRYPTED:
        raise CellError("file-format", f"{quoted(member.name)} is encrypted")
    if member.method == _STORED:
        return bytes(packed[:most]), len(packed) <= most
    if member.method != _DEFLATED:
        message = f"{quoted(member.name)} is packed by a method that is not read"
        raise CellError("file-format", message, "numpy.savez and numpy.savez_compressed write what is read")
    stream = zlib.decompressobj(-zlib.MAX_WBITS)
    try:
        return stream.decompress(packed, most), stream.eof
    except zlib.error as error:
        raise CellError("file-format", f"{quoted(member.name)} is damaged: it cannot be unpacked") from error


def _damaged() -> CellError:
    return CellError("file-format", "the directory of the archive is damaged")
