"""Faults of several kinds, put into a right spec at chosen places; and where each of them has to be found.

In: the document of a right spec. Out: Faults, each a change of its text with the place of its finding; and texts with
several of them at once.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import dataclass

from neurovis_spec.language.places import keys_at
from neurovis_spec.language.yaml.source import Entry, Mapping, Node, Scalar
from neurovis_spec.language.yaml.source import Sequence as List

#: Numbers that are whole and not negative, by the key they stand under.
_COUNTS = {"count", "steps", "episode", "size", "delay", "at", "from", "to", "probability"}
Place = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Fault:
    """Characters ``start`` to ``end`` (from 0) of a line (from 1) that are replaced. It is found where they begin, or
    at the character ``key``, where that is another."""

    kind: str
    line: int
    start: int
    end: int
    new: str
    key: int

    def overlaps(self, other: Fault) -> bool:
        """Whether the two cannot both be made: they change the same characters, or are found at the same place."""
        if self.line != other.line:
            return False
        one, two = sorted((min(fault.start, fault.key), max(fault.end, fault.key + 1)) for fault in (self, other))
        return two[0] < one[1]


def faults(
    root: Mapping, misspelt: Iterable[tuple[str, int, int, str]], own: Set[str], free: Set[str]
) -> Iterator[Fault]:
    """Every fault of every kind. ``misspelt`` are words with line and column and what they become. Under keys ``own``
    stand mappings of the author's names, under ``free`` texts that may say anything."""
    for text, line, column, wrong in misspelt:
        start = column - 1
        yield Fault("misspelling", line, start, start + len(text), wrong, start)
    for path, entry, node in _leaves(root, ()):
        yield from _of_leaf(path, entry, node, free)
    for key, mapping in _mappings(root, ""):
        first = mapping.entries[0].key.span
        if key not in own and mapping.span.column < first.column:  # in braces
            start = first.column - 1
            yield Fault("foreign key", first.line, start, start, "colour: red, ", start)


def _of_leaf(path: tuple[str, ...], entry: Entry | None, node: Scalar, free: Set[str]) -> Iterator[Fault]:
    span = node.span
    start, end = span.column - 1, span.end_column - 1
    key = path[-1] if path else ""
    if span.line != span.end_line or key in free:
        return
    number = isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
    if number:
        yield Fault("wrong type", span.line, start, end, "true", start)
        # each is a mistake of its own: an expression that stands in several cells is told of once
        yield Fault("unknown name", span.line, start, end, f"nothing{span.line}x{start}*2", start)
    elif isinstance(node.value, str) and not keys_at(path):  # as a theme, which may be a mapping
        yield Fault("wrong type", span.line, start, end, "{}", start)
    if number and key in _COUNTS:
        yield Fault("out of range", span.line, start, end, "-1", start)
    if entry is not None and entry.value is node and entry.key.span.line == span.line:
        yield Fault("no value", span.line, start, end, "null", entry.key.span.column - 1)


def _leaves(
    node: Node, path: tuple[str, ...], entry: Entry | None = None
) -> Iterator[tuple[tuple[str, ...], Entry | None, Scalar]]:
    match node:
        case Mapping(entries=entries):
            for inner in entries:
                yield from _leaves(inner.value, (*path, inner.name), inner)
        case List(items=items):
            for item in items:
                yield from _leaves(item, path)
        case Scalar():
            yield path, entry, node


def _mappings(node: Node, key: str) -> Iterator[tuple[str, Mapping]]:
    """The mappings that hold something, each with the key that it stands under."""
    match node:
        case Mapping(entries=entries):
            if entries:
                yield key, node
            for entry in entries:
                yield from _mappings(entry.value, entry.name)
        case List(items=items):
            for item in items:
                yield from _mappings(item, key)


def pick(possible: Sequence[Fault], count: int, chooser: random.Random) -> list[Fault]:
    """So many faults that do not get into each other's way; every kind is as likely as any other."""
    kinds: dict[str, list[Fault]] = {}
    for fault in possible:
        kinds.setdefault(fault.kind, []).append(fault)
    names = sorted(kinds)
    picked: list[Fault] = []
    while len(picked) < count:
        fault = chooser.choice(kinds[chooser.choice(names)])
        if not any(fault.overlaps(other) for other in picked):
            picked.append(fault)
    return picked


def with_faults(text: str, picked: Sequence[Fault]) -> tuple[str, list[set[Place]]]:
    """The text with these faults, and the places (line and column from 1) at one of which each is to be found."""
    lines = text.split("\n")
    places = []
    for fault in picked:
        before = [other for other in picked if other.line == fault.line]

        def at(column: int, before: Sequence[Fault] = before) -> int:
            return column + 1 + sum(len(one.new) - (one.end - one.start) for one in before if one.end <= column)

        moved = at(fault.start) - (len(fault.new) if fault.start == fault.end else 0)
        places.append({(fault.line, moved), (fault.line, moved if fault.key == fault.start else at(fault.key))})
    for fault in sorted(picked, key=lambda one: one.start, reverse=True):
        line = lines[fault.line - 1]
        lines[fault.line - 1] = line[: fault.start] + fault.new + line[fault.end :]
    return "\n".join(lines), places
