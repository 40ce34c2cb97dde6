"""The operations of the program as NumPy code: what is gathered, updated, sent and learned.

In: a Network, and what a step leaves out of it. Out: lines in a ``Code``, operation by operation; one of a new type is
registered with ``emit``. New values are all computed before the first old one is replaced. Two neurons K, one O,
K1 -> O after two steps and a rule give

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

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import singledispatch

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.events.settable import HIGH, LOW
from neurovis_spec.compiler.flows import ports_read_by
from neurovis_spec.compiler.network import Network, Outlet
from neurovis_spec.compiler.program import (
    MODEL,
    Advance,
    Definition,
    Diffuse,
    Gather,
    Integrate,
    Key,
    Learn,
    Operation,
    Projection,
    ReadInputs,
    Receive,
    Send,
    SendAhead,
    Softmax,
    Tie,
    Update,
    Use,
)
from neurovis_spec.compiler.values.shared import added_by
from neurovis_spec.runtime.numpy_arrivals import (
    Step,
    Working,
    brought_now,
    ends_at,
    gathered,
    seen_before_update,
    sent_at,
    sent_by,
    slots_at,
    slots_of,
)
from neurovis_spec.runtime.numpy_code import FIRST, Cell, Code, emit_change
from neurovis_spec.runtime.numpy_events import come_to_some, seen_by
from neurovis_spec.runtime.numpy_flows import diffuse, integrate
from neurovis_spec.runtime.numpy_lags import behind_lags
from neurovis_spec.runtime.signals import SharedSlots
from neurovis_spec.runtime.softmax import share
from neurovis_spec.runtime.stages import formulas_of, given, unfolded


@singledispatch
def emit(operation: Operation, step: Step) -> None:
    """The code of an operation. Raises TypeError for one that is not registered."""
    raise TypeError(f"NumPy has no code for {type(operation).__name__}")


@emit.register
def _read(operation: ReadInputs, step: Step) -> None:
    """Nothing: ``s`` holds what the caller has read."""


@emit.register
def _gather(operation: Gather, step: Step) -> None:
    """What is at each port of a population that its step reads; of spikes that act behind all of the step these
    alone."""
    population = step.network.populations[operation.population]
    read = ports_read_by(population.model.definition).once
    brought = brought_now if operation.now else gathered
    step.ports[operation.population] = {
        port.name: brought(step, operation.population, port) for port in population.ports if port.name in read
    }


@emit.register
def _advance(operation: Advance, step: Step) -> None:
    """The states of a population in a phase, from old values and what was gathered; not at the first step."""
    code, population = step.code, step.network.populations[operation.population]
    model = population.model
    definition = replace(model.definition.during([operation.phase]), gives=())
    code.line(f"if fixed: hold_cells(fixed, {code.constant((model.owner,))}, cells)")
    code.line(f"if not ({FIRST}):")
    code.indent += 1
    known = code.parameters(model) | step.ports[operation.population]
    count = len(population.members)
    cells = {one.name: _cell(code, model, one.name, count) for one in definition.state}
    emit_change(code, definition, known, cells, None, code.functions(population.activation))
    code.indent -= 1


def _cell(code: Code, use: Use, name: str, count: int, kept: Callable[[str], str] = str) -> Cell:
    """A state of all members of a population, and what is ``kept`` of a new value."""
    now, key = code.state(use, name), code.constant(Key(use.owner, name))
    return Cell(now, f"{now}[:]", kept, f"held_at(fixed, {key}, {{}}, {count})".format)


@emit.register
def _integrate(operation: Integrate, step: Step) -> None:
    integrate(operation, step)


@emit.register
def _diffuse(operation: Diffuse, step: Step) -> None:
    diffuse(operation, step)


@emit.register
def _receive(operation: Receive, step: Step) -> None:
    """The states of synapses."""
    code, (whole, some) = step.code, step.working(operation.projection)
    projection = whole.during(operation.phases)
    definition = projection.use.definition
    if projection.slots is None:
        definition = replace(definition, gives=())  # signals are formed at ports
    if not len(projection.members):
        return
    trees = (tree for one in definition.lasting for tree in (one.each_step, one.each_episode))
    read = unfolded(definition.let, trees).names
    if projection.when:
        with come_to_some(step, Working(projection, some), sent=False) as which:
            seen = seen_by(step, Working(projection, some), which, read)
            seen["weight"] = _weights_at(code, projection, which)
            cells = _cells_of(code, projection, some, which)
            if projection.slots is None:
                emit_change(code, definition, seen, cells, None)
            else:
                _add(step, projection, definition, seen, cells, which)
        return
    seen = code.parameters(projection.use, some) | seen_before_update(step, projection, read)
    cells = _cells_of(code, projection, some)
    emit_change(code, definition, seen, cells, step.network.episode)


def _add(
    step: Step,
    projection: Projection,
    definition: Definition,
    seen: Mapping[str, str],
    cells: Mapping[str, Cell],
    which: str,
) -> None:
    """What connections, code says which, add to states of a shared synapse, one after the other."""
    assert projection.slots is not None
    code, receptor = step.code, step.network.projections[projection.feeds].use
    slots = f"{code.constant(projection.slots.astype(np.intp))}[{which}]"
    added = {one.name: code.name("n") for one in definition.gives}
    alone = replace(definition, gives=tuple(replace(one, each_step=added_by(one)) for one in definition.gives))
    emit_change(code, alone, seen, {**cells, **{name: Cell(there, there) for name, there in added.items()}}, None)
    for name, there in added.items():
        code.line(f"np.add.at({code.state(receptor, name)}, {slots}, {there})")
    code.line(f"if fixed: hold_cells(fixed, {code.constant((receptor.owner,))}, cells)")


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
        return _cell(code, model, name, len(population.members), lambda value: unless_first(value, now))

    if model.definition.state:
        code.line(f"if fixed: hold_cells(fixed, {code.constant((model.owner,))}, cells)")
    seen = code.parameters(model) | step.ports[number]
    cells = {one.name: cell(one.name) for one in model.definition.kept}
    functions = code.functions(activation)
    given = emit_change(code, model.definition.at_update, seen, cells, network.episode, functions)
    place = code.position(population.members, len(network.neurons))
    code.line(f"activity{place} = {unless_first(given['activity'], first)}")
    code.line(f"if holds and holds[{number}]: activity[holds[{number}][0]] = holds[{number}][1]")
    _let_out(step, number)


def _let_out(step: Step, number: int) -> None:
    """What connections take of a population beside its activities."""
    for outlet in step.network.outlets:
        if outlet.population == number:
            _put_out(step, outlet, step.code.state(step.network.populations[number].model, outlet.name))


def _put_out(step: Step, outlet: Outlet, values: str) -> None:
    """These values are what connections take; 0 of neurons that are lesioned."""
    code, members = step.code, step.network.populations[outlet.population].members
    place = code.view("outlets", f"{outlet.start}:{outlet.start + len(members)}")
    code.line(f"{place}[:] = {values}")
    lesioned = f"state.conditions.lesioned_neurons[{code.constant(members)}]"
    code.line(f"if holds and holds[{outlet.population}]: {place}[{lesioned}] = 0.0")


@emit.register
def _send_ahead(operation: SendAhead, step: Step) -> None:
    """What connections take of a population, where flow states are all that it is made of."""
    code, network, number = step.code, step.network, operation.population
    population = network.populations[number]
    model = population.model
    code.line(f"if fixed: hold_cells(fixed, {code.constant((model.owner,))}, cells)")
    states = {one.name: code.state(model, one.name) for one in model.definition.state}
    functions = code.functions(population.activation)
    for name in operation.names:
        formulas = formulas_of(population, [(name, given(model.definition, name))])
        known = code.parameters(model) | states
        for one, tree in formulas.let:
            known[one] = code.fresh("m", tree, known, functions)
        ((_, tree),) = formulas.trees
        value = code.let("y", code.expression(tree, known, functions))
        if name == MODEL.gives:
            code.line(f"activity{code.position(population.members, len(network.neurons))} = {value}")
            code.line(f"if holds and holds[{number}]: activity[holds[{number}][0]] = holds[{number}][1]")
        for outlet in network.outlets:
            if (outlet.population, outlet.name) == (number, name):
                _put_out(step, outlet, value)


@emit.register
def _send(operation: Send, step: Step) -> None:
    """w[t]·a[t] of every delayed connection leaves its source, or a[t] where it is shared; a[t] is remembered for
    ``pre``."""
    code, network = step.code, step.network
    connections = network.connections
    if step.layout.many:
        _send_all(step)
    for slots in () if step.layout.many else step.layout.rings:
        there = slots_of(code, slots.start, slots.stop, slots.length)
        if isinstance(slots, SharedSlots):
            code.line(f"{there}[:] = {sent_at(step, slots.sent)}")
        else:
            weights = code.select("weights", slots.connections, len(connections))
            code.line(f"multiply({weights}, {sent_by(step, slots.connections)}, {there})")
    if late := [slots for slots in step.layout.rings if slots.length != slots.delay]:
        code.line(f"if {FIRST}:")  # with a continuous delay what comes before the first step is what is sent there
        for slots in late:
            rows = f"signals[{slots.start}:{slots.stop}].reshape(-1, {slots.length})"
            code.line(f"    {rows}[:] = signals[{slots.start}:{slots.stop}:{slots.length}, None]")
    if step.depth:
        sent = "np.concatenate((activity, outlets))" if network.outlets else "activity"
        code.line(f"history[k % {step.depth}] = {sent}")


def _send_all(step: Step) -> None:
    """What is sent leaves, whatever the delays."""
    code, layout = step.code, step.layout
    own = np.concatenate([np.zeros(0, dtype=np.int64), *(one.connections for one in layout.classes)])
    if len(own):
        slots = slots_at(code, layout.offsets[own], layout.lengths[own], np.zeros(len(own), dtype=np.int64))
        weights = code.select("weights", own, len(step.network.connections))
        code.line(f"{slots} = {weights} * {sent_by(step, own)}")
    if layout.shared:
        sent = np.concatenate([one.sent for one in layout.shared])
        firsts = np.concatenate([np.arange(one.start, one.stop, one.length) for one in layout.shared])
        lengths = np.repeat([one.length for one in layout.shared], [len(one.sent) for one in layout.shared])
        slots = slots_at(code, firsts, lengths, np.zeros(len(sent), dtype=np.int64))
        code.line(f"{slots} = {sent_at(step, sent)}")


@emit.register
def _learn(operation: Learn, step: Step) -> None:
    """The rule of a projection at a step and, where it has one, at an episode's end; not of connections that are
    ``still`` in this structure."""
    code, network = step.code, step.network
    whole, learning = step.working(operation.projection)
    projection = whole.during(operation.phases)
    if not len(projection.members):
        return
    rule = projection.rule
    if projection.when:
        _learn_of_spikes(step, Working(projection, learning))
        return
    seen = code.parameters(rule, learning) | seen_at(step, projection)
    cells = _cells_of(code, projection, learning)
    count = len(network.connections)
    if not rule.definition.moves_centre:
        cells["weight"] = Cell(
            code.select("weights", projection.members, count),
            f"weights{code.position(projection.members, count)}",
            lambda weight: _bounded(code, network, projection, weight),
        )
    emit_change(code, rule.definition, seen, cells, network.episode)


def _learn_of_spikes(step: Step, working: Working) -> None:
    """The rule of a projection at those of its connections to which a spike has come."""
    code, network, (projection, learning) = step.code, step.network, working
    definition = projection.rule.definition
    read = unfolded(definition.let, definition.steps.values()).names
    with come_to_some(step, working, sent=True) as which:
        seen, cells = seen_by(step, working, which, read), _cells_of(code, projection, learning, which)
        if not definition.moves_centre:
            weights = _weights_at(code, projection, which)
            cells["weight"] = Cell(weights, weights, lambda weight: _bounded(code, network, projection, weight, which))
        emit_change(code, definition, seen, cells, None)


def _weights_at(code: Code, projection: Projection, which: str) -> str:
    """The weights of those of the connections of a projection that code says."""
    return f"weights[{code.constant(projection.members.astype(np.intp))}[{which}]]"


def _cells_of(code: Code, projection: Projection, some: IntArray | None, which: str = "") -> dict[str, Cell]:
    """What is kept of a synapse or a rule at the connections of a projection, which are ``some`` of all or all; or at
    those of them that code says."""
    use, at = projection.use, which
    if some is not None:
        at = f"{code.constant(some)}[{which}]" if which else code.constant(some)
    count = f"len({which})" if which else f"{len(projection.members)}"

    def cell(name: str) -> Cell:
        now, key = code.state(use, name), code.constant(Key(use.owner, name))
        held = f"held_at(fixed, {key}, {{}}, {count}, {at or None})".format
        return Cell(f"{now}[{at}]" if at else now, f"{now}[{at or ':'}]", held=held)

    return {one.name: cell(one.name) for one in use.definition.kept}


def _bounded(code: Code, network: Network, projection: Projection, weight: str, which: str = "") -> str:
    """Weights within their bounds, of those of the connections that code says, else of all."""
    members = projection.members
    for function, array, values in (
        ("maximum", LOW, network.connections.low.whole()),
        ("minimum", HIGH, network.connections.high.whole()),
    ):
        if code.is_set(array) or np.isfinite(values[members]).any():
            bounds = code.numbers(array, values, members, share=False)
            if which:
                bounds = code.numbers_of(array, values, members, which)
            weight = f"np.{function}({weight}, {bounds})"
    return weight


def seen_at(step: Step, projection: Projection) -> dict[str, str]:
    """Arrays for pre, sent, post and the signals; only what the definitions read is gathered."""
    seen = behind_lags(step, projection)
    return seen | ends_at(step, projection, projection.read - seen.keys())


@emit.register
def _tie(operation: Tie, step: Step) -> None:
    """The weights of tied connections, behind the rules of those that they are of."""
    code, count = step.code, len(step.network.connections)
    taken = code.select("weights", operation.of, count)
    code.line(f"weights{code.position(operation.connections, count)} = {taken}")


@emit.register
def _softmax(operation: Softmax, step: Step) -> None:
    """The shares of groups in 1; at step 0, members with ``initial`` are that."""
    code, network, number = step.code, step.network, operation.population
    population = network.populations[number]
    members, initial = population.members, network.neurons.initial[population.members]
    assert population.shares is not None
    code.namespace["share"] = share
    free = code.let("q", f"np.ones({len(members)}, dtype=bool)")
    if not np.isnan(initial).all():
        code.line(f"if {FIRST}: {free}[{code.constant(np.flatnonzero(~np.isnan(initial)))}] = False")
    code.line(f"if holds and holds[{number}]: {free}[np.isin({code.constant(members)}, holds[{number}][0])] = False")
    place = code.position(members, len(network.neurons))
    code.line(f"activity{place} = share(activity{place}, {free}, {code.constant(population.shares)})")
