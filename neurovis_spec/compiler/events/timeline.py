"""The timeline: from the events of a spec to what changes in a run, and when (§9).

In: a Network, its events. Out: the same network with a Change for each step at which something does, and a hash that
covers what they make of it; findings, each at its event, where something could not be done. What is set is tried out
here, one event after the other, on numbers that can be changed: what a run does later cannot fail.
"""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import IntArray, frozen
from neurovis_spec.compiler.digest import digest
from neurovis_spec.compiler.events.changes import NO_INDICES, Change, Clamp, Held
from neurovis_spec.compiler.events.events import Event
from neurovis_spec.compiler.events.patch import Patch, Patcher, PatchError
from neurovis_spec.compiler.events.settable import Binding, ParameterFormula, table_of
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Key
from neurovis_spec.compiler.values.constants import Constants, check_finite
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.expressions.tree import Number
from neurovis_spec.language.located import Formula
from neurovis_spec.language.unknown import UNKNOWN


def with_changes(network: Network, events: tuple[Event, ...], constants: Constants) -> Network:
    """The network with what its events change. An expression that is set sees the values that the parameters have by
    then, not those of the other parameters that are set at the same step."""
    settable = constants.settable.keys()
    events = tuple(  # a parameter whose own value is invalid has no slot, and that is reported
        event
        if event.set.keys() <= settable
        else replace(event, set={name: value for name, value in event.set.items() if name in settable})
        for event in events
    )
    begun, over = defaultdict[int, list[int]](list), defaultdict[int, list[int]](list)
    for number, event in enumerate(events):
        begun[event.at].append(number)
        if event.clamp and event.to is not None:
            over[event.to].append(number)
    changes = tuple(
        _change(step, [(number, events[number]) for number in begun[step]], over[step], constants)
        for step in sorted({*begun, *over})
    )
    trial, course = _Trial(network, events, changes, constants), hashlib.sha256()
    for change in changes:
        course.update(trial.go_on(change, [events[number] for number in begun[change.at]]))
    own = digest(network.hash, course.hexdigest())
    return replace(network, changes=changes, hash=own)


def _change(step: int, new: list[tuple[int, Event]], over: list[int], constants: Constants) -> Change:
    """What several events change at a step; of those that do the same the last one counts."""
    values: dict[int, ParameterFormula] = {}
    clamps: list[Clamp] = []
    learning: list[tuple[IntArray, bool]] = []
    for number, event in new:
        for name, formula in event.set.items():
            values[constants.settable[name]] = _formula(formula, constants)
        for place, (neurons, formula) in enumerate(event.clamp):
            order = number * _MOST_CLAMPS + place
            clamps.append(Clamp(order, number, neurons, _formula(formula, constants)))
        learning += event.learning
    return Change(
        step,
        tuple(values.items()),
        tuple(clamps),
        tuple(over),
        lesioned_neurons=_indices([one for _, event in new for one in event.neurons]),
        lesioned_connections=_indices([one for _, event in new for one in event.connections]),
        mended_neurons=_indices([one for _, event in new for one in event.mended_neurons]),
        mended_connections=_indices([one for _, event in new for one in event.mended_connections]),
        learning=tuple(learning),
    )


#: Entries of a clamp that are told apart; more than a file can hold.
_MOST_CLAMPS = 1 << 32


def _indices(found: Sequence[IntArray]) -> IntArray:
    """All of these indices, ascending; of one array that one."""
    if len(found) < 2:
        return found[0] if found else NO_INDICES
    return frozen(np.unique(np.concatenate(found)))


def _formula(formula: Formula, constants: Constants) -> ParameterFormula:
    """A formula of an event over the parameters, whatever these are by then."""
    tree = constants.tree(formula)
    return constants.bound(Number(0.0) if tree is UNKNOWN else tree)


