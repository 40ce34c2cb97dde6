"""Connections: from the entries of a spec to structures of arrays.

In: the ``connections`` section, the Population, Constants, Definitions. Out: Connections in the order written (a
matrix or pattern row by row), and for each plastic entry what it learns by.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import IntArray, frozen
from neurovis_spec.compiler.connections.entries import Bundle, EntryBuilder, Place
from neurovis_spec.compiler.connections.plasticity import title_of
from neurovis_spec.compiler.limits import Limits
from neurovis_spec.compiler.names.references import Directory, arrow_of, resolve_sum
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.network import Connections
from neurovis_spec.compiler.neurons.populate import Population
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.language.located import Located
from neurovis_spec.language.references import Sum
from neurovis_spec.language.sections import ConnectionModel, written


class Connected(NamedTuple):
    """The entries that are not invalid, and whether these are all."""

    bundles: tuple[Bundle, ...]
    complete: bool

    @property
    def sources(self) -> IntArray:
        """The source of every connection."""
        return np.concatenate([bundle.sources for bundle in self.bundles] or [_NONE])

    @property
    def targets(self) -> IntArray:
        """The target of every connection."""
        return np.concatenate([bundle.targets for bundle in self.bundles] or [_NONE])


_NONE = np.zeros(0, dtype=np.int64)


def connect(scopes: tuple[Scope, ...], population: Population, limits: Limits, seed: int) -> Connected:
    """The entries of all scopes, a scope's own before those of the instances within it. What is invalid in one instance
    of a module is so in all: it is said once."""
    result: list[Bundle] = []
    total = 0
    failed: set[str | None] = set()
    for scope, directory in zip(scopes, population.directories, strict=True):
        if scope.module is not None and scope.module in failed:
            continue
        made = Connector(scope, directory, population, limits, seed).connect(total)
        if not made.complete:
            failed.add(scope.module)
        result += made.bundles
        total += sum(len(bundle.sources) for bundle in made.bundles)
    return Connected(tuple(result), not failed)


@dataclass(frozen=True)
class Connector:
    """Makes the connections of every entry of one scope."""

    scope: Scope
    directory: Directory
    population: Population
    limits: Limits
    seed: int

    @property
    def constants(self) -> Constants:
        """What evaluates the formulas of the scope."""
        return self.scope.constants

    def connect(self, total: int) -> Connected:
        """All entries, behind ``total`` connections."""
        result: list[Bundle] = []
        failed = False
        seen: dict[str, int] = {}
        for key, body in self.scope.section.connections:
            bundle = self._entry(key, body, seen, total)
            if bundle is None:
                failed = True
                continue
            total += len(bundle.sources)
            result.append(bundle)
        return Connected(tuple(result), not failed and not self._left_out())

    def _left_out(self) -> bool:
        """Whether there are entries that could not be read at all."""
        section = self.scope.section
        return "connections" in section.lost_keys or written(section.source) > len(section.connections)

    def _entry(self, key: Located[str], body: ConnectionModel, seen: dict[str, int], total: int) -> Bundle | None:
        """One entry; None where it is invalid, and then all that does not depend on that is still looked at."""
        before = self.constants.findings.errors
        arrow = arrow_of(key, self.constants.findings)
        sources = None if arrow is None else self._end(arrow.sources, key)
        targets = None if arrow is None else self._end(arrow.targets, key)
        name = key.value if arrow is None else arrow.normal
        seen[name] = seen.get(name, 0) + 1
        if seen[name] > 1:
            name = f"{name} ({seen[name]})"
        room = self.limits.connections - total
        place = Place(self.scope, self.directory, self.population, self.limits, self.seed, room)
        bundle = EntryBuilder(place, key, body, name, sources, targets).build()
        return bundle if self.constants.findings.errors == before else None

    def _end(self, end: Sum, key: Located[str]) -> IntArray | None:
        found = resolve_sum(end, key, self.directory, self.constants.findings)
        return None if found is None else np.array(found, dtype=np.int64)


def join(bundles: tuple[Bundle, ...], rules: IntArray) -> Connections:
    """All entries as one structure of arrays; ``rules`` says, for each connection, which plasticity it has."""
    empty = np.zeros(0)
    none = empty.astype(np.int64)
    sizes = [len(bundle.sources) for bundle in bundles]
    result = Connections(
        sources=np.concatenate([bundle.sources for bundle in bundles] or [none]),
        targets=np.concatenate([bundle.targets for bundle in bundles] or [none]),
        weights=np.concatenate([bundle.weights for bundle in bundles] or [empty]),
        centres=np.concatenate([bundle.centres for bundle in bundles] or [empty]),
        delays=np.concatenate([bundle.delays for bundle in bundles] or [none]),
        rules=rules,
        entry=np.repeat(np.arange(len(bundles), dtype=np.int64), sizes),
        low=np.repeat(np.array([bundle.low for bundle in bundles], dtype=np.float64), sizes),
        high=np.repeat(np.array([bundle.high for bundle in bundles], dtype=np.float64), sizes),
        entries=tuple(bundle.name for bundle in bundles),
        descriptions=tuple(bundle.description for bundle in bundles),
        learns=tuple(None if bundle.learning is None else title_of(bundle.learning) for bundle in bundles),
        labels=tuple(bundle.label for bundle in bundles),
    )
    for array in (
        result.sources,
        result.targets,
        result.weights,
        result.centres,
        result.delays,
        result.rules,
        result.entry,
        result.low,
        result.high,
    ):
        frozen(array)
    return result
