"""What the models of the language say of a path: the keys that fit there, their descriptions, the words for a value.

In: a path of keys and indices. Out: Keys and words, from the pydantic models and the JSON Schemas of their leaves; the
same source that ``neurovis schema`` prints.
"""

from __future__ import annotations

import types
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Final, TypeAlias, Union, get_args, get_origin

from pydantic import WithJsonSchema
from pydantic.fields import FieldInfo

from neurovis_spec.language.located import Leaf
from neurovis_spec.language.model import Model
from neurovis_spec.language.modules import IncludedModel
from neurovis_spec.language.spec import Spec
from neurovis_spec.lsp.outline import Path
from neurovis_spec.lsp.words import PATTERNS

#: What may stand somewhere: a model, a type annotation, or the JSON Schema of a leaf.
_Kind: TypeAlias = object

#: What only a spec has at its top level, and what makes a file without it one to be included.
SPEC_ALONE: Final = frozenset(Spec.model_fields) - frozenset(IncludedModel.model_fields)
LIBRARY_ALONE: Final = frozenset({"modules", "activations", "models", "rules"})

#: Keys of leaves, the patterns among them, whose schemas carry no words of their own.
_LEAF_KEYS = {
    "activity": "The activity at step 0; without it step 0 is computed.",
    "value": "The value, a number or an expression.",
    "min": "The least value that may be set.",
    "max": "The largest value that may be set.",
    "description": "Shown as tooltip and on hover.",
    "file": "A file, by its path relative to this one.",
    "key": "The name of the array in an archive.",
    "probability": "The probability of each pair, from 0 to 1.",
    "count": "With how many neurons each one is connected.",
    "degree": "How many neighbours on the ring each neuron is connected with; an even number.",
    "rewire": "The probability with which a connection is led elsewhere, from 0 to 1.",
    "width": "The largest difference |i − j| of two neurons that are connected.",
    **PATTERNS,
}


@dataclass(frozen=True, slots=True)
class Key:
    """A key that may stand in a mapping."""

    name: str
    description: str
    required: bool = False


def keys_at(path: Path, *, library: bool = False) -> tuple[Key, ...]:
    """The keys that the language knows in the mapping at a path, of a spec or of a file to be included (``library``);
    none where the author chooses them."""
    found: dict[str, Key] = {}
    for kind in _expected(path) if path or not library else (IncludedModel,):
        for key in _keys(kind):
            found.setdefault(key.name, key)
    return tuple(found.values())


def key_at(path: Path) -> Key | None:
    """The last key of a path, where it is one of the language."""
    if not path or isinstance(path[-1], int):
        return None
    return next((key for key in keys_at(path[:-1]) if key.name == path[-1]), None)


def words_at(path: Path) -> tuple[str, ...]:
    """The words of which the value at a path is one."""
    return tuple(dict.fromkeys(word for kind in _expected(path) for word in _words(kind)))


def _expected(path: Path) -> tuple[_Kind, ...]:
    kinds: tuple[_Kind, ...] = (Spec,)
    for part in path:
        kinds = tuple(below for kind in kinds for below in _step(kind, part))
    return kinds


def _open(annotation: object, metadata: tuple[object, ...] = ()) -> Iterator[_Kind]:
    """The kinds of an annotation: unions one by one, annotated leaves as their schemas."""
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *more = get_args(annotation)
        yield from _open(inner, tuple(more))
        return
    for item in metadata:
        if isinstance(item, Leaf):
            yield item.schema
            return
    if origin in (Union, types.UnionType):
        for part in get_args(annotation):
            yield from _open(part)
    else:
        for item in metadata:
            if isinstance(item, WithJsonSchema) and item.json_schema is not None:
                yield item.json_schema
        yield annotation


def _step(kind: _Kind, part: str | int) -> Iterator[_Kind]:
    """What may stand under a key, or at an index."""
    if isinstance(kind, dict):
        yield from _schema_step(kind, part)
    elif isinstance(kind, type) and issubclass(kind, Model):
        for name, field in _fields(kind):
            if name == part:
                yield from _open(field.annotation, tuple(field.metadata))
    elif get_origin(kind) is dict and isinstance(part, str):
        yield from _open(get_args(kind)[1])
    elif get_origin(kind) in (tuple, list):
        first = get_args(kind)[0]
        if get_origin(first) is tuple:  # pairs of a key and what it leads to, in one mapping or in a list of them
            if isinstance(part, int):
                yield kind
            else:
                yield from _open(get_args(first)[1])
        elif isinstance(part, int):
            yield from _open(first)


def _schema_step(schema: dict[str, object], part: str | int) -> Iterator[_Kind]:
    for choice in _choices(schema):
        if isinstance(part, int):
            below = choice.get("items")
        else:
            properties = choice.get("properties")
            below = properties.get(part) if isinstance(properties, dict) else None
        if isinstance(below, dict):
            yield below


def _choices(schema: dict[str, object]) -> Iterator[dict[str, object]]:
    yield schema
    several = schema.get("anyOf")
    for choice in several if isinstance(several, list) else ():
        if isinstance(choice, dict):
            yield choice


def _fields(model: type[Model]) -> Iterator[tuple[str, FieldInfo]]:
    for name, field in model.model_fields.items():
        if name != "source":
            yield field.alias or name, field


def _keys(kind: _Kind) -> Iterator[Key]:
    if isinstance(kind, type) and issubclass(kind, Model):
        for name, field in _fields(kind):
            yield Key(name, field.description or "", field.is_required())
    elif isinstance(kind, dict):
        for choice in _choices(kind):
            properties = choice.get("properties")
            for name in properties if isinstance(properties, dict) else ():
                yield Key(str(name), _LEAF_KEYS.get(str(name), ""))


def _words(kind: _Kind) -> Iterator[str]:
    if not isinstance(kind, dict):
        return
    for choice in _choices(kind):
        words = choice.get("enum")
        if isinstance(words, list):
            yield from (str(word) for word in words)
        elif choice.get("type") == "boolean":
            yield from ("true", "false")
        elif "const" in choice:
            yield str(choice["const"])
