"""Changes: what the events of a spec do to a network in a run, step by step.

In: nothing; these are values of a Network, which ``timeline`` makes of events and a run applies. A Change is a
difference: how many there are costs no more than to keep them, and a step costs nothing for those that are past.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray, frozen
from neurovis_spec.compiler.events.settable import ParameterFormula
from neurovis_spec.language.expressions.functions import NUMPY, Library

NO_INDICES: IntArray = frozen(np.zeros(0, dtype=np.int64))


class Clamp(NamedTuple):
    """Neurons held at a value, which follows the parameters; or states, of models, rules and synapses: indices from the
    number of neurons on are those of ``Network.state_places``. Of several clamps of a neuron the one of the highest
    ``order`` holds: the one written last, or by hand after that. ``event`` is what ends it."""

    order: int
    event: int
    neurons: IntArray
    value: ParameterFormula


class Change(NamedTuple):
    """What changes at the beginning of step ``at``.

    ``parameters`` are slots, those that events alone set among them, and what they are set to, by the values that the
    parameters have before this step; ``clamps`` begin, those of the events ``released`` end; neurons and connections
    are lesioned or mended; the rules of connections are switched on or off (``learning``); neurons go back to their
    beginning (``reset``).
    """

    at: int
    parameters: tuple[tuple[int, ParameterFormula], ...] = ()
    clamps: tuple[Clamp, ...] = ()
    released: tuple[int, ...] = ()
    mended_neurons: IntArray = NO_INDICES
    mended_connections: IntArray = NO_INDICES
    lesioned_neurons: IntArray = NO_INDICES
    lesioned_connections: IntArray = NO_INDICES
    learning: tuple[tuple[IntArray, bool], ...] = ()
    reset: IntArray = NO_INDICES


@dataclass
class Held:
    """The clamps that hold at a step: ``order`` is that of the clamp which holds a neuron or a state, −1 where none
    does, and ``value`` what it is held at, both for all that can be clamped, neurons first. What is a spike
    (``spiking``) is held at 1 where it is not 0. ``active`` are all that have not ended, by their order. What a formula
    says is computed ``by`` a library."""

    order: IntArray
    value: FloatArray
    active: dict[int, Clamp]
    spiking: BoolArray

    @classmethod
    def none(cls, spiking: BoolArray) -> Held:
        """No clamp, of all neurons and states; ``spiking`` says of each whether it is a spike."""
        return cls(np.full(len(spiking), -1, dtype=np.int64), np.zeros(len(spiking)), {}, spiking)

    def copy(self) -> Held:
        """The same, of its own."""
        return Held(self.order.copy(), self.value.copy(), dict(self.active), self.spiking)

    def begin(self, clamp: Clamp, parameters: FloatArray, by: Library = NUMPY) -> None:
        """A clamp holds from now on, with these parameters."""
        self.active[clamp.order] = clamp
        self._hold(clamp, clamp.neurons, parameters, by)

    def _hold(self, clamp: Clamp, neurons: IntArray, parameters: FloatArray, by: Library) -> None:
        own = neurons[self.order[neurons] < clamp.order]
        self.order[own] = clamp.order
        self._put(own, clamp, parameters, by)

    def _put(self, which: IntArray, clamp: Clamp, parameters: FloatArray, by: Library) -> None:
        """What a clamp says now, into some values; one that is not finite, which is reported, stays."""
        value = clamp.value.values(parameters, by)
        self.value[which] = np.where(self.spiking[which] & np.isfinite(value), value != 0, value)

    def end(self, events: Collection[int], parameters: FloatArray, by: Library = NUMPY) -> None:
        """The clamps of these events end; those of other events that they have covered hold again."""
        self._end([order for order, clamp in self.active.items() if clamp.event in events], parameters, by)

    def release(self, neurons: IntArray) -> None:
        """No clamp that has begun holds these neurons any more."""
        for order, clamp in list(self.active.items()):
            rest = clamp.neurons[~np.isin(clamp.neurons, neurons)]
            if not len(rest):
                del self.active[order]
            elif len(rest) < len(clamp.neurons):
                self.active[order] = clamp._replace(neurons=rest)
        self.order[neurons] = -1

    def _end(self, orders: list[int], parameters: FloatArray, by: Library) -> None:
        for order in orders:
            del self.active[order]
        free = np.flatnonzero(np.isin(self.order, orders))
        self.order[free] = -1
        if len(free):
            for order in sorted(self.active, reverse=True):
                clamp = self.active[order]
                self._hold(clamp, clamp.neurons[np.isin(clamp.neurons, free)], parameters, by)

    def follow(self, changed: Collection[int], parameters: FloatArray, by: Library = NUMPY) -> None:
        """Parameters have other values now: what is held follows them."""
        if not changed:
            return
        for order, clamp in self.active.items():
            if not clamp.value.slots.isdisjoint(changed):
                self._put(np.flatnonzero(self.order == order), clamp, parameters, by)
