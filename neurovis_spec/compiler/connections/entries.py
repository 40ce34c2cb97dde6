"""Entries: one entry of ``connections``, from its ends and its body to arrays.

In: the neurons of both ends, where these are known, and the body. Out: a Bundle, or UNKNOWN: of an entry that is
invalid every part is still checked, whatever is wrong with the others.

A number that is made from a parameter which can be set *follows* it in a run: ``with constants.following() as parts``
collects a Part, a formula and where its numbers stand, for each such number, and ``constants.follow(parts)`` hands
parts on to the block around it (``values/constants.py``). Where the parts do not say all, they are replaced by one that
does: weights that are scaled together are one Scaled, what depends on positions has a Distance in its formula.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, Indices, IntArray, Texts, narrow
from neurovis_spec.compiler.connections.delays import DelayReader, Delays, Timed, check_below_step, text_of
from neurovis_spec.compiler.connections.edges import EdgeColumns, EdgeReader, End
from neurovis_spec.compiler.connections.ends import Ends, counted
from neurovis_spec.compiler.connections.in_use import InUse, Joined, in_use
from neurovis_spec.compiler.connections.pair_formulas import At, PairFormulas
from neurovis_spec.compiler.connections.patterns import all_to_all, drawn_alone, empty_reason, pairs_of, pairs_where
from neurovis_spec.compiler.connections.plasticity import Learning, rules_of
from neurovis_spec.compiler.connections.routes import default_delays, route_of
from neurovis_spec.compiler.connections.shared import carriers_in, check_shared
from neurovis_spec.compiler.connections.signals import ConnectionEnds, Place
from neurovis_spec.compiler.connections.spikes import SpikeCheck
from neurovis_spec.compiler.connections.ties import Entries, Tied, tied_to
from neurovis_spec.compiler.connections.twins import both_ways, doubled, in_turn, one_of_each
from neurovis_spec.compiler.connections.weight_scale import Scaled, check_scale, scaled
from neurovis_spec.compiler.events.settable import Assembled, Part
from neurovis_spec.compiler.limits import PAIRS_A_CONNECTION, Limits, amount
from neurovis_spec.compiler.names.references import Directory
from neurovis_spec.compiler.names.scope import GivenMatrix, Scope
from neurovis_spec.compiler.network import PLAIN_ROUTE, Route
from neurovis_spec.compiler.neurons.labels import check_length
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import DRIVE, RULE, SYNAPSE, Definition
from neurovis_spec.compiler.values.arguments import Each, Settled, check_initials, settled_of
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.compiler.values.matrices import Grid, draws_any, grid_of
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.expressions.tree import draws, names
from neurovis_spec.language.grammar import WHICH
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.patterns import PATTERNS
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.sections import ConnectionModel
from neurovis_spec.language.tables import EdgeFile, EdgeTexts, FileReference, columns_of_edges, edge_column
from neurovis_spec.language.unknown import UNKNOWN, Unknown, known
from neurovis_spec.language.values import Delay, Matrix, MatrixName, MatrixRows, Tie
from neurovis_spec.language.words import Combine
from neurovis_spec.language.yaml.source import Mapping, Scalar
from neurovis_spec.likeness import suggest

#: Keys of a body that say which connections there are.
_SHAPING = frozenset({"matrix", "edges", "pattern", "centre", "rows", "self", "where"})
_PAIR = formula_at(ConnectionModel, "weight")
_SETTING = formula_at(ConnectionModel, "synapse", "SYNAPSE", "SETTING")
#: Keys that a symmetric entry cannot have, why, and what to do.
_UNLIKE_TWINS = (
    (
        "plasticity",
        "a rule at a symmetric entry would give the two connections of a pair different weights",
        "write two entries, one each way, without 'symmetric'",
    ),
    ("scale", "the weights of a symmetric entry are not scaled together", "put the factor into the 'weight'"),
)


class Bundle(NamedTuple):
    """The connections of one entry: neuron indices and values, one a connection, and the rules, if any."""

    name: str
    #: where the entry is named
    key: Span
    sources: Indices
    targets: Indices
    weights: FloatArray
    centres: FloatArray
    delays: Indices
    low: float
    high: float
    rules: tuple[Learning, ...]
    description: str | None
    #: whether the entry has a ``self``, and no neuron is in both of its ends
    ends_disjoint: bool
    #: which of its numbers follow parameters: of ``weights``, or ``initial_weights`` where it learns (which nothing
    #: that is set in a run changes), of ``centres``, ``low``, ``high`` and ``rule``
    parts: tuple[Part, ...] = ()
    label: str | None = None
    #: of an entry in whose file the connections have labels of their own these
    labels: Texts | None = None
    #: what else is read of the file of its edges
    columns: EdgeColumns | None = None
    #: of an entry that makes no connection the neurons of its ends
    empty: tuple[Indices, Indices] | None = None
    route: Route = PLAIN_ROUTE
    #: whether it names no delay, and connections have delay 0 for what flows through them
    undelayed: bool = False
    #: its delays, where any is in seconds
    timing: Delays | None = None
    #: whether each connection is directly followed by its twin, which leads back
    symmetric: bool = False
    synapse: Settled | None = None
    #: the rules and the synapse, with what they read of both ends
    uses: tuple[InUse, ...] = ()
    #: where the synapse is shared, for each connection the one of the entry that carries its states; else None
    carriers: IntArray | None = None
    #: where the weights are those of another entry, of which connection each of them is the weight; else None
    tied: Tied | None = None

    @property
    def learns(self) -> bool:
        """Whether a rule changes its weights."""
        return any(one.rule.given.name == RULE.gives for one in self.rules)

    def twinned(self) -> Bundle:
        """The same with each connection directly followed by its twin, which has its numbers."""
        count = len(self.sources)
        each = np.repeat(np.arange(count, dtype=np.int64), 2)
        synapse = self.synapse
        if synapse is not None:
            values = {name: array[each] for name, array in synapse.parameters.items()}
            synapse = synapse._replace(parameters=values, parts=tuple(doubled(one, count) for one in synapse.parts))
        return self._replace(
            sources=in_turn(self.sources, self.targets),
            targets=in_turn(self.targets, self.sources),
            weights=self.weights[each],
            centres=self.centres[each],
            delays=self.delays[each],
            parts=tuple(doubled(one, count) for one in self.parts),
            timing=None if self.timing is None else self.timing.at(each),
            labels=None if self.labels is None else self.labels.at(each),
            columns=None if self.columns is None else self.columns.at(each),
            synapse=synapse,
            symmetric=True,
        )


class _Shape(NamedTuple):
    """Which pairs of an entry exist, and what its shape says of weights and delays."""

    #: for each pair the position of its source among the sources of the entry
    i: Indices
    #: for each pair the position of its target among the targets of the entry
    j: Indices
    weights: FloatArray | None = None
    delays: Delays | None = None
    #: which of its weights follow parameters
    parts: tuple[Part, ...] = ()
    #: what else a file of edges says of each
    columns: EdgeColumns | None = None
    #: the number of each connection among those of its pair
    copy: int | Indices = 0
    #: the entry that has the weights
    tied: Tied | None = None

    @property
    def has_delay(self) -> BoolArray:
        """For each pair whether its shape says a delay."""
        return np.asarray(self.delays.steps >= 0) if self.delays is not None else np.zeros(len(self.i), dtype=np.bool_)

    def some(self, kept: IntArray) -> _Shape:
        """Some of its pairs."""
        weights = None if self.weights is None else self.weights[kept]
        delays = None if self.delays is None else self.delays.at(kept)
        place_of = np.full(len(self.i), -1, dtype=np.int64)
        place_of[kept] = np.arange(len(kept))
        parts = tuple(_moved_to(part, place_of[part.within(len(self.i))]) for part in self.parts)
        columns = None if self.columns is None else self.columns.at(kept)
        copy = self.copy if isinstance(self.copy, int) else self.copy[kept]
        return _Shape(self.i[kept], self.j[kept], weights, delays, parts, columns, copy)


class _Read(NamedTuple):
    """What the body of an entry says, all of it valid; ``delays`` are None where it says none."""

    shape: _Shape
    route: Route
    rules: tuple[Learning, ...]
    synapse: Settled | None
    weights: FloatArray
    centres: FloatArray
    bounds: tuple[float, float]
    delays: Delays | Unknown | None
    labels: Texts | None


class EntryContext(NamedTuple):
    """Where an entry stands: its scope, what is called how there, how many connections it may make."""

    scope: Scope
    directory: Directory
    census: Census
    limits: Limits
    seed: int
    room: int
    #: the entries that weights may be tied to
    originals: Entries
    #: the matrices of the scope that entries have asked for, by their names
    read: set[str]
    #: the column of edges whose values pictures tell apart
    style: Located[str] | None = None


@dataclass(frozen=True)
class EntryBuilder:
    """Builds one entry, step by step: its shape, its weights, its rules. An end that is invalid is UNKNOWN.

    ``name`` is what it is called in its scope.
    """

    context: EntryContext
    key: Located[str]
    body: ConnectionModel
    name: str
    sources: Indices | Unknown
    targets: Indices | Unknown

    @property
    def constants(self) -> Constants:
        """What evaluates the formulas of the scope."""
        return self.context.scope.constants

    @property
    def formulas(self) -> PairFormulas:
        """What evaluates those of pairs."""
        most = PAIRS_A_CONNECTION * self.context.limits.connections
        return PairFormulas(self.sources, self.targets, self.context.census, self.constants, most)

    @cached_property
    def route(self) -> Route | Unknown:
        """What its connections take, and where they bring it."""
        return route_of(self.body, self._starts, self._aims, self.context.census, self.constants)

    @property
    def symmetric(self) -> bool:
        """Whether each connection is followed by its twin."""
        return self.body.symmetric is not None and self.body.symmetric.value

    @property
    def _starts(self) -> Indices | Unknown:
        """The neurons that connections may come from: of a symmetric entry those of both ends."""
        return _of_both(self.sources, self.targets) if self.symmetric else self.sources

    @property
    def _aims(self) -> Indices | Unknown:
        """The neurons that they may lead to."""
        return _of_both(self.sources, self.targets) if self.symmetric else self.targets

    def _stream(self, purpose: str) -> Stream:
        return Stream(self.context.seed, purpose, self.context.scope.declares(self.name))

    def _is_sound(self, *keys: str) -> bool:
        """Whether these keys could be read; False where one was invalid, and dropped while reading."""
        return self.body.unknown.isdisjoint(keys)

    def build(self) -> Bundle | Unknown:
        """The connections; UNKNOWN where anything of the entry is invalid, which is reported."""
        body, findings = self.body, self.constants.findings
        errors_before_entry = findings.errors
        if isinstance(body.label, Located):
            check_length(body.label, findings)
        route = self.route
        errors_before_shape = findings.errors
        # what is collected here stands at cells of the matrix, what ``centre_parts`` collects at connections
        with self.constants.following() as centre_cell_parts:
            centre = self._grid(body.centre, "centre") if isinstance(body.centre, (MatrixRows, FileReference)) else None
        shape = self._fitting(self._shape(centre), errors_before_shape)
        written = self._written_delays(shape)
        with self.constants.following() as weight_parts:
            weights = self._weights(shape)
        with self.constants.following() as centre_parts:
            centres = self._centres(centre, shape)
            self.constants.follow(self._parts_per_connection(centre, centre_cell_parts, shape))
        with self.constants.following() as bound_parts:  # ``_bounds`` sets the field of each
            bounds = self._bounds(weights)
        rules, synapse, labels = self._rules(shape), self._synapse(shape), self._labels(shape)
        if shape is UNKNOWN or weights is UNKNOWN or centres is UNKNOWN or bounds is UNKNOWN:
            return UNKNOWN
        if route is UNKNOWN or rules is UNKNOWN or synapse is UNKNOWN or labels is UNKNOWN:
            return UNKNOWN
        if not body.sound or findings.errors > errors_before_entry:
            return UNKNOWN
        read = _Read(shape, route, rules, synapse, weights, centres, bounds, written, labels)
        return self._bundle(read, (weight_parts, centre_parts, bound_parts))

    def _fitting(self, shape: _Shape | Unknown, errors_before: int) -> _Shape | Unknown:
        """The shape, of a symmetric entry each pair once; UNKNOWN where anything was invalid, or there is no room."""
        if self.symmetric:
            shape = self._once(shape)
        if shape is UNKNOWN or self.constants.findings.errors > errors_before:
            return UNKNOWN
        if not len(shape.i):
            self._report_empty()
        fits = self.constants.findings.errors == errors_before and self._fits(len(shape.i))
        return shape if fits else UNKNOWN

    def _bundle(self, read: _Read, parts: tuple[list[Part], list[Part], list[Part]]) -> Bundle | Unknown:
        """The bundle of what was read, of whose weights, centres and bounds these ``parts`` follow parameters."""
        shape, body = read.shape, self.body
        if self.sources is UNKNOWN or self.targets is UNKNOWN:
            return UNKNOWN
        sources, targets = self.sources[shape.i], self.targets[shape.j]
        delays, unsaid = self._settled_delays(read, sources, targets)
        # without connections there is nothing that rules and synapses would do
        rules, synapse = (read.rules, read.synapse) if len(shape.i) else ((), None)
        learns = {name: any(one.rule.given.name == name for one in rules) for name in ("weight", "centre")}
        learns["weight"] |= shape.tied is not None and shape.tied.original.learns
        weight_parts, centre_parts, bound_parts = parts
        bundle = Bundle(
            name=self.context.scope.called(self.name),
            key=self.key.span,
            sources=sources,
            targets=targets,
            weights=read.weights,
            centres=read.centres,
            delays=delays.steps,
            low=read.bounds[0],
            high=read.bounds[1],
            rules=rules,
            description=None if body.description is None else body.description.value,
            ends_disjoint=body.self is not None and not np.isin(self.sources, self.targets).any(),
            parts=(
                *(part._replace(field="initial_weights" if learns["weight"] else "weights") for part in weight_parts),
                *(part._replace(field="initial_centres" if learns["centre"] else "centres") for part in centre_parts),
                *bound_parts,
            ),
            label=body.label.value if isinstance(body.label, Located) else None,
            labels=read.labels,
            columns=shape.columns,
            empty=None if len(shape.i) else (self.sources, self.targets),
            route=read.route,
            undelayed=read.delays is None and not np.all(np.asarray(unsaid) | shape.has_delay),
            timing=None if delays.exact is None else delays,
            synapse=synapse,
            tied=shape.tied,
        )
        return self._in_use(bundle.twinned() if self.symmetric else bundle)

    def _settled_delays(self, read: _Read, sources: Indices, targets: Indices) -> tuple[Delays, int | Indices]:
        """The delay of every connection, and what it is where nothing says one; checked against what flows and fires
        at both ends."""
        made, models = None if read.synapse is None else read.synapse.definition, self.context.census.models
        unsaid = self._default_delays(sources, targets, read.route, made)
        delays = _delays(read.shape, read.delays, unsaid)
        into_flow = models.into_flow(targets, read.route) | (made is not None and bool(made.flows))
        if self.symmetric:
            into_flow = into_flow | models.into_flow(sources, read.route)
        check_below_step(delays, into_flow, self.constants)
        if models.fires:
            pairs = models.pairs(sources, targets) + (models.pairs(targets, sources) if self.symmetric else [])
            check = SpikeCheck(read.route, made, read.rules, pairs, models, self.key.span, self.constants.findings)
            check.check(undelayed=bool((delays.steps == 0).any()))
        return delays, unsaid

    def _default_delays(
        self, sources: Indices, targets: Indices, route: Route, synapse: Definition | None
    ) -> int | Indices:
        """The delays of connections that name none; twins have the same, the longer one of both."""
        models = self.context.census.models
        there = default_delays(sources, targets, route, models, synapse)
        if not self.symmetric:
            return there
        longer = np.maximum(there, default_delays(targets, sources, route, models, synapse))
        return narrow(np.broadcast_to(longer, sources.shape))

    def _in_use(self, bundle: Bundle) -> Bundle | Unknown:
        """A bundle with its rules and its synapse in use, and what of these follows parameters."""
        uses = self._uses(bundle.rules, bundle.synapse, Joined(bundle.sources, bundle.targets, self.context.census))
        if uses is UNKNOWN:
            return UNKNOWN
        parts = *bundle.parts, *(part for use in uses for part in use.parts)
        return bundle._replace(uses=uses, parts=parts, carriers=carriers_in(uses, bundle.targets))

    def _once(self, shape: _Shape | Unknown) -> _Shape | Unknown:
        """The pairs of a symmetric entry, each once and none of a neuron with itself. A finding for those that are
        written both ways, and for what has different numbers there."""
        for key, why, hint in _UNLIKE_TWINS:
            entry = self.body.source.entry(key)
            if entry is not None:
                self.constants.findings.error("conflicting-keys", entry.key.span, why, hint)
        if shape is UNKNOWN or self.sources is UNKNOWN or self.targets is UNKNOWN:
            return UNKNOWN
        made = self.body.matrix is None and self.body.edges is None
        if made and shape.weights is None and np.array_equal(self.sources, self.targets):
            pattern = self.body.pattern
            return _shape_of(*one_of_each(shape.i, shape.j, pattern is not None and drawn_alone(pattern)))
        sources, targets = self.sources[shape.i], self.targets[shape.j]
        kept = np.flatnonzero(sources != targets)
        both = both_ways(sources[kept], targets[kept])
        if both is None:
            return shape if len(kept) == len(shape.i) else shape.some(kept)
        called = self.context.census.neurons.names
        first = kept[both.first]
        ends = called[sources[first]], called[targets[first]]
        many = f" ({both.many:,} of {len(kept):,} connections do)" if both.many > 2 else ""
        message = f"symmetric: true, and both '{' -> '.join(ends)}' and '{' -> '.join(ends[::-1])}' are there{many}"
        hint = "leave 'symmetric' out, or give one connection of each pair"
        self.constants.findings.error("both-ways", self._symmetric_span, message, hint)
        return UNKNOWN

    @property
    def _symmetric_span(self) -> Span:
        entry = self.body.source.entry("symmetric")
        return self.key.span if entry is None else entry.key.span

    def _report_empty(self) -> None:
        """Say that there are no connections: an error, but for those that are drawn, counted or chosen by a condition,
        as validity depends on no seed and no parameter."""
        pattern, where, findings = self.body.pattern, self.body.where, self.constants.findings
        if isinstance(self.body.weight, Tie):
            findings.warning("nothing-drawn", self.key.span, "the entry that has the weights makes no connection", None)
            return
        if where is not None:
            hint = "i and j count from 0; a neuron is connected to itself with self: true alone"
            findings.warning("nothing-drawn", where.span, "of no pair 'where' holds", hint)
            return
        reason = None if pattern is None else empty_reason(pattern, self.formulas)
        if reason is None:
            findings.error("no-connection", self.key.span, "this entry makes no connection at all")
        else:
            findings.warning("nothing-drawn", self.key.span, *reason)

    def _fits(self, count: int) -> bool:
        """Whether there is room for so many connections; a finding where there is not."""
        room, limit = self.context.room, self.context.limits.connections
        count *= 1 + self.symmetric
        if count <= room:
            return True
        message = f"this makes {amount(limit - room + count)} connections; the limit is {limit:,}"
        self.constants.findings.error("too-many", self.key.span, message, "raise it with --limit")
        return False

    def _may_fit(self, least: int) -> bool:
        """The same before the pairs are made, of which there are ``least``: within a group those of a symmetric entry
        are halved, and none of a neuron with itself is kept."""
        sources, targets = self.sources, self.targets
        if sources is UNKNOWN or targets is UNKNOWN or not self.symmetric:
            return self._fits(least)
        if np.array_equal(sources, targets):
            least = max(least - len(sources), 0) // 2
        return self._fits(least)

    def _given(self, matrix: Matrix) -> GivenMatrix | Unknown:
        """A matrix as it is written, here or, where it is one of the module, there or where it is set."""
        scope = self.context.scope
        if not isinstance(matrix, MatrixName):
            return GivenMatrix(matrix, self.constants, scope.files)
        found, name = scope.matrices.get(matrix.name.value), matrix.name.value
        self.context.read.add(name)
        if found is not None:
            return found
        hint = suggest(name, scope.matrices, "matrices of the module") if scope.matrices else None
        hint = hint or "write rows, [[1, 2], [3, 4]], or {file: …}; a module may declare 'matrices'"
        self.constants.findings.error("unknown-matrix", matrix.span, f"there is no matrix '{shorten(name)}'", hint)
        return UNKNOWN

    def _grid(self, matrix: Matrix, purpose: str) -> Grid | Unknown:
        """A matrix of this entry, sources as rows; UNKNOWN where it is invalid. The structure depends on what formulas
        read in one that is set from around the module."""
        by_target = self.body.rows is not None and self.body.rows.value == "to"
        n = UNKNOWN if self.sources is UNKNOWN or not self._is_sound("rows") else len(self.sources)
        m = UNKNOWN if self.targets is UNKNOWN or not self._is_sound("rows") else len(self.targets)
        given = self._given(matrix)
        if given is UNKNOWN:
            return UNKNOWN
        written, constants, files = given
        if constants is self.constants:
            return grid_of(written, n, m, by_target, constants, files, self._stream(purpose))
        with constants.following() as parts:
            grid = grid_of(written, n, m, by_target, constants, files, self._stream(purpose))
        constants.depend_on(parts)
        return grid

    def _parts_per_connection(
        self, grid: Grid | Unknown | None, parts: list[Part], shape: _Shape | Unknown
    ) -> tuple[Part, ...]:
        """The parts of a matrix, whose places are its cells as they are written, with connections as their places."""
        if grid is None or grid is UNKNOWN or shape is UNKNOWN or not parts:
            return ()
        by_target = self.body.rows is not None and self.body.rows.value == "to"
        connection_at = np.full(grid.shape, -1, dtype=np.int64)  # −1: no connection
        connection_at[shape.i, shape.j] = np.arange(len(shape.i))
        connection_of_cell = (connection_at.T if by_target else connection_at).ravel()
        return tuple(_moved_to(part, connection_of_cell[part.within(connection_of_cell.size)]) for part in parts)

    def _shape(self, centre: Grid | Unknown | None) -> _Shape | Unknown:
        """The pairs; every key that may say which they are is checked."""
        body = self.body
        with self.constants.following() as cell_parts:
            grid = UNKNOWN if body.matrix is None else self._grid(body.matrix, "weight")
        edges = UNKNOWN if body.edges is None else self._edges()
        if isinstance(body.weight, Tie):
            return self._tied_to(body.weight)
        pattern = UNKNOWN if body.pattern is None else self._pattern()
        where = UNKNOWN if body.where is None or body.pattern is not None else self._where(body.where)
        if self.sources is UNKNOWN or self.targets is UNKNOWN or not self._is_sound(*_SHAPING):
            return UNKNOWN
        if body.edges is not None:
            return edges
        if body.matrix is not None:
            if grid is UNKNOWN or centre is UNKNOWN:
                return UNKNOWN
            present = grid.present if centre is None else grid.present & centre.present
            shape = _cells_of(present, grid.values)
            return shape._replace(parts=self._parts_per_connection(grid, cell_parts, shape))
        if isinstance(body.centre, (MatrixRows, FileReference)):
            if centre is None or centre is UNKNOWN:
                return UNKNOWN
            return _cells_of(centre.present, centre.values)._replace(weights=None)
        return pattern if body.pattern is not None else self._all_pairs() if body.where is None else where

    def _tied_to(self, tie: Tie) -> _Shape | Unknown:
        """The pairs of the entry that has the weights, with these."""
        tied = tied_to(tie, (self.sources, self.targets), self.context.originals, self.constants.findings)
        if tied is UNKNOWN:
            return UNKNOWN
        inverse, other = np.argsort(tied.places), tied.original
        parts = (part for part in other.parts if part.field in ("weights", "initial_weights"))
        moved = tuple(_moved_to(part, inverse[part.within(len(inverse))]) for part in parts)
        return _Shape(tied.i, tied.j, other.weights[tied.places], None, moved, tied=tied)

    def _ends(self) -> Ends | Unknown:
        if self.sources is UNKNOWN or self.targets is UNKNOWN or not self._is_sound("self"):
            return UNKNOWN
        loops: bool | None = True if len(self.sources) == len(self.targets) == 1 else None
        loops = loops if self.body.self is None else self.body.self.value
        position = self.context.census.neurons.position
        return Ends(self.sources, self.targets, loops, position[self.sources], position[self.targets])

    def _pattern(self) -> _Shape | Unknown:
        """The pairs of a pattern. Some patterns connect by position, so ends with an invalid one are not known."""
        assert self.body.pattern is not None
        everything = self.body.pattern.name.value == "all_to_all" and not self.body.pattern.settings.entries
        if self.body.where is not None and everything:
            return self._where(self.body.where)
        ends = UNKNOWN if self.formulas.misplaced else self._ends()
        pairs = pairs_of(self.body.pattern, ends, self.formulas, self._stream, self._may_fit)
        if ends is not UNKNOWN and self.body.pattern.name.value == "nearest":  # what places neurons is structural then
            self.context.census.go_by_position(np.concatenate((ends.sources, ends.targets)))
        shape = UNKNOWN if pairs is UNKNOWN else _shape_of(narrow(pairs[0]), narrow(pairs[1]))
        return shape if self.body.where is None else self._some_where(shape, self.body.where)

    def _where(self, condition: Formula) -> _Shape | Unknown:
        """Of all pairs those of which a condition holds."""
        ends, rows = self._ends(), self.formulas.rows(condition, WHICH)
        pairs = UNKNOWN if ends is UNKNOWN or rows is UNKNOWN else pairs_where(ends, rows, self._may_fit)
        return UNKNOWN if pairs is UNKNOWN else _Shape(*pairs)

    def _some_where(self, shape: _Shape | Unknown, condition: Formula) -> _Shape | Unknown:
        """Of the pairs of a pattern those of which a condition holds."""
        pattern = PATTERNS.get(self.body.pattern.name.value) if self.body.pattern is not None else None
        if pattern is not None and pattern.counts:
            message = f"'where' beside '{pattern.name}', which counts the connections that it makes"
            hint = "leave 'where' out, or take a probability: random: {probability: p if … else 0}"
            self.constants.findings.error("conflicting-keys", condition.span, message, hint)
            shape = UNKNOWN
        at = UNKNOWN if shape is UNKNOWN else At(shape.i, shape.j)
        holds = self.formulas.structural(condition, WHICH, at, self._stream("edges"))
        return UNKNOWN if holds is UNKNOWN or shape is UNKNOWN else shape.some(np.flatnonzero(holds))

    def _all_pairs(self) -> _Shape | Unknown:
        """All pairs, where nothing says which."""
        ends = self._ends()
        if ends is UNKNOWN:
            return UNKNOWN
        n, m = len(ends.sources), len(ends.targets)
        if n > 1 and m > 1 and self._may_be_a_matrix():
            return UNKNOWN
        if n > 1 and m > 1:
            message = f"{n} neurons to {m} neurons: how are they connected?"
            hint = "add pattern: all_to_all, or pattern: one_to_one, or a matrix"
            self.constants.findings.error("pattern-missing", self.key.span, message, hint)
            return UNKNOWN
        return _Shape(*all_to_all(ends))

    def _may_be_a_matrix(self) -> bool:
        """Whether what is given as the weight, and was refused, may have been meant to say who is connected."""
        weight = self.body.source.get("weight")
        return not self._is_sound("weight") and not (isinstance(weight, Scalar) and isinstance(weight.value, str))

    def _edges(self) -> _Shape | Unknown:
        assert self.body.edges is not None
        called, path = self.context.census.neurons.names, len(self.context.scope.called(""))
        census = self.context.census
        sources, targets = (
            End(
                neurons if census.ids_known else UNKNOWN,
                self.context.directory,
                called,
                path,
                census.by_id,
                not census.ids_known,
            )
            for neurons in (self.sources, self.targets)
        )
        reader = EdgeReader(
            sources, targets, self.constants, self.context.scope.files, self._stream("weight"), self.context.room
        )
        written, label = self.body.edges, self.body.label
        if isinstance(written, EdgeFile):
            texts = (label.name,) if isinstance(label, EdgeTexts) else ()
            style = self.context.style
            perhaps = () if style is None else (style,)
            written = written._replace(more=self._further_columns(), texts=texts, perhaps=perhaps)
        with self.constants.following() as parts:
            edges = reader.read(written)
        if edges is UNKNOWN:
            return UNKNOWN
        return _Shape(edges.i, edges.j, edges.weights, edges.delays, tuple(parts), edges.columns)

    def _further_columns(self) -> tuple[Located[str], ...]:
        """The columns of the edges that settings of the synapse and of the rules name, each once."""
        choices = *self.body.plasticity, *(() if self.body.synapse is None else (self.body.synapse,))
        found = (name for choice in choices for name in columns_of_edges(choice.settings))
        return tuple({name.value: name for name in found}.values())

    def _labels(self, shape: _Shape | Unknown) -> Texts | Unknown | None:
        """What each connection is called in pictures; None where they are called as the entry is."""
        label, findings = self.body.label, self.constants.findings
        if not isinstance(label, EdgeTexts):
            return None
        if not isinstance(self.body.edges, EdgeFile):
            if self._is_sound("edges"):
                report_no_file(label.span, findings)
            return UNKNOWN
        if shape is UNKNOWN or shape.columns is None:
            return UNKNOWN
        found = shape.columns.texts[label.name.value]
        for text in found.used:
            if not check_length(Located(text, label.name.node), findings):
                return UNKNOWN
        return found

    def _table(self, shape: _Shape | Unknown) -> Callable[[Mapping], FloatArray | Unknown]:
        """What a mapping means as the value of a setting of connections: a column of their edges."""

        def value(node: Mapping) -> FloatArray | Unknown:
            column, findings = edge_column(node, self.constants.findings), self.constants.findings
            if column is UNKNOWN or not self._is_sound("edges"):
                return UNKNOWN
            if not isinstance(self.body.edges, EdgeFile):
                report_no_file(node.span, findings)
                return UNKNOWN
            return UNKNOWN if shape is UNKNOWN or shape.columns is None else shape.columns.value(column, findings)

        return value

    def _written_delays(self, shape: _Shape | Unknown) -> Delays | Unknown | None:
        """What the entry says of its delays, of every pair; None where it says nothing. The structure depends on it."""
        written = self.body.delay
        if written is None:
            return None
        with self.constants.following() as parts:
            found = self._pair_delays(written, shape)
        self.constants.depend_on(parts)
        return found

    def _pair_delays(self, written: Delay, shape: _Shape | Unknown) -> Delays | Unknown:
        """Delays in a matrix, by a formula of each pair, or all the same."""
        reader, drawn = DelayReader(self.constants), False
        if isinstance(written.value, Located):
            tree = self.constants.tree(written.value, _PAIR)
            if tree is UNKNOWN:
                return UNKNOWN
            drawn = bool(draws(tree))
            if not (drawn or any(name in _PAIR.sees or "." in name for name in names(tree))):
                return self._same_delay(written.value, written.in_seconds, shape)
            self.formulas.go_by(names(tree))
            values = self._values(written.value, shape, "delay")
        else:
            given = self._given(written.value)
            grid, drawn = self._grid(written.value, "delay"), given is not UNKNOWN and draws_any(given.written)
            values = UNKNOWN if grid is UNKNOWN or shape is UNKNOWN else grid.values[shape.i, shape.j]
        if values is UNKNOWN or shape is UNKNOWN or self.sources is UNKNOWN or self.targets is UNKNOWN:
            return UNKNOWN
        called = partial(self._called, shape)
        return reader.each(values, written.span, written.in_seconds, drawn, called)

    def _called(self, shape: _Shape, pair: int) -> str:
        return self.formulas.called(int(shape.i[pair]), int(shape.j[pair]))

    def _same_delay(self, formula: Formula, in_seconds: bool, shape: _Shape | Unknown) -> Delays | Unknown:
        """A delay that all connections have."""
        found = DelayReader(self.constants).single(formula, in_seconds)
        if found is UNKNOWN or shape is UNKNOWN:
            return UNKNOWN
        steps, exact = (np.broadcast_to(np.asarray(one), shape.i.shape) for one in found)
        if not in_seconds:
            return Delays(steps)
        return Delays(steps, exact, (Timed(formula.span, text_of(formula)),))

    def _values(self, formula: Formula, shape: _Shape | Unknown, purpose: str) -> FloatArray | Unknown:
        """The values of a formula, one for every pair."""
        at = UNKNOWN if shape is UNKNOWN else At(shape.i, shape.j, shape.copy)
        return self.formulas.values(formula, _PAIR, at, self._stream(purpose))

    def _weights(self, shape: _Shape | Unknown) -> FloatArray | Unknown:
        """The weight of every pair, scaled where the entry has a ``scale``."""
        if self.body.scale is None:
            weights = self._plain_weights(shape)
            return weights if self._is_sound("scale") else UNKNOWN
        with self.constants.following() as parts:
            weights = self._plain_weights(shape)
        if weights is UNKNOWN or shape is UNKNOWN or self.sources is UNKNOWN or self.targets is UNKNOWN:
            check_scale(self.body.scale, self.constants)
            return UNKNOWN
        ends, pairs = (self.sources, self.targets), (shape.i, shape.j)
        scale = Scaled(Assembled(weights, tuple(parts)), self.body.scale, ends, pairs, self.constants)
        if scale.slots:
            self.constants.follow([Part(scale)])
        with self.constants.following():  # dropped: ``Part(scale)`` says all that the weights follow
            return scaled(self.body.scale, weights, ends, pairs, self.constants)

    def _plain_weights(self, shape: _Shape | Unknown) -> FloatArray | Unknown:
        """The weights before they are scaled."""
        if self.body.weight is not None and not isinstance(self.body.weight, Tie):
            return self._values(self.body.weight, shape, "weight")
        if shape is UNKNOWN:
            return UNKNOWN
        if shape.weights is None:
            return np.broadcast_to(1.0, shape.i.shape) if self._is_sound("weight") else UNKNOWN
        self.constants.follow(shape.parts)
        return shape.weights

    def _centres(self, grid: Grid | Unknown | None, shape: _Shape | Unknown) -> FloatArray | Unknown:
        """The centre of every pair: by a formula, from the ``grid`` where it is a matrix, else 0."""
        centre = self.body.centre
        if centre is None:
            return UNKNOWN if shape is UNKNOWN else np.broadcast_to(0.0, shape.i.shape)
        if self._measures_distance() is False:
            entry = self.body.source.entry("centre")
            span = self.key.span if entry is None else entry.key.span
            message = "'centre' has no effect: none of the targets combines by distance"
            self.constants.findings.error("useless-key", span, message, "give the targets combine: distance")
        if isinstance(centre, Located):
            return self._values(centre, shape, "centre")
        if grid is None or grid is UNKNOWN or shape is UNKNOWN:
            return UNKNOWN
        return np.ascontiguousarray(grid.values[shape.i, shape.j])

    def _measures_distance(self) -> bool | Unknown:
        """Whether any of the targets combines what arrives by distance."""
        return self._combine_by("distance")

    def _combine_by(self, how: Combine) -> bool | Unknown:
        """Whether any of the targets combines what arrives in this way; UNKNOWN where it may, since what it says of
        that is invalid."""
        aims = self._aims
        if aims is UNKNOWN or self.route is UNKNOWN:
            return UNKNOWN
        ports, groups = [name for name, _ in self.route.ports], self.context.census.groups_of(aims)
        declared = (port for one in groups for port in one.kind.model.definition.ports)
        at_drive = [one for one in groups if DRIVE in ports]
        if any(port.combine == how and port.name in ports for port in declared):
            return True
        if any(one.group.combine == how for one in at_drive):
            return True
        return UNKNOWN if any("combine" in one.model.unknown for one in at_drive) else False

    def _bounds(self, weights: FloatArray | Unknown) -> tuple[float, float] | Unknown:
        """The bounds of the weights. A bound that follows parameters is followed together with the other one, so that
        low ≤ high can be checked when either is set."""
        bounds = self.body.bounds
        if bounds is None:
            return (-np.inf, np.inf)
        findings = self.constants.findings
        with self.constants.following() as lower:
            low = self.constants.scalar(bounds.first)
        with self.constants.following() as upper:
            high = self.constants.scalar(bounds.second)
        if low is UNKNOWN or high is UNKNOWN:
            return UNKNOWN
        if lower or upper:
            high_bound = Assembled(np.array(high), tuple(upper))
            lower = lower or [Part(Assembled(np.array(low), ()))]  # a number, to be compared when the other one is set
            self.constants.follow(part._replace(field="low", high=high_bound) for part in lower)
            self.constants.follow(part._replace(field="high") for part in upper)
        if low > high:
            findings.error("out-of-range", bounds.span, f"the lower bound {low:g} is above the upper one {high:g}")
            return UNKNOWN
        if weights is not UNKNOWN and ((weights < low) | (weights > high)).any():
            first = weights[(weights < low) | (weights > high)][0]
            message = f"the first weight {first:g} lies outside the bounds {low:g} to {high:g}"
            findings.error("weight-outside", bounds.span, message)
            return UNKNOWN
        return (low, high)

    def _rules(self, shape: _Shape | Unknown) -> tuple[Learning, ...] | Unknown:
        """What the entry learns by, rule by rule."""
        if not self.body.plasticity:
            return ()
        place = Place(
            self._connection_ends(shape),
            sources=UNKNOWN if self.sources is UNKNOWN else len(self.sources),
            targets=UNKNOWN if self.targets is UNKNOWN else len(self.targets),
            scope=self.context.scope,
            directory=self.context.directory,
            census=self.context.census,
            table=self._table(shape),
        )
        rules = rules_of(self.body.plasticity, place)
        if rules is not UNKNOWN:
            self._check_centres(rules)
        return rules

    def _check_centres(self, rules: tuple[Learning, ...]) -> None:
        """That what rules change has an effect, and that bounds have something to hold."""
        findings, moving = self.constants.findings, [one.rule.moves_centre for one in rules]
        for choice, learning in zip(self.body.plasticity, rules, strict=True):
            if learning.rule.moves_centre and self._measures_distance() is False:
                message = f"'{learning.rule.name}' changes centres, and none of the targets combines by distance"
                findings.error("useless-key", choice.name.span, message, "give the targets combine: distance")
        if rules and all(moving) and self.body.bounds is not None:
            message = "'bounds' hold plastic weights, and what learns here are centres"
            hint = "bounds of a centre stand in its rule, as in clip(centre + …, 0, 1)"
            findings.error("useless-key", self.body.bounds.span, message, hint)

    def _connection_ends(self, shape: _Shape | Unknown) -> ConnectionEnds | Unknown:
        """Which of both ends the connections join, for the settings of rules and synapses."""
        if shape is UNKNOWN or self.sources is UNKNOWN or self.targets is UNKNOWN:
            return UNKNOWN
        i, j = shape.i.astype(np.int64), shape.j.astype(np.int64)  # formulas compute with them
        return ConnectionEnds(i, j, len(self.sources), len(self.targets))

    def _synapse(self, shape: _Shape | Unknown) -> Settled | Unknown | None:
        """What the connections bring in place of the weight times what is sent; None without a synapse."""
        choice = self.body.synapse
        if choice is None:
            return None
        if self._measures_distance() is True:
            message = "a synapse brings a signal, and there is nothing that a distance would be measured from"
            hint = "leave the synapse out, or let the targets combine by sum or product"
            self.constants.findings.error("synapse-at-distance", choice.name.span, message, hint)
        ends = self._connection_ends(shape)
        each = Each(
            "connection",
            dict.fromkeys(_SETTING.sees, UNKNOWN) if ends is UNKNOWN else ends._asdict(),
            self._table(shape),
        )
        count = UNKNOWN if ends is UNKNOWN else len(ends.i)
        settled = settled_of(choice, SYNAPSE, self.context.scope.definitions, self.constants, each, count)
        if settled is UNKNOWN or not settled.sound or not check_initials(settled, choice, self.constants):
            return UNKNOWN
        if settled.definition.shared:
            check_shared(settled, choice.name.span, self.constants.findings)
            if self._combine_by("product") is True:
                message = "a shared synapse brings the sum of what its connections bring, and a target multiplies that"
                hint = "let the targets combine by sum, or leave 'shared' out of the synapse"
                self.constants.findings.error("shared-not-linear", choice.name.span, message, hint)
        return settled

    def _uses(self, rules: tuple[Learning, ...], synapse: Settled | None, at: Joined) -> tuple[InUse, ...] | Unknown:
        """The rules and the synapse, with what they read of both ends."""
        findings = self.constants.findings
        found: list[InUse | Unknown] = []
        for place, (choice, learning) in enumerate(zip(self.body.plasticity, rules, strict=False)):
            rule = in_use(learning.settled, choice.name.span, at, findings)
            found.append(rule if rule is UNKNOWN else rule._replace(signals=learning.signals, place=place))
        if synapse is not None and self.body.synapse is not None:
            span = self.body.synapse.name.span
            found.append(in_use(synapse, span, at, findings))
            taken = {one.name: learning.rule.name for learning in rules for one in learning.rule.state}
            for state in (one.name for one in synapse.definition.state if one.name in taken):
                message = f"the synapse and the rule '{taken[state]}' both have a state '{state}'"
                hint = "states of a connection have different names: rename it in one of them"
                findings.error("duplicate-name", span, message, hint)
            if SYNAPSE.gives in taken:
                message = f"the rule '{taken[SYNAPSE.gives]}' has a state '{SYNAPSE.gives}', which the synapse gives"
                findings.error("duplicate-name", span, message, "rename it in the rule")
        known = tuple(one for one in found if one is not UNKNOWN)
        return known if len(known) == len(found) else UNKNOWN


def report_no_file(span: Span, findings: Findings) -> None:
    """Report a column of edges at an entry that reads none of a file."""
    message = "'column' is one of the file of an entry's edges, and this entry has none"
    findings.error("useless-key", span, message, "write edges: {file: …}")


def _of_both(one: Indices | Unknown, other: Indices | Unknown) -> Indices | Unknown:
    """The neurons of both ends."""
    return UNKNOWN if one is UNKNOWN or other is UNKNOWN else np.union1d(one, other)


def _delays(shape: _Shape, written: Delays | Unknown | None, unsaid: int | Indices) -> Delays:
    """The delay of each connection: that of its edge, where it has one, else that of the entry, else as it is where
    nothing is said. An invalid one is 1: at 0 it could close a cycle."""
    otherwise = 1 if written is UNKNOWN else unsaid
    result = Delays(np.broadcast_to(np.asarray(otherwise, dtype=np.int64), shape.i.shape))
    for given in (known(written, None), shape.delays):
        result = result if given is None else given.over(result)
    return result


def _shape_of(i: Indices, j: Indices) -> _Shape:
    """The pairs of a pattern, row by row; what is drawn for one that is there several times differs."""
    again = (i[1:] == i[:-1]) & (j[1:] == j[:-1])
    if not again.any():
        return _Shape(i, j)
    place = np.arange(len(i), dtype=np.int64)
    first = np.maximum.accumulate(np.where(np.concatenate(([True], ~again)), place, 0))
    return _Shape(i, j, copy=place - first)


def _cells_of(present: BoolArray, values: FloatArray) -> _Shape:
    """The cells of a matrix that are there, row by row, and what is in them."""
    n, m = present.shape
    if present.all():
        return _Shape(np.repeat(counted(n), m), np.tile(counted(m), n), np.ascontiguousarray(values).reshape(-1))
    i, j = map(narrow, np.nonzero(present))
    return _Shape(i, j, values[i, j])


def _moved_to(part: Part, places: IntArray) -> Part:
    """The part with its numbers at these places, without those that stand at none (−1)."""
    inside = np.flatnonzero(places >= 0)
    if len(inside) < len(places):
        part = part.subset(inside)
    return part._replace(places=places[inside])
