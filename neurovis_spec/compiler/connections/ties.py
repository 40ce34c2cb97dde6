"""Ties: entries whose weights are those of another one.

In: the entries of a scope that have weights of their own, by what they are called. Out: which connection of such an
entry each connection of a tied one has its weight of. Connections are matched by the positions of their neurons within
the ends, so that the neurons of both entries may be others.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray, narrow
from neurovis_spec.compiler.events.settable import Part
from neurovis_spec.compiler.names.references import arrow_of
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import Tie
from neurovis_spec.likeness import suggest


class Original(NamedTuple):
    """An entry that has weights of its own, as far as others may be tied to it. ``name`` is what it is called in the
    network; ``learns`` says whether a rule changes its weights, ``symmetric`` whether each of them is there twice."""

    name: str
    ends: tuple[Indices, Indices]
    sources: Indices
    targets: Indices
    weights: FloatArray
    parts: tuple[Part, ...]
    learns: bool
    symmetric: bool

    def places(self) -> tuple[IntArray, IntArray]:
        """For each connection the positions of its neurons within the ends."""
        return _within(self.ends[0], self.sources), _within(self.ends[1], self.targets)


class Tied(NamedTuple):
    """The connections of a tied entry, row by row: positions within its ends, and of which connection of the original
    each has its weight."""

    original: Original
    i: Indices
    j: Indices
    places: IntArray
    transposed: bool

    @property
    def shown(self) -> str:
        """Whose weights they are, for display."""
        return f"weights of {self.original.name}{', transposed' if self.transposed else ''}"


#: The entries of a scope, by what they are called there: UNKNOWN where one is invalid, None where it is tied itself.
Entries = Mapping[str, Original | Unknown | None]


def tied_to(
    tie: Tie, ends: tuple[Indices | Unknown, Indices | Unknown], entries: Entries, findings: Findings
) -> Tied | Unknown:
    """The connections that a tie makes between these ends; UNKNOWN where it is invalid, which is reported."""
    original = _named(tie, entries, findings)
    sources, targets = ends
    if original is UNKNOWN or sources is UNKNOWN or targets is UNKNOWN:
        return UNKNOWN
    if original.symmetric:
        message = f"'{shorten(tie.entry.value)}' is symmetric: each of its weights is there both ways"
        findings.error("conflicting-keys", tie.span, message, "write that entry as two, one of them tied to the other")
        return UNKNOWN
    own, other = (len(sources), len(targets)), (len(original.ends[0]), len(original.ends[1]))
    wanted = other[::-1] if tie.transposed else other
    if own != wanted:
        what = "the transpose of" if tie.transposed else "one like"
        message = f"{what} '{shorten(tie.entry.value)}' leads from {wanted[0]} to {wanted[1]} neurons, "
        findings.error("wrong-size", tie.span, f"{message}this entry from {own[0]} to {own[1]}")
        return UNKNOWN
    i, j = original.places()[:: -1 if tie.transposed else 1]
    order = np.lexsort((j, i))
    return Tied(original, narrow(i[order]), narrow(j[order]), order, tie.transposed)


def _named(tie: Tie, entries: Entries, findings: Findings) -> Original | Unknown:
    """The entry that a tie names."""
    name = tie.entry.value
    if name not in entries:
        arrow = arrow_of(tie.entry, findings)
        if arrow is UNKNOWN:
            return UNKNOWN
        name = arrow.normal
    found = entries.get(name, UNKNOWN)
    if name not in entries:
        hint = suggest(name, list(entries), "entries") or "name an entry as it is written in 'connections'"
        findings.error("unknown-name", tie.span, f"there is no entry '{shorten(name)}'", hint)
    if found is None:
        message = f"the weights of '{shorten(name)}' are those of another entry, too"
        findings.error("conflicting-keys", tie.span, message, "name the entry that has the weights")
    return UNKNOWN if found is None else found


def _within(end: Indices, neurons: Indices) -> IntArray:
    """The positions of neurons within an end."""
    order = np.argsort(end, kind="stable")
    return order[np.searchsorted(end[order], neurons)]
