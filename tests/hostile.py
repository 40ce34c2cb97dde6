"""Misuse made systematically: every place of a spec with every wrong value.

In: a spec as plain data. Out: texts of specs, each with one value replaced, and where.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TypeAlias

Data: TypeAlias = "dict[str, Data] | list[Data] | str | float | bool | None"
Place: TypeAlias = tuple[str | int, ...]

#: A spec in which every key of the language occurs.
RICH = (Path(__file__).parent / "rich.yaml").read_text(encoding="utf-8")

#: What a value is replaced by, as YAML; the long list takes the reader's packed path.
WRONG: dict[str, str] = {
    "null": "null",
    "true": "true",
    "three": "3",
    "minus one": "-1",
    "one and a half": "1.5",
    "huge": "1e300",
    "largest integer": "9223372036854775807",
    "text": "text",
    "empty text": '""',
    "blank": '" "',
    "expression": "1/0",
    "operator": '"+"',
    "arrow": '"A -> B"',
    "empty list": "[]",
    "list of an empty list": "[[]]",
    "list of nulls": "[null, null]",
    "list of texts": "[a, b]",
    "list of a mapping": "[{a: 1}]",
    "empty mapping": "{}",
    "mapping": "{a: 1}",
    "mapping of nothing": "{a: null}",
    "long list": "[" + ", ".join(["1"] * 100) + "]",
    "long list of texts": "[" + ", ".join(["a"] * 100) + "]",
    "long list of nulls": "[" + ", ".join(["null"] * 100) + "]",
    "long list of rows": "[" + ", ".join(["[1, 2]"] * 100) + "]",
    "long list of edges": "[" + ", ".join(["[a, b, 1]"] * 100) + "]",
    "nan": ".nan",
    "long text": "x" * 10_000,
    "long sum": "1" + "+1" * 5_000,
}


def paths(data: Data, here: Place = ()) -> Iterator[Place]:
    """Every place of a spec, from the outside in."""
    if here:
        yield here
    if isinstance(data, dict):
        for key, value in data.items():
            yield from paths(value, (*here, key))
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from paths(value, (*here, index))


_MARK = "@@replaced@@"


def replaced(data: Data, path: Place, wrong: str) -> str:
    """The spec as a text, with the value at this place replaced."""
    return json.dumps(_with(data, path, _MARK), indent=1, ensure_ascii=False).replace(f'"{_MARK}"', wrong)


def without(data: Data, path: Place) -> Data:
    """The spec without this place."""
    first, rest = path[0], path[1:]
    if isinstance(data, dict):
        kept = {key: value for key, value in data.items() if key != first or rest}
        return {key: without(value, rest) if key == first else value for key, value in kept.items()}
    assert isinstance(data, list)
    items = [(index, value) for index, value in enumerate(data) if index != first or rest]
    return [without(value, rest) if index == first else value for index, value in items]


def _with(data: Data, path: Place, value: Data) -> Data:
    if not path:
        return value
    first, rest = path[0], path[1:]
    if isinstance(data, dict):
        return {key: _with(inner, rest, value) if key == first else inner for key, inner in data.items()}
    assert isinstance(data, list)
    return [_with(inner, rest, value) if index == first else inner for index, inner in enumerate(data)]


def shown(path: Place) -> str:
    """A place, to read."""
    return ".".join(str(part) for part in path)
