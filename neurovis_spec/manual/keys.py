"""The keys of the language, from its models: path, kind of value, default, what it means.

In: the pydantic models, their descriptions and shapes. Out: Keys in the order of the models, those that this
version does not read yet among them; of a key, an example, a part of a spec from ``examples.yaml`` beside this module.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import NoneType
from typing import get_args, get_origin

from pydantic.fields import FieldInfo

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.grammar import ListOf, Map, Plain, Role, Row
from neurovis_spec.language.model import Model
from neurovis_spec.language.modules import InstanceModel
from neurovis_spec.language.places import fields_of, fitting, role_at
from neurovis_spec.language.sections import ConnectionModel, GroupModel, InputModel
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.values import ParameterModel
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import Entry, Mapping, Scalar

_DEFAULT = re.compile(r" \(default ([^()]*)\)")
#: Where a mapping of the author's names stands between a section and its keys, as in ``neurons.GROUP.count``.
_SINGLE = "{name: {…}}"
#: keys of which one is given are listed up to so many
_FEW = 3


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
    for shown, field in fields_of(model):
        about = field.description or ""
        default = _DEFAULT.search(about)
        below = _model_in(field.annotation)
        again = model is not Spec and below in _SHARED
        yield Key(
            path=prefix + shown,
            kind=kind(field),
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


def kind(field: FieldInfo) -> str:
    """What may be written at a field, in words.

    >>> kind(GroupModel.model_fields["bias"]), kind(ConnectionModel.model_fields["rows"])
    ('number or expression or list or {file: …} or mapping', 'from, to')
    """
    found = dict.fromkeys(word for word in map(_word, fitting(field)) if word)
    words = sorted(found, key="mapping".__eq__)  # which comes last
    return " or ".join("name" if word == "text" and _SINGLE in words else word for word in words)


def _word(fits: object) -> str:
    """One of the things that fit a place, in words."""
    match fits:
        case Plain(formula=True):
            return "number or expression"
        case Plain(words=(_, *_) as words):
            return ", ".join(words)
        case Plain(written={"type": "string"} as written):
            return "name" if str(written.get("pattern", "")).startswith("^[A-Za-z_]") else "text"
        case Plain(written=written):
            return str(written["type"])
        case ListOf(least=2, most=2):
            return "pair [a, b]"
        case ListOf(item=ListOf(most=2)):
            return "list of pairs"
        case ListOf(item=ListOf(item=Plain())):
            return "list of lists"
        case ListOf(item=ListOf() | Row()):
            return "list of rows"
        case ListOf(item=item):
            word = _word(item)
            return f"list of {word}s" if word in ("text", "name") else "list"
        case Map(one=True, other=None, known=known) if len(known) <= _FEW:
            return " or ".join(f"{{{name}: …}}" for name in known)
        case Map(one=True, known=known):
            return _SINGLE if all(isinstance(key.shape, Map) for key in known.values()) else "{name: …}"
        case Map(known={"file": _}):
            return "{file: …}"
    if get_origin(fits) is tuple:
        return "mapping or list" if get_origin(get_args(fits)[0]) is tuple else "list"
    return "" if fits is NoneType else "mapping"


@cache
def examples() -> dict[str, str]:
    """Path of a key to a part of a spec, in the order of the file."""
    return {
        entry.name: str(entry.value.value).rstrip()
        for entry in written_in("examples.yaml")
        if isinstance(entry.value, Scalar)
    }


def written_in(file: str) -> tuple[Entry, ...]:
    """What a file beside this module says."""
    text = files("neurovis_spec.manual").joinpath(file).read_text(encoding="utf-8")
    findings = Findings()
    document = read_text(text, file, findings)
    findings.check()
    assert document is not None
    assert isinstance(document.root, Mapping)
    return document.root.entries


def example(path: str) -> str | None:
    """The example of a key, else that of its section; none where there is nothing to show."""
    while path:
        found = examples().get(path)
        if found is not None:
            return found
        path = path.rpartition(".")[0]
    return None
