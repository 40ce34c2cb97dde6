"""Keys that exclude or need each other, as the fields of the models say (``NotWith``, ``Needs``, ``OneOf``).

In: these rules and a mapping as written. Out: findings, and the same as JSON Schema.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TypeAlias

from pydantic.json_schema import JsonSchemaValue

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.grammar import AsTable, Needs, NotWith, OneOf, Written
from neurovis_spec.language.yaml.source import Mapping, Scalar

#: What the fields of a model say, by their keys.
Rules: TypeAlias = tuple[tuple[str, NotWith | Needs], ...]


def _key(other: Written) -> str:
    return other.key if isinstance(other, AsTable) else other


def _is_there(other: Written, data: Mapping) -> bool:
    entry = data.entry(_key(other))
    return entry is not None and not (isinstance(other, AsTable) and isinstance(entry.value, Scalar))


def _excluded(rule: NotWith, data: Mapping) -> str | None:
    """The first key that is there and excludes that of a field."""
    return next((_key(other) for other in rule.others if _is_there(other, data)), None)


def contradictory(rules: Rules, data: Mapping) -> bool:
    """Whether two keys of a mapping exclude each other."""
    return any(
        isinstance(rule, NotWith) and data.entry(own) is not None and _excluded(rule, data) is not None
        for own, rule in rules
    )


def check_rules(rules: Rules, data: Mapping, unknown: Collection[str], findings: Findings) -> None:
    """Report keys that exclude each other, each once, and those that miss another one, unless that is ``unknown``, as
    an unknown key may be meant for it."""
    for own, rule in rules:
        entry = data.entry(own)
        if entry is None:
            continue
        if isinstance(rule, NotWith):
            other = _excluded(rule, data)
            if other is not None:
                hint = None if rule.hint is None else rule.hint.format(own=own, other=other)
                findings.error(rule.code, entry.key.span, rule.why.format(own=own, other=other), hint)
        elif not any(_key(other) in unknown or _is_there(other, data) for other in rule.others):
            findings.error(rule.code, entry.key.span, rule.why, rule.hint)


def _has(other: Written) -> JsonSchemaValue:
    if isinstance(other, AsTable):
        return {"required": [other.key], "properties": {other.key: {"type": ["array", "object"]}}}
    return {"required": [other]}


def schema_of(rules: Rules, one_of: OneOf | None) -> JsonSchemaValue:
    """The rules as keywords of a JSON Schema."""
    found: list[JsonSchemaValue] = []
    for own, rule in rules:
        if isinstance(rule, NotWith):
            found += ({"not": {"allOf": [_has(own), _has(other)]}} for other in rule.others)
        else:
            found.append({"if": _has(own), "then": {"anyOf": [_has(other) for other in rule.others]}})
    if one_of is not None:
        found.append({"anyOf": [_has(key) for key in one_of.keys]})
    return {"allOf": found} if found else {}
