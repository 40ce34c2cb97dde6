"""States of connections of which all copies at an end are the same, as traces of spikes are: how to keep them once.

In: a Network. Out: the same network with such states in projections of their own (Once), which have a member for each
source and delay, or for each target. What reads these states finds them there.

A trace that decays and jumps where its source fires is the same at all connections from there with the same delay: all
copies go through the same operations on the same numbers, from the same beginning. Whether they begin alike is for
whoever runs it to see, by their numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray, Indices, IntArray
from neurovis_spec.compiler.events.settable import Variable
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import (
    AT_SPIKE,
    RULE,
    Definition,
    Integrate,
    Key,
    Kind,
    Learn,
    Operation,
    Owner,
    Phase,
    Projection,
    Quantity,
    Receive,
    Use,
)
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.runtime.events import Rows, rows_of, weights_stay
from neurovis_spec.runtime.presynaptic import history_depth
from neurovis_spec.runtime.stages import ends_of, unfolded
from neurovis_spec.runtime.state import constants

#: What of a rule or a synapse is kept once: states alone.
ONCE: Final = Kind("once", "connection", "nothing")


class Kept(NamedTuple):
    """Where a state of connections is kept once: which state of which owner it is there; for each connection, by its
    position in its projection, of which member; and of each member the first connection. ``weights``: the connections
    whose weights have to be alike, too, where formulas read them."""

    owner: Owner
    number: int
    of: Indices
    first: IntArray
    weights: IntArray | None = None


@dataclass(frozen=True, eq=False)
class Once:
    """A ``network`` in which states of the ``whole`` are ``kept`` once, by whose they were; the projections that have
    them are behind the others."""

    whole: Network
    network: Network
    kept: Mapping[Key, Kept]

    @cached_property
    def variables(self) -> Mapping[Key, Variable]:
        """What can be set in a run, of their definitions, too."""
        known = self.whole.settable.variables
        added = {
            Key(kept.owner, name): known[Key(key.owner, name)]
            for key, kept in self.kept.items()
            for name in self.network.projections[kept.owner.number].use.parameters
            if Key(key.owner, name) in known
        }
        return {**known, **added}


def kept_once(network: Network) -> Once | None:
    """The network in which all states are kept once of which that can be known; None where there are none."""
    sides = [side for number in range(len(network.projections)) for side in _sides(network, number)]
    if not sides:
        return None
    projections, kept = list(network.projections), dict[Key, Kept]()
    for side in sides:
        owner, whole = Owner(ONCE.name, len(projections)), network.projections[side.number]
        projections[side.number] = _without(projections[side.number], side.names)
        projections.append(_alone(whole, owner, side))
        weights = whole.members if RULE.gives in projections[-1].read else None
        for number, name in enumerate(side.names):
            kept[Key(whole.use.owner, name)] = Kept(owner, number, side.of, side.first, None if number else weights)
    program = tuple(one for operation in network.program for one in _apart(operation, sides, projections))
    found = replace(network, projections=tuple(projections), program=program)
    return Once(network, found, kept) if history_depth(found) == history_depth(network) else None


class _Side(NamedTuple):
    """The states of a projection that spikes of one end alone change: their names, the first of all members that are
    alike, by its position, and for each member the number of that."""

    number: int
    end: str
    names: tuple[str, ...]
    first: IntArray
    of: Indices


def _sides(network: Network, number: int) -> Iterator[_Side]:
    """What of a projection can be kept once for each row of either end."""
    projection = network.projections[number]
    made, fixed = projection.use.definition, _fixed(network, projection)
    if any(one.each_episode is not None for one in made.lasting):
        return  # at an episode's end formulas read what the step has just made
    clock: Set[str] = {*constants(network.dt), "k", "t"}
    for phase in sorted(made.acts & AT_SPIKE.keys()):
        if not _alike(made, phase, clock | fixed.keys()):
            continue
        end, delays = ends_of(network, projection)[AT_SPIKE[phase]], network.connections.delays[projection.members]
        rows = rows_of(end.places, delays if end.past else np.zeros_like(delays))
        first, of = _members(rows)
        known = {name for name, values in fixed.items() if values is None or _same(values, values[first][of])}
        names = _alike(made, phase, clock | known)
        if names and len(first) < len(of):
            yield _Side(number, AT_SPIKE[phase], names, first, of)


def _members(rows: Rows) -> tuple[IntArray, Indices]:
    """The first member of each row, and for each member its row."""
    of = np.empty(len(rows.order), dtype=np.int32)
    of[rows.order] = np.repeat(np.arange(len(rows.ends), dtype=np.int32), np.diff(rows.starts))
    return np.asarray(rows.order[rows.starts[:-1]], dtype=np.int64), of


def _fixed(network: Network, projection: Projection) -> Mapping[str, FloatArray | None]:
    """What formulas of a projection read that no step changes, and that is the same for all (None) or has these values:
    parameters but those that can be set each for itself, and weights that stay."""
    found = dict[str, FloatArray | None]()
    for name, values in projection.use.parameters.items():
        variable = network.settable.variables.get(Key(projection.use.owner, name))
        if variable is None or variable.size == 1:
            found[name] = values if variable is None else None
    if RULE.gives in projection.read and weights_stay(network)[projection.members].all():
        found[RULE.gives] = network.connections.weights[projection.members]
    return found


def _same(one: FloatArray, other: FloatArray) -> bool:
    """Whether numbers are the same, by their bits: 0.0 and −0.0 are two."""
    return np.array_equal(one.view(np.int64), other.view(np.int64))


def _alike(made: Definition, phase: Phase, known: Set[str]) -> tuple[str, ...]:
    """The states that are the same at all members of a row, where they begin so and what is ``known`` is, and change at
    each step, with those that these read."""
    read = {one.name: _read(made, one) for one in made.state if one.noise is None}
    acts = {one.name: {act for act, _ in one.acts} for one in made.state}
    alike = _closed({name for name in read if acts[name] <= {phase}}, read, known)
    # what no spike changes, neither itself nor by what it reads, belongs to neither side
    reached = {name for name in alike if phase in acts[name]}
    while more := {name for name in alike - reached if not reached.isdisjoint(read[name])}:
        reached |= more
    reached = _closed(reached, read, known)
    moving = {one.name for one in made.state if one.derivative is not None or one.each_step is not None} & reached
    while more := {name for name in reached - moving if any(name in read[other] for other in moving)}:
        moving |= more
    return tuple(one.name for one in made.state if one.name in moving)


def _closed(states: set[str], read: Mapping[str, frozenset[str]], known: Set[str]) -> set[str]:
    """Those of some states that read each other and what is known alone."""
    while wrong := {name for name in states if not read[name] <= known | states}:
        states = states - wrong
    return states


def _read(made: Definition, state: Quantity) -> frozenset[str]:
    """What the formulas of a state read, its initial value among them."""
    trees: list[Tree | None] = [state.derivative, state.each_step, state.initial, *(tree for _, tree in state.acts)]
    found = unfolded(made.let, trees)
    return found.names - {name for name, _ in found.let}


def _still(one: Quantity) -> Quantity:
    """A state that stays as it is, for others to read."""
    return replace(one, each_step=None, each_episode=None, derivative=None, acts=())


def _without(projection: Projection, names: tuple[str, ...]) -> Projection:
    """A projection whose definition leaves some states as they are."""
    made = projection.use.definition
    state = tuple(_still(one) if one.name in names else one for one in made.state)
    return replace(projection, uses=(replace(projection.use, definition=replace(made, state=state)),))


def _alone(whole: Projection, owner: Owner, side: _Side) -> Projection:
    """A projection that has these states alone, of its members."""
    made = whole.use.definition
    state = tuple(one for one in made.state if one.name in side.names)
    made = replace(made, kind=ONCE, gives=(Quantity(ONCE.gives),), state=state, signals=())
    parameters = {name: values[side.first] for name, values in whole.use.parameters.items()}
    ends = {side.end: whole.ends[side.end][side.first]}
    return Projection(whole.members[side.first], (Use(owner, made, parameters),), {}, ends)


def _apart(operation: Operation, sides: list[_Side], projections: list[Projection]) -> Iterator[Operation]:
    """An operation of the whole, and behind it that of what is kept once: all read what was there before."""
    first = len(projections) - len(sides)  # what is kept once comes behind the others, side by side
    if isinstance(operation, Integrate):
        flowing = (number for number in range(first, len(projections)) if projections[number].use.definition.flows)
        yield replace(operation, projections=(*operation.projections, *flowing))
        return
    if not isinstance(operation, Learn | Receive) or all(side.number != operation.projection for side in sides):
        yield operation
        return
    own = (first + place for place, side in enumerate(sides) if side.number == operation.projection)
    for number in (operation.projection, *own):
        made = projections[number].use.definition.during(operation.phases)
        if any(tree is not None for tree in made.steps.values()):
            yield replace(operation, projection=number)
