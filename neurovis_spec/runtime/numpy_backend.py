"""The NumPy backend: the update program as one function of array code, made for one network.

In: a Network. Out: a Runner that calls that function. It is as quick as array code written by hand, and needs nothing
but NumPy.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from neurovis_spec.arrays import FloatArray, subscript
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Population
from neurovis_spec.runtime.backend import Availability, Capabilities
from neurovis_spec.runtime.lags import lags_of
from neurovis_spec.runtime.numpy_arrivals import Step
from neurovis_spec.runtime.numpy_code import Code
from neurovis_spec.runtime.numpy_operations import emit
from neurovis_spec.runtime.presynaptic import history_depth
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.stages import port_with
from neurovis_spec.runtime.state import Mask, State, Structure
from neurovis_spec.runtime.watch import all_finite, carried_by


class NumpyStepper:
    """The function of one network, made anew where the structure of a step is another."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self._structure: Structure | None = None
        self._own_signals = False
        self._changing = subscript(network.changing)

    def step(self, state: State, inputs: FloatArray, /) -> None:
        """Advance the state by a step."""
        for _ in self._steps(state, (inputs,)):
            pass

    def run(
        self, state: State, vectors: FloatArray, activity: FloatArray, weights: FloatArray, every: int, look: bool
    ) -> int:
        """Advance the state by a step for each row of ``vectors``, as a Runner does."""
        own, learned, changing = state.activity, state.weights, self._changing
        carried, first, row = carried_by(self.network, state), state.k, 0
        steps = self._steps(state, vectors)
        for k in range(first, first + len(vectors)):
            kept = k % every == 0
            if kept and changing is not None and weights.shape[1]:
                weights[row] = learned[changing]
            next(steps)
            if kept:
                activity[row] = own
                row += 1
            if look and not all_finite(carried):
                break
        return state.k - first

    def _steps(self, state: State, vectors: Iterable[FloatArray]) -> Iterator[None]:
        if state.conditions.structure is not self._structure or state.own_signals != self._own_signals:
            self._structure, self._own_signals = state.conditions.structure, state.own_signals
            self._made = step_code(self.network, self._structure, self._own_signals).compiled()
        return self._made(state, vectors)


class NumpyBackend:
    """Array code made from the update program."""

    name = "numpy"
    capabilities = Capabilities(noise=True, flows=True, synapses=True, spikes=True, clamped_states=True)

    def availability(self) -> Availability:
        """Always there."""
        return Availability(True, "array code made for each network")

    def prepare(self, network: Network) -> NumpyStepper:
        """Make the functions of one network."""
        return NumpyStepper(network)


def step_code(network: Network, structure: Structure, own_signals: bool = False) -> Code:
    """The code of one step, operation by operation, without what the structure leaves out."""
    layout = signal_layout(network, own_signals)  # where all has its place, what is left out too
    whole = network
    if structure.gone.any():
        populations = tuple(_without(population, structure.gone) for population in network.populations)
        network = replace(network, populations=populations)
    code = Code(network.dt, network.settable.variables)
    step = Step(code, whole, network, structure, layout, history_depth(network), lags_of(network), {})
    if stateful := tuple(one.use.owner for one in network.projections if one.use.definition.holdable):
        code.line(f"if fixed: hold_cells(fixed, {code.constant(stateful)}, cells)")
    for operation in network.program:
        emit(operation, step)
    return code


def _without(population: Population, gone: Mask) -> Population:
    """A population without some connections."""
    if not any(gone[port.incoming].any() for port in population.ports):
        return population
    return replace(population, ports=tuple(port_with(port, ~gone[port.incoming]) for port in population.ports))
