"""What is in a message: numbers and texts at a field of any type, in the bytes of either ROS, and such bytes anew.

In: the definition of a type, as recordings hold it; bytes. Out: numbers, texts; bytes. Lengths are compared with what
is there before anything is made of them, so that no message costs more than its bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias, cast

import numpy as np
import numpy.typing as npt

from neurovis_spec.ros.definitions import HEADER, NUMBERS, Definition, Field
from neurovis_spec.runtime.wire import Cursor, Encoding, WireError

#: what a message is made of: numbers, texts, lists of values, fields by name; what is left out is 0 or empty
Value: TypeAlias = "float | int | str | Sequence[Value] | Mapping[str, Value]"


class _Reader:
    """Reads values from the bytes of a message."""

    def __init__(self, definition: Definition, data: bytes, encoding: Encoding) -> None:
        self.definition, self._cursor = definition, Cursor(data, encoding)

    def numbers(self, code: str, count: int) -> tuple[float, ...]:
        size, cursor = struct.calcsize(code), self._cursor
        if count:
            cursor.align(size)
        return struct.unpack(f"{cursor.order}{count}{code}", cursor.take(size * count))

    def need(self, size: int) -> None:
        if size > len(self._cursor.data) - self._cursor.at:
            raise WireError("the message is shorter than it says")

    def several(self, field: Field) -> int:
        """How many values a field has, as far as there is room for them."""
        if field.array is None:
            return 1
        count = self._cursor.integer() if field.array < 0 else field.array
        self.need(count * self.definition.least[field.type])
        return count

    def values(self, field: Field) -> Sequence[float] | Sequence[str]:
        """The values of a field of numbers or texts."""
        count = self.several(field)
        if field.type == "string":
            return [self._cursor.string().decode(errors="replace") for _ in range(count)]
        return self.numbers(NUMBERS[field.type], count)

    def skip(self, field: Field) -> None:
        if field.type in NUMBERS or field.type == "string":
            self.values(field)
            return
        count, fields, cdr = self.several(field), self.definition.types[field.type], self._cursor.origin is not None
        if not fields and cdr:  # ROS 2 gives an empty message a byte
            self._cursor.take(count)
        elif cdr or self.definition.least[field.type]:
            for _ in range(count):
                for inner in fields:
                    self.skip(inner)

    def find(self, type_: str, path: Sequence[str]) -> Sequence[float] | Sequence[str]:
        """The values at a path; what is before it is passed over."""
        for field in self.definition.types[type_]:
            if field.name != path[0]:
                self.skip(field)
            elif len(path) > 1:
                return self.find(field.type, path[1:])
            else:
                return self.values(field)
        raise WireError(f"there is no field '{path[0]}'")


def numbers_at(definition: Definition, path: str, encoding: Encoding) -> Callable[[bytes], Sequence[float]]:
    """What reads the numbers at a path. Raises WireError where there are none; the reader raises it for bytes that are
    no such message."""
    field = definition.field(path)
    if field is None or field.type not in NUMBERS:
        raise WireError(f"messages of type {definition.type} have no numbers at '{path}'")
    parts = path.split(".")
    return lambda data: cast("Sequence[float]", _Reader(definition, data, encoding).find(definition.type, parts))


def texts_at(definition: Definition, path: str, encoding: Encoding) -> Callable[[bytes], Sequence[str]]:
    """What reads the texts at a path. Raises WireError, as ``numbers_at`` does."""
    field = definition.field(path)
    if field is None or field.type != "string":
        raise WireError(f"messages of type {definition.type} have no texts at '{path}'")
    parts = path.split(".")
    return lambda data: cast("Sequence[str]", _Reader(definition, data, encoding).find(definition.type, parts))


class _Writer:
    """Writes values as the bytes of a message; ``wanted`` is where the numbers at a path begin."""

    def __init__(self, definition: Definition, encoding: Encoding, wanted: str = "") -> None:
        self.definition, self.encoding, self.path = definition, encoding, wanted
        self.data, self.found = bytearray(), -1

    def align(self, size: int) -> None:
        if self.encoding == "cdr":
            self.data += bytes(-len(self.data) % size)

    def numbers(self, code: str, values: Sequence[float | int]) -> None:
        if not values:
            return
        self.align(struct.calcsize(code))
        if code not in "fd":
            values = [int(value) for value in values]
        try:
            self.data += struct.pack(f"<{len(values)}{code}", *values)
        except (struct.error, OverflowError) as error:
            raise WireError(f"a number that a field cannot hold: {error}") from None

    def text(self, value: str) -> None:
        raw = value.encode() + (b"\0" if self.encoding == "cdr" else b"")
        self.numbers("I", [len(raw)])
        self.data += raw

    def value(self, type_: str, value: Value | None, path: str) -> None:
        if type_ == "string":
            self.text("" if value is None else str(value))
        elif type_ in NUMBERS:
            self.numbers(NUMBERS[type_], [cast(float, 0 if value is None else value)])
        else:
            given = cast("Mapping[str, Value]", value or {})
            if unknown := [name for name in given if all(name != field.name for field in self.definition.types[type_])]:
                raise WireError(f"messages of type {type_} have no field '{unknown[0]}'")
            for field in self.definition.types[type_]:
                self.field(field, given.get(field.name), f"{path}.{field.name}" if path else field.name)
            if not self.definition.types[type_] and self.encoding == "cdr":
                self.data += b"\0"

    def field(self, field: Field, value: Value | None, path: str) -> None:
        if field.array is None:
            if path == self.path and field.type in NUMBERS:
                self.align(struct.calcsize(NUMBERS[field.type]))
                self.found = len(self.data)
            self.value(field.type, value, path)
            return
        values = list(cast("Sequence[Value]", [] if value is None else value))
        if field.array < 0:
            self.numbers("I", [len(values)])
        elif len(values) > field.array:
            raise WireError(f"'{path}' holds {field.array} values, not {len(values)}")
        else:
            zero: Value = "" if field.type == "string" else 0 if field.type in NUMBERS else {}
            values += [zero] * (field.array - len(values))
        if field.type in NUMBERS:
            if values:
                self.align(struct.calcsize(NUMBERS[field.type]))
            if path == self.path:
                self.found = len(self.data)
            self.numbers(NUMBERS[field.type], cast("Sequence[float]", values))
        else:
            for one in values:
                self.value(field.type, one, path)

    def bytes(self) -> bytes:
        return (b"\0\1\0\0" if self.encoding == "cdr" else b"") + bytes(self.data)


def encode(definition: Definition, value: Mapping[str, Value], encoding: Encoding) -> bytes:
    """The bytes of a message with these fields. Raises WireError.

    >>> encode(Definition.parse("std_msgs/Float64", "float64 data"), {"data": 1.5}, "ros1").hex()
    '000000000000f83f'
    """
    writer = _Writer(definition, encoding)
    writer.value(definition.type, value, "")
    return writer.bytes()


class Form:
    """A message in which nothing but the numbers at a path changes, and the time of its header, if it has one.

    Numbers are kept within what the field holds; for one of integers they are rounded. Raises WireError where the field
    is none of numbers, or holds another number of them.
    """

    def __init__(
        self,
        definition: Definition,
        path: str,
        size: int,
        encoding: Encoding,
    ) -> None:
        field = definition.field(path)
        if field is None or field.type not in NUMBERS:
            raise WireError(f"messages of type {definition.type} have no numbers at '{path}'")
        if field.array is None and size != 1:
            raise WireError(f"'{path}' of {definition.type} is one number, not {size}")
        value: Value = 0 if field.array is None else [0] * size
        for name in reversed(path.split(".")):
            value = {name: value}
        writer = _Writer(definition, encoding, path)
        writer.value(definition.type, value, "")
        shift = 4 if encoding == "cdr" else 0
        self._data, at = bytearray(writer.bytes()), writer.found + shift
        code = NUMBERS[field.type]
        self._numbers = np.frombuffer(self._data, dtype=f"<{code}", count=size, offset=at)
        self._whole = code not in "fd"
        self._bounds = _bounds(field.type, code)
        self._stamp: int | None = None
        if definition.stamped:
            numbered = definition.types[HEADER][0].name == "seq"
            self._stamp = shift + (4 if numbered else 0)

    def fill(self, numbers: npt.ArrayLike, nanoseconds: int) -> bytes:
        """The message with these numbers, at this time. Raises WireError for a number that the field cannot hold."""
        given = np.asarray(numbers, dtype=np.float64)
        if self._whole:
            if not np.isfinite(given).all():
                raise WireError("a field of integers cannot hold what is not finite")
            given = np.round(given)
        self._numbers[:] = np.clip(given, *self._bounds)
        if self._stamp is not None:
            seconds, rest = divmod(nanoseconds, 1_000_000_000)
            struct.pack_into("<II", self._data, self._stamp, seconds & 0xFFFFFFFF, rest)
        return bytes(self._data)


def _bounds(type_: str, code: str) -> tuple[float, float]:
    """The least and the most that numbers of a type can be, as far as a double can say it."""
    if type_ == "bool":
        return 0.0, 1.0
    if code in "fd":
        most = float(np.finfo(np.float32).max) if code == "f" else np.inf
        return -most, most
    about = np.iinfo(np.dtype(code))
    high = float(about.max)
    return float(about.min), high if int(high) <= about.max else float(np.nextafter(high, 0))
