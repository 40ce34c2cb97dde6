"""The State: all that a run carries from step to step.

In: a Network. Out: a mutable bundle of arrays that every backend advances in place; so one backend can begin a
step in the state of another.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.events.changes import Held
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.neurons.initial_states import initial_states
from neurovis_spec.compiler.program import CENTRE, FEED, SYNAPSE, Definition, Key, Owner, Projection
from neurovis_spec.runtime.presynaptic import history_depth
from neurovis_spec.runtime.signals import signal_layout

#: the names of the arrays of states in saved files and exported C, which may not change, by the kinds of their owners
_KEPT_AS: Mapping[str, str] = {"model": "cells", "rule": "traces"}
Mask = npt.NDArray[np.bool_]
Cells: TypeAlias = Mapping[Owner, Mapping[str, FloatArray]]

#: what ``Structure.lost`` says where nothing is lost: a step before all others
NEVER_LOST: Final = -(1 << 62)


def kept_as(kind: str) -> str:
    """The name under which the states of all owners of a kind are kept; of a later kind by its own."""
    return _KEPT_AS.get(kind, kind)


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """Which connections a step leaves out. A backend that has made code for one structure makes it anew where that of a
    State is another object."""

    #: (m,) those that bring nothing, and whose synapse does nothing: those that are ``cut``; of those that carry the
    #: states of a shared synapse, to which others add, too, those alone whose target is lesioned
    gone: Mask
    #: (m,) those that are lesioned, or one of whose ends is
    cut: Mask
    #: (m,) the step from which each of them is cut
    since: IntArray
    #: (m,) those whose rule is not carried out
    still: Mask
    #: (m,) what a connection has sent before this step never arrives, so that its synapse and its rules read 0 as
    #: ``pre``; NEVER_LOST where nothing is lost, or nobody would read it: none of these, and signals of its own are 0
    lost: IntArray

    @property
    def whole(self) -> bool:
        """Whether no connection is left out or still."""
        return not (self.cut.any() or self.still.any())

    def idle(self, projection: Projection) -> Mask:
        """Which connections of a projection do nothing, so that their states stay: those that are gone, and of rules
        those that are still; of what adds to shared states those that are cut."""
        masks = {SYNAPSE: self.gone, FEED: self.cut}
        return np.asarray(masks.get(projection.kind, self.still)[projection.members])

    @property
    def has_lost(self) -> bool:
        """Whether anything that would be read of the past never arrives."""
        return bool((self.lost > NEVER_LOST).any())


#: what is held of a state of which nothing is
_NOTHING: Final = (np.zeros(0, dtype=np.int64), np.zeros(0))


@dataclass
class Conditions:
    """What holds for the step to come; n neurons, m connections. A *slot* is the index of a parameter in Settable."""

    #: the value of each slot
    parameters: FloatArray
    #: whether an event or a caller has set it
    was_set: Mask
    #: the numbers that formulas of parameters give, as ``Settable.variables`` lays them out
    variables: FloatArray
    #: the clamps that hold, and what they hold each neuron at
    held: Held
    #: (n,) lesioned themselves
    lesioned_neurons: Mask
    #: (m,) lesioned themselves, and not by an end of theirs
    lesioned_connections: Mask
    #: (m,) whose rules are stopped
    paused: Mask
    #: what the step leaves out, as follows from the three masks
    structure: Structure
    #: per population the neurons that are held, and at what (lesioned ones at 0); None for a population without any,
    #: and as a whole where nothing is held
    holds: tuple[tuple[IntArray, FloatArray] | None, ...] | None = None
    #: the states that are held, by owner and name: of which members (their positions, ascending), and at what; None
    #: where none is
    fixed: Mapping[Key, tuple[IntArray, FloatArray]] | None = None

    def copy(self) -> Conditions:
        """The same, of its own; what is replaced as a whole is shared."""
        return replace(
            self,
            parameters=self.parameters.copy(),
            was_set=self.was_set.copy(),
            variables=self.variables.copy(),
            held=self.held.copy(),
            lesioned_neurons=self.lesioned_neurons.copy(),
            lesioned_connections=self.lesioned_connections.copy(),
            paused=self.paused.copy(),
        )

    def fixed_in(self, owner: Owner, state: str) -> Mapping[int, float]:
        """What a state is held at, by the positions of the members of which it is."""
        positions, values = (self.fixed or {}).get(Key(owner, state), _NOTHING)
        return dict(zip(positions.tolist(), values.tolist(), strict=True))

    def held_at(self, neuron: int) -> float | None:
        """What a neuron is held at, None where it is not."""
        if self.lesioned_neurons[neuron]:
            return 0.0
        return float(self.held.value[neuron]) if self.held.order[neuron] >= 0 else None


def first_conditions(network: Network) -> Conditions:
    """Before anything has changed."""
    n, m = len(network.neurons), len(network.connections)
    settable = network.settable
    nothing = np.broadcast_to(np.False_, (m,))
    from_start, lost = (np.broadcast_to(np.int64(step), (m,)) for step in (0, NEVER_LOST))
    return Conditions(
        parameters=settable.parameters.copy(),
        was_set=np.zeros(len(settable.slots), dtype=np.bool_),
        variables=settable.initial.copy(),
        held=Held.none(network.held_as_spikes),
        lesioned_neurons=np.zeros(n, dtype=np.bool_),
        lesioned_connections=np.zeros(m, dtype=np.bool_),
        paused=np.zeros(m, dtype=np.bool_),
        structure=Structure(gone=nothing, cut=nothing, since=from_start, still=nothing, lost=lost),
    )


@dataclass(frozen=True, slots=True, eq=False)
class BodyState:
    """Where the body of a network is: in which ``episode``, whether the last step ended one, and what the body itself
    carries (``Body.state``); None at the beginning of the episode, where ``reset`` gives it."""

    episode: int
    ended_episode: bool
    carried: object | None


@dataclass(slots=True)
class State:
    """What a step reads and writes; n neurons, m connections.

    ``k`` is the step to compute next; ``activity`` (n,) is a[k−1], ``weights`` (m,) is w[k]; ``outlets`` are what
    connections take of the same step beside activities, as ``Network.outlets`` lays them out; ``signals`` as in
    ``signal_layout(network, own_signals)``; row t mod (depth) of ``history`` (depth, n + outlets) is what is sent at t,
    for ``pre``; ``cells[owner][name]`` is a state or an output of a definition in use, as long as its members, in the
    order of the network's ``uses``.
    ``conditions`` are what events and callers have changed. ``continued`` says that a[−1] is given, so that
    ``initial`` is not used at step 0; ``drawn`` is how many steps earlier runs had, after which random numbers go on.
    """

    k: int
    activity: FloatArray
    outlets: FloatArray
    weights: FloatArray
    signals: FloatArray
    history: FloatArray
    cells: Cells
    conditions: Conditions
    continued: bool = False
    drawn: int = 0
    #: the last step whose events have had their effect, −1 before any
    begun: int = -1
    #: the mark of the network
    network: str = ""
    #: the name of the backend that has made its steps, "" before any and where that is not known
    backend: str = ""
    #: the body as it is for step k; None before step 0, and where the network has none
    body: BodyState | None = None
    #: whether no connection shares what is under way with others
    own_signals: bool = False

    def copy(self) -> State:
        """A state of its own: no array is shared."""
        return replace(
            self,
            activity=self.activity.copy(),
            outlets=self.outlets.copy(),
            weights=self.weights.copy(),
            signals=self.signals.copy(),
            history=self.history.copy(),
            cells={owner: {name: array.copy() for name, array in own.items()} for owner, own in self.cells.items()},
            conditions=self.conditions.copy(),
        )

    def become(self, other: State) -> None:
        """Be what another state is; its arrays are shared."""
        for field in fields(self):
            setattr(self, field.name, getattr(other, field.name))


def initial_state(network: Network, own_signals: bool = False) -> State:
    """The state before step 0: nothing is under way, weights are w[0], states have their initials."""
    layout = signal_layout(network, own_signals)
    n = len(network.neurons)
    return State(
        k=0,
        activity=np.zeros(n),
        outlets=np.zeros(network.outlet_count),
        weights=np.array(network.connections.weights.whole(), dtype=np.float64),
        signals=np.zeros(layout.size),
        history=np.zeros((history_depth(network), n + network.outlet_count)),
        cells={
            use.owner: initial_states(use, holder.members, network.dt, _given(network, use.definition))
            for holder, use in network.uses
        },
        conditions=first_conditions(network),
        network=network.mark,
        own_signals=not layout.shared,
    )


def _given(network: Network, definition: Definition) -> Mapping[str, FloatArray]:
    """What the network says of what states of a definition begin with, for all neurons or connections."""
    if definition.moves_centre:
        return {CENTRE: network.connections.centres.whole()}
    return network.neurons.starts if definition.kind.each == "neuron" else {}


def signals_of_each(network: Network, state: State) -> FloatArray:
    """What is under way on each connection, as a state with ``own_signals`` has it."""
    if state.own_signals:
        return state.signals
    layout, own = signal_layout(network), signal_layout(network, own=True)
    lost, result = state.conditions.structure.lost, np.zeros(own.size)
    for each in own.classes:
        slots, members = np.arange(each.length), each.connections
        sent_at = state.k - each.length + (slots - state.k) % each.length
        first = np.where(layout.shares[members], lost[members], NEVER_LOST)
        if not state.continued and (each.length == each.delay or state.k == 0):
            first = np.maximum(first, 0)  # else what comes before the first step is what is sent there
        factors = np.where(layout.shares[members], state.weights[members], 1.0)
        with np.errstate(all="ignore"):
            signals = factors[:, None] * state.signals[layout.offsets[members][:, None] + slots]
        result[each.start : each.stop] = np.where(sent_at < first[:, None], 0.0, signals).ravel()
    return result


def have_own_signals(network: Network, state: State) -> None:
    """Have no connection share what is under way with others; it stays what it is."""
    state.signals, state.own_signals = signals_of_each(network, state), True


def by_kind(cells: Cells) -> dict[str, list[FloatArray]]:
    """All states one after the other, by the names under which those of a kind are kept."""
    result: dict[str, list[FloatArray]] = {kept: [] for kept in _KEPT_AS.values()}
    for owner, own in cells.items():
        if own:
            result.setdefault(kept_as(owner.kind), []).extend(own.values())
    return result


def constants(dt: float) -> dict[str, float]:
    """The constants that every expression may name."""
    return {"pi": math.pi, "e": math.e, "dt": dt}
