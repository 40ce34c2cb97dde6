"""The Simulation: a network run step by step, for a control loop.

In: values for inputs, at each step. Out: the outputs of the step; activities and weights to look at; parameters that
can be set from now on; states that can be kept and gone back to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import suggest
from neurovis_spec.runtime.backend import Backend, prepare
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.phases import go_over, network_at
from neurovis_spec.runtime.recording import Recording, unknown
from neurovis_spec.runtime.resume import resumed_state
from neurovis_spec.runtime.state import State, initial_state
from neurovis_spec.runtime.watch import Watch

Rebind: TypeAlias = Callable[[Mapping[str, float], int | None], Network]


class ParameterError(ValueError):
    """A parameter that does not exist, or cannot be set in a run."""


class Simulation:
    """A run in the making.

    ``start`` is a recording to go on from (see ``resume``); ``rebind`` makes the network with other values of
    parameters, those that it has at a step (None: before the first), without it ``set`` is refused. Raises
    BackendError, RecordingError.
    """

    def __init__(
        self,
        network: Network,
        backend: str | Backend | None = None,
        start: Recording | None = None,
        rebind: Rebind | None = None,
    ) -> None:
        self._original, self._backend, self._rebind = network, backend, rebind
        self._begin = initial_state(network) if start is None else resumed_state(network, start)
        go_over(self._begin, network, network_at(network, 0))
        #: what was set by hand, and the step of the last time
        self._chosen: dict[str, float] = {}
        self._since = 0
        self._use(network)
        self._watch = Watch(network)
        self._state = self._begin.copy()

    def _use(self, network: Network, step: int = 0) -> None:
        """Run a network from a step on."""
        self.network = network
        self._enter(network_at(network, step))

    def _enter(self, phase: Network) -> None:
        self._stepper = prepare(phase, self._backend)
        self._reader = InputReader(phase)
        self._phase = phase

    @property
    def k(self) -> int:
        """The step that is computed next: 0 before the first, so the number of steps made."""
        return self._state.k

    @property
    def activity(self) -> FloatArray:
        """a[k−1] of all neurons (n,), a copy; NaN before the first step."""
        if self._state.k == 0:
            return np.full(len(self.network.neurons), np.nan)
        return self._state.activity.copy()

    @property
    def weights(self) -> FloatArray:
        """w[k], for the next step, of the connections that can change, in the order of a ``.npz``; a copy."""
        return self._state.weights[self._original.changing]

    def weight(self, name: str) -> float:
        """w[k] of any connection by name. Raises KeyError with the nearest names."""
        index = self.network.connection_index.get(name)
        if index is None:
            raise unknown("connection", name, self.network.connection_names)
        return float(self._state.weights[index])

    def step(
        self, values: Mapping[str, npt.ArrayLike] | None = None, /, **inputs: npt.ArrayLike
    ) -> Mapping[str, np.float64 | FloatArray]:
        """Compute step k; values replace the sources of inputs for this step only.

        Gives the outputs by name: a number for a single neuron, else an array; an empty mapping where the spec declares
        none. Raises InputError, and then no step was made.
        """
        vector = self._reader.at(self._state.k, {**(values or {}), **inputs})
        with np.errstate(all="ignore"):
            self._stepper.step(self._state, vector)
            self._watch.look(self._state)
        # The events of the next step apply now, so that ``weights`` are those of the next step.
        phase = network_at(self.network, self._state.k)
        if phase is not self._phase:
            go_over(self._state, self._phase, phase)
            self._enter(phase)
        activity = self._state.activity
        return {
            entry.name: np.float64(activity[entry.neurons[0]]) if entry.scalar else activity[entry.neurons]
            for entry in self.network.outputs
        }

    def set(self, values: Mapping[str, float] | None = None, /, **parameters: float) -> None:
        """Give parameters other values from step k on, until an event of a later step sets them again.

        Fixed weights, biases, inputs and parameters of models and rules follow; plastic weights, states and signals
        under way stay. Raises ParameterError, and then nothing has changed.
        """
        checked = self._checked({**(values or {}), **parameters})
        k, before = self._state.k, self._phase
        # what events have set by now stays; before the first step none has, they come after what is set by hand
        self._use(self._bound(self._chosen | (dict(before.given) if k else {}) | checked, k), k)
        go_over(self._state, before, self._phase)
        self._chosen |= checked
        self._since = k

    def _bound(self, given: Mapping[str, float], step: int) -> Network:
        """The network with these parameters from a step on. Raises ParameterError."""
        if self._rebind is None:
            raise ParameterError("this simulation was made without a way to compile the network again")
        network = self._rebind(given, step or None)
        if not _same_structure(self.network, network):
            raise ParameterError("with these parameters the network has another structure")
        return network

    def _checked(self, values: Mapping[str, float]) -> dict[str, float]:
        for name, value in values.items():
            if name not in self.network.parameters:
                hint = suggest(name, self.network.parameters, "the parameters are")
                raise ParameterError(f"no parameter '{name}'" + (f"; {hint}" if hint else "; the network has none"))
            if name in self.network.structural:
                raise ParameterError(
                    f"parameter '{name}' cannot be set in a run: the structure of the network depends on it"
                )
            if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not np.isfinite(value):
                raise ParameterError(f"parameter '{name}' takes a finite number, not {value!r}")
        return {name: float(value) for name, value in values.items()}

    def reset(self) -> None:
        """Back to the beginning, with the parameters of the beginning."""
        self._use(self._original)
        self._watch = Watch(self._original)
        self._state, self._chosen, self._since = self._begin.copy(), {}, 0

    def state(self) -> State:
        """A copy of all that the run carries from step to step."""
        return self._state.copy()

    def restore(self, state: State) -> None:
        """Go on from a state of this simulation. Parameters that were set by hand stay as they are, and so do the fixed
        weights; what events set goes by the step."""
        restored = state.copy()
        k, network = restored.k, self.network
        if k < self._since and self._original.phases:  # events between the two steps are to come again
            stay = {name: self._phase.given.get(name, value) for name, value in self._chosen.items()}
            network = self._bound({**(network_at(self._original, k).given if k else {}), **stay}, k)
            self._since = k
        self._use(network, k)
        fixed = self.network.connections.rules < 0
        restored.weights[fixed] = self._phase.connections.weights[fixed]
        self._state = restored


def _same_structure(one: Network, other: Network) -> bool:
    """Whether states of one are states of the other."""
    a, b = one.connections, other.connections
    return (
        one.neurons.names == other.neurons.names
        and len(a) == len(b)
        and all(
            np.array_equal(x, y)
            for x, y in (
                (a.sources, b.sources),
                (a.targets, b.targets),
                (a.delays, b.delays),
                (a.rules, b.rules),
            )
        )
        and [len(block.members) for block in one.blocks] == [len(block.members) for block in other.blocks]
        and [len(block.model.state) for block in one.blocks] == [len(block.model.state) for block in other.blocks]
        and [entry.rule.name for entry in one.plasticity] == [entry.rule.name for entry in other.plasticity]
        and [entry.name for entry in one.inputs] == [entry.name for entry in other.inputs]
    )
