"""Keys that exclude or need each other, as the fields of the models say (``NotWith``, ``Needs``, ``OneOf``).

In: these rules and a mapping as written. Out: findings, and the same as JSON Schema.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TypeAlias

from pydantic.json_schema import JsonSchemaValue

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.grammar import AsTable, Needs, NotWith, OneOf, Written
from neurovis_spec.language.yaml.source import Mapping as SourceMapping
from neurovis_spec.language.yaml.source import Scalar

#: What the fields of a model say, by their keys.
Rules: TypeAlias = Mapping[str, tuple[NotWith | Needs, ...]]


def _key(other: Written) -> str:
    return other.key if isinstance(other, AsTable) else other


def _is_there(other: Written, data: SourceMapping) -> bool:
    entry = data.entry(_key(other))
    return entry is not None and not (isinstance(other, AsTable) and isinstance(entry.value, Scalar))


def _excluded(rule: NotWith | Needs, data: SourceMapping) -> str | None:
    """The first key that is there and excludes that of a field."""
    others = rule.others if isinstance(rule, NotWith) else ()
    return next((_key(other) for other in others if _is_there(other, data)), None)


def contradictory(rules: Rules, data: SourceMapping) -> bool:
    """Whether two keys of a mapping exclude each other."""
    return any(_excluded(rule, data) is not None for own in data.entries for rule in rules.get(own.name, ()))


def check_rules(rules: Rules, data: SourceMapping, unknown: Collection[str], findings: Findings) -> None:
    """Report keys that exclude each other, each once, and those that miss another one, unless that is ``unknown``,
    as an unknown key may be meant for it."""
    for entry in data.entries:
        own = entry.name
        for rule in rules.get(own, ()):
            other = _excluded(rule, data)
            if other is not None:
                hint = None if rule.hint is None else rule.hint.format(own=own, other=other)
                findings.error(rule.code, entry.key.span, rule.why.format(own=own, other=other), hint)
            elif isinstance(rule, Needs) and not any(
                _key(needed) in unknown or _is_there(needed, data) for needed in rule.others
            ):
                findings.error(rule.code, entry.key.span, rule.why, rule.hint)


def _has(other: Written) -> JsonSchemaValue:
    if isinstance(other, AsTable):
        return {"required": [other.key], "properties": {other.key: {"type": ["array", "object"]}}}
    return {"required": [other]}


def schema_of(rules: Rules, one_of: OneOf | None) -> JsonSchemaValue:
    """The rules as keywords of a JSON Schema."""
    found: list[JsonSchemaValue] = []
    for own, rule in ((own, rule) for own, several in rules.items() for rule in several):
        if isinstance(rule, NotWith):
            found += ({"not": {"allOf": [_has(own), _has(other)]}} for other in rule.others)
        else:
            found.append({"if": _has(own), "then": {"anyOf": [_has(other) for other in rule.others]}})
    if one_of is not None:
        found.append({"anyOf": [_has(key) for key in one_of.keys]})
    return {"allOf": found} if found else {}
