"""The timeline: from the events of a spec to what changes in a run, and when.

In: a Network, its events. Out: the same network with a Change for each step at which something changes, and a hash that
covers what the changes make of it; findings, each at its event, where something cannot be done. The changes are tried
out here, one after the other, on arrays of a trial run without steps; so a run cannot fail on them. Slots and bindings
are explained in ``settable``.
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
from neurovis_spec.compiler.events.event_slots import Assigned, with_event_slots
from neurovis_spec.compiler.events.events import Event
from neurovis_spec.compiler.events.patch import Patch, Patcher, PatchError
from neurovis_spec.compiler.events.settable import Binding, ParameterFormula, table_of
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Key
from neurovis_spec.compiler.values.constants import Constants, check_finite
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.expressions.tree import Number
from neurovis_spec.language.located import Formula
from neurovis_spec.language.unknown import UNKNOWN

#: More clamps than an event can have (``_clamp_order``).
_MOST_CLAMPS = 1 << 32


def with_changes(network: Network, events: tuple[Event, ...], constants: Constants) -> Network:
    """The network with what its events change. An expression that is set sees the values that the parameters have by
    then, not those of the other parameters that are set at the same step."""
    network, assigned = with_event_slots(network, events, constants.settable, constants.findings)
    starting_at, ending_at = defaultdict[int, list[int]](list), defaultdict[int, list[int]](list)
    for index, event in enumerate(events):
        starting_at[event.at].append(index)
        if event.clamp and event.to is not None:
            ending_at[event.to].append(index)
    changes = tuple(
        _change(network, step, {at: events[at] for at in starting_at[step]}, assigned, ending_at[step], constants)
        for step in sorted({*starting_at, *ending_at})
    )
    trial, run_hash = _TrialRun(network, events, changes, constants), hashlib.sha256()
    for change in changes:  # each is tried out, findings included, with all that those before it have made
        run_hash.update(trial.apply(change, [one for index in starting_at[change.at] for one in assigned[index]]))
    return replace(network, changes=changes, hash=digest(network.hash, run_hash.hexdigest()))


def _clamp_order(event: int, index_in_event: int) -> int:
    """The order of a clamp, known by the index of its event and by its own index in that: of two clamps of a neuron the
    one written later has the higher order, and holds."""
    return event * _MOST_CLAMPS + index_in_event


def _index_in_event(clamp_order: int) -> int:
    """The index of a clamp in its event, from its order."""
    return clamp_order % _MOST_CLAMPS


def _change(
    network: Network,
    step: int,
    starting: dict[int, Event],
    assigned: tuple[tuple[Assigned, ...], ...],
    ending: list[int],
    constants: Constants,
) -> Change:
    """What several events change at a step; of those that do the same the last one counts. Events are known by their
    index; ``assigned`` is what each sets."""
    values: dict[int, ParameterFormula] = {}
    clamps: list[Clamp] = []
    learning: list[tuple[IntArray, bool]] = []
    for index, event in starting.items():
        for one in assigned[index]:
            values[one.slot] = _formula(one.formula, constants)
        for index_in_event, (what, formula) in enumerate(event.clamp):
            order, places = _clamp_order(index, index_in_event), network.clamp_places(what)
            clamps.append(Clamp(order, event=index, neurons=places, value=_formula(formula, constants)))
        learning += event.learning
    events, with_twins = starting.values(), network.connections.with_twins
    return Change(
        step,
        parameters=tuple(values.items()),
        clamps=tuple(clamps),
        released=tuple(ending),
        lesioned_neurons=_union([neurons for event in events for neurons in event.lesioned_neurons]),
        lesioned_connections=with_twins(_union([some for event in events for some in event.lesioned_connections])),
        mended_neurons=_union([neurons for event in events for neurons in event.mended_neurons]),
        mended_connections=with_twins(_union([some for event in events for some in event.mended_connections])),
        learning=tuple(learning),
        reset=_union([neurons for event in events for neurons in event.reset]),
    )


def _union(indices: Sequence[IntArray]) -> IntArray:
    """All of these indices, ascending; of one array that array itself."""
    if len(indices) < 2:
        return indices[0] if indices else NO_INDICES
    return frozen(np.unique(np.concatenate(indices)))


def _formula(formula: Formula, constants: Constants) -> ParameterFormula:
    """A formula of an event over the parameters, whatever values these have by then."""
    tree = constants.tree(formula)
    return constants.bound(Number(0.0) if tree is UNKNOWN else tree)


class _WrittenArray(NamedTuple):
    """An array of the network that some bindings of a patch write to. Their numbers are taken one binding after the
    other."""

    #: whether it is the weights
    weights: bool
    #: the index of each of these bindings, and which of all numbers are its own
    bindings_and_slices: tuple[tuple[int, slice], ...]
    #: sorts the numbers by their places in the array
    order: IntArray
    #: bytes that stand for the name of the array and for the places
    hash_prefix: bytes


def _written_array(name: str, indices: list[int], bindings: tuple[Binding, ...]) -> _WrittenArray:
    """The array of this name that the bindings with these indices write to."""
    places = np.concatenate([bindings[index].places for index in indices])
    ends = [0, *accumulate(len(bindings[index].places) for index in indices)]
    bindings_and_slices = tuple(
        (index, slice(start, end)) for index, (start, end) in zip(indices, pairwise(ends), strict=True)
    )
    order = np.argsort(places, kind="stable")
    hash_prefix = name.encode() + hashlib.sha256(places[order].tobytes()).digest()
    return _WrittenArray(bindings[indices[0]].weights, bindings_and_slices, order, hash_prefix)


@dataclass
class _TrialRun:
    """A run without steps: which values the parameters have by an event, and all numbers that follow them."""

    network: Network
    events: tuple[Event, ...]
    changes: tuple[Change, ...]
    constants: Constants

    def __post_init__(self) -> None:
        settable = self.network.settable
        self._patcher = Patcher(settable)
        self._parameters = settable.parameters.copy()
        self._was_set = np.zeros(len(settable.slots), dtype=np.bool_)
        self._weights = self.network.connections.weights.whole().copy()
        self._variables = settable.initial.copy()
        self._held = Held.none(self.network.held_as_spikes)
        self._arrays: dict[tuple[Binding, ...], tuple[_WrittenArray, ...]] = {}
        #: the slots that events alone set, and those of them that say what inputs are fed
        self._own = frozenset(range(settable.own_count, len(settable.slots)))
        sizes = {name: self.network.input_index[name].size for name in settable.feeds}
        self._fed = {name: [*range(first, first + 1 + sizes[name])] for name, first in sorted(settable.feeds.items())}
        self._read_in_run = self._slots_read_in_run()
        # without those of instances, which follow; by name, as the hash depends on no order of the spec
        by_name = sorted((name, index) for name, index in settable.index.items() if "." not in name)
        self._spec_slots = np.array([index for _, index in by_name], dtype=np.int64)

    @property
    def findings(self) -> Findings:
        """Where findings go."""
        return self.constants.findings

    def _slots_read_in_run(self) -> frozenset[int]:
        """The slots that inputs, noise and the events themselves read, and those that these follow."""
        read: set[int] = set()
        for change in self.changes:
            for _, formula in change.parameters:
                read |= formula.slots
            for clamp in change.clamps:
                read |= clamp.value.slots
        for entry in self.network.inputs:
            read.update(entry.slots.values())
        for noise in self.network.noises:
            read.update(noise.slots.values())
        waiting = list(read)
        while waiting:
            followed = self.network.settable.slots[waiting.pop()].formula
            new = frozenset() if followed is None else followed.slots - read
            read |= new
            waiting += new
        return frozenset(read)

    def apply(self, change: Change, assigned: list[Assigned]) -> bytes:
        """Apply the changes of a step, at which this is set, to the parameters, weights and clamps of this trial
        run. Gives bytes that identify their effect, for the hash."""
        setting_of = self._settings(assigned)
        identities = [str(change.at).encode()]
        values: dict[int, float] = {}
        for slot, formula in change.parameters:
            value = float(formula.values(self._parameters))
            if check_finite(value, setting_of[slot].formula, self.findings):
                values[slot] = value
        changed: frozenset[int] = frozenset()
        if values:
            identity, changed = self._set(change.at, values, {slot: setting_of[slot].key for slot in values})
            identities.append(identity)
        identities.append(self._clamp(change, changed))
        identities += [
            change.mended_neurons.tobytes(),
            change.mended_connections.tobytes(),
            change.lesioned_neurons.tobytes(),
            change.lesioned_connections.tobytes(),
        ]
        if len(change.reset):
            identities.append(b"reset" + change.reset.tobytes())
        identities += (members.tobytes() + bytes([on]) for members, on in change.learning)
        return b"".join(len(identity).to_bytes(8, "little") + identity for identity in identities)

    def _settings(self, assigned: list[Assigned]) -> dict[int, Assigned]:
        """The last setting of each slot at a step; a warning at one that another replaces."""
        settings: dict[int, Assigned] = {}
        told: set[Span] = set()
        for one in assigned:
            earlier = settings.get(one.slot)
            if earlier is not None and earlier.key not in told:
                told.add(earlier.key)
                where = one.key.seen_from(earlier.key)
                message = f"'{shorten(one.name)}' is set again at this step ({where}): what is set here is lost"
                self.findings.warning("no-effect", earlier.key, message, "set it once")
            settings[one.slot] = one
        return settings

    def _set(self, step: int, values: dict[int, float], keys: dict[int, Span]) -> tuple[bytes, frozenset[int]]:
        """Set slots to values. Gives bytes that identify the effect, and the slots that change. Where a number cannot
        be what it would be then: a finding at every parameter set here that it depends on."""
        settable = self.network.settable
        try:
            patch = self._patcher.patch(self._parameters, self._was_set, values)
        except PatchError as error:
            was_set = [set_before or slot in values for slot, set_before in enumerate(self._was_set.tolist())]
            for slot, key in keys.items():
                if not error.slots.isdisjoint((slot, *settable.reached([slot], was_set))):
                    self.findings.error("out-of-range", key, f"from step {step} on {error}")
            return b"", frozenset()
        self._was_set[list(values)] = True
        previous, self._parameters = self._parameters, patch.parameters
        identity, has_effect = self._identity_and_effect(patch)
        patch.write(self._weights, self._variables)
        for name, slots in self._fed.items():
            if not patch.changed.isdisjoint(slots):
                identity += b"/feed/" + name.encode() + patch.parameters[slots].tobytes()
        if not has_effect and self._read_in_run.union(self._own).isdisjoint(patch.changed):
            for slot, key in keys.items():
                if previous[slot] != patch.parameters[slot]:
                    message = f"setting '{settable.slots[slot].name}' changes nothing in the run"
                    hint = "what it begins with (an initial, a weight that learns) and how it is drawn stay as they are"
                    self.findings.warning("no-effect", key, message, hint)
        return identity, patch.changed

    def _identity_and_effect(self, patch: Patch) -> tuple[bytes, bool]:
        """Bytes that identify the numbers that a patch writes, however its formulas are written (for the hash); and
        whether it changes any of them."""
        identities = [patch.parameters[self._spec_slots].tobytes()]
        has_effect = False
        for array in self._arrays_written_by(patch.bindings):
            current = self._weights if array.weights else self._variables
            values = np.empty(len(array.order))
            for index, own_slice in array.bindings_and_slices:
                values[own_slice] = patch.values[index]
                if (current[patch.bindings[index].indices] != patch.values[index]).any():
                    has_effect = True
            hashed = values[:1] if (values == values[0]).all() else values[array.order]  # of equal numbers one
            identities.append(array.hash_prefix + hashed.tobytes())
        return b"/".join(identities), has_effect

    def _arrays_written_by(self, bindings: tuple[Binding, ...]) -> tuple[_WrittenArray, ...]:
        """The arrays that these bindings write to, by name."""
        if bindings not in self._arrays:
            by_array: dict[Key, list[int]] = defaultdict(list)
            for index, binding in enumerate(bindings):
                if len(binding.indices):
                    by_array[binding.array].append(index)
            named = sorted((self._name_of(array), array) for array in by_array)
            self._arrays[bindings] = tuple(_written_array(name, by_array[array], bindings) for name, array in named)
        return self._arrays[bindings]

    def _name_of(self, array: Key) -> str:
        """A name of an array in which no order of the spec shows: that of an input has the input's name, not its
        number."""
        owner = array.owner
        if owner is None or array != table_of(owner.number):  # anything but the table of an input
            return array.text
        return f"{owner.kind}/{self.network.inputs[owner.number].name}"

    def _clamp(self, change: Change, changed: frozenset[int]) -> bytes:
        """Begin and end clamps, and let those that go on follow the slots that changed. Gives bytes that identify which
        neurons are held at what; a finding, at what a neuron is clamped to, where that is not finite."""
        if not (self._held.active or change.clamps):
            return b""
        before = self._held.copy()
        self._held.follow(changed, self._parameters)
        self._held.end(change.released, self._parameters)
        for clamp in change.clamps:
            self._held.begin(clamp, self._parameters)
        neurons = np.flatnonzero(self._held.order >= 0)
        values = self._held.value[neurons]
        for order in dict.fromkeys(self._held.order[neurons[~np.isfinite(values)]].tolist()):
            clamp = self._held.active[order]
            _, formula = self.events[clamp.event].clamp[_index_in_event(order)]
            check_finite(float(clamp.value.values(self._parameters)), formula, self.findings)
        # nothing changes where the same neurons are held at the same values, by whichever clamp
        if np.array_equal(neurons, np.flatnonzero(before.order >= 0)) and np.array_equal(values, before.value[neurons]):
            return b""
        return neurons.tobytes() + values.tobytes()
