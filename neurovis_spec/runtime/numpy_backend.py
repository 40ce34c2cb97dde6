"""The NumPy backend: the update program as one function of array code, made for one network.

In: a Network. Out: a Stepper whose ``step`` is that function. It is as quick as array code written by
hand, and needs nothing but NumPy.
"""

from __future__ import annotations

from dataclasses import replace

from neurovis_spec.compiler.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Block, Gather, Learn, ReadInputs, Send, Update
from neurovis_spec.runtime.backend import Availability, Capabilities
from neurovis_spec.runtime.conditions import Mask, Structure
from neurovis_spec.runtime.numpy_blocks import emit_gather, emit_send, emit_update
from neurovis_spec.runtime.numpy_code import Code
from neurovis_spec.runtime.numpy_learn import emit_history, emit_learn
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.state import State, history_depth


class NumpyStepper:
    """The function of one network, made anew where the structure of a step is another."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self._structure: Structure | None = None

    def step(self, state: State, inputs: FloatArray, /) -> None:
        """Advance the state by a step."""
        if state.conditions.structure is not self._structure:
            self._structure = state.conditions.structure
            self._made = step_code(self.network, self._structure).compiled()
        self._made(state, inputs)


class NumpyBackend:
    """Array code made from the update program."""

    name = "numpy"
    capabilities = Capabilities(noise=True)

    def availability(self) -> Availability:
        """Always there."""
        return Availability(True, "array code made for each network")

    def prepare(self, network: Network) -> NumpyStepper:
        """Make the functions of one network."""
        return NumpyStepper(network)


def step_code(network: Network, structure: Structure) -> Code:
    """The code of one step, operation by operation, without what the structure leaves out."""
    code, layout, depth = Code(network.dt, network.settable.variables), signal_layout(network), history_depth(network)
    if structure.gone.any():
        network = replace(network, blocks=tuple(_without(block, structure.gone) for block in network.blocks))
    drives: dict[int, str] = {}
    for operation in network.program:
        match operation:
            case ReadInputs():
                pass  # done by the caller: ``s`` holds them
            case Gather(block=number):
                drives[number] = emit_gather(code, network, layout, operation)
            case Update(block=number):
                emit_update(code, network, operation, drives[number])
            case Send():
                emit_send(code, network, layout)
                emit_history(code, depth)
            case Learn(plasticity=number):
                emit_learn(code, network, number, depth, structure.still)
    return code


def _without(block: Block, gone: Mask) -> Block:
    """A block without some connections."""
    keep = ~gone[block.incoming]
    return block if keep.all() else replace(block, incoming=block.incoming[keep], slots=block.slots[keep])
