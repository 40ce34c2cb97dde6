"""Activities by the names of neurons, as JSON: what PlotJuggler and Foxglove plot as curves by name.

In: the names of a network's neurons, and which of them are wanted. Out: what messages look like, as a JSON Schema, and
a message for each row: ``{"K1": 0.25, "left": {"O": 1}}``, where ``left`` is an instance. What is not finite is left
out, as JSON has no word for it: a curve has a gap there.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np

from neurovis_spec.arrays import FloatArray

#: the name of the schema
SCHEMA: Final = "neurovis.Values"
#: enough digits for a curve; the arrays beside it have every bit
_NUMBER: Final = "%.9g"
#: the columns of a row by the parts of names
_Tree: TypeAlias = "dict[str, int | _Tree]"


@dataclass(frozen=True)
class NamedValues:
    """Messages with the activities of some neurons."""

    _tree: _Tree
    #: the columns in the order of the tree
    _order: tuple[int, ...] = field(init=False)
    #: a message whose numbers are all finite, to be filled in
    _whole: str = field(init=False)

    def __post_init__(self) -> None:
        order: list[int] = []

        def number(column: int) -> str:
            order.append(column)
            return _NUMBER

        object.__setattr__(self, "_whole", _object(self._tree, number))
        object.__setattr__(self, "_order", tuple(order))

    @classmethod
    def of(cls, names: Sequence[str], wanted: Sequence[int]) -> NamedValues:
        """Of a network whose neurons have these names, those that are ``wanted``, by their numbers.

        >>> NamedValues.of(["K1", "K2", "left.O"], [0, 2]).message(np.array([0.5, 1, -2]))
        b'{"K1":0.5,"left":{"O":-2}}'
        """
        paths = {column: names[column].split(".") for column in wanted}
        within = {".".join(path[:length]) for path in paths.values() for length in range(1, len(path))}
        tree: _Tree = {}
        for column, path in paths.items():
            below = tree
            # a file may name neurons as no spec does, one as what is around another: then each has its whole name
            for part in () if within.intersection(names) else path[:-1]:
                found = below.setdefault(part, {})
                assert isinstance(found, dict)
                below = found
            below[names[column] if below is tree else path[-1]] = column
        return cls(tree)

    @property
    def schema(self) -> str:
        """What messages look like, as a JSON Schema."""
        return json.dumps(_schema(self._tree))

    def message(self, row: FloatArray) -> bytes:
        """The message of a row (neurons,)."""
        numbers = row[list(self._order)].tolist()
        if np.isfinite(numbers).all():
            return (self._whole % tuple(numbers)).encode()
        finite = [number for number in numbers if np.isfinite(number)]
        text = _object(self._tree, lambda column: _NUMBER if np.isfinite(row[column]) else None)
        return (text % tuple(finite)).encode()


def _object(tree: _Tree, number: Callable[[int], str | None]) -> str:
    """The text of an object, as a template; what ``number`` gives None for is left out."""
    parts = []
    for name, below in tree.items():
        value = _object(below, number) if isinstance(below, dict) else number(below)
        if value is not None:
            parts.append(f"{json.dumps(name).replace('%', '%%')}:{value}")
    return f"{{{','.join(parts)}}}"


def _schema(tree: _Tree) -> dict[str, object]:
    properties = {
        name: _schema(below) if isinstance(below, dict) else {"type": "number"} for name, below in tree.items()
    }
    return {"type": "object", "properties": properties}
