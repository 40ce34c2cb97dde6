"""Inputs: s[t] as one vector, from expressions, tables, spikes and what the caller supplies; behind them the noise.

In: a Network and the caller's values. Out: for each step the vector of all inputs. Expressions are *left* to a stepper
that computes them itself, but for those in which something undefined may hide. Else they are evaluated a stretch of
steps at a time, the same stretches however one runs, so that stepping and running give the same bits, by the functions
that compute the steps; rows are made from them for as many of these steps as make a fixed number of values, so that
memory does not grow with the steps.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from math import isfinite
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import BoolArray, FloatArray
from neurovis_spec.compiler.events.settable import table_of
from neurovis_spec.compiler.network import Input, Network, Noise, Spikes
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.language.expressions.evaluate import evaluate, evaluate_array
from neurovis_spec.language.expressions.functions import NUMPY, Library
from neurovis_spec.language.expressions.tree import Draw, Tree
from neurovis_spec.language.expressions.undefined import either, hazards
from neurovis_spec.likeness import suggest
from neurovis_spec.runtime.backend import Reading, Stepper
from neurovis_spec.runtime.rows import STRETCH
from neurovis_spec.runtime.state import State, constants

#: values of rows that are made together, at least one row
_MOST_VALUES = 1 << 16


class InputError(ValueError):
    """A value for an input that does not exist, has another size, or is no finite number."""


class _Numbers(NamedTuple):
    """What a formula gives a number for each of, at each step: what they are for and the name by which they are drawn,
    how many there are, and the values and slots of the parameters that the formula reads."""

    purpose: str
    name: str
    size: int
    parameters: Mapping[str, float]
    slots: Mapping[str, int]


class InputReader:
    """The inputs of a network, step by step.

    ``supplied`` maps names to whole arrays that replace their sources: (steps, size), (steps,) for size 1, or one
    number or (size,) for all steps; past its end the last row stays. ``on_rows`` is called with rows of inputs as
    soon as they are computed: the first step, a row for each step from there on, and which of these numbers hide that
    something is undefined in their formula (None: none does). Functions are computed ``by`` a library. Raises
    InputError.
    """

    def __init__(
        self,
        network: Network,
        supplied: Mapping[str, npt.ArrayLike] | None = None,
        on_rows: Callable[[int, FloatArray, BoolArray | None], None] | None = None,
        by: Library = NUMPY,
    ) -> None:
        self.network, self._on_rows, self._by = network, on_rows, by
        self._supplied = {name: _whole(_entry(network, name), value) for name, value in (supplied or {}).items()}
        self._parameters, self._variables, self._drawn_before = network.settable.parameters, network.settable.initial, 0
        #: by inputs that events feed, and nobody supplies, the slots that say whether they are fed, and what
        self._feeds = {
            name: range(first, first + 1 + network.input_index[name].size)
            for name, first in network.settable.feeds.items()
            if name not in self._supplied
        }
        #: the inputs that are fed by events now
        self.fed: frozenset[str] = frozenset()
        read = (*(entry.slots for entry in network.inputs), *(noise.slots for noise in network.noises))
        #: the slots (indices of parameters) that formulas read, and feeds
        self._read = sorted({slot for slots in read for slot in slots.values()}.union(*self._feeds.values()))
        #: whether a table follows parameters
        self._tables = any(table_of(number) in network.settable.variables for number in range(len(network.inputs)))
        #: the rows made last, and the step of the first of them
        self._first = -1
        self._rows: FloatArray = np.zeros((0, network.vector_size))
        #: how many rows are made together at most, and where no more are asked for: powers of two, too, so that no
        #: rows are of two stretches
        self._most = 1 << (max(1, _MOST_VALUES // max(1, network.vector_size)).bit_length() - 1)
        self._steps = min(STRETCH, self._most)
        #: the steps of spikes, by input
        self._spikes = {one.name: one.spikes.steps(network.dt) for one in network.inputs if one.spikes is not None}
        #: the inputs that are left to the stepper, and whether these are all numbers of the vector
        self.left: frozenset[str] = frozenset()
        self.all_left = False
        #: some names of inputs that were given, and the inputs that are left beside them (``left_beside``)
        self._left_beside = self.left, self.left
        #: the values of expressions over a stretch, by input, and where the stretch begins
        self._expressions: dict[str, tuple[int, FloatArray]] = {}
        #: where something is undefined, as a formula, by the number of the input or of the noise
        self._undefined: dict[int, Tree] = {}
        self._undefined_noise: dict[int, Tree] = {}
        if on_rows is not None:
            formulas = (None if entry.name in self._supplied else entry.expression for entry in network.inputs)
            self._undefined = dict(_undefined(formulas))
            self._undefined_noise = dict(_undefined(noise.expression for noise in network.noises))

    def leave(self, stepper: Stepper, but: Collection[str] = ()) -> None:
        """Leave to a stepper the inputs that it can compute itself, ``but`` those of these names."""
        if not isinstance(stepper, Reading):
            return
        kept = {*self._supplied, *self._feeds, *but, *(self.network.inputs[number].name for number in self._undefined)}
        self.left = frozenset(one.name for one in self.network.inputs if one.is_formula) - kept
        sizes = (one.size for one in self.network.inputs if one.name in self.left)
        self.all_left = sum(sizes) == self.network.vector_size
        self._left_beside = frozenset(), self.left
        stepper.read(self.left)

    def left_beside(self, given: Mapping[str, object]) -> frozenset[str]:
        """The inputs that are left but those that are given; the same set as long as these have the same names."""
        if given.keys() != self._left_beside[0]:
            self._left_beside = frozenset(given), self.left.difference(given)
        return self._left_beside[1]

    def use(self, state: State) -> None:
        """Take parameters as a state has them by now; what depends on those that have changed is made anew."""
        now = state.conditions
        old, self._parameters, self._variables = self._parameters, now.parameters, now.variables
        if (
            self._tables
            or self._drawn_before != state.drawn
            or any(old[slot] != now.parameters[slot] for slot in self._read)
        ):
            self._drawn_before = state.drawn
            self.fed = frozenset(name for name, slots in self._feeds.items() if self._parameters[slots[0]])
            self._first, self._rows = -1, self._rows[:0]
            self._expressions.clear()

    def rows(self, first: int, stop: int) -> Iterator[FloatArray]:
        """The vectors of steps ``first`` … ``stop`` − 1, each (inputs,), read-only."""
        for part in self.parts(first, stop):
            yield from part

    def parts(self, first: int, stop: int) -> Iterator[FloatArray]:
        """The same, as many at a time as are made together: (steps, inputs). The numbers of inputs that are left are
        to be put there."""
        while first < stop:
            if not self._first <= first < self._first + len(self._rows):
                self._make(first, stop)
            yield self._rows[first - self._first : stop - self._first]
            first = self._first + len(self._rows)

    def at(self, k: int, values: Mapping[str, npt.ArrayLike] | None = None) -> FloatArray:
        """The vector of step k; ``values`` replace the sources for this step only."""
        if not self._first <= k < self._first + len(self._rows):
            self._make(k, k + 1)
        row: FloatArray = self._rows[k - self._first]
        if values:
            row = row.copy()
            for name, value in values.items():
                entry = _entry(self.network, name)
                if isinstance(value, float) and entry.size == 1 and isfinite(value):
                    row[entry.start] = value
                else:
                    row[entry.start : entry.start + entry.size] = _single(entry, value)
                if name in self.network.held_inputs:
                    row[self.network.held_inputs[name]] = 1.0
        return row

    def _make(self, first: int, stop: int) -> None:
        """Make the rows of steps from the beginning of a stretch before ``first`` on, as far as ``stop`` where nothing
        depends on how many are made together."""
        count = self._steps
        first -= first % count
        if self.left or self.all_left:  # by functions that give the same bits whatever stands beside a number
            count = min(self._most, -(-(stop - first) // count) * count)
        steps = np.arange(first, first + count)
        rows = np.zeros((count, self.network.vector_size))
        for entry in self.network.inputs:
            if entry.name not in self.left:
                rows[:, entry.start : entry.start + entry.size] = self._source(entry, steps)
            if (entry.name in self._supplied or entry.name in self.fed) and entry.name in self.network.held_inputs:
                rows[:, self.network.held_inputs[entry.name]] = 1.0
        for noise in self.network.noises:
            rows[:, noise.start : noise.start + len(noise.members)] = self._noise(noise, noise.expression, steps)
        rows.flags.writeable = bool(self.left)
        self._first, self._rows = first, rows
        if self._on_rows is not None and not self.all_left:
            self._on_rows(first, rows, self._hidden(steps))

    def _hidden(self, steps: npt.NDArray[np.int64]) -> BoolArray | None:
        """Of the numbers of some steps those that hide that something is undefined in their formula."""
        if not self._undefined and not self._undefined_noise:
            return None
        hidden = np.zeros((len(steps), self.network.vector_size), dtype=np.bool_)
        for number, tree in self._undefined.items():
            entry = self.network.inputs[number]
            if entry.name in self.fed:
                continue
            values = self._each(entry, tree, steps) if entry.indexed or entry.is_drawn else None
            if values is None:
                values = np.broadcast_to(self._evaluated(entry, tree, steps), len(steps)).reshape(-1, 1)
            hidden[:, entry.start : entry.start + entry.size] = np.not_equal(values, 0)
        for number, tree in self._undefined_noise.items():
            noise = self.network.noises[number]
            hidden[:, noise.start : noise.start + len(noise.members)] = np.not_equal(self._noise(noise, tree, steps), 0)
        return hidden

    def _source(self, entry: Input, steps: npt.NDArray[np.int64]) -> FloatArray | float:
        if entry.name in self.fed:
            values = self._parameters[self._feeds[entry.name][1:]]
            return np.broadcast_to(values, (len(steps), entry.size))
        table = self._supplied.get(entry.name, self._table(entry))
        if table is not None:
            chosen: FloatArray = table[np.minimum(steps, len(table) - 1)]
            return chosen.reshape(len(steps), -1)
        if entry.spikes is not None:
            return self._counted(entry, entry.spikes, steps)
        if entry.expression is None:
            return 0.0
        if entry.indexed or entry.is_drawn:
            return self._each(entry, entry.expression, steps)
        if len(steps) > STRETCH:
            return np.broadcast_to(self._evaluated(entry, entry.expression, steps), len(steps)).reshape(-1, 1)
        within = int(steps[0]) % STRETCH
        begin = int(steps[0]) - within
        kept = self._expressions.get(entry.name)
        if kept is None or kept[0] != begin:
            stretch = np.arange(begin, begin + STRETCH)
            values = np.broadcast_to(self._evaluated(entry, entry.expression, stretch), (STRETCH,))
            kept = self._expressions[entry.name] = begin, np.asarray(values, dtype=np.float64)
        return kept[1][within : within + len(steps)].reshape(-1, 1)

    def _counted(self, entry: Input, spikes: Spikes, steps: npt.NDArray[np.int64]) -> FloatArray:
        """How many spikes of each number these steps have, which follow each other: (steps, size)."""
        counts, first = np.zeros((len(steps), entry.size)), int(steps[0])
        of = self._spikes[entry.name]
        begin, end = np.searchsorted(of, (first, first + len(steps))).tolist()
        np.add.at(counts, (of[begin:end] - first, spikes.indices[begin:end]), 1.0)
        return counts

    def _each(self, entry: Input, tree: Tree, steps: npt.NDArray[np.int64]) -> FloatArray | float:
        """A formula of each number of an input, over a stretch of steps: (steps, size)."""
        numbers = _Numbers("input", entry.name, entry.size, self.network.parameters, entry.slots)
        return self._drawn(numbers, tree, steps)

    def _evaluated(self, entry: Input, tree: Tree, steps: npt.NDArray[np.int64]) -> FloatArray | float:
        """A formula of an input over these steps."""
        k, dt = steps.astype(np.float64), self.network.dt
        known: dict[str, float | FloatArray] = {**constants(dt), **self.network.parameters, "k": k, "t": k * dt}
        known |= self._set(entry.slots)
        return evaluate_array(tree, known, by=self._by)

    def _set(self, slots: Mapping[str, int]) -> dict[str, float]:
        """The parameters of an expression that can be set, as they are by now."""
        return {name: float(self._parameters[slot]) for name, slot in slots.items()}

    def _table(self, entry: Input) -> FloatArray | None:
        """The rows of an input, of which some may follow parameters."""
        number = self.network.inputs.index(entry) if entry.parts else -1
        if entry.table is None or number < 0:
            return entry.table
        start, size = self.network.settable.variables[table_of(number)]
        return np.broadcast_to(self._variables[start : start + size], (entry.table.size,)).reshape(entry.table.shape)

    def _noise(self, noise: Noise, tree: Tree, steps: npt.NDArray[np.int64]) -> FloatArray | float:
        """A formula of a noise over a stretch of steps: (steps, members)."""
        numbers = _Numbers("noise", noise.name, len(noise.members), noise.parameters, noise.slots)
        return self._drawn(numbers, tree, steps)

    def _drawn(self, of: _Numbers, tree: Tree, steps: npt.NDArray[np.int64]) -> FloatArray | float:
        """A formula of some numbers over a stretch of steps: the counter of a number that is drawn is (i, 0, step,
        number of the draw)."""
        stream = Stream(self.network.seed, of.purpose, of.name)
        i, step = np.arange(of.size).reshape(1, -1), steps.reshape(-1, 1)
        k, dt = step.astype(np.float64), self.network.dt
        known: dict[str, float | FloatArray] = {**constants(dt), **of.parameters, "k": k, "t": k * dt}
        known |= {"i": i.astype(np.float64), "n": float(of.size)}
        known |= self._set(of.slots)
        step = step + self._drawn_before

        def draw(node: Draw, first: float | FloatArray, second: float | FloatArray) -> FloatArray:
            return stream.drawn(node.kind, first, second, (i, 0, step, node.index))

        return evaluate_array(tree, known, draw, by=self._by)


def at_stage(network: Network, inputs: FloatArray, state: State, t: float) -> list[float]:
    """The vector of a step as it is at a stage of the integration, at ``t`` seconds: formulas that reach what flows are
    evaluated then, one by one."""
    result: list[float] = inputs.tolist()
    for name, held in network.held_inputs.items():
        entry = network.input_index[name]
        if not result[held] and entry.expression is not None:
            known = {**constants(network.dt), **network.parameters, "k": float(state.k), "t": t}
            known |= {name: float(state.conditions.parameters[slot]) for name, slot in entry.slots.items()}
            if entry.indexed:
                known["n"] = float(entry.size)
                values = [evaluate(entry.expression, known | {"i": float(i)}) for i in range(entry.size)]
            else:
                values = [evaluate(entry.expression, known)] * entry.size
            result[entry.start : entry.start + entry.size] = values
    return result


def _undefined(formulas: Iterable[Tree | None]) -> Iterator[tuple[int, Tree]]:
    """Where something is undefined in formulas, and hidden, each with the number of the formula."""
    for number, tree in enumerate(formulas):
        found = [] if tree is None else hazards(tree).found
        if found:
            yield number, either(hazard.formula for hazard in found)


def check_names(network: Network, names: Iterable[str]) -> None:
    """Refuse a name that no input has. Raises InputError."""
    for name in names:
        _entry(network, name)


def _entry(network: Network, name: str) -> Input:
    found = network.input_index.get(name)
    if found is None:
        hint = _numbered(network, name) or suggest(name, network.input_index, "the inputs are")
        raise InputError(f"no input '{name}'" + (f"; {hint}" if hint else "; the network has no inputs"))
    return found


def _numbered(network: Network, name: str) -> str | None:
    """What to say of an input of several instances, ``left.load``: each has its own."""
    head, dot, own = name.partition(".")
    pattern = re.compile(rf"{re.escape(head)}\d+\.{re.escape(own)}")
    found = [other for other in network.input_index if dot and pattern.fullmatch(other)]
    shown = ", ".join(f"'{other}'" for other in found[:6]) + (", …" if len(found) > 6 else "")
    return f"'{head}' is several instances, each with its own: {shown}" if found else None


def _numbers(entry: Input, value: npt.ArrayLike) -> FloatArray:
    try:
        given = np.asarray(value)
        if given.dtype.kind not in "fiub":
            raise TypeError
        array = given.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"input '{entry.name}': not an array of numbers") from None
    if not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0].tolist()
        place = f" at row {where[0]}" if where else ""
        raise InputError(f"input '{entry.name}': NaN or infinity{place}")
    return array


def _single(entry: Input, value: npt.ArrayLike) -> FloatArray:
    """The numbers of an input at a step, (size,). Raises InputError."""
    array = _numbers(entry, value)
    if array.size == entry.size and array.ndim <= 1:
        return array
    raise InputError(f"input '{entry.name}' takes {_sized(entry.size)} a step, not shape {array.shape}")


def _whole(entry: Input, value: npt.ArrayLike) -> FloatArray:
    """The numbers of an input at all steps, (steps, size). Raises InputError."""
    array = _numbers(entry, value)
    if array.ndim == 1 and entry.size == 1:
        array = array.reshape(-1, 1)
    elif array.ndim <= 1:
        array = array.reshape(1, -1)
    if array.ndim != 2 or array.shape[1] != entry.size or not len(array):
        wanted = f"(steps, {entry.size})" + (" or (steps,)" if entry.size == 1 else "")
        raise InputError(f"input '{entry.name}' takes an array of shape {wanted}, not {np.shape(value)}")
    return array


def _sized(size: int) -> str:
    return "one number" if size == 1 else f"{size} numbers"
