"""The watch: one warning, at once, when something that a run computes is no longer a finite number.

In: the inputs of the steps to come, the State after each step. Out: at most one RuntimeWarning in a run, which names
the step and the neuron or the connection whose activity, weight, state or input it is.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from itertools import chain
from math import isfinite

import numpy as np

from neurovis_spec.arguments import callers_level
from neurovis_spec.arrays import BoolArray, FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Check
from neurovis_spec.runtime.backend import Stepper
from neurovis_spec.runtime.state import Cells, State

#: The longest array that is squared at once. A longer one BLAS shares among threads, which takes a thousand times as
#: long as the product where the processors have other work to do.
_LONGEST_SQUARED = 8192
#: What is said of an undefined operation that no number shows.
_HIDDEN = "which the rest of the formula hides"


class Watch:
    """Looks at the state after each step until it has warned."""

    def __init__(self, network: Network) -> None:
        self._network, self._carried = network, _Carried(network)
        #: of those steps to come at which an input is wrong: all inputs, and which of them hide what is undefined. Of
        #: others only those behind which something is not finite need a check
        self.waiting: dict[int, tuple[FloatArray, BoolArray | None]] = {}
        self.warned = False

    def take_inputs(self, first: int, vectors: FloatArray, hidden: BoolArray | None = None) -> None:
        """Take the inputs of the steps from ``first`` on, a row a step; ``check`` warns of them at their step.
        ``hidden`` are those in whose formulas something is undefined that their numbers do not show."""
        wrong = ~np.isfinite(vectors).all(axis=1)
        if hidden is not None:
            wrong |= hidden.any(axis=1)
        rows = np.flatnonzero(wrong).tolist()
        self.waiting = {first + row: (vectors[row], None if hidden is None else hidden[row]) for row in rows}

    def take_inputs_at(self, k: int, vector: FloatArray, replaced: Iterable[str]) -> None:
        """Take the inputs of step k alone, where they are known only then: these (``replaced``) do not come from their
        formulas."""
        _, hidden = self.waiting.pop(k, (vector, None))
        if hidden is not None:
            hidden = hidden.copy()
            for entry in map(self._network.input_index.__getitem__, replaced):
                hidden[entry.start : entry.start + entry.size] = False
        if not all_finite([vector]) or (hidden is not None and hidden.any()):
            self.waiting[k] = vector, hidden

    def next_stop(self, k: int, stop: int) -> int:
        """How far steps from k on may be made, ``stop`` at most, before one must be checked: one behind the first
        whose inputs are not finite."""
        return stop if self.warned else min((step + 1 for step in self.waiting if k <= step < stop), default=stop)

    def check(self, state: State) -> None:
        """Warn if something of the step just made is NaN or infinite."""
        if self.warned:
            return
        if all_finite(self._carried.by(state)) and state.k - 1 not in self.waiting:
            return
        message = next(self._messages(state), None)
        if message is not None:
            self.warned = True
            message = f"{message}, in '{self._network.name}'{self._why(state)}"
            warnings.warn(message, RuntimeWarning, stacklevel=callers_level())

    def _why(self, state: State) -> str:
        """That a step is too long for what is integrated, where that is so; "" else."""
        if self._network.integration is None:
            return ""
        from neurovis_spec.runtime.stiffness import stiffest_of_run

        worst = stiffest_of_run(self._network, state.k, state.conditions)
        if worst is None:
            return ""
        message, hint = worst._replace(step=None).words(self._network)  # its step may be another in this run
        return f" (stiff-step: {message}; {hint})"

    def _messages(self, state: State) -> Iterator[str]:
        """What is not finite: what shows it best comes first."""
        step, network, lesioned = state.k - 1, self._network, state.conditions.lesioned_neurons
        names = network.neurons.names
        for index in _wrong(state.activity):
            yield f"the activity of {names[index]} is {state.activity[index]} at step {step}"
        for index in _wrong(state.weights):
            yield f"the weight of {network.connection_names[index]} is {state.weights[index]} after step {step}"
        for holder, use in network.uses:
            of_neurons = use.definition.kind.each == "neuron"
            when = f"{'at' if of_neurons else 'after'} step {step}"
            for quantity in use.definition.kept:
                values = state.cells[use.owner][quantity.name]
                for member, value in ((holder.members[index], values[index]) for index in _wrong(values)):
                    name = names[member] if of_neurons else network.connection_names[member]
                    if not isinstance(quantity, Check):
                        what = "output" if quantity in use.definition.outputs else "state"
                        yield f"the {what} '{quantity.name}' of {name} is {value} {when}"
                    # of a check the name says all; what a lesioned neuron computes is for nobody
                    elif not (of_neurons and lesioned[member]):
                        yield f"{quantity.name} for {name} {when}, {_HIDDEN}"
        vector, hidden = self.waiting.get(step, (np.zeros(0), None))
        for index in _wrong(vector):
            yield f"the {self._input_name(index)} is {vector[index]} at step {step}"
        for index in () if hidden is None else np.flatnonzero(hidden).tolist():
            yield f"the {self._input_name(index)} has an undefined operation at step {step}, {_HIDDEN}"

    def _input_name(self, index: int) -> str:
        """What a number of the vector of all inputs is: whose noise, or whose input by its name."""
        network = self._network
        names = network.neurons.names
        for noise in network.noises:
            if noise.start <= index < noise.start + len(noise.members):
                return f"noise of {names[noise.members[index - noise.start]]}"
        entry = next(entry for entry in network.inputs if entry.start <= index < entry.start + entry.size)
        takers = np.flatnonzero(network.neurons.input == index)
        return f"input '{entry.name}'" + (f" of {names[takers[0]]}" if len(takers) else "")


class Checked:
    """A stepper that computes no inputs, and what it is then asked: whether something is not finite (``Reading``)."""

    def __init__(self, network: Network, stepper: Stepper) -> None:
        self._stepper, self._carried = stepper, _Carried(network)
        #: the inputs of the step that was made last
        self.vector: FloatArray = np.zeros(network.vector_size)

    def read(self, computed: frozenset[str]) -> None:
        """There are none that it computes."""

    def advance(self, state: State, inputs: FloatArray, computed: frozenset[str], /) -> bool:
        """Make a step; whether something is not finite behind it, an input, too."""
        self.vector = inputs
        with np.errstate(all="ignore"):
            self._stepper.step(state, inputs)
            return not (all_finite(self._carried.by(state)) and all_finite([inputs]))


class _Carried:
    """What the states of a network carry (``carried_by``), worked out anew only where the arrays are others."""

    def __init__(self, network: Network) -> None:
        self._network, self._pieces = network, list[FloatArray]()
        self._activity = self._weights = np.zeros(0)
        self._cells: Cells | None = None

    def by(self, state: State) -> list[FloatArray]:
        """By this one, in pieces."""
        if state.activity is not self._activity or state.weights is not self._weights or state.cells is not self._cells:
            self._activity, self._weights, self._cells = state.activity, state.weights, state.cells
            self._pieces = carried_by(self._network, state)
        return self._pieces


def carried_by(network: Network, state: State) -> list[FloatArray]:
    """What a state carries to the next step and may not be finite, in pieces. Where activities and weights are, the
    signals that leave, products of both, are as well."""
    learned = [state.weights] if network.projections else []
    arrays = [state.activity, *learned, *chain.from_iterable(own.values() for own in state.cells.values())]
    return [piece for values in arrays for piece in _pieces(values)]


def _pieces(values: FloatArray) -> list[FloatArray]:
    if len(values) <= _LONGEST_SQUARED:
        return [values]
    return [values[first : first + _LONGEST_SQUARED] for first in range(0, len(values), _LONGEST_SQUARED)]


def all_finite(pieces: list[FloatArray]) -> bool:
    """Whether all numbers of all of these are finite."""
    # A sum of squares is finite only if all terms are: one cheap product instead of a test each. If it is not, it may
    # be the sum that overflows: then each number is tested.
    for values in pieces:
        if isfinite(values.dot(values)):
            continue
        if _wrong(values):
            return False
    return True


def _wrong(values: FloatArray) -> list[int]:
    """Where values are not finite."""
    return np.flatnonzero(~np.isfinite(values)).tolist()
