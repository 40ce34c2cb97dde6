"""Idle neurons: those whose activity is 0 at every step, whatever happens elsewhere.

In: a Network. Out: for each group the neurons that nothing reaches, that have no input, bias, initial value or noise,
and that stay at 0 by their model and activation (a cosine would not), while something depends on them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from neurovis_spec.compiler.network import Block, Group, Network
from neurovis_spec.language.expressions.arrays import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS


def idle_neurons(network: Network) -> Iterator[tuple[Group, list[int]]]:
    """Groups with their idle neurons, in the order of the groups."""
    neurons = network.neurons
    idle = (neurons.input < 0) & (neurons.bias == 0) & np.isnan(neurons.initial)
    idle[network.connections.targets] = False
    for noise in network.noises:
        idle[noise.members] = False
    idle &= _needed(network)
    if not idle.any():
        return
    for block in network.blocks:
        idle[block.members] &= _stays_at_zero(block, network.dt)
    for group in neurons.groups:
        members = [member for member in group.indices if idle[member]]
        if members:
            yield group, members


def _needed(network: Network) -> npt.NDArray[np.bool_]:
    """Whether something depends on a neuron: a connection, an output or a rule."""
    n = len(network.neurons)
    needed = np.zeros(n, dtype=np.bool_)
    needed[network.connections.sources] = True
    for output in network.outputs:
        needed[output.neurons] = True
    for plasticity in network.plasticity:
        for signal in plasticity.signals.values():
            needed[signal[signal < n]] = True
    return needed


def _stays_at_zero(block: Block, dt: float) -> npt.NDArray[np.bool_]:
    """Whether the neurons of a block, never driven, keep their states and an activity of 0. Looked at at two steps, so
    that what depends on the time is not taken for idle."""
    count = len(block.members)
    result = np.full(count, block.combine != "product", dtype=np.bool_)
    constants: dict[str, Value] = {**CONSTANTS, "dt": dt, **block.model_parameters}
    states = {state.name: evaluate_array(state.initial, constants) for state in block.model.state}
    for k in (0.0, 7.0):
        values: dict[str, Value] = {**constants, **states, "drive": 0.0, "k": k, "t": k * dt}
        for name, tree in block.model.let:
            values[name] = evaluate_array(tree, values)
        for state in block.model.state:
            for change in (state.each_step, state.each_episode):
                if change is not None:
                    result &= np.broadcast_to(evaluate_array(change, values) == states[state.name], (count,))
        result &= np.broadcast_to(_activity(block, values) == 0, (count,))
    return result


def _activity(block: Block, values: dict[str, Value]) -> Value:
    """The model's activity; f is the neurons' activation."""
    given = {**values, **block.activation_parameters}
    functions = {"f": lambda x: evaluate_array(block.activation.value, {**given, "x": x})}
    return evaluate_array(block.model.activity, values, functions=functions)
