"""NumPy code for a block of neurons: its drive, its states, its activities; and for the signals that leave.

In: a Block. Out: lines in a ``Code``. Sums are made by ``bincount``, which adds in the order of the connections from
0.0 on, and products by ``multiply.reduceat``, which multiplies from left to right: the order of the reference.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.events.settable import BIAS, CENTRES
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Block, Gather, Update, Use
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.runtime.numpy_code import Cell, Code, any_given, emit_change
from neurovis_spec.runtime.signals import SignalLayout

FIRST = "k == 0 and not state.continued"


def emit_gather(code: Code, network: Network, layout: SignalLayout, operation: Gather) -> str:
    """u[t] of a block: what arrives, combined, + bias + input + noise. Gives the identifier of the drive."""
    block = network.blocks[operation.block]
    bias = network.neurons.bias[block.members]
    if len(block.incoming):
        drive = code.let("u", _combined(code, block, network, _signals(code, network, layout, operation.block)))
        # a sum that begins with 0.0 is never −0.0, so adding 0.0 changes nothing; a product may be
        if code.is_set(BIAS) or any_given(bias) or block.combine == "product":
            drive = code.let("u", f"{drive} + {_bias(code, network, block)}")
    elif code.is_set(BIAS):
        drive = code.let("u", f"{'1.0' if block.combine == 'product' else '0.0'} + {_bias(code, network, block)}")
    else:
        drive = code.constant((1.0 if block.combine == "product" else 0.0) + bias)
    drive = _with(code, network, network.neurons.input[block.members], drive)
    return _with(code, network, network.noise_index[block.members], drive)


def _bias(code: Code, network: Network, block: Block) -> str:
    return code.numbers(BIAS, network.neurons.bias, block.members, share=False)


def _with(code: Code, network: Network, fed: IntArray, drive: str) -> str:
    """The drive and, for each member, the number of the step's vector that ``fed`` points to (−1: none)."""
    given = np.flatnonzero(fed >= 0)
    if not len(given):
        return drive
    values = code.select("s", fed[given], network.vector_size, broadcast=True)
    if len(given) == len(fed):
        return code.let("u", f"{drive} + {values}")
    drive = code.let("u", f"np.array({drive})")
    code.line(f"{drive}{code.position(given, len(fed))} += {values}")
    return drive


def _signals(code: Code, network: Network, layout: SignalLayout, number: int) -> str:
    """What arrives at a block, in the order of its connections."""
    connections, block = network.connections, network.blocks[number]
    delays = connections.delays[block.incoming]
    parts: dict[int, str] = {}
    now = block.incoming[delays == 0]
    if len(now):
        weights = code.select("weights", now, len(connections))
        parts[0] = f"{weights} * {code.select('activity', connections.sources[now], len(network.neurons))}"
    for kind in layout.classes:
        inside = np.flatnonzero(kind.blocks == number)
        if len(inside):
            start, stop = (kind.start + kind.delay * int(i) for i in (inside[0], inside[-1] + 1))
            slots = _slots(code, start, stop, kind.delay)
            arriving = np.isin(kind.connections[inside], block.incoming)
            if not arriving.any():  # a lesion: what is under way there never arrives
                continue
            if not arriving.all():
                slots = code.select(code.let("g", slots), np.flatnonzero(arriving), len(arriving))
            parts[kind.delay] = slots
    if len(parts) == 1:
        return code.let("g", next(iter(parts.values())))
    signals = code.let("g", f"np.empty({len(delays)})")
    for delay, part in parts.items():
        code.line(f"{signals}{code.position(np.flatnonzero(delays == delay), len(delays))} = {part}")
    return signals


def _slots(code: Code, start: int, stop: int, delay: int) -> str:
    """The slots of this step of connections that are stored next to each other."""
    if delay == 1:
        return code.view("signals", f"{start}:{stop}")
    return f"signals[{start} + {code.slot(delay)}:{stop}:{delay}]"


def _combined(code: Code, block: Block, network: Network, signals: str) -> str:
    count = len(block.members)
    if block.combine == "product":
        return _product(code, block, signals)
    slots = code.constant(np.ascontiguousarray(block.slots, dtype=np.intp))
    if block.combine == "sum":
        return f"bincount({slots}, {signals}, {count})"
    centres = network.connections.centres[block.incoming]
    if code.is_set(CENTRES) or any_given(centres):
        taken = code.numbers(CENTRES, network.connections.centres.whole(), block.incoming, share=False)
        signals = code.let("g", f"{signals} - {taken}")
    return f"np.sqrt(bincount({slots}, {signals} * {signals}, {count}))"


def _product(code: Code, block: Block, signals: str) -> str:
    order = np.argsort(block.slots, kind="stable")
    filled, starts = np.unique(block.slots[order], return_index=True)
    sorted_signals = code.select(signals, order, len(order))
    product = f"multiply.reduceat({sorted_signals}, {code.constant(starts.astype(np.intp))})"
    if len(filled) == len(block.members):
        return product
    whole = code.let("u", f"np.ones({len(block.members)})")
    code.line(f"{whole}{code.position(filled, len(block.members))} = {product}")
    return whole


def emit_update(code: Code, network: Network, operation: Update, drive: str) -> None:
    """The states of a block from old states and the drive; activities from the new ones; the episode's end. At step 0,
    neurons with ``initial`` take it, and their states stay."""
    block, number = network.blocks[operation.block], operation.block
    model, activation = block.model, block.activation
    initial = network.neurons.initial[block.members]
    mask, first = ("", "") if np.isnan(initial).all() else map(code.constant, (~np.isnan(initial), initial.copy()))

    def taken(value: str, kept: str) -> str:
        return f"np.where({mask}, {kept}, {value}) if {FIRST} else {value}" if mask else value

    def cell(name: str) -> Cell:
        now = code.state(model, name)
        return Cell(now, f"{now}[:]", lambda value: taken(value, now))

    functions = {
        name: lambda argument, value=value: _called(code, activation, value, argument)
        for name, value in activation.definition.functions.items()
    }
    seen = code.parameters(model) | {"drive": drive}
    cells = {one.name: cell(one.name) for one in model.definition.state}
    activity = emit_change(code, model.definition, seen, cells, network.episode, functions)["activity"]
    place = code.position(block.members, len(network.neurons))
    code.line(f"activity{place} = {taken(activity, first)}")
    code.line(f"if holds and holds[{number}]: activity[holds[{number}][0]] = holds[{number}][1]")


def _called(code: Code, activation: Use, value: Tree, argument: str) -> str:
    """A function of an activation of an argument, which gets an identifier of its own so that it is computed once."""
    x = argument if argument.isidentifier() else code.let("x", argument)
    return code.expression(value, code.parameters(activation) | {"x": x})


def emit_send(code: Code, network: Network, layout: SignalLayout) -> None:
    """w[t]·a[t] of every delayed connection leaves its source; a[t] is remembered for ``pre``."""
    connections = network.connections
    for kind in layout.classes:
        weights = code.select("weights", kind.connections, len(connections))
        sources = code.select("activity", connections.sources[kind.connections], len(network.neurons))
        code.line(f"multiply({weights}, {sources}, {_slots(code, kind.start, kind.stop, kind.delay)})")
