"""The operations of the program as NumPy code: what is gathered, updated, sent and learned.

In: a Network, and what a step leaves out of it. Out: lines in a ``Code``, operation by operation; one of a new type is
registered with ``emit``. Sums are made by ``bincount``, which adds in the order of the connections from 0.0 on, and
products by ``multiply.reduceat``, which multiplies from left to right: the order of the reference. New values are all
computed before the first old one is replaced. Two neurons K, one O, K1 -> O after two steps and a rule give

    u5 = c4 + s                                  # update K: c4 bias, s the inputs and noise of the step
    activity[0:2] = u5
    g7 = s0_                                     # gather O: g what arrives, s0_ = signals[0:2], a slice taken once
    u9 = bincount(c8, g7, 1)                     # u the drive; c8 the neuron in O of each connection
    activity[2:3] = np.minimum(np.maximum(u9, c10), c11)
    multiply(weights, activity[c13], s0_)        # send; c13 the sources
    history[k % 2] = activity
    a16 = history[(k - 1) % 2][0:1]              # learn: a what a rule reads, here pre
    n17 = w3_ + v1_*a16*a15 - c14*w3_            # v1_ a parameter that can be set
    weights[1:2] = np.minimum(np.maximum(n17, c18), c19)

Every identifier is new: its letter says what it is, its number sets it apart. c are constants of the namespace.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.events.settable import BIAS, CENTRES, HIGH, LOW
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import (
    Gather,
    Learn,
    Operation,
    Population,
    Projection,
    ReadInputs,
    Send,
    Update,
    Use,
)
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.runtime.numpy_code import Cell, Code, any_given, emit_change
from neurovis_spec.runtime.signals import SignalLayout
from neurovis_spec.runtime.state import NEVER_LOST, Structure

FIRST = "k == 0 and not state.continued"


@dataclass(frozen=True, slots=True)
class Step:
    """A step in the making."""

    code: Code
    #: without the connections that the structure leaves out
    network: Network
    structure: Structure
    #: where signals are under way
    layout: SignalLayout
    #: how many past activities are remembered
    depth: int
    #: the identifiers of the drives that were gathered, by populations
    drives: dict[int, str]


@singledispatch
def emit(operation: Operation, step: Step) -> None:
    """The code of an operation. Raises TypeError for one that is not registered."""
    raise TypeError(f"NumPy has no code for {type(operation).__name__}")


@emit.register
def _read(operation: ReadInputs, step: Step) -> None:
    """Nothing: ``s`` holds what the caller has read."""


@emit.register
def _gather(operation: Gather, step: Step) -> None:
    """u[t] of a population: what arrives, combined, + bias + input + noise."""
    code, network = step.code, step.network
    population = network.populations[operation.population]
    bias = network.neurons.bias[population.members]
    if len(population.drive.incoming):
        drive = code.let(
            "u", _combined(code, population, network, _signals(code, network, step.layout, operation.population))
        )
        # a sum that begins with 0.0 is never −0.0, so adding 0.0 changes nothing; a product may be
        if code.is_set(BIAS) or any_given(bias) or population.drive.combine == "product":
            drive = code.let("u", f"{drive} + {_bias(code, network, population)}")
    elif code.is_set(BIAS):
        drive = code.let(
            "u", f"{'1.0' if population.drive.combine == 'product' else '0.0'} + {_bias(code, network, population)}"
        )
    else:
        drive = code.constant((1.0 if population.drive.combine == "product" else 0.0) + bias)
    drive = _plus_step_values(code, network, network.neurons.input[population.members], drive)
    step.drives[operation.population] = _plus_step_values(code, network, network.noise_index[population.members], drive)


def _bias(code: Code, network: Network, population: Population) -> str:
    return code.numbers(BIAS, network.neurons.bias, population.members, share=False)


def _plus_step_values(code: Code, network: Network, index_in_s: IntArray, drive: str) -> str:
    """The drive and, for each member, the number of the step's vector that ``index_in_s`` points to (−1: none)."""
    fed_members = np.flatnonzero(index_in_s >= 0)
    if not len(fed_members):
        return drive
    values = code.select("s", index_in_s[fed_members], network.vector_size, broadcast=True)
    if len(fed_members) == len(index_in_s):
        return code.let("u", f"{drive} + {values}")
    drive = code.let("u", f"np.array({drive})")
    code.line(f"{drive}{code.position(fed_members, len(index_in_s))} += {values}")
    return drive


