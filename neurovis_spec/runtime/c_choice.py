"""Whether C pays: what compiling costs beside what it saves.

In: a Network and the length of a run. Out: why C is to be taken, or why not. The figures are measured on common
machines (``benchmarks/runtime.py``); they need not be right, only to fall on the right side of factors of ten. What was
compiled before does not count: the last bits of a run must not depend on what was run before it.
"""

from __future__ import annotations

from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime import c_library
from neurovis_spec.runtime.c_backend import SMALL

#: seconds that array code takes a step: for each operation of the program, for each neuron and connection
_OPERATION, _ITEM = 6e-6, 5e-9
#: seconds to compile: at least, for each neuron and connection that is written out, and for each in a table
_COMPILE, _WRITTEN_OUT, _TABLE = 0.12, 1.2e-3, 5e-7
#: and for each block and each plasticity, which are loops
_LOOP = 0.02


def seconds_saved(network: Network, steps: int) -> float:
    """What a run in C saves beside one of array code."""
    items = len(network.neurons) + len(network.connections)
    return steps * (_OPERATION * (len(network.blocks) + len(network.plasticity)) + _ITEM * items)


def seconds_to_compile(network: Network) -> float:
    """What it costs to compile a network."""
    items = len(network.neurons) + len(network.connections)
    loops = len(network.blocks) + len(network.plasticity)
    return _COMPILE + (_WRITTEN_OUT * items if items <= SMALL else _TABLE * items + _LOOP * loops)


def pays(network: Network, steps: int) -> tuple[bool, str]:
    """Whether C pays for a run of so many steps, and why."""
    try:
        name = c_library.compiler().name
    except c_library.CompilerError as error:
        return False, str(error)
    saved = seconds_saved(network, steps)
    if saved > seconds_to_compile(network):
        return True, f"C compiled by {name}, which pays for {steps} steps"
    return False, f"{steps} steps are too few to pay for compiling C"
