"""Keys that exclude or need each other, as JSON Schema says it.

In: names of keys. Out: keywords of a schema, which models give as their ``json_schema_extra``. The compiler checks the
same and says it in words; the tests hold the two to each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import Final

from pydantic import ConfigDict
from pydantic.config import JsonDict

#: Exactly one key of the model.
ONE_KEY: Final = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})


def _both(first: JsonDict, second: JsonDict) -> JsonDict:
    return {"not": {"allOf": [first, second]}}


def _has(*keys: str) -> JsonDict:
    return {"required": [*keys]}


def _is_table(key: str) -> JsonDict:
    """Whether a key is there and its value a matrix or a file."""
    return {"required": [key], "properties": {key: {"type": ["array", "object"]}}}


def _if(condition: JsonDict, then: JsonDict) -> JsonDict:
    return {"if": condition, "then": then}


def _any(choices: Iterable[JsonDict]) -> JsonDict:
    return {"anyOf": [*choices]}


#: An input has one source at the most.
INPUT: Final = ConfigDict(
    json_schema_extra={
        "allOf": [
            _both(_has(one), _has(other)) for one, other in combinations(("expression", "file", "values", "size"), 2)
        ]
    }
)
#: ``first`` counts from somewhere.
GROUP: Final = ConfigDict(json_schema_extra=_if(_has("first"), _any([_has("count"), _has("names")])))

_WRITTEN: Final = ("matrix", "edges")
_TABLE: Final = _is_table("centre")
#: What makes the connections is said once, and what is said of it has something to hold to.
CONNECTION: Final = ConfigDict(
    json_schema_extra={
        "dependentRequired": {"bounds": ["plasticity"]},
        "allOf": [
            *[_both(_has(one), _has(other)) for one in _WRITTEN for other in ("weight", "pattern", "self")],
            _both(*map(_has, _WRITTEN)),
            *[_both(_TABLE, _has(other)) for other in ("edges", "pattern", "self")],
            _if(_has("rows"), _any([_has("matrix"), _TABLE])),
        ],
    }
)
#: A clamp lasts and is an event of its own; what is set or removed is so from one step on.
_AT_ONCE: Final = ("set", "lesion", "mend", "learning")
EVENT: Final = ConfigDict(
    json_schema_extra={
        "if": _has("clamp"),
        "then": {"required": ["from"], "properties": dict.fromkeys(("at", *_AT_ONCE), False)},
        "else": {"required": ["at"], "properties": {"from": False, "to": False}, **_any([*map(_has, _AT_ONCE)])},
    }
)