def _signals(code: Code, network: Network, layout: SignalLayout, population_index: int) -> str:
    """What arrives at a population, in the order of its connections: the values of each delay, put together."""
    connections, population = network.connections, network.populations[population_index]
    delays = connections.delays[population.drive.incoming]
    by_delay: dict[int, str] = {}
    undelayed = population.drive.incoming[delays == 0]
    if len(undelayed):
        weights = code.select("weights", undelayed, len(connections))
        by_delay[0] = f"{weights} * {code.select('activity', connections.sources[undelayed], len(network.neurons))}"
    for delay_class in layout.classes:
        inside = np.flatnonzero(delay_class.populations == population_index)  # they lie next to each other
        if len(inside):
            start, stop = (delay_class.start + delay_class.delay * int(i) for i in (inside[0], inside[-1] + 1))
            slots = _slots(code, start, stop, delay_class.delay)
            arriving = np.isin(delay_class.connections[inside], population.drive.incoming)
            if not arriving.any():  # a lesion: what is under way there never arrives
                continue
            if not arriving.all():
                slots = code.select(code.let("g", slots), np.flatnonzero(arriving), len(arriving))
            by_delay[delay_class.delay] = slots
    if len(by_delay) == 1:
        return code.let("g", next(iter(by_delay.values())))
    signals = code.let("g", f"np.empty({len(delays)})")
    for delay, values in by_delay.items():
        code.line(f"{signals}{code.position(np.flatnonzero(delays == delay), len(delays))} = {values}")
    return signals


def _slots(code: Code, start: int, stop: int, delay: int) -> str:
    """The slots of this step of connections that are stored next to each other: ``signals[4:8]`` with a delay of 1,
    else every ``delay``-th, ``signals[4 + r3:16:3]`` with r3 = k % 3."""
    if delay == 1:
        return code.view("signals", f"{start}:{stop}")
    return f"signals[{start} + {code.slot(delay)}:{stop}:{delay}]"


def _combined(code: Code, population: Population, network: Network, signals: str) -> str:
    """What arrives at each member as one number: sum, product, or distance to the centres."""
    count = len(population.members)
    if population.drive.combine == "product":
        return _product(code, population, signals)
    slots = code.constant(np.ascontiguousarray(population.drive.slots, dtype=np.intp))
    if population.drive.combine == "sum":
        return f"bincount({slots}, {signals}, {count})"
    centres = network.connections.centres[population.drive.incoming]
    if code.is_set(CENTRES) or any_given(centres):
        centre = code.numbers(CENTRES, network.connections.centres.whole(), population.drive.incoming, share=False)
        signals = code.let("g", f"{signals} - {centre}")
    return f"np.sqrt(bincount({slots}, {signals} * {signals}, {count}))"


def _product(code: Code, population: Population, signals: str) -> str:
    """The product of what arrives at each member, 1.0 where nothing does. ``reduceat`` multiplies what lies between two
    starts, so the signals are sorted by member, and members without any are left out."""
    order = np.argsort(population.drive.slots, kind="stable")  # equal ones keep the order of the connections
    filled, starts = np.unique(population.drive.slots[order], return_index=True)
    sorted_signals = code.select(signals, order, len(order))
    product = f"multiply.reduceat({sorted_signals}, {code.constant(starts.astype(np.intp))})"
    if len(filled) == len(population.members):
        return product
    whole = code.let("u", f"np.ones({len(population.members)})")
    code.line(f"{whole}{code.position(filled, len(population.members))} = {product}")
    return whole


@emit.register
def _update(operation: Update, step: Step) -> None:
    """The states of a population from old states and the drive; activities from the new ones; the episode's end. At
    step 0, neurons with ``initial`` take it, and their states stay."""
    code, network, number = step.code, step.network, operation.population
    population = network.populations[number]
    model, activation = population.model, population.activation
    initial = network.neurons.initial[population.members]
    mask = first = ""  # which members have an ``initial``, and what it is; "" where none has
    if not np.isnan(initial).all():
        mask, first = code.constant(~np.isnan(initial)), code.constant(initial.copy())

    def unless_first(value: str, at_first_step: str) -> str:
        """The value; at step 0, of members with ``initial``, the other one."""
        return f"np.where({mask}, {at_first_step}, {value}) if {FIRST} else {value}" if mask else value

    def cell(name: str) -> Cell:
        now = code.state(model, name)
        return Cell(now, f"{now}[:]", lambda value: unless_first(value, now))

    functions = {
        name: lambda argument, value=value: _activation_call(code, activation, value, argument)
        for name, value in activation.definition.functions.items()
    }
    seen = code.parameters(model) | {population.drive.name: step.drives[number]}
    cells = {one.name: cell(one.name) for one in model.definition.state}
    activity = emit_change(code, model.definition, seen, cells, network.episode, functions)["activity"]
    place = code.position(population.members, len(network.neurons))
    code.line(f"activity{place} = {unless_first(activity, first)}")
    code.line(f"if holds and holds[{number}]: activity[holds[{number}][0]] = holds[{number}][1]")


