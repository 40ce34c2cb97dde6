"""A spec that is given as a mapping, as its text.

In: mappings, sequences, arrays and numbers of any make. Out: JSON, which is YAML; its lines are what findings point at.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

import numpy as np

#: The most values: a larger text than theirs is not read.
MOST_VALUES = 1 << 23


def text_of(spec: Mapping[str, object]) -> str:
    """The text of a spec. Raises TypeError for what no spec holds; ValueError for what holds itself, is too large, or
    has two keys that read alike."""
    try:
        plain = _Plain().of(spec, ())
        return json.dumps(plain, indent=1, ensure_ascii=False, allow_nan=True)
    except RecursionError:
        raise ValueError("the mapping is nested too deeply for a spec") from None


class _Plain:
    """Turns values into those that JSON knows, and counts them: what is shared may be larger than it looks."""

    def __init__(self) -> None:
        self._count = 0
        self._around: list[object] = []

    def of(self, value: object, place: tuple[str, ...]) -> object:
        """The plain value; ``place``: the keys that lead to it."""
        self._count += 1
        if self._count > MOST_VALUES:
            raise ValueError(f"the mapping is too large for a spec: it has more than {MOST_VALUES:,} values")
        if isinstance(value, np.ndarray | np.generic):
            return self.of(value.tolist(), place)
        if isinstance(value, str | int | float) or value is None:
            return value
        if any(value is one for one in self._around):
            where = f", at '{': '.join(place[-3:])}'" if place else ""
            raise ValueError(f"the mapping holds itself{where}")
        if not isinstance(value, Iterable) or isinstance(value, bytes | bytearray | memoryview):
            raise TypeError(f"a spec holds mappings, lists, texts and numbers, not {type(value).__name__}")
        self._around.append(value)
        plain = self._mapping(value, place) if isinstance(value, Mapping) else [self.of(item, place) for item in value]
        self._around.pop()
        return plain

    def _mapping(self, value: Mapping[object, object], place: tuple[str, ...]) -> dict[str, object]:
        result: dict[str, object] = {}
        for key, item in value.items():
            name = str(key)
            if name in result:
                raise ValueError(f"two keys of the mapping read as '{name}'")
            result[name] = self.of(item, (*place, name))
        return result
