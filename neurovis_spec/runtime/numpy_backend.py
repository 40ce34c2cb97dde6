"""The NumPy backend: the update program as one function of array code, made for one network.

In: a Network. Out: a Stepper whose ``step`` is that function. It is as quick as array code written by
hand, and needs nothing but NumPy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from neurovis_spec.compiler.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Gather, Learn, ReadInputs, Send, Update
from neurovis_spec.runtime.backend import Availability, Capabilities
from neurovis_spec.runtime.numpy_blocks import emit_gather, emit_send, emit_update
from neurovis_spec.runtime.numpy_code import Code
from neurovis_spec.runtime.numpy_learn import emit_history, emit_learn
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.state import State, history_depth


@dataclass(frozen=True, slots=True)
class NumpyStepper:
    """``step`` is the function made; ``text`` is its code, to read."""

    step: Callable[[State, FloatArray], None]
    text: str


class NumpyBackend:
    """Array code made from the update program."""

    name = "numpy"
    capabilities = Capabilities(noise=True)

    def availability(self) -> Availability:
        """Always there."""
        return Availability(True, "array code made for each network")

    def prepare(self, network: Network) -> NumpyStepper:
        """Make the function of one network."""
        code = step_code(network)
        return NumpyStepper(code.compiled(), code.text())


def step_code(network: Network) -> Code:
    """The code of one step, operation by operation."""
    code, layout, depth = Code(network.dt), signal_layout(network), history_depth(network)
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
                emit_learn(code, network, number, depth)
    return code
