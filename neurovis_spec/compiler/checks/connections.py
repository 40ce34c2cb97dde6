"""Connections that are surely not meant: made twice, beyond the run, or told what makes no difference to them.

In: what a spec without errors became. Out: warnings at the entries as they are written.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from neurovis_spec.compiler.checks.compiled import Compiled, WrittenEntry
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.names.references import Section
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.yaml.source import Mapping, one_or_more


def check_connections(compiled: Compiled, findings: Findings) -> None:
    """Warn of entries, and of what is said in them."""
    for section, _ in compiled.sections:
        for mapping in _mappings(section):
            _check_doubled(mapping, compiled, findings)
    _check_beyond(compiled, findings)
    for entry in compiled.entries.values():
        _check_vain(entry, findings)


def _mappings(section: Section) -> Iterator[Mapping]:
    """The mappings of a section's connections that have several entries. Parallel connections are written as a list of
    mappings; so entries of two mappings, and equal edges of one entry, are let be."""
    for part in one_or_more(section.source.get("connections")):
        if isinstance(part, Mapping) and len(part.entries) > 1:
            yield part


def _check_doubled(mapping: Mapping, compiled: Compiled, findings: Findings) -> None:
    """Every entry that makes a connection which another one of its mapping makes already: ``A -> K`` beside
    ``A -> K2``."""
    names = compiled.network.neurons.names
    entries = [compiled.entries[entry.key.span] for entry in mapping.entries if entry.key.span in compiled.entries]
    told: set[int] = set()
    for first, again, source, target in _twice([entry.bundles for entry in entries], len(names)):
        if again not in told:
            told.add(again)
            one, other = entries[again].key, entries[first].key
            message = (
                f"'{names[source]} -> {names[target]}' is there twice: in '{shorten(one.value)}' and in "
                f"'{shorten(other.value)}' ({other.span.seen_from(one.span)})"
            )
            hint = "leave one out; connections that are parallel on purpose are written as a list of mappings"
            findings.warning("made-twice", one.span, message, hint)


def _twice(entries: list[list[Bundle]], neurons: int) -> Iterator[tuple[int, int, int, int]]:
    """Connections that two entries make: the numbers of the first and a later entry, the source and the target."""
    bundles = [bundle for entry in entries for bundle in entry]
    if len(bundles) < 2:
        return
    pairs = np.concatenate([bundle.sources.astype(np.int64) * neurons + bundle.targets for bundle in bundles])
    ordered = np.sort(pairs)
    if not (ordered[1:] == ordered[:-1]).any():
        return
    numbers = [number for number, entry in enumerate(entries) for _ in entry]
    owner = np.repeat(np.array(numbers), [len(bundle.sources) for bundle in bundles])
    order = np.argsort(pairs, kind="stable")
    same = (pairs[order][1:] == pairs[order][:-1]) & (owner[order][1:] != owner[order][:-1])
    for place in np.sort(order[1:][same]).tolist():
        first = int(order[np.searchsorted(ordered, pairs[place])])
        yield int(owner[first]), int(owner[place]), *divmod(int(pairs[place]), neurons)


def _check_beyond(compiled: Compiled, findings: Findings) -> None:
    """Delays and episodes that are too long for a run of the spec's own length."""
    time, steps = compiled.spec.time, compiled.network.steps
    if time is None or time.steps is None:
        return
    hint = "shorten it, or lengthen the run: time: {{steps: {}}}"
    episode = compiled.network.episode
    if time.episode is not None and episode is not None and episode > steps:
        message = f"an episode of {plural(episode, 'step')} does not end in a run of {steps} ('steps')"
        findings.warning("beyond-steps", time.episode.span, message, hint.format(episode))
    for key, body, bundles in compiled.entries.values():
        longest = max((int(bundle.delays.max(initial=0)) for bundle in bundles), default=0)
        if longest >= steps:
            span = key.span if body.delay is None or body.edges is not None else body.delay.span
            message = f"after a delay of {plural(longest, 'step')} nothing arrives in a run of {steps} ('steps')"
            findings.warning("beyond-steps", span, message, hint.format(longest + 1))


def _check_vain(entry: WrittenEntry, findings: Findings) -> None:
    """What an entry says and what makes no difference to it, or all weights 0."""
    _, body, bundles = entry
    if body.self is not None and body.self.value and bundles and all(bundle.apart for bundle in bundles):
        message = "'self: true' changes nothing: no neuron is in both ends of this connection"
        findings.warning("no-effect", body.self.span, message, "remove it")
    scale = body.scale
    if scale is not None and scale.indegree is not None and not scale.indegree.value:
        findings.warning("no-effect", scale.indegree.span, "'indegree: false' scales nothing", "remove it")
    for formula in () if scale is None else (scale.norm, scale.spectral_radius):
        if formula is not None and formula.value == 0:
            message = "scaled to 0, all weights of this entry are 0"
            findings.warning("no-effect", formula.span, message, "give it another number, or 'weight: 0'")
