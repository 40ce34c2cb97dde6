"""Connections: from the entries of a spec to structures of arrays.

In: the ``connections`` section, the Census, Constants, Definitions. Out: Connections in the order written (a
matrix or pattern row by row), and for each plastic entry what it learns by.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import (
    BoolArray,
    Column,
    FloatColumn,
    Indices,
    IntArray,
    IntColumn,
    Texts,
    frozen,
    integers,
    narrow,
    reals,
    texts_of,
)
from neurovis_spec.compiler.connections.entries import Bundle, EntryBuilder, EntryContext
from neurovis_spec.compiler.connections.plasticity import called, title_of
from neurovis_spec.compiler.connections.ties import Original
from neurovis_spec.compiler.limits import Limits
from neurovis_spec.compiler.names.references import Directory, arrow_of, resolve_sum
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.network import PLAIN_ROUTE, Connections
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import Tie
from neurovis_spec.compiler.taken import Wired
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.compiler.values.matrices import grid_of
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import Located
from neurovis_spec.language.sections import ConnectionModel, written
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import Tie as TiedWeight


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

    def styles(self, column: str) -> Texts | None:
        """What each connection has in a column of the files of edges; None where no file has it."""
        columns = (one.columns for one in self.bundles)
        found = (None if one is None else one.texts.get(column) for one in columns)
        return texts_of(zip(found, self.sizes.tolist(), strict=True))

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


def connect(
    scopes: tuple[Scope, ...], census: Census, limits: Limits, seed: int, style: Located[str] | None = None
) -> Connected:
    """The entries of all scopes, a scope's own before those of the instances within it. What is invalid in one instance
    of a module is so in all: it is said once. Of an invalid entry all that does not depend on that is checked.
    ``style`` is the column of edges whose values pictures tell apart."""
    result: list[Bundle] = []
    total = 0
    failed: set[str | None] = set()
    for scope, directory in zip(scopes, census.directories, strict=True):
        if scope.module is not None and scope.module in failed:
            _check_matrices(scope, (), seed)  # those that this instance sets are its own
            continue
        section, findings = scope.section, scope.constants.findings
        if "connections" in section.unknown or written(section.source) > len(section.connections):
            failed.add(scope.module)
        named = list(_named(section.connections, directory, findings))
        made: dict[int, Bundle] = {}
        read: set[str] = set()
        originals: dict[str, Original | Unknown | None] = {one.name: None for one in named if one.tied}
        # what is tied to another entry is made behind all that have weights of their own
        for place in sorted(range(len(named)), key=lambda place: named[place].tied):
            entry, before = named[place], findings.errors
            room = limits.connections - total
            around = EntryContext(scope, directory, census, limits, seed, room, originals, read, style)
            bundle = EntryBuilder(around, *entry).build()
            sound = bundle is not UNKNOWN and findings.errors == before
            if not entry.tied:
                originals[entry.name] = _original(entry, bundle) if sound else UNKNOWN
            if bundle is UNKNOWN or not sound:
                failed.add(scope.module)
            else:
                total += len(bundle.sources)
                made[place] = bundle
        result += (made[place] for place in sorted(made))
        _check_matrices(scope, read, seed)
    return Connected(tuple(result), not failed)


def _check_matrices(scope: Scope, read: Collection[str], seed: int) -> None:
    """Findings of the matrices of a scope that none of its entries has ``read``: whatever stands in a spec is checked,
    and what is said of it where it is read a second time, in an instance around or within, is not said again."""
    for name, given in scope.matrices.items():
        if name not in read and given is not UNKNOWN:
            stream = Stream(seed, "weight", scope.declares(name))
            grid_of(given.written, UNKNOWN, UNKNOWN, False, given.constants, given.files, stream)


class _Entry(NamedTuple):
    """An entry as it is written, what it is called in its scope, and the neurons of its ends."""

    key: Located[str]
    body: ConnectionModel
    name: str
    sources: Indices | Unknown
    targets: Indices | Unknown

    @property
    def tied(self) -> bool:
        """Whether its weights are those of another one."""
        return isinstance(self.body.weight, TiedWeight)


def _named(
    entries: Iterable[tuple[Located[str], ConnectionModel]], directory: Directory, findings: Findings
) -> Iterator[_Entry]:
    """The entries of a scope with their names."""
    number: dict[str, int] = {}
    for key, body in entries:
        name, sources, targets = _ends(key, directory, findings)
        number[name] = number.get(name, 0) + 1
        if number[name] > 1:
            name = f"{name} ({number[name]})"
        if body.contradictory:  # which key is meant is not known: nothing is held against the sizes of the ends
            sources = targets = UNKNOWN
        yield _Entry(key, body, name, sources, targets)


def _original(entry: _Entry, bundle: Bundle | Unknown) -> Original | Unknown:
    """An entry as others may be tied to it."""
    if bundle is UNKNOWN or entry.sources is UNKNOWN or entry.targets is UNKNOWN:
        return UNKNOWN
    return Original(
        name=bundle.name,
        ends=(entry.sources, entry.targets),
        sources=bundle.sources,
        targets=bundle.targets,
        weights=bundle.weights,
        parts=bundle.parts,
        learns=bundle.learns,
        symmetric=bundle.symmetric,
    )


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


def join(made: Connected, rules: Sequence[Indices], lagging: BoolArray | None = None, style: str = "") -> Connections:
    """All entries as one structure of columns; ``rules`` has for each entry the Projection of each connection, or −1,
    ``lagging`` says which connections have a continuous delay, if any, and ``style`` is the column of their styles."""
    bundles, sizes = made.bundles, made.sizes
    tied = _tied(bundles)
    if tied is not None:  # what is tied changes as the rule of the other says
        whole = integers(*rules).whole()
        rules = [np.where(tied >= 0, whole[tied], whole)]
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
        learns=tuple(title_of(one.rules) or (None if one.tied is None else one.tied.shown) for one in bundles),
        labels=tuple(bundle.label for bundle in bundles),
        routes=() if all(route == PLAIN_ROUTE for route in made.wired.routes) else tuple(made.wired.routes),
        undelayed=tuple(number for number, bundle in enumerate(bundles) if bundle.undelayed),
        lags=lags,
        twins=_twins(bundles),
        synapses=synapses if any(synapses) else (),
        tied=None if tied is None else integers(tied),
        own_labels=texts_of((one.labels, len(one.sources)) for one in bundles),
        styles=made.styles(style),
    )


def tying(connections: Connections) -> Iterator[Tie]:
    """What has the tied weights of a network follow those that rules change."""
    if connections.tied is not None:
        tied = connections.tied.whole()
        changing = np.flatnonzero((tied >= 0) & np.asarray(connections.rules.whole() >= 0))
        if len(changing):
            yield Tie(frozen(changing), frozen(tied[changing]))


def _tied(bundles: Sequence[Bundle]) -> IntArray | None:
    """Of every connection the one whose weight it has, −1 where that is its own; None where it is so of all."""
    if all(one.tied is None for one in bundles):
        return None
    starts = np.cumsum([0, *(len(one.sources) for one in bundles)])
    start_of = {one.name: int(start) for one, start in zip(bundles, starts, strict=False)}
    own = (np.full(len(one.sources), -1, dtype=np.int64) for one in bundles)
    places = (
        none if one.tied is None else start_of[one.tied.original.name] + one.tied.places
        for one, none in zip(bundles, own, strict=True)
    )
    return np.concatenate([*places])


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
