"""Trials: runs of a network from one and the same state, each with something changed.

In: a compiled network, the step at which the trials begin, how many steps they have. Out: the outputs of a trial, step
by step. The run up to the first step is made once, and so is the code that makes steps.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from neurovis_spec import arguments
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.network import Input, Network
from neurovis_spec.runtime.backend import Stepper, ready
from neurovis_spec.runtime.columns import ALL, columns_of
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.embodied import embodied
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.record import InMemory, Last, go
from neurovis_spec.runtime.rows import RowSink, Steps
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.state import State, initial_state

#: Steps of a trial where nothing else is asked for.
STEPS = 500


@dataclass(frozen=True)
class _Turned:
    """A stepper that is given other inputs: ``seen`` is given those of each step, and says which it is to take."""

    stepper: Stepper
    seen: Callable[[FloatArray], FloatArray]

    def step(self, state: State, inputs: FloatArray, /) -> None:
        self.stepper.step(state, self.seen(inputs))


class Trials:
    """Trials of ``steps`` steps from step ``start`` on, by default the last ones of ``time.steps``; ``inputs`` replace
    sources of inputs as in ``run``, ``of`` are the neurons that count as outputs (default: the spec's outputs, else
    those that send to nobody). Raises KeyError, ValueError where there are no outputs."""

    def __init__(
        self,
        compiled: CompiledNetwork,
        start: int | None = None,
        steps: int | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        of: str | Sequence[str] | None = None,
    ) -> None:
        network = compiled.network
        count = min(STEPS, network.steps) if steps is None else arguments.integer("steps", steps, 1, 1 << 40)
        first = max(network.steps - count, 0) if start is None else arguments.integer("start", start, 0, 1 << 40)
        self.network, self.start, self.steps, self._inputs = network, first, count, inputs
        self.outputs = output_neurons(network) if of is None else _neurons(network, of)
        if not len(self.outputs):
            raise ValueError("the network has no outputs: name the neurons that count as outputs")
        self._made, self._body = ready(network), embodied(network)
        self._simulation = Simulation(network, self._made, inputs=inputs, body=self._body)
        self._state = initial_state(network)
        self._widths = columns_of(network, ALL, self._body).widths(network)
        course = Course(first, inputs=inputs, backend=self._made, body=self._body)
        _go(network, self._state, course, Last(self._widths))
        if self._body is not None:
            self._body.put(self._state)
        vectors: list[FloatArray] = []

        def noted(vector: FloatArray) -> FloatArray:
            vectors.append(vector.copy())
            return vector

        #: what the network does with nothing changed: all activities (steps, neurons), and the inputs that it is given
        self.activity = self._run(self._state.copy(), noted)
        self.given = np.array(vectors).reshape(count, -1)
        self.intact = self.activity[:, self.outputs]

    @property
    def weights(self) -> FloatArray:
        """w[start] of all connections (m,)."""
        return self._state.weights

    def parameter(self, name: str) -> float:
        """The value of a parameter at the first step."""
        return float(self._state.conditions.parameters[self.network.settable.index[name]])

    def changed(self, change: Callable[[Simulation], None]) -> FloatArray:
        """The outputs (steps, outputs) where something was done to the simulation before the first step."""
        self._simulation.restore(self._state)
        change(self._simulation)
        return self._run(self._simulation.state())[:, self.outputs]

    def with_weight(self, connection: int, more: float) -> FloatArray:
        """The outputs (steps, outputs) with a connection's weight increased by ``more`` from the first step on."""
        state = self._state.copy()
        state.weights[connection] += more
        return self._run(state)[:, self.outputs]

    def with_input(self, entry: Input, other: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """The outputs (steps, outputs) with an input replaced: ``other`` makes of its values others, at each step."""
        own = slice(entry.start, entry.start + entry.size)

        def seen(vector: FloatArray) -> FloatArray:
            replaced = vector.copy()
            replaced[own] = other(vector[own])
            return replaced

        return self._run(self._state.copy(), seen)[:, self.outputs]

    def _run(self, state: State, seen: Callable[[FloatArray], FloatArray] | None = None) -> FloatArray:
        rows = InMemory(self._widths, self.steps)
        made = self._made if seen is None else replace(self._made, stepper=_Turned(self._made.stepper, seen))
        course = Course(self.steps, inputs=self._inputs, backend=made, body=self._body)
        _go(self.network, state, course, rows)
        return rows.numbers(Steps(self.steps, 1, self.start)).rows.activity


def _go(network: Network, state: State, course: Course, rows: RowSink) -> None:
    """Make the steps. What is no longer finite is seen in the numbers: hundreds of trials need not warn of it each."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        go(network, state, course, rows)


def output_neurons(network: Network) -> IntArray:
    """The neurons of the spec's outputs, else those of the role output, else those that send to no other."""
    found = {index for output in network.outputs if not output.states for index in output.neurons.tolist()}
    if not found:
        found = {index for group in network.neurons.groups if group.role == "output" for index in group.indices}
    if not found:
        sources, targets = network.connections.sources.whole(), network.connections.targets.whole()
        found = set(targets.tolist()) - set(sources[sources != targets].tolist())
    return np.array(sorted(found), dtype=np.int64)


def _neurons(network: Network, of: str | Sequence[str]) -> IntArray:
    from neurovis_spec.runtime.names import names_of

    result: dict[int, None] = {}
    names = names_of(network)
    for reference in arguments.texts("of", of):
        found = names.find(reference)
        if isinstance(found, str):
            raise RecordingError(found)
        result.update(dict.fromkeys(found.neurons))
    return np.array(list(result), dtype=np.int64)
