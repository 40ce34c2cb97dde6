"""The keys of the language, from its models: path, kind of value, default, what it means.

In: the pydantic models, their descriptions and JSON Schemas. Out: Keys in the order of the models, those that this
version does not read yet among them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import get_args

from neurovis_spec.language.grammar import Role
from neurovis_spec.language.model import Model
from neurovis_spec.language.modules import InstanceModel
from neurovis_spec.language.places import role_at
from neurovis_spec.language.sections import ConnectionModel, GroupModel, InputModel
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.values import ParameterModel

_DEFAULT = re.compile(r" \(default ([^()]*)\)")
#: Where a mapping of the author's names stands between a section and its keys, as in ``neurons.GROUP.count``.
_SINGLE = "{name: {…}}"


@dataclass(frozen=True, slots=True)
class Key:
    """A key: ``path`` is the sections and the key joined with dots, names of the author's left out.

    ``kind`` says what may be written there, ``role`` what its texts are for; ``model`` is the model that holds the keys
    below it, if there are such.
    """

    path: str
    kind: str
    about: str
    default: str = ""
    required: bool = False
    model: type[Model] | None = None
    role: Role | None = None

    @property
    def name(self) -> str:
        """The key itself."""
        return self.path.rpartition(".")[2]


#: What modules and definitions have in common with a spec: the keys are those of the section of the same name at the
#: top level.
_SHARED = (GroupModel, ConnectionModel, InputModel, InstanceModel, ParameterModel)


@cache
def keys() -> tuple[Key, ...]:
    """All keys, a section's before those below it."""
    return tuple(_walk(Spec, ""))


def keys_of(section: str) -> tuple[Key, ...]:
    """The keys right below a section; ``""`` is the top level."""
    return tuple(key for key in keys() if key.path.rpartition(".")[0] == section)


def _walk(model: type[Model], prefix: str) -> Iterator[Key]:
    shapes = model.model_json_schema(by_alias=True)["properties"]
    for name, field in model.model_fields.items():
        shown = field.alias or name
        if name == "source":
            continue
        about = field.description or ""
        default = _DEFAULT.search(about)
        below = _model_in(field.annotation)
        again = model is not Spec and below in _SHARED
        yield Key(
            path=prefix + shown,
            kind=kind(shapes[shown]),
            about=f"{about} Written as at the top level." if again else _DEFAULT.sub("", about),
            default="" if default is None else default[1],
            required=field.is_required(),
            model=below,
            role=role_at(model, shown),
        )
        if again:
            continue
        if below is not None:
            yield from _walk(below, f"{prefix}{shown}.")


def _model_in(annotation: object) -> type[Model] | None:
    """The model that an annotation holds, directly or as the value of a mapping."""
    if isinstance(annotation, type) and issubclass(annotation, Model):
        return annotation
    found = (_model_in(part) for part in get_args(annotation))
    return next((model for model in found if model is not None), None)


def kind(shape: Mapping[str, object]) -> str:
    """What may be written, in words, from a JSON Schema.

    >>> kind({"anyOf": [{"type": "number"}, {"type": "string", "maxLength": 1000}, {"type": "null"}]})
    'number or expression'
    >>> kind({"anyOf": [{"enum": ["from", "to"]}, {"type": "null"}]})
    'from, to'
    """
    options = shape.get("anyOf")
    if not isinstance(options, list):
        return _one(shape)
    words = [word for word in dict.fromkeys(map(_one, options)) if word]
    return " or ".join(("name" if word == "text" and _SINGLE in words else word) for word in words)


def _one(shape: Mapping[str, object]) -> str:
    if "anyOf" in shape:
        return kind(shape)
    if "$ref" in shape:
        return "mapping"
    if "const" in shape:
        return str(shape["const"])
    words = shape.get("enum")
    if isinstance(words, list):
        return ", ".join(str(word) for word in words)
    match shape.get("type"):
        case "null":
            return ""
        case "string":
            return _text(shape)
        case "boolean":
            return "true, false"
        case "array":
            return _list(shape)
        case "object":
            return _mapping(shape)
        case plain:
            return str(plain or "mapping")


def _text(shape: Mapping[str, object]) -> str:
    """Expressions have a length, names have a form."""
    if "maxLength" in shape:
        return "expression"
    return "name" if str(shape.get("pattern", "")).startswith("^[A-Za-z_]") else "text"


def _list(shape: Mapping[str, object]) -> str:
    items = shape.get("items")
    if shape.get("minItems") == shape.get("maxItems") == 2:
        return "pair [a, b]"
    if isinstance(items, dict) and items.get("type") == "array":
        if items.get("items") == {"type": "string"} and items.get("maxItems") is None:
            return "list of lists"
        return "list of pairs" if items.get("maxItems") == 2 else "list of rows"
    word = _one(items) if isinstance(items, dict) else ""
    return f"list of {word}s" if word in ("text", "name") else "list"


def _mapping(shape: Mapping[str, object]) -> str:
    properties = shape.get("properties")
    if shape.get("maxProperties") == 1:
        plain = isinstance(properties, dict) and any("anyOf" in one for one in properties.values())
        return "{name: …}" if plain else _SINGLE
    if isinstance(properties, dict) and "file" in properties:
        return "{file: …}"
    return "mapping"
