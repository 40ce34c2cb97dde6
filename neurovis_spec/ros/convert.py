"""Messages of one ROS become messages of the other.

In: the definition of a type in either ROS, and messages of it. Out: the same values in the other encoding. Headers
have a number in ROS 1 that ROS 2 has not; an empty message takes a byte in ROS 2; all else differs in alignment alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np

from neurovis_spec.ros.definitions import PRIMITIVES, fields_of_text, inner_name, sections
from neurovis_spec.runtime.wire import Cursor, Encoding, WireError

_SIZES: Final = {
    **{f"{kind}{bits}": bits // 8 for kind in ("int", "uint", "float") for bits in (8, 16, 32, 64)},
    **dict.fromkeys(("bool", "byte", "char"), 1),
}
_TIMES: Final = ("time", "duration")
#: messages within messages, and fields of a type with all that is in it
_DEEPEST, _MOST_FIELDS = 32, 10_000
_HEADER: Final = "std_msgs/Header"


class ConversionError(ValueError):
    """A type that cannot be converted."""


@dataclass(frozen=True, slots=True)
class _Field:
    """``count`` is None for a single value, −1 for as many as the message says; ``inner`` is the size of a number, None
    for a string, or the fields of a message."""

    inner: _Inner
    count: int | None


_Fields: TypeAlias = tuple[_Field, ...]
_Inner: TypeAlias = int | _Fields | str | None
#: what stands in place of the fields of a Header: both ROS know what is in it
_HEADED: Final = "header"


def _fields(type_: str, texts: Mapping[str, str], depth: int, room: list[int]) -> _Inner:
    if type_ == _HEADER:
        return _HEADED
    if depth > _DEEPEST or type_ not in texts:
        raise ConversionError(f"the definition of {type_} is not known")
    result = list[_Field]()
    for base, behind, _, value in fields_of_text(texts[type_]):
        if value is not None:
            continue
        room[0] -= 1
        if room[0] < 0:
            raise ConversionError(f"{type_} has too many fields")
        bracket = behind.partition("[")[2].removesuffix("]")
        count = None if "[" not in behind else int(bracket) if bracket.isdigit() else -1
        if base in _TIMES:
            inner: _Inner = (_Field(4, None), _Field(4, None))
        elif base == "wstring":
            raise ConversionError(f"{type_} holds text of wide characters, which ROS 1 does not know")
        elif base in PRIMITIVES:
            inner = _SIZES.get(base)
        else:
            inner = _fields(inner_name(base, type_.partition("/")[0], texts), texts, depth + 1, room)
        result.append(_Field(inner, count))
    return tuple(result)


def shape_of(type_: str, text: str) -> object:
    """What the values of a type are, in order: equal where messages of both ROS hold the same. Raises
    ConversionError."""
    return _fields(type_, sections(type_, text), 0, [_MOST_FIELDS])


@dataclass
class _Writer:
    encoding: Encoding
    parts: bytearray = field(default_factory=bytearray)

    def align(self, size: int) -> None:
        if self.encoding == "cdr":
            self.parts += bytes(-len(self.parts) % size)

    def integer(self, value: int) -> None:
        self.align(4)
        self.parts += value.to_bytes(4, "little")

    def string(self, text: bytes) -> None:
        end = b"\0" if self.encoding == "cdr" else b""
        self.integer(len(text) + len(end))
        self.parts += text + end

    def message(self) -> bytes:
        return (b"\0\1\0\0" if self.encoding == "cdr" else b"") + bytes(self.parts)


class Converter:
    """Converts messages of a type; ``text`` is its definition where they come from, ``other`` where they go to ("":
    taken to be the same). Raises ConversionError."""

    def __init__(self, type_: str, text: str, source: Encoding, other: str = "") -> None:
        self.source: Encoding = source
        self.target: Encoding = "cdr" if source == "ros1" else "ros1"
        self._shape = _fields(type_, sections(type_, text), 0, [_MOST_FIELDS])
        if other and shape_of(type_, other) != self._shape:
            raise ConversionError(f"{type_} is not the same in ROS 1 and ROS 2")

    def convert(self, data: bytes) -> bytes:
        """The same message in the other encoding. Raises WireError."""
        cursor, writer = Cursor(data, self.source), _Writer(self.target)
        self._value(self._shape, cursor, writer)
        cursor.end()
        return writer.message()

    def _value(self, inner: _Inner, cursor: Cursor, writer: _Writer) -> None:
        if isinstance(inner, tuple):
            if not inner:  # an empty message takes a byte in ROS 2
                cursor.take(self.source == "cdr")
                writer.parts += bytes(self.target == "cdr")
            for one in inner:
                self._field(one, cursor, writer)
        elif isinstance(inner, int):
            self._numbers(inner, 1, cursor, writer)
        elif inner is None:
            writer.string(cursor.string())
        else:
            if self.source == "ros1":
                cursor.integer()
            else:
                writer.integer(0)
            self._numbers(4, 2, cursor, writer)
            writer.string(cursor.string())

    def _field(self, one: _Field, cursor: Cursor, writer: _Writer) -> None:
        if one.count is None:
            self._value(one.inner, cursor, writer)
            return
        count = one.count
        if count < 0:
            count = cursor.integer()
            writer.integer(count)
        if count > len(cursor.data):
            raise WireError("it breaks off")
        if isinstance(one.inner, int):
            self._numbers(one.inner, count, cursor, writer)
        else:
            for _ in range(count):
                self._value(one.inner, cursor, writer)

    @staticmethod
    def _numbers(size: int, count: int, cursor: Cursor, writer: _Writer) -> None:
        if not count:
            return
        cursor.align(size)
        writer.align(size)
        data = cursor.take(size * count)
        writer.parts += (
            data if cursor.order == "<" or size == 1 else np.frombuffer(data, f">u{size}").astype(f"<u{size}").tobytes()
        )
