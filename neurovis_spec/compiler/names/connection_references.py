"""Wires: which connections a reference names, ``A -> B``, and which neurons.

In: the connections that are made, and who finds neurons by name. Out: arrays of ascending indices, or findings with the
nearest names. Those that name the same share one array.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import IntArray, frozen
from neurovis_spec.compiler.connections.connect import Connected
from neurovis_spec.compiler.names.references import Directory, few, resolve_end, resolve_ends
from neurovis_spec.diagnostics import Findings, shorten, suggest
from neurovis_spec.language.located import Located


@dataclass(frozen=True)
class Wires:
    """Connections: sources and targets, one each, and what the entries are called."""

    sources: IntArray
    targets: IntArray
    names: tuple[str, ...]
    #: whether each of them learns
    plastic: npt.NDArray[np.bool_]

    def between(self, sources: tuple[int, ...], targets: tuple[int, ...]) -> IntArray:
        """The connections from any of some neurons to any of others."""
        return np.flatnonzero(np.isin(self.sources, sources) & np.isin(self.targets, targets))


def wires_of(made: Connected) -> Wires | None:
    """The connections of a spec, if all of them are known."""
    if not made.complete:
        return None
    plastic = np.repeat([one.learning is not None for one in made.bundles], [len(one.sources) for one in made.bundles])
    return Wires(made.sources, made.targets, tuple(one.name for one in made.bundles), plastic)


@dataclass(frozen=True)
class Finder:
    """Finds what references name among the neurons and the connections; ``wires`` is None where these are not known."""

    wires: Wires | None
    directory: Directory
    findings: Findings
    #: what references mean, those that are valid
    known: dict[str, IntArray] = field(default_factory=dict)

    def neurons(self, text: Located[str]) -> IntArray | None:
        """The neurons of a reference; None where it is invalid."""
        if text.value not in self.known:
            found = resolve_end(text, self.directory, self.findings)
            if found is None:
                return None
            self._know(text, np.unique(np.array(found, dtype=np.int64)))
        return self.known[text.value]

    def connections(self, text: Located[str]) -> IntArray | None:
        """The connections between two ends; None, and a finding, where there is none."""
        if "->" not in text.value:
            self.findings.error(
                "bad-connection", text.span, f"'{shorten(text.value)}' is no connection", "write FROM -> TO"
            )
            return None
        if text.value not in self.known:
            ends = resolve_ends(text, self.directory, self.findings)
            if ends is None or self.wires is None:
                return None
            found = self.wires.between(*ends)
            if not len(found):
                message = f"there is no connection '{shorten(text.value)}'"
                self.findings.error("no-connection", text.span, message, lambda: self._other(text, ends))
                return None
            self._know(text, found)
        return self.known[text.value]

    def _know(self, text: Located[str], indices: IntArray) -> None:
        frozen(indices)
        self.known[text.value] = indices

    def _other(self, text: Located[str], ends: tuple[tuple[int, ...], tuple[int, ...]]) -> str | None:
        """Which connection may be meant: the one the other way, those that are called alike, those of either end."""
        assert self.wires is not None
        source, target = (part.strip() for part in text.value.split("->", 1))
        if len(self.wires.between(ends[1], ends[0])):
            return f"there is '{shorten(target)} -> {shorten(source)}', the other way"
        names = self.wires.names
        near = [name for name in names if source in name.split(" -> ")[0] or target in name.split(" -> ")[-1]]
        return suggest(f"{source} -> {target}", few(text.value, near or names), "connections")
