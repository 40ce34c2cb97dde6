"""Connections that two entries of one mapping make: ``A -> K`` beside ``A -> K2``.

In: what a spec without errors became. Out: a warning at the later entry. Parallel connections are written as a list of
mappings; so entries of two mappings, and equal edges of one entry, are let be.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.names.references import Section
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.yaml.source import Mapping, Packed, Sequence


def check_doubled(compiled: Compiled, findings: Findings) -> None:
    """Warn of every entry that makes a connection which another one of its mapping makes already."""
    made: dict[Span, list[Bundle]] = {}
    for bundle in compiled.bundles:
        made.setdefault(bundle.key, []).append(bundle)
    names = compiled.network.neurons.names
    for section, _ in compiled.sections():
        for mapping in _mappings(section):
            keys = [entry.key for entry in mapping.entries if entry.key.span in made]
            told: set[int] = set()
            for first, again, source, target in _twice([made[key.span] for key in keys], len(names)):
                if again not in told:
                    told.add(again)
                    one, other = keys[again], keys[first]
                    message = (
                        f"'{names[source]} -> {names[target]}' is there twice: in '{shorten(str(one.value))}' and in "
                        f"'{shorten(str(other.value))}' ({_place(other.span, one.span)})"
                    )
                    hint = "leave one out; connections that are parallel on purpose are written as a list of mappings"
                    findings.warning("made-twice", one.span, message, hint)


def _mappings(section: Section) -> Iterator[Mapping]:
    """The mappings of a section's connections that have several entries."""
    node = section.source.get("connections")
    for part in node.items if isinstance(node, (Sequence, Packed)) else (node,):
        if isinstance(part, Mapping) and len(part.entries) > 1:
            yield part


def _twice(entries: list[list[Bundle]], neurons: int) -> Iterator[tuple[int, int, int, int]]:
    """Connections that two entries make: the numbers of the first and a later entry, the source and the target."""
    bundles = [bundle for entry in entries for bundle in entry]
    if len(entries) < 2:
        return
    pairs = np.concatenate([bundle.sources * neurons + bundle.targets for bundle in bundles])
    ordered = np.sort(pairs)
    if not (ordered[1:] == ordered[:-1]).any():
        return
    owner = np.repeat(
        np.concatenate([np.full(len(entry), number) for number, entry in enumerate(entries)]),
        [len(bundle.sources) for bundle in bundles],
    )
    order = np.argsort(pairs, kind="stable")
    same = (pairs[order][1:] == pairs[order][:-1]) & (owner[order][1:] != owner[order][:-1])
    for place in np.sort(order[1:][same]).tolist():
        first = int(order[np.searchsorted(ordered, pairs[place])])
        yield int(owner[first]), int(owner[place]), *divmod(int(pairs[place]), neurons)


def _place(other: Span, here: Span) -> str:
    return f"column {other.column}" if other.line == here.line else f"line {other.line}"
