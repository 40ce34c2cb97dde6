"""Connections: from the entries of a spec to structures of arrays.

In: the ``connections`` section, the Population, Constants, Definitions. Out: Connections in the order written (a
matrix or pattern row by row), and for each plastic entry what it learns by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurovis_spec.compiler.constants import Constants, Randomness
from neurovis_spec.compiler.definitions import Definitions
from neurovis_spec.compiler.draws import Stream
from neurovis_spec.compiler.edges import EdgeReader, delay_of
from neurovis_spec.compiler.ends import Ends
from neurovis_spec.compiler.learning import Learning, learning_of
from neurovis_spec.compiler.limits import Limits, amount
from neurovis_spec.compiler.matrices import Grid, grid_of
from neurovis_spec.compiler.network import Connections, FloatArray, IntArray, frozen
from neurovis_spec.compiler.patterns import all_to_all, pairs_of
from neurovis_spec.compiler.populate import Population
from neurovis_spec.compiler.references import Directory, resolve_ends
from neurovis_spec.compiler.scale import scaled
from neurovis_spec.compiler.settings import choose
from neurovis_spec.compiler.units import Unit
from neurovis_spec.diagnostics import Span
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.located import Formula, Located, shown
from neurovis_spec.language.sections import ConnectionModel
from neurovis_spec.language.values import FileReference, Rows


@dataclass(frozen=True)
class Bundle:
    """The connections of one entry: neuron indices and values, and the rule, if any."""

    name: str
    key: Span
    sources: IntArray
    targets: IntArray
    weights: FloatArray
    centres: FloatArray
    delays: IntArray
    low: float
    high: float
    learning: Learning | None
    description: str | None


@dataclass(frozen=True)
class _Shape:
    """Which pairs of an entry exist (positions within its ends), and what its shape says of weights and delays."""

    i: IntArray
    j: IntArray
    weights: FloatArray | None = None
    delays: IntArray | None = None


def connect(units: tuple[Unit, ...], population: Population, limits: Limits, seed: int) -> tuple[Bundle, ...] | None:
    """The entries of all units, a unit's own before those of the instances within it; None where one is at fault. What
    is at fault in one instance of a module is so in all: it is said once."""
    result: list[Bundle] = []
    total = 0
    failed: set[str | None] = set()
    for unit, directory in zip(units, population.directories, strict=True):
        if unit.module is not None and unit.module in failed:
            continue
        bundles = Connector(unit, directory, population, limits, seed).connect(total)
        if bundles is None:
            failed.add(unit.module)
            continue
        result += bundles
        total += sum(len(bundle.sources) for bundle in bundles)
    return None if failed else tuple(result)


@dataclass(frozen=True)
class Connector:
    """Makes the connections of every entry of one unit."""

    unit: Unit
    directory: Directory
    population: Population
    limits: Limits
    seed: int

    @property
    def constants(self) -> Constants:
        """What evaluates the formulas of the unit."""
        return self.unit.constants

    @property
    def definitions(self) -> Definitions:
        """What the unit knows of activations, models and rules."""
        return self.unit.definitions

    def connect(self, total: int) -> tuple[Bundle, ...] | None:
        """All entries, behind ``total`` connections; None where one is at fault, the others are still looked at."""
        result: list[Bundle] = []
        failed = False
        seen: dict[str, int] = {}
        for key, body in self.unit.section.connections:
            bundle = self._entry(key, body, seen, total)
            if bundle is None:
                failed = True
                continue
            total += len(bundle.sources)
            result.append(bundle)
        return None if failed else tuple(result)

    def _entry(self, key: Located[str], body: ConnectionModel, seen: dict[str, int], total: int) -> Bundle | None:
        findings = self.constants.findings
        ends = self._ends(key)
        if body.plasticity is not None:  # said here as well, since what is wrong with the ends must not hide it
            choose(body.plasticity, self.definitions.rules, "rule", self.definitions, findings)
        before = findings.errors
        if ends is None or body.lost:  # a body without what is at fault in it would be another one
            return None
        name = self.unit.called(_normal(key.value))
        seen[name] = seen.get(name, 0) + 1
        if seen[name] > 1:
            name = f"{name} ({seen[name]})"
        sources, targets = ends
        return _EntryBuilder(self, key, body, name, sources, targets, self.limits.connections - total).build(before)

    def _ends(self, key: Located[str]) -> tuple[IntArray, IntArray] | None:
        findings = self.constants.findings
        _, arrow, right = key.value.partition("->")
        if not arrow or "->" in right:
            message = f"'{shown(key.value)}' is no connection"
            findings.error("bad-connection", key.span, message, "write FROM -> TO")
            return None
        ends = resolve_ends(key, self.directory, findings)
        if ends is None:
            return None
        return np.array(ends[0], dtype=np.int64), np.array(ends[1], dtype=np.int64)


def _normal(text: str) -> str:
    """An entry's name with single blanks: ``K1 + K3 -> O``."""
    left, _, right = text.partition("->")
    ends = (" + ".join(part.strip() for part in end.split("+")) for end in (left, right))
    return " -> ".join(ends)


