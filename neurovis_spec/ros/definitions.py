"""The definitions of message types, as recordings hold them: their complete texts, their fields, ROS 1's MD5 sums.

In: a type of the table of the usual ones; or the text of any. Out: the text with those of all types within it, its
fields, and its sum. Header, time and duration are where both ROS differ.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import md5
from typing import Final

from neurovis_spec.language.ros_types import MESSAGES, plain
from neurovis_spec.ros.middleware import Ros
from neurovis_spec.runtime.wire import WireError

SEPARATOR: Final = "=" * 80
_HEADERS: Final[Mapping[Ros, str]] = {
    1: "uint32 seq, time stamp, string frame_id",
    2: "builtin_interfaces/Time stamp, string frame_id",
}
_TIMES: Final = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}
_BUILTIN: Final = {
    "builtin_interfaces/Time": "int32 sec, uint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec, uint32 nanosec",
}
HEADER: Final = "std_msgs/Header"
#: types of numbers, and their characters in ``struct``
NUMBERS: Final[Mapping[str, str]] = {
    "bool": "B", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i",
    "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
#: types of the fields that are no messages
PRIMITIVES: Final = frozenset((*NUMBERS, *_TIMES, "string", "wstring"))
#: types within types, fields of a type with those of all within it, digits of a length: a message has no more
DEEPEST: Final = 32
MOST: Final = 10_000
_LENGTHS: Final = 9
_FIELD: Final = re.compile(r"\s*([A-Za-z0-9_/]+)((?:<=\d+)?(?:\[[<=\d]*\])?)\s+([A-Za-z]\w*)\s*(=)?(.*)", re.DOTALL)


def written(type_: str, ros: Ros) -> str:
    """A type as a ROS writes it.

    >>> written("std_msgs/String", 2)
    'std_msgs/msg/String'
    """
    package, _, name = plain(type_).partition("/")
    return f"{package}/msg/{name}" if ros == 2 else f"{package}/{name}"


def definition(type_: str, ros: Ros) -> str | None:
    """The text of a type with all that is in it; None where it is neither in the table nor known to ``rosbags`` (the
    extra ``ros``), which knows those of ROS itself.

    >>> definition("std_msgs/Float64", 2)
    'float64 data\\n'
    """
    texts: dict[str, str] = {}
    if not _gather(plain(type_), ros, texts):
        return _of_rosbags(type_, ros)
    first, *others = texts.items()
    return "".join([first[1], *(f"{SEPARATOR}\nMSG: {name}\n{text}" for name, text in others)])


def _of_rosbags(type_: str, ros: Ros) -> str | None:
    try:
        from rosbags.typesys import Stores, TypesysError, get_typestore
    except ImportError:
        return None
    try:
        store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.LATEST)
        return store.generate_msgdef(written(type_, 2), ros_version=ros)[0]
    except TypesysError:
        return None


def _gather(type_: str, ros: Ros, texts: dict[str, str]) -> bool:
    """Add the text of a type, and of those in it; False where one is not known."""
    if type_ in texts:
        return True
    package, _, name = type_.partition("/")
    fields = _HEADERS[ros] if type_ == HEADER else _BUILTIN.get(type_) or MESSAGES.get(package, {}).get(name)
    if fields is None:
        return False
    lines, inner = [], []
    for field in filter(None, fields.split(", ")):
        base, _, rest = field.partition(" ")
        base, bracket, length = base.partition("[")
        if base == "Header":
            base = HEADER
        elif ros == 2:
            base = _TIMES.get(base, base)
        if base not in PRIMITIVES and "/" not in base:
            base = f"{package}/{base}"
        if base not in PRIMITIVES:
            inner.append(base)
        lines.append(f"{base}{bracket}{length} {rest}\n")
    texts[type_] = "".join(lines)
    return all(_gather(one, ros, texts) for one in inner)


def fields_of_text(text: str) -> Iterator[tuple[str, str, str, str | None]]:
    """The fields and constants of a type: base, what is behind it (``[3]``, ``<=5``), name, value of a constant."""
    for line in text.splitlines():
        matched = _FIELD.fullmatch(line)
        if matched is None:
            continue
        base, behind, name, equals, rest = matched.groups()
        if equals and base == "string":  # all of the line is its value
            yield base, behind, name, rest.lstrip()
        else:
            rest = rest.partition("#")[0].strip()
            yield base, behind, name, rest if equals else None


def sections(type_: str, text: str) -> dict[str, str]:
    """The texts of a type and of those in it, by their names (``package/Name``)."""
    result = dict[str, str]()
    name, lines = plain(type_), list[str]()
    for line in text.splitlines():
        if line.startswith("=====") and not line.strip("="):
            result.setdefault(name, "\n".join(lines))
            name, lines = "", []
        elif line.startswith("MSG: ") and not name:
            name = plain(line[5:].strip())
        else:
            lines.append(line)
    result.setdefault(name, "\n".join(lines))
    return result


def inner_name(base: str, package: str, known: Mapping[str, object]) -> str:
    """The full name of the type of a field."""
    if base == "Header":
        return HEADER
    full = plain(base) if "/" in base else f"{package}/{base}"
    return full if full in known or "/" in base else next((n for n in known if n.endswith(f"/{base}")), full)


def length_of(behind: str) -> int | None:
    """How many values a field has, by what is behind its type: None for one, −1 for a list of any length. Raises
    WireError.

    >>> [length_of(behind) for behind in ("", "<=9", "[3]", "[]", "[<=3]", "<=9[3]")]
    [None, None, 3, -1, -1, 3]
    """
    if "[" not in behind:
        return None
    length = behind.partition("[")[2].removesuffix("]")
    if not length.isdigit():
        return -1
    if len(length) > _LENGTHS:
        raise WireError(f"an array of a length of {len(length)} digits")
    return int(length)


@dataclass(frozen=True, slots=True)
class Field:
    """A field: ``type`` is a primitive, or the full name of a type; ``array`` is None for one value, −1 for a list of
    any length, else the length."""

    name: str
    type: str
    array: int | None = None


@dataclass(frozen=True)
class Definition:
    """A type, and the fields of each type that it refers to (``package/Name``); ``time`` and ``duration`` of ROS 1 are
    types of two fields, as those of ROS 2 are."""

    type: str
    types: Mapping[str, tuple[Field, ...]]

    @classmethod
    def parse(cls, type_: str, text: str) -> Definition:
        """The definition that recordings hold. Raises WireError.

        >>> text = "float64[] x  # m\\nuint8 K=3\\nC c\\n" + "=" * 80 + "\\nMSG: a/C\\nstring<=9 s"
        >>> Definition.parse("a/B", text).types["a/B"]
        (Field(name='x', type='float64', array=-1), Field(name='c', type='a/C', array=None))
        """
        return cls(plain(type_), _Resolver(type_, text).types)

    @cached_property
    def least(self) -> Mapping[str, int]:
        """The fewest bytes that a value of each type takes."""
        found = {name: struct.calcsize(code) for name, code in NUMBERS.items()} | {"string": 4}

        def size(type_: str) -> int:
            if type_ not in found:
                found[type_] = sum(
                    size(field.type) * field.array if field.array is not None and field.array >= 0
                    else 4 if field.array is not None
                    else size(field.type)
                    for field in self.types[type_]
                )  # fmt: skip
            return found[type_]

        for name in self.types:
            size(name)
        return found

    def field(self, path: str) -> Field | None:
        """The field at a dotted path."""
        type_, found = self.type, None
        for name in path.split("."):
            if found is not None and found.array is not None:
                return None
            found = next((field for field in self.types.get(type_, ()) if field.name == name), None)
            if found is None:
                return None
            type_ = found.type
        return found

    @property
    def stamped(self) -> bool:
        """Whether it begins with a header."""
        return self.types[self.type][:1] == (Field("header", HEADER),)


class _Resolver:
    """Finds the fields of a type and of all types within it, each type once. Raises WireError for a text that does not
    say what a type is, and for one with more in it than a message has."""

    def __init__(self, type_: str, text: str) -> None:
        self._type, self._texts = plain(type_), sections(type_, text)
        self.types: dict[str, tuple[Field, ...]] = {}
        #: how deep types lie within each, and how many fields it has with those of all within it
        self._sizes: dict[str, tuple[int, int]] = {}
        self._resolve(self._type, 0)

    def _resolve(self, type_: str, within: int) -> tuple[int, int]:
        if type_ not in self._sizes and within <= DEEPEST:
            fields = self.types[type_] = tuple(self._fields(type_))
            inner = [self._resolve(field.type, within + 1) for field in fields if not _is_plain(field.type)]
            depth = 1 + max((depth for depth, _ in inner), default=0)
            self._sizes[type_] = depth, len(fields) + sum(count for _, count in inner)
        depth, count = self._sizes.get(type_, (1, 0))
        if within + depth > DEEPEST + 1:
            raise WireError(f"the definition of {self._type} refers to itself")
        if count > MOST:
            raise WireError(f"the definition of {self._type} has too many fields")
        return depth, count

    def _fields(self, type_: str) -> Iterator[Field]:
        if type_ in _TIMES:
            yield from (Field("sec", "int32"), Field("nanosec", "uint32"))
            return
        package = type_.partition("/")[0]
        for base, behind, name, value in fields_of_text(self._texts[type_]):
            if value is not None:
                continue
            if base == "wstring":
                raise WireError(f"the definition of {self._type} has text of wide characters, which is not known here")
            inner = base if base in PRIMITIVES else inner_name(base, package, self._texts)
            if inner not in PRIMITIVES and inner not in self._texts:
                raise WireError(f"the definition of {self._type} does not say what {inner} is")
            yield Field(name, inner, length_of(behind))


def _is_plain(type_: str) -> bool:
    return type_ in NUMBERS or type_ == "string"


def md5sum(type_: str, text: str) -> str:
    """What ROS 1 tells types apart by; "*", which stands for any, where the text is not complete.

    >>> md5sum("std_msgs/Float64", "float64 data # a number")
    'fdb28210bfa9d7c91146260178d9a584'
    """
    try:
        return _md5(plain(type_), sections(type_, text), {}, 0)
    except KeyError:
        return "*"


def _md5(type_: str, texts: Mapping[str, str], sums: dict[str, str], within: int) -> str:
    if type_ in sums:
        return sums[type_]
    if within > DEEPEST:
        raise KeyError(type_)
    constants, fields = [], []
    for base, behind, name, value in fields_of_text(texts[type_]):
        if value is not None:
            constants.append(f"{base} {name}={value}")
        elif base in PRIMITIVES:
            fields.append(f"{base}{behind} {name}")
        else:
            inner = inner_name(base, type_.partition("/")[0], texts)
            fields.append(f"{_md5(inner, texts, sums, within + 1)} {name}")
    sums[type_] = md5("\n".join(constants + fields).encode(), usedforsecurity=False).hexdigest()
    return sums[type_]