def _activation_call(code: Code, activation: Use, value: Tree, argument: str) -> str:
    """The value of a function of an activation; its argument gets an identifier, so that it is computed once."""
    x = argument if argument.isidentifier() else code.let("x", argument)
    return code.expression(value, code.parameters(activation) | {"x": x})


@emit.register
def _send(operation: Send, step: Step) -> None:
    """w[t]·a[t] of every delayed connection leaves its source; a[t] is remembered for ``pre``."""
    code, network = step.code, step.network
    connections = network.connections
    for delay_class in step.layout.classes:
        weights = code.select("weights", delay_class.connections, len(connections))
        sources = code.select("activity", connections.sources[delay_class.connections], len(network.neurons))
        code.line(
            f"multiply({weights}, {sources}, {_slots(code, delay_class.start, delay_class.stop, delay_class.delay)})"
        )
    if step.depth:
        code.line(f"history[k % {step.depth}] = activity")


@emit.register
def _learn(operation: Learn, step: Step) -> None:
    """The rule of a projection at a step and, where it has one, at an episode's end; not of connections that are
    ``still`` in this structure."""
    code, network = step.code, step.network
    projection, learning = network.projections[operation.projection], None  # None: all of its connections learn
    still = step.structure.still[projection.members]
    if still.any():
        learning = np.flatnonzero(~still)
        if not len(learning):
            return
        signals = {name: indices[learning] for name, indices in projection.signals.items()}
        projection = replace(projection, members=projection.members[learning], signals=signals)
    rule, place = projection.rule, "" if learning is None else f"[{code.constant(learning)}]"
    seen = code.parameters(rule, learning) | seen_at(step, projection)
    states = {one.name: code.state(rule, one.name) for one in rule.definition.state}
    cells = {name: Cell(f"{state}{place}", f"{state}{place or '[:]'}") for name, state in states.items()}
    count = len(network.connections)
    cells["weight"] = Cell(
        code.select("weights", projection.members, count),
        f"weights{code.position(projection.members, count)}",
        lambda weight: _bounded(code, network, projection, weight),
    )
    emit_change(code, rule.definition, seen, cells, network.episode)


def _bounded(code: Code, network: Network, projection: Projection, weight: str) -> str:
    members = projection.members
    for function, array, values in (
        ("maximum", LOW, network.connections.low.whole()),
        ("minimum", HIGH, network.connections.high.whole()),
    ):
        if code.is_set(array) or np.isfinite(values[members]).any():
            weight = f"np.{function}({weight}, {code.numbers(array, values, members, share=False)})"
    return weight


def seen_at(step: Step, projection: Projection) -> dict[str, str]:
    """Arrays for pre, sent, post and the signals; only what the definitions read is gathered."""
    code, network, depth = step.code, step.network, step.depth
    read, members = projection.read, projection.members
    connections, n = network.connections, len(network.neurons)
    sources, targets = connections.sources[members], connections.targets[members]
    emitters: dict[str, Callable[[], str]] = {
        "sent": lambda: code.select("activity", sources, n, broadcast=True),
        "post": lambda: code.select("activity", targets, n, broadcast=True),
        "pre": lambda: _pre_without_lost(
            code, sources, connections.delays[members], n, depth, step.structure.lost[members]
        ),
    }
    seen = {name: code.let("a", make()) for name, make in emitters.items() if name in read}
    for signal, indices in projection.signals.items():
        if signal in read:
            seen[signal] = code.let("a", _signal(code, indices, n, network.vector_size))
    return seen


def _pre_without_lost(code: Code, sources: IntArray, delays: IntArray, n: int, depth: int, lost: IntArray) -> str:
    """a_j[t−d] of each connection, 0 where what was sent then is lost."""
    pre = _pre(code, sources, delays, n, depth)
    if not (lost > NEVER_LOST).any():
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
    """A signal of a rule: activities, inputs, or some of both; an index of n or more is one of ``s``, behind n."""
    if (indices < n).all():
        return code.select("activity", indices, n, broadcast=True)
    if (indices >= n).all():
        return code.select("s", indices - n, inputs, broadcast=True)
    return code.select("np.concatenate((activity, s))", indices, n + inputs)
