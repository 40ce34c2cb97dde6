"""Carrying over: a run goes on in a network that was edited, at the same step, with what was learned.

In: a state of the old network, what was turned in it, the new network. Out: a state of the new one at the same step.
What has the same name keeps its activity, what else it sends, its weight where it learns, the states of its model and
rule, and, with the same delay, the signals under way; what is new begins as at step 0. The same body goes on where it
was. Parameters, clamps and lesions are what the events of the new spec and what was turned by hand make of them by this
step.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.body import BodyError
from neurovis_spec.compiler.body_settings import BodySettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Projection
from neurovis_spec.live.futures import called
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import SourceError
from neurovis_spec.live.turns import Feed, Turned, feed, turn
from neurovis_spec.runtime.controls import lose
from neurovis_spec.runtime.signals import SignalLayout, signal_layout
from neurovis_spec.runtime.simulation import ParameterError, Simulation
from neurovis_spec.runtime.state import State, have_own_signals, signals_of_each


def carried(old: SimulatedSource, simulation: Simulation) -> SimulatedSource:
    """A source of the new network at the step of ``old``, or at step 0 where the two have no neuron in common. ``old``
    must not be used afterwards. Raises SourceError where the body cannot make a step; then, and whatever else is
    raised, ``old`` goes on."""
    try:
        return _carried(old, simulation)
    except Exception as error:
        old.stay()
        if isinstance(error, BodyError):
            raise SourceError(str(error)) from None
        raise


def _carried(old: SimulatedSource, simulation: Simulation) -> SimulatedSource:
    was, network, turned = old.network, simulation.network, old.turned
    past = old.past()
    source = _going_on(old, simulation, turned)
    source.number_behind(old)
    same = was.mark == network.mark and called(was) == called(network)
    source.futures = past if same else past.of_older_spec(was, network)
    return source


def _going_on(old: SimulatedSource, simulation: Simulation, turned: Sequence[Turned]) -> SimulatedSource:
    was, network = old.network, simulation.network
    if not set(was.neurons.names) & set(network.neurons.names):
        return SimulatedSource(simulation)
    origin = simulation.state()
    try:
        then = old.leave()
    except BodyError:  # a body that cannot be kept
        return SimulatedSource(simulation)
    done, fed = _replay(simulation, then.k, [entry for entry in turned if entry.step < then.k])
    state = simulation.state()
    _carry(was, then, network, state)
    _restore(simulation, was, then, state)
    source = SimulatedSource(simulation, state, done, fed, origin)
    for entry in (entry for entry in turned if entry.step >= then.k):
        with suppress(SourceError):  # of what is no longer there
            source.turn(entry.turn)
    return source


def _restore(simulation: Simulation, was: Network, old: State, state: State) -> None:
    """Go on from a state, with the body where it was, if it is the same one; else it begins anew."""
    new = simulation.network
    if was.body is not None and new.body is not None and old.body is not None and _kind(was.body) == _kind(new.body):
        fresh, state.body = state.body, old.body
        try:
            simulation.restore(state)
        except BodyError:  # its file was edited
            state.body = fresh
        else:
            return
    simulation.restore(state)


def _kind(body: BodySettings) -> tuple[object, ...]:
    """What makes a body the same one."""
    return body.kind, body.given, body.path, body.substeps


def _replay(
    simulation: Simulation, k: int, turned: Sequence[Turned]
) -> tuple[list[Turned], dict[str, tuple[float, ...]]]:
    """Change what events until step k change, and turn what was turned, in the order of their steps; gives what could
    be turned, and what is fed by hand."""
    fed = dict[str, tuple[float, ...]]()
    events = [(change.at, 0, None) for change in simulation.network.changes if change.at <= k]
    done = []
    for at, _, entry in sorted([*events, *((entry.step + 1, 1, entry) for entry in turned)], key=lambda item: item[:2]):
        state = simulation.state()
        state.k = at
        with suppress(ParameterError):  # the events of this step apply, but for those that do not go with what was set
            simulation.restore(state)
        if entry is None:
            continue
        try:
            if isinstance(entry.turn, Feed):
                fed = feed(simulation, fed, entry.turn)
            else:
                turn(simulation, entry.turn)
        except (ValueError, KeyError):  # of what is no longer there
            continue
        done.append(entry)
    return done, fed


def _carry(was: Network, old: State, network: Network, state: State) -> None:
    """Have ``state`` hold what ``old``, a state of ``was``, knows, and be at its step."""
    if state.k != old.k:
        state.k, state.begun = old.k, -1
    state.continued, state.drawn = old.continued, old.drawn
    neurons = _shared(was.neurons.names, network.neurons.names)
    connections = _shared(was.connection_names, network.connection_names)
    _carry_sent(old, state, _shared(_sent(was), _sent(network)))
    learn = was.connections.rules[connections[0]] >= 0
    learn &= network.connections.rules[connections[1]] >= 0
    state.weights[connections[1][learn]] = old.weights[connections[0][learn]]
    _carry_states(was, old, network, state, neurons, connections)
    _carry_signals(was, old, network, state, connections)


def _shared(old: Sequence[Hashable], new: Sequence[Hashable]) -> tuple[IntArray, IntArray]:
    """The places of the names that both have, in the one and in the other."""
    places = {name: index for index, name in enumerate(old)}
    pairs = [(places[name], index) for index, name in enumerate(new) if name in places]
    both = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return both[:, 0], both[:, 1]


def _sent(network: Network) -> list[tuple[str, str]]:
    """What is sent, in order: the activities of all neurons, and outlets, by the names of neurons and of outlets."""
    names = network.neurons.names
    members = ((network.populations[one.population].members.tolist(), one.name) for one in network.outlets)
    return [*((name, "") for name in names), *((names[neuron], name) for own, name in members for neuron in own)]


def _carry_sent(old: State, state: State, sent: tuple[IntArray, IntArray]) -> None:
    """What is sent as it is now, and as it was, for rules."""
    now = np.concatenate((state.activity, state.outlets))
    now[sent[1]] = np.concatenate((old.activity, old.outlets))[sent[0]]
    state.activity, state.outlets = now[: len(state.activity)], now[len(state.activity) :]
    depths = len(old.history), len(state.history)
    for ago in range(1, min(old.k, *depths) + 1):
        step = old.k - ago
        state.history[step % depths[1], sent[1]] = old.history[step % depths[0], sent[0]]


def _carry_states(
    was: Network,
    old: State,
    network: Network,
    state: State,
    neurons: tuple[IntArray, IntArray],
    connections: tuple[IntArray, IntArray],
) -> None:
    """States of models and rules, by their names."""
    shared = {"neuron": neurons, "connection": connections}
    sizes = {"neuron": len(was.neurons), "connection": len(was.connections)}
    found: dict[tuple[str, str], FloatArray] = {}
    for holder, use in was.uses:
        each = use.definition.kind.each
        for name, array in old.cells[use.owner].items():
            found.setdefault((each, name), np.full(sizes[each], np.nan))[holder.members] = array
    together = _together(was, old)
    sizes = {"neuron": len(network.neurons), "connection": len(network.connections)}
    for holder, use in network.uses:
        each = use.definition.kind.each
        for name, array in state.cells[use.owner].items():
            _gather(found.get((each, name)), holder.members, array, shared[each], sizes[each])
            if isinstance(holder, Projection) and use.owner.number in network.fed:
                _gather(together.get(name), holder.members, array, shared[each], sizes[each])


def _together(was: Network, old: State) -> dict[str, FloatArray]:
    """The states of shared synapses, at all connections that have them together: in an edited network another one may
    be the first."""
    found: dict[str, FloatArray] = {}
    for number, members in was.fed.items():
        for name, array in old.cells[was.projections[number].use.owner].items():
            values = found.setdefault(name, np.full(len(was.connections), np.nan))
            values[members] = array[was.synapses.positions[members]]
    return found


def _gather(
    values: FloatArray | None, members: IntArray, into: FloatArray, shared: tuple[IntArray, IntArray], count: int
) -> None:
    """Take what the old network knew of the members."""
    if values is None:
        return
    known = np.full(count, np.nan)
    known[shared[1]] = values[shared[0]]
    there = ~np.isnan(known[members])
    into[there] = known[members][there]


def _as_they_left(
    old: State, before: SignalLayout, state: State, after: SignalLayout, one: IntArray, other: IntArray
) -> bool:
    """Whether connections that share what is under way have shared it before, and have the weights that it left by."""
    rings = np.zeros(after.size, dtype=np.int64)  # of each place the one before
    rings[after.offsets[other]] = before.offsets[one]
    alike = before.shares[one] & (rings[after.offsets[other]] == before.offsets[one])
    return bool((alike & (old.weights[one] == state.weights[other])).all())


def _as_delayed(network: Network, connections: IntArray) -> FloatArray:
    """The delays of connections in steps: of continuous ones less than 0, as they are exactly."""
    delays = network.connections.delays[connections].astype(np.float64)
    lags = network.connections.lags
    return delays if lags is None else np.where(np.isnan(lags[connections]), delays, -lags[connections])


def _carry_signals(
    was: Network, old: State, network: Network, state: State, connections: tuple[IntArray, IntArray]
) -> None:
    before, after = signal_layout(was, old.own_signals), signal_layout(network, state.own_signals)
    joined = (before.offsets[connections[0]] < 0) != (after.offsets[connections[1]] < 0)
    same = (_as_delayed(was, connections[0]) == _as_delayed(network, connections[1])) & ~joined
    one, other = connections[0][same], connections[1][same]
    lengths = after.lengths[other].astype(np.int64)
    shares = after.shares[other]
    if not _as_they_left(old, before, state, after, one[shares], other[shares]):
        have_own_signals(network, state)
        after = signal_layout(network, own=True)
        shares = after.shares[other]
    own = (after.offsets[other] >= 0) & ~shares
    parts = [(shares, before.offsets, old.signals)]
    if own.any():
        parts.append((own, signal_layout(was, own=True).offsets, signals_of_each(was, old)))
    for which, offsets, signals in parts:
        for length in np.unique(lengths[which]).tolist():
            some, slots = which & (lengths == length), np.arange(length)
            there = signals[offsets[one[some]][:, None] + slots]
            state.signals[after.offsets[other[some]][:, None] + slots] = there
    structure, lost = state.conditions.structure, old.conditions.structure.lost[one[shares]]
    if (structure.lost[other[shares]] != lost).any():  # what is carried has lost what it had lost
        state.conditions.structure = replace(structure, lost=structure.lost.copy())
        state.conditions.structure.lost[other[shares]] = lost
    anew = np.ones(len(network.connections), dtype=np.bool_)
    anew[other] = False
    lose(network, state, np.flatnonzero(anew))
