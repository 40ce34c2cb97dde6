"""The census: how many instances and neurons a spec makes, counted before any of them is made.

In: a section, its Constants, the modules. Out: a Tally, or an Excess. Modules within modules multiply, so that a few
lines can ask for more than any machine holds. Modules are gone through from the outside in, each of them
once, with an array for each parameter that its counts depend on: one value for all instances that are made alike. What
is invalid counts as nothing here, and is found where the instances are made.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from graphlib import TopologicalSorter
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.limits import MOST_INSTANCES, amount
from neurovis_spec.compiler.names.modules import Module
from neurovis_spec.compiler.names.references import Section, key_span
from neurovis_spec.compiler.values.constants import Constants, Value
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.expressions.parser import ExpressionError, parse
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.located import Formula
from neurovis_spec.language.modules import InstanceModel, ModuleModel
from neurovis_spec.language.sections import GroupModel

#: Counts beyond this are all the same; their product with as many is a number, too.
_HUGE = 1e100


class TooManyError(Exception):
    """There are more instances than there may be, however many."""


class Tally(NamedTuple):
    """How many instances there are, and neurons in them; and the first group of which one alone has too many, if any,
    by its ``count``, with that number."""

    instances: int = 0
    neurons: int = 0
    large: tuple[Formula, int] | None = None


class Excess(NamedTuple):
    """What there is too much of, and where that is asked for; nothing where the finding is that of a group."""

    span: Span | None = None
    message: str = ""
    hint: str | None = None


class _Alike(NamedTuple):
    """Instances of a module: a row for those that are alike, what is set in them, how many they are."""

    set: Mapping[str, FloatArray]
    many: FloatArray

    @staticmethod
    def joined(parts: list[_Alike]) -> _Alike:
        """All parts, in which the same parameters are set; equal rows as one."""
        keys = tuple(parts[0].set)
        many = np.concatenate([part.many for part in parts])
        if not keys:
            return _Alike({}, many.sum(keepdims=True))
        table = np.column_stack([np.concatenate([part.set[key] for part in parts]) for key in keys])
        rows, places = np.unique(table, axis=0, return_inverse=True)
        return _Alike(dict(zip(keys, rows.T, strict=True)), np.bincount(places.ravel(), many).astype(np.float64))


@dataclass
class _Count:
    """One count under way: what was counted, and what is still to be, by module and by what is set in it."""

    instances: float = 0
    neurons: float = 0
    waiting: dict[str, dict[tuple[str, ...], list[_Alike]]] = field(default_factory=dict)
    #: instances that were checked one by one: each of them is made at least once
    seen: int = 0
    large: tuple[Formula, int] | None = None

    def tally(self) -> Tally:
        """What was counted."""
        return Tally(int(min(self.instances, _HUGE)), int(min(self.neurons, _HUGE)), self.large)


class SizeEstimate:
    """Counts the instances of modules, none of which holds itself. ``most`` neurons are not too many."""

    def __init__(self, modules: Mapping[str, Module], dt: float, most: int) -> None:
        self._modules = modules
        self._dt = dt
        self._most = most
        inner = {name: [used for used in _used(module.model) if used in modules] for name, module in modules.items()}
        inside_out = tuple(TopologicalSorter(inner).static_order())
        self._order = inside_out[::-1]
        self._wanted: dict[str, frozenset[str]] = {}
        for name in inside_out:
            self._wanted[name] = self._depends(modules[name].model)

    def check(self, section: Section, constants: Constants) -> Tally | Excess:
        """What a section makes with all that is within it, or the first of its instances that are too many, for the
        instances before it or its own neurons."""
        entries = tuple(section.instances.items())
        own = sum(float(size_of(group, constants, {}, 1)[0]) for group in section.neurons.values())
        if own > self._most:
            return Excess()
        tallies: dict[int, Tally | None] = {}

        def first(some: int) -> Tally | None:
            """What that many entries make."""
            if some not in tallies:
                tallies[some] = self._of(entries[:some], constants, int(own))
            return tallies[some]

        tally = first(len(entries))
        if tally is not None and not self._excessive(tally):
            return tally
        some = 1 + bisect_left(range(1, len(entries)), True, key=lambda some: self._excessive(first(some)))
        name, model = entries[some - 1]
        span = key_span(section, "instances", name) if model.count is None else model.count.span
        return self._excess(span, first(some))

    def _of(self, entries: tuple[tuple[str, InstanceModel], ...], constants: Constants, own: int) -> Tally | None:
        """What some entries make beside what there is; None where these are more than there may be, however many."""
        try:
            made = self.count([model for _, model in entries], constants)
        except TooManyError:
            return None
        return Tally(made.instances, own + made.neurons, made.large)

    def _excessive(self, tally: Tally | None) -> bool:
        return tally is None or tally.instances > MOST_INSTANCES or tally.neurons > self._most

    def _excess(self, span: Span, tally: Tally | None) -> Excess:
        if tally is None or tally.instances > MOST_INSTANCES:
            many = f"more than {MOST_INSTANCES:,}" if tally is None else amount(tally.instances)
            return Excess(span, f"this makes {many} instances; {MOST_INSTANCES:,} are the most")
        neurons = tally.neurons
        if tally.large is not None:
            span, neurons = tally.large[0].span, tally.large[1]
        return Excess(
            span, f"this makes {amount(neurons)} neurons; the limit is {self._most:,}", "raise it with --limit"
        )

    def count(self, entries: Iterable[InstanceModel], constants: Constants) -> Tally:
        """What these entries make, with all that is within. Raises TooManyError where there are more instances than
        there may be and it would take long to say how many."""
        done = _Count()
        for model in entries:
            self._enter(model, constants, {}, np.ones(1), done)
        for name in self._order:
            for parts in done.waiting.pop(name, {}).values():
                self._within(self._modules[name], _Alike.joined(parts), done)
        return done.tally()

    def _within(self, module: Module, alike: _Alike, done: _Count) -> None:
        """Count what is in instances of a module."""
        rows = len(alike.many)
        constants = Constants({}, self._dt, Findings())
        known: dict[str, Value] = {}
        for name, parameter in module.model.parameters.items():
            if name in alike.set:
                known[name] = alike.set[name]
            elif name in self._wanted[module.name]:
                value = constants.unchecked(parameter.value, known)
                if value is not None:
                    known[name] = value
        for group in module.model.neurons.values():
            sizes = size_of(group, constants, known, rows)
            done.neurons += float(np.minimum(alike.many * sizes, _HUGE).sum())
            if done.large is None and group.count is not None and sizes.max() > self._most:
                done.large = group.count, int(sizes.max())
        for model in module.model.instances.values():
            self._enter(model, constants, known, alike.many, done)

    def _enter(
        self, model: InstanceModel, constants: Constants, known: Mapping[str, Value], many: FloatArray, done: _Count
    ) -> None:
        """Count the instances of one entry, in rows of scopes of which there are so ``many``; what is in them has to
        wait until all entries that make such are known."""
        module = self._modules.get(model.module.value)
        if module is None:
            return
        counts = _counted(model.count, constants, known, len(many))
        if not counts.any():  # a count invalid: there are no rows to go on with
            return
        total = np.minimum(many * counts, _HUGE)
        done.instances += float(total.sum())
        waiting = done.waiting.setdefault(module.name, {})
        keys = tuple(sorted(self._wanted[module.name].intersection(model.set)))
        if not keys:
            waiting.setdefault((), []).append(_Alike({}, total))
            return
        if done.seen + counts.sum() > MOST_INSTANCES:
            raise TooManyError
        rows = np.repeat(np.arange(len(many)), counts.astype(np.int64))
        done.seen += len(rows)
        first = np.cumsum(counts) - counts
        around: dict[str, Value] = {
            name: value if np.ndim(value) == 0 else np.asarray(value)[rows] for name, value in known.items()
        }
        around |= {"i": np.arange(len(rows)) - first[rows], "n": counts[rows]}
        columns: dict[str, FloatArray] = {}
        for name in keys:
            value = constants.unchecked(model.set[name], around)
            columns[name] = np.broadcast_to(np.nan if value is None else np.asarray(value), rows.shape)
        waiting.setdefault(keys, []).append(_Alike(columns, many[rows]))

    def _depends(self, model: ModuleModel) -> frozenset[str]:
        """The parameters of a module on which it depends how much there is in it, those within it being known."""
        found = _names(group.count for group in model.neurons.values())
        found |= _names(entry.count for entry in model.instances.values())
        for entry in model.instances.values():
            below: Collection[str] = self._wanted.get(entry.module.value, ())
            found |= _names(formula for name, formula in entry.set.items() if name in below)
        for name, parameter in reversed(model.parameters.items()):  # one may use those before it
            if name in found:
                found |= _names((parameter.value,))
        return found


def _used(model: ModuleModel) -> Iterable[str]:
    return dict.fromkeys(entry.module.value for entry in model.instances.values())


def size_of(group: GroupModel, constants: Constants, known: Mapping[str, Value], rows: int) -> FloatArray:
    """How many neurons a group has, in each row."""
    if group.count is None:
        return np.full(rows, float(len(group.names or ()) or 1))
    return _counted(group.count, constants, known, rows)


def _counted(formula: Formula | None, constants: Constants, known: Mapping[str, Value], rows: int) -> FloatArray:
    """A count, in each row; 0 where it is none."""
    value = 1.0 if formula is None else constants.unchecked(formula, known)
    counts = np.broadcast_to(np.asarray(0.0 if value is None else value, dtype=np.float64), (rows,))
    with np.errstate(invalid="ignore"):
        return np.where((counts >= 1) & (counts <= 2**53) & (counts == np.floor(counts)), counts, 0.0)


def _names(formulas: Iterable[Formula | None]) -> frozenset[str]:
    """The names that formulas use; none of one that cannot be read."""
    found: set[str] = set()
    for formula in formulas:
        if formula is not None and isinstance(formula.value, str):
            try:
                found.update(names(parse(formula.value)))
            except ExpressionError:
                continue
    return frozenset(found)
