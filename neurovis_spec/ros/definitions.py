"""The definitions of message types, as recordings hold them: complete texts, and ROS 1's MD5 sums of them.

In: a type of the table of the usual ones; or the text of any. Out: the text with those of all types within it, and its
sum. Header, time and duration are where both ROS differ.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from hashlib import md5
from typing import Final

from neurovis_spec.language.ros_types import MESSAGES, plain
from neurovis_spec.ros.middleware import Ros

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
#: types of the fields that are no messages
PRIMITIVES: Final = frozenset(
    (
        *("bool", "byte", "char", "float32", "float64", "string", "wstring", "time", "duration"),
        *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
    )
)
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
    fields = _HEADERS[ros] if type_ == "std_msgs/Header" else _BUILTIN.get(type_) or MESSAGES.get(package, {}).get(name)
    if fields is None:
        return False
    lines, inner = [], []
    for field in filter(None, fields.split(", ")):
        base, _, rest = field.partition(" ")
        base, bracket, length = base.partition("[")
        if base == "Header":
            base = "std_msgs/Header"
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
        return "std_msgs/Header"
    full = plain(base) if "/" in base else f"{package}/{base}"
    return full if full in known or "/" in base else next((n for n in known if n.endswith(f"/{base}")), full)


def md5sum(type_: str, text: str) -> str:
    """What ROS 1 tells types apart by; "*", which stands for any, where the text is not complete.

    >>> md5sum("std_msgs/Float64", "float64 data # a number")
    'fdb28210bfa9d7c91146260178d9a584'
    """
    try:
        return _md5(plain(type_), sections(type_, text), ())
    except KeyError:
        return "*"


def _md5(type_: str, texts: Mapping[str, str], within: tuple[str, ...]) -> str:
    if type_ in within:
        raise KeyError(type_)
    constants, fields = [], []
    for base, behind, name, value in fields_of_text(texts[type_]):
        if value is not None:
            constants.append(f"{base} {name}={value}")
        elif base in PRIMITIVES:
            fields.append(f"{base}{behind} {name}")
        else:
            inner = inner_name(base, type_.partition("/")[0], texts)
            fields.append(f"{_md5(inner, texts, (*within, type_))} {name}")
    return md5("\n".join(constants + fields).encode(), usedforsecurity=False).hexdigest()
