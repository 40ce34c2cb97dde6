"""The base of all models of the language: a mapping with known keys.

In: a Mapping of the document. Out: the model, its ``source`` the Mapping, in which misspelt keys bear the right names
(``keys``). Missing keys are answered with what is missing. A key whose value is invalid is reported and left out, and
so is an entry of a mapping of the author's names: all others are still read, so that later stages have something to
look at. What was left out is what stands in ``source`` and not in the model (``lost``).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from collections.abc import Mapping as AnyMapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Annotated, ClassVar, Final, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    ValidationInfo,
    WrapValidator,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue, SkipJsonSchema
from pydantic_core import core_schema

from neurovis_spec.diagnostics import Findings, Span, listed, shorten
from neurovis_spec.language.exclusions import Rules, check_rules, contradictory, schema_of
from neurovis_spec.language.expressions.functions import RESERVED
from neurovis_spec.language.grammar import Needs, NotWith, OneOf
from neurovis_spec.language.keys import Keys, Words, apart, joined, mend_torn, read_keys
from neurovis_spec.language.located import (
    IDENTIFIER,
    Leaf,
    Located,
    bad_name,
    findings_of,
    give_up,
    name_hint,
    refuse,
    unknown_at,
)
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown
from neurovis_spec.language.yaml.source import Entry, Mapping, Node, Scalar, Sequence
from neurovis_spec.likeness import in_ascii

V = TypeVar("V")

_NONE: frozenset[str] = frozenset()
#: fields that are no keys
OWN: Final = ("source", "meant")


def _as_it_is(value: V, info: ValidationInfo) -> V:
    return value


class Model(BaseModel):
    """A mapping of the language."""

    model_config = ConfigDict(frozen=True, extra="ignore", arbitrary_types_allowed=True, populate_by_name=False)

    #: what a mapping of this kind is called in a finding, for keys that are written elsewhere
    PLACE: ClassVar[str] = ""
    #: keys of which there has to be one
    ONE_OF: ClassVar[OneOf | None] = None
    #: what other languages call keys, in small letters
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {}
    #: the key for which a text or a number stands that is written in the place of the mapping
    BARE: ClassVar[str] = ""
    #: what is said of a key without a value
    UNSAID: ClassVar[str] = "leave the key out, or give it a value"

    source: SkipJsonSchema[Annotated[Mapping, Leaf(_as_it_is, {})]] = Field(alias="$", exclude=True, repr=False)
    #: the keys that an unknown one may be meant for, and those that are missing or invalid and needed
    meant: SkipJsonSchema[Annotated[frozenset[str], Leaf(_as_it_is, {})]] = Field(
        _NONE, alias="$meant", exclude=True, repr=False
    )

    @model_validator(mode="wrap")
    @classmethod
    def _read(cls, data: object, handler: Callable[[object], Model], info: ValidationInfo) -> Model:
        if isinstance(data, Located):  # all of it is unknown
            every = dict.fromkeys(cls._fields(), data)
            return handler({"$": Mapping((), data.span), "$meant": frozenset(every), **every})
        if not isinstance(data, Mapping):
            assert not isinstance(data, (str, int, float, dict))
            refuse(info, data, "a mapping", cls._no_mapping(data))  # type: ignore[arg-type]
        keys = read_keys(data, cls._fields(), findings_of(info), Words(cls._foreign, _home, cls.ELSEWHERE))
        data = keys.mapping
        cls._check_rules(data, keys.unknown, findings_of(info))
        values = cls._keys(keys, findings_of(info))
        for _ in range(2):
            meant = [key for key, node in values.items() if type(node) is Located]
            if meant or keys.unknown:
                values["$meant"] = keys.unknown.union(meant)
            try:
                return handler(values)
            except ValidationError as error:
                faulty = _first_parts(error)
                for key in map(str, faulty):
                    values.pop(key, None)
                    if cls._fields()[key].is_required():
                        values[key] = cls._unknown(key, data.span)
        give_up()

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """The schema of the keys, and of which of them go together."""
        result = handler.resolve_ref_schema(handler(schema))
        result.update({"additionalProperties": False, **schema_of(cls._rules(), cls.ONE_OF)})
        return result

    @classmethod
    @cache
    def _rules(cls) -> Rules:
        """Which keys exclude each other, and which need others."""
        said = {
            name: tuple(item for item in field.metadata if isinstance(item, (NotWith, Needs)))
            for name, field in cls._fields().items()
        }
        return {name: rules for name, rules in said.items() if rules}

    @classmethod
    def _check_rules(cls, data: Mapping, unknown: Collection[str], findings: Findings) -> None:
        rules, one_of = cls._rules(), cls.ONE_OF
        if not rules and one_of is None:
            return
        check_rules(rules, data, unknown, findings)
        if one_of is None or data.is_open:
            return
        keys = {entry.name for entry in data.entries}
        if keys.isdisjoint(one_of.keys) and keys <= cls._fields().keys():
            findings.error(one_of.code, opening(data), one_of.why, one_of.hint)

    @cached_property
    def contradictory(self) -> bool:
        """Whether keys exclude each other, which is reported: which of them is meant is not known."""
        return contradictory(self._rules(), self.source)

    @classmethod
    @cache
    def _fields(cls) -> dict[str, FieldInfo]:
        return {field.alias or name: field for name, field in cls.model_fields.items() if name not in OWN}

    @classmethod
    @cache
    def _required(cls) -> tuple[str, ...]:
        return tuple(name for name, field in cls._fields().items() if field.is_required())

    @classmethod
    @cache
    def _written(cls) -> dict[str, str]:
        """The field of each key of a spec."""
        return {field.alias or name: name for name, field in cls.model_fields.items()}

    @classmethod
    def _no_mapping(cls, node: Node) -> str:
        """What to do about something that is no mapping."""
        value = node.value if isinstance(node, Scalar) else ""
        if value is None:
            return "write {} where there is nothing to say"
        parts = apart(value) if isinstance(value, str) else None
        if parts is not None and parts.key in cls._fields():
            return parts.told
        return cls._instead(node) or f"its keys are {listed(cls._fields())}"

    @classmethod
    def _instead(cls, node: Node) -> str | None:
        """What to write for something that is no mapping, where it is clear what it is meant to be."""
        value = node.value if isinstance(node, Scalar) and not isinstance(node.value, bool) else None
        if not cls.BARE or value is None or (isinstance(value, str) and not value.strip()):
            return None
        return f"write {{{cls.BARE}: {shorten(str(value).strip())}}}"

    @classmethod
    def _keys(cls, keys: Keys, findings: Findings) -> dict[str, object]:
        """The values by key, under ``$`` the Mapping itself; what is missing is reported."""
        fields, data = cls._fields(), keys.mapping
        result: dict[str, object] = {"$": data}
        for entry in data.entries:
            field = fields.get(entry.name)
            if field is None:
                continue
            if isinstance(entry.value, Scalar) and entry.value.value is None and not field.is_required():
                if not findings.is_invalid(entry.value.span):  # such as an alias, which is refused and read as nothing
                    null = entry.value.span.column < entry.value.span.end_column
                    message = f"'{entry.name}' has no value{': YAML reads this as null' if null else ''}"
                    findings.error("no-value", entry.key.span, message, cls.UNSAID)
            else:
                result[entry.name] = entry.value
        missing = [name for name in cls._required() if name not in result]
        told = bool(missing) and findings.is_invalid(opening(data))
        for name in missing:
            if keys.lack(name) and not told:
                message = f"the key '{name}' is missing"
                findings.error("missing-key", opening(data), message, cls._without(name, data), key=name)
            result[name] = cls._unknown(name, opening(data))
        return result

    @classmethod
    def _unknown(cls, name: str, span: Span) -> Located[Unknown]:
        """A required value that is missing or invalid. Where it may not be UNKNOWN, nothing is known of the whole."""
        field = cls._fields()[name]
        inner = field.annotation
        if any(isinstance(item, Leaf) and item.may_be_unknown for item in field.metadata):
            return unknown_at(span)
        if isinstance(inner, type) and issubclass(inner, Model):
            return unknown_at(span)
        give_up()

    @classmethod
    def _without(cls, name: str, data: Mapping) -> str:
        """A help line for a required key that is missing: by default what its row in the grammar says of it."""
        described = (cls._fields()[name].description or "").rstrip(".")
        return f"add {name}: {described[:1].lower()}{described[1:]}"

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        """What is said of an unknown key that is no misspelling of a known one: a message and a hint."""
        return None

    @property
    def _left_out(self) -> frozenset[str]:
        """The keys of the source that are not in the model: unknown ones, and those whose value is invalid."""
        if not self.source.entries:
            return _NONE
        read, written = self.model_fields_set, self._written()
        left = [entry.name for entry in self.source.entries if written.get(entry.name) not in read]
        return frozenset(left) if left else _NONE

    @property
    def sound(self) -> bool:
        """Whether all that stands there is in the model, and nothing is missing."""
        return not (self._left_out or self.meant)

    @property
    def unknown(self) -> frozenset[str]:
        """The keys of which it is not known what they say: invalid ones, and those that an unknown key may be meant
        for."""
        left = self._left_out
        return self.meant | left.intersection(self._fields()) if left else self.meant


def _home(name: str) -> str | None:
    """A help line for a key that is known elsewhere."""
    homes = dict.fromkeys(model.PLACE for model in _models() if model.PLACE and name in model._fields())
    return f"'{name}' is a key of {' and of '.join(homes)}" if homes else None


def _models() -> Iterator[type[Model]]:
    """All models of the language."""
    waiting: list[type[Model]] = [Model]
    while waiting:
        model = waiting.pop(0)
        yield model
        waiting += model.__subclasses__()


def _first_parts(error: ValidationError) -> set[str | int]:
    """The keys, names or indices under which a validation failed."""
    return {item["loc"][0] for item in error.errors(include_url=False, include_context=False, include_input=False)}


def opening(mapping: Mapping) -> Span:
    """The first key of a mapping, else its first character: where a finding about the whole is shown."""
    if mapping.entries:
        return mapping.entries[0].key.span
    span = mapping.span
    return Span(span.file, span.line, span.column, span.line, span.column + 1)


def names_of(model: Model, key: str, made: AnyMapping[str, V | Unknown]) -> Names[V]:
    """What the names mean that are declared under a key: what was ``made`` of each, UNKNOWN where it could not be read.
    The table is open where the whole of it could not be."""
    node = model.source.get(key)
    return Names({**unread(model, key), **made}, key in model.unknown or (isinstance(node, Mapping) and node.is_open))


def unread(model: Model, key: str) -> dict[str, Unknown]:
    """The names under a key whose declarations could not be read; of ``A:{bias`` the name is A."""
    node, kept = model.source.get(key), getattr(model, key)
    entries = node.entries if isinstance(node, Mapping) else ()
    return {entry.name.partition(":")[0]: UNKNOWN for entry in entries if entry.name not in kept}


def entry_hint(node: Node) -> str | None:
    """What to do about a text in the place of a mapping, if it is an entry of one."""
    parts = apart(node.value) if isinstance(node, Scalar) and isinstance(node.value, str) else None
    return None if parts is None else parts.told


def _named(node: Node, handler: Callable[[object], dict[str, V]], info: ValidationInfo) -> dict[str, V]:
    if not isinstance(node, Mapping):
        refuse(info, node, "a mapping", entry_hint(node) or "write NAME: … for each")
    node = mend_torn(node, "bad-name", findings_of(info))
    entries = tuple(
        entry if IDENTIFIER.fullmatch(entry.name) else _renamed(entry, node, findings_of(info))
        for entry in node.entries
    )
    return _keyed(Mapping(entries, node.span, node.is_open), handler, info)


def _renamed(entry: Entry, node: Mapping, findings: Findings) -> Entry:
    """An entry whose key is no name, which is reported: with the name that the key looks like, where there is one."""
    parts = joined(entry)
    hint = name_hint(entry.name) if parts is None else parts.told
    findings.error("bad-name", entry.key.span, bad_name(entry.name), hint)
    if parts is not None:
        findings.unread(entry.value.span)  # the value is in what is read as the key
    seen = in_ascii(entry.name)
    meant = IDENTIFIER.fullmatch(seen) and node.entry(seen) is None
    return Entry(entry.key._replace(value=seen, inner=None, written=None), entry.value) if meant else entry


def _keyed(node: Node, handler: Callable[[object], dict[str, V]], info: ValidationInfo) -> dict[str, V]:
    if not isinstance(node, Mapping):
        refuse(info, node, "a mapping", entry_hint(node))
    values = {entry.name: entry.value for entry in node.entries}
    try:
        return handler(values)
    except ValidationError as error:
        for name in _first_parts(error):
            values.pop(str(name), None)
        return handler(values)


#: A mapping whose keys are references or free texts: ``Keyed[PointField]``.
Keyed = Annotated[dict[str, V], WrapValidator(_keyed)]


@dataclass(frozen=True, slots=True)
class KeysAreNames:
    """Says in the schema that keys are names, and none of those that the language has ``reserved``."""

    reserved: tuple[str, ...] = ()

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        others: JsonSchemaValue = {"not": {"enum": [*self.reserved]}} if self.reserved else {}
        return {**handler(schema), "propertyNames": {"pattern": f"^{IDENTIFIER.pattern}$", **others}}


@dataclass(frozen=True, slots=True)
class Filled:
    """Says of a field that may be left out that it is not empty where it stands: it would do nothing. ``wanted`` is
    what it holds, for the finding."""

    wanted: str

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """The value is checked before anything is made of it."""
        return core_schema.with_info_before_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """The schema of the value, of one entry at least."""
        return {**handler(schema), "minProperties": 1, "minItems": 1}

    def _check(self, node: Node, info: ValidationInfo) -> Node:
        if (isinstance(node, Sequence) and not node.items) or (isinstance(node, Mapping) and not node.entries):
            message = f"expected {self.wanted}, found nothing"
            findings_of(info).error("no-value", node.span, message, "leave the key out, or give it a value")
            give_up()
        return node


@dataclass(frozen=True, slots=True)
class Short:
    """Says of a model that a bare value is short for a mapping with this ``key`` alone; ``wanted`` is what may stand
    there, for a finding."""

    key: str
    wanted: str = "a value or a mapping"

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """What is short is written out before anything is made of it."""
        return core_schema.with_info_before_validator_function(self._written_out, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """The value of the key, or the mapping."""
        whole = handler(schema)
        key = handler.resolve_ref_schema(whole)["properties"][self.key]
        bare = {name: item for name, item in key.items() if name not in ("title", "description")}
        return {"anyOf": [*bare.get("anyOf", (bare,)), whole]}

    def _written_out(self, node: Node, info: ValidationInfo) -> Node:
        if isinstance(node, Mapping):
            return node
        if not isinstance(node, Scalar):
            refuse(info, node, self.wanted)
        return Mapping((Entry(Scalar(self.key, node.span), node),), node.span)


#: A mapping whose keys are names of the author's: ``Named[Group]``.
Named = Annotated[dict[str, V], WrapValidator(_named), KeysAreNames()]
#: A mapping whose keys are names of parameters: ``NamedParameters[ParameterField]``.
NamedParameters = Annotated[dict[str, V], WrapValidator(_named), KeysAreNames(RESERVED)]
