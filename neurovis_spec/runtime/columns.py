"""Columns: what of each step is kept, which are activities, changing weights, states of models and rules and what
inputs are given, and whose spikes are.

In: a Network, and what is wanted of it (Keep). Out: Columns: the indices to take, and a Probe that reads states; a
Recording of the rows that were kept.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Protocol

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray, subscript
from neurovis_spec.body import Skeleton
from neurovis_spec.compiler.names.state_references import StateOf, singles
from neurovis_spec.compiler.network import Located, Network
from neurovis_spec.compiler.program import SPIKE, SYNAPSE, Definition, Each, Owner
from neurovis_spec.runtime.names import Names, names_of
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.references import find_connections, find_neurons, find_recorded
from neurovis_spec.runtime.rows import After, Rows, Widths
from neurovis_spec.runtime.spikes import Fired
from neurovis_spec.runtime.state import State


class Sensing(Protocol):
    """What is recorded of a body: the names of what it senses, and how its pose is drawn."""

    sensor_names: tuple[str, ...]
    skeleton: Skeleton | None


@dataclass(frozen=True)
class Keep:
    """What is recorded."""

    #: references to neurons; all where there are none
    neurons: tuple[str, ...] = ()
    #: whether the changing weights are, and if so of which references to connections; of all where there are none
    weights: bool = True
    connections: tuple[str, ...] = ()
    #: references to states, besides those that the outputs of the spec name and its pictures show, and to what inputs
    #: are given
    states: tuple[str, ...] = ()
    #: the spec itself as one text, where a format holds it
    spec: str = ""
    #: of the steps that would be recorded the last alone
    last: bool = False
    #: whether what a picture of the connections needs beside (``Network.sent``) is, where all else that it needs is
    sent: bool = True


#: Everything but states that nobody asks for.
ALL = Keep()


@dataclass(frozen=True, slots=True, eq=False)
class _Read:
    """What a probe reads at once: a state of an owner, of ``members`` (places in its population or projection), each
    into its one of ``columns``."""

    owner: Owner
    state: str
    members: IntArray
    columns: IntArray


def _none() -> IntArray:
    return np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Probe:
    """Reads states, each into its column, and signals of synapses, which are no states: whoever reads these has to form
    them (``runtime/formed.py``)."""

    names: tuple[str, ...]
    reads: tuple[_Read, ...]
    #: the connections whose signals it reads, and the columns of these
    joined: IntArray = field(default_factory=_none)
    signals: IntArray = field(default_factory=_none)

    @property
    def forms(self) -> bool:
        """Whether it reads signals."""
        return len(self.joined) > 0

    def read(self, state: State, row: FloatArray, signals: FloatArray | None = None) -> None:
        """The states as they are now, (columns,), and of the ``signals`` of all connections (m,) those that are asked
        for, NaN where they are not known."""
        for read in self.reads:
            row[read.columns] = state.cells[read.owner][read.state][read.members]
        if self.forms:
            row[self.signals] = np.nan if signals is None else signals[self.joined]

    def addresses(self, state: State, signals: FloatArray | None = None) -> IntArray:
        """Where in memory each number lies (columns,), as long as the arrays of a state are the same ones; that of a
        signal lies in ``signals``, of all connections (m,), which whoever reads it has to form."""
        found = np.empty(len(self.names), np.int64)
        for read in self.reads:
            array = state.cells[read.owner][read.state]
            found[read.columns] = array.ctypes.data + array.strides[0] * read.members
        if self.forms:
            assert signals is not None
            found[self.signals] = signals.ctypes.data + signals.strides[0] * self.joined
        return found

    def beside(self, other: Probe) -> Probe:
        """A probe of its own columns, and behind them those of another one, which reads no signals."""
        behind = (replace(read, columns=read.columns + len(self.names)) for read in other.reads)
        return replace(self, names=(*self.names, *other.names), reads=(*self.reads, *behind))

    def now(self, state: State, signals: FloatArray | None = None) -> FloatArray:
        """What ``read`` gives as an array of its own."""
        row = np.empty(len(self.names))
        self.read(state, row, signals)
        return row


@dataclass(frozen=True, eq=False)
class Spiking:
    """Which neurons of a network spike, and what tells it after a step: of some the activity, of those whose activity
    is something else the state that ``probe`` reads; both ascending. A spike is what a model with a ``spike`` block
    fires, or, of a model that says ``spikes: true``, an activity that is not 0."""

    by_activity: IntArray
    by_state: IntArray
    probe: Probe

    def __bool__(self) -> bool:
        """Whether any do."""
        return len(self.by_activity) + len(self.by_state) > 0

    @cached_property
    def neurons(self) -> IntArray:
        """All that do, ascending."""
        return np.union1d(self.by_activity, self.by_state)

    @cached_property
    def activities(self) -> slice | IntArray:
        """Where those of ``by_activity`` stand among all activities."""
        found = subscript(self.by_activity)
        return slice(0) if found is None else found

    @property
    def together(self) -> range | None:
        """All that do, where they lie side by side and their activities say it; else None."""
        found = self.activities
        return range(found.start, found.stop) if isinstance(found, slice) and not len(self.by_state) else None

    def now(self, state: State) -> IntArray:
        """Those that have fired in the last step, ascending."""
        fired = self.by_activity[_fire(state.activity[self.activities])]
        if not len(self.by_state):
            return fired
        active = (self.probe.now(state) != 0) & ~state.conditions.lesioned_neurons[self.by_state]
        return np.sort(np.concatenate([fired, self.by_state[active]]))

    def of_rows(self, first: int, activity: FloatArray, spikes: FloatArray, lesioned: npt.NDArray[np.bool_]) -> Fired:
        """Those that have fired in some steps from ``first`` on: by the activities (steps, len(by_activity)), by
        what the probe reads (steps, len(by_state)), but for neurons that were ``lesioned`` (n,) meanwhile."""
        steps, places = np.divmod(np.flatnonzero(activity != 0), max(1, activity.shape[1]))
        known = ~np.isnan(activity[steps, places])
        steps, neurons = steps[known], self.by_activity[places[known]]
        if len(self.by_state):
            more, places = np.nonzero((spikes != 0) & ~lesioned[self.by_state])
            steps, neurons = np.concatenate([steps, more]), np.concatenate([neurons, self.by_state[places]])
            order = np.lexsort((neurons, steps))
            steps, neurons = steps[order], neurons[order]
        return Fired(steps + first, neurons, first, first + len(activity))


def _fire(activity: FloatArray) -> npt.NDArray[np.bool_]:
    """Which activities are a spike; what is no number is none."""
    result: npt.NDArray[np.bool_] = (activity != 0) & (activity == activity)
    return result


@dataclass(frozen=True, eq=False)
class Columns:
    """What is recorded of a network."""

    #: indices of neurons, None for all of them
    neurons: IntArray | None
    #: indices of connections
    weights: IntArray
    #: what reads the states
    probe: Probe
    #: for each output that is states, their columns, and whether a single one is meant
    outputs: dict[str, tuple[tuple[int, ...], bool]]
    #: whose spikes are, at every step; None where that is not known
    spiking: Spiking | None = None
    spec: str = ""
    #: the names of what the body senses, and how its pose is drawn; None where there is none
    sensors: tuple[str, ...] | None = None
    skeleton: Skeleton | None = None
    #: places in the vector of all inputs: what is given there stands behind the states, and is called as these are
    given: IntArray = field(default_factory=_none)
    given_names: tuple[str, ...] = ()

    @property
    def state_names(self) -> tuple[str, ...]:
        """The names of states, and of what inputs are given."""
        return (*self.probe.names, *self.given_names)

    def widths(self, network: Network) -> Widths:
        """How many numbers of each kind a step has."""
        neurons = len(network.neurons) if self.neurons is None else len(self.neurons)
        pose = 0 if self.skeleton is None else self.skeleton.size
        return Widths(neurons, len(self.weights), len(self.state_names), len(self.sensors or ()), pose)


def columns_of(network: Network, keep: Keep = ALL, body: Sensing | None = None) -> Columns:
    """What is kept of a network, and of the body that it has in a run; states that its pictures show are, as those that
    its outputs name, and where all is there that a picture needs, those that connections send (Eq. 3). Raises KeyError
    with the nearest names."""
    names = names_of(network) if keep.neurons or keep.states or keep.connections else None
    weights = _weights(network, keep, names)
    states: dict[tuple[str, Each, int], None] = {}
    outputs: dict[str, tuple[tuple[int, ...], bool]] = {}
    for output in network.outputs:
        if output.states:
            of_output = list(singles(output.states))
            states.update(dict.fromkeys(of_output))
            outputs[output.name] = tuple(list(states).index(one) for one in of_output), output.scalar
    shown = (StateOf.of("neuron", one.state, one.indices) for one in network.render.show)
    states.update(dict.fromkeys(singles(shown)))
    if keep.sent and not keep.neurons and len(weights) == len(network.changing):
        of_connections = keep.weights  # which are as many as weights
        states.update(dict.fromkeys(singles(one for one in network.sent if of_connections or len(one.neurons))))
    places: dict[int, None] = {}
    for reference in keep.states:
        found, given = find_recorded(network, reference, names)
        states.update(dict.fromkeys(singles(found)))
        places.update(dict.fromkeys(given))
    neurons = _neurons(keep.neurons, names, len(network.neurons))
    return Columns(
        neurons=neurons,
        weights=weights,
        probe=_probe(network, list(states)),
        outputs=outputs,
        spiking=spiking_of(network, neurons),
        spec=keep.spec,
        sensors=None if body is None else body.sensor_names,
        skeleton=None if body is None else body.skeleton,
        given=np.array([*places], dtype=np.int64),
        given_names=tuple(network.given_names[place] for place in places),
    )


def _weights(network: Network, keep: Keep, names: Names | None) -> IntArray:
    """The connections whose weights are kept, ascending."""
    if not keep.weights:
        return network.changing[:0]
    if not keep.connections or names is None:
        return network.changing
    wanted = [find_connections(network, reference, names) for reference in keep.connections]
    return np.intersect1d(network.changing, np.concatenate(wanted))


def _neurons(references: Sequence[str], names: Names | None, count: int) -> IntArray | None:
    """The indices of these neurons, ascending; None for all ``count``."""
    if not references or names is None:
        return None
    indices = np.array(sorted(find_neurons(" + ".join(references), names)), dtype=np.int64)
    return None if len(indices) == count else indices


def spiking_of(network: Network, neurons: IntArray | None = None) -> Spiking:
    """Which neurons of a network spike, or of some of its neurons."""
    spikes, states = (np.zeros(len(network.neurons), np.bool_) for _ in range(2))
    for group in network.neurons.groups:
        spikes[group.start : group.start + group.count] = group.spikes
    for population in network.populations:
        states[population.members] = population.model.definition.fires
    if neurons is not None:
        others = np.delete(np.arange(len(network.neurons)), neurons)
        spikes[others] = states[others] = False
    by_state = np.flatnonzero(states & ~spikes)
    asked = [StateOf.of("neuron", SPIKE, by_state)] if len(by_state) else []
    return Spiking(np.flatnonzero(spikes), by_state, probe_of(network, asked))


def probe_of(network: Network, states: Iterable[StateOf]) -> Probe:
    """A probe of these states, in their order."""
    return _probe(network, list(singles(states)))


def named_signals(network: Network) -> list[str]:
    """The outputs of a spec that have signals of synapses among them."""
    named = [one for one in network.outputs if one.states] if len(network.joined) else []
    return [one.name for one in named if probe_of(network, one.states).forms]


def _probe(network: Network, wanted: list[tuple[str, Each, int]]) -> Probe:
    """A probe of single states: the name, what has it ("neuron", "connection"), and the index of that."""
    places: dict[tuple[Owner, str], tuple[list[int], list[int]]] = {}
    located: dict[tuple[str, Each], Located] = {}
    signals: dict[int, int] = {}
    synapses = network.synapses.numbers
    for column, (state, what, index) in enumerate(wanted):
        if (what, state) == (SYNAPSE.each, SYNAPSE.gives) and synapses[index] >= 0:
            signals[column] = index
            continue
        key = state, what
        if key not in located:
            located[key] = network.located(what, partial(_keeps, state))
        holders, numbers, positions = located[key]
        uses = holders[int(numbers[index])].uses
        owner = next(use.owner for use in uses if any(one.name == state for one in use.definition.kept))
        members, columns = places.setdefault((owner, state), ([], []))
        members.append(int(positions[index]))
        columns.append(column)
    reads = tuple(
        _Read(*key, np.array(members, dtype=np.int64), np.array(columns, dtype=np.int64))
        for key, (members, columns) in places.items()
    )
    names: list[str] = []
    for state, what, index in wanted:
        names += network.state_names([StateOf.of(what, state, np.array([index], dtype=np.int64))])
    joined, of = (np.array([*some], dtype=np.int64) for some in (signals.values(), signals))
    return Probe(tuple(names), reads, joined, of)


def _keeps(state: str, definition: Definition) -> bool:
    return any(one.name == state for one in definition.kept)


@dataclass(frozen=True, eq=False)
class Numbers:
    """The rows of a recording, and their steps."""

    step: IntArray
    rows: Rows
    #: the spikes of all steps; None where these were not noted
    fired: Fired | None = None


def recording_of(
    network: Network, columns: Columns, numbers: Numbers, all_weights: FloatArray, after: After, backend: str = ""
) -> Recording:
    """A recording with the structure of a network, made by a ``backend`` of this name; ``all_weights`` (m,) gives those
    that stay."""
    connections = network.connections
    names, rows, ranks = names_of(network), numbers.rows, _ranks(network)
    recording = Recording(
        activity=rows.activity,
        neurons=network.neurons.names,
        weights=rows.weights,
        weights_static=np.delete(all_weights, network.changing),
        plastic=network.changing.copy(),
        sources=connections.sources.whole(),
        targets=connections.targets.whole(),
        delays=connections.delays.whole(),
        dt=network.dt,
        step=numbers.step,
        ranks=ranks,
        weights_after=after.weights,
        reached=after.reached,
        set_parameters=after.set_parameters,
        lesioned_neurons=after.lesioned_neurons,
        lesioned_connections=after.lesioned_connections,
        views=names.views,
        network=network.name,
        hash=network.hash,
        counted=names.counted,
        named=names.named,
        states=rows.states,
        state_names=columns.state_names,
        state_views=columns.outputs,
        recorded=columns.neurons,
        recorded_weights=None if len(columns.weights) in (0, len(network.changing)) else columns.weights,
        spec=columns.spec,
        namespace=network.ros.namespace,
        by_name=network.ros.values,
        sensors=None if columns.sensors is None else rows.sensors,
        sensor_names=columns.sensors or (),
        pose=None if columns.skeleton is None else rows.pose,
        skeleton=columns.skeleton,
        backend=backend,
    )
    if numbers.fired is None or not columns.spiking:
        return recording
    return recording.with_fired(numbers.fired, columns.spiking.neurons)


def _ranks(network: Network) -> IntArray:
    """1 for each connection, 2, 3, … for the further ones that share both ends."""
    ranks = np.broadcast_to(np.int64(1), (len(network.connections),))
    if network.parallel:
        ranks = ranks.copy()
        ranks[[*network.parallel]] = [*network.parallel.values()]
    return ranks
