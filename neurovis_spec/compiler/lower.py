"""Lowering: from neurons and connections to populations and the update program.

In: the Census, the connections. Out: levels of neurons along delay-0 connections (one more than the highest of
those that reach it within the step) or a Cycle; Populations (neurons that are updated together), Projections
(connections that learn by one rule) and the program, an ordered list of operations.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import Indices, IntArray, IntColumn, frozen, narrow, sorting, starts_of, width
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.connections.plasticity import Learning
from neurovis_spec.compiler.neurons.groups import Built
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import (
    Gather,
    Learn,
    Operation,
    Owner,
    Population,
    Port,
    Projection,
    ReadInputs,
    Send,
    Update,
    Use,
)


def make_program(populations: tuple[Population, ...], projections: tuple[Projection, ...]) -> tuple[Operation, ...]:
    """What a step does, in order: inputs, neurons along delay 0, signals that leave, rules."""
    program: list[Operation] = [ReadInputs()]
    for population in range(len(populations)):
        program += [Gather(population), Update(population)]
    program.append(Send())
    program += [Learn(projection) for projection in range(len(projections))]
    return tuple(program)


class Cycle(NamedTuple):
    """Neurons that wait for each other: the first is named again at the end; ``connection`` closes the cycle."""

    neurons: tuple[int, ...]
    connection: int


def assign_levels(n: int, sources: IntColumn, targets: IntColumn, delays: IntColumn) -> IntArray | Cycle:
    """The level of each of n neurons, by Kahn's algorithm: one more than the highest of those that reach it without
    delay; a cycle of such connections where there is one."""
    result = np.zeros(n, dtype=np.int64)
    if not (delays.kept == 0).any():
        return result
    undelayed = np.flatnonzero(delays.compact() == 0)
    begins, ends = sources.some(undelayed), targets.some(undelayed)
    # the targets of each neuron: outgoing[starts[neuron] : starts[neuron + 1]]
    order = np.argsort(begins, kind="stable")
    outgoing = ends[order]
    starts = np.searchsorted(begins[order], np.arange(n + 1)).tolist()
    waiting = np.bincount(ends, minlength=n).tolist()
    ready = [neuron for neuron in range(n) if waiting[neuron] == 0]
    level = result.tolist()
    finished = 0
    while finished < len(ready):
        neuron = ready[finished]
        finished += 1
        for target in outgoing[starts[neuron] : starts[neuron + 1]].tolist():
            level[target] = max(level[target], level[neuron] + 1)
            waiting[target] -= 1
            if waiting[target] == 0:
                ready.append(target)
    if len(ready) == n:
        return np.array(level, dtype=np.int64)
    return _cycle(undelayed, begins, ends, waiting)


def _cycle(undelayed: IntArray, begins: Indices, ends: Indices, waiting: list[int]) -> Cycle:
    """Go backwards among the neurons that still wait until one comes up again: each of them has a source that waits,
    as there is a cycle. ``begins`` and ``ends`` are the sources and the targets of the ``undelayed`` connections."""
    connection_into: dict[int, int] = {}
    source_of: dict[int, int] = {}
    for connection, source, target in zip(undelayed.tolist(), begins.tolist(), ends.tolist(), strict=True):
        if waiting[source] and waiting[target] and target not in source_of:
            connection_into[target], source_of[target] = connection, source
    neuron = min(source_of)  # any of them; the same each time
    path: list[int] = []
    place_in_path: dict[int, int] = {}
    while neuron not in place_in_path:
        place_in_path[neuron] = len(path)
        path.append(neuron)
        neuron = source_of[neuron]
    ring = path[place_in_path[neuron] :]
    forward = (ring[0], *reversed(ring))
    return Cycle(forward, connection_into[ring[0]])


def make_populations(census: Census, targets: Indices, levels: IntArray) -> tuple[Population, ...]:
    """Neurons of the same level, activation, model and combination, in the order of the levels."""
    groups = census.groups
    kind_numbers: dict[tuple[str, ...], int] = {}
    kind_of_group = [
        kind_numbers.setdefault(
            (*(used.definition.name for used in built.kind), built.group.combine), len(kind_numbers)
        )
        for built in groups
    ]
    counts = [built.group.count for built in groups]
    group_of = np.repeat(np.arange(len(groups)), counts)
    population_of = _population_of(
        levels, np.repeat(np.array(kind_of_group, dtype=np.int64), counts), len(kind_numbers)
    )
    members_of = [members.astype(np.int64) for members in _split(population_of, int(population_of.max(initial=-1)) + 1)]
    population_of = narrow(population_of)
    place_in_population = np.zeros(len(population_of), dtype=width(0, len(population_of)))
    for members in members_of:
        place_in_population[members] = np.arange(len(members))
    populations = []
    for population, (members, incoming) in enumerate(
        zip(members_of, _split(population_of[targets], len(members_of)), strict=True)
    ):
        group_of_member = group_of[members]
        first = groups[group_of_member[0]]
        activation, model = (_use(population, members, group_of_member, groups, which) for which in (0, 1))
        drive = Port("drive", first.group.combine, frozen(incoming), frozen(place_in_population[targets[incoming]]))
        populations.append(Population(int(levels[members[0]]), frozen(members), activation, model, (drive,)))
    return tuple(populations)


def _population_of(levels: IntArray, kind_of: IntArray, kinds: int) -> Indices:
    """The number of each neuron's population, by levels, then by first neurons. ``kind_of`` is what else they have in
    common: the number of one of so many kinds."""
    _, first, population = np.unique(levels * kinds + kind_of, return_index=True, return_inverse=True)
    number = np.empty_like(first)
    number[np.lexsort((first, levels[first]))] = np.arange(len(first))
    return np.asarray(number[population], dtype=np.int64)


def _split(populations: Indices, count: int) -> list[Indices]:
    """The members of each population, ascending, in the least width. ``populations`` has the population of each."""
    kind = width(0, len(populations))
    if count == 1:
        return [np.arange(len(populations), dtype=kind)]
    starts, order = starts_of(populations, count), np.empty(len(populations), dtype=kind)
    for some, places in sorting(populations, starts):
        order[places] = np.arange(some.start, some.stop)
    return [order[start:end].copy() for start, end in pairwise(starts.tolist())]


def _use(population: int, members: IntArray, group_of: IntArray, groups: Sequence[Built], which: int) -> Use:
    """A definition in use at a population: the activation (``which`` is 0) or the model (1) of its groups, each of
    which has settings of its own. ``group_of`` says of each member which group it belongs to."""
    definition = groups[group_of[0]].kind[which].definition
    owner = Owner(definition.kind.name, population)
    if not definition.parameters:
        return Use(owner, definition, {})
    # members are ascending, and so are their groups: each run of equal groups takes the settings of one group
    starts = np.flatnonzero(np.diff(group_of, prepend=-1))
    ends = pairwise((*starts.tolist(), len(group_of)))
    parts = [
        (built.kind[which].parameters, members[start:end] - built.group.start)
        for built, (start, end) in zip((groups[place] for place in group_of[starts].tolist()), ends, strict=True)
    ]
    parameters = {
        name: frozen(np.concatenate([values[name][rows] for values, rows in parts])) for name in definition.parameters
    }
    return Use(owner, definition, parameters)


def make_projections(bundles: tuple[Bundle, ...]) -> tuple[tuple[Projection, ...], list[int]]:
    """One Projection a rule, whichever entries learn by it, and for each entry the index of its Projection, or −1: what
    is learned by the same rule is computed together."""
    number_of_rule: dict[str, int] = {}
    entries: list[list[tuple[Learning, IntArray]]] = []
    rules: list[int] = []
    start = 0
    for bundle in bundles:
        count, learning = len(bundle.sources), bundle.learning
        projection = -1
        if learning is not None:
            projection = number_of_rule.setdefault(learning.rule.name, len(entries))
            if projection == len(entries):
                entries.append([])
            entries[projection].append((learning, np.arange(start, start + count, dtype=np.int64)))
        rules.append(projection)
        start += count
    return tuple(_projection(projection, of_projection) for projection, of_projection in enumerate(entries)), rules


def _projection(projection: int, entries: list[tuple[Learning, IntArray]]) -> Projection:
    """The connections of several entries that learn by one rule; of each entry what it learns by, and the indices of
    its connections."""
    first = entries[0][0]
    members = np.concatenate([members for _, members in entries])
    parameters = {
        name: np.concatenate([learning.parameters[name] for learning, _ in entries]) for name in first.parameters
    }
    signals = {name: np.concatenate([learning.signals[name] for learning, _ in entries]) for name in first.signals}
    for array in (members, *parameters.values(), *signals.values()):
        frozen(array)
    return Projection(members, (Use(Owner(first.rule.kind.name, projection), first.rule, parameters),), signals)
