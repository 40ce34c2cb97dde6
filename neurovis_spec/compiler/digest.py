"""The content hash: SHA-256 of what a network is, not of how its spec is written.

In: the parts of a Network. Out: a hexadecimal digest. Formatting, titles, ``time.steps``, ``layout``, ``render`` and
``ros`` do not show in it; data files (through their values) and the definitions in use do.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass

import numpy as np

from neurovis_spec.language.located import Located

#: Where a node of an expression stood, and what is only shown, is no content.
_SHOWN = frozenset({"start", "end", "title", "description", "descriptions", "labels", "label", "box", "role", "module"})


class _Writer:
    """Feeds values of any of our kinds to the hash, each with a tag, so that no two values read alike."""

    def __init__(self) -> None:
        self.hash = hashlib.sha256()

    def put(self, tag: str, content: bytes = b"") -> None:
        self.hash.update(f"{tag}:{len(content)}:".encode())
        self.hash.update(content)

    def value(self, value: object) -> None:
        if value is None:
            self.put("none")
        elif isinstance(value, np.ndarray):
            kind = "<f8" if value.dtype.kind == "f" else "<i8"
            self.put(f"array{value.shape}{kind}", np.ascontiguousarray(value, dtype=kind).tobytes())
        elif isinstance(value, (bool, int)):
            self.put("integer", str(int(value)).encode())
        elif isinstance(value, float):
            self.put("number", value.hex().encode())
        elif isinstance(value, str):
            self.put("text", value.encode())
        elif isinstance(value, Mapping):
            self.put("mapping", str(len(value)).encode())
            for key, item in sorted(value.items()):  # no mapping of a network has an order that matters
                self.value(str(key))
                self.value(item)
        elif isinstance(value, Located):  # where it stands is no content
            written = value.value
            self.value(float(written) if isinstance(written, int) else written)
        elif is_dataclass(value) and not isinstance(value, type):
            self.put("record", type(value).__name__.encode())
            hidden = _SHOWN if type(value).__name__ not in _KEEP_START else _SHOWN - {"start"}
            for field in fields(value):
                if field.name not in hidden:
                    self.value(field.name)
                    self.value(getattr(value, field.name))
        elif isinstance(value, Iterable):
            items = list(value)
            self.put("list", str(len(items)).encode())
            for item in items:
                self.value(item)
        else:  # pragma: no cover - a new kind of value must be given a way here
            raise TypeError(f"no canonical form for {type(value).__name__}")


#: Records whose ``start`` is content (an index), not a place in a text.
_KEEP_START = frozenset({"Group", "Input", "Noise"})


def digest(*parts: object) -> str:
    """The SHA-256 of the parts, hexadecimal."""
    writer = _Writer()
    for part in parts:
        writer.value(part)
    return writer.hash.hexdigest()
