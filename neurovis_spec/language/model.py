"""The base of all models of the language: a mapping with known keys.

In: a dict as ``shape.plain`` makes it: its values are nodes, and under ``$`` stands the Mapping itself. Out: the
model, its ``source`` the Mapping. Unknown keys are answered with the nearest known ones, missing ones with what is
missing; both are findings, and the rest of the mapping is still looked at.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo, model_validator
from pydantic.json_schema import SkipJsonSchema

from neurovis_spec.diagnostics import Span, suggest
from neurovis_spec.language.located import IDENTIFIER, NAME_RULE, Leaf, bad_name, findings_of, give_up, refuse
from neurovis_spec.language.source import Mapping, Node, Scalar

V = TypeVar("V")


def _as_it_is(value: Node, info: ValidationInfo) -> Node:
    return value


class Model(BaseModel):
    """A mapping of the language."""

    model_config = ConfigDict(frozen=True, extra="ignore", arbitrary_types_allowed=True, populate_by_name=False)

    #: keys that belong to the language but not yet to this version, with what they are
    LATER: ClassVar[dict[str, str]] = {}

    source: SkipJsonSchema[Annotated[Mapping, Leaf(_as_it_is, {})]] = Field(alias="$", exclude=True, repr=False)

    @model_validator(mode="before")
    @classmethod
    def _keys(cls, data: object, info: ValidationInfo) -> object:
        if not isinstance(data, Mapping):
            assert not isinstance(data, (str, int, float, dict))
            refuse(info, data, "a mapping")  # type: ignore[arg-type]
        findings = findings_of(info)
        known = {field.alias or name: field for name, field in cls.model_fields.items() if name != "source"}
        result: dict[str, object] = {"$": data}
        for entry in data.entries:
            if entry.name in known:
                if (
                    isinstance(entry.value, Scalar)
                    and entry.value.value is None
                    and not known[entry.name].is_required()
                ):
                    if cls._null_is_mapping(entry.name):
                        result[entry.name] = Mapping((), entry.value.span)
                    else:
                        message = f"'{entry.name}' has no value"
                        findings.error("no-value", entry.key.span, message, "leave the key out, or give it a value")
                    continue
                result[entry.name] = entry.value
            elif entry.name in cls.LATER:
                message = f"'{entry.name}' ({cls.LATER[entry.name]}) is not read by this version yet"
                findings.error("unsupported", entry.key.span, message)
            else:
                shown = entry.name if len(entry.name) <= 40 else entry.name[:37] + "…"
                hint = suggest(entry.name, known, "known here")
                findings.error("unknown-key", entry.key.span, f"unknown key '{shown}'", hint)
        missing = [name for name, field in known.items() if field.is_required() and data.entry(name) is None]
        for name in missing:
            findings.error("missing-key", opening(data), f"the key '{name}' is missing")
        if missing:
            give_up()
        return result

    @classmethod
    def _null_is_mapping(cls, key: str) -> bool:
        """Whether an empty value stands for an empty mapping (``neurons:`` with nothing below it does not)."""
        return False


def opening(mapping: Mapping) -> Span:
    """The first key of a mapping, else its first character: where a finding about the whole is shown."""
    if mapping.entries:
        return mapping.entries[0].key.span
    span = mapping.span
    return Span(span.file, span.line, span.column, span.line, span.column + 1)


def _named(node: Node, info: ValidationInfo) -> dict[str, Node]:
    if not isinstance(node, Mapping):
        refuse(info, node, "a mapping")
    for entry in node.entries:
        if not IDENTIFIER.fullmatch(entry.name):
            findings_of(info).error("bad-name", entry.key.span, bad_name(entry.name), NAME_RULE)
    return {entry.name: entry.value for entry in node.entries}


def _keyed(node: Node, info: ValidationInfo) -> dict[str, Node]:
    if not isinstance(node, Mapping):
        refuse(info, node, "a mapping")
    return {entry.name: entry.value for entry in node.entries}


#: A mapping whose keys are references or free texts: ``Keyed[PointField]``.
Keyed = Annotated[dict[str, V], BeforeValidator(_keyed)]
#: A mapping whose keys are names of the author's: ``Named[Group]``.
Named = Annotated[dict[str, V], BeforeValidator(_named)]
