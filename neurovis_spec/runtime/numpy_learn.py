"""NumPy code for plasticity: w[t+1] and the states of a rule, for all connections that share it.

In: a Plasticity. Out: lines in a ``Code``. New values are all computed before the first old one is replaced.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Plasticity
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.runtime.numpy_blocks import emit_let
from neurovis_spec.runtime.numpy_code import Code
from neurovis_spec.runtime.presynaptic import rule_names
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
    rule = plasticity.rule
    known = code.parameters(f"rule/{number}", plasticity.parameters, some) | _seen(
        code, network, plasticity, depth, structure.lost[plasticity.members]
    )
    place = "" if some is None else f"[{code.constant(some)}]"
    traces = {q.name: code.let("v", f"traces[{number}][{i}]{place}") for i, q in enumerate(rule.state)}
    stored = {q.name: f"traces[{number}][{i}]{place}" if place else "" for i, q in enumerate(rule.state)}
    weight = _weight(code, network, plasticity)
    steps = {q.name: q.each_step for q in rule.state} | {"weight": rule.each_step}
    ends = {q.name: q.each_episode for q in rule.state} | {"weight": rule.each_episode}
    _change(code, network, plasticity, known | traces | {"weight": weight}, steps, stored)
    if network.episode is not None and any(tree is not None for tree in ends.values()):
        code.line(f"if (k + 1) % {network.episode} == 0:")
        code.indent += 1
        weight = _weight(code, network, plasticity)
        if place:  # copies, which the step has not changed
            traces = {name: code.let("v", stored[name]) for name in traces}
        _change(code, network, plasticity, known | traces | {"weight": weight}, ends, stored)
        code.indent -= 1


def _weight(code: Code, network: Network, plasticity: Plasticity) -> str:
    return code.let("w", code.select("weights", plasticity.members, len(network.connections)))


def _change(
    code: Code,
    network: Network,
    plasticity: Plasticity,
    known: dict[str, str],
    trees: dict[str, Tree | None],
    stored: dict[str, str],
) -> None:
    """All right-hand sides, then all changes, the weight within its bounds. ``stored``: where states are kept, if what
    is known of them is a copy."""
    values = emit_let(code, plasticity.rule.let, known, list(trees.values()))
    new = {name: code.fresh("n", tree, values) for name, tree in trees.items() if tree is not None}
    for name, value in new.items():
        if name != "weight":
            code.line(f"{stored[name] or known[name] + '[:]'} = {value}")
    if "weight" in new:
        place = code.position(plasticity.members, len(network.connections))
        code.line(f"weights{place} = {_bounded(code, network, plasticity, new['weight'])}")


def _bounded(code: Code, network: Network, plasticity: Plasticity, weight: str) -> str:
    members = plasticity.members
    for function, array, values in (
        ("maximum", "low", network.connections.low.whole()),
        ("minimum", "high", network.connections.high.whole()),
    ):
        if code.is_set(array) or np.isfinite(values[members]).any():
            weight = f"np.{function}({weight}, {code.numbers(array, values, members, share=False)})"
    return weight


def _seen(code: Code, network: Network, plasticity: Plasticity, depth: int, lost: IntArray) -> dict[str, str]:
    """Arrays for pre, sent, post and the signals; only what the rule reads is gathered. What was sent before the steps
    ``lost`` never arrives."""
    read, members = rule_names(plasticity.rule), plasticity.members
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
