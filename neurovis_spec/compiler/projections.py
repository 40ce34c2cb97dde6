"""Projections: from what the connections of entries learn by, and bring their signals by, to what is computed together.

In: the entries with their rules and synapses in use, the populations. Out: Projections, rules before synapses, and
where each of them finds what it reads.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import Indices, IntArray, frozen
from neurovis_spec.compiler.connections.connect import Connected
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.connections.in_use import InUse, Piece
from neurovis_spec.compiler.connections.shared import receptor_and_feed
from neurovis_spec.compiler.connections.signals import Signal
from neurovis_spec.compiler.network import Outlet, outlets_of, taken_at
from neurovis_spec.compiler.program import FEED, RULE, SYNAPSE, Definition, EndName, Owner, Population, Projection, Use


class Projected(NamedTuple):
    """The projections; for each entry the number of that of the first rule of each of its connections, or −1; and of
    those of synapses the population of the targets."""

    projections: tuple[Projection, ...]
    rules: tuple[Indices, ...]
    targets: Mapping[int, int]


class _Alike(NamedTuple):
    """What the connections of a projection have in common: the definition, what of its names of the ends are
    parameters there; of a rule its place among theirs; of a synapse the population of the targets."""

    kind: str
    name: str
    parameters: tuple[str, ...]
    place: int
    population: int = -1
    at_once: bool = False

    @property
    def receptor(self) -> _Alike:
        """Of a feed what has in common that to which it adds."""
        return self._replace(kind=SYNAPSE.name, at_once=False)


class _Some(NamedTuple):
    """Connections of an entry that are members of one projection: their indices in the network, and which of the piece
    they are."""

    use: InUse
    piece: Piece
    members: IntArray
    inside: IntArray | slice

    def signal(self, name: str) -> Signal:
        """Where a signal of the rule comes from."""
        signal = self.use.signals[name]
        return signal if len(signal.places) == len(self.members) else signal.some(self.piece.places[self.inside])


def make_projections(made: Connected, populations: tuple[Population, ...]) -> Projected:
    """One Projection a rule, at a place among those of its connections, and one a synapse and population of targets,
    whichever entries they are of: what is computed alike is computed together. Rules come first."""
    found: dict[str, dict[_Alike, list[_Some]]] = {RULE.name: {}, SYNAPSE.name: {}, FEED.name: {}}
    population_of = np.zeros(sum(len(one.members) for one in populations), dtype=np.int64)
    for number, population in enumerate(populations):
        population_of[population.members] = number
    start = 0
    for bundle in made.bundles:
        for use in bundle.uses:
            for piece in use.pieces:
                for part in receptor_and_feed(piece) if piece.definition.shared else (piece,):
                    for key, inside in _alike(use, part, piece.definition, bundle, population_of):
                        some = _Some(use, part, start + part.places[inside], inside)
                        found[key.kind].setdefault(key, []).append(some)
        start += len(bundle.sources)
    alike = {**found[RULE.name], **found[SYNAPSE.name], **found[FEED.name]}
    outlets = outlets_of(populations, _asked(made.bundles))
    ends = _Ends(made, populations, outlets, len(population_of))
    numbers = {key: number for number, key in enumerate(alike)}
    projections = [_projection(number, *one, ends) for number, one in enumerate(alike.items())]
    for key, number in numbers.items():
        if key.kind == FEED.name:
            projections[number] = _feeding(projections, number, numbers[key.receptor], made)
    targets = {number: key.population for key, number in numbers.items() if key.population >= 0}
    return Projected(tuple(projections), tuple(_first_rules(made, projections)), targets)


def _feeding(projections: Sequence[Projection], number: int, feeds: int, made: Connected) -> Projection:
    """A feed with what it adds to: of which projection, and to which of its members."""
    one, receptor = projections[number], projections[feeds]
    slots = np.searchsorted(receptor.members, made.carriers[one.members])
    return replace(one, feeds=feeds, slots=frozen(slots))


def _alike(
    use: InUse, piece: Piece, whole: Definition, bundle: Bundle, population_of: IntArray
) -> Iterator[tuple[_Alike, IntArray | slice]]:
    """The connections of a piece by what projections they are members of; its definition is ``whole``, or a part of
    that. Of those with a receptor these alone that carry it."""
    definition = piece.definition
    read = {name.text for name in whole.end_names}
    names = definition.kind.name, definition.name, tuple(one for one in whole.parameters if one in read)
    if definition.kind == RULE:
        yield _Alike(*names, use.place), slice(None)
        return
    populations = population_of[bundle.targets[piece.places]]
    at_once = np.asarray(bundle.delays[piece.places] == 0) & definition.has("on_pre")
    for population in np.flatnonzero(np.bincount(populations)).tolist():
        for now in (False, True):
            inside = np.flatnonzero((populations == population) & (at_once == now))
            if whole.shared and definition.kind == SYNAPSE and bundle.carriers is not None:
                inside = inside[bundle.carriers[piece.places[inside]] == piece.places[inside]]
            if len(inside):
                yield _Alike(*names, use.place, population, now), inside


def _asked(bundles: Sequence[Bundle]) -> set[str]:
    """The names of what is taken of neurons beside their activities."""
    uses = [use for one in bundles for use in one.uses]
    read = {name.name for use in uses for piece in use.pieces for name in piece.read}
    signals = {name for use in uses for signal in use.signals.values() for name in signal.states}
    return read.union(signals, (one.route.sends for one in bundles))


def _first_rules(made: Connected, projections: Sequence[Projection]) -> Iterator[Indices]:
    """For each entry the projection of the first rule of each of its connections, −1 without."""
    firsts = [(number, one) for number, one in enumerate(projections) if one.kind == RULE and one.place == 0]
    start = 0
    for bundle in made.bundles:
        size = len(bundle.sources)
        inside = [slice(*np.searchsorted(one.members, (start, start + size)).tolist()) for _, one in firsts]
        numbers = [number for (number, _), some in zip(firsts, inside, strict=True) if some.start < some.stop]
        if len(numbers) < 2:
            yield np.broadcast_to(np.int64(numbers[0] if numbers else -1), (size,))
        else:
            found = np.empty(size, dtype=np.int64)
            for (number, one), some in zip(firsts, inside, strict=True):
                found[one.members[some] - start] = number
            yield found
        start += size


class _Ends(NamedTuple):
    """What can be read of the ends of connections."""

    made: Connected
    populations: tuple[Population, ...]
    outlets: tuple[Outlet, ...]
    neurons: int

    def read(self, name: EndName, members: IntArray) -> IntArray:
        """Where what has this name stands at the ends of some connections, among activities and outlets."""
        ends = self.made.sources if name.side == "pre" else self.made.targets
        return np.asarray(taken_at(self.populations, self.outlets, self.neurons, name.name)[ends.some(members)])

    def signal(self, signal: Signal) -> IntArray:
        """Where a signal of some connections stands, among activities, outlets and inputs."""
        places, count = signal.places, sum(len(self.populations[one.population].members) for one in self.outlets)
        result = places + np.where(places < self.neurons, 0, count)
        for name, own in signal.states.items():
            result[own] = taken_at(self.populations, self.outlets, self.neurons, name)[places[own]]
        return result


def _projection(number: int, key: _Alike, some: list[_Some], ends: _Ends) -> Projection:
    """The connections that have one rule or synapse in common."""
    first = some[0]
    definition = first.piece.definition
    members = frozen(np.concatenate([one.members for one in some]))
    parameters = {
        name: frozen(np.concatenate([one.piece.parameters[name][one.inside] for one in some]))
        for name in definition.parameters
    }
    signals = {
        name: frozen(np.concatenate([ends.signal(one.signal(name)) for one in some])) for name in first.use.signals
    }
    names = frozenset(name for one in some for signal in one.use.signals.values() for name in signal.states)
    read = {name.text: frozen(ends.read(name, members)) for name in first.piece.read}
    use = Use(Owner(definition.kind.name, number), definition, parameters)
    return Projection(members, (use,), signals, read, key.place, names, at_once=key.at_once)
