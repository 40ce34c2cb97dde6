"""The grammar of values: what a text is for, which names a formula sees, what may be written at a place.

In: nothing. Out: Roles and Shapes, with which the models of the language annotate their fields. A field says once what
it takes (its shape), what its texts are for (its role), which keys exclude it or are needed beside it (``NotWith``,
``Needs``) and what it means (its description). The reader, the JSON Schema, the language server, the manual and the
compiler ask the field.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias

from pydantic.json_schema import JsonSchemaValue

#: What a name names. Groups, neurons, inputs and instances share their names; "local" is known in one definition.
Kind: TypeAlias = Literal[
    "parameter",
    "neuron",
    "input",
    "instance",
    "output",
    "module",
    "activation",
    "model",
    "rule",
    "synapse",
    "local",
]
#: What a text is for. A ``choice`` names a definition, a ``setting`` one of its parameters or signals, a ``settable`` a
#: parameter, or connections.
Use: TypeAlias = Literal[
    "declares",
    "names",
    "formula",
    "template",
    "ends",
    "references",
    "settable",
    "choice",
    "setting",
    "setting value",
    "state",
    "port",
    "sent",
    "pattern",
    "engine",
    "message",
    "field",
    "sensor",
    "actuator",
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
    #: whether it knows ``pre.X`` and ``post.X``, what X is at the ends of a connection
    ends: bool = False


#: Formulas, by what they see.
PLAIN: Final = Role("formula")
RUN: Final = Role("formula", sees=("k", "t"))
#: A formula of a run for each number of an input; without a size it sees no i and n.
RUN_EACH: Final = Role("formula", sees=("k", "t", "i", "n"))
GROUP: Final = Role("formula", sees=("i", "n"))
GROUP_DRAWN: Final = Role("formula", sees=("i", "n"), draws=True)
NOISE: Final = Role("formula", sees=("k", "t", "i", "n"), draws=True)
PAIR: Final = Role("formula", sees=("i", "j", "n_from", "n_to", "distance"), draws=True, ends=True)
#: Which pairs are connected: what is drawn there is drawn by these formulas, not in them.
WHICH: Final = Role("formula", sees=PAIR.sees, ends=True)
#: How many connections a source, a target or an entry has.
OF_SOURCE: Final = Role("formula", sees=("i", "n_from", "n_to"), draws=True, ends=True)
OF_TARGET: Final = Role("formula", sees=("j", "n_from", "n_to"), draws=True, ends=True)
OF_ENTRY: Final = Role("formula", sees=("n_from", "n_to"), draws=True)
CELL: Final = Role("formula", sees=("i", "j", "n_from", "n_to"), draws=True)
#: What the settings of a rule or a synapse see.
_OF_PAIRS: Final = ("i", "j", "n_from", "n_to")
#: The value of a rule's setting: a formula, or the references of a signal.
RULE_SETTING: Final = Role("setting value", "rule", sees=_OF_PAIRS)
SYNAPSE_SETTING: Final = Role("setting value", "synapse", sees=_OF_PAIRS)
#: What an actuator is told: a formula that names outputs, too.
COMMAND: Final = Role("formula", "output")
IN_ACTIVATION: Final = Role("formula", sees=("x",))
IN_MODEL: Final = Role("formula", sees=("drive", "k", "t"), functions=("f",))
#: What of a model is no matter of its activation: how much noise there is, what an episode's end does.
WITHOUT_F: Final = Role("formula", sees=("drive", "k", "t"))
#: The activities that a rule and a synapse see.
ACTIVITIES: Final = ("pre", "sent", "post")
IN_RULE: Final = Role("formula", sees=(*ACTIVITIES, "weight", "k", "t"), ends=True)
#: And one that changes the centre.
IN_CENTRE: Final = Role("formula", sees=(*ACTIVITIES, "centre", "k", "t"), ends=True)
#: A synapse sees what a rule does.
IN_SYNAPSE: Final = IN_RULE
#: How a line ends is said once, not step by step.
IN_SIGN: Final = Role("formula", sees=("weight",), ends=True)
#: A text with formulas in braces.
LABEL: Final = Role("template", sees=("i", "n", "number"))
#: A port of the neurons that something goes to; what connections take of their sources.
PORT: Final = Role("port")
SENT: Final = Role("sent")
#: References to neurons; the ends of a connection, FROM -> TO, or neurons.
REFERENCES: Final = Role("references")
ENDS: Final = Role("ends")
#: What an event sets: a parameter, or the weights of connections.
SETTABLE: Final = Role("settable")


def declaring(kind: Kind) -> Role:
    """Of names that are given here to something."""
    return Role("declares", kind)


def naming(kind: Kind) -> Role:
    """Of names of something that is declared elsewhere."""
    return Role("names", kind)


@dataclass(frozen=True, slots=True, eq=False)
class Plain:
    """A scalar. ``role``: what it is for, whatever its field says; ``formula``: it is a number or an expression;
    ``abouts``: what the words mean of which it is one, where that is not plain."""

    written: Mapping[str, object]
    role: Role | None = None
    formula: bool = False
    abouts: Mapping[str, str] = field(default_factory=dict)

    @property
    def words(self) -> tuple[str, ...]:
        """The words of which it is one."""
        if self.written.get("type") == "boolean":
            return ("true", "false")
        words = self.written.get("enum", [self.written["const"]] if "const" in self.written else [])
        return tuple(map(str, words)) if isinstance(words, list) else ()

    def role_in(self, field: Role | None) -> Role | None:
        """Its role in a field: formulas have those of formulas, other texts the others."""
        if self.role is not None or not self.formula:
            return self.role or (None if field is None or field.use == "formula" else field)
        return PLAIN if field is None or field.use != "formula" else field


@dataclass(frozen=True, slots=True, eq=False)
class Either:
    """One of several."""

    choices: tuple[Shape, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ListOf:
    """A list of things of one shape."""

    item: Shape
    least: int = 0
    most: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """A list whose items differ; those from ``least`` on may be left out."""

    items: tuple[Shape, ...]
    least: int


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """A key of a mapping: what it takes, and what it means."""

    shape: Shape
    about: str
    required: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Map:
    """A mapping: of ``known`` keys, and of others, which have a role, to an ``other`` shape. ``one``: it has one key;
    ``nothing``: it may be left empty."""

    known: Mapping[str, Key]
    other: Shape | None = None
    role: Role | None = None
    one: bool = False
    least: int = 0
    nothing: bool = False


#: What may be written at a place.
Shape: TypeAlias = Plain | Either | ListOf | Row | Map


def schema_of(shape: Shape) -> JsonSchemaValue:
    """A shape as a JSON Schema."""
    match shape:
        case Plain():
            return dict(shape.written)
        case Either():
            schemas = map(schema_of, shape.choices)  # a choice of choices is one choice
            return {"anyOf": [one for each in schemas for one in (each["anyOf"] if [*each] == ["anyOf"] else [each])]}
        case ListOf():
            found = {"type": "array", "items": schema_of(shape.item)}
            least = {"minItems": shape.least} if shape.least else {}
            return {**found, **least, **({"maxItems": shape.most} if shape.most else {})}
        case Row():
            items = [*map(schema_of, shape.items)]
            return {"type": "array", "prefixItems": items, "minItems": shape.least, "maxItems": len(items)}
        case Map():
            result: JsonSchemaValue = {"type": ["object", "null"] if shape.nothing else "object"}
            if shape.known:
                result["properties"] = {name: schema_of(key.shape) for name, key in shape.known.items()}
                result["required"] = [name for name, key in shape.known.items() if key.required]
            result["additionalProperties"] = False if shape.other is None else schema_of(shape.other)
            result["minProperties"] = max(shape.least, int(shape.one))
            return {**result, "maxProperties": 1} if shape.one else result


def below(shape: Shape, part: str | int) -> Shape | None:
    """What may be written under a key of a mapping, or at an index of a list; None where nothing may."""
    match shape:
        case ListOf() if isinstance(part, int):
            return shape.item
        case Row() if isinstance(part, int):
            return shape.items[part] if part < len(shape.items) else None
        case Map() if isinstance(part, str):
            return shape.known[part].shape if part in shape.known else shape.other
    return None


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
    why: str = "'{own}' beside '{other}': only one of the two may be there"
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
