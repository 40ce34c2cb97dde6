"""Formulas of pairs: what weights, delays, centres, probabilities, counts and conditions of an entry see of the two
neurons of a pair.

In: a formula and positions of pairs within the ends. Out: its numbers, which follow in a run what they were made from.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray
from neurovis_spec.compiler.connections.ends import counted
from neurovis_spec.compiler.events.settable import Dependent, Distance, Part, apart
from neurovis_spec.compiler.limits import amount
from neurovis_spec.compiler.neurons.groups import is_written
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import MODEL
from neurovis_spec.compiler.values.constants import Constants, Randomness, Value, check_finite
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.diagnostics import Home, Span, Undeclared, shorten
from neurovis_spec.language.expressions.tree import Name, Tree, draws, names, walk
from neurovis_spec.language.grammar import WHICH, Role
from neurovis_spec.language.located import Formula
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.likeness import suggest

#: What differs from pair to pair.
_OF_A_PAIR = ("i", "j", "distance")
#: Numbers of pairs that are made at once.
_CELLS = 1 << 18


class At(NamedTuple):
    """Pairs, by the positions of their neurons within the ends, which broadcast. One of both is None where a number is
    of a neuron and not of a pair. ``copy`` numbers the connections of a pair that has several."""

    i: Indices | None
    j: Indices | None
    copy: int | Indices = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """That of the numbers."""
        return np.broadcast_shapes(*(one.shape for one in (self.i, self.j) if one is not None))


class Rows(NamedTuple):
    """The numbers of all pairs of ``n`` sources and ``m`` targets: ``made`` of some rows, (rows, m), UNKNOWN where they
    are invalid, which is reported."""

    made: Callable[[slice], FloatArray | Unknown]
    n: int
    m: int

    def blocks(self) -> Iterator[tuple[IntArray, FloatArray | Unknown]]:
        """Some rows at a time, with their numbers, as many as stay in a processor's cache."""
        together = max(1, _CELLS // max(self.m, 1))
        for start in range(0, self.n, together):
            rows = np.arange(start, min(start + together, self.n), dtype=np.int64)
            yield rows, self.made(slice(start, start + together))


@dataclass(frozen=True)
class PairFormulas:
    """Evaluates the formulas of an entry over pairs of its neurons."""

    sources: Indices | Unknown
    targets: Indices | Unknown
    census: Census
    constants: Constants
    #: how many pairs may be looked at, for those that there are
    most: int

    def values(self, formula: Formula, role: Role, at: At | Unknown, stream: Stream) -> FloatArray | Unknown:
        """What a formula is at each pair, of the names that its ``role`` sees."""
        tree = self._tree(formula, role, at)
        if tree is UNKNOWN or at is UNKNOWN:
            return UNKNOWN
        extra, moving = self._seen(role, at, names(tree)), self._moving(names(tree), at)
        i, j = (0 if one is None else one for one in at[:2])
        randomness = Randomness(stream, i, j, at.copy) if role.draws else None
        with self.constants.following() as parts:
            value = self.constants.value(formula, extra, randomness)
        if moving:  # the collected parts have numbers where something follows parameters, too
            parts = [Part(self.constants.bound(tree, {**extra, **moving}, randomness))]
        self.constants.follow(parts)
        return UNKNOWN if value is UNKNOWN else np.broadcast_to(np.asarray(value, dtype=np.float64), at.shape)

    def structural(self, formula: Formula, role: Role, at: At | Unknown, stream: Stream) -> FloatArray | Unknown:
        """The same of what the structure depends on."""
        with self.constants.following() as parts:
            values = self.values(formula, role, at, stream)
        self.constants.depend_on(parts)
        tree = self.constants.tree(formula, role) if values is not UNKNOWN else UNKNOWN
        if tree is not UNKNOWN:
            self.go_by(names(tree))
        return values

    def rows(self, formula: Formula, role: Role) -> Rows | Unknown:
        """A formula over all pairs, a few rows at a time, on which the structure depends."""
        if self.sources is UNKNOWN or self.targets is UNKNOWN:
            self._tree(formula, role, UNKNOWN)
            return UNKNOWN
        i, j = counted(len(self.sources))[:, None], counted(len(self.targets))[None]
        tree = self._tree(formula, role, At(i, j))
        if tree is UNKNOWN:
            return UNKNOWN
        looked_at = len(self.sources) * len(self.targets)
        if looked_at > self.most:
            message = f"this looks at {amount(looked_at)} pairs; the limit is {self.most:,}"
            hint = "name fewer neurons, or raise it with --limit, a hundred pairs a connection"
            self.constants.findings.error("too-many", formula.span, message, hint)
            return UNKNOWN
        used = names(tree)
        self.go_by(used)
        self.constants.depend(used)

        def made(some: slice) -> FloatArray | Unknown:
            at = At(i[some], j)
            value = self.constants.evaluated(tree, self._seen(role, at, used))
            if not check_finite(value, formula, self.constants.findings):
                return UNKNOWN
            return np.broadcast_to(np.asarray(value, dtype=np.float64), at.shape)

        return Rows(made, len(self.sources), len(self.targets))

    def differs(self, formula: Formula, role: Role) -> bool:
        """Whether what a formula is depends on the pair or the neuron that it is of, or is drawn."""
        if not isinstance(formula.value, str):
            return False
        tree = self.constants.tree(formula, role)
        if tree is UNKNOWN:
            return True
        return bool(draws(tree)) or any(name in _OF_A_PAIR or "." in name for name in names(tree))

    def sizes(self, role: Role) -> dict[str, Value | Unknown]:
        """How many neurons there are at both ends, as far as a role sees it."""
        ends = (("n_from", self.sources), ("n_to", self.targets))
        return {name: UNKNOWN if end is UNKNOWN else float(len(end)) for name, end in ends if name in role.sees}

    def go_by(self, used: Collection[str]) -> None:
        """What these names read of the ends is structural, since something that is does depend on it."""
        for side, end in (("pre.", self.sources), ("post.", self.targets)):
            neurons = np.zeros(0, dtype=np.int64) if end is UNKNOWN else end.astype(np.int64)
            if "distance" in used:
                self.census.go_by_position(neurons)
            for name in used:
                if name.startswith(side):
                    self.census.go_by_parameter(name.removeprefix(side), neurons)

    @property
    def misplaced(self) -> bool:
        """Whether what the spec says of a position of these neurons is invalid."""
        ends = (self.sources, self.targets)
        return any(end is not UNKNOWN and bool(self.census.misplaced[end].any()) for end in ends)

    def called(self, i: int, j: int) -> str:
        """The name of a pair, for a finding."""
        return f"{self.neuron(i, at_source=True)} -> {self.neuron(j, at_source=False)}"

    def neuron(self, place: int, at_source: bool) -> str:
        """The name of a neuron of an end."""
        end = self.sources if at_source else self.targets
        assert end is not UNKNOWN
        return self.census.neurons.names[int(end[place])]

    def _tree(self, formula: Formula, role: Role, at: At | Unknown) -> Tree | Unknown:
        """A formula of which each name means something at all of these pairs."""
        tree = self.constants.tree(formula, role)
        if tree is UNKNOWN:
            return UNKNOWN
        of_ends = [node for node in walk(tree) if isinstance(node, Name) and "." in node.name]
        if at is UNKNOWN or self.sources is UNKNOWN or self.targets is UNKNOWN:
            unknown = (*role.sees, *(node.name for node in of_ends))
            self.constants.value(formula, dict.fromkeys(unknown, UNKNOWN), UNKNOWN if role.draws else None)
            return UNKNOWN
        if "distance" in names(tree):
            if self.misplaced:
                return UNKNOWN
            if not all(np.isfinite(self.census.neurons.position[end]).all() for end in self._reached(at)):
                message = "'distance' needs a position of every neuron of both ends"
                self.constants.findings.error("no-position", formula.span, message, "give the groups a 'position'")
                return UNKNOWN
        sound = all(self._has(node.name, formula.node.at(node.start, node.end), at) for node in of_ends)
        return tree if sound else UNKNOWN

    def _seen(self, role: Role, at: At, used: Collection[str]) -> dict[str, Value]:
        """What a formula knows beside parameters."""
        assert self.sources is not UNKNOWN
        assert self.targets is not UNKNOWN
        extra: dict[str, Value] = {"n_from": float(len(self.sources)), "n_to": float(len(self.targets))}
        for name, positions in (("i", at.i), ("j", at.j)):  # what nobody reads takes no room
            if name in role.sees:
                extra[name] = 0.0 if positions is None or name not in used else positions.astype(np.float64)
        if "distance" in used:
            with np.errstate(over="ignore"):  # what is then infinite is found where it matters
                # which pairs there are is the same on every machine
                measure = self.census.straight if role == WHICH else partial(apart, self.census.neurons.position)
                extra["distance"] = measure(*self._reached(at))
        for name in used:
            side, point, parameter = name.partition(".")
            if point:
                extra[name] = self.census.parameter(parameter)[self._at_end(side, at)]
        return extra

    def _reached(self, at: At) -> tuple[Indices, Indices]:
        """The neurons of some pairs."""
        return self._at_end("pre", at), self._at_end("post", at)

    def _moving(self, used: Collection[str], at: At) -> dict[str, Dependent]:
        """Of the names that a formula uses those that follow parameters, though no parameter is named in it."""
        found: dict[str, Dependent] = {}
        if "distance" in used:
            sources, targets = (end.astype(np.int64) for end in self._reached(at))
            found["distance"] = Distance(self.census.moving, sources, targets, self.census.neurons.position.shape[1])
        for name in used:
            side, point, parameter = name.partition(".")
            if point:
                found[name] = self.census.followed(parameter, self._at_end(side, at).astype(np.int64))
        return {name: one for name, one in found.items() if one.slots}

    def _at_end(self, side: str, at: At) -> Indices:
        """The neurons at one end of some pairs."""
        neurons, places = (self.sources, at.i) if side == "pre" else (self.targets, at.j)
        assert neurons is not UNKNOWN
        assert places is not None
        return neurons[places]

    def _has(self, name: str, span: Span, at: At) -> bool:
        """Whether the models at the end that ``pre.tau`` or ``post.tau`` is of have this parameter; a finding where one
        has not."""
        side, _, parameter = name.partition(".")
        if (at.i if side == "pre" else at.j) is None:
            here, other = ("target", "post") if side == "pre" else ("source", "pre")
            hint = f"this is a number of each {here}, which sees {other}.{shorten(parameter)}"
            self.constants.findings.error("unknown-name", span, f"'{shorten(name)}' is not known here", hint)
            return False
        for one in self.census.groups_of(self._at_end(side, at).ravel()):
            model = one.kind.model
            if not (is_written(one.kind, one.model) and model.sound):
                return False
            if parameter not in model.parameters:
                message = f"the model '{model.definition.name}' of '{one.name}' has no parameter '{shorten(parameter)}'"
                hint_of = partial(suggest, parameter, model.definition.parameters, "it has")
                lost = Undeclared(parameter, Home((MODEL.section, model.definition.name), ("parameters",)))
                self.constants.findings.error("unknown-name", span, message, hint_of, undeclared=lost)
                return False
        return True
