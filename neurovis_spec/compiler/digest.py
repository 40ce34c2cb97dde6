"""The content hash: SHA-256 of what a network is, not of how its spec is written.

In: the parts of a Network. Out: a hexadecimal digest. Formatting, titles, ``time.steps``, ``layout``, ``render`` and
``ros`` do not show in it; data files (through their values) and the definitions in use do.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from neurovis_spec.language.expressions.tree import Chain
from neurovis_spec.language.located import Located

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

#: Where a node of an expression stood, and what is only shown, is no content.
_SHOWN = frozenset(
    # ``slots``, ``parts`` and ``widths`` are how something follows parameters; ``starts``, where there are some, are
    # put behind the rest
    (
        "start",
        "end",
        "title",
        "description",
        "descriptions",
        "labels",
        "label",
        "box",
        "role",
        "module",
        "learns",
        "slots",
        "parts",
        "starts",
        "states",
        "spikes",
        "widths",
    )
)


#: Pieces that are fed to the hash together.
_MANY = 4096


class _Writer:
    """Feeds values of any of our kinds to the hash, each with a tag, so that no two values read alike."""

    def __init__(self) -> None:
        self.hash = hashlib.sha256()
        self._pieces: list[bytes] = []
        #: for each kind of record its beginning, and its fields: how each is called, in the hash and by itself
        self._records: dict[type, tuple[bytes, tuple[tuple[bytes, str], ...]]] = {}

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
        kind = type(value)
        if kind is str or kind is int or value is None:
            self._add(self._common(kind, value))
        elif isinstance(value, str):
            self.put("text", value.encode())
        elif kind in self._records:  # there may be many thousands of a kind
            self._record(cast("DataclassInstance", value))
        elif kind is dict and not value:
            self._add(_EMPTY)
        elif isinstance(value, float):
            self.put("number", value.hex().encode())
        elif isinstance(value, (bool, int)):
            self.put("integer", str(int(value)).encode())
        elif isinstance(value, np.ndarray):
            form = "<f8" if value.dtype.kind == "f" else "<i8"
            self.put(f"array{value.shape}{form}", np.ascontiguousarray(value, dtype=form).tobytes())
        elif isinstance(value, (list, tuple)) and not isinstance(value, Located):
            self._list(value)
        elif isinstance(value, Mapping):
            self.put("mapping", str(len(value)).encode())
            for key, item in sorted(value.items()):  # no mapping of a network has an order that matters
                self.value(str(key))
                self.value(item)
        elif isinstance(value, Chain):
            self._chain(value)
        elif isinstance(value, Located):  # where it stands is no content
            written = value.value
            self.value(float(written) if isinstance(written, int) else written)
        elif is_dataclass(value) and not isinstance(value, type):
            self._record(value)
        elif isinstance(value, Iterable):
            self._list(list(value))
        else:  # pragma: no cover - a new kind of value must be given a way here
            raise TypeError(f"no canonical form for {type(value).__name__}")

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

    def _chain(self, chain: Chain) -> None:
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

    def _record(self, value: DataclassInstance) -> None:
        kind = type(value)
        if kind not in self._records:
            hidden = _SHOWN if kind.__name__ not in _KEEP_START else _SHOWN - {"start"}
            called = (field.name for field in fields(kind) if field.name not in hidden)
            parts = tuple((_piece("text", name.encode()), name) for name in called)
            self._records[kind] = _piece("record", kind.__name__.encode()), parts
        begin, parts = self._records[kind]
        pieces, common = self._pieces, self._known
        pieces.append(begin)
        for piece, name in parts:
            pieces.append(piece)
            item = getattr(value, name)
            kind = type(item)
            if kind is str or kind is int or item is None:
                pieces.append(common.get((kind, item)) or self._common(kind, item))
            else:
                self.value(item)


def _piece(tag: str, content: bytes) -> bytes:
    return b"%b:%d:%b" % (tag.encode(), len(content), content)


_EMPTY = _piece("mapping", b"0")
#: Records whose ``start`` is content (an index), not a place in a text.
_KEEP_START = frozenset({"Group", "Input", "Noise"})


def digest(*parts: object) -> str:
    """The SHA-256 of the parts, hexadecimal."""
    writer = _Writer()
    for part in parts:
        writer.value(part)
    writer.flush()
    return writer.hash.hexdigest()
