"""The content hash: SHA-256 of what a network is, not of how its spec is written.

In: values, and a schema that says what of which record is content, and how that is called. Out: a hexadecimal digest.
The names are those that the first version had: a hash outlives the types that it is made of, so a field that is new, or
moved, changes none until the schema says so. A record that the schema does not know is an error.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import Column, pieces
from neurovis_spec.language.expressions import tree
from neurovis_spec.language.located import Located


@dataclass(frozen=True, slots=True)
class Record:
    """A record as it is hashed, made for it: what its kind is called, and its fields by name."""

    kind: str
    fields: Mapping[str, object]


@dataclass(frozen=True)
class Content:
    """What of a type is content: what it is called, and its fields, each with the attribute that it is. ``beside`` are
    the attributes that are none: what is only shown, where it stood, how something follows parameters."""

    kind: str
    fields: Mapping[str, str]
    beside: frozenset[str] = frozenset()

    @cached_property
    def pieces(self) -> tuple[bytes, tuple[tuple[bytes, str], ...]]:
        """How it begins, and each of its fields with the attribute."""
        fields = tuple((_piece("text", name.encode()), attribute) for name, attribute in self.fields.items())
        return _piece("record", self.kind.encode()), fields


def content(kind: str, fields: str, beside: str = "") -> Content:
    """The content of a type whose fields are called as its attributes are.

    >>> content("Name", "name", "start end").fields
    {'name': 'name'}
    """
    return Content(kind, {name: name for name in fields.split()}, frozenset(beside.split()))


_PLACE = "start end"
#: The nodes of expressions; a Chain is written as the Binary nodes that it stands for.
TREES: Mapping[type, Content] = {
    tree.Number: content("Number", "value", _PLACE),
    tree.Name: content("Name", "name", _PLACE),
    tree.Unary: content("Unary", "operator operand", _PLACE),
    tree.Binary: content("Binary", "operator left right", _PLACE),
    tree.Conditional: content("Conditional", "condition then otherwise", _PLACE),
    tree.Call: content("Call", "function arguments", _PLACE),
    tree.Draw: content("Draw", "kind first second index", _PLACE),
}

#: Pieces that are fed to the hash together.
_MANY = 4096


class _Writer:
    """Feeds values of any of our kinds to the hash, each with a tag, so that no two values read alike."""

    def __init__(self, schema: Mapping[type, Content]) -> None:
        self.hash = hashlib.sha256()
        self._pieces: list[bytes] = []
        self._schema = schema

        #: texts and numbers that come time and again, as pieces
        self._known: dict[tuple[type, object], bytes] = {}

    def put(self, tag: str, content: bytes = b"") -> None:
        self._add(_piece(tag, content))

    def _add(self, piece: bytes) -> None:
        self._pieces.append(piece)
        if len(self._pieces) > _MANY:
            self.flush()

    def flush(self) -> None:
        self.hash.update(b"".join(self._pieces))
        self._pieces.clear()

    def value(self, value: object) -> None:
        """Write a value: plain ones (texts, numbers, lists, mappings, arrays), formulas, records, and those of the
        schema."""
        kind = type(value)
        if kind is str or kind is int or value is None:
            self._add(self._common(kind, value))
        elif isinstance(value, str):
            self.put("text", value.encode())
        elif kind in self._schema:  # there may be many thousands of a kind
            self._content(value)
        elif kind is dict and not value:
            self._add(_EMPTY)
        elif isinstance(value, float):
            self.put("number", value.hex().encode())
        elif isinstance(value, (bool, int)):
            self.put("integer", str(int(value)).encode())
        elif isinstance(value, np.ndarray):
            self._array(value.shape, value.dtype.kind, pieces(value.reshape(-1)))
        elif isinstance(value, Column):  # as the array that it stands for
            self._array((len(value),), value.kept.dtype.kind, value.pieces())
        elif isinstance(value, (list, tuple)) and not isinstance(value, Located):
            self._list(value)
        elif isinstance(value, Mapping):
            self.put("mapping", str(len(value)).encode())
            for key, item in sorted(value.items()):  # no mapping of a network has an order that matters
                self.value(str(key))
                self.value(item)
        elif isinstance(value, tree.Chain):
            self._chain(value)
        elif isinstance(value, Located):  # where it stands is no content
            written = value.value
            self.value(float(written) if isinstance(written, int) else written)
        elif isinstance(value, Record):
            self.put("record", value.kind.encode())
            for name, item in value.fields.items():
                self.value(name)
                self.value(item)
        elif isinstance(value, Iterable):
            self._list(list(value))
        else:
            raise TypeError(f"no schema says what of a {kind.__name__} is content")

    def _array(self, shape: tuple[int, ...], kind: str, parts: Iterable[npt.NDArray[np.generic]]) -> None:
        """An array of numbers of eight bytes, some of it at a time: it may be large."""
        form = "<f8" if kind == "f" else "<i8"
        self._add(b"array%b%b:%d:" % (str(shape).encode(), form.encode(), 8 * math.prod(shape)))
        for part in parts:
            if len(part) > _MANY:
                self.flush()
            self._add(np.ascontiguousarray(part, dtype=form).tobytes())

    def _common(self, kind: type, value: object) -> bytes:
        """The piece of a text, an integer or nothing, of which a network has very many, most of them alike."""
        known = self._known.get((kind, value))
        if known is not None:
            return known
        if len(self._known) >= _MANY:  # names fill it; what comes time and again is soon there again
            self._known.clear()
        tag = "none" if value is None else "text" if kind is str else "integer"
        piece = self._known[kind, value] = _piece(tag, b"" if value is None else str(value).encode())
        return piece

    def _list(self, items: Sequence[object]) -> None:
        self.put("list", str(len(items)).encode())
        for item in items:
            self.value(item)

    def _chain(self, chain: tree.Chain) -> None:
        """One operation upon the other, in the form in which two operands are written: hashes outlive a version."""
        for operator in reversed(chain.operators):
            self.put("record", b"Binary")
            self.value("operator")
            self.value(operator)
            self.value("left")
        self.value(chain.operands[0])
        for operand in chain.operands[1:]:
            self.value("right")
            self.value(operand)

    def _content(self, value: object) -> None:
        """Write a value of the schema: its kind and its attributes. The commonest attributes are written here rather
        than by ``value``, as there are very many."""
        begin, parts = self._schema[type(value)].pieces
        pieces, common = self._pieces, self._known
        pieces.append(begin)
        for piece, attribute in parts:
            pieces.append(piece)
            item = getattr(value, attribute)
            kind = type(item)
            if kind is str or kind is int or item is None:
                pieces.append(common.get((kind, item)) or self._common(kind, item))
            else:
                self.value(item)


def _piece(tag: str, content: bytes) -> bytes:
    return b"%b:%d:%b" % (tag.encode(), len(content), content)


_EMPTY = _piece("mapping", b"0")


def digest(*parts: object, schema: Mapping[type, Content] = TREES) -> str:
    """The SHA-256 of the parts, hexadecimal. Raises TypeError for a value of a type that is neither plain nor in the
    schema."""
    writer = _Writer(schema)
    for part in parts:
        writer.value(part)
    writer.flush()
    return writer.hash.hexdigest()
