"""Connections that are surely not meant: made twice, with a delay beyond the run, or with keys that have no effect.

In: what a spec without errors became. Out: warnings at the entries as they are written.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from neurovis_spec.compiler.checks.compiled import Compiled, WrittenEntry
from neurovis_spec.compiler.connections.delays import warn_rounded
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.names.references import Section
from neurovis_spec.compiler.network import Route
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.yaml.source import Mapping, one_or_more


def check_doubled(compiled: Compiled, findings: Findings) -> None:
    """Warn of every entry that makes a connection which another one of its mapping makes already: ``A -> K`` beside
    ``A -> K2``."""
    for section, _ in compiled.sections:
        for mapping in _mappings(section):
            _check_doubled(mapping, compiled, findings)


def _mappings(section: Section) -> Iterator[Mapping]:
    """The mappings of a section's connections that have several entries. A list of mappings means parallel connections
    on purpose, so only entries of one mapping are compared with each other, and no edges of one entry."""
    for part in one_or_more(section.source.get("connections")):
        if isinstance(part, Mapping) and len(part.entries) > 1:
            yield part


def _check_doubled(mapping: Mapping, compiled: Compiled, findings: Findings) -> None:
    """The same, in one mapping."""
    names = compiled.network.neurons.names
    entries = [compiled.entries[entry.key.span] for entry in mapping.entries if entry.key.span in compiled.entries]
    reported: set[int] = set()
    for doubled in _doubled_pairs([entry.bundles for entry in entries], len(names)):
        if doubled.later not in reported:
            reported.add(doubled.later)
            later, first = entries[doubled.later].key, entries[doubled.first].key
            message = (
                f"'{names[doubled.source]} -> {names[doubled.target]}' is there twice: in '{shorten(later.value)}' and "
                f"in '{shorten(first.value)}' ({first.span.seen_from(later.span)})"
            )
            hint = "leave one out; connections that are parallel on purpose are written as a list of mappings"
            findings.warning("made-twice", later.span, message, hint)


class _DoubledPair(NamedTuple):
    """A connection that two entries make, known by their indices."""

    first: int
    later: int
    source: int
    target: int


def _doubled_pairs(entries: list[list[Bundle]], neurons: int) -> Iterator[_DoubledPair]:
    """The connections that several entries make, each with the first of these and a later one."""
    bundles = [bundle for entry in entries for bundle in entry]
    if len(bundles) < 2:
        return
    routes = {way: number for number, way in enumerate(dict.fromkeys(map(_way, bundles)))}
    # a pair (source, target) as one number; those of different routes or synapses are no pairs
    pairs = np.concatenate([
        (bundle.sources.astype(np.int64) * neurons + bundle.targets) * len(routes) + routes[_way(bundle)]
        for bundle in bundles
    ])  # fmt: skip
    ordered = np.sort(pairs)
    if not (ordered[1:] == ordered[:-1]).any():
        return
    entry_of_bundle = [index for index, entry in enumerate(entries) for _ in entry]
    entry_of = np.repeat(np.array(entry_of_bundle), [len(bundle.sources) for bundle in bundles])
    order = np.argsort(pairs, kind="stable")  # so that the first of equal pairs is of the earliest entry
    same = (pairs[order][1:] == pairs[order][:-1]) & (entry_of[order][1:] != entry_of[order][:-1])
    for position in np.sort(order[1:][same]).tolist():
        first = int(order[np.searchsorted(ordered, pairs[position])])
        source, target = divmod(int(pairs[position]) // len(routes), neurons)
        yield _DoubledPair(int(entry_of[first]), int(entry_of[position]), source, target)


def _way(bundle: Bundle) -> tuple[Route, str]:
    """What the connections of an entry take, where they bring it, and by which synapse."""
    return bundle.route, "" if bundle.synapse is None else bundle.synapse.definition.name


def check_beyond_run(compiled: Compiled, findings: Findings) -> None:
    """Warn of delays and episodes that are too long for a run of the spec's own length."""
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
            # where there are edges, these may have delays of their own: the finding stands at the key
            span = key.span if body.delay is None or body.edges is not None else body.delay.span
            late = compiled.network.connections.lags is not None and any(bundle.timing for bundle in bundles)
            what = "nothing but what there is at first" if late else "nothing"
            message = f"after a delay of {plural(longest, 'step')} {what} arrives in a run of {steps} ('steps')"
            findings.warning("beyond-steps", span, message, hint.format(longest + 1))


def check_rounded(compiled: Compiled, findings: Findings) -> None:
    """Warn of delays in seconds that are rounded to steps: those between which nothing is read."""
    connections, start = compiled.network.connections, 0
    for bundle in compiled.bundles:
        held = np.ones(len(bundle.sources), dtype=np.bool_)
        if connections.lags is not None:
            held = np.isnan(connections.lags[start : start + len(held)])
        if bundle.timing is not None:
            warn_rounded(bundle.timing, held, compiled.network.dt, findings)
        start += len(held)


def check_no_effect(compiled: Compiled, findings: Findings) -> None:
    """Warn of keys of an entry that change nothing, and of a scale that makes all weights 0."""
    for entry in compiled.entries.values():
        _check_no_effect(entry, findings)


def _check_no_effect(entry: WrittenEntry, findings: Findings) -> None:
    """The same, of one entry."""
    _, body, bundles = entry
    if body.self is not None and body.self.value and bundles and all(bundle.ends_disjoint for bundle in bundles):
        message = "'self: true' changes nothing: no neuron is in both ends of this connection"
        findings.warning("no-effect", body.self.span, message, "remove it")
    synapse = next((bundle.synapse.definition for bundle in bundles if bundle.synapse and not bundle.rules), None)
    if body.weight is not None and synapse is not None and "weight" not in synapse.read:
        message = f"the synapse '{synapse.name}' does not read 'weight': what arrives does not depend on it"
        findings.warning("no-effect", body.weight.span, message, "let its signal read it, or leave it out")
    scale = body.scale
    if scale is not None and scale.indegree is not None and not scale.indegree.value:
        findings.warning("no-effect", scale.indegree.span, "'indegree: false' scales nothing", "remove it")
    for formula in () if scale is None else (scale.norm, scale.spectral_radius):
        if formula is not None and formula.value == 0:
            message = "scaled to 0, all weights of this entry are 0"
            findings.warning("no-effect", formula.span, message, "give it another number, or 'weight: 0'")
