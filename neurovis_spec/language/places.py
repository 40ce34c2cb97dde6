"""What the grammar says of a place in a spec: the keys that fit there, what its texts are for, the words for a value.

In: a path of keys and indices. Out: Keys, Roles and words, read from the fields of the models.
"""

from __future__ import annotations

import re
import types
from collections.abc import Collection, Iterator
from functools import lru_cache
from typing import Annotated, Final, NamedTuple, TypeAlias, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from neurovis_spec.language.grammar import Either, Map, Plain, Role, Shape, below
from neurovis_spec.language.located import Leaf
from neurovis_spec.language.model import OWN, Model, Short
from neurovis_spec.language.modules import INCLUDED
from neurovis_spec.language.spec import IncludedModel, Spec
from neurovis_spec.language.yaml.source import Mapping, Node, Packed, Scalar, Sequence

#: Keys and indices from the root.
Path: TypeAlias = tuple[str | int, ...]

#: What only a spec has at its top level, and what makes a file without it one to be included.
SPEC_ALONE: Final = frozenset(Spec.model_fields) - frozenset(IncludedModel.model_fields)
LIBRARY_ALONE: Final = frozenset(INCLUDED)


class _Place(NamedTuple):
    """What may stand somewhere: a model, the annotation of a mapping or of a list, or a shape; and its role."""

    kind: object
    role: Role | None = None


class KeyHere(NamedTuple):
    """A key that may stand in a mapping."""

    name: str
    description: str
    required: bool = False


def keys_at(path: Path, *, library: bool = False) -> tuple[KeyHere, ...]:
    """The keys that the language knows in the mapping at a path, of a spec or of a file to be included (``library``);
    none where the author chooses them."""
    places = _places(path) if path or not library else (_Place(IncludedModel),)
    found: dict[str, KeyHere] = {}
    for place in places:
        for key in _keys(place.kind):
            found.setdefault(key.name, key)
    return tuple(found.values())


def key_at(path: Path) -> KeyHere | None:
    """The last key of a path, where it is one of the language."""
    if not path or isinstance(path[-1], int):
        return None
    return next((key for key in keys_at(path[:-1]) if key.name == path[-1]), None)


def words_at(path: Path) -> dict[str, str]:
    """The words of which the value at a path is one, with what they mean."""
    shapes = [place.kind for place in _places(path) if isinstance(place.kind, Plain)]
    return {word: shape.abouts.get(word, "") for shape in shapes for word in shape.words}


def role_of(path: Path, is_key: bool) -> Role | None:
    """What the text at a path is for, a key or a value.

    >>> role_of(("neurons", "K", "bias", 2), False).sees, role_of(("modules", "leg", "parameters", "g"), True).kind
    (('i', 'n'), 'parameter')
    """
    if not is_key:
        return _role(_places(path))
    roles = (_role_of_key(place, str(path[-1])) for place in _places(path[:-1]))
    return next((role for role in roles if role is not None), None)


def role_at(model: type[Model], *path: str | int) -> Role | None:
    """What the texts below a key of a model are for."""
    places: tuple[_Place, ...] = (_Place(model),)
    for part in path:
        places = _below(places, part)
    return _role(places)


@lru_cache
def formula_at(model: type[Model], *path: str | int) -> Role:
    """What the formulas below a key of a model see.

    >>> formula_at(Spec, "connections", "A -> B", "weight").draws, formula_at(Spec, "time", "dt").sees
    (True, ())
    """
    role = role_at(model, *path)
    assert role is not None
    return role


def fitting(field: FieldInfo) -> Iterator[object]:
    """What fits a field, one by one: models, mappings and lists of these as annotations, all else as shapes."""
    return (place.kind for place in _open(field.annotation, tuple(field.metadata)))


class Written(NamedTuple):
    """A formula as it is written: its text, and the keys that lead to it from a model; indices are left out."""

    text: str
    node: Scalar
    path: tuple[str, ...]


def formulas_of(model: Model, seen: Collection[str]) -> Iterator[Written]:
    """The formulas of a model that are texts, hold any of some names and see them."""
    for node, path in _texts(model.source, (), _any_of(tuple(seen))):
        role = role_at(type(model), *path)
        if role is not None and role.use in ("formula", "setting value") and not set(seen).isdisjoint(role.sees):
            yield Written(str(node.value), node, tuple(part for part in path if isinstance(part, str)))


