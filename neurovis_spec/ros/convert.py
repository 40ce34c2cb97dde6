"""Messages of one ROS become messages of the other.

In: the definition of a type in either ROS, and messages of it. Out: the same values in the other encoding. Headers
have a number in ROS 1 that ROS 2 has not; an empty message takes a byte in ROS 2; all else differs in alignment alone.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import numpy as np

from neurovis_spec.ros.definitions import DEEPEST, HEADER, MOST, NUMBERS, Definition, Field
from neurovis_spec.runtime.wire import Cursor, Encoding, WireError


class ConversionError(ValueError):
    """A type that cannot be converted."""


def _alike(one: Definition, other: Definition, types: tuple[str, str], seen: set[tuple[str, str]]) -> bool:
    """Whether messages of two types hold the same values; ``seen`` are pairs that have been compared."""
    first, second = types
    if types in seen or first == second == "string" or first == second == HEADER:
        return True
    if first in NUMBERS or second in NUMBERS:
        return first in NUMBERS and second in NUMBERS and _size(first) == _size(second)
    if "string" in types or HEADER in types:
        return False
    seen.add(types)
    pairs = list(zip(one.types[first], other.types[second], strict=False))
    return len(one.types[first]) == len(other.types[second]) and all(
        a.array == b.array and _alike(one, other, (a.type, b.type), seen) for a, b in pairs
    )


def _size(type_: str) -> int:
    return struct.calcsize(NUMBERS[type_])


@dataclass
class _Writer:
    encoding: Encoding
    #: values that may still be written: each has bytes, or is among those that a definition holds, or around them
    room: int
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
        try:
            self._definition = Definition.parse(type_, text)
            there = Definition.parse(type_, other) if other else self._definition
        except WireError as error:
            raise ConversionError(str(error)) from None
        if not _alike(self._definition, there, (self._definition.type, there.type), set()):
            raise ConversionError(f"{type_} is not the same in ROS 1 and ROS 2")

    def convert(self, data: bytes) -> bytes:
        """The same message in the other encoding. Raises WireError."""
        cursor, writer = Cursor(data, self.source), _Writer(self.target, MOST + DEEPEST * len(data))
        self._value(self._definition.type, cursor, writer)
        cursor.end()
        return writer.message()

    def _value(self, type_: str, cursor: Cursor, writer: _Writer) -> None:
        writer.room -= 1
        if writer.room < 0:
            raise WireError("it has more values than bytes")
        if type_ in NUMBERS:
            self._numbers(_size(type_), 1, cursor, writer)
        elif type_ == "string":
            writer.string(cursor.string())
        elif type_ == HEADER:
            if self.source == "ros1":
                cursor.integer()
            else:
                writer.integer(0)
            self._numbers(4, 2, cursor, writer)
            writer.string(cursor.string())
        else:
            fields = self._definition.types[type_]
            if not fields:  # an empty message takes a byte in ROS 2
                cursor.take(self.source == "cdr")
                writer.parts += bytes(self.target == "cdr")
            for one in fields:
                self._field(one, cursor, writer)

    def _field(self, one: Field, cursor: Cursor, writer: _Writer) -> None:
        count = one.array
        if count is None:
            self._value(one.type, cursor, writer)
            return
        if count < 0:
            count = cursor.integer()
            writer.integer(count)
        if count > len(cursor.data):
            raise WireError("it breaks off")
        if one.type in NUMBERS:
            self._numbers(_size(one.type), count, cursor, writer)
        else:
            for _ in range(count):
                self._value(one.type, cursor, writer)

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
