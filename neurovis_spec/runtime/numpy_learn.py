"""NumPy code for plasticity: w[t+1] and the states of a rule, for all connections that share it.

In: a Plasticity. Out: lines in a ``Code``. New values are all computed before the first old one is replaced.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.events.settable import HIGH, LOW
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Plasticity
from neurovis_spec.runtime.numpy_code import Cell, Code, emit_change
from neurovis_spec.runtime.state import NOTHING, Structure


def emit_history(code: Code, depth: int) -> None:
    """a[t] into its row of the history."""
    if depth:
        code.line(f"history[k % {depth}] = activity")


def emit_learn(code: Code, network: Network, number: int, depth: int, structure: Structure) -> None:
    """The rule of a plasticity at a step and, where it has one, at an episode's end; not of connections that are
    ``still`` in this structure."""
    plasticity, some = network.plasticity[number], None
    moving = ~structure.still[plasticity.members]
    if not moving.all():
        some = np.flatnonzero(moving)
        if not len(some):
            return
        signals = {name: indices[some] for name, indices in plasticity.signals.items()}
        plasticity = replace(plasticity, members=plasticity.members[some], signals=signals)
    rule, place = plasticity.rule, "" if some is None else f"[{code.constant(some)}]"
    seen = code.parameters(rule, some) | _seen(code, network, plasticity, depth, structure.lost[plasticity.members])
    states = {one.name: code.state(rule, one.name) for one in rule.definition.state}
    cells = {name: Cell(f"{state}{place}", f"{state}{place or '[:]'}") for name, state in states.items()}
    count = len(network.connections)
    cells["weight"] = Cell(
        code.select("weights", plasticity.members, count),
        f"weights{code.position(plasticity.members, count)}",
        lambda weight: _bounded(code, network, plasticity, weight),
    )
    emit_change(code, rule.definition, seen, cells, network.episode)


def _bounded(code: Code, network: Network, plasticity: Plasticity, weight: str) -> str:
    members = plasticity.members
    for function, array, values in (
        ("maximum", LOW, network.connections.low.whole()),
        ("minimum", HIGH, network.connections.high.whole()),
    ):
        if code.is_set(array) or np.isfinite(values[members]).any():
            weight = f"np.{function}({weight}, {code.numbers(array, values, members, share=False)})"
    return weight


def _seen(code: Code, network: Network, plasticity: Plasticity, depth: int, lost: IntArray) -> dict[str, str]:
    """Arrays for pre, sent, post and the signals; only what the rule reads is gathered. What was sent before the steps
    ``lost`` never arrives."""
    read, members = plasticity.rule.definition.read, plasticity.members
    connections, n = network.connections, len(network.neurons)
    sources, targets = connections.sources[members], connections.targets[members]
    made: dict[str, Callable[[], str]] = {
        "sent": lambda: code.select("activity", sources, n, broadcast=True),
        "post": lambda: code.select("activity", targets, n, broadcast=True),
        "pre": lambda: _arrived(code, sources, connections.delays[members], n, depth, lost),
    }
    seen = {name: code.let("a", make()) for name, make in made.items() if name in read}
    for signal, indices in plasticity.signals.items():
        if signal in read:
            seen[signal] = code.let("a", _signal(code, indices, n, network.vector_size))
    return seen


def _arrived(code: Code, sources: IntArray, delays: IntArray, n: int, depth: int, lost: IntArray) -> str:
    """a_j[t−d] of each connection, 0 where what was sent then is lost."""
    pre = _pre(code, sources, delays, n, depth)
    if not (lost > NOTHING).any():
        return pre
    return f"np.where(k < {code.constant(lost + delays)}, 0.0, {pre})"


def _pre(code: Code, sources: IntArray, delays: IntArray, n: int, depth: int) -> str:
    """a_j[t−d] of each connection."""
    if not delays.any():
        return code.select("activity", sources, n, broadcast=True)
    first = int(delays[0])
    if (delays == first).all():
        return code.select(f"history[(k - {first}) % {depth}]", sources, n, broadcast=True)
    rows = f"(k - {code.constant(delays.copy())}) % {depth}"
    return f"history[{rows}, {code.constant(np.ascontiguousarray(sources, dtype=np.intp))}]"


def _signal(code: Code, indices: IntArray, n: int, inputs: int) -> str:
    """A signal of a rule: activities, inputs, or some of both."""
    if (indices < n).all():
        return code.select("activity", indices, n, broadcast=True)
    if (indices >= n).all():
        return code.select("s", indices - n, inputs, broadcast=True)
    return code.select("np.concatenate((activity, s))", indices, n + inputs)
