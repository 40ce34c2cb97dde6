"""Connections: from the entries of a spec to structures of arrays.

In: the ``connections`` section, the Census, Constants, Definitions. Out: Connections in the order written (a
matrix or pattern row by row), and for each plastic entry what it learns by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from neurovis_spec.arrays import (
    BoolArray,
    Column,
    FloatColumn,
    Indices,
    IntArray,
    IntColumn,
    integers,
    narrow,
    reals,
)
from neurovis_spec.compiler.connections.entries import Bundle, EntryBuilder, EntryContext
from neurovis_spec.compiler.connections.plasticity import called, title_of
from neurovis_spec.compiler.limits import Limits
from neurovis_spec.compiler.names.references import Directory, arrow_of, resolve_sum
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.network import PLAIN_ROUTE, Connections
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.taken import Wired
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import Located
from neurovis_spec.language.sections import written
from neurovis_spec.language.unknown import UNKNOWN, Unknown


@dataclass(frozen=True)
class Connected:
    """The entries that are not invalid, and whether these are all."""

    bundles: tuple[Bundle, ...]
    complete: bool

    @cached_property
    def sources(self) -> IntColumn:
        """The source of every connection."""
        return integers(*(bundle.sources for bundle in self.bundles))

    @cached_property
    def targets(self) -> IntColumn:
        """The target of every connection."""
        return integers(*(bundle.targets for bundle in self.bundles))

    @cached_property
    def delays(self) -> IntColumn:
        """The delay of every connection."""
        return integers(*(bundle.delays for bundle in self.bundles))

    @cached_property
    def exact(self) -> FloatColumn | None:
        """How many steps the delay of every connection is, where it is in seconds, else NaN; None without any."""
        exact = [None if bundle.timing is None else bundle.timing.exact for bundle in self.bundles]
        if all(one is None for one in exact):
            return None
        sizes = self.sizes.tolist()
        nothing = (np.broadcast_to(np.nan, (size,)) for size in sizes)
        return reals(*(none if one is None else one for one, none in zip(exact, nothing, strict=True)))

    @cached_property
    def entry(self) -> IntColumn:
        """The number of the entry of every connection."""
        return Column.repeated(np.arange(len(self.bundles)), self.sizes, np.int64)

    @property
    def shares(self) -> bool:
        """Whether connections have the states of a synapse together."""
        return any(one.carriers is not None for one in self.bundles)

    @property
    def sizes(self) -> IntArray:
        """How many connections each entry makes."""
        return np.array([len(bundle.sources) for bundle in self.bundles], dtype=np.int64)

    def bundle_of(self, connection: int) -> Bundle:
        """The entry that makes a connection."""
        return self.bundles[int(np.searchsorted(np.cumsum(self.sizes), connection, side="right"))]

    @cached_property
    def wired(self) -> Wired:
        """The connections as levels go by them."""
        bundles = self.bundles
        return Wired(
            self.sources,
            self.targets,
            self.delays,
            self.entry,
            routes=tuple(one.route for one in bundles),
            synapses={number: one.synapse.definition for number, one in enumerate(bundles) if one.synapse is not None},
            rules={number: [own.rule for own in one.rules] for number, one in enumerate(bundles) if one.rules},
            timed=None if self.exact is None else np.asarray(self.exact.whole() > 0),
            silent=np.arange(len(self.carriers)) != self.carriers if self.shares else None,
        )

    @cached_property
    def carriers(self) -> IntArray:
        """For each connection the one that carries the states of its synapse: itself, where none is shared."""
        return np.concatenate(
            [
                start + (np.arange(size) if bundle.carriers is None else bundle.carriers)
                for bundle, size, start in zip(
                    self.bundles, self.sizes, np.cumsum(self.sizes) - self.sizes, strict=True
                )
            ]
        )


def connect(scopes: tuple[Scope, ...], census: Census, limits: Limits, seed: int) -> Connected:
    """The entries of all scopes, a scope's own before those of the instances within it. What is invalid in one instance
    of a module is so in all: it is said once. Of an invalid entry all that does not depend on that is checked."""
    result: list[Bundle] = []
    total = 0
    failed: set[str | None] = set()
    for scope, directory in zip(scopes, census.directories, strict=True):
        if scope.module is not None and scope.module in failed:
            continue
        section, findings = scope.section, scope.constants.findings
        if "connections" in section.unknown or written(section.source) > len(section.connections):
            failed.add(scope.module)
        number: dict[str, int] = {}
        for key, body in section.connections:
            before = findings.errors
            name, sources, targets = _ends(key, directory, findings)
            number[name] = number.get(name, 0) + 1
            if number[name] > 1:
                name = f"{name} ({number[name]})"
            if body.contradictory:  # which key is meant is not known: nothing is held against the sizes of the ends
                sources = targets = UNKNOWN
            around = EntryContext(scope, directory, census, limits, seed, limits.connections - total)
            bundle = EntryBuilder(around, key, body, name, sources, targets).build()
            if bundle is UNKNOWN or findings.errors > before:
                failed.add(scope.module)
            else:
                total += len(bundle.sources)
                result.append(bundle)
    return Connected(tuple(result), not failed)


def _ends(
    key: Located[str], directory: Directory, findings: Findings
) -> tuple[str, Indices | Unknown, Indices | Unknown]:
    """What an entry is called, and the neurons of its ends, UNKNOWN where an end is invalid."""
    arrow = arrow_of(key, findings)
    if arrow is UNKNOWN:
        return key.value, UNKNOWN, UNKNOWN
    ends = [resolve_sum(end, key, directory, findings) for end in (arrow.sources, arrow.targets)]
    sources, targets = (UNKNOWN if end is UNKNOWN else narrow(np.array(end, dtype=np.int64)) for end in ends)
    return arrow.normal, sources, targets


def join(made: Connected, rules: Sequence[Indices], lagging: BoolArray | None = None) -> Connections:
    """All entries as one structure of columns; ``rules`` has for each entry the Projection of each connection, or −1,
    and ``lagging`` says which connections have a continuous delay, if any."""
    bundles, sizes = made.bundles, made.sizes
    synapses = tuple(None if one.synapse is None else called(one.synapse) for one in bundles)
    lags = None
    if lagging is not None and made.exact is not None:
        lags = made.exact if lagging.all() else reals(np.where(lagging, made.exact.whole(), np.nan))
    return Connections(
        sources=made.sources,
        targets=made.targets,
        weights=reals(*(bundle.weights for bundle in bundles)),
        centres=reals(*(bundle.centres for bundle in bundles)),
        delays=made.delays,
        rules=integers(*rules),
        entry=made.entry,
        low=Column.repeated(np.array([bundle.low for bundle in bundles]), sizes, np.float64),
        high=Column.repeated(np.array([bundle.high for bundle in bundles]), sizes, np.float64),
        entries=tuple(bundle.name for bundle in bundles),
        descriptions=tuple(bundle.description for bundle in bundles),
        learns=tuple(title_of(bundle.rules) or None for bundle in bundles),
        labels=tuple(bundle.label for bundle in bundles),
        routes=() if all(route == PLAIN_ROUTE for route in made.wired.routes) else tuple(made.wired.routes),
        undelayed=tuple(number for number, bundle in enumerate(bundles) if bundle.undelayed),
        lags=lags,
        twins=_twins(bundles),
        synapses=synapses if any(synapses) else (),
    )


def _twins(bundles: Sequence[Bundle]) -> IntColumn | None:
    """The twin of every connection, −1 without; None where no entry is symmetric."""
    if not any(one.symmetric for one in bundles):
        return None
    found: list[IntArray] = []
    start = 0
    for bundle in bundles:
        size = len(bundle.sources)
        numbers = np.arange(start, start + size, dtype=np.int64)
        found.append(numbers.reshape(-1, 2)[:, ::-1].ravel() if bundle.symmetric else np.broadcast_to(-1, (size,)))
        start += size
    return integers(*found)