@lru_cache(maxsize=64)
def _any_of(names: tuple[str, ...]) -> re.Pattern[str]:
    """Any of some names in a text."""
    return re.compile(rf"\b(?:{'|'.join(names)})\b", re.ASCII)


def _texts(node: Node, path: Path, wanted: re.Pattern[str]) -> Iterator[tuple[Scalar, Path]]:
    match node:
        case Scalar(value=str() as text):
            if wanted.search(text):
                yield node, path
        case Mapping(entries=entries):
            for entry in entries:
                yield from _texts(entry.value, (*path, entry.name), wanted)
        case Sequence() | Packed():
            if isinstance(node, Sequence) or any(map(wanted.search, node.texts)):  # of many numbers none is asked
                for index, item in enumerate(node.items):
                    yield from _texts(item, (*path, index), wanted)


def _role(places: tuple[_Place, ...]) -> Role | None:
    shapes = ((place.kind, place.role) for place in places)
    roles = (kind.role_in(role) for kind, role in shapes if isinstance(kind, Plain))
    return next((role for role in roles if role is not None), None)


def _role_of_key(place: _Place, key: str) -> Role | None:
    """What the keys of a mapping are for; those that the language knows are for nothing else."""
    if isinstance(place.kind, Map):
        return None if key in place.kind.known else place.kind.role
    return place.role if get_origin(place.kind) in (dict, tuple) else None


@lru_cache(maxsize=4096)
def _places(path: Path) -> tuple[_Place, ...]:
    """What may stand at a path. Those of long lists are one."""
    if not path:
        return (_Place(Spec),)
    return _below(_places(tuple(0 if isinstance(part, int) else part for part in path[:-1])), path[-1])


def _below(places: tuple[_Place, ...], part: str | int) -> tuple[_Place, ...]:
    return tuple(one for place in places for one in _step(place, part))


def _open(annotation: object, metadata: tuple[object, ...] = (), role: Role | None = None) -> Iterator[_Place]:
    """The places of an annotation: unions one by one, leaves as their shapes. The innermost role is the place's."""
    if get_origin(annotation) is Annotated:
        inner, *more = get_args(annotation)
        yield from _open(inner, tuple(more), next((one for one in metadata if isinstance(one, Role)), role))
        return
    role = next((one for one in metadata if isinstance(one, Role)), role)
    leaf = next((one for one in metadata if isinstance(one, Leaf)), None)
    if leaf is not None:
        yield from _choices(leaf.shape, role)
    elif get_origin(annotation) in (Union, types.UnionType):
        for part in get_args(annotation):
            yield from _open(part, (), role)
    else:
        yield _Place(annotation, role)
        short = next((one for one in metadata if isinstance(one, Short)), None)
        if short is not None:
            yield from _step(_Place(annotation, role), short.key)


def _choices(shape: Shape, role: Role | None) -> Iterator[_Place]:
    for choice in shape.choices if isinstance(shape, Either) else ():
        yield from _choices(choice, role)
    if not isinstance(shape, Either):
        yield _Place(shape, role)


def _step(place: _Place, part: str | int) -> Iterator[_Place]:
    """What may stand under a key, or at an index."""
    kind, role = place
    arguments = get_args(kind)
    if isinstance(kind, Shape):
        under = below(kind, part)
        yield from () if under is None else _choices(under, role)
    elif isinstance(kind, type) and issubclass(kind, Model):
        field = dict(fields_of(kind)).get(str(part))
        if field is not None:
            yield from _open(field.annotation, tuple(field.metadata), role)
    elif get_origin(kind) is dict and isinstance(part, str):
        yield from _open(arguments[1])
    elif get_origin(kind) is tuple and get_origin(arguments[0]) is tuple:  # connections: pairs of a key and a body
        yield from (place,) if isinstance(part, int) else _open(get_args(arguments[0])[1])
    elif get_origin(kind) is tuple and isinstance(part, int):
        yield from _open(arguments[0], (), role)


def fields_of(model: type[Model]) -> Iterator[tuple[str, FieldInfo]]:
    """The keys of a model and their fields."""
    for name, field in model.model_fields.items():
        if name not in OWN:
            yield field.alias or name, field


def _keys(kind: object) -> Iterator[KeyHere]:
    if isinstance(kind, type) and issubclass(kind, Model):
        for name, field in fields_of(kind):
            yield KeyHere(name, field.description or "", field.is_required())
    elif isinstance(kind, Map):
        for name, key in kind.known.items():
            yield KeyHere(name, key.about, key.required)
