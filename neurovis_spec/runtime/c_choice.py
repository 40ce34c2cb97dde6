"""Whether C pays: what compiling costs beside what it saves.

In: a Network and the length of a run. Out: why C is to be taken, or why not. The figures are measured on common
machines (``benchmarks/runtime.py``); they need not be right, only to fall on the right side of factors of ten. What was
compiled before does not count: the last bits of a run must not depend on what was run before it.
"""

from __future__ import annotations

from pathlib import Path

from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime import c_library
from neurovis_spec.runtime.c_backend import SMALL

#: seconds that array code takes a step: for each operation of the program, for each neuron and connection
_OPERATION, _ITEM = 6e-6, 5e-9
#: seconds to compile anything; with zig, which compiles a part of the C library for itself when it is first used
_COMPILE, _COMPILE_WITH_ZIG = 0.12, 5.0
#: seconds to compile, besides: for each neuron and connection that is written out, and for each in a table
_WRITTEN_OUT, _TABLE = 1.2e-3, 5e-7
#: and for each block and each plasticity, which are loops
_LOOP = 0.02


def seconds_saved(network: Network, steps: int) -> float:
    """What a run in C saves beside one of array code."""
    items = len(network.neurons) + len(network.connections)
    return steps * (_OPERATION * (len(network.blocks) + len(network.plasticity)) + _ITEM * items)


def seconds_to_compile(network: Network, compiler: c_library.Compiler) -> float:
    """What it costs to compile a network."""
    zig = any(Path(word).stem in ("zig", "ziglang") for word in compiler.command)
    least = _COMPILE_WITH_ZIG if zig else _COMPILE
    items = len(network.neurons) + len(network.connections)
    loops = len(network.blocks) + len(network.plasticity)
    return least + (_WRITTEN_OUT * items if items <= SMALL else _TABLE * items + _LOOP * loops)


def pays(network: Network, steps: int) -> tuple[bool, str]:
    """Whether C pays for a run of so many steps, and why."""
    try:
        compiler = c_library.compiler()
    except c_library.CompilerError as error:
        return False, str(error)
    saved = seconds_saved(network, steps)
    if saved > seconds_to_compile(network, compiler):
        return True, f"C compiled by {compiler.name}, which pays for {steps} steps"
    return False, f"{steps} steps are too few to pay for compiling C"