class _Written(NamedTuple):
    """An array that a patch writes to: which of its bindings write, and where each of these has its numbers among all.

    ``order`` is that of their places; ``mark`` says what the array is called and what the places are.
    """

    weights: bool
    parts: tuple[tuple[int, slice], ...]
    order: IntArray
    mark: bytes


def _written(called: str, numbers: list[int], bindings: tuple[Binding, ...]) -> _Written:
    places = np.concatenate([bindings[number].places for number in numbers])
    ends = [0, *accumulate(len(bindings[number].places) for number in numbers)]
    parts = tuple((number, slice(first, end)) for number, (first, end) in zip(numbers, pairwise(ends), strict=True))
    order = np.argsort(places, kind="stable")
    mark = called.encode() + hashlib.sha256(places[order].tobytes()).digest()
    return _Written(bindings[numbers[0]].weights, parts, order, mark)


@dataclass
class _Trial:
    """A run without steps: what the parameters are by an event, and all that follows them."""

    network: Network
    events: tuple[Event, ...]
    changes: tuple[Change, ...]
    constants: Constants

    def __post_init__(self) -> None:
        settable = self.network.settable
        self._patcher = Patcher(settable)
        self._parameters = settable.parameters.copy()
        self._chosen = np.zeros(len(settable.slots), dtype=np.bool_)
        self._weights = self.network.connections.weights.whole().copy()
        self._variables = settable.initial.copy()
        self._held = Held.none(len(self.network.neurons))
        self._arrays: dict[tuple[Binding, ...], tuple[_Written, ...]] = {}
        self._read = self._slots_of_formulas()
        by_name = sorted((slot.name, place) for place, slot in enumerate(settable.slots) if "." not in slot.name)
        self._root = np.array([place for _, place in by_name], dtype=np.int64)

    @property
    def findings(self) -> Findings:
        """Where findings go."""
        return self.constants.findings

    def _slots_of_formulas(self) -> frozenset[int]:
        """The slots that inputs, noise and the events themselves read, and those that these follow."""
        found: set[int] = set()
        for change in self.changes:
            for formula in (*(one for _, one in change.parameters), *(clamp.value for clamp in change.clamps)):
                found |= formula.slots
        for slots in (*(i.slots for i in self.network.inputs), *(noise.slots for noise in self.network.noises)):
            found.update(slots.values())
        waiting = list(found)
        while waiting:
            followed = self.network.settable.slots[waiting.pop()].formula
            new = frozenset() if followed is None else followed.slots - found
            found |= new
            waiting += new
        return frozenset(found)

    def go_on(self, change: Change, events: list[Event]) -> bytes:
        """Apply the changes of a step to the parameters, weights and clamps of this trial run. Gives bytes that
        identify their effect, for the hash."""
        keys = self._keys(events)
        marks = [str(change.at).encode()]
        values: dict[int, float] = {}
        for slot, formula in change.parameters:
            value = float(formula.values(self._parameters))
            _, written = keys[self.network.settable.slots[slot].name]
            if check_finite(value, written, self.findings):
                values[slot] = value
        changed: frozenset[int] = frozenset()
        if values:
            spans = {slot: keys[self.network.settable.slots[slot].name][0] for slot in values}
            mark, changed = self._set(change.at, values, spans)
            marks.append(mark)
        marks.append(self._clamp(change, changed))
        for array in (
            change.mended_neurons, change.mended_connections, change.lesioned_neurons, change.lesioned_connections,
        ):  # fmt: skip
            marks.append(array.tobytes())
        marks += (members.tobytes() + bytes([on]) for members, on in change.learning)
        return b"".join(len(mark).to_bytes(8, "little") + mark for mark in marks)

    def _keys(self, events: list[Event]) -> dict[str, tuple[Span, Formula]]:
        """Where each parameter is set at a step, and to what; a warning where one is set twice."""
        due: dict[str, tuple[Span, Formula]] = {}
        for event in events:
            for name, formula in event.set.items():
                key = event.keys[name]
                if name in due:
                    first = due[name][0]
                    where = key.seen_from(first)
                    message = f"'{name}' is set again at this step ({where}): what is set here is lost"
                    self.findings.warning("no-effect", first, message, "set it once")
                due[name] = key, formula
        return due

    def _set(self, step: int, values: dict[int, float], keys: dict[int, Span]) -> tuple[bytes, frozenset[int]]:
        """Set parameters; a finding, at each of them from which it follows, where they cannot have these values."""
        try:
            patch = self._patcher.patch(self._parameters, self._chosen, values)
        except PatchError as error:
            own = [chosen or slot in values for slot, chosen in enumerate(self._chosen.tolist())]
            for slot, key in keys.items():
                if not error.slots.isdisjoint((slot, *self.network.settable.reached([slot], own))):
                    self.findings.error("out-of-range", key, f"from step {step} on {error}")
            return b"", frozenset()
        self._chosen[list(values)] = True
        before, self._parameters = self._parameters, patch.parameters
        mark, effect = self._effect(patch)
        patch.write(self._weights, self._variables)
        if not effect and self._read.isdisjoint(patch.changed):
            for slot, key in keys.items():
                if before[slot] != patch.parameters[slot]:
                    message = f"setting '{self.network.settable.slots[slot].name}' changes nothing in the run"
                    hint = "what it begins with (an initial, a weight that learns) and how it is drawn stay as they are"
                    self.findings.warning("no-effect", key, message, hint)
        return mark, patch.changed

    def _effect(self, patch: Patch) -> tuple[bytes, bool]:
        """Bytes that identify the numbers that a patch writes, however its formulas are written (for the hash); and
        whether it changes any of them."""
        marks = [patch.parameters[self._root].tobytes()]
        effect = False
        for array in self._written(patch.bindings):
            now = self._weights if array.weights else self._variables
            values = np.empty(len(array.order))
            for number, where in array.parts:
                values[where] = patch.values[number]
                effect = effect or bool((now[patch.bindings[number].indices] != patch.values[number]).any())
            same = bool((values == values[0]).all())
            marks.append(array.mark + values[slice(1) if same else array.order].tobytes())
        return b"/".join(marks), effect

    def _written(self, bindings: tuple[Binding, ...]) -> tuple[_Written, ...]:
        """The arrays that these bindings write to, with the places in them."""
        if bindings not in self._arrays:
            arrays: dict[Key, list[int]] = defaultdict(list)
            for number, binding in enumerate(bindings):
                if len(binding.indices):
                    arrays[binding.array].append(number)
            named = sorted((self._called(array), array) for array in arrays)
            self._arrays[bindings] = tuple(_written(called, arrays[array], bindings) for called, array in named)
        return self._arrays[bindings]

    def _called(self, array: Key) -> str:
        """An array by a name in which no order of the spec shows."""
        owner = array.owner
        if owner is None or array != table_of(owner.number):
            return array.text
        return f"{owner.kind}/{self.network.inputs[owner.number].name}"

    def _clamp(self, change: Change, changed: frozenset[int]) -> bytes:
        """Begin and end clamps; a finding, at what it is clamped to, where that is not finite."""
        if not (self._held.active or change.clamps):
            return b""
        before = self._held.order.copy(), self._held.value.copy()
        self._held.follow(changed, self._parameters)
        self._held.end(change.released, self._parameters)
        for clamp in change.clamps:
            self._held.begin(clamp, self._parameters)
        held = np.flatnonzero(self._held.order >= 0)
        wrong = held[~np.isfinite(self._held.value[held])]
        for order in dict.fromkeys(self._held.order[wrong].tolist()):
            clamp = self._held.active[order]
            _, formula = self.events[clamp.event].clamp[order % _MOST_CLAMPS]
            check_finite(float(clamp.value.values(self._parameters)), formula, self.findings)
        if np.array_equal(before[0] >= 0, self._held.order >= 0) and np.array_equal(
            before[1][held], self._held.value[held]
        ):
            return b""
        return held.tobytes() + self._held.value[held].tobytes()
