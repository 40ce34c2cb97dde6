"""The grammar of values: what a text is for, which names a formula sees, what may be written at a place.

In: nothing. Out: Roles and Shapes, with which the models of the language annotate their fields. A field says once what
it takes (its shape), what its texts are for (its role), which keys exclude it or are needed beside it (``NotWith``,
``Needs``) and what it means (its description). The reader, the JSON Schema, the language server, the manual and the
compiler ask the field.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias

from pydantic.json_schema import JsonSchemaValue

#: What a name names. Groups, neurons, inputs and instances share their names; "local" is known in one definition.
Kind: TypeAlias = Literal[
    "parameter", "neuron", "input", "instance", "output", "module", "activation", "model", "rule", "local"
]
#: What a text is for. A ``choice`` names a definition, a ``setting`` one of its parameters or signals.
Use: TypeAlias = Literal[
    "declares",
    "names",
    "formula",
    "template",
    "ends",
    "references",
    "choice",
    "setting",
    "setting value",
    "state",
    "pattern",
    "engine",
    "message",
    "field",
    "text",
]


@dataclass(frozen=True, slots=True)
class Role:
    """What a text is for. ``kind`` is what it declares or names. Of a formula ``sees`` are the names that it knows
    beside parameters and constants, ``functions`` those of one argument beside the usual ones; ``draws`` says whether
    it may draw random numbers.

    On a field it is the role of its formulas or of its texts; on a mapping, that of its keys; on a model, that of the
    formulas in it.
    """

    use: Use
    kind: Kind | None = None
    sees: tuple[str, ...] = ()
    draws: bool = False
    functions: tuple[str, ...] = ()


#: Formulas, by what they see.
PLAIN: Final = Role("formula")
RUN: Final = Role("formula", sees=("k", "t"))
GROUP: Final = Role("formula", sees=("i", "n"))
GROUP_DRAWN: Final = Role("formula", sees=("i", "n"), draws=True)
NOISE: Final = Role("formula", sees=("k", "t", "i", "n"), draws=True)
PAIR: Final = Role("formula", sees=("i", "j", "n_from", "n_to", "distance"), draws=True)
CELL: Final = Role("formula", sees=("i", "j", "n_from", "n_to"), draws=True)
#: The value of a rule's setting: a formula, or the references of a signal.
RULE_SETTING: Final = Role("setting value", "rule", sees=("i", "j", "n_from", "n_to"))
IN_ACTIVATION: Final = Role("formula", sees=("x",))
IN_MODEL: Final = Role("formula", sees=("drive", "k", "t"))
ACTIVITY: Final = Role("formula", sees=("drive", "k", "t"), functions=("f",))
IN_RULE: Final = Role("formula", sees=("pre", "sent", "post", "weight", "k", "t"))
#: A text with formulas in braces.
LABEL: Final = Role("template", sees=("i", "n", "number"))
#: References to neurons; the ends of a connection, FROM -> TO, or neurons.
REFERENCES: Final = Role("references")
ENDS: Final = Role("ends")


def declaring(kind: Kind) -> Role:
    """Of names that are given here to something."""
    return Role("declares", kind)


def naming(kind: Kind) -> Role:
    """Of names of something that is declared elsewhere."""
    return Role("names", kind)


class Shape(ABC):
    """What may be written at a place."""

    @property
    @abstractmethod
    def schema(self) -> JsonSchemaValue:
        """The same as a JSON Schema."""

    def below(self, part: str | int) -> Iterator[Shape]:
        """What may be written under a key, or at an index."""
        return iter(())


@dataclass(frozen=True, slots=True, eq=False)
class Plain(Shape):
    """A scalar. ``role``: what it is for, whatever its field says; ``formula``: it is a number or an expression;
    ``abouts``: what the words mean of which it is one, where that is not plain."""

    written: Mapping[str, object]
    role: Role | None = None
    formula: bool = False
    abouts: Mapping[str, str] = field(default_factory=dict)

    @property
    def schema(self) -> JsonSchemaValue:
        """As written."""
        return dict(self.written)

    @property
    def words(self) -> Iterator[str]:
        """The words of which it is one."""
        words = self.written.get("enum")
        if isinstance(words, list):
            yield from map(str, words)
        elif self.written.get("type") == "boolean":
            yield from ("true", "false")
        elif "const" in self.written:
            yield str(self.written["const"])

    def role_in(self, field: Role | None) -> Role | None:
        """Its role in a field: formulas have those of formulas, other texts the others."""
        if self.role is not None or not self.formula:
            return self.role or (None if field is None or field.use == "formula" else field)
        return PLAIN if field is None or field.use != "formula" else field


@dataclass(frozen=True, slots=True, eq=False)
class Either(Shape):
    """One of several."""

    choices: tuple[Shape, ...]

    @property
    def schema(self) -> JsonSchemaValue:
        """``anyOf``, of one level."""
        schemas = [choice.schema for choice in self.choices]
        return {
            "anyOf": [
                one for schema in schemas for one in (schema["anyOf"] if schema.keys() == {"anyOf"} else [schema])
            ]
        }


@dataclass(frozen=True, slots=True, eq=False)
class ListOf(Shape):
    """A list of things of one shape."""

    item: Shape
    least: int = 0
    most: int | None = None

    @property
    def schema(self) -> JsonSchemaValue:
        """An array."""
        bounds = {"minItems": self.least or None, "maxItems": self.most}
        return {"type": "array", "items": self.item.schema, **{key: n for key, n in bounds.items() if n is not None}}

    def below(self, part: str | int) -> Iterator[Shape]:
        """The item."""
        if isinstance(part, int):
            yield self.item


@dataclass(frozen=True, slots=True, eq=False)
class Row(Shape):
    """A list whose items differ; those from ``least`` on may be left out."""

    items: tuple[Shape, ...]
    least: int

    @property
    def schema(self) -> JsonSchemaValue:
        """An array with ``prefixItems``."""
        items = [item.schema for item in self.items]
        return {"type": "array", "prefixItems": items, "minItems": self.least, "maxItems": len(items)}

    def below(self, part: str | int) -> Iterator[Shape]:
        """The item at the index."""
        if isinstance(part, int) and part < len(self.items):
            yield self.items[part]


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """A key of a mapping: what it takes, and what it means."""

    shape: Shape
    about: str
    required: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Map(Shape):
    """A mapping: of ``known`` keys, and of others, which have a role, to an ``other`` shape. ``one``: it has one key;
    ``nothing``: it may be left empty."""

    known: Mapping[str, Key]
    other: Shape | None = None
    role: Role | None = None
    one: bool = False
    least: int = 0
    nothing: bool = False

    @property
    def schema(self) -> JsonSchemaValue:
        """An object."""
        result: JsonSchemaValue = {"type": ["object", "null"] if self.nothing else "object"}
        if self.known:
            result["properties"] = {name: key.shape.schema for name, key in self.known.items()}
        required = [name for name, key in self.known.items() if key.required]
        if required:
            result["required"] = required
        result["additionalProperties"] = False if self.other is None else self.other.schema
        if self.least or self.one:
            result["minProperties"] = self.least or 1
        if self.one:
            result["maxProperties"] = 1
        return result

    def below(self, part: str | int) -> Iterator[Shape]:
        """What stands under the key."""
        if isinstance(part, str):
            known = self.known.get(part)
            below = self.other if known is None else known.shape
            if below is not None:
                yield below


#: A number, or the text of an expression.
FORMULA: Final = Plain(
    {"anyOf": [{"type": "number"}, {"type": "string", "pattern": "\\S", "maxLength": 1000}]}, formula=True
)
#: One formula, or a list with one for each neuron.
FORMULAS: Final = Either((FORMULA, ListOf(FORMULA)))
#: Two formulas: a place, a size, bounds.
TWO: Final = ListOf(FORMULA, least=2, most=2)
TEXT: Final = Plain({"type": "string"})
#: A text that is for nothing but reading, whatever its field is for.
UNNAMED: Final = Plain({"type": "string"}, Role("text"))
BOOL: Final = Plain({"type": "boolean"})
NULL: Final = Plain({"type": "null"})
TEXTS: Final = Either((TEXT, ListOf(TEXT)))
#: Something that names neurons or connections.
REFERENCE: Final = Plain({"type": "string", "pattern": "[A-Za-z_]"})


def words(*known: str, abouts: Mapping[str, str] | None = None) -> Plain:
    """One of these words, with what they mean."""
    return Plain({"enum": [*known]}, abouts=abouts or {})


@dataclass(frozen=True, slots=True)
class AsTable:
    """A key, where it is written as rows or as a file: then it says which neurons are connected."""

    key: str


#: A key that is there, in whatever way or as a table.
Written: TypeAlias = "str | AsTable"


@dataclass(frozen=True, slots=True)
class NotWith:
    """Keys that exclude that of a field. ``why`` and ``hint`` may name {own} and {other}, the two keys."""

    others: tuple[Written, ...]
    why: str = "'{own}' beside '{other}': the {other} says it already"
    hint: str | None = "remove '{own}'"
    code: str = "conflicting-keys"


@dataclass(frozen=True, slots=True)
class Needs:
    """Keys of which one has to be there beside that of a field."""

    others: tuple[Written, ...]
    why: str
    hint: str | None = None
    code: str = "useless-key"


@dataclass(frozen=True, slots=True)
class OneOf:
    """Keys of a model of which at least one has to be there."""

    keys: tuple[str, ...]
    why: str
    hint: str | None = None
    code: str = "missing-key"