@dataclass(frozen=True)
class _EntryBuilder:
    """Builds one entry, step by step: its shape, its weights, its rule."""

    connector: Connector
    key: Located[str]
    body: ConnectionModel
    name: str
    sources: IntArray
    targets: IntArray
    #: how many connections it may make
    room: int

    @property
    def constants(self) -> Constants:
        return self.connector.constants

    def stream(self, purpose: str) -> Stream:
        return Stream(self.connector.seed, purpose, self.name)

    def build(self, before: int) -> Bundle | None:
        body, findings = self.body, self.constants.findings
        self._conflicts()
        if findings.errors > before:
            return None
        delay = 1 if body.delay is None else delay_of(body.delay, self.constants)
        behind = findings.errors
        centre = self._centre_grid()
        shape = self._shape(centre)
        if shape is None or findings.errors > behind:
            return None
        if not len(shape.i):
            findings.error("no-connection", self.key.span, "this entry makes no connection at all")
            return None
        if not self._fits(len(shape.i)):
            return None
        weights = shape.weights if shape.weights is not None else self._weights(shape)
        if weights is not None and body.scale is not None:
            ends, pairs = (self.sources, self.targets), (shape.i, shape.j)
            weights = scaled(body.scale, weights, ends, pairs, self.constants)
        centres = self._centres(centre, shape)
        delays = np.full(len(shape.i), 0 if delay is None else delay, dtype=np.int64)
        if shape.delays is not None:
            delays = np.where(shape.delays >= 0, shape.delays, delays)
        bounds = self._bounds(weights)
        learning = self._learning(shape)
        if weights is None or centres is None or bounds is None or findings.errors > before:
            return None
        return Bundle(
            self.name,
            self.key.span,
            self.sources[shape.i],
            self.targets[shape.j],
            weights,
            centres,
            delays,
            bounds[0],
            bounds[1],
            learning,
            None if body.description is None else body.description.value,
        )

    def _conflicts(self) -> None:
        """What excludes each other: each pair is one finding, at the second key."""
        body, findings = self.body, self.constants.findings
        pairs = [
            ("matrix", "weight"),
            ("matrix", "edges"),
            ("matrix", "pattern"),
            ("edges", "weight"),
            ("edges", "pattern"),
        ]
        table = isinstance(body.centre, (Rows, FileReference))
        if table:
            pairs += [("edges", "centre"), ("centre", "pattern")]
        for first, second in pairs:
            one, other = body.source.entry(first), body.source.entry(second)
            if one is not None and other is not None:
                later = max(one, other, key=lambda entry: entry.key.span)
                message = f"'{second}' beside '{first}': the {first} says it already"
                findings.error("conflicting-keys", later.key.span, message, f"remove '{second}'")
        rows = body.source.entry("rows")
        if rows is not None and body.matrix is None and not table:
            message = "'rows' says how a matrix is read; there is no matrix"
            findings.error("useless-key", rows.key.span, message)
        loops = body.source.entry("self")
        if loops is not None and (body.matrix is not None or body.edges is not None or table):
            message = "'self' says what a pattern may do; here every connection is written"
            findings.error("useless-key", loops.key.span, message)

    def _fits(self, count: int) -> bool:
        """Whether there is room for so many connections; a finding where there is not."""
        if count <= self.room:
            return True
        limit = self.connector.limits.connections
        message = f"this makes {amount(limit - self.room + count)} connections; the limit is {limit:,}"
        self.constants.findings.error("too-many", self.key.span, message, "raise it with --limit")
        return False

    def _centre_grid(self) -> Grid | None:
        centre = self.body.centre
        if not isinstance(centre, (Rows, FileReference)):
            return None
        return self._grid(centre, "centre")

    def _grid(self, matrix: Rows | FileReference, purpose: str) -> Grid | None:
        by_target = self.body.rows is not None and self.body.rows.value == "to"
        n, m = len(self.sources), len(self.targets)
        return grid_of(matrix, n, m, by_target, self.constants, self.connector.unit.files, self.stream(purpose))

    def _shape(self, centre: Grid | None) -> _Shape | None:
        body = self.body
        if body.edges is not None:
            return self._edges()
        if body.matrix is not None:
            grid = self._grid(body.matrix, "weight")
            if grid is None:
                return None
            present = grid.present if centre is None else grid.present & centre.present
            i, j = np.nonzero(present)
            return _Shape(i, j, np.ascontiguousarray(grid.values[i, j]))
        if isinstance(body.centre, (Rows, FileReference)):
            if centre is None:
                return None
            i, j = np.nonzero(centre.present)
            return _Shape(i, j)
        return self._pattern()

    def _pattern(self) -> _Shape | None:
        n, m = len(self.sources), len(self.targets)
        loops: bool | None = True if n == m == 1 else None
        loops = loops if self.body.self is None else self.body.self.value
        position = self.connector.population.neurons.position
        ends = Ends(self.sources, self.targets, loops, position[self.sources], position[self.targets])
        if self.body.pattern is not None:
            pairs = pairs_of(self.body.pattern, ends, self.constants, self.stream("edges"), self._fits)
            return None if pairs is None else _Shape(*pairs)
        if n > 1 and m > 1:
            message = f"{n} neurons to {m} neurons: how are they connected?"
            hint = "add pattern: all_to_all, or pattern: one_to_one, or a matrix"
            self.constants.findings.error("pattern-missing", self.key.span, message, hint)
            return None
        return _Shape(*all_to_all(ends))

    def _edges(self) -> _Shape | None:
        called, own = self.connector.population.neurons.names, len(self.connector.unit.called(""))
        sources = {called[neuron][own:]: place for place, neuron in enumerate(self.sources.tolist())}
        targets = {called[neuron][own:]: place for place, neuron in enumerate(self.targets.tolist())}
        files, stream = self.connector.unit.files, self.stream("weight")
        reader = EdgeReader(sources, targets, self.constants, files, stream, self.room)
        assert self.body.edges is not None
        edges = reader.read(self.body.edges)
        return None if edges is None else _Shape(edges.i, edges.j, edges.weights, edges.delays)

    def _values(self, formula: Formula, shape: _Shape, purpose: str) -> FloatArray | None:
        """A formula of i, j, n_from, n_to (and distance) for every pair."""
        extra: dict[str, float | FloatArray] = {
            "i": shape.i.astype(np.float64),
            "j": shape.j.astype(np.float64),
            "n_from": float(len(self.sources)),
            "n_to": float(len(self.targets)),
        }
        tree = None
        if isinstance(formula.value, str):
            tree = self.constants.tree(formula, (*extra, "distance"), random=True)
            if tree is None:
                return None
        if tree is not None and "distance" in names(tree):
            position = self.connector.population.neurons.position
            apart = position[self.sources[shape.i]] - position[self.targets[shape.j]]
            if not np.isfinite(apart).all():
                message = "'distance' needs a position of every neuron of both ends"
                self.constants.findings.error("no-position", formula.span, message, "give the groups a 'position'")
                return None
            extra["distance"] = np.hypot(apart[:, 0], apart[:, 1])
        value = self.constants.value(formula, extra, Randomness(self.stream(purpose), shape.i, shape.j))
        return None if value is None else np.broadcast_to(np.asarray(value, dtype=np.float64), shape.i.shape).copy()

    def _weights(self, shape: _Shape) -> FloatArray | None:
        if self.body.weight is None:
            return np.ones(len(shape.i))
        return self._values(self.body.weight, shape, "weight")

    def _centres(self, grid: Grid | None, shape: _Shape) -> FloatArray | None:
        centre = self.body.centre
        if centre is None:
            return np.zeros(len(shape.i))
        if not self._measures_distance():
            entry = self.body.source.entry("centre")
            span = self.key.span if entry is None else entry.key.span
            message = "'centre' has no effect: none of the targets combines by distance"
            self.constants.findings.error("useless-key", span, message, "give the targets combine: distance")
            return None
        if grid is not None:
            return np.ascontiguousarray(grid.values[shape.i, shape.j])
        assert isinstance(centre, Located)
        return self._values(centre, shape, "centre")

    def _measures_distance(self) -> bool:
        """Whether any of the targets combines by distance, or may, where what it says of that is at fault."""
        return bool(self.connector.population.by_distance[self.targets].any())

    def _bounds(self, weights: FloatArray | None) -> tuple[float, float] | None:
        bounds = self.body.bounds
        if bounds is None:
            return (-np.inf, np.inf)
        findings = self.constants.findings
        entry = self.body.source.entry("bounds")
        assert entry is not None
        if self.body.plasticity is None:
            findings.error("useless-key", entry.key.span, "'bounds' hold plastic weights; there is no 'plasticity'")
            return None
        low, high = self.constants.scalar(bounds[0]), self.constants.scalar(bounds[1])
        if low is None or high is None:
            return None
        if low > high:
            findings.error("out-of-range", entry.value.span, f"the lower bound {low:g} is above the upper one {high:g}")
            return None
        if weights is not None and ((weights < low) | (weights > high)).any():
            first = weights[(weights < low) | (weights > high)][0]
            message = f"the first weight {first:g} lies outside the bounds {low:g} to {high:g}"
            findings.error("weight-outside", entry.value.span, message)
            return None
        return (low, high)

    def _learning(self, shape: _Shape) -> Learning | None:
        if self.body.plasticity is None:
            return None
        connector = self.connector
        return learning_of(
            self.body.plasticity,
            shape.j,
            len(self.targets),
            connector.unit,
            connector.directory,
            len(connector.population.neurons),
        )


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
